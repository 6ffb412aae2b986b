//! Sheath friction that is higher at low speed: `μ(v) = μ (1 + (ρ - 1) e^{-|v/v_s|^δ})`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::is_weak;
use libm::{exp, expm1, log};

/// Excess of the friction at rest times the speed over which it falls, m/s, below which it is no more than how contacts give way: over
/// some ten micrometres, less than the count of an encoder. On virtual benches whose sheaths stick, 0.8 to 3.5 mm/s came out; on the
/// fifty that hide nothing, at most 0.09 mm/s, at speeds of 0.1 to 1.4 mm/s.
const LEAST_FALL_M_S: f64 = 2.5e-4;

/// Sheath friction that is higher at low speed: `μ(v) = μ (1 + (ρ - 1) e^{-|v/v_s|^δ})`.
pub struct SheathStribeckFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sheath_stribeck_friction",
    component: Component::Transmission,
    summary: "friction in the sheath that is higher at low speed",
    parameters: &[
        ParameterSpec::linear(
            "static_ratio",
            "1",
            [1.0, 5.0],
            1.6,
            "friction coefficient at standstill over that at speed",
        ),
        ParameterSpec::log(
            "speed_m_s",
            "m/s",
            [1e-5, 0.5],
            0.003,
            "speed at which the excess has fallen to 37 %",
        ),
        ParameterSpec::linear("exponent", "1", [0.5, 3.0], 1.5, "shape of the fall"),
    ],
    neutral: Some(1.0),
    channels: &[],
};

/// Time by which friction follows the speed: the frictional memory of lubricated metal, a few milliseconds (Hess and
/// Soom, J. Tribol. 112 (1990) 147).
const MEMORY_S: f64 = 0.005;

impl Effect for SheathStribeckFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// It falls at a crawl, or hardly.
    fn is_hardly_there(&self, p: &[f64; MAX_PARAMETERS], usual: f64) -> bool {
        (p[0] - 1.0) * p[1] < LEAST_FALL_M_S || is_weak(p[0], 1.0, usual)
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("triangles of equal amplitude at five speeds over two decades")
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut TransmissionPort) {
        let share = -expm1(-port.dt_s / MEMORY_S);
        // Both tendons mostly slip at the same speed: by end, that speed and the excess there.
        let mut known = [[f64::NAN; 2]; 2];
        for (tendon, filtered) in port.tendons.iter_mut().zip(s.chunks_mut(2)) {
            let speeds = tendon.slip_speeds_m_s();
            let ends = tendon.slip.iter_mut().zip(speeds).zip(filtered).zip(&mut known);
            for (((law, speed), filtered), known) in ends {
                *filtered += share * (speed - *filtered);
                if known[0] != *filtered {
                    *known = [*filtered, (p[0] - 1.0) * exp(-exp(p[2] * log(*filtered / p[1])))];
                }
                law.friction_coefficient *= 1.0 + known[1];
            }
        }
    }
}
