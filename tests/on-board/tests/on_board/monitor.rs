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
        board.attend(awaited, || screen.text().contains(awaited) || screen.has_ended())?;
        let text = screen.text();
        assert!(text.contains(awaited) && text.contains("no fault"), "{awaited}: {text}");
        assert!(text.contains("  lost 0 (by the board 0)  damaged 0  late 0"), "{text}");
        screen.press(keys);
    }
    board.attend("the end", || screen.has_ended())?;
    assert_eq!(screen.end(), (0, String::new()));
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    Ok(())
}
