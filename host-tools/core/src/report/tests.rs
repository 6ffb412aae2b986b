//! The page as a whole: order, completeness, safety, size.

use super::{example, render};
use crate::diagnose::verdict::Estimate;

/// Page without tags and with plain spaces: what a reader sees.
fn text_of(page: &str) -> String {
    let body = page.split_once("<body>").expect("a body").1;
    let mut text = String::new();
    let mut is_tag = false;
    for c in body.chars() {
        match c {
            '<' => is_tag = true,
            '>' => is_tag = false,
            '\u{202f}' if !is_tag => text.push(' '),
            c if !is_tag => text.push(c),
            _ => {}
        }
    }
    text.replace("&gt;", ">").replace("&lt;", "<")
}

#[test]
fn verdict_comes_first_and_sections_follow_in_order() {
    let page = render(&example::findings(2000));
    let sections = ["verdict", "place", "physics", "proof", "traces", "provenance"];
    let places =
        sections.map(|id| page.find(&format!("id=\"{id}\"")).unwrap_or_else(|| panic!("no section {id}")));
    assert!(places.is_sorted(), "{places:?}");
    let text = text_of(&page);
    let opening = text.find("Missing physics: wrap angle disturbed, motor Coulomb friction, sensor offset");
    assert!(opening.is_some_and(|at| at < 60), "verdict at {opening:?}");
    assert!(
        text.find("has not seen.") < text.find("Where simulation and recording differ"),
        "summary stands after the places"
    );
}

#[test]
fn every_finding_is_shown() {
    let text = text_of(&render(&example::findings(2000)));
    // By hand from the example: value to the digits that two digits of its deviation allow.
    for expected in [
        "Wrap angle disturbed wrap_angle_disturbed",
        "> 99.9 %",
        "from 21.40 s on",
        "(0.823 ± 0.021) rad",
        "(6.31 ± 0.12) s",
        "Friction drift friction_drift, < 0.1 %. To tell them apart: repeat the triangle",
        "Motor Coulomb friction motor_coulomb_friction",
        "(0.00392 ± 0.00031) N·m",
        "all the time",
        "Sensor offset sensor_offset",
        "Tension of cable b, joint end f4_n",
        "2.00 N▲ at the end of its range",
        "Asymmetric friction asymmetric_friction, 11 %",
        "sheath.friction_coefficient0.1000.1237 ± 0.0018+23.7 %",
        "tendon.axial_stiffness_n25 000 N(21 430 ± 260) N−14.3 %",
        "motor.rotor_inertia_kg_m21.20 × 10⁻⁵ kg·m²(1.310 ± 0.020) × 10⁻⁵ kg·m²+9.2 %",
        "load.viscous_nm_s_per_rad0.0200 N·m·s/rad0.500 N·m·s/rad+2400 %▲ at the end of its range",
        "sheath.wrap_angle_rad with sheath.friction_coefficient",
        "21.38 s to 27.71 s41 %",
        "Close to the end of its travel the joint moves less than the tendons say.",
        "varies with theta_out_rad, torque_out_nm.",
        // f1_n: before 0.7 * 14 * 0.22 = 2.156; then 0.55, 0.08 and 0.07 of it.
        "Tension of cable a, motor end f1_nN2.161.190.1720.1511.14",
        "bench 3, left elbow",
        "elbow_triangle.mcap, 30.00 s to 36.00 s",
        "bowden 0.1.0",
    ] {
        assert!(text.contains(expected), "{expected:?} is missing");
    }
}

/// Which of two kinds an effect is has no deviation; the table says what it was chosen from.
#[test]
fn a_parameter_that_is_not_fitted_says_which_values_were_tried() {
    let mut findings = example::findings(500);
    let kind = Estimate { value: 1.0, std: None, unit: "1".into(), at_bound: false };
    findings.diagnosis.effects[1].parameters.insert("presliding_exponent".into(), kind);
    let text = text_of(&render(&findings));
    assert!(text.contains("presliding_exponent1.00best of 0 and 1, not fitted"));
}

