//! Torque mode: the image holds the true output torque as the same control code does without a board.

use bowden_link::message::Mode;
use bowden_on_board_tests::trial::{Trial, error_of, sine, torque_error};
use bowden_on_board_tests::{Outcome, image};

/// Sheath friction of the default bench, `2 F0 r2 mu K` of Eq. (15)-(17) \[N·m\]: the error of a joint that ignores it.
const FRICTION_NM: f64 = 2.0 * 30.0 * 0.015 * 0.12 * std::f64::consts::PI;

#[test]
fn the_output_torque_follows_a_sine_as_the_control_code_alone_does() -> Outcome {
    let trial = Trial::new(Mode::Torque, sine(0.3, 0.5), 4.0);
    let natively = error_of(&trial.natively()?, torque_error);
    let on_image = error_of(&trial.on_image(&image::firmware()?)?, torque_error);
    println!("natively {natively:.4?}, on the image {on_image:.4?} N·m");
    // Better than friction by far on either side, and alike: what differs is the timing of converters and encoders.
    assert!(natively.rms < 0.1 * FRICTION_NM, "{natively:?}");
    assert!((on_image.rms - natively.rms).abs() < 0.2 * natively.rms, "{on_image:?}, natively {natively:?}");
    assert!(on_image.largest < 1.3 * natively.largest, "{on_image:?}, natively {natively:?}");
    Ok(())
}
