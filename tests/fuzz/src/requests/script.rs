//! Bytes as actions.

use bowden_control::parameters::Parameters;
use bowden_link::ToBoard;
use bowden_link::message::{Goal, Mode, Provocation, Reference, Shape, TableHead};

use crate::joint::Mishap;

/// What is done next.
#[derive(Clone, Debug)]
pub enum Action {
    /// Send a request.
    Ask(ToBoard),
    /// From any state to ready, if the joint lets.
    Prepare,
    /// Let time pass.
    Ticks(u32),
    /// A sensor says something wrong for so many ticks.
    Mishap(Mishap, u32),
    /// The host says nothing for so many ticks.
    Silence(u32),
}

/// Limits of the joint, which are written more often than other parameters.
const LIMITS: [&str; 14] = [
    "bridge.duty_limit",
    "limits.current",
    "limits.angle_minimum",
    "limits.angle_maximum",
    "limits.speed",
    "limits.acceleration",
    "limits.jerk",
    "limits.torque",
    "limits.torque_rate",
    "limits.contact_torque",
    "supervisor.host_timeout",
    "supervisor.homing_speed",
    "reference.ramp_time",
    "supervisor.joint_speed",
];

const MODES: [Mode; 4] = [Mode::Position, Mode::Torque, Mode::Hybrid, Mode::Impedance];
const SHAPES: [Shape; 4] = [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase];

/// Bytes, taken one by one.
pub struct Script<'b>(&'b [u8]);

impl<'b> Script<'b> {
    pub const fn new(bytes: &'b [u8]) -> Self {
        Self(bytes)
    }

    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> Option<T> {
        self.byte().map(|byte| of[usize::from(byte) % of.len()])
    }

    /// A number, mostly between -2 and 2, and sometimes none.
    fn number(&mut self) -> Option<f32> {
        Some(match self.byte()? {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => f32::MAX,
            4 => f32::MIN_POSITIVE,
            5 => -1999.0,
            byte => (f32::from(byte) - 130.0) / 62.5,
        })
    }

    /// A value of a parameter: an end of its range, its default, between, or none that it can have.
    fn value(&mut self, index: u16) -> Option<f32> {
        let Some(specification) = Parameters::specification(index) else { return Some(1.0) };
        let (minimum, maximum) = (specification.minimum, specification.maximum);
        Some(match self.byte()? % 10 {
            0 => minimum,
            1 => maximum,
            2 => f32::NAN,
            3 => maximum * 1.01 + 1.0,
            4 => specification.default,
            // Near the default, where limits are at work.
            5..=7 => specification.default * (f32::from(self.byte()?) / 100.0),
            _ => minimum + (maximum - minimum) * f32::from(self.byte()?) / 255.0,
        })
    }

    /// The next action; none at the end.
    pub fn action(&mut self) -> Option<Action> {
        Some(match self.byte()? % 18 {
            0 | 1 => Action::Prepare,
            2..=4 => Action::Ask(ToBoard::Enter(Goal::Run(self.one(&MODES)?))),
            5 => Action::Ask(ToBoard::Enter(Goal::Home)),
            6 | 7 => Action::Ask(ToBoard::SetReference(self.reference()?)),
            8 => Action::Ticks(1 + u32::from(self.byte()?)),
            9 | 10 => Action::Ticks(16 * (1 + u32::from(self.byte()?))),
            11 | 12 => {
                let index = Parameters::index_of(self.one(&LIMITS)?)?;
                Action::Ask(ToBoard::WriteParameter { index, value: self.value(index)? })
            }
            13 => {
                let index = u16::from(self.byte()?);
                Action::Ask(ToBoard::WriteParameter { index, value: self.value(index)? })
            }
            14 => Action::Ask(self.other()?),
            15 => Action::Mishap(self.mishap()?, u32::from(self.byte()?)),
            16 => Action::Silence(64 * u32::from(self.byte()?)),
            // Any message that bytes can say.
            _ => match postcard::take_from_bytes(self.0) {
                Ok((message, rest)) => {
                    self.0 = rest;
                    Action::Ask(message)
                }
                Err(_) => Action::Ticks(1),
            },
        })
    }

