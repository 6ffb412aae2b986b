//! `bowden monitor`: a joint live in the terminal.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output::describe;
use bowden_core::recording::Format;
use bowden_host_link::LinkError;
use bowden_host_link::capture::Capture;
use bowden_host_link::conversion::Conversion;
use bowden_host_link::evidence::Origin;
use bowden_host_link::hub::{Hub, Next, Reader};
use bowden_host_link::operator::{Desk, Plan, operate_through};
use bowden_host_link::recorder::{Recorder, Tally};
use bowden_host_link::replug::Replug;
use bowden_host_link::rig_file::Weight;
use bowden_host_link::session::Session;

use super::course::{CourseArguments, run_seconds};
use super::port::{PortArguments, ReplugArguments};
use crate::interrupt;
use crate::monitor::keys;
use crate::monitor::recording::{self, Progress};
use crate::monitor::screen::Screen;
use crate::monitor::serving::Server;
use crate::monitor::signals::Meter;
use crate::monitor::view::{Beside, Watch};

/// Time between two pictures.
const FRAME: Duration = Duration::from_millis(50);

/// Samples that may wait for the screen: a second at the highest control rate.
const SCREEN_ROOM: usize = 20_000;

/// Samples that may wait for the disk: 100 s at the highest control rate, some 100 MB.
const RECORDING_ROOM: usize = 2_000_000;

/// Arguments of `bowden monitor`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Keys: a arms the joint (self test and pretension check), h moves it to zero, r runs the reference, SPACE \
                  switches the bridge off at once, c clears a fault, q ends. Nothing moves before it is armed; after a \
                  stop, a fault and a run it has to be armed again. The bridge is off at the end. Colours are off with \
                  --no-color or where NO_COLOR is set."
)]
pub struct MonitorArguments {
    #[command(flatten)]
    port: PortArguments,
    #[command(flatten)]
    replug: ReplugArguments,
    /// Recording to write meanwhile, of every tick in every state (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "REC.mcap")]
    record: Option<PathBuf>,
    /// What is to be remembered; it stands in the recording
    #[arg(long, value_name = "TEXT", requires = "record")]
    note: Option<String>,
    /// Weight on the arm and its distance from the axis, for the rig in the recording: the board does not know it
    #[arg(long, value_name = "KG,M", requires = "record")]
    load: Option<Weight>,
    #[command(flatten)]
    course: CourseArguments,
    /// Length of a run, s; otherwise until it is stopped
    #[arg(long, value_parser = run_seconds)]
    seconds: Option<f64>,
    /// Serve the live data to Foxglove at ws://127.0.0.1:PORT, 8765 if not given; 0 for any that is free. Open
    /// docs/foxglove-layout.json there
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "8765")]
    foxglove: Option<u16>,
    /// Length of the history, s
    #[arg(long, value_name = "SECONDS", default_value = "20", value_parser = history_seconds)]
    history: f64,
    /// Without colours
    #[arg(long)]
    no_color: bool,
}

/// Threads beside the one that owns the port, and how they ended.
struct Ended {
    link: Result<(), LinkError>,
    screen: io::Result<()>,
    keys: io::Result<()>,
    recording: Option<Result<Tally, Failure>>,
}

impl MonitorArguments {
    /// Shows the joint until the user has enough.
    ///
    /// # Errors
    /// Exit status 2, if there is no terminal, or an output or the port is not usable, or the joint cannot do the reference;
    /// 1, if the link broke, the terminal went away, or the recording could not be written.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let inputs: Vec<&Path> = self.course.file().into_iter().collect();
        let format = self.record.as_deref().map(|out| recording::check(out, &inputs)).transpose()?;
        let plan = Plan { mode: self.course.mode(), course: self.course.course()?, seconds: self.seconds };
        Screen::check()?;
        interrupt::catch()?;

