//! Calibrations of the simulated board: right and wrong wires, hands that forget what they were asked for, stops.

use std::cell::Cell;
use std::fs;
use std::time::Duration;

use bowden_core::outcome::FailureClass;

use super::hand::Act;
use super::*;
use crate::sim::{Concealed, SimTransport};
use crate::{Client, ParameterSet};

/// Answers questions by what they begin with, the last fitting one of a list; a part of the list is used up by each use if it says so.
struct Script {
    answers: Vec<(&'static str, Vec<&'static str>)>,
    /// Everything shown and asked.
    transcript: String,
}

impl Script {
    /// What a person answers who has done everything and hangs 2 kg on every cell.
    fn new() -> Self {
        let cells = vec!["f1", "f2", "f3", "f4", "done"];
        Self {
            answers: vec![
                ("Which load cell", cells),
                ("Mass of the weight", vec!["2"; 9]),
                ("Set these", vec!["yes"; 9]),
                ("Store", vec!["yes"]),
                ("Signed off", vec!["Ada Lovelace"]),
                ("Measure this step again?", vec![]),
            ],
            transcript: String::new(),
        }
    }

    /// With these answers to questions that begin so.
    fn with(mut self, begins: &'static str, answers: &[&'static str]) -> Self {
        self.answers.insert(0, (begins, answers.to_vec()));
        self
    }
}

impl Dialog for Script {
    fn show(&mut self, text: &str) -> Result<(), Failure> {
        self.transcript += text;
        Ok(())
    }

    fn ask(&mut self, question: &str) -> Result<Option<String>, Failure> {
        self.transcript += question;
        self.transcript += "\n";
        let listed = self.answers.iter_mut().find(|(begins, _)| question.starts_with(begins));
        Ok(match listed {
            Some((_, answers)) if answers.is_empty() => None,
            Some((_, answers)) => Some(answers.remove(0).to_owned()),
            None if question.ends_with("[Enter] ") => Some(String::new()),
            None => None,
        })
    }
}

/// A hand that does something else in the place of an act.
struct Clumsy<H> {
    hand: H,
    instead: Instead,
}

/// What a hand does in the place of an act.
type Instead = Box<dyn FnMut(Act) -> Option<Act>>;

impl<H: Hand> Hand for Clumsy<H> {
    fn act(&mut self, act: Act) {
        if let Some(act) = (self.instead)(act) {
            self.hand.act(act);
        }
    }
}

/// A board, and where its calibration goes.
struct Case {
    session: Session,
    hand: Box<dyn Hand>,
    folder: tempfile::TempDir,
}

impl Case {
    /// The simulated board of this name, at which everything that is asked for is done.
    fn new(port: &str) -> Self {
        Self::clumsy(port, Some)
    }

    fn clumsy(port: &str, instead: impl FnMut(Act) -> Option<Act> + 'static) -> Self {
        let list = port.strip_prefix("sim:");
        let board = list.map_or_else(SimTransport::new, |list| {
            SimTransport::with(&Concealed::parse(list).unwrap()).unwrap()
        });
        let hand = Box::new(Clumsy { hand: board.hand(), instead: Box::new(instead) });
        let client = Client::connect(Box::new(board), "sim", Duration::from_secs(2)).unwrap();
        Self { session: Session::new(client).unwrap(), hand, folder: tempfile::tempdir().unwrap() }
    }

    /// Sets a parameter of the board, as it was before somebody calibrates it.
    fn told(&mut self, name: &str, value: f32) {
        let index = self.session.parameters().find(name).unwrap().index;
        self.session.replace_parameters(&[(index, value)]).unwrap();
    }

    fn file(&self) -> std::path::PathBuf {
        self.folder.path().join("calibration.toml")
    }

    fn run(&mut self, script: &mut Script) -> Result<Outcome, Failure> {
        self.run_until(script, &|| false)
    }

    fn run_until(&mut self, script: &mut Script, stop: Stop) -> Result<Outcome, Failure> {
        let file = self.file();
        let now = || "2030-01-02T03:04:05Z".to_owned();
        let setup = Setup { out: &file, tool: "test".to_owned(), now: &now, store: false, stop };
        calibrate(&setup, &mut self.session, self.hand.as_mut(), script)
    }

