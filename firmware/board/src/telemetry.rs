//! Everything that the board says goes through here: answers first, then samples.
//!
//! A host that does not read stops this task and nothing else: answers that find no room are dropped, for the host asks
//! again, and samples that find none are counted as lost.

use bowden_control::service::{Batcher, RawBatcher, TelemetryMode};
use bowden_link::frame::FRAME_LENGTH;
use bowden_link::{Answer, FaultRecord, FromBoard, RawTick, encode};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Ticker};
use embassy_usb::class::cdc_acm::Sender;
use embassy_usb::driver::EndpointError;

use crate::queues::SampleEnds;
use crate::tick;
use crate::usb::{PACKET, UsbDriver};

/// Time between two looks at the samples. The tick cannot wake a task.
const LOOK: Duration = Duration::from_millis(1);

/// Answers on their way, with the number of their request.
// Nobody but the thread uses it.
#[expect(unsafe_code, reason = "a place for a variable")]
#[unsafe(link_section = ".bss.ccm.answers")]
pub static ANSWERS: Channel<CriticalSectionRawMutex, (u16, FromBoard), 4> = Channel::new();

/// Sends answers and samples; `period_ns` is asked for at every batch.
#[embassy_executor::task]
pub async fn run(port: Sender<'static, UsbDriver>, ends: SampleEnds) {
    let mut line = Line { port, next_frame: 0, frame: [0; FRAME_LENGTH] };
    let mut source = Source { ends, batcher: Batcher::default(), raw: RawBatcher::default(), fault: None };
    let mut look = Ticker::every(LOOK);
    loop {
        let said = select(ANSWERS.receive(), look.next()).await;
        let sent = match said {
            // A host that asks without a pause does not keep samples from their turn.
            Either::First((request, answer)) => match line.say(Some(request), answer).await {
                Ok(()) => source.pass_on(&mut line).await,
                gone => gone,
            },
            Either::Second(()) => source.pass_on(&mut line).await,
        };
        if sent.is_err() {
            // Unplugged: what was begun is of no use to the next host.
            source.forget();
            line.port.wait_connection().await;
        }
    }
}

/// Samples on their way into batches.
struct Source {
    ends: SampleEnds,
    batcher: Batcher,
    raw: RawBatcher,
    /// A fault whose tick comes yet.
    fault: Option<FaultRecord>,
}

impl Source {
    /// Drops what was begun.
    fn forget(&mut self) {
        self.batcher.take();
        self.raw.take();
    }

    /// Sends the batches that are complete. At most as many samples as are there now, so that answers get their turn.
    async fn pass_on(&mut self, line: &mut Line) -> Result<(), EndpointError> {
        let mode = tick::telemetry();
        if mode == TelemetryMode::Off {
            while self.ends.samples.dequeue().is_some() {}
        }
        if mode != TelemetryMode::Raw {
            while self.ends.given.dequeue().is_some() {}
            while self.ends.faults.dequeue().is_some() {}
            self.fault = None;
            self.raw.take();
        }
        if mode != TelemetryMode::Samples {
            self.batcher.take();
        }
        for _ in 0..self.ends.samples.len() {
            if let Some(message) = self.next(mode) {
                line.say(None, message).await?;
                if let Ok((request, answer)) = ANSWERS.try_receive() {
                    line.say(Some(request), answer).await?;
                }
            }
        }
        Ok(())
    }

    /// Takes a sample; the batch that it completes.
    fn next(&mut self, mode: TelemetryMode) -> Option<FromBoard> {
        let (number, sample) = self.ends.samples.dequeue()?;
        let (period_ns, lost) = (tick::period_ns(), tick::lost());
        if mode != TelemetryMode::Raw {
            return self.batcher.push(number, sample, period_ns, lost).map(FromBoard::Telemetry);
        }
        // One that is older than its sample was made while the other kind of telemetry was on; a sample without one as well.
        while self.ends.given.peek().is_some_and(|(of, _)| number.wrapping_sub(*of).cast_signed() > 0) {
            self.ends.given.dequeue();
        }
        if self.ends.given.peek().is_none_or(|(of, _)| *of != number) {
            return None;
        }
        let (_, given) = self.ends.given.dequeue()?;
        if self.fault.is_none_or(|fault| number.wrapping_sub(fault.tick).cast_signed() > 0) {
            self.fault = self.ends.faults.dequeue();
        }
        let tripped = self.fault.filter(|fault| fault.tick == number);
        let tick = RawTick { sample, inputs: given.with(tripped) };
        self.raw.push(number, tick, period_ns, lost).map(FromBoard::RawTelemetry)
    }
}

struct Line {
    port: Sender<'static, UsbDriver>,
    next_frame: u16,
    frame: [u8; FRAME_LENGTH],
}

impl Line {
    async fn say(&mut self, answers: Option<u16>, message: FromBoard) -> Result<(), EndpointError> {
        let answer = Answer { sequence: self.next_frame, answers, message };
        self.next_frame = self.next_frame.wrapping_add(1);
        // Every message fits, which a test of the protocol checks.
        let Ok(frame) = encode(&answer, &mut self.frame) else { return Ok(()) };
        for packet in frame.chunks(PACKET) {
            self.port.write_packet(packet).await?;
        }
        if frame.len().is_multiple_of(PACKET) {
            // The host's driver waits for a short packet.
            self.port.write_packet(&[]).await?;
        }
        Ok(())
    }
}
