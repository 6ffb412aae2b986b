//! Laws of a rig file that state points: what they simulate, how they are written, and what is refused.

use bowden_core::hypothesis;
use bowden_core::recording::Recording;
use bowden_core::replay::predict;
use bowden_core::rig::{Rig, RigDocument};
use bowden_model::channel::Channel;

use crate::BENCH;

const POINTS: &str = r#"
[[law]]
name = "drag"
component = "joint"
port = "joint_friction_nm"
variables = ["omega_out_rad_s"]
units = { omega_out_rad_s = "rad/s", joint_friction_nm = "N·m" }
points = [[-1, 0.5], [0, 0.0], [1, 0.5]]
"#;

/// Joint and pulley swing by 0.4 rad.
fn swing() -> Recording {
    let t_s: Vec<f64> = (0..1500).map(|k| f64::from(k) * 2e-3).collect();
    let theta_rad = t_s.iter().map(|t| 0.4 * (5.0 * t).sin()).collect();
    Recording::new("swing", t_s).with(Channel::ThetaIn, theta_rad)
}

fn bench() -> Rig {
    let replay = "\n[replay]\ninputs = [\"theta_in_rad\"]\noutputs = [\"theta_out_rad\", \"f2_n\"]\n";
    Rig::parse(&format!("{BENCH}{replay}"), "bench.toml").unwrap()
}

fn with(law: &str) -> Rig {
    let law = Rig::parse(&format!("{BENCH}{law}"), "rig.toml").unwrap();
    Rig { effects: law.effects, ..bench() }
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// `0.4 abs(omega)^2` by its formula and by 81 points of it: what the straight lines between points miss is
/// `0.4 h^2 / 4` with `h = 0.1`, 1 mN·m of 1.6 N·m.
#[test]
fn points_of_a_formula_simulate_what_the_formula_does() {
    let formula = with(
        "[[law]]\ncomponent = \"joint\"\nport = \"joint_friction_nm\"\nvariables = [\"omega_out_rad_s\"]\nformula = \
         \"amplitude_nm * abs(omega_out_rad_s)^exponent\"\ncoefficients = { amplitude_nm = 0.4, exponent = 2.0 }\n",
    );
    let points: Vec<[f64; 2]> =
        (-40..=40).map(|k| f64::from(k) * 0.1).map(|omega| [omega, 0.4 * omega * omega]).collect();
    let tabled = POINTS.replace("[[-1, 0.5], [0, 0.0], [1, 0.5]]", &format!("{points:?}"));
    let [nothing, by_formula, by_points] = [bench(), formula, with(&tabled)]
        .map(|rig| predict(&rig, &swing()).unwrap().channel(Channel::F2).unwrap().to_vec());
    let effect = rms(&nothing, &by_formula);
    let missed = rms(&by_points, &by_formula);
    assert!(effect > 0.5 && missed < 0.01 * effect, "{missed} N of {effect} N");
}

/// By hand: the same drag, stated over a second variable that changes nothing, is the same.
#[test]
fn a_second_variable_that_changes_nothing_changes_nothing() {
    let plane = POINTS
        .replace("variables = [", "variables = [\"theta_out_rad\", ")
        .replace("units = {", "units = { theta_out_rad = \"rad\",")
        .replace(
            "[[-1, 0.5], [0, 0.0], [1, 0.5]]",
            "[[3, 1, 0.5], [-3, -1, 0.5], [-3, 0, 0.0], [-3, 1, 0.5], [3, -1, 0.5], [3, 0, 0.0]]",
        );
    let [line, plane] = [POINTS, &plane].map(|law| predict(&with(law), &swing()).unwrap());
    let [line, plane] = [&line, &plane].map(|one| one.channel(Channel::F2).unwrap());
    assert!(rms(line, plane) < 1e-9);
}

#[test]
fn points_read_back_as_they_were_written_and_the_same_are_one_law() {
    let [one, two] = [with(POINTS), with(POINTS)].map(|rig| rig.effects);
    assert_eq!(one, two);
    let law = hypothesis::of(&one[0]).unwrap();
    assert!(std::ptr::eq(law, hypothesis::of(&two[0]).unwrap()), "read twice, kept once");
    assert!(!law.is_function() && law.name() == "drag");
    let mut document = RigDocument::parse(BENCH, "bench.toml").unwrap();
    document.add_effect(&one[0]).unwrap();
    assert_eq!(document.rig().unwrap().effects, one, "{document}");
    // Other points of the same name take their place.
    let other = with(&POINTS.replace("[1, 0.5]", "[1, 0.7]")).effects;
    assert_ne!(one, other);
    document.add_effect(&other[0]).unwrap();
    assert_eq!(document.rig().unwrap().effects, other, "{document}");
    assert!(document.remove_effect("law") && document.rig().unwrap().effects.is_empty());
}

#[test]
fn what_is_no_law_of_points_is_refused_with_its_place() {
    let points = "[[-1, 0.5], [0, 0.0], [1, 0.5]]";
    let before = BENCH.matches('\n').count() + 1;
    let at = |line: usize, column: usize| format!("rig.toml:{}:{column}: ", before + line);
    for (from, to, place, want) in [
        (
            "joint_friction_nm\"\n",
            "joint_frictoin_nm\"\n",
            at(4, 8),
            "unknown port `joint_frictoin_nm`; did you mean",
        ),
        ("\"joint\"", "\"motor\"", at(3, 13), "component: got `motor`"),
        (
            "[\"omega_out_rad_s\"]",
            "[\"omega_in_rad_s\"]",
            at(5, 14),
            "port joint_friction_nm has no variable",
        ),
        ("\"rad/s\"", "\"deg/s\"", at(6, 29), "omega_out_rad_s: got the unit `deg/s`, expected `rad/s`"),
        ("name = \"drag\"", "name = \"Drag!\"", at(1, 1), "law `Drag!`: a name has lower-case letters"),
        ("name = \"drag\"", "colour = 1", at(2, 1), "unknown key `colour` in [law]"),
        ("name = \"drag\"", "channel = \"f1_n\"", at(2, 11), "port joint_friction_nm has no channel"),
        (points, "7", at(7, 10), "law.points: got the whole number 7, expected points [x, value]"),
        (points, "[[0, 1], [1, 2, 3]]", at(7, 19), "law.points: got a list, expected points [x, value]"),
        (
            points,
            "[[0, 1], [1, nan]]",
            at(7, 19),
            "law.points: got a list, expected points [x, value] of finite",
        ),
        (points, "[[0, 1]]", at(7, 10), "points: give at least two values of each variable"),
        (points, "[[0, 1], [1, 1], [0, 2]]", at(7, 10), "points: [0.0] stands twice"),
    ] {
        let text = format!("{BENCH}{}", POINTS.replacen(from, to, 1));
        let message = Rig::parse(&text, "rig.toml").unwrap_err().message().to_owned();
        assert!(message.starts_with(&format!("{place}{want}")), "got  {message}\nwant {place}{want}");
    }
    let plane = POINTS
        .replace("variables = [", "variables = [\"theta_out_rad\", ")
        .replace("units = { omega_out_rad_s = \"rad/s\", joint_friction_nm = \"N·m\" }", "")
        .replace(points, "[[0, 0, 1], [1, 1, 1]]");
    let message = Rig::parse(&format!("{BENCH}{plane}"), "rig.toml").unwrap_err().message().to_owned();
    assert!(message.contains("2 points for 4 combinations"), "{message}");
}
