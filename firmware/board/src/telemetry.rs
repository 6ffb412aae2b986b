//! Everything that the board says goes through here: answers first, then samples.
//!
//! A host that does not read stops this task and nothing else: answers that find no room are dropped, for the host asks
//! again, and samples that find none are counted as lost.

use bowden_control::service::Batcher;
use bowden_link::frame::FRAME_LENGTH;
use bowden_link::{Answer, FromBoard, Sample, encode};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Ticker};
use embassy_usb::class::cdc_acm::Sender;
use embassy_usb::driver::EndpointError;
use heapless::spsc::Consumer;

use crate::tick;
use crate::usb::{PACKET, UsbDriver};

/// Time between two looks at the samples. The tick cannot wake a task.
const LOOK: Duration = Duration::from_millis(1);

/// Answers on their way, with the number of their request.
pub static ANSWERS: Channel<CriticalSectionRawMutex, (u16, FromBoard), 4> = Channel::new();

/// Sends answers and samples; `period_ns` is asked for at every batch.
#[embassy_executor::task]
pub async fn run(port: Sender<'static, UsbDriver>, mut samples: Consumer<'static, (u32, Sample)>) {
    let mut line = Line { port, next_frame: 0, frame: [0; FRAME_LENGTH] };
    let mut batcher = Batcher::default();
    let mut look = Ticker::every(LOOK);
    loop {
        let said = select(ANSWERS.receive(), look.next()).await;
        let sent = match said {
            Either::First((request, answer)) => line.say(Some(request), answer).await,
            Either::Second(()) => pass_on(&mut line, &mut batcher, &mut samples).await,
        };
        if sent.is_err() {
            // Unplugged: what was begun is of no use to the next host.
            batcher.take();
            line.port.wait_connection().await;
        }
    }
}

/// Sends the batches that are complete. At most as many samples as are there now, so that answers get their turn.
async fn pass_on(
    line: &mut Line,
    batcher: &mut Batcher,
    samples: &mut Consumer<'static, (u32, Sample)>,
) -> Result<(), EndpointError> {
    if !tick::telemetry() {
        while samples.dequeue().is_some() {}
        batcher.take();
        return Ok(());
    }
    for _ in 0..samples.len() {
        let Some((number, sample)) = samples.dequeue() else { break };
        if let Some(batch) = batcher.push(number, sample, tick::period_ns(), tick::lost()) {
            line.say(None, FromBoard::Telemetry(batch)).await?;
            while let Ok((request, answer)) = ANSWERS.try_receive() {
                line.say(Some(request), answer).await?;
            }
        }
    }
    Ok(())
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
