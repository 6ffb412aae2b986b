//! Findings made up for tests: no simulation behind them, but every part of a report in them.

use std::collections::BTreeMap;

use crate::diagnose::verdict::{
    ChannelFit, Diagnosis, Estimate, Findings, Fit, FreeForm, MapAxis, MapChannel, Mismatch, NamedEffect,
    Recalibrated, RegimeResidual, ResidualMap, Rival, SCHEMA, StageLoss, Trace, Unexplained, Verdict,
};

/// Channels with unit, amplitude, and error of the rig file as a part of it.
const CHANNELS: [(&str, &str, f64, f64); 8] = [
    ("f1_n", "N", 14.0, 0.22),
    ("f2_n", "N", 11.0, 0.35),
    ("f3_n", "N", 14.0, 0.20),
    ("f4_n", "N", 11.0, 0.31),
    ("i_motor_a", "A", 0.8, 0.12),
    ("motor_torque_nm", "N m", 0.004, 0.9),
    ("theta_in_rad", "rad", 0.9, 0.04),
    ("theta_out_rad", "rad", 0.8, 0.10),
];

/// Findings with `samples` samples at 1 kHz in each of eight channels.
pub(crate) fn findings(samples: usize) -> Findings {
    Findings { diagnosis: diagnosis(), traces: traces(samples), regimes: regimes() }
}

/// Findings of a rig that needs nothing.
pub(super) fn consistent() -> Findings {
    let mut findings = findings(500);
    findings.diagnosis.verdict = Verdict::Consistent;
    findings.diagnosis.effects.clear();
    findings.diagnosis.recalibrated.clear();
    findings.diagnosis.indistinguishable.clear();
    findings.diagnosis.mismatch.clear();
    findings.diagnosis.unexplained = None;
    findings
}

fn estimate(value: f64, std: Option<f64>, unit: &str) -> Estimate {
    Estimate { value, std, unit: unit.into(), at_bound: std.is_none() }
}