    /// The reason why the calibration of a right script ends with exit status 1.
    fn refused(mut self, script: &mut Script) -> String {
        let failure = self.run(script).unwrap_err();
        assert_eq!(failure.class(), FailureClass::Failed, "{failure}\n{}", script.transcript);
        failure.message().to_owned()
    }

    /// The file, and the board's parameters.
    fn calibrated(mut self, script: &mut Script) -> (Sheet, ParameterSet) {
        let result = self.run(script);
        assert!(result.is_ok(), "{result:?}\n{}", script.transcript);
        let sheet = Sheet::load(&self.file()).unwrap();
        (sheet, ParameterSet::read(self.session.client()).unwrap())
    }
}

/// A right script for a board that is wired wrongly or a hand that is clumsy.
fn refused(port: &str, instead: impl FnMut(Act) -> Option<Act> + 'static) -> String {
    Case::clumsy(port, instead).refused(&mut Script::new())
}

#[test]
fn a_board_is_calibrated_to_what_the_bench_is_and_signed_off() {
    let (sheet, parameters) = Case::new("sim:mounted=300-3500").calibrated(&mut Script::new());
    let value = |name: &str| parameters.value(name).unwrap();
    for name in ["f1", "f2", "f3", "f4"] {
        // By hand from the front end: 0.5 V and 23 mV/N behind 3.3 V in 4095 steps. 2 kg are 19.62 N on this bench, 19.6133 N in the
        // tool; the noise of the mean is 2.9 codes over the root of 5000.
        let (zero, gain) = (0.5 / 3.3 * 4095.0, 3.3 / 4095.0 / 0.023);
        assert!((value(&format!("tension.{name}.zero")) - zero).abs() < 0.2, "{name}");
        assert!((value(&format!("tension.{name}.gain")) / gain - 1.0).abs() < 1.5e-3, "{name}");
        assert_eq!(sheet.zeros.as_ref().unwrap().tension[name].samples, 5000);
        // 0.1 N of noise are 2.854 codes; rounding adds 1/12 code².
        let spread = sheet.zeros.as_ref().unwrap().tension[name].spread;
        assert!((spread - (2.854_f64.powi(2) + 1.0 / 12.0).sqrt()).abs() < 0.1, "{name}: {spread}");
    }
    assert_eq!((value("encoder.input.zero"), value("encoder.joint.zero")), (300.0, 3500.0));
    assert_eq!((value("encoder.input.direction"), value("encoder.joint.direction")), (1.0, 1.0));
    assert_eq!(value("bridge.direction"), 1.0);
    let motor = sheet.motor.clone().unwrap();
    assert!((motor.resistance_ohm - 2.0).abs() < 0.1, "{motor:?}");
    assert_eq!(value("motor.resistance"), motor.resistance_ohm);
    let signed = sheet.signed_off.clone().unwrap();
    assert_eq!(
        (signed.by.as_str(), signed.at.as_str(), signed.stored),
        ("Ada Lovelace", "2030-01-02T03:04:05Z", true)
    );
    assert_eq!(signed.parameters, sheet.parameters());
    // What was lowered for the motor is as before.
    assert_eq!(value("limits.current"), 3.0);
    assert!((sheet.pretension.unwrap().mean_n - 30.0).abs() < 0.3);
}

#[test]
fn reversed_encoders_and_motor_are_found_and_set() {
    let port = "sim:reversed=input,reversed=joint,reversed=motor,mounted=100-4000";
    let mut script = Script::new();
    let (sheet, parameters) = Case::new(port).calibrated(&mut script);
    let value = |name: &str| parameters.value(name).unwrap();
    assert_eq!((value("encoder.input.direction"), value("encoder.joint.direction")), (-1.0, -1.0));
    assert_eq!((value("encoder.input.zero"), value("encoder.joint.zero")), (100.0, 4000.0));
    assert_eq!(value("bridge.direction"), -1.0);
    assert!(script.transcript.contains("the motor is reversed"), "{}", script.transcript);
    assert!((sheet.motor.unwrap().resistance_ohm - 2.0).abs() < 0.1);
    let (sheet, _) = Case::new("sim:reversed=joint").calibrated(&mut Script::new());
    let encoders = sheet.encoders.unwrap();
    assert_eq!((encoders.input.direction, encoders.joint.direction), (1, -1));
}

