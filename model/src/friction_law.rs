//! Laws of sheath friction: what a rig states, and what an effect may replace.

/// How friction acts along the sheath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrictionLaw {
    /// Along the whole sheath; a part of the tendon may stick while the rest slips.
    Distributed,
    /// All of it at one contact in the middle: the lumped loop of Eq. (17)–(24).
    Lumped,
}
