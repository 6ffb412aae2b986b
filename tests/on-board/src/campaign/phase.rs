//! What the joint does when something breaks.

use std::fmt;

use bowden_link::message::{Reference, Shape};

use super::draw::Draw;

/// A phase of the board's work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// Power has just come, no host yet.
    Start,
    /// The self test and the pretension check run.
    SelfTest,
    /// The joint is on its way from 0.2 rad to zero.
    Homing,
    /// The joint stands on a stair for 0.75 s, then takes the next one, 0.1 rad away.
    Hold,
    /// A triangle of 0.3 rad at 0.125 Hz: 0.15 rad/s.
    Slow,
    /// A sine of 0.3 rad at 1 Hz.
    Fast,
    /// The same, within 10 ms of a turning point.
    Reversal,
}

impl Phase {
    /// Every phase, in the order of a session.
    pub const ALL: [Self; 7] =
        [Self::Start, Self::SelfTest, Self::Homing, Self::Hold, Self::Slow, Self::Fast, Self::Reversal];

    /// Name in the names of cases.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::SelfTest => "self-test",
            Self::Homing => "homing",
            Self::Hold => "hold",
            Self::Slow => "slow",
            Self::Fast => "fast",
            Self::Reversal => "reversal",
        }
    }

    /// The phase of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|phase| phase.name() == name)
    }

    /// What the joint follows in this phase; behind a start, a self test and a homing it goes on with the fast one.
    pub const fn reference(self) -> Reference {
        let (shape, amplitude, frequency_hz) = match self {
            // A stair of 0.1 rad every second, taken in a quarter of it.
            Self::Hold => (Shape::Staircase, 0.4, 0.0625),
            Self::Slow => (Shape::Triangle, 0.3, 0.125),
            Self::Start | Self::SelfTest | Self::Homing | Self::Fast | Self::Reversal => {
                (Shape::Sine, 0.3, 1.0)
            }
        };
        Reference::Generated { shape, amplitude, offset: 0.0, frequency_hz }
    }

    /// First and last time from the phase's beginning at which a fault comes \[s\].
    pub const fn instants_s(self) -> [f64; 2] {
        match self {
            // Up to the greeting, or to the state ready.
            Self::Start => [0.0, 0.05],
            Self::SelfTest => [0.0, 0.2],
            // 0.2 rad take 0.5 s.
            Self::Homing => [0.02, 0.4],
            // Standing on the second stair, behind the ramp of 0.5 s.
            Self::Hold => [1.3, 1.9],
            // Behind the ramp.
            Self::Slow => [0.55, 0.8],
            Self::Fast => [0.55, 1.3],
            // The first turning point of the sine behind the ramp is at 0.75 s.
            Self::Reversal => [0.74, 0.76],
        }
    }

    /// Time from the phase's beginning to the fault \[s\].
    pub fn instant_s(self, draw: &mut Draw) -> f64 {
        let [first_s, last_s] = self.instants_s();
        draw.uniform(first_s, last_s)
    }

    /// Time that is driven behind the fault, or behind the end of the phase \[s\].
    pub const fn window_s(self) -> f64 {
        match self {
            // A host that is silent is found after 0.5 s.
            Self::Start | Self::SelfTest | Self::Fast | Self::Reversal => 0.9,
            Self::Homing => 0.7,
            Self::Hold => 1.2,
            // 0.15 rad, which tell an encoder that stands, take 1 s.
            Self::Slow => 1.3,
        }
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
