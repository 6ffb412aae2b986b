//! Hypotheses and laws of points that this program has met: effects live as long as it does.

use std::sync::{PoisonError, RwLock};

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Descriptor, ParameterSpec};
use bowden_model::law::Port;

use super::{Axis, Hypothesis, Table};

static KNOWN: RwLock<Vec<&'static Hypothesis>> = RwLock::new(Vec::new());

/// The hypothesis that an effect of a simulation is.
#[must_use]
pub fn of(active: &ActiveEffect) -> Option<&'static Hypothesis> {
    find(|known| std::ptr::eq(known.descriptor, active.descriptor()))
}

/// The first of those that `is_it` takes.
pub(super) fn find(is_it: impl Fn(&&'static Hypothesis) -> bool) -> Option<&'static Hypothesis> {
    KNOWN.read().unwrap_or_else(PoisonError::into_inner).iter().find(|known| is_it(known)).copied()
}

/// Takes a hypothesis for good.
pub(super) fn keep(hypothesis: Hypothesis) -> &'static Hypothesis {
    let kept: &'static Hypothesis = Box::leak(Box::new(hypothesis));
    KNOWN.write().unwrap_or_else(PoisonError::into_inner).push(kept);
    kept
}

/// A text for good.
pub(super) fn text(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

/// Declaration of an effect.
pub(super) fn descriptor(
    id: &str,
    port: Port,
    parameters: &[ParameterSpec],
    neutral: Option<f64>,
    channels: &[Channel],
) -> &'static Descriptor {
    Box::leak(Box::new(Descriptor {
        id: text(id),
        component: port.component(),
        summary: port.meaning(),
        parameters: Box::leak(parameters.to_vec().into_boxed_slice()),
        neutral,
        channels: Box::leak(channels.to_vec().into_boxed_slice()),
    }))
}

/// Identifier of a law of points: its name, and a checksum of the points (FNV-1a). Two tables of one name are two effects.
pub(super) fn id_of_points(name: &str, table: &Table) -> String {
    let knots = table.axes().iter().flat_map(Axis::knots);
    let bytes = knots.chain(table.values()).flat_map(|value| value.to_bits().to_le_bytes());
    let sum = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{name}@{sum:016x}")
}
