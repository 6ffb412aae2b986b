//! What the tests across crates share: recordings of the virtual bench as bowden reads them, and where real ones lie.
#![forbid(unsafe_code)]

pub mod direct_drives;
pub mod other_benches;
pub mod prove;
pub mod recovery;
pub mod rounds;
pub mod studies;

use std::path::PathBuf;

use bowden_core::recording::Recording;
use bowden_model::channel::Channel;

/// Folder of real and concealed recordings beside the workspace, if it is there.
#[must_use]
pub fn data_dir() -> Option<PathBuf> {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "shared"].iter().collect();
    folder.is_dir().then_some(folder)
}

/// A file below [`data_dir`]; where it is missing, says on standard output that `test` is skipped.
#[must_use]
pub fn data_file(test: &str, path: &str) -> Option<PathBuf> {
    let file = data_dir().map(|folder| folder.join(path)).filter(|file| file.exists());
    if file.is_none() {
        println!("skipped: {test}: shared/{path} is not beside the workspace");
    }
    file
}

/// A recording of the virtual bench, without the detour over a file.
///
/// # Panics
/// If the virtual bench recorded a column that is no role, which would be a mistake in it.
#[must_use]
pub fn recording_of(bench: &virtual_bench::Recording) -> Recording {
    let mut recording = Recording::new("virtual bench", bench.t_s.clone());
    // A column that was not recorded is empty.
    for (name, values) in bench.columns().into_iter().filter(|(name, v)| *name != "t_s" && !v.is_empty()) {
        let channel =
            Channel::from_role(name).unwrap_or_else(|| panic!("`{name}` is no role of a recording"));
        recording.set(channel, values.to_vec());
    }
    recording
}

/// Root mean square difference of a channel that both recordings have.
///
/// # Panics
/// If one of them lacks the channel.
#[must_use]
pub fn rms_difference(channel: Channel, a: &Recording, b: &Recording) -> f64 {
    let values = |recording: &Recording| -> Vec<f64> {
        let values = recording.channel(channel);
        values.unwrap_or_else(|| panic!("{}: no {}", recording.source(), channel.role())).to_vec()
    };
    let (a, b) = (values(a), values(b));
    let sum: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}
