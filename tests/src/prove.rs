//! The concealed-effects benchmark: rigs of the virtual bench, drawn by seed, diagnosed from their files alone.
//!
//! A [`plan`] says which rigs; [`run`] draws one, writes its files and lets the binary work on them; the [`outcome`] is
//! kept as a line of JSON; [`score`] and [`summary`] judge it against the [`truth`], and [`page`] prints that.
//! [`rivals`] are other tools on the same files; [`lengths`] is what longer recordings cost.

pub mod lengths;
pub mod outcome;
pub mod page;
pub mod plan;
pub mod recorded;
pub mod rivals;
pub mod run;
pub mod score;
pub mod summary;
pub mod tool;
pub mod true_law;
pub mod truth;
