//! Torque transmission with standstill: Eq. (15)-(17).

use super::capstan::Direction;
use super::error::{PaperError, finite};
use super::pair::TendonPair;
use super::phase::{Regime, TorquePhase};
use super::torque::LoopTorque;

/// `M = 2 F0 r2 mu K`, N·m: friction torque of the pair at the output pulley, ≥ 0. Eq. (15)-(17).
///
/// Exact for even curvature at any load, since the mean tension over both tendons stays F0. For other profiles mu K is
/// replaced by [`super::SheathPath::loss_exponent`]: at mu K = 0.377 by 0.386 (+2.4 %) with all bends at the output
/// end, 0.360 (-4.5 %) at the input end.
pub fn friction_torque_nm(pair: &TendonPair) -> f64 {
    2.0 * pair.pretension_n() * pair.output_radius_m() * pair.path().loss_exponent()
}

/// `T_in` referred to the output pulley, N·m: `(r2/r1) T_in`, times the profile's torque gain (1 in the paper).
fn referred_to_output_nm(pair: &TendonPair, torque_in_nm: f64) -> f64 {
    pair.path().torque_gain() * pair.output_radius_m() / pair.input_radius_m() * torque_in_nm
}

/// `T_out = (r2/r1) T_in ∓ 2 F0 r2 mu K`, N·m: minus in + motion, Eq. (15), plus in - motion, Eq. (16).
///
/// `torque` at either pulley; the output torque of a slipping pair, taut or not (see
/// [`super::EndTensions::is_taut`]). An output torque passes unchanged. For even curvature within 1e-10 N·m of the
/// integrated ODE. Other profiles: gain and M as documented at [`friction_torque_nm`]; with all bends at one end and
/// mu K = 0.377 the paper's gain of 1 is off by 7 %.
pub fn slip_output_torque_nm(pair: &TendonPair, direction: Direction, torque: LoopTorque) -> f64 {
    match torque {
        LoopTorque::Input(t_in_nm) => {
            referred_to_output_nm(pair, t_in_nm) - direction.sign() * friction_torque_nm(pair)
        }
        LoopTorque::Output(t_out_nm) => t_out_nm,
    }
}

/// `T_in = (r1/r2)(T_out ± 2 F0 r2 mu K)`, N·m: Eq. (15)-(16) solved for the input. An input torque passes unchanged.
pub fn slip_input_torque_nm(pair: &TendonPair, direction: Direction, torque: LoopTorque) -> f64 {
    match torque {
        LoopTorque::Input(t_in_nm) => t_in_nm,
        LoopTorque::Output(t_out_nm) => {
            (t_out_nm + direction.sign() * friction_torque_nm(pair)) * pair.input_radius_m()
                / (pair.path().torque_gain() * pair.output_radius_m())
        }
    }
}

/// Power delivered over power received of a pair that slips in `direction`, 1 (section 4.2).
///
/// Where the input drives, `(r1/r2) T_out / T_in = T_out / (T_out + 2 F0 r2 mu K)` for torques in the direction of
/// motion; where the load drives, the inverse. 0 where both sides feed the friction. Torque ratio only: stretch adds
/// no loss over a cycle. With both tendons taut and even curvature it never exceeds `Q_p = exp(-mu K)`.
pub fn efficiency(pair: &TendonPair, direction: Direction, torque: LoopTorque) -> f64 {
    let received_per_m =
        direction.sign() * slip_input_torque_nm(pair, direction, torque) / pair.input_radius_m();
    let delivered_per_m =
        direction.sign() * slip_output_torque_nm(pair, direction, torque) / pair.output_radius_m();
    if received_per_m > 0.0 && delivered_per_m > 0.0 {
        delivered_per_m / received_per_m
    } else if received_per_m < 0.0 && delivered_per_m < 0.0 {
        received_per_m / delivered_per_m
    } else {
        0.0
    }
}

/// Memory of Eq. (17): the output torque while the pair stands, and the way it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueState {
    torque_out_nm: f64,
    last_slip: Option<Direction>,
    has_slipped_backward: bool,
}

/// Result of one step of [`TorqueState::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueStep {
    /// `T_out`, N·m.
    pub torque_out_nm: f64,
    /// Hold or slip.
    pub regime: Regime,
    /// Segment of the torque loop, section 3.2.
    pub phase: TorquePhase,
}

impl TorqueState {
    /// Pair at rest that has not slipped yet, with this output torque, N·m (0 in the paper's segment A).
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if the torque is not finite.
    pub fn at_rest(torque_out_nm: f64) -> Result<Self, PaperError> {
        Ok(Self {
            torque_out_nm: finite("torque_out_nm", torque_out_nm)?,
            last_slip: None,
            has_slipped_backward: false,
        })
    }

    /// Output torque held now, N·m.
    pub fn torque_out_nm(&self) -> f64 {
        self.torque_out_nm
    }

    /// One step of Eq. (17): a play operator of half width M on `(r2/r1) T_in`.
    ///
    /// `T_out(t) = T_out(t⁻)` while `|(r2/r1) T_in - T_out(t⁻)| ≤ M`, else `(r2/r1) T_in ∓ M`. The printed Eq. (17)
    /// switches on `omega_in` instead, which turns over before the output does: read literally it makes `T_out` jump by 2 M
    /// at every reversal, against the paper's own segments C and F. `torque_in_nm`: any step size; the result depends
    /// on the sequence of turning points only.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if the torque is not finite; the state is left as it was.
    pub fn step(&mut self, pair: &TendonPair, torque_in_nm: f64) -> Result<TorqueStep, PaperError> {
        let referred_nm = referred_to_output_nm(pair, finite("torque_in_nm", torque_in_nm)?);
        let friction_nm = friction_torque_nm(pair);
        let (low_nm, high_nm) = (referred_nm - friction_nm, referred_nm + friction_nm);
        let regime = if self.torque_out_nm < low_nm {
            self.torque_out_nm = low_nm;
            Regime::Slip(Direction::Positive)
        } else if self.torque_out_nm > high_nm {
            self.torque_out_nm = high_nm;
            Regime::Slip(Direction::Negative)
        } else {
            Regime::Hold
        };
        if let Regime::Slip(direction) = regime {
            self.last_slip = Some(direction);
            self.has_slipped_backward |= direction == Direction::Negative;
        }
        let phase = TorquePhase::of(regime, self.last_slip, self.has_slipped_backward, torque_in_nm);
        Ok(TorqueStep { torque_out_nm: self.torque_out_nm, regime, phase })
    }
}
