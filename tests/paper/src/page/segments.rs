//! Section of Fig. 4.

use super::Section;
use crate::plots::{Mark, Panel, figure, line};
use crate::torque_phases::{PhasedSample, TorqueLoop, letters};

/// Table and figure of the torque loop.
///
/// # Errors
/// When the figure cannot be drawn.
pub fn section(all: &TorqueLoop) -> Result<Section, String> {
    let row = |what: &str, paper: &str, equations: String, here: String| {
        vec![what.to_owned(), paper.to_owned(), equations, here]
    };
    let rows = vec![
        row(
            "segments in the order passed",
            "A to G, its list A to H",
            letters(&all.samples, |sample| sample.predicted),
            letters(&all.samples, |sample| sample.recorded),
        ),
        row(
            "width of the loop in T_in at T_out = 0, N·m",
            "2·2 F0 r2 μK",
            format!("{:.4}", all.width_predicted_nm),
            format!("{:.4}", all.width_nm),
        ),
        row(
            "RMS of T_out (17) less T_out, N·m",
            "\"essentially the same\"",
            "0".to_owned(),
            format!("{:.4} (of {:.2} at the peak)", all.prediction_rms_nm, all.largest_torque_nm),
        ),
        row("time in the segment of (17)", "", "100 %".to_owned(), format!("{:.1} %", 100.0 * all.agreement)),
    ];
    Ok(Section {
        heading: "Section 3.2, Fig. 4: the torque loop and its segments".to_owned(),
        setting: "K = π, r1 = r2 = 15 mm, F0 = 30 N as in the paper; chosen: μ = 0.12, tendons of 1 m, 2.5 kg at 30 mm, input pulley\n\
                  on a sine of 0.8 rad at 0.1 Hz, so that T_in exceeds 2·2 F0 r2 μK and segments D and G exist."
            .to_owned(),
        columns: vec!["what", "paper", "equations", "reproduction"],
        rows,
        reading: "The letters of the equations come from Eq. (17) on the recorded T_in, those of the reproduction from the joint's\n\
                  speed (at rest: below a tenth of its largest) and the sign of T_in, all averaged over 0.2 s. Both agree but for the\n\
                  edges of the holds, where slip fronts travel along the sheaths and the joint creeps before (17) lets it go."
            .to_owned(),
        figures: vec![("fig-4", "Torque loop with its segments, and torques over time", plot(&all.samples)?)],
    })
}

fn plot(samples: &[PhasedSample]) -> Result<String, String> {
    // The second pass of every segment, and A and B of the first.
    let marks = samples
        .chunk_by(|one, next| one.recorded == next.recorded)
        .filter(|segment| segment[0].sample.t_s < 12.0 && segment.len() > 30)
        .map(|segment| {
            let middle = segment[segment.len() / 2].sample;
            Mark {
                at: (middle.torque_in_nm, middle.torque_out_nm + 0.04),
                text: segment[0].recorded.letter().to_string(),
            }
        })
        .collect();
    let torque_loop = Panel {
        title: "Output torque over input torque".to_owned(),
        x: "T_in, N·m",
        y: "T_out, N·m",
        lines: vec![
            line("bench", samples, |all| (all.sample.torque_in_nm, all.sample.torque_out_nm)),
            line("Eq. (17)", samples, |all| (all.sample.torque_in_nm, all.torque_predicted_nm)),
        ],
        marks,
    };
    let course = Panel {
        title: "Torques over time".to_owned(),
        x: "time, s",
        y: "torque, N·m",
        lines: vec![
            line("T_in", samples, |all| (all.sample.t_s, all.sample.torque_in_nm)),
            line("T_out, Eq. (17)", samples, |all| (all.sample.t_s, all.torque_predicted_nm)),
            line("T_out, bench", samples, |all| (all.sample.t_s, all.sample.torque_out_nm)),
            line("T_in - T_out", samples, |all| {
                (all.sample.t_s, all.sample.torque_in_nm - all.sample.torque_out_nm)
            }),
        ],
        marks: Vec::new(),
    };
    figure(&[torque_loop, course], 2)
}
