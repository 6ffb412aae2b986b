//! What an investigation says: the content of `investigation.json`, schema `bowden-investigation/1`, and of its page.

use std::fmt::Write as _;

use serde::Serialize;

use super::changes::{Changes, Reason, State};
use super::driver::Recorded;
use super::plan::Plan;
use super::rounds::Round;
use super::verification::{Effect, Verification};
use super::words;
use crate::ParameterSet;

/// Value of `schema`.
pub const SCHEMA: &str = "bowden-investigation/1";

/// Numbers of an investigation, in its folder.
pub const RESULT: &str = "investigation.json";

/// Report of an investigation, in its folder.
pub const PAGE: &str = "investigate.html";

/// One investigation, as far as it came.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Investigation {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Name of the rig.
    pub rig: String,
    /// What the board calls itself.
    pub board: String,
    /// What was to be done.
    pub plan: Plan,
    /// Recordings, in the order in which they were made.
    pub recordings: Vec<Recorded>,
    /// Diagnoses, the last one counts.
    pub rounds: Vec<Round>,
    /// What changes on the board.
    pub parameters: Option<Changes>,
    /// Tracking error.
    pub verification: Option<Verification>,
    /// What was tried before that and taken back.
    pub taken_back: Option<TakenBack>,
    /// Why it ended early; `None` if it did not.
    pub stopped: Option<String>,
    /// Program and version that wrote this.
    pub written_by: String,
}

/// New parameters with which the joint followed worse.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TakenBack {
    /// The parameters.
    pub parameters: Changes,
    /// Tracking error.
    pub verification: Verification,
}

impl Investigation {
    /// One in which nothing was done yet.
    pub fn new(rig: &str, parameters: &ParameterSet, plan: Plan) -> Self {
        Self {
            schema: SCHEMA,
            rig: rig.to_owned(),
            board: parameters.board(),
            plan,
            recordings: Vec::new(),
            rounds: Vec::new(),
            parameters: None,
            verification: None,
            taken_back: None,
            stopped: None,
            written_by: format!("bowden {}", env!("CARGO_PKG_VERSION")),
        }
    }

    /// What became of the board's parameters, and of the tracking error, and of what was found, in up to three sentences.
    pub fn conclusion(&self) -> String {
        if let Some(stopped) = &self.stopped {
            return format!("Ended early: {stopped}.");
        }
        let tracking = self.verification.as_ref().map(Verification::in_words);
        let Some(Changes { state, changes, left, .. }) = &self.parameters else {
            return "Not finished.".to_owned();
        };
        let count = words::parameters(changes.len());
        let parameters = match state {
            State::Unchanged => "No parameter of the board changes".to_owned(),
            State::Declined => format!("{count} would change; declined, nothing was set"),
            State::Set => {
                format!("{count} set until the board is switched off; `bowden params store` keeps them")
            }
            State::Restored => {
                let worse = self.followed_worse();
                let how = if worse { "followed worse" } else { "did not follow better" };
                format!("The joint {how} with the new parameters: the board has its old ones again")
            }
        };
        let mut text = match tracking {
            Some(tracking) => format!("{parameters}; {tracking}."),
            None => format!("{parameters}."),
        };
        if let Some(TakenBack { verification, .. }) = &self.taken_back {
            let _ = write!(
                text,
                " With the corrections of the effects that were found it had followed worse ({}).",
                verification.in_words()
            );
        }
        if !left.is_empty() {
            let left = left.iter().map(|Reason { source, reason }| {
                format!("{} ({reason})", source.strip_prefix("effects.").unwrap_or(source))
            });
            let left: Vec<String> = left.collect();
            let _ = write!(text, " Left as it is: {}.", left.join("; "));
        }
        text
    }

    /// Whether the joint followed worse with the new parameters.
    pub fn followed_worse(&self) -> bool {
        let effect = self.verification.as_ref().and_then(|verification| verification.effect);
        effect == Some(Effect::Worse)
    }
}