fn diagnosis() -> Diagnosis {
    let sheath = NamedEffect {
        id: "wrap_angle_disturbed".into(),
        component: "transmission".into(),
        probability: 0.9997,
        onset_s: Some(21.4),
        channel: None,
        bench: None,
        parameters: BTreeMap::from([
            ("extra_wrap_angle_rad".into(), estimate(0.8231, Some(0.0214), "rad")),
            ("duration_s".into(), estimate(6.31, Some(0.12), "s")),
        ]),
        further: vec![],
        heldout_improvement: 0.714,
        training_improvement: 0.722,
        sentence:
            "Something bent the sheath between 21.4 s and 27.7 s, which raised friction at the output ends."
                .into(),
        rivals: vec![Rival {
            id: "friction_drift".into(),
            formula: None,
            probability: 0.0003,
            separating_experiment:
                "repeat the triangle after the sheath has been left alone for ten minutes.".into(),
        }],
    };
    let motor = NamedEffect {
        id: "motor_coulomb_friction".into(),
        component: "motor".into(),
        probability: 0.962,
        onset_s: None,
        channel: None,
        bench: None,
        parameters: BTreeMap::from([("torque_nm".into(), estimate(0.003_92, Some(0.000_31), "N m"))]),
        further: vec![],
        heldout_improvement: 0.083,
        training_improvement: 0.170,
        sentence: "The motor loses a constant torque against its direction of motion.".into(),
        rivals: vec![],
    };
    let sensor = NamedEffect {
        id: "sensor_offset".into(),
        component: "sensors".into(),
        probability: 0.88,
        onset_s: None,
        channel: Some("f4_n".into()),
        bench: None,
        parameters: BTreeMap::from([("offset".into(), estimate(2.0, None, "N"))]),
        further: vec![],
        heldout_improvement: 0.031,
        training_improvement: 0.164,
        sentence: "The sensor of f4_n reads too high by a constant.".into(),
        rivals: vec![Rival {
            id: "asymmetric_friction".into(),
            formula: None,
            probability: 0.11,
            separating_experiment: "hold still with both tendons slack and read all four sensors.".into(),
        }],
    };
    let mismatch = |component: &str, channel: &str, regime: &str, from: f64, to: f64, share: f64| Mismatch {
        component: component.into(),
        channel: channel.into(),
        regime: regime.into(),
        t_start_s: from,
        t_end_s: to,
        share,
    };
    let recalibrated =
        |parameter: &str, nominal: f64, fitted: f64, std: Option<f64>, unit: &str| Recalibrated {
            bench: None,
            parameter: parameter.into(),
            nominal,
            fitted,
            std,
            unit: unit.into(),
            at_bound: std.is_none(),
        };
    let fits = CHANNELS.iter().map(|&(channel, _, amplitude, error)| {
        let before_rmse = 0.7 * amplitude * error;
        let fit = ChannelFit {
            before_rmse,
            recalibrated_rmse: 0.55 * before_rmse,
            after_rmse: 0.08 * before_rmse,
            noise_rmse: 0.07 * before_rmse,
            free_run: false,
        };
        (channel.to_owned(), fit)
    });
    Diagnosis {
        schema: SCHEMA.into(),
        verdict: Verdict::MissingPhysics,
        summary: "Between 21.4 s and 27.7 s the sheath wrapped by 0.82 rad more than the rig file says. \
                  With that, friction in the motor and an offset of f4_n, the simulation meets data it has not seen."
            .into(),
        effects: vec![sheath, motor, sensor],
        recalibrated: vec![
            recalibrated("sheath.friction_coefficient", 0.10, 0.1237, Some(0.0018), "1"),
            recalibrated("tendon.axial_stiffness_n", 25_000.0, 21_430.0, Some(260.0), "N"),
            recalibrated("motor.rotor_inertia_kg_m2", 1.2e-5, 1.31e-5, Some(2.0e-7), "kg m^2"),
            recalibrated("load.viscous_nm_s_per_rad", 0.02, 0.5, None, "N m s/rad"),
        ],
        differing: Vec::new(),
        indistinguishable: vec![vec!["sheath.wrap_angle_rad".into(), "sheath.friction_coefficient".into()]],
        mismatch: vec![
            mismatch("transmission", "f2_n", "moving", 21.38, 27.71, 0.413),
            mismatch("transmission", "f4_n", "moving", 21.41, 27.69, 0.297),
            mismatch("motor", "motor_torque_nm", "reversal", 0.52, 39.2, 0.121),
            mismatch("sensors", "f4_n", "hold", 0.0, 39.99, 0.094),
        ],
        unexplained: Some(Unexplained {
            component: "joint".into(),
            channel: "theta_out_rad".into(),
            depends_on: vec!["theta_out_rad".into(), "torque_out_nm".into()],
            period_rad: Some(0.233),
            frequency_hz: None,
            free_form: Some(FreeForm {
                variable: "theta_out_rad".into(),
                variable_unit: "rad".into(),
                per_ampere: false,
                unit: "N".into(),
                points: (0..=32)
                    .map(|k| 0.233 * f64::from(k) / 32.0)
                    .map(|x| [x, 1.4 * (27.0 * x + 0.4).sin()])
                    .collect(),
                points_backwards: Vec::new(),
                heldout: true,
                heldout_rms_before: 1.21,
                heldout_rms_after: 0.534,
                heldout_share: 0.805,
            }),
            modelled: false,
            law: None,
            sentence: "Close to the end of its travel the joint moves less than the tendons say.".into(),
        }),
        hypotheses: Vec::new(),
        laws: Vec::new(),
        residual_map: residual_map(),
        policy: crate::diagnose::policy::POLICY,
        heldout_loss: StageLoss { before: 9.4, recalibrated: 6.2, after: 1.1 },
        training_loss: StageLoss { before: 9.1, recalibrated: 6.0, after: 1.0 },
        ordinary: Vec::new(),
        search: Vec::new(),
        fit: Fit { heldout: true, channels: fits.collect() },
        rig: "bench 3, left elbow".into(),
        recordings: vec!["elbow_triangle.mcap".into()],
        heldout: vec!["elbow_triangle.mcap, 8.00 s to 12.00 s".into(), "elbow_triangle.mcap, 30.00 s to 36.00 s".into()],
        complete: true,
        written_by: "bowden 0.1.0".into(),
    }
}