/// An effect that a part has several times stands in one table, a row each.
#[test]
fn instances_of_an_effect_stand_side_by_side() {
    let mut findings = example::findings(2000);
    let before = render(&findings).matches("<tr").count();
    let effect = &mut findings.diagnosis.effects[0];
    let parameters = effect.parameters.clone();
    effect.further = vec![parameters; 3];
    let page = render(&findings);
    // A heading and four rows in place of a heading and a row for each parameter.
    let rows = findings.diagnosis.effects[0].parameters.len();
    assert_eq!(page.matches("<tr").count(), before - rows + 4);
    for name in findings.diagnosis.effects[0].parameters.keys() {
        assert_eq!(page.matches(&format!("<code>{name}</code>")).count(), 1, "{name}");
    }
}

#[test]
fn a_rival_is_shown_by_its_name_and_a_law_by_its_formula() {
    let mut findings = example::findings(50);
    let rival = &mut findings.diagnosis.effects[0].rivals[0];
    let by_name = format!("<code>{}</code>", rival.id);
    let by_formula = "<code>curvature * value^2</code>";
    assert!(render(&findings).contains(&by_name) && !render(&findings).contains(by_formula));
    findings.diagnosis.effects[0].rivals[0].formula = Some("curvature * value^2".into());
    assert!(render(&findings).contains(by_formula) && !render(&findings).contains(&by_name));
}

#[test]
fn what_several_benches_have_stands_once_in_the_heading_and_once_for_each() {
    let mut findings = example::findings(50);
    let effects = &mut findings.diagnosis.effects;
    effects.push(effects[2].clone());
    for (effect, bench) in effects[2..].iter_mut().zip(["left", "right"]) {
        effect.bench = Some(bench.into());
    }
    let text = text_of(&render(&findings));
    let heading = "Missing physics: wrap angle disturbed, motor Coulomb friction, sensor offset";
    let end = text.find(heading).expect("the heading") + heading.len();
    assert!(!text[end..].starts_with(','), "{}", &text[..end + 20]);
    for bench in ["left", "right"] {
        assert!(text.contains(&format!("sensor_offset on bench {bench}")), "{bench}");
    }
}

#[test]
fn text_from_files_is_escaped() {
    let hostile = "<script>alert(\"x\")</script>&'";
    let mut findings = example::findings(50);
    let diagnosis = &mut findings.diagnosis;
    let (effect, place) = (&mut diagnosis.effects[0], &mut diagnosis.mismatch[0]);
    let (trace, regime) = (&mut findings.traces[0], &mut findings.regimes[0]);
    for text in [
        &mut diagnosis.rig,
        &mut diagnosis.summary,
        &mut diagnosis.written_by,
        &mut diagnosis.recordings[0],
        &mut diagnosis.heldout[0],
        &mut effect.id,
        &mut effect.sentence,
        &mut effect.rivals[0].separating_experiment,
        &mut diagnosis.recalibrated[0].parameter,
        &mut diagnosis.indistinguishable[0][0],
        &mut place.component,
        &mut place.channel,
        &mut trace.channel,
        &mut trace.unit,
        &mut regime.regime,
        &mut regime.channel,
    ] {
        *text = hostile.into();
    }
    let page = render(&findings);
    assert!(!page.to_lowercase().contains("<script"), "text became a tag");
    assert!(page.matches("&lt;script&gt;").count() >= 12, "the text itself is lost");
}

