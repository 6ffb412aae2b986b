//! Prints one run of each kind of the paper's experiments, natively and with the image on the emulated board.

use std::process::ExitCode;

use bowden_on_board_tests::paper::{torque_loop, tracking};
use bowden_on_board_tests::{Outcome, image};
use bowden_paper::torque_phases::letters;

fn main() -> ExitCode {
    match compared() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("on-board-paper: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn row(what: &str, paper: &str, natively: &str, on_image: &str) {
    println!("| {what} | {paper} | {natively} | {on_image} |");
}

fn compared() -> Outcome {
    let elf = image::firmware()?;
    row("experiment", "paper", "control code alone", "image on the emulated board");
    row("---", "---", "---", "---");
    let sides = torque_loop(&elf)?;
    let both = |what: &str, paper: &str, figure: &dyn Fn(&_) -> String| {
        row(what, paper, &figure(&sides.natively), &figure(&sides.on_image));
    };
    both(
        "Fig. 4, segments in the order passed",
        "A to H",
        &|all: &bowden_paper::torque_phases::TorqueLoop| letters(&all.samples, |sample| sample.recorded),
    );
    both("Fig. 4, width of the loop, N·m", "2·2 F0 r2 μK", &|all| format!("{:.4}", all.width_nm));
    both("Fig. 4, RMS of T_out (17) less T_out, N·m", "", &|all| format!("{:.4}", all.prediction_rms_nm));
    both("Fig. 4, time in the segment of (17)", "", &|all| format!("{:.1} %", 100.0 * all.agreement));
    for (method, sides) in tracking(&elf)? {
        let name = format!("section 5.2, 2.5 kg, {}", method.name);
        let paper = method.paper_percent.map_or(String::new(), |percent| format!("{percent} %"));
        let torque =
            |errors: &bowden_paper::tracking_error::TrackingErrors| format!("{:.2} %", errors.torque_percent);
        row(&format!("{name}: torque error"), &paper, &torque(&sides.natively), &torque(&sides.on_image));
        let angle = |errors: &bowden_paper::tracking_error::TrackingErrors| {
            format!("{:.2}", 1e3 * errors.angle_rms_rad)
        };
        row(
            &format!("{name}: RMS of the angle error, mrad"),
            "",
            &angle(&sides.natively),
            &angle(&sides.on_image),
        );
    }
    Ok(())
}
