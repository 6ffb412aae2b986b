//! A joint with somebody at the keys: orders go in, every sample goes to a hub.
//!
//! The one who owns the port calls [`operate`]; keys and view share the [`Desk`] with it from threads of their own. Neither a view
//! that hangs nor an order under way keeps [`Desk::stop`] from switching the bridge off.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bowden_link::message::{Goal, Mode};
use bowden_link::{FaultRecord, State};

use super::course::Course;
use super::error::{CommsError, LinkError};
use super::recorder::tick_time_s;
use super::replug::Replug;
use super::session::{RunEnd, Session};

/// Longest wait for telemetry before orders are looked at.
const LISTEN_INTERVAL: Duration = Duration::from_millis(5);

/// Time between two looks at state and fault while nothing is under way.
const STATUS_INTERVAL: Duration = Duration::from_millis(200);

/// What can be asked for. Stopping is no order, see [`Desk::stop`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Self test and pretension check; from then on the joint may move.
    Arm,
    /// Armed: moves to angle zero.
    Home,
    /// Armed: follows the course.
    Run,
    /// Forgets a fault.
    ClearFault,
}

/// Where things stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Situation {
    /// The joint may move.
    pub armed: bool,
    /// What is under way.
    pub doing: Option<Order>,
    /// Fault that waits to be cleared.
    pub fault: Option<FaultRecord>,
    /// What happened last.
    pub notice: String,
}

/// What keys, view and the owner of the port share.
#[derive(Debug, Default)]
pub struct Desk {
    orders: Mutex<VecDeque<Order>>,
    stop: AtomicBool,
    quit: AtomicBool,
    situation: Mutex<Situation>,
}

/// What the joint follows on [`Order::Run`].
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is controlled.
    pub mode: Mode,
    /// The reference.
    pub course: Course,
    /// How long, s; `None`: until stopped.
    pub seconds: Option<f64>,
}

impl Desk {
    /// Asks for something.
    pub fn order(&self, order: Order) {
        lock(&self.orders).push_back(order);
    }

    /// Bridge off at once; the joint is no longer armed, and orders that wait are void.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Bridge off, and the end.
    pub fn quit(&self) {
        self.quit.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    pub fn is_over(&self) -> bool {
        self.quit.load(Ordering::Relaxed)
    }

    /// Where things stand.
    pub fn situation(&self) -> Situation {
        lock(&self.situation).clone()
    }

    fn change(&self, change: impl FnOnce(&mut Situation)) {
        change(&mut lock(&self.situation));
    }

    fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.is_over()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Whoever panicked with it in hand left a whole value: each change is one assignment.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Serves the desk until somebody quits, through every absence of the board that `replug` waits for: the joint is stopped and
/// not armed afterwards.
///
/// # Errors
/// As [`operate`], where the board does not come back.
pub fn operate_through(
    session: &mut Session,
    desk: &Desk,
    plan: &Plan,
    replug: &Replug,
    interrupted: &dyn Fn() -> bool,
) -> Result<(), LinkError> {
    loop {
        let error = match operate(session, desk, plan, interrupted) {
            Err(error @ LinkError::Comms(CommsError::Broken { .. })) if replug.is_on() => error,
            result => return result,
        };
        desk.change(|situation| {
            situation.armed = false;
            situation.doing = None;
            "unplugged: waiting for the board; q quits".clone_into(&mut situation.notice);
        });
        match replug.bring_back(session, &|| desk.is_over() || interrupted()) {
            Ok(absence) => desk.change(|situation| {
                let how = if absence.restarted { ", started again" } else { "" };
                situation.notice = format!(
                    "the board is back after {:.1} s{how}; the joint is stopped",
                    absence.away.as_secs_f64()
                );
            }),
            Err(LinkError::Interrupted | LinkError::Comms(_)) => return Err(error),
            Err(other) => return Err(other),
        }
    }
}

/// Serves the desk until somebody quits, or `interrupted` says so; the bridge is off then.
///
/// # Errors
/// When the link breaks or the board started again. Faults and refusals are shown at the desk.
pub fn operate(
    session: &mut Session,
    desk: &Desk,
    plan: &Plan,
    interrupted: &dyn Fn() -> bool,
) -> Result<(), LinkError> {
    let mut looked = None;
    loop {
        if interrupted() {
            desk.quit();
        }
        if desk.is_stopping() {
            session.off()?;
            if desk.is_over() {
                return Ok(());
            }
            lock(&desk.orders).clear();
            desk.stop.store(false, Ordering::Relaxed);
            desk.change(|situation| {
                situation.armed = false;
                "stopped".clone_into(&mut situation.notice);
            });
        }
        let order = lock(&desk.orders).pop_front();
        match order {
            Some(order) => {
                carry_out(session, desk, plan, order, interrupted)?;
                looked = None;
            }
            None => session.idle(LISTEN_INTERVAL)?,
        }
        let now = session.client().now();
        if looked.is_none_or(|looked| now.saturating_sub(looked) >= STATUS_INTERVAL) {
            looked = Some(now);
            let status = session.client().status()?;
            desk.change(|situation| {
                situation.fault = status.fault;
                // Another state than the one it was left in is nothing to go on from.
                situation.armed &= status.state == State::Ready;
            });
        }
    }
}

/// Does what an order says, and notes at the desk how it went.
fn carry_out(
    session: &mut Session,
    desk: &Desk,
    plan: &Plan,
    order: Order,
    interrupted: &dyn Fn() -> bool,
) -> Result<(), LinkError> {
    let moves = matches!(order, Order::Home | Order::Run);
    if moves && !desk.situation().armed {
        desk.change(|situation| "not armed: arm the joint first".clone_into(&mut situation.notice));
        return Ok(());
    }
    desk.change(|situation| {
        situation.doing = Some(order);
        situation.notice.clear();
    });
    let stop = || desk.is_stopping() || interrupted();
    let (armed, result) = match order {
        Order::Arm => (true, session.ready(&stop).map(|()| "ready to move".to_owned())),
        Order::Home => (true, session.home(&stop).map(|()| "at zero".to_owned())),
        Order::Run => (false, run(session, plan, &stop)),
        Order::ClearFault => (false, session.client().enter(Goal::ClearFault).map(|()| "cleared".to_owned())),
    };
    if result.is_err() {
        session.off()?;
    }
    let notice = match &result {
        Ok(notice) => notice.clone(),
        Err(LinkError::Comms(_)) => return result.map(|_| ()),
        Err(error) => error.to_string(),
    };
    desk.change(|situation| {
        situation.doing = None;
        situation.armed = armed && result.is_ok();
        situation.notice = notice;
        if let Err(LinkError::Fault(fault)) = result {
            situation.fault = Some(fault);
        }
    });
    Ok(())
}

fn run(session: &mut Session, plan: &Plan, stop: &dyn Fn() -> bool) -> Result<String, LinkError> {
    let mut first = None;
    let end = session.run(plan.mode, &plan.course, stop, &mut |tick| {
        let first = *first.get_or_insert(tick.tick);
        let run_s = tick_time_s(tick.tick - first, tick.period_ns);
        // Half a nanosecond is below every control period.
        match plan.seconds {
            Some(seconds) if run_s >= seconds - 5e-10 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    })?;
    match end {
        RunEnd::Complete => Ok("the run is complete".to_owned()),
        RunEnd::Interrupted => Err(LinkError::Interrupted),
        RunEnd::Fault(fault) => Err(LinkError::Fault(fault)),
        RunEnd::Left(got) => Err(LinkError::Strayed { got, expected: State::Run }),
    }
}