#[test]
fn wrong_wires_are_found_and_named() {
    for (port, expected) in [
        (
            "sim:swap=f1-f3",
            "load cell f1 is plugged into input f3, load cell f3 is plugged into input f1; correct the wires",
        ),
        ("sim:swap=f1-f2,swap=f3-f4", "load cell f4 is plugged into input f3; correct"),
        ("sim:dead=f2", "f2: 0.02 V, expected 0.1 to 3.2 V; look for a broken wire"),
        ("sim:swap=encoders", "the input pulley was turned, but the joint encoder moved, by +"),
    ] {
        let reason = refused(port, Some);
        assert!(reason.contains(expected), "{port}: {reason}");
    }
}

#[test]
fn a_gain_that_is_off_is_found() {
    let port = "sim:sensor_gain_error:2,seed=5";
    let (sheet, parameters) = Case::new(port).calibrated(&mut Script::new());
    let nominal = 3.3 / 4095.0 / 0.023;
    let off: Vec<f64> =
        sheet.gains.unwrap().tension.values().map(|gain| gain.gain_n_per_code / nominal - 1.0).collect();
    let wrong = off.iter().filter(|off| off.abs() > 0.02).count();
    assert_eq!((wrong, off.iter().filter(|off| off.abs() < 2e-3).count()), (1, 3), "{off:?}");
    // The board reads its pretension right with it: bench and data sheet are a few per cent apart.
    let pretension_n = sheet.pretension.unwrap().mean_n;
    assert!((pretension_n - 30.0).abs() < 3.0, "{pretension_n} N of {}", parameters.board());
}

#[test]
fn what_a_hand_forgets_is_refused_with_the_reason() {
    let forgets = |act| match act {
        Act::HangWeight { cell: 2, .. } => None,
        act => Some(act),
    };
    let reason = refused("sim", forgets);
    assert!(
        reason.contains("f3: ") && reason.contains("codes under 2 kg, expected 82 at least; hang the weight"),
        "{reason}"
    );

    let other_cell = |act| match act {
        Act::HangWeight { cell: 1, mass_kg } => Some(Act::HangWeight { cell: 3, mass_kg }),
        act => Some(act),
    };
    let reason = refused("sim", other_cell);
    assert!(
        reason.contains("f2: the weight shows at input f4; check the channel order, or hang it on f2"),
        "{reason}"
    );

    // 30 N of pretension are code 1477: 2494 codes below the rail at 3.2 V, 87.4 N of the 90 N that have to fit.
    let tendons_on = |act| match act {
        Act::TakeTendonsOff => None,
        act => Some(act),
    };
    let reason = refused("sim", tendons_on);
    assert!(reason.contains("f1: code 14") && reason.contains("leaves room for 87."), "{reason}");
    assert!(reason.contains("expected 90 N (tension.over); take the tendon off"), "{reason}");

    let pulls_nothing = |act| match act {
        Act::Pull { cell: 0 } => None,
        act => Some(act),
    };
    let reason = refused("sim", pulls_nothing);
    assert!(reason.contains("load cell f1 was pulled, but no input changed by 82 codes"), "{reason}");

    let turns_nothing = |act| match act {
        Act::TurnJoint => None,
        act => Some(act),
    };
    let reason = refused("sim", turns_nothing);
    assert!(
        reason.contains("encoder joint: neither encoder turned by 114 counts; turn the joint"),
        "{reason}"
    );

    let tendons_off = |act| match act {
        Act::FitTendons => None,
        act => Some(act),
    };
    let reason = refused("sim", tendons_off);
    // The arm is still being lowered.
    assert!(reason.contains("encoder joint: moved over"), "{reason}");
}

#[test]
fn zeros_that_were_measured_with_the_tendons_on_are_found_when_they_are_off() {
    // Where 80 N are enough the level alone does not tell. The tendons come off with the second time of asking.
    let mut asked = 0;
    let later = move |act| {
        asked += usize::from(act == Act::TakeTendonsOff);
        if act == Act::TakeTendonsOff && asked == 1 { None } else { Some(act) }
    };
    let mut case = Case::clumsy("sim", later);
    case.told("tension.over", 80.0);
    let mut script = Script::new().with("Measure this step again?", &["", "stop"]);
    let reason = case.refused(&mut script);
    assert!(script.transcript.contains("joint encoder moved as well, by"), "{}", script.transcript);
    // 30 N of 23 mV/N are 856 codes.
    assert!(
        reason.contains("f1: -85") && reason.contains("codes from its zero; take the tendons off"),
        "{reason}"
    );
    assert!(reason.contains("calibration.toml and begin again: they were on"), "{reason}");
}

