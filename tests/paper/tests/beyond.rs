//! Tracking with the friction followed, on a motion of the sheaths that took part in no choice.

use bowden_paper::beyond::{SENSOR_SETS, STARTS, removal, uncompensated_percent};
use bowden_paper::error::ExperimentError;
use bowden_paper::tracking_methods::LOADS;

/// What each set of sensors removes of the error on one seed \[%\]: not less than its median over many seeds by more than four
/// points, and not more than noise and a count of the encoders leave room for.
const REMOVED_PERCENT: [[f64; 2]; 3] = [[82.0, 90.0], [90.0, 95.0], [95.0, 99.0]];

#[test]
fn each_set_of_sensors_removes_its_part_of_the_error() -> Result<(), ExperimentError> {
    let (load, seeds) = (&LOADS[0], [301]);
    let before = uncompensated_percent(load, &seeds)?;
    for (sensors, [least, most]) in SENSOR_SETS.iter().zip(REMOVED_PERCENT) {
        for start in &STARTS[..2] {
            let removed = removal(sensors, load, start, &seeds, &before)?.removed_percent.least;
            println!("{}, {}: {removed:.1} %", sensors.name, start.name);
            assert!((least..most).contains(&removed), "{}, {}: {removed} %", sensors.name, start.name);
        }
    }
    Ok(())
}
