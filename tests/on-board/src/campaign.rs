//! A campaign of faults: the joint is driven by the release image on the emulated board, something breaks, and what happens is judged.
//!
//! [`catalogue`] lists the kinds of faults, [`phase`] what the joint does meanwhile, [`case`] draws one of each by its name, [`run`] runs
//! it, [`healthy`] holds the runs without a fault that it is compared with, [`judgement`] says what it was, [`page`] makes the tables.

pub mod case;
pub mod catalogue;
pub mod draw;
pub mod healthy;
pub mod judgement;
pub mod operator;
pub mod page;
pub mod phase;
pub mod run;
pub mod trouble;
