//! Section of Fig. 5 to 8.

use super::Section;
use crate::loop_run::LoopSample;
use crate::lubrication_and_radius::{FROM_S, JOINT_AMPLITUDE_RAD, TransmissionLoops};
use crate::plots::{Panel, figure, line};

/// Table and figure of the gaps; `all` in the order of [`crate::lubrication_and_radius::NAMES`].
///
/// # Errors
/// When the figure cannot be drawn.
pub fn section(all: &[TransmissionLoops; 3]) -> Result<Section, String> {
    let rows = all.iter().map(|loops| {
        let ([torque, torque_predicted], [angle, angle_predicted]) =
            (loops.torque_gap_nm, loops.displacement_gap_rad);
        vec![
            loops.name.to_owned(),
            format!("{:.3}", loops.largest_torque_out_nm),
            format!("{:.3}", loops.largest_torque_in_nm),
            format!("{torque_predicted:.4}"),
            format!("{torque:.4}"),
            format!("{:.2}", 1e3 * angle_predicted),
            format!("{:.2}", 1e3 * angle),
        ]
    });
    let [dry, greased, large] = all;
    let change = |of: fn(&TransmissionLoops) -> f64, other: &TransmissionLoops| {
        format!("{:+.0} %", 100.0 * (of(other) / of(dry) - 1.0))
    };
    let torque: fn(&TransmissionLoops) -> f64 = |loops| loops.torque_gap_nm[0];
    let angle: fn(&TransmissionLoops) -> f64 = |loops| loops.displacement_gap_rad[0];
    Ok(Section {
        heading: "Section 4.1, Fig. 5 to 8: lubrication and pulley radius".to_owned(),
        setting: format!(
            "K = π, sine of 0.1 Hz at the input, equal output torque as in the paper; chosen: F0 = 30 N, tendons of 1 m, 2.5 kg at\n\
             30 mm, {:.2} rad; μ = {} dry (steel on a sliding polyethylene, near the upper end of steel on PTFE, 0.04 to 0.22) and\n\
             {} greased (steel on lubricated polyamide), from a published table\n\
             (pickedshares.com/en/static-and-sliding-friction-values).",
            JOINT_AMPLITUDE_RAD,
            crate::friction::DRY,
            crate::friction::GREASED
        ),
        columns: vec![
            "configuration",
            "largest T_out, N·m",
            "largest T_in, N·m",
            "torque gap, equations, N·m",
            "torque gap, reproduction, N·m",
            "displacement gap, equations, mrad",
            "displacement gap, reproduction, mrad",
        ],
        rows: rows.collect(),
        reading: format!(
            "| figure | paper | equations | reproduction |\n|---|---|---|---|\n\
             | 5 | greased: torque gap smaller | as μ: -50 % | {} |\n\
             | 6 | greased: displacement gap smaller | as tanh(μK/2): -49 % | {} |\n\
             | 7 | r = 20 mm: torque gap larger | as r: +33 % | {} |\n\
             | 8 | r = 20 mm: displacement gap larger | as 1/r: -25 % | {} |\n\n\
             **Fig. 8 is not reproduced, and cannot be with these equations.** In slip the lag at one T_out is\n\
             φ = (L tanh(a/2)/(EA r2)) (T_out/(a r2) ± F0), a = μK (20). The gap is the difference of both directions at one T_out, taken\n\
             back to the input by r2/r1: Δθ_in = 2 F0 L tanh(a/2)/(EA r1) (23). The tendon slips by the same length\n\
             2 F0 L tanh(a/2)/EA whatever the pulley, and a larger pulley makes a smaller angle of it. The elastic part falls as\n\
             1/r². The torque gap 2 M = 4 F0 r2 μK grows with the radius, so the two gaps order the radii in opposite ways. The paper's\n\
             order would need another pretension at r = 20 mm (above 4/3 of the other) or a gap read at unequal output torque; its\n\
             text names neither.\n\n\
             The displacement gap of the bench is up to 2 % below the equations: its sheaths are straight at their ends, which\n\
             leaves less stretch to turn over than even bends.",
            change(torque, greased),
            change(angle, greased),
            change(torque, large),
            change(angle, large)
        ),
        figures: vec![("fig-5-to-8", "Torque and displacement loops", plot(all)?)],
    })
}

fn plot(all: &[TransmissionLoops; 3]) -> Result<String, String> {
    let [dry, greased, large] = all;
    let torque = |title: &str, shown: [&TransmissionLoops; 2]| Panel {
        title: title.to_owned(),
        x: "T_in, N·m",
        y: "T_out, N·m",
        lines: shown
            .map(|loops| line(loops.name, periodic(&loops.samples), |s| (s.torque_in_nm, s.torque_out_nm)))
            .into(),
        marks: Vec::new(),
    };
    // Against the input angle itself the gap of some mrad in ±500 would not be seen.
    let displacement = |title: &str, shown: [&TransmissionLoops; 2]| Panel {
        title: title.to_owned(),
        x: "θ_in, rad",
        y: "θ_in - θ_out, mrad",
        lines: shown
            .map(|loops| {
                line(loops.name, periodic(&loops.samples), |s| {
                    (s.theta_in_rad, 1e3 * (s.theta_in_rad - s.theta_out_rad))
                })
            })
            .into(),
        marks: Vec::new(),
    };
    figure(
        &[
            torque("Fig. 5: torque, lubrication", [dry, greased]),
            displacement("Fig. 6: displacement, lubrication", [dry, greased]),
            torque("Fig. 7: torque, pulley radius", [dry, large]),
            displacement("Fig. 8: displacement, pulley radius", [dry, large]),
        ],
        2,
    )
}

fn periodic(samples: &[LoopSample]) -> &[LoopSample] {
    &samples[samples.partition_point(|sample| sample.t_s < FROM_S)..]
}
