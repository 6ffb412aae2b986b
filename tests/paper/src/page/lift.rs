//! Section of Fig. 9.

use super::Section;
use crate::efficiency::{EfficiencyRun, FROM_S, Panel as EfficiencyPanel, TRIED};
use crate::plots::{Panel, figure, line};

/// Table and figure of efficiency and least pretension.
///
/// # Errors
/// When the figure cannot be drawn.
pub fn section(all: &[(EfficiencyPanel, Vec<EfficiencyRun>)]) -> Result<Section, String> {
    let percent = |part: f64| format!("{:.1} %", 100.0 * part);
    let mut rows = Vec::new();
    for (panel, runs) in all {
        for (index, run) in runs.iter().enumerate() {
            let [above, below] = run.tension_above_below_n;
            rows.push(vec![
                format!("{}: {}", panel.letter, panel.varied),
                run.name.to_owned(),
                if index == 0 { panel.claim.to_owned() } else { String::new() },
                format!("{:.3}", run.driving_torque_predicted_nm),
                format!("{:.3}", run.driving_torque_nm),
                percent(run.efficiency_predicted),
                percent(run.efficiency),
                format!("{:.2}", run.least_pretension_n),
                format!("{above:.2} / {below:.2}"),
            ]);
        }
    }
    Ok(Section {
        heading: "Section 4.2, Fig. 9: efficiency and least pretension".to_owned(),
        setting: "θ_in = π/4 sin(π/5 t), pretensions, wrap angles and radii as in the paper (a: K = π, dry, r = 15 mm; b and d: 25 N; c: 30 N,\n\
                  K = π); chosen: μ as in section 4.1, tendons of 1 m, 0.7 kg at 40 mm, which 10 N just bear.\n\n\
                  The paper plots efficiency without a formula and argues with the driving torque for the same load. Here efficiency is\n\
                  the work that the joint receives over the work that the input pulley gives while the motor lifts the weight. By the\n\
                  equations, from the lowest point to θ: W_out = m g l (1 - cos θ), W_in = W_out + M θ + c (T²/2 + M T) with T = m g l sin θ,\n\
                  M = 2 F0 r μK (15) and the slope c of the lag in T_out (20). The least pretension is the one at which the slackest end\n\
                  just keeps tension at the largest T_out of the motion: F0 = (T/r2)(e^a - 1)/(2a), a = μK (derivation, section 7)."
            .to_owned(),
        columns: vec![
            "panel",
            "configuration",
            "paper",
            "driving torque, equations, N·m",
            "reproduction, N·m",
            "efficiency, equations",
            "reproduction",
            "least pretension, equations, N",
            "least tension of the bench just above / below, N",
        ],
        rows,
        reading: format!(
            "All orders are the paper's. The last column is the least of the four end tensions in runs at {:.0} % more and {:.0} % less than\n\
             the least pretension; the bench's tendons are linear, so a negative tension is a tendon that would be slack. Efficiency\n\
             is low because the load is light: friction grows with pretension, not with load, and 10 N just bear this one. Panel d\n\
             compares the radii at equal pretension; the least pretension falls as 1/r, and with each pair at its own the radius\n\
             makes no difference (derivation, section 8).",
            100.0 * TRIED,
            100.0 * TRIED
        ),
        figures: vec![("fig-9", "Output torque over input torque in four comparisons", plot(all)?)],
    })
}

fn plot(all: &[(EfficiencyPanel, Vec<EfficiencyRun>)]) -> Result<String, String> {
    let panels: Vec<Panel> = all
        .iter()
        .map(|(panel, runs)| Panel {
            title: format!("Fig. 9{}: {}", panel.letter, panel.varied),
            x: "T_in, N·m",
            y: "T_out, N·m",
            lines: runs
                .iter()
                .map(|run| {
                    let from = run.samples.partition_point(|sample| sample.t_s < FROM_S);
                    let name = format!("{}: {:.0} %", run.name, 100.0 * run.efficiency);
                    line(name, &run.samples[from..], |s| (s.torque_in_nm, s.torque_out_nm))
                })
                .collect(),
            marks: Vec::new(),
        })
        .collect();
    figure(&panels, 2)
}
