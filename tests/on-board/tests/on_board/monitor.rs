//! `bowden monitor` of the emulated board, in a terminal.

use bowden_board::Board;
use bowden_on_board_tests::tool::{Plugged, tool};
use bowden_on_board_tests::{Outcome, image};

use crate::screen::Screen;

#[test]
fn the_joint_is_watched_armed_run_and_stopped_by_keys() -> Outcome {
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let mut command = std::process::Command::new(tool()?);
    command.args(board.arguments("monitor"));
    command.args(["--reference", "sine", "--amplitude", "0.2"]);
    let mut screen = Screen::start(&command, 100, 30);
    let steps = [
        ("nucleo-g474re", "a"),
        ("ready to move", "h"),
        ("at zero", "r"),
        ("run  ARMED", " "),
        ("stopped", "q"),
    ];
    for (awaited, keys) in steps {
        // A picture comes in pieces: one look has to find everything.
        let wanted = [awaited, "no fault", "  lost 0 (by the board 0)  damaged 0  late 0"];
        let mut text = String::new();
        let mut is_whole = false;
        let waited = board.attend(awaited, || {
            text = screen.text();
            is_whole = wanted.iter().all(|part| text.contains(part));
            is_whole || screen.has_ended()
        });
        assert!(is_whole, "{waited:?}: {wanted:?} are not all on the screen:\n{text}");
        screen.press(keys);
    }
    board.attend("the end", || screen.has_ended())?;
    assert_eq!(screen.end(), (0, String::new()));
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    Ok(())
}
