//! Parts of the workspace that tests and benchmarks can be confined to.

use clap::Args;

/// Which parts are run; all when none is named.
#[derive(Debug, Clone, Copy, Args)]
pub struct Parts {
    /// Only what needs neither the board's Rust target nor the emulator
    #[arg(long)]
    host: bool,
    /// Only the release images on the emulated board, and the emulator itself
    #[arg(long)]
    board: bool,
}

impl Parts {
    /// Whether the host's part is run.
    pub fn host(self) -> bool {
        self.host || !self.board
    }

    /// Whether one is named.
    pub fn is_named(self) -> bool {
        self.host || self.board
    }

    /// Whether the board's part is run.
    pub fn board(self) -> bool {
        self.board || !self.host
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_that_is_named_leaves_out_the_other() {
        let run = |host, board| {
            let parts = Parts { host, board };
            (parts.host(), parts.board())
        };
        assert_eq!(
            [run(false, false), run(true, false), run(false, true), run(true, true)],
            [(true, true), (true, false), (false, true), (true, true)]
        );
    }
}
