//! The four tension channels: newtons from codes, and whether they can be believed.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Angle, Code, Debounce, Gain, Quantity, Sum, Tension, Weight};
use crate::sheath::Fitted;

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
    /// Which channels are there.
    pub fitted: Fitted,
    /// Pretension F0.
    pub pretension: Tension,
    /// `2 EA r1/L`: twice the tension that a lag at the input pulley gives a cable.
    pub stretch: Gain<Angle, Tension>,
    /// How far the sum of both ends may be from the one that the stretch tells.
    pub stretch_margin: Tension,
    /// Ticks for which they have to disagree, at least 1: longer than an encoder that stands needs to be found.
    pub stretch_ticks: u16,
    /// Largest ratio of the tensions at both ends, `e^(mu K + margin)` of the largest `mu K` that a sheath may have.
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
    unlike_stretch: [Debounce; 2],
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
    /// over, whatever the cable does: that is `|ln(f2/f1)| ≤ mu K` of Eq. (2)-(3) with margins, without a division. `mu K` is
    /// the largest that a sheath may have, so this check follows a sheath wherever it is moved. What it no longer sees, a
    /// channel that drifts, stands still or belongs to another cable, contradicts the stretch: `f1 + f2 = 2 F0 + 2 EA r1 lag/L`
    /// and `f3 + f4` with the other sign, from Eq. (6)-(9), within [`TensionConfig::stretch_margin`]. `lag` is
    /// `theta_in - (r2/r1) theta_out`. Where only f1 and f3 are there, the stretch stands for the other end.
    pub fn watch(
        &mut self,
        config: &TensionConfig,
        checks: TensionChecks,
        codes_raw: [u16; 4],
        tensions: [Tension; 4],
        lag: Angle,
    ) -> Option<Detection> {
        let [low, high] = config.rail_raw;
        // Each in one comparison: the lower limit is the lesser one of both.
        let at_rail = |code_raw: u16| code_raw.wrapping_sub(low) > high.wrapping_sub(low);
        let off = |tension: Tension| !tension.is_within(config.slack, config.over);
        let wrong = |n: usize| at_rail(codes_raw[n]) || off(tensions[n]);
        let any = match config.fitted {
            Fitted::All => wrong(0) || wrong(1) || wrong(2) || wrong(3),
            Fitted::Input => wrong(0) || wrong(2),
            Fitted::Nothing => false,
        };
        let found = if any {
            self.channels(config, checks, codes_raw, tensions)
        } else {
            // Nearly always.
            (self.rail, self.slack, self.over) = Default::default();
            None
        };
        let inconsistent = self.compare(config, tensions, lag);
        found.or(inconsistent.filter(|_| checks.load))
    }

    /// Tensions behind the low-pass of the comparison; none where nothing is measured.
    #[inline]
    #[must_use]
    pub fn filtered(&self) -> Option<[Tension; 4]> {
        self.filtered.as_ref().map(|sums| core::array::from_fn(|n| sums[n].value()))
    }

    /// The channels one by one, and the first fault.
    #[cold]
    #[inline(never)]
    fn channels(
        &mut self,
        config: &TensionConfig,
        checks: TensionChecks,
        codes_raw: [u16; 4],
        tensions: [Tension; 4],
    ) -> Option<Detection> {
        let channels = [0, 1, 2, 3].map(|n| {
            let there = config.fitted.has(n);
            there.then(|| self.channel(config, checks, n, codes_raw[n], tensions[n])).flatten()
        });
        channels.into_iter().flatten().next()
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

    fn compare(&mut self, config: &TensionConfig, tensions: [Tension; 4], lag: Angle) -> Option<Detection> {
        if config.fitted == Fitted::Nothing {
            return None;
        }
        let sums = self.filtered.get_or_insert_with(|| tensions.map(Sum::at));
        let filtered: [Tension; 4] = core::array::from_fn(|n| sums[n].approach(config.filter, tensions[n]));
        let twice_stretch = config.stretch.apply(lag);
        let twice_rest = config.pretension.plus(config.pretension);
        let ends = |cable: usize| {
            let from_stretch =
                if cable == 0 { twice_rest.plus(twice_stretch) } else { twice_rest.minus(twice_stretch) };
            let input = filtered[2 * cable];
            let output = match config.fitted {
                Fitted::All => filtered[2 * cable + 1],
                Fitted::Input | Fitted::Nothing => from_stretch.minus(input),
            };
            Ends::new(config, input, output, from_stretch)
        };
        let cables = [ends(0), ends(1)];
        if cables[0].fit(config) && cables[1].fit(config) {
            // Nearly always.
            (self.inconsistent, self.unlike_stretch) = Default::default();
            return None;
        }
        self.misfit(config, &cables)
    }

    /// Counts how long ends do not fit, and returns the first fault.
    #[cold]
    #[inline(never)]
    fn misfit(&mut self, config: &TensionConfig, cables: &[Ends; 2]) -> Option<Detection> {
        let mut found = None;
        for (cable, ends) in cables.iter().enumerate() {
            let Ends { more, allowed, apart } = *ends;
            let wrong = self.inconsistent[cable].count(more > allowed, config.consistency_ticks);
            let unlike = self.unlike_stretch[cable].count(ends.unlike(config), config.stretch_ticks);
            if found.is_none() && wrong {
                found =
                    Some(Detection::new(Fault::TensionInconsistent, cable, more.to_f32(), allowed.to_f32()));
            } else if found.is_none() && unlike {
                let (got, limit) = (apart.magnitude().to_f32(), config.stretch_margin.to_f32());
                found = Some(Detection::new(Fault::StretchInconsistent, cable, got, limit));
            }
        }
        found
    }
}

/// Both ends of a cable.
#[derive(Clone, Copy)]
struct Ends {
    /// The larger tension, and how large it may be.
    more: Tension,
    allowed: Tension,
    /// Sum of both less the one that the stretch tells.
    apart: Tension,
}

impl Ends {
    #[inline]
    fn new(config: &TensionConfig, input: Tension, output: Tension, from_stretch: Tension) -> Self {
        let (less, more) = if input < output { (input, output) } else { (output, input) };
        Self {
            more,
            allowed: config.ratio.apply(less).plus(config.margin),
            apart: input.plus(output).minus(from_stretch),
        }
    }

    /// Whether they contradict the stretch.
    #[inline]
    fn unlike(self, config: &TensionConfig) -> bool {
        !self.apart.is_at_most(config.stretch_margin)
    }

    /// Whether they fit friction and stretch.
    #[inline]
    fn fit(self, config: &TensionConfig) -> bool {
        self.more <= self.allowed && !self.unlike(config)
    }
}
