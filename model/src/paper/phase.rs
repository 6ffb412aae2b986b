//! Segments of the torque loop: section 3.2 and Figure 4.
//!
//! The paper's text says A to G, its list goes to H. In the list the lines of G and H are the same; by symmetry with D
//! and E, G is the part of the forward slip where `T_in` is still negative. "Increases" and "decreases" in the list
//! speak of the magnitude of `T_in`. A sine of `(r2/r1) T_in` with an amplitude above 2 M visits A B C D E F G H C D ...;
//! between M and 2 M the holds last beyond `T_in` = 0 and D and G are skipped; up to M nothing slips.

use super::capstan::Direction;

/// Whether the output follows the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// Inside the friction band: the output stands.
    Hold,
    /// Both tendons slip and the pulleys turn this way.
    Slip(Direction),
}

/// Where on the torque loop the pair is. + is the paper's clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TorquePhase {
    /// A: standstill before the first slip.
    InitialHold,
    /// B: slip in + direction with `T_in` ≥ 0, before any slip in - direction.
    FirstForwardLoading,
    /// C: standstill after slip in + direction, `|(r2/r1) T_in - T_out| ≤ M`.
    HoldAfterForward,
    /// D: slip in - direction while `T_in` > 0 falls to 0.
    BackwardUnloading,
    /// E: slip in - direction with `T_in` ≤ 0, magnitude growing.
    BackwardLoading,
    /// F: standstill after slip in - direction.
    HoldAfterBackward,
    /// G: slip in + direction while `T_in` < 0 returns to 0.
    ForwardUnloading,
    /// H: as B, once the loop has been through a slip in - direction.
    ForwardLoading,
}

impl TorquePhase {
    /// The paper's letter.
    pub fn letter(self) -> char {
        match self {
            Self::InitialHold => 'A',
            Self::FirstForwardLoading => 'B',
            Self::HoldAfterForward => 'C',
            Self::BackwardUnloading => 'D',
            Self::BackwardLoading => 'E',
            Self::HoldAfterBackward => 'F',
            Self::ForwardUnloading => 'G',
            Self::ForwardLoading => 'H',
        }
    }

    pub(crate) fn of(
        regime: Regime,
        last_slip: Option<Direction>,
        has_slipped_backward: bool,
        torque_in_nm: f64,
    ) -> Self {
        match (regime, last_slip) {
            (Regime::Slip(Direction::Positive), _) if torque_in_nm < 0.0 => Self::ForwardUnloading,
            (Regime::Slip(Direction::Positive), _) if has_slipped_backward => Self::ForwardLoading,
            (Regime::Slip(Direction::Positive), _) => Self::FirstForwardLoading,
            (Regime::Slip(Direction::Negative), _) if torque_in_nm > 0.0 => Self::BackwardUnloading,
            (Regime::Slip(Direction::Negative), _) => Self::BackwardLoading,
            (Regime::Hold, None) => Self::InitialHold,
            (Regime::Hold, Some(Direction::Positive)) => Self::HoldAfterForward,
            (Regime::Hold, Some(Direction::Negative)) => Self::HoldAfterBackward,
        }
    }
}
