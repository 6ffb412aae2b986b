//! Friction coefficients of steel wire in a plastic sheath: chosen, because the paper gives none.
//!
//! Both are from a published table of friction coefficients (pickedshares.com/en/static-and-sliding-friction-values, read
//! in 2026): steel on PTFE 0.04 to 0.22, on a sliding polyethylene about 0.20, on polyamide 0.32 to 0.45 dry and 0.10
//! lubricated. The plastic inside the paper's sheath is not named.

/// Dry: steel on a sliding polyethylene, near the upper end of steel on PTFE \[1\].
pub const DRY: f64 = 0.20;

/// Greased: steel on polyamide, lubricated \[1\].
pub const GREASED: f64 = 0.10;
