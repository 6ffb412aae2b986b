//! What the simulated joint conceals, as the name of the port says it: `sim:joint_backlash:0.8,seed=7`.

use virtual_bench::{BenchConfig, ConcealedEffect};

use super::wiring::Wiring;
use crate::error::CommsError;

/// Standard deviation of how far a bench with a seed of its own is off its data sheet: `E A` and `F0` in per cent, others
/// in proportion.
const PERCENT_OFF: f64 = 3.0;

/// Seed of the sensors' noise where the port names none.
const DEFAULT_SEED: u64 = 1;

/// What to do about a name that cannot be used.
const NEXT: &str = "name it sim, or sim:EFFECT[:STRENGTH][,...][,seed=N][,swap=f1-f3][,dead=f2][,reversed=motor] with effects of `virtual-bench effects`";

/// The simulated joint as it really is.
#[derive(Clone, Debug, PartialEq)]
pub struct Concealed {
    /// The bench, without its effects.
    pub(super) bench: BenchConfig,
    /// Physics that no rig file mentions.
    pub(super) effects: Vec<ConcealedEffect>,
    /// Seed of the sensors' noise.
    pub(super) seed: u64,
    /// How the board is wired to it.
    pub(super) wiring: Wiring,
}

impl Default for Concealed {
    /// The bench of the data sheet, nothing concealed.
    fn default() -> Self {
        Self {
            bench: BenchConfig::default(),
            effects: Vec::new(),
            seed: DEFAULT_SEED,
            wiring: Wiring::default(),
        }
    }
}

impl Concealed {
    /// Reads what follows `sim:` in the name of a port. An effect without strength has 1, a clear fault. A seed stands for
    /// another bench of the same data sheet, other details of the effects, and other noise.
    ///
    /// # Errors
    /// [`CommsError::Open`]: an unknown effect, a strength beyond 0 to 5, a seed that is no whole number, an effect that a
    /// bench under a board cannot have.
    pub fn parse(list: &str) -> Result<Self, CommsError> {
        let port = format!("{}:{list}", crate::SIM);
        let refuse = |reason: String| CommsError::Open { port: port.clone(), reason, next: NEXT.into() };
        let mut seed = None;
        let mut wanted = Vec::new();
        let mut wiring = Wiring::default();
        for part in list.split(',').map(str::trim) {
            if let Some(text) = part.strip_prefix("seed=") {
                let number = text
                    .parse()
                    .map_err(|_| refuse(format!("seed: got `{text}`, expected a whole number")))?;
                seed = Some(number);
                continue;
            }
            if let Some((key, value)) = part.split_once('=')
                && wiring.take(key, value).map_err(&refuse)?
            {
                continue;
            }
            let (id, strength) = part.split_once(':').unwrap_or((part, "1"));
            let strength: f64 = strength
                .parse()
                .map_err(|_| refuse(format!("strength of {id}: got `{strength}`, expected a number")))?;
            wanted.push((id, strength));
        }
        let drawn = seed.unwrap_or(DEFAULT_SEED);
        let effects = wanted
            .into_iter()
            .map(|(id, strength)| ConcealedEffect::drawn(id, strength, drawn))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| refuse(error.to_string()))?;
        let mut bench = BenchConfig::default();
        for effect in &effects {
            effect.prepare(&mut bench);
        }
        if let Some(seed) = seed {
            bench = bench.perturbed(seed, PERCENT_OFF);
        }
        virtual_bench::LiveBench::new(&bench, &effects, drawn).map_err(|error| refuse(error.to_string()))?;
        Ok(Self { bench, effects, seed: drawn, wiring })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_strengths_and_seed_are_read() {
        let read = Concealed::parse("joint_backlash:0.5, motor_cogging,seed=9").unwrap();
        let effects = [("joint_backlash", 0.5), ("motor_cogging", 1.0)];
        let effects = effects.map(|(id, strength)| ConcealedEffect::drawn(id, strength, 9).unwrap());
        assert_eq!((read.effects.as_slice(), read.seed), (effects.as_slice(), 9));
        assert_eq!(read.bench, BenchConfig::default().perturbed(9, 3.0));
        assert_eq!(Concealed::parse("joint_spring").unwrap().bench, BenchConfig::default());
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for (list, expected) in [
            ("backlash", "no effect is called 'backlash'"),
            ("joint_backlash:9", "strength 9"),
            ("joint_backlash:big", "strength of joint_backlash: got `big`"),
            ("seed=x", "seed: got `x`"),
            ("sensor_lag", "sensor_lag"),
            ("dead=f9", "dead: got `f9`, expected f1, f2, f3 or f4"),
            ("joint_spring,swaps=f1-f3", "no effect is called 'swaps=f1-f3'"),
            ("joint_spring,joint_spring", "given twice"),
            ("", "no effect is called ''"),
        ] {
            let refused = Concealed::parse(list).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("sim:{list}: ")) && refused.contains(expected), "{refused}");
        }
    }
}
