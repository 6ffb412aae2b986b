//! `bowden send`: single steps from one state of a board to another.

use std::ops::ControlFlow;

use bowden_core::outcome::{Failure, Outcome};
use bowden_host_link::LinkError;
use bowden_host_link::recorder::tick_time_s;
use bowden_host_link::session::{RunEnd, RunTick, Session};
use bowden_link::Limit;
use serde::Serialize;

use super::course::{CourseArguments, run_seconds};
use super::faults::{StatusFacts, describe};
use super::port::PortArguments;
use super::{print, print_json, print_json_line};
use crate::interrupt;

/// Arguments of `bowden send`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A joint that moves needs its host: the board stops it with a fault when the host falls silent for longer \
                  than its parameter supervisor.host_timeout. `send home` and `send run` therefore stay until the joint \
                  is at zero or the time is over, print where it is, and leave the bridge off; Ctrl-C ends them early."
)]
pub struct SendArguments {
    #[command(flatten)]
    port: PortArguments,
    /// Print JSON: one object; `run` one object a line, twice a second
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    /// Switch the bridge off
    #[command(visible_alias = "stop")]
    Off,
    /// Self test and pretension check, then ready
    Ready,
    /// From ready: move to angle zero, then ready again
    Home,
    /// From ready: follow a reference for a while, keeping the board company
    Run {
        #[command(flatten)]
        course: CourseArguments,
        /// How long, s; otherwise until Ctrl-C
        #[arg(long, value_parser = run_seconds)]
        seconds: Option<f64>,
    },
    /// Print state, fault, limits and counters
    Status,
    /// From off or fault: leave the firmware for the processor's own boot loader, which takes a new image over USB
    BootLoader,
}

/// Time between two lines of a run, s.
const LINE_INTERVAL_S: f64 = 0.5;

impl SendArguments {
    /// Does one step.
    ///
    /// # Errors
    /// Exit status 2, if the port or a file is not usable; 1, if the board refused, a fault stopped the joint, or the
    /// link broke.
    pub fn run(&self) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        let stop = &interrupt::requested;
        if let Action::Status = self.action {
            let status = self.port.connect()?.status()?;
            if self.json {
                print_json(&StatusFacts::from(&status))?;
            } else {
                print(&describe(&status))?;
            }
            return Ok(Outcome::done());
        }
        if let Action::Run { course, seconds } = &self.action {
            return self.follow(course, *seconds);
        }
        if let Action::BootLoader = self.action {
            self.port.connect()?.enter_boot_loader()?;
            if self.json {
                print_json(&InBootLoader { state: "boot loader", usb: "0483:df11" })?;
            } else {
                print(
                    "the board is in its boot loader (USB 0483:df11); flash it, or switch it off and on to leave\n",
                )?;
            }
            return Ok(Outcome::done());
        }
        let mut session = Session::new(self.port.connect()?)?;
        match self.action {
            Action::Ready => session.ready(stop)?,
            Action::Home => session.home(stop)?,
            _ => session.off()?,
        }
        let state = session.client().status()?.state;
        if self.json {
            print_json(&Reached { state: state.to_string() })?;
        } else {
            print(&format!("state: {state}\n"))?;
        }
        Ok(Outcome::done())
    }

    fn follow(&self, course: &CourseArguments, seconds: Option<f64>) -> Result<Outcome, Failure> {
        let (mode, course) = (course.mode(), course.course()?);
        let mut session = Session::new(self.port.connect()?)?;
        let conversion = bowden_host_link::conversion::Conversion::new(session.parameters())?;
        let mut first = None;
        let mut next_line_s = 0.0;
        let end = session.run(mode, &course, &interrupt::requested, &mut |tick: &RunTick| {
            let first = *first.get_or_insert(tick.tick);
            let run_s = tick_time_s(tick.tick - first, tick.period_ns);
            if run_s >= next_line_s {
                next_line_s += LINE_INTERVAL_S;
                // A standard output that is gone does not stop the joint in the middle.
                let at = Position::new(run_s, tick, &conversion);
                let _ = if self.json { print_json_line(&at) } else { print(&at.line()) };
            }
            if seconds.is_some_and(|seconds| run_s >= seconds - 5e-10) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })?;
        match end {
            RunEnd::Complete | RunEnd::Interrupted => Ok(Outcome::done()),
            RunEnd::Fault(fault) => Err(LinkError::Fault(fault).into()),
            RunEnd::Left(state) => Err(Failure::failed(format!(
                "the board went to state {state} during the run; see `bowden faults`"
            ))),
        }
    }
}

/// State in which a step has left the board.
#[derive(Serialize)]
struct Reached {
    state: String,
}

/// A board that has left its firmware.
#[derive(Serialize)]
struct InBootLoader {
    state: &'static str,
    /// Vendor and product.
    usb: &'static str,
}

/// Where the joint is.
#[derive(Serialize)]
struct Position {
    /// Time since the run began, s.
    run_s: f64,
    state: String,
    theta_out_rad: f64,
    theta_in_rad: f64,
    /// f1 to f4, N.
    tensions_n: [f64; 4],
    /// Limits that act.
    limits: Vec<&'static str>,
}

impl Position {
    fn new(run_s: f64, tick: &RunTick, conversion: &bowden_host_link::conversion::Conversion) -> Self {
        let sample = &tick.sample;
        let [theta_in_rad, theta_out_rad] = conversion.angles_rad(sample);
        Self {
            run_s,
            state: sample.state.to_string(),
            theta_out_rad,
            theta_in_rad,
            tensions_n: conversion.tensions_n(sample),
            limits: Limit::ALL
                .into_iter()
                .filter(|limit| sample.limits.contains(*limit))
                .map(Limit::title)
                .collect(),
        }
    }

    /// For people.
    fn line(&self) -> String {
        let Self { run_s, state, theta_out_rad, theta_in_rad, tensions_n: [f1, f2, f3, f4], limits } = self;
        let limits = if limits.is_empty() { String::new() } else { format!("; {}", limits.join(", ")) };
        format!(
            "{run_s:8.3} s  {state}  joint {theta_out_rad:+.4} rad, pulley {theta_in_rad:+.4} rad, tensions {f1:.1} {f2:.1} {f3:.1} \
             {f4:.1} N{limits}\n"
        )
    }
}
