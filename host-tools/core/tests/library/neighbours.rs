//! Models that others wrote as rigs, line by line, rigs out to MuJoCo, and a ROS 2 bag that others wrote as a recording. That MuJoCo itself comes
//! to the same numbers, and loads what is written, is tested in Python.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use bowden_core::neighbours::{from_mjcf, from_urdf, into_mjcf, to_mjcf};
use bowden_core::recording::{ReadOptions, Recording};
use bowden_core::rig::{Rig, RigDocument};
use bowden_model::channel::Channel;
use bowden_model::load::GRAVITY_M_S2;

use crate::BENCH;

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models").join(name)
}

fn bench() -> RigDocument {
    RigDocument::parse(BENCH, "bench.toml").unwrap()
}

fn near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-9 * expected.abs().max(1.0), "{value}, expected {expected}");
}

/// By hand: both links turn about x through the origin of link1; link2 stands 0.1 m above it. Everything points up.
#[test]
fn a_double_pendulum_in_urdf_is_one_weight() {
    let found = from_urdf(&model("double_pendulum.urdf"), "joint1").unwrap();
    let rig = found.document(bench()).unwrap().rig().unwrap();
    let load = rig.joint.load.unwrap();
    let (m1, m2): (f64, f64) = (0.26703, 0.33238);
    let (y, z) = (m1 * 2.1727e-6 + m2 * 1.9371e-10, m1 * 0.036_012 + m2 * (0.1 + 0.10088));
    let arm_m = y.hypot(z) / (m1 + m2);
    near(load.mass_kg, m1 + m2);
    near(load.arm_m, arm_m);
    let about_x = |ixx: f64, m: f64, y: f64, z: f64| ixx + m * (y * y + z * z);
    let inertia =
        about_x(0.000_408_27, m1, 2.1727e-6, 0.036_012) + about_x(0.001_175_3, m2, 1.9371e-10, 0.20088);
    near(load.inertia_kg_m2 + load.mass_kg * arm_m * arm_m, inertia);
    near(load.viscous_nm_s_per_rad, 0.05);
    assert!((found.zero_rad.abs() - PI).abs() < 1e-4, "{}", found.zero_rad);
    let said: Vec<String> = found.mapped.iter().map(ToString::to_string).collect();
    for expected in
        ["line 104: damping = 0.05 -> load.viscous", "line 99: limit lower = 0", ": not mapped, limits"]
    {
        assert!(said.iter().any(|line| line.contains(expected)), "{expected}: {said:#?}");
    }
}

/// By hand: the forearm is a capsule of 0.5 m and radius 0.035 m of water about its end, and turns about the vertical: nothing hangs.
#[test]
fn an_arm_in_mjcf_turns_about_the_vertical_without_a_weight() {
    let found = from_mjcf(&model("arm26.xml"), "elbow").unwrap();
    let rig = found.document(bench()).unwrap().rig().unwrap();
    let load = rig.joint.load.unwrap();
    assert_eq!((load.mass_kg, load.arm_m, found.zero_rad), (0.0, 0.0, 0.0));
    let (r, l) = (0.035_f64, 0.5);
    let (rod, ball) = (1000.0 * PI * r * r * l, 1000.0 * 4.0 / 3.0 * PI * r.powi(3));
    // Each half ball's centre lies 3 r / 8 beyond the rod's end, and has 83/320 m r² about it.
    let half = |end: f64| ball / 2.0 * (83.0 / 320.0 * r * r + (end + (end / (l / 2.0)) * 0.375 * r).powi(2));
    let about_middle = rod * (l * l / 12.0 + r * r / 4.0) + half(l / 2.0) + half(-l / 2.0);
    near(load.inertia_kg_m2, about_middle + (rod + ball) * (l / 2.0).powi(2));
    near(load.viscous_nm_s_per_rad, 0.1);
    let said: Vec<String> = found.mapped.iter().map(ToString::to_string).collect();
    for expected in ["range = 0 120: not mapped", "line 103: tendon spatial `BE`: not mapped"] {
        assert!(said.iter().any(|line| line.contains(expected)), "{expected}: {said:#?}");
    }
}