/// Twelve bins of four variables; differences grow with the variable, and one bin of speed is empty.
fn residual_map() -> ResidualMap {
    let axes = [
        ("theta_rad", "rad", -0.75, 0.75),
        ("omega_rad_s", "rad/s", -3.1, 2.9),
        ("tension_n", "N", 11.0, 62.0),
        ("t_s", "s", 0.3, 40.0),
    ];
    let edges = |low: f64, high: f64| (0..=12).map(|k| low + (high - low) * f64::from(k) / 12.0).collect();
    let bins = |axis: usize, largest: f64| -> Vec<Option<f64>> {
        (0..12).map(|k| (axis != 1 || k != 11).then_some(largest * (1.0 + f64::from(k)) / 12.0)).collect()
    };
    let over = |largest: f64| (0..axes.len()).map(|axis| bins(axis, largest)).collect();
    ResidualMap {
        axes: axes
            .map(|(variable, unit, low, high)| MapAxis {
                variable: variable.into(),
                unit: unit.into(),
                edges: edges(low, high),
            })
            .to_vec(),
        channels: CHANNELS
            .map(|(channel, unit, amplitude, error)| MapChannel {
                channel: channel.into(),
                unit: unit.into(),
                before_rmse: over(amplitude * error),
                after_rmse: over(0.1 * amplitude * error),
            })
            .to_vec(),
    }
}

fn traces(samples: usize) -> Vec<Trace> {
    let mut state = 1_u32;
    // Sum of three uniform numbers: close to a bell, standard deviation 0.5.
    let mut noise = move || {
        (0..3)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1_u32 << 24) - 0.5
            })
            .sum::<f64>()
    };
    let t_s: Vec<f64> = (0..samples).map(|i| i as f64 * 1e-3).collect();
    CHANNELS
        .iter()
        .enumerate()
        .map(|(k, &(channel, unit, amplitude, error))| {
            let truth = |t: f64| {
                let turn = (0.9 * t + 0.2 * k as f64).sin() + 0.3 * (2.3 * t).sin();
                amplitude * (1.4 + turn.clamp(-0.9, 0.9))
            };
            let missing = |t: f64| {
                let disturbed = if (21.4..27.7).contains(&t) { 1.0 } else { 0.25 };
                amplitude * error * disturbed * (0.9 * t).cos().signum() * (1.0 + 0.2 * (3.0 * t).sin())
            };
            Trace {
                channel: channel.into(),
                unit: unit.into(),
                measured: t_s.iter().map(|t| truth(*t) + 0.1 * amplitude * error * noise()).collect(),
                before: t_s.iter().map(|t| truth(*t) - missing(*t)).collect(),
                after: t_s.iter().map(|t| truth(*t) - 0.05 * missing(*t)).collect(),
                held_out: t_s.iter().map(|t| (8.0..12.0).contains(t) || (30.0..36.0).contains(t)).collect(),
                t_s: t_s.clone(),
            }
        })
        .collect()
}

fn regimes() -> Vec<RegimeResidual> {
    CHANNELS
        .iter()
        .flat_map(|&(channel, unit, amplitude, error)| {
            [("reversal", 1.0), ("hold", 0.35), ("slow", 0.6), ("moving", 0.8)].map(|(regime, part)| {
                RegimeResidual {
                    channel: channel.into(),
                    unit: unit.into(),
                    regime: regime.into(),
                    before_rmse: amplitude * error * part,
                    recalibrated_rmse: 0.6 * amplitude * error * part,
                    after_rmse: 0.07 * amplitude * error,
                }
            })
        })
        .collect()
}
