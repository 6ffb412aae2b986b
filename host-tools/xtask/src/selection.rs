//! Which packages of the workspace are built together.
//!
//! Cargo chooses the features of a dependency for the packages that a command selects. With another selection it compiles what they share once
//! more: the emulator, which is C, among it. So every command that may build all of them selects all of them.

use crate::{firmware, python};

/// The emulated board and its tests: no default members of the workspace, because the emulator is built with packages of the system.
pub const EMULATED_BOARD: [&str; 2] = ["bowden-board", "bowden-on-board-tests"];

/// Arguments for cargo that select all that is built for the host; the Python module is left out where there is no Python.
pub fn for_the_host(python: bool) -> Vec<&'static str> {
    let absent = if python { None } else { Some(python::CRATE) };
    let left_out = firmware::packages().into_iter().chain(absent);
    ["--workspace"].into_iter().chain(left_out.flat_map(|package| ["--exclude", package])).collect()
}

/// Arguments for cargo that select the emulated board alone.
pub fn emulated_board() -> impl Iterator<Item = &'static str> {
    EMULATED_BOARD.into_iter().flat_map(|package| ["--package", package])
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::process::{self, cargo};

    #[test]
    fn every_member_of_the_workspace_is_tested_or_an_image() {
        let read =
            process::output(&mut cargo(&["metadata", "--no-deps", "--offline", "--format-version", "1"]));
        let metadata: serde_json::Value = serde_json::from_str(&read.unwrap()).unwrap();
        let default: HashSet<_> = metadata["workspace_default_members"].as_array().unwrap().iter().collect();
        let others = metadata["packages"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|package| !default.contains(&package["id"]));
        let others: HashSet<_> = others.map(|package| package["name"].as_str().unwrap()).collect();
        let known = EMULATED_BOARD.into_iter().chain([python::CRATE]).chain(firmware::packages());
        assert_eq!(others, known.collect());
    }

    #[test]
    fn images_are_not_built_for_the_host_nor_the_module_without_python() {
        let images = ["--workspace", "--exclude", "bowden-firmware", "--exclude", "bowden-measure"];
        assert_eq!(for_the_host(true), images);
        assert_eq!(for_the_host(false)[..5], images);
        assert_eq!(for_the_host(false)[5..], ["--exclude", "bowden-python"]);
    }
}