const DRIVEN: &str = r#"<mujoco model="driven">
  <compiler angle="degree"/>
  <option gravity="0 0 -9.80665"/>
  <default><default class="servo"><joint damping="0.2" frictionloss="0.05" armature="0.01"/></default></default>
  <worldbody>
    <body pos="0 0 1" euler="0 90 0" childclass="servo">
      <joint name="knee" axis="0 1 0" stiffness="2" springref="10"/>
      <geom type="box" size="0.1 0.01 0.01" pos="0.1 0 0" mass="0.5"/>
      <body pos="0.2 0 0"><geom type="mesh" mesh="foot"/></body>
    </body>
  </worldbody>
  <actuator><position joint="knee" kp="10"/></actuator>
</mujoco>
"#;

#[test]
fn classes_units_and_turns_of_a_model_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("driven.xml");
    std::fs::write(&path, DRIVEN).unwrap();
    let found = from_mjcf(&path, "knee").unwrap();
    let rig = found.document(bench()).unwrap().rig().unwrap();
    let load = rig.joint.load.unwrap();
    // The box points along x, which the turn about y has laid straight down.
    near(found.zero_rad, 0.0);
    near(load.mass_kg * GRAVITY_M_S2 * load.arm_m, 0.5 * 9.80665 * 0.1);
    let of_box = 0.5 / 3.0 * (0.1 * 0.1 + 0.01 * 0.01);
    near(load.inertia_kg_m2, of_box);
    let parameters: Vec<(&str, f64)> =
        rig.effects.iter().map(|effect| (effect.descriptor().id, effect.parameters[0])).collect();
    assert_eq!(parameters, [("joint_coulomb_friction", 0.05), ("joint_spring", 2.0)]);
    near(rig.effects[1].parameters[1], 10.0 * PI / 180.0);
    // Behind the gear of a rig that knows it, the armature is the rotor's.
    near(rig.joint.motor.unwrap().rotor_inertia_kg_m2, 0.01 / (30.0 * 30.0));
    let (start, end) = (BENCH.find("[motor]").unwrap(), BENCH.find("[pulleys]").unwrap());
    let without_motor = BENCH.replace(&BENCH[start..end], "");
    let base = found.document(RigDocument::parse(&without_motor, "bench.toml").unwrap()).unwrap();
    near(base.rig().unwrap().joint.load.unwrap().inertia_kg_m2, of_box + 0.01);
    let said: Vec<String> = found.mapped.iter().map(ToString::to_string).collect();
    for expected in
        ["line 9: geom of type mesh: not mapped, its mass", "line 12: actuator position: not mapped"]
    {
        assert!(said.iter().any(|line| line.contains(expected)), "{expected}: {said:#?}");
    }
}

#[test]
fn a_joint_of_a_model_takes_the_rigs_values_and_nothing_else_changes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("driven.xml");
    std::fs::write(&path, DRIVEN).unwrap();
    let rig = "schema = \"bowden-rig/1\"\n[pulleys]\ninput_radius_m = 0.01\noutput_radius_m = 0.01\n[tendon]\nlength_m = \
               1\naxial_stiffness_n = 7e4\npretension_n = 20\n[load]\nmass_kg = 1\narm_m = 0.1\ninertia_kg_m2 = \
               0\nviscous_nm_s_per_rad = 0.3\n[simulation]\neffects = \
               [\"joint_coulomb_friction\", \"joint_spring\"]\n[effects.joint_coulomb_friction]\ntorque_nm = \
               0.07\n[effects.joint_spring]\nstiffness_nm_per_rad = 1.5\nrest_rad = 0.5\nhardening_per_rad2 = 0.4\n";
    let (text, mapped) = into_mjcf(&Rig::parse(rig, "rig.toml").unwrap(), &path, "knee").unwrap();
    // In the model's unit and from its zero, which is hanging straight down but for rounding.
    let degrees = text.split("springref=\"").nth(1).unwrap().split('"').next().unwrap();
    near(degrees.parse::<f64>().unwrap().to_radians(), 0.5);
    let expected = DRIVEN.replace(
        "<joint name=\"knee\" axis=\"0 1 0\" stiffness=\"2\" springref=\"10\"/>",
        &format!(
            "<joint damping=\"0.3\" frictionloss=\"0.07\" name=\"knee\" axis=\"0 1 0\" stiffness=\"1.5\" \
             springref=\"{degrees}\"/>"
        ),
    );
    assert_eq!(text, expected);
    assert!(
        mapped.iter().any(|one| one.says == "load.mass_kg, arm_m, inertia_kg_m2" && one.becomes.is_err())
    );
    let says = |text: &str| mapped.iter().any(|one| one.becomes.as_ref().is_ok_and(|it| it.ends_with(text)));
    assert!(says("it does not harden"), "{mapped:#?}");
}