    fn reference(&mut self) -> Option<Reference> {
        Some(match self.byte()? % 5 {
            0 => Reference::Hold(self.number()?),
            1 => Reference::Stream,
            _ => Reference::Generated {
                shape: self.one(&SHAPES)?,
                amplitude: self.number()? * 0.3,
                offset: self.number()? * 0.1,
                frequency_hz: f32::from(self.byte()?) * 0.02,
            },
        })
    }

    fn other(&mut self) -> Option<ToBoard> {
        const PROVOCATIONS: [Provocation; 3] = [Provocation::Panic, Provocation::LateTick, Provocation::Hang];
        Some(match self.byte()? % 16 {
            0 => ToBoard::Enter(Goal::Off),
            1 => ToBoard::Enter(Goal::ClearFault),
            2 => ToBoard::Enter(Goal::Ready),
            3 => ToBoard::DefaultParameters,
            4 => ToBoard::ResetControl,
            5 => ToBoard::StoreParameters,
            6 => ToBoard::EnterBootLoader,
            7 => ToBoard::Hello,
            8 | 9 => {
                let points = [self.number()?, self.number()?, self.number()?];
                ToBoard::StreamPoints(points.into_iter().cycle().take(30).collect())
            }
            10 => ToBoard::Provoke(self.one(&PROVOCATIONS)?),
            11 => {
                let points_raw = [i16::MIN, i16::MAX, 0].into_iter().cycle().take(32).collect();
                ToBoard::WriteTablePoints { first: u16::from(self.byte()?) * 32, points_raw }
            }
            12 => {
                let head = TableHead { period_rad: self.number()?, full_scale_nm: self.number()?, crc: 0 };
                ToBoard::ActivateTable(head)
            }
            13 => ToBoard::ClearTable,
            14 => ToBoard::ReadSnapshot(self.byte()?),
            _ => ToBoard::ReadTablePoints(u16::from(self.byte()?)),
        })
    }

    fn mishap(&mut self) -> Option<Mishap> {
        let which = self.byte()?;
        let place = usize::from(which >> 4);
        Some(match which % 6 {
            0 => Mishap::BadFrame(place % 2),
            1 => Mishap::Stuck(place % 2),
            2 => Mishap::Rail(place % 4),
            3 => Mishap::Current(u16::from(self.byte()?) * 16),
            4 => Mishap::Bus(u16::from(self.byte()?) * 16),
            _ => Mishap::Bridge,
        })
    }
}

/// A sine that is followed, and stopped by a fault; a torque within limits that are narrowed while it acts; a stream; homing; a torque
/// whose duty is limited to a ninth, and one whose current is limited to 1.2 A.
pub fn seeds() -> Vec<Vec<u8>> {
    let sine = [6, 2, 0, 192, 130, 50];
    let followed = [&[0][..], &sine, &[2, 0, 9, 255, 9, 255, 9, 255, 15, 0x12, 90, 9, 30, 14, 1, 8, 20]];
    let torque = [&[0][..], &[6, 0, 160, 2, 1, 9, 90, 11, 7, 5, 60, 9, 90, 12, 1, 5, 30, 9, 200, 14, 0]];
    let stream = [
        &[0][..],
        &[6, 1, 14, 8, 140, 150, 120, 2, 0, 9, 60, 14, 8, 200, 60, 130, 9, 200, 16, 200, 9, 255, 9, 255],
    ];
    let home = [&[0][..], &sine, &[2, 2, 9, 255, 9, 100, 14, 0, 8, 2, 0, 5, 9, 255, 2, 3, 9, 200]];
    let narrowed = [(0, 12), (1, 40)].map(|(limit, percent)| {
        [&[0][..], &[6, 0, 160, 2, 1, 9, 90, 11, limit, 5, percent, 9, 255]].concat()
    });
    [followed.concat(), torque.concat(), stream.concat(), home.concat()].into_iter().chain(narrowed).collect()
}