        let mut session = Session::new(self.port.connect_live()?)?;
        let replug = self.port.replug(self.replug);
        self.course.check(&plan.course, &session.parameters().control())?;
        let client = session.client();
        let greeting = client.greeting();
        let title = format!("{} {} at {}", greeting.board, greeting.firmware, client.port());
        let meter = Meter::new(session.parameters(), plan.mode)?;
        let colours = !self.no_color && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        let watch = Watch::new(meter, title, self.history, colours);
        let recorder = self.recorder(format, &plan, &session)?;
        let server = self.server(meter, &plan, &session)?;
        let screen = Screen::open()?;
        let hub = Hub::default();
        let to_disk = recorder.as_ref().map(|_| hub.subscribe(RECORDING_ROOM));
        let recorder = recorder.zip(to_disk.as_ref());
        let work = Work { plan: &plan, replug: &replug, hub: &hub, recorder, server };
        let ended = attend(&mut session, work, watch, screen);
        let not_recorded = to_disk.map_or(0, |reader| reader.lost());
        self.conclude(ended, not_recorded, &mut session)
    }

    /// The recording, if there is one, and its name in words.
    fn recorder(
        &self,
        format: Option<Format>,
        plan: &Plan,
        session: &Session,
    ) -> Result<Option<(Recorder, String)>, Failure> {
        let (Some(out), Some(format)) = (self.record.as_deref(), format) else { return Ok(None) };
        let origin =
            Origin { note: self.note.clone(), reference: Some(self.course.words()), ..super::origin() };
        let name = out.file_stem().map_or("joint".into(), |name| name.to_string_lossy());
        let capture = Capture {
            out,
            format,
            mode: plan.mode,
            every: 1,
            seconds: None,
            origin: &origin,
            rig: Some((&name, self.load)),
            replug: None,
        };
        Ok(Some((capture.recorder(session)?, out.display().to_string())))
    }

    fn server(&self, meter: Meter, plan: &Plan, session: &Session) -> Result<Option<Server>, Failure> {
        let Some(port) = self.foxglove else { return Ok(None) };
        let conversion = Conversion::new(session.parameters())?;
        Server::start(port, meter, conversion, plan.mode).map(Some)
    }

    /// What it amounts to.
    fn conclude(&self, ended: Ended, not_recorded: u64, session: &mut Session) -> Result<Outcome, Failure> {
        let mut outcome = Outcome::done();
        let mut kept = String::new();
        if let (Some(out), Some(recording)) = (&self.record, ended.recording) {
            let (out, tally) = (out.display(), recording?);
            kept = format!("{out}: {} rows over {:.3} s", tally.rows, tally.duration_s());
            let losses = *session.client().losses();
            outcome.extend(tally.loss(&losses).map(|loss| format!("{out}: {loss}")));
            if not_recorded > 0 {
                outcome.extend([format!(
                    "{out}: the disk was too slow for {not_recorded} samples of these; record to another one"
                )]);
            }
        }
        let with_kept = |text: String| {
            Failure::failed(if kept.is_empty() { text } else { format!("{text}; {kept} are kept") })
        };
        if let Err(error) = ended.link {
            return Err(with_kept(error.to_string()));
        }
        if let Err(error) = ended.screen.and(ended.keys) {
            let reason = describe(&error);
            return Err(with_kept(format!(
                "monitor: the terminal is gone: {reason}; the joint was stopped, start again in another one"
            )));
        }
        if !kept.is_empty() {
            super::print(&format!("{kept}\n"))?;
        }
        Ok(outcome)
    }
}

/// What is done with the joint, and who reads along.
struct Work<'w> {
    plan: &'w Plan,
    replug: &'w Replug,
    hub: &'w Hub,
    recorder: Option<((Recorder, String), &'w Reader)>,
    server: Option<Server>,
}

/// Owns the port in this thread while others show, read keys, record and serve; until somebody quits or something breaks.
fn attend(session: &mut Session, work: Work, mut watch: Watch, screen: Screen) -> Ended {
    let Work { plan, replug, hub, recorder, server } = work;
    let (desk, progress) = (Desk::default(), Progress::default());
    let to_screen = hub.subscribe(SCREEN_ROOM);
    let address = server.as_ref().map_or_else(String::new, Server::address);
    std::thread::scope(|threads| {
        let recorder = recorder.map(|((recorder, name), reader)| {
            let progress = &progress;
            threads.spawn(move || recording::write(recorder, &name, reader, progress))
        });
        if let Some(server) = server {
            let reader = hub.subscribe(SCREEN_ROOM);
            threads.spawn(move || server.serve(&reader));
        }
        let viewer = threads.spawn(|| {
            let result = show(screen, &mut watch, &to_screen, &desk, &progress, &address);
            // Nobody is left without a view of the joint.
            desk.quit();
            result
        });
        let keys = threads.spawn(|| keys::read(&desk));
        let link = session
            .watch(hub.clone())
            .and_then(|()| operate_through(session, &desk, plan, replug, &interrupt::requested));
        desk.quit();
        hub.close();
        let panicked = || io::Error::other("internal error");
        Ended {
            link,
            keys: keys.join().unwrap_or_else(|_| Err(panicked())),
            screen: viewer.join().unwrap_or_else(|_| Err(panicked())),
            recording: recorder.map(|recorder| {
                recorder.join().unwrap_or_else(|_| Err(Failure::failed("recording: internal error")))
            }),
        }
    })
}

/// Draws what comes until there is no more.
fn show(
    mut screen: Screen,
    watch: &mut Watch,
    reader: &Reader,
    desk: &Desk,
    progress: &Progress,
    address: &str,
) -> io::Result<()> {
    loop {
        let begun = Instant::now();
        let mut next = reader.next(FRAME);
        while let Next::Batch(live) = &next {
            watch.take(live);
            next = reader.next(Duration::ZERO);
        }
        if next == Next::Ended {
            return Ok(());
        }
        let beside =
            Beside { recording: progress.words(), server: address.to_owned(), not_shown: reader.lost() };
        screen.draw(|frame| watch.draw(frame, &desk.situation(), &beside))?;
        std::thread::sleep(FRAME.saturating_sub(begun.elapsed()));
    }
}

fn history_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (1.0..=600.0).contains(&seconds) => Ok(seconds),
        _ => Err("allowed 1 to 600 s".to_owned()),
    }
}
