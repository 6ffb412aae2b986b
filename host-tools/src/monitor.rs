//! The live view of a joint: a screen, keys, and a recording beside it, each in a thread of its own that reads from one hub.
//!
//! | module | what |
//! |---|---|
//! | [`signals`], [`history`], [`health`] | what is shown of samples and link |
//! | [`panel`], [`view`] | how it is shown |
//! | [`screen`], [`keys`] | the terminal |
//! | [`recording`], [`serving`] | what is written and served meanwhile |

pub mod health;
pub mod history;
pub mod keys;
pub mod panel;
pub mod recording;
pub mod screen;
pub mod serving;
pub mod signals;
pub mod view;