/// A motor that turns the arm without tendons: all of it goes into the one joint.
#[test]
fn a_joint_of_a_model_takes_the_rotor_of_a_motor_without_tendons_as_armature() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("driven.xml");
    std::fs::write(&path, DRIVEN).unwrap();
    let (start, end) = (BENCH.find("[pulleys]").unwrap(), BENCH.find("[load]").unwrap());
    let effects = "\n[simulation]\neffects = [\"motor_coulomb_friction\", \"motor_viscous_friction\", \
                   \"joint_coulomb_friction\", \"joint_viscous_friction\"]\n\
                   [effects.motor_coulomb_friction]\ntorque_nm = 0.05\n\
                   [effects.motor_viscous_friction]\nviscous_nm_s_per_rad = 0.01\n\
                   [effects.joint_coulomb_friction]\ntorque_nm = 0.07\n\
                   [effects.joint_viscous_friction]\nviscous_nm_s_per_rad = 0.002\n";
    let text = BENCH.replace(&BENCH[start..end], "") + effects;
    let (written, mapped) = into_mjcf(&Rig::parse(&text, "rig.toml").unwrap(), &path, "knee").unwrap();
    let knee = written.lines().find(|line| line.contains("\"knee\"")).unwrap();
    let value = |name: &str| -> f64 {
        let (_, after) = knee.split_once(&format!(" {name}=\"")).unwrap();
        after.split('"').next().unwrap().parse().unwrap()
    };
    // Gear ratio 30, rotor 5e-6 kg m2; viscous: load, motor, and what the effects add.
    near(value("armature"), 30.0 * 30.0 * 5e-6);
    near(value("damping"), 0.004 + 0.02 + 0.01 + 0.002);
    near(value("frictionloss"), 0.05 + 0.07);
    // The model's own spring stays.
    assert_eq!((value("stiffness"), value("springref")), (2.0, 10.0));
    let expected: Vec<&str> = DRIVEN.lines().filter(|line| !line.contains("name=\"knee\"")).collect();
    let others: Vec<&str> = written.lines().filter(|line| !line.contains("name=\"knee\"")).collect();
    assert_eq!(others, expected);
    let said: Vec<String> = mapped.iter().map(ToString::to_string).collect();
    assert!(
        said.iter()
            .any(|line| line.starts_with("motor.rotor_inertia_kg_m2, gear_ratio -> armature = 0.0045"))
    );
    assert!(!said.iter().any(|line| line.contains("one joint has no transmission")), "{said:#?}");
}

#[test]
fn a_rig_out_to_mujoco_comes_back_as_it_was() {
    let text = BENCH.to_owned()
        + "\n[effects.joint_coulomb_friction]\ntorque_nm = 0.07\n[effects.joint_backlash]\ngap_rad = 0.01\n";
    let effects = "effects = [\"joint_coulomb_friction\", \"joint_backlash\"]";
    let text = if text.contains("[simulation]") {
        text.replace("effects = []", effects)
    } else {
        format!("{text}\n[simulation]\n{effects}\n")
    };
    let rig = Rig::parse(&text, "rig.toml").unwrap();
    let (written, mapped) = to_mjcf(&rig).unwrap();
    let not = |what: &str| mapped.iter().any(|one| one.says.contains(what) && one.becomes.is_err());
    assert!(not("joint_backlash") && not("inductance"), "{mapped:#?}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench.xml");
    std::fs::write(&path, &written).unwrap();
    let (load, back) = (rig.joint.load.unwrap(), from_mjcf(&path, "joint").unwrap());
    let there = back.document(bench()).unwrap().rig().unwrap();
    let found = there.joint.load.unwrap();
    near(found.mass_kg, load.mass_kg);
    near(found.arm_m, load.arm_m);
    near(found.inertia_kg_m2, load.inertia_kg_m2.max(1e-9));
    near(found.viscous_nm_s_per_rad, load.viscous_nm_s_per_rad);
    assert_eq!(there.effects.len(), 1);
    near(there.effects[0].parameters[0], 0.07);
    near(back.zero_rad, 0.0);
}

