//! The four tension channels: newtons from codes, and whether they can be believed.

use bowden_link::Fault;

use crate::scale::{Code, Debounce, Gain, Quantity, Sum, Tension, Weight};
use crate::supervisor::Detection;

/// Volts a code of the 12-bit converters at 3.3 V reference.
pub const V_PER_CODE: f32 = 3.3 / 4095.0;

/// Channels and what is expected of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensionConfig {
    /// Code at 0 N.
    pub zero: [Code; 4],
    /// Tension a code.
    pub gain: [Gain<Code, Tension>; 4],
    /// A code below this or above the other is a broken wire.
    pub rail_raw: [u16; 2],
    /// Below: slack.
    pub slack: Tension,
    /// Above: overloaded.
    pub over: Tension,
    /// Ticks for which a tension has to be wrong, at least 1.
    pub debounce_ticks: u16,
    /// Low-pass ahead of the comparison of both ends.
    pub filter: Weight<Tension, Tension>,
    /// Largest ratio of the tensions at both ends, `e^(mu K + margin)`.
    pub ratio: Gain<Tension, Tension>,
    /// Margin beyond that ratio.
    pub margin: Tension,
    /// Ticks for which they have to disagree, at least 1.
    pub consistency_ticks: u16,
}

/// What counts at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TensionChecks {
    /// Broken wires.
    pub rail: bool,
    /// Slack, overload and the comparison of both ends.
    pub load: bool,
}

/// State of the channels.
#[derive(Clone, Copy, Debug, Default)]
pub struct TensionChannels {
    rail: [Debounce; 4],
    slack: [Debounce; 4],
    over: [Debounce; 4],
    inconsistent: [Debounce; 2],
    filtered: Option<[Sum<Tension>; 4]>,
}

impl TensionConfig {
    /// Tensions f1 to f4, `(code − zero)·gain`, within half a step of 2⁻²⁰ N.
    #[inline]
    #[must_use]
    pub fn tensions(&self, codes_raw: [u16; 4]) -> [Tension; 4] {
        core::array::from_fn(|n| self.gain[n].apply(code(codes_raw[n]).minus(self.zero[n])))
    }
}

/// Code of a converter.
#[inline]
pub(crate) fn code(code_raw: u16) -> Code {
    Code::from_bits(i32::from(code_raw) << Code::FRACTION_BITS)
}

impl TensionChannels {
    /// Watches this tick's codes and tensions; returns the first fault.
    ///
    /// Both ends of a cable fit its friction while `f2 ≤ e^(mu K + margin)·f1 + margin` and the same with f1 and f2 changed
    /// over, whatever the cable does: that is `|ln(f2/f1)| ≤ mu K` of Eq. (2)-(3) with margins, without a division.
    pub fn watch(
        &mut self,
        config: &TensionConfig,
        checks: TensionChecks,
        codes_raw: [u16; 4],
        tensions: [Tension; 4],
    ) -> Option<Detection> {
        let [low, high] = config.rail_raw;
        let at_rail = |code_raw: u16| code_raw < low || code_raw > high;
        let off = |tension: Tension| tension < config.slack || tension > config.over;
        let any_wrong = codes_raw.into_iter().any(at_rail) || tensions.into_iter().any(off);
        let found = if any_wrong {
            let channels = [0, 1, 2, 3].map(|n| self.channel(config, checks, n, codes_raw[n], tensions[n]));
            channels.into_iter().flatten().next()
        } else {
            // Nearly always.
            (self.rail, self.slack, self.over) = Default::default();
            None
        };
        let inconsistent = self.compare(config, tensions);
        found.or(inconsistent.filter(|_| checks.load))
    }

    fn channel(
        &mut self,
        config: &TensionConfig,
        checks: TensionChecks,
        n: usize,
        code_raw: u16,
        tension: Tension,
    ) -> Option<Detection> {
        let [low, high] = config.rail_raw;
        let ticks = config.debounce_ticks;
        let at_low = code_raw < low;
        let rail = self.rail[n].count(at_low || code_raw > high, ticks) && checks.rail;
        let slack = self.slack[n].count(tension < config.slack, ticks) && checks.load;
        let over = self.over[n].count(tension > config.over, ticks) && checks.load;
        if rail {
            let limit_raw = if at_low { low } else { high };
            let volts = |code_raw| f32::from(code_raw) * V_PER_CODE;
            Some(Detection::new(Fault::TensionRail, n, volts(code_raw), volts(limit_raw)))
        } else if slack {
            Some(Detection::new(Fault::Slack, n, tension.to_f32(), config.slack.to_f32()))
        } else if over {
            Some(Detection::new(Fault::OverTension, n, tension.to_f32(), config.over.to_f32()))
        } else {
            None
        }
    }

    fn compare(&mut self, config: &TensionConfig, tensions: [Tension; 4]) -> Option<Detection> {
        let sums = self.filtered.get_or_insert_with(|| tensions.map(Sum::at));
        let filtered: [Tension; 4] = core::array::from_fn(|n| sums[n].approach(config.filter, tensions[n]));
        let mut found = None;
        for cable in [0, 1] {
            let (input, output) = (filtered[2 * cable], filtered[2 * cable + 1]);
            let (less, more) = if input < output { (input, output) } else { (output, input) };
            let allowed = config.ratio.apply(less).plus(config.margin);
            let wrong = self.inconsistent[cable].count(more > allowed, config.consistency_ticks);
            if wrong && found.is_none() {
                found =
                    Some(Detection::new(Fault::TensionInconsistent, cable, more.to_f32(), allowed.to_f32()));
            }
        }
        found
    }
}
