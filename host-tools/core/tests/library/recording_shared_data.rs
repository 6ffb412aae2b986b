//! Recordings of real benches, as they were published, load through a rig's column map.
//!
//! The files lie beside the workspace in `shared/data`; where they are absent the tests say so and pass.

use std::path::PathBuf;

use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_model::channel::Channel;

const SERVO: &str = r#"schema = "bowden-rig/1"
[motor]
supply_v = 7.4
resistance_ohm = 3
inductance_h = 0.0
torque_constant_nm_per_a = 0.01
gear_ratio = 100
rotor_inertia_kg_m2 = 1e-8
viscous_nm_s_per_rad = 0.01
[load]
mass_kg = 0.49
arm_m = 0.1
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.0
"#;

const TRANSMISSION: &str = r#"schema = "bowden-rig/1"
[pulleys]
input_radius_m = 0.005
output_radius_m = 0.005
[tendon]
length_m = 0.4
axial_stiffness_n = 20000
pretension_n = 5
"#;

/// Loads a file of a folder of `shared/data` through a rig with these columns.
fn load(folder: &str, file: &str, rig: &str, columns: &str) -> Option<Recording> {
    let path: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "..", "..", "..", "shared", "data", folder, file].iter().collect();
    if !path.exists() {
        println!("skipped: shared/data/{folder}/{file} is not beside the workspace");
        return None;
    }
    let rig = Rig::parse(&format!("{rig}[recording.columns]\n{columns}"), "rig.toml").unwrap();
    Some(rig.load_recording(&path).unwrap())
}

#[test]
fn servo_pendulum() {
    let columns = r#"
        t_s = { column = "time_s" }
        theta_ref_rad = { column = "goal_angle_rad" }
        theta_out_rad = { column = "angle_rad" }
        bus_v = { column = "supply_v" }
        drive_enable = { column = "torque_enable" }"#;
    let file = "xl330_kp100_lift_and_drop_10h28m17.csv";
    let Some(recording) = load("bam-xl330-pendulum", file, SERVO, columns) else { return };
    // Rows and rate as the provenance manifest states them; first cells as the file shows them.
    assert_eq!(recording.len(), 1510);
    assert!((1.0 / recording.median_step_s().unwrap() - 284.9).abs() < 1.0);
    assert_eq!(recording.t_s()[0], 0.003_571);
    assert_eq!(recording.channel(Channel::ThetaOut).unwrap()[0], -0.013_806);
    assert_eq!(recording.channel(Channel::Duty).unwrap()[0], 0.003_39);
    let enable = recording.channel(Channel::DriveEnable).unwrap();
    assert!(enable.first() == Some(&1.0) && enable.last() == Some(&0.0), "torque is cut during the run");
}

#[test]
fn cable_driven_tool() {
    let columns = r#"
        t_s = { column = "time_s" }
        theta_in_rad = { column = "input_angle_rad" }
        theta_out_rad = { column = "output_angle_rad", scale = -1.0 }
        torque_in_nm = { column = "input_torque_nm" }
        torque_out_nm = { column = "output_torque_nm" }"#;
    let Some(recording) = load("davinci-cable-tool", "T5L_3__00.csv", TRANSMISSION, columns) else { return };
    assert_eq!(recording.len(), 20_000);
    assert_eq!(recording.channel(Channel::ThetaIn).unwrap()[0], 1.046_94);
    assert_eq!(recording.channel(Channel::ThetaOut).unwrap()[0], -0.367_57);
    assert_eq!(recording.channel(Channel::TorqueOut).unwrap()[1], -0.008_639);
    // Line 25 of the file: -8.40, -8.64, -6.09, -8.48, -8.64 mN·m.
    let [spikes] = recording.notes() else { panic!("{:?}", recording.notes()) };
    assert!(
        spikes.contains("T5L_3__00.csv:25: torque_out_nm is -0.006091 between -0.008639 and -0.00848"),
        "{spikes}"
    );
    let torque_nm = recording.channel(Channel::TorqueOut).unwrap();
    assert!((torque_nm[23] + 0.008_56).abs() < 1e-5, "{}", torque_nm[23]);
}

#[test]
fn cogging_motor() {
    let columns = r#"
        t_s = { column = "time_s" }
        theta_in_rad = { column = "angle_rad" }
        i_motor_a = { column = "iq_measured_a" }
        [replay]
        inputs = ["theta_in_rad"]
        outputs = ["i_motor_a"]"#;
    let Some(recording) = load("odrive-cogging", "slow2__comp_0.csv", SERVO, columns) else { return };
    assert_eq!(recording.len(), 4377);
    assert_eq!(recording.channel(Channel::MotorCurrent).unwrap()[1], 0.413_41);
}

#[test]
fn every_concealed_example_loads() {
    let examples: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "..", "..", "..", "shared", "concealed-examples"].iter().collect();
    if !examples.exists() {
        println!("skipped: shared/concealed-examples is not beside the workspace");
        return;
    }
    for number in 1..=8 {
        let folder = examples.join(format!("example-{number}"));
        let rig = Rig::load(&folder.join("rig.toml")).unwrap();
        assert_eq!(rig.name, format!("example-{number}"));
        for (file, samples) in [("train.csv.gz", 40_000), ("heldout.csv.gz", 20_000)] {
            let recording = rig.load_recording(&folder.join(file)).unwrap();
            assert_eq!((recording.len(), recording.notes()), (samples, [].as_slice()), "{number} {file}");
        }
    }
}
