//! The rivals of `cargo xtask prove --rivals` find systems that are known; what is not fair to them would fail here.

use std::path::Path;
use std::process::Command;

#[test]
fn every_rival_finds_what_is_known() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("rivals").join("check");
    let done = Command::new("sh").arg(&script).output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout);
    // Without an environment that is one line: skipped, and what makes it.
    print!("{said}");
    assert!(done.status.success(), "{said}{}", String::from_utf8_lossy(&done.stderr));
}