#[test]
fn a_mass_that_is_off_by_more_than_a_quarter_is_asked_about() {
    let two_kg = |act| match act {
        Act::HangWeight { cell, .. } => Some(Act::HangWeight { cell, mass_kg: 2.0 }),
        act => Some(act),
    };
    let script = || Script::new().with("Mass of the weight", &["3"]).with("Which load cell", &["f4", "done"]);
    let reason = Case::clumsy("sim", two_kg).refused(&mut script().with("f4: 0.0525", &["no"]));
    assert!(reason.contains("f4: 0.0525") && reason.contains("weigh it again"), "{reason}");
    let mut case = Case::clumsy("sim", two_kg);
    let mut script = script().with("f4: 0.0525", &["yes"]).with("Fit both tendons", &["stop"]);
    case.run(&mut script).unwrap_err();
    let gain = Sheet::load(&case.file()).unwrap().gains.unwrap().tension["f4"];
    assert!((gain.gain_n_per_code / (1.5 * 3.3 / 4095.0 / 0.023) - 1.0).abs() < 1.5e-3, "{gain:?}");
}

#[test]
fn impossible_masses_are_refused_by_the_gain_that_they_make() {
    for (mass, expected) in [
        // Ten times the gain: 2.9 codes are 1.0 N. A quarter of it: 3350 codes are 29.3 N.
        ("20", "N/code makes its noise 1.0"),
        ("0.5", "N/code makes the channel end at 29.3"),
    ] {
        // The hand hangs 2 kg all the same.
        let two_kg = |act| match act {
            Act::HangWeight { cell, .. } => Some(Act::HangWeight { cell, mass_kg: 2.0 }),
            act => Some(act),
        };
        let script = Script::new().with("Mass of the weight", &[mass]);
        let reason =
            Case::clumsy("sim", two_kg).refused(&mut script.with("Which load cell", &["f4", "done"]));
        assert!(reason.contains("f4: ") && reason.contains("; check the mass"), "{reason}");
        assert!(reason.contains(expected), "{mass}: {reason}");
    }
}

#[test]
fn answers_that_cannot_be_are_asked_for_again() {
    let mut script = Script::new()
        .with("Mass of the weight", &["two", "-1", "nan", "1000", "2"])
        .with("Which load cell", &["f5", "", "f2", "done"])
        .with("Set these", &["perhaps", "yes", "yes", "yes"])
        .with("Signed off", &["", "Ada"]);
    let (sheet, _) = Case::new("sim").calibrated(&mut script);
    assert_eq!(sheet.gains.unwrap().tension.keys().collect::<Vec<_>>(), ["f2"]);
    for expected in [
        "got `f5`, expected f1, f2, f3, f4 or done, or stop",
        "got `nan`, expected a number of 0.05 to 100 kg",
        "got `1000`, expected a number",
        "got `perhaps`, expected yes or no, or stop",
        "got ``, expected a name",
    ] {
        assert!(script.transcript.contains(expected), "{expected}: {}", script.transcript);
    }
}

#[test]
fn a_stopped_calibration_goes_on_behind_what_is_done() {
    let mut case = Case::new("sim");
    let mut script = Script::new().with("Which load cell", &["f1", "stop"]);
    let failure = case.run(&mut script).unwrap_err();
    assert!(
        failure
            .message()
            .starts_with("stopped by the user during gains, with a weight; the same command goes on"),
        "{failure}"
    );
    let before = Sheet::load(&case.file()).unwrap();
    assert!(before.channel_order.is_some() && before.gains.is_none() && before.signed_off.is_none());
    // No more answers: what is done stays as well.
    let mut script = Script::new().with("Fit both tendons", &[]);
    let failure = case.run(&mut script).unwrap_err();
    assert_eq!(failure.class(), FailureClass::BadInput);
    assert!(failure.message().starts_with("standard input: no answer to `Fit both tendons"), "{failure}");
    assert!(
        script
            .transcript
            .starts_with("1 of 6: zeros of the tension channels and of the current: done before\n")
    );
    let mut script = Script::new();
    case.run(&mut script).unwrap();
    let after = Sheet::load(&case.file()).unwrap();
    assert_eq!((&after.zeros, &after.channel_order), (&before.zeros, &before.channel_order));
    assert!(!script.transcript.contains("Which load cell"), "{}", script.transcript);
    // Finished: nothing is measured, nothing overwritten.
    let text = fs::read_to_string(case.file()).unwrap();
    let failure = case.run(&mut Script::new()).unwrap_err();
    assert_eq!(failure.class(), FailureClass::BadInput);
    assert!(
        failure.message().contains("signed off by Ada Lovelace at 2030-01-02T03:04:05Z; name another file"),
        "{failure}"
    );
    assert_eq!(fs::read_to_string(case.file()).unwrap(), text);
}

