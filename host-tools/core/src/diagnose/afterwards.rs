//! The bench after its recordings: what happened at a moment has happened, what has passed is gone, and creep and drift go
//! on from where they are.

use bowden_model::effect::ActiveEffect;
use bowden_model::effects;

use crate::joint_model::JointModel;

/// `model` after `clock_s` seconds of recordings. The first `own` effects are the rig's and stay as it states them.
pub(super) fn afterwards(model: &JointModel, own: usize, clock_s: f64) -> JointModel {
    let mut now = model.clone();
    let found = now.effects.split_off(own);
    for effect in found {
        let mut aged = effect;
        let left = effect.effect.after(&mut aged.parameters, clock_s);
        if let Some(sheath) = &mut now.parameters.sheath {
            sheath.friction_coefficient *= left.friction_factor;
        }
        if left.offset != 0.0 {
            let offset = effects::find("sensor_offset").map(ActiveEffect::with_defaults);
            let offset = offset.map(|offset| offset.with("offset", left.offset));
            now.effects.extend(offset.map(|offset| ActiveEffect { target: effect.target, ..offset }));
        }
        now.effects.extend(left.goes_on.then_some(aged));
    }
    now
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::*;
    use crate::recording::Recording;
    use crate::test_bench;

    fn after(clock_s: f64, effects: &[ActiveEffect]) -> JointModel {
        let rig = test_bench::rig();
        let recording = Recording::new("any", vec![0.0, 1.0])
            .with(bowden_model::channel::Channel::ThetaIn, vec![0.0, 0.0]);
        let model = JointModel::from_rig(&rig, &recording).unwrap();
        afterwards(&JointModel { effects: effects.to_vec(), ..model }, 0, clock_s)
    }

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    /// 0.12 that falls by a hundredth a second for 20 s is 0.096; what falls on by the same amount is a larger share of that.
    #[test]
    fn a_drift_goes_on_from_where_it_is() {
        let now = after(20.0, &[effect("friction_drift").with("rate_per_s", -0.01)]);
        let friction = now.parameters.sheath.unwrap().friction_coefficient;
        assert!((friction - 0.096).abs() < 1e-12, "{friction}");
        let rate = now.effects[0].parameters[0];
        assert!((rate * friction - -0.01 * 0.12).abs() < 1e-12, "{rate}");
    }

    /// A rate of 0.01/s that loses 2 % of itself a second is e^{-1} of that after 50 s; by then the friction has changed by (1 - e^{-1}) 0.01 / 0.02.
    #[test]
    fn a_drift_that_fades_goes_on_at_the_rate_that_is_left() {
        let drift = effect("friction_drift").with("rate_per_s", 0.01).with("fading_per_s", 0.02);
        let now = after(50.0, &[drift]);
        let friction = now.parameters.sheath.unwrap().friction_coefficient;
        assert!((friction / 0.12 - 1.316_060).abs() < 1e-6, "{friction}");
        let rate = now.effects[0].parameters[0];
        assert!((rate * friction / 0.12 - 0.003_678_79).abs() < 1e-7, "{rate}");
        assert_eq!(now.effects[0].parameters[1], 0.02);
    }

    /// Friction that falls to half its value with a time constant of 10 s has, after as long, 1 - 0.5 (1 - 1/e) of it.
    #[test]
    fn what_has_set_in_does_not_begin_anew() {
        let law = bowden_model::law::find("law_sheath_friction_sets_in").unwrap();
        let active = ActiveEffect::with_defaults(law).with("amplitude", -0.5).with("time_constant_s", 10.0);
        let now = after(10.0, &[active]);
        let friction = now.parameters.sheath.unwrap().friction_coefficient;
        assert!((friction / 0.12 - 0.683_939_7).abs() < 1e-6, "{friction}");
        // At last it is half of what it was.
        assert!((friction * (1.0 + now.effects[0].parameters[0]) - 0.06).abs() < 1e-12);
    }

    /// A reading that warms up keeps what it has drifted as an offset; a swing goes on where it is: a quarter of a second at 7 Hz is
    /// a turn and three quarters.
    #[test]
    fn a_sensor_goes_on_from_where_it_is() {
        let law = |id| ActiveEffect::with_defaults(bowden_model::law::find(id).unwrap());
        let warm = law("law_reading_sets_in").with("amplitude", 2.0).with("time_constant_s", 10.0);
        let now = after(10.0, &[warm]).effects;
        let [offset, rest] = &now[..] else { panic!("{now:?}") };
        assert_eq!((offset.descriptor().id, offset.target), ("sensor_offset", warm.target));
        assert!((offset.parameters[0] - 1.264_241_1).abs() < 1e-6, "{offset:?}");
        assert!((rest.parameters[0] - 0.735_758_9).abs() < 1e-6, "{rest:?}");
        let swing = law("law_reading_over_time").with("frequency_hz", 7.0).with("phase_rad", 1.0);
        let now = after(0.25, &[swing]).effects;
        let turned = std::f64::consts::FRAC_PI_2;
        assert!((now[0].parameters[2] - (1.0 - turned)).abs() < 1e-9, "{now:?}");
    }

    #[test]
    fn what_has_crept_does_not_begin_anew() {
        let creep = effect("tendon_creep").with("ratio", 0.3);
        assert_eq!(after(20.0, &[creep]).effects, [creep.with("age_s", 20.0)]);
        assert_eq!(after(20.0, &[creep.with("age_s", 5.0)]).effects, [creep.with("age_s", 25.0)]);
    }

    #[test]
    fn a_moment_has_been_and_a_disturbance_passes() {
        let lost = after(20.0, &[effect("pretension_loss").with("time_s", 12.0)]);
        assert_eq!(lost.effects, [effect("pretension_loss").with("time_s", 0.0)]);
        let disturbed = effect("wrap_angle_disturbed").with("start_s", 5.0).with("duration_s", 4.0);
        assert_eq!(after(20.0, &[disturbed]).effects, []);
        assert_eq!(after(8.0, &[disturbed]).effects, [disturbed]);
    }
}
