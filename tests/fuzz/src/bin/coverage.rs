//! One target under libFuzzer, the one that `BOWDEN_FUZZ_TARGET` names; `names` lists them.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use bowden_fuzz::{TARGETS, Target, target};
use libfuzzer_sys::fuzz_target;

static TARGET: LazyLock<&Target> = LazyLock::new(|| {
    let name = std::env::var("BOWDEN_FUZZ_TARGET").unwrap_or_default();
    target(&name).unwrap_or_else(|| {
        let known = TARGETS.map(|target| target.name).join(", ");
        panic!("BOWDEN_FUZZ_TARGET: got `{name}`, expected one of {known}")
    })
});

/// Lists the targets, or writes the seeds where they are wanted, before the engine reads its folders.
fn begin() {
    if std::env::var("BOWDEN_FUZZ_TARGET").is_ok_and(|name| name == "names") {
        TARGETS.iter().for_each(|target| println!("{}", target.name));
        std::process::exit(0);
    }
    let Some(folder) = std::env::var_os("BOWDEN_FUZZ_SEEDS").map(PathBuf::from) else { return };
    for (number, seed) in (TARGET.seeds)().into_iter().enumerate() {
        fs::write(folder.join(format!("seed-{number}")), seed)
            .expect("the folder of the seeds can be written");
    }
}

fuzz_target!(init: begin(), |bytes: &[u8]| (TARGET.run)(bytes));