#[test]
fn what_cannot_be_read_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |text: &str, joint: &str, urdf: bool| {
        let path = folder.path().join("model.xml");
        std::fs::write(&path, text).unwrap();
        let read = if urdf { from_urdf } else { from_mjcf };
        let message = read(&path, joint).unwrap_err().message().to_owned();
        message.replace(&format!("{}:", path.display()), "")
    };
    let body = |inner: &str| {
        format!("<mujoco><worldbody><body>\n{inner}\n<joint name=\"a\"/></body></worldbody></mujoco>")
    };
    let cases = [
        (refusal("<mujoco>", "a", false), "1:1: no XML"),
        (refusal("<robot/>", "a", false), "1: got <robot>, expected <mujoco>"),
        (refusal("<mujoco/>", "a", false), "1: has no <worldbody>"),
        (refusal(&body(""), "b", false), "1: no joint `b`; "),
        (refusal(&body(""), "a", false), "1: nothing that hangs on the joint has a mass"),
        (refusal(&body("<inertial mass=\"x\"/>"), "a", false), "2: mass: got `x`, expected a number"),
        (refusal(&body("<inertial mass=\"1\"/>"), "a", false), "2: <inertial> lacks `diaginertia`"),
        (
            refusal(&body("<geom type=\"box\" size=\"1 2\"/>"), "a", false),
            "2: geom of type box: `size` has too few",
        ),
        (refusal("<mujoco>\n<include file=\"x\"/></mujoco>", "a", false), "2: <include> is not followed"),
        (
            refusal("<robot>\n<joint name=\"a\" type=\"prismatic\"/></robot>", "a", true),
            "2: joint `a` is of type prismatic",
        ),
        (
            refusal("<robot>\n<joint name=\"a\" type=\"revolute\"/></robot>", "a", true),
            "2: <joint> lacks <parent link",
        ),
    ];
    for (message, expected) in cases {
        assert!(message.starts_with(expected), "{message}, expected {expected}");
    }
    let circle = "<robot><link name=\"l\"/><joint name=\"a\" type=\"revolute\"><parent link=\"l\"/><child link=\"l\"/></joint></robot>";
    assert!(refusal(circle, "a", true).contains("circle"));
    let slide = body("<joint name=\"s\" type=\"slide\"/>");
    assert!(refusal(&slide, "s", false).contains("type slide"));
}

/// Joint states among 94 types of messages, two each; numbers as the script that wrote them has them, times as another library reads them.
#[test]
fn a_bag_of_somebody_else_is_a_recording() {
    let columns = r#"
        [recording.columns]
        theta_in_rad = { column = "/test/sensor_msgs/joint_state:joint1.position" }
        theta_out_rad = { column = "/test/sensor_msgs/joint_state:joint2.position", scale = -2.0 }
        i_motor_a = { column = "/test/sensor_msgs/joint_state:joint3.effort" }"#;
    let rig = Rig::parse(&format!("{BENCH}{columns}"), "rig.toml").unwrap();
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bags/rosbags-rs.mcap");
    // A rig asks for fifty samples; the bag has two.
    let recording = Recording::load(&bag, &ReadOptions { columns: rig.columns, only: None }).unwrap();
    // 1749315325.013567488 s after 1749315324.955078144 s.
    let seconds = 1.013_567_488 - 0.955_078_144;
    assert_eq!(recording.t_s().len(), 2);
    assert!(
        recording.t_s()[0] == 0.0 && (recording.t_s()[1] - seconds).abs() < 1e-12,
        "{:?}",
        recording.t_s()
    );
    assert_eq!(recording.channel(Channel::ThetaIn).unwrap(), [0.1, 0.1]);
    assert_eq!(recording.channel(Channel::ThetaOut).unwrap(), [-0.4, -0.4]);
    assert_eq!(recording.channel(Channel::MotorCurrent).unwrap(), [3.0, 3.0]);
}
