//! A recording of every control tick with all that went into it, from a known start on: what `replay_control` computes again.

use std::ops::ControlFlow;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::recording::END_GROUP;

use super::capture::{Capture, PROGRESS_STEPS};
use super::course::Course;
use super::error::LinkError;
use super::evidence;
use super::hub::{Hub, Next, Reader};
use super::raw::OrderBook;
use super::recorder::{Recorder, Tally, tick_time_s};
use super::session::{RunEnd, Session, Stop};

/// Samples that may wait between the link and the writer: a minute and a half at 10 kHz.
const ROOM: usize = 1 << 20;

/// Longest wait for a batch.
const WAKE: Duration = Duration::from_millis(100);

/// Board time that is recorded before the known start and behind the end.
const MARGIN: Duration = Duration::from_millis(10);

/// From off: a known start, then ready, home if that is wanted, the run, off; all of it recorded. It is kept whatever ended the run.
///
/// # Errors
/// When the medium refuses, or nothing was recorded.
pub fn run(
    capture: &Capture,
    session: &mut Session,
    course: &Course,
    home: bool,
    stop: Stop,
    progress: &dyn Progress,
) -> Result<(Tally, Result<RunEnd, LinkError>), Failure> {
    let orders = OrderBook::default();
    let recorder = capture.raw_recorder(session, &orders)?;
    let hub = Hub::default();
    let reader = hub.subscribe(ROOM);
    let writer = std::thread::spawn(move || write(recorder, &reader));
    let end = drive(capture, session, course, (home, &orders, &hub), stop, progress);
    let over = leave(session);
    hub.close();
    let (recorder, overrun) =
        writer.join().map_err(|_| Failure::failed("recording: internal error; please report this"))?;
    let end = end.and_then(|end| over.map(|()| end));
    let mut known = evidence::end(recorder.tally(), &super::capture::words(&end));
    known.extend(END_GROUP, [("overrun".to_owned(), overrun.to_string())]);
    let tally = recorder.finish(&known)?;
    match end {
        Err(error) if tally.rows == 0 => Err(error.into()),
        end => Ok((tally, end)),
    }
}

fn drive(
    capture: &Capture,
    session: &mut Session,
    course: &Course,
    (home, orders, hub): (bool, &OrderBook, &Hub),
    stop: Stop,
    progress: &dyn Progress,
) -> Result<RunEnd, LinkError> {
    session.off()?;
    session.client().note_orders(orders.clone());
    session.watch(hub.clone())?;
    rest(session)?;
    session.client().reset_control()?;
    progress.stage("self test and pretension check", 0);
    session.ready(stop)?;
    if home {
        progress.stage("homing", 0);
        session.home(stop)?;
    }
    progress.stage("recording", if capture.seconds.is_some() { PROGRESS_STEPS } else { 0 });
    let (mut first, mut shown) = (None, 0);
    session.run(capture.mode, course, stop, &mut |tick| {
        let first = *first.get_or_insert(tick.tick);
        let Some(seconds) = capture.seconds else { return ControlFlow::Continue(()) };
        let run_s = tick_time_s(tick.tick + 1 - first, tick.period_ns);
        let step = ((run_s / seconds * PROGRESS_STEPS as f64) as u64).min(PROGRESS_STEPS);
        progress.advance(step - shown);
        shown = step;
        // Half a nanosecond is below every control period.
        if run_s >= seconds - 5e-10 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
}

/// Lets the board send for a while.
fn rest(session: &mut Session) -> Result<(), LinkError> {
    let end = session.client().now() + MARGIN;
    while session.client().now() < end {
        session.idle(MARGIN)?;
    }
    Ok(())
}

/// The bridge off, and the ticks in which it went off received.
fn leave(session: &mut Session) -> Result<(), LinkError> {
    session.off()?;
    rest(session)?;
    session.unwatch()
}

/// Writes what the reader gets until there is no more; how many samples there was no room for.
fn write(mut recorder: Recorder, reader: &Reader) -> (Recorder, u64) {
    loop {
        match reader.next(WAKE) {
            Next::Batch(live) => {
                if !live.telemetry.ticks().all(|tick| recorder.tick(&tick)) {
                    break;
                }
            }
            Next::Nothing => {}
            Next::Ended => break,
        }
    }
    (recorder, reader.lost())
}
