//! Sections 3 and 4: loops, gaps, efficiency and least pretension of the bench against the equations.

use bowden_paper::efficiency::{panels, run_panel};
use bowden_paper::lubrication_and_radius;
use bowden_paper::torque_phases::{letters, torque_loop};

/// Whether `value` is within `part` of `expected`, both ways.
fn close(value: f64, expected: f64, part: f64) -> bool {
    (value - expected).abs() <= part * expected.abs()
}

#[test]
fn the_torque_loop_of_figure_4_has_the_segments_and_the_width_of_equation_17() {
    let all = torque_loop().expect("runs");
    // Two periods and a half; the loop starts from rest.
    assert_eq!(letters(&all.samples, |sample| sample.predicted), "ABCDEFGHCDEFGHCDE");
    assert_eq!(letters(&all.samples, |sample| sample.recorded), "ABCDEFGHCDEFGHCDE");
    // 4·30 N·15 mm·0.12·pi; the bench's bends are not quite even: loss exponent within 0.3 % of mu K.
    assert!((all.width_predicted_nm - 0.678_584).abs() < 1e-6, "{}", all.width_predicted_nm);
    assert!(close(all.width_nm, all.width_predicted_nm, 0.01), "{}", all.width_nm);
    // Fronts travel for part of the hold: (17) is off by up to a tenth of M then, for a tenth of the time.
    assert!(all.prediction_rms_nm < 0.02 * 0.339, "{} Nm", all.prediction_rms_nm);
    assert!((0.94..1.0).contains(&all.agreement), "{}", all.agreement);
}

#[test]
fn gaps_of_figures_5_to_8_are_those_of_the_equations() {
    let all = lubrication_and_radius::all().expect("runs");
    for loops in &all {
        let ([torque, torque_predicted], [angle, angle_predicted]) =
            (loops.torque_gap_nm, loops.displacement_gap_rad);
        assert!(close(torque, torque_predicted, 0.01), "{}: {torque} {torque_predicted}", loops.name);
        // Straight ends: (psi_r - psi_p)/(psi_r + psi_p) of the bench's bends is 0.296 where even ones have 0.304.
        assert!(close(angle, angle_predicted, 0.03), "{}: {angle} {angle_predicted}", loops.name);
        // The same torque at the joint, as the paper asks: 0.736 sin 0.5 rad.
        assert!(close(loops.largest_torque_out_nm, 0.353, 0.07), "{}", loops.largest_torque_out_nm);
    }
    let [dry, greased, large] = &all;
    // Fig. 5 and 6: both gaps shrink with lubrication. Fig. 7: the torque gap grows with the radius, as r.
    assert!(close(greased.torque_gap_nm[0] / dry.torque_gap_nm[0], 0.5, 0.02));
    assert!(close(large.torque_gap_nm[0] / dry.torque_gap_nm[0], 4.0 / 3.0, 0.02));
    // tanh(0.1571)/tanh(0.3142).
    assert!(close(greased.displacement_gap_rad[0] / dry.displacement_gap_rad[0], 0.5121, 0.03));
    // Fig. 8 shows the opposite: the equations have the angle fall as 1/r.
    assert!(close(large.displacement_gap_rad[0] / dry.displacement_gap_rad[0], 0.75, 0.03));
}

#[test]
fn efficiency_and_least_pretension_of_figure_9_are_those_of_the_equations() {
    for panel in panels() {
        let runs = run_panel(&panel).expect("runs");
        for run in &runs {
            let name = run.name;
            // The pulley follows its reference within a count, which the torque takes part in: 2 % of the weight's.
            assert!(close(run.efficiency, run.efficiency_predicted, 0.02), "{name}: {}", run.efficiency);
            assert!(close(run.driving_torque_nm, run.driving_torque_predicted_nm, 0.02), "{name}");
            let [above, below] = run.tension_above_below_n;
            assert!(above > 0.0 && below < 0.0, "{name}: {above} N, {below} N");
            // Just so: 4 % of the pretension is less than 0.5 N, of which the slackest end shows less than three times.
            assert!(above < 0.5 && below > -1.5, "{name}: {above} N, {below} N");
        }
        // The order that the paper shows.
        for pair in runs.windows(2) {
            assert!(pair[0].efficiency > pair[1].efficiency, "{} {}", pair[0].name, pair[1].name);
            assert!(pair[0].driving_torque_nm < pair[1].driving_torque_nm, "{}", pair[1].name);
        }
    }
}