#[test]
fn page_needs_nothing_from_elsewhere() {
    let page = render(&example::findings(2000));
    for outside in ["http", "src=", "href=", "@import", "//", "<script", "<link", "<img"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert_eq!(page.matches("url(").count(), 0);
}

#[test]
fn same_findings_give_the_same_bytes() {
    assert_eq!(render(&example::findings(3000)), render(&example::findings(3000)));
}

#[test]
fn page_of_eight_long_channels_is_small() {
    let page = render(&example::findings(40_000));
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
}

#[test]
fn spike_of_one_sample_reaches_the_plot() {
    let mut findings = example::findings(40_000);
    findings.traces.truncate(1);
    let trace = &mut findings.traces[0];
    trace.before.fill(0.0);
    trace.after.fill(0.0);
    trace.measured.fill(0.0);
    trace.measured[12_345] = 1000.0;
    let page = render(&findings);
    let (_, line) = page.split_once("<polyline class=\"measured\" points=\"").expect("a measured line");
    let points: Vec<(f64, f64)> = line[..line.find('"').expect("an end")]
        .split(' ')
        .map(|point| point.split_once(',').expect("x,y"))
        .map(|(x, y)| (x.parse().expect("x"), y.parse().expect("y")))
        .collect();
    // The axis leaves a twentieth of its data range free at either end: 1000 is at 1.05/1.1 of the strip's height.
    let highest = points.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).expect("points");
    let base = points[0].1;
    assert!((base - highest.1 - 170.0 / 1.1).abs() < 0.2, "spike of {} px", base - highest.1);
    // 12.345 s of 39.999 s on a time axis from 58 px to 1070 px.
    assert!((highest.0 - 370.3).abs() < 0.2, "spike at {} px", highest.0);
    assert!(points.len() < 2100, "{} points", points.len());
}

#[test]
fn simulation_that_runs_away_leaves_the_other_lines_legible() {
    let mut findings = example::findings(4000);
    findings.traces.truncate(1);
    let trace = &mut findings.traces[0];
    for (i, value) in trace.before.iter_mut().enumerate().skip(1000) {
        *value = (i as f64 - 1000.0).exp();
    }
    let span = |values: &[f64]| {
        let (low, high) =
            values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
        high - low
    };
    assert!(span(&trace.measured) > 10.0, "the measured line moves");
    let page = render(&findings);
    assert!(page.contains("Signal, N; rig file leaves the scale"));
    let heights = |class: &str| -> Vec<f64> {
        let (_, line) = page.split_once(&format!("<polyline class=\"{class}\" points=\"")).expect("a line");
        let points = line[..line.find('"').expect("an end")].split(' ');
        points.map(|point| point.split_once(',').expect("x,y").1.parse().expect("y")).collect()
    };
    // The strip is 170 px high and shows at most 1 + 2 * 2 lengths with a twentieth of room at either end.
    assert!(span(&heights("measured")) > 170.0 / 5.0 / 1.1 - 0.2);
    assert!(span(&heights("before")) <= 170.0);
}

#[test]
fn reports_with_little_in_them_still_read() {
    let mut findings = example::consistent();
    let text = text_of(&render(&findings));
    for expected in
        ["Consistent: nothing needs", "No place stands out.", "No effect of the catalogue is named."]
    {
        assert!(text.contains(expected), "{expected:?} is missing");
    }
    assert!(text.contains("No nominal parameter was recalibrated."));

    findings.traces.truncate(1);
    findings.traces[0].before.clear();
    assert!(text_of(&render(&findings)).contains("No samples."));
    findings.traces.clear();
    findings.regimes.clear();
    findings.diagnosis.fit.channels.clear();
    let text = text_of(&render(&findings));
    assert!(text.contains("No traces were kept.") && text.contains("No channel was compared."));
}

#[test]
fn errors_of_a_free_run_are_said_to_be_of_one() {
    let mut findings = example::findings(2000);
    assert!(!render(&findings).contains("free run"));
    findings.diagnosis.fit.channels.get_mut("theta_out_rad").unwrap().free_run = true;
    let page = render(&findings);
    assert!(page.contains(", free run") && page.contains("held to its recorded angle"));
}

#[test]
fn values_that_are_not_finite_never_reach_the_page() {
    let mut findings = example::findings(2000);
    for trace in &mut findings.traces {
        trace.before[10..400].fill(f64::NAN);
        trace.after[700] = f64::INFINITY;
    }
    findings.traces[1].measured.fill(f64::NAN);
    findings.traces[2].t_s[5] = f64::NAN;
    findings.regimes[0].after_rmse = f64::NAN;
    findings.diagnosis.mismatch[0].share = f64::NAN;
    for fit in findings.diagnosis.fit.channels.values_mut() {
        fit.noise_rmse = 0.0;
        fit.before_rmse = f64::NAN;
    }
    let page = render(&findings);
    assert!(!page.contains("NaN") && !page.contains("inf"), "a number that is none is on the page");
}
