//! Gives the program the revision of its sources.

#[path = "../firmware/revision.rs"]
mod revision;

fn main() {
    revision::emit(&[
        "build.rs",
        "../firmware/revision.rs",
        "src",
        "core/src",
        "link/src",
        "../firmware/control/src",
        "../firmware/link/src",
        "../model/src",
    ]);
}
