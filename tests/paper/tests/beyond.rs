//! Tracking with the friction followed, on a motion of the sheaths that took part in no choice.

use bowden_paper::beyond::{SENSOR_SETS, STARTS, removal, uncompensated_percent};
use bowden_paper::error::ExperimentError;
use bowden_paper::tracking_methods::LOADS;

/// The part of the error that every set of sensors removes is at least what is wanted of its worst seed, and not more than
/// noise and a count of the encoders leave room for.
#[test]
fn each_set_of_sensors_removes_what_is_wanted_of_its_worst_seed() -> Result<(), ExperimentError> {
    let (load, seeds) = (&LOADS[0], [301]);
    let before = uncompensated_percent(load, &seeds)?;
    for (sensors, most_percent) in SENSOR_SETS.iter().zip([95.0, 95.0, 99.5]) {
        for start in &STARTS[..2] {
            let row = removal(sensors, load, start, &seeds, &before)?;
            let [_, worst] = sensors.goal_percent;
            let removed = row.removed_percent.least;
            assert!(
                (worst..most_percent).contains(&removed),
                "{}, {}: {removed} %",
                sensors.name,
                start.name
            );
        }
    }
    Ok(())
}