#[test]
fn an_interrupt_ends_a_measurement() {
    let mut case = Case::new("sim");
    let looks = Cell::new(0);
    let stop = || {
        looks.set(looks.get() + 1);
        looks.get() > 20
    };
    let failure = case.run_until(&mut Script::new(), &stop).unwrap_err();
    assert!(failure.message().starts_with("stopped by the user during zeros"), "{failure}");
    assert!(failure.message().ends_with("nothing is done yet; the same command begins again"), "{failure}");
    assert!(!case.file().exists());
}

#[test]
fn files_that_are_no_calibration_of_this_board_are_refused() {
    let mut case = Case::new("sim");
    let mut other = Sheet::new(BoardName {
        name: "nucleo".to_owned(),
        serial: "0042".to_owned(),
        firmware: String::new(),
        tool: String::new(),
    });
    other.save(&case.file()).unwrap();
    let failure = case.run(&mut Script::new()).unwrap_err();
    assert!(
        failure
            .message()
            .ends_with("begun with nucleo 0042, this is simulated; name another file with --out"),
        "{failure}"
    );
    other.schema = "bowden-calibration/2".to_owned();
    other.save(&case.file()).unwrap();
    let failure = case.run(&mut Script::new()).unwrap_err();
    assert!(
        failure.message().contains("schema: got `bowden-calibration/2`, expected `bowden-calibration/1`"),
        "{failure}"
    );
    fs::write(case.file(), "schema = \"bowden-calibration/1\"\nzero = 3\n").unwrap();
    let failure = case.run(&mut Script::new()).unwrap_err();
    assert_eq!(failure.class(), FailureClass::BadInput);
    assert!(
        failure.message().contains("calibration.toml:2: no calibration: unknown field `zero`"),
        "{failure}"
    );
}

#[test]
fn a_pretension_that_is_off_is_refused_or_adopted() {
    // The same joint, and a board that is told of 20 N.
    let mut case = Case::new("sim");
    case.told("tendon.pretension", 20.0);
    let reason = case.refused(&mut Script::new().with("The mean is", &["no"]));
    assert!(reason.contains("N above tendon.pretension; loosen the tendons"), "{reason}");
    let mut case = Case::new("sim");
    case.told("tendon.pretension", 20.0);
    let (sheet, parameters) = case.calibrated(&mut Script::new().with("The mean is", &["yes"]));
    let pretension = sheet.pretension.unwrap();
    assert!(pretension.adopted && (pretension.mean_n - 30.0).abs() < 0.3, "{pretension:?}");
    assert!((parameters.value("tendon.pretension").unwrap() - pretension.mean_n).abs() < 1e-4);
}

#[test]
fn what_is_written_reads_back_and_has_time_and_spread_of_every_step() {
    let (sheet, _) = Case::new("sim").calibrated(&mut Script::new());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("again.toml");
    sheet.save(&file).unwrap();
    assert_eq!(Sheet::load(&file).unwrap(), sheet);
    let text = fs::read_to_string(&file).unwrap();
    let count = |line: &str| text.lines().filter(|found| found.starts_with(line)).count();
    // Six steps and the signature. Current, four zeros, four weights and two encoders have a spread each.
    assert_eq!(count("at = \"2030-01-02T03:04:05Z\""), 7, "{text}");
    assert_eq!((count("spread = "), count("samples = 5000")), (11, 11), "{text}");
    let others = ["spread_n_per_code = ", "spread_ohm = ", "[pretension.spread_n]"].map(count);
    assert_eq!(others, [4, 1, 1], "{text}");
}
