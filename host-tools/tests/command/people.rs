//! What makes the command usable: completions, manual pages, `doctor`, facts as JSON, no colours in a pipe.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::bowden;
use crate::screen::Screen;
use bowden_core::recording::Recording;
use bowden_model::channel::Channel;

/// Subcommands, by what the help lists.
fn subcommands() -> Vec<String> {
    let (status, help, _) = bowden(Path::new("."), &["--help"]);
    assert_eq!(status, 0);
    let lines =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<String> =
        // A line that goes on with what a command does begins farther right.
        lines
            .filter(|line| !line.starts_with("   "))
            .filter_map(|line| line.split_whitespace().next())
            .map(str::to_owned)
            .collect();
    assert!(names.len() > 15, "{help}");
    names.into_iter().filter(|name| name != "help").collect()
}

#[test]
fn bash_itself_completes_every_subcommand() {
    let folder = tempfile::tempdir().unwrap();
    let (status, script, stderr) = bowden(folder.path(), &["completions", "bash"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    fs::write(folder.path().join("c.bash"), script).unwrap();
    // As bash calls it after `bowden re` and a tab.
    let ask = "source ./c.bash; COMP_WORDS=(bowden re); COMP_CWORD=1; _bowden bowden re bowden; echo ${COMPREPLY[@]}";
    let output = Command::new("bash").current_dir(folder.path()).args(["-c", ask]).output().unwrap();
    let offered = String::from_utf8(output.stdout).unwrap();
    let mut offered: Vec<&str> = offered.split_whitespace().collect();
    offered.sort_unstable();
    let names = subcommands();
    let mut expected: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| name.starts_with("re")).collect();
    expected.sort_unstable();
    assert_eq!(offered, expected);
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        let (status, script, _) = bowden(folder.path(), &["completions", shell]);
        assert!(status == 0 && names.iter().all(|name| script.contains(name.as_str())), "{shell}");
    }
    let (status, _, stderr) = bowden(folder.path(), &["completions", "tcsh"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = bowden(folder.path(), &["man", "--out", "man1"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    for name in subcommands() {
        let page = fs::read_to_string(folder.path().join(format!("man1/bowden-{name}.1"))).unwrap();
        assert!(page.contains(".SH NAME") && page.contains(".SH SYNOPSIS"), "{name}");
    }
    let (status, page, _) = bowden(folder.path(), &["man"]);
    assert!(status == 0 && page.contains(".TH bowden 1") && page.contains("Exit status"), "{page}");
}

#[test]
fn doctor_says_what_is_there_and_talks_to_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, stderr) = bowden(folder.path(), &["doctor", "--port", "sim", "--json"]);
    let checks: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let subjects: Vec<&str> =
        checks.as_array().unwrap().iter().map(|check| check["subject"].as_str().unwrap()).collect();
    assert_eq!(subjects, ["bowden", "compiler", "probe", "port", "board"]);
    // The simulated board is of this program and has no revision of its own.
    let found = concat!("simulated, firmware ", env!("CARGO_PKG_VERSION"), ", state off");
    assert_eq!((&checks[4]["grade"], &checks[4]["found"]), (&"ok".into(), &found.into()));
    let wrong = stdout.contains("\"wrong\"");
    assert_eq!(status, i32::from(wrong), "{stderr}");
    let (status, stdout, stderr) = bowden(folder.path(), &["doctor", "--port", "/no/such/port"]);
    assert_eq!((status, stderr.lines().count()), (1, 1), "{stderr}");
    assert!(stdout.contains("WRONG  board: /no/such/port: "), "{stdout}");
    assert!(stderr.contains("board; the lines above say what to do"), "{stderr}");
}

#[test]
fn facts_of_a_board_come_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let json = |arguments: &[&str]| -> serde_json::Value {
        let (status, stdout, stderr) = bowden(folder.path(), arguments);
        assert_eq!((status, stderr.as_str()), (0, ""), "{arguments:?}");
        serde_json::from_str(&stdout).unwrap()
    };
    let parameters = json(&["params", "--port", "sim", "--json"]);
    assert!(parameters.as_array().unwrap().len() > 90);
    let one = json(&["params", "--port", "sim", "get", "supervisor.host_timeout", "--json"]);
    assert_eq!((&one[0]["value"], &one[0]["unit"]), (&0.5.into(), &"s".into()));
    let status = json(&["send", "--port", "sim", "status", "--json"]);
    assert_eq!(
        (&status["state"], &status["fault"], &status["samples_lost"]),
        (&"off".into(), &serde_json::Value::Null, &0.into())
    );
    assert_eq!(json(&["params", "--port", "sim", "table", "--json"]), serde_json::Value::Null);
    let (status, _, stderr) =
        bowden(folder.path(), &["params", "--port", "sim", "table", "--clear", "--json"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
    let faults = json(&["faults", "--port", "sim", "--json"]);
    assert_eq!(
        (&faults["state"], &faults["fault"], &faults["board"]),
        (&"off".into(), &serde_json::Value::Null, &"simulated".into())
    );
    assert_eq!(json(&["send", "--port", "sim", "ready", "--json"]), serde_json::json!({ "state": "ready" }));
    // A rig with another pretension.
    let rig = virtual_bench::nominal_rig_toml("bench").replace("pretension_n = 30.0", "pretension_n = 35.0");
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let from_rig = ["params", "--port", "sim", "from-rig", "rig.toml", "--json"];
    for (more, set) in [(&["--dry-run"][..], false), (&[], true)] {
        let facts = json(&[&from_rig[..], more].concat());
        let changes = facts["changes"].as_array().unwrap();
        let pretension = changes.iter().find(|change| change["parameter"] == "tendon.pretension").unwrap();
        assert_eq!(facts["set"], set);
        assert_eq!(
            *pretension,
            serde_json::json!({ "parameter": "tendon.pretension", "old": 30.0, "new": 35.0, "unit": "N", "from": "tendon.pretension_n" })
        );
        assert!(facts["unused"].is_array() && facts["limited"].is_array(), "{facts}");
    }
    let (status, _, stderr) = bowden(folder.path(), &["params", "--port", "sim", "store", "--json"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
}

#[test]
fn what_was_made_of_a_run_comes_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let json = |arguments: &[&str], expected: i32| -> serde_json::Value {
        let (status, stdout, stderr) = bowden(folder.path(), &[arguments, &["--json"]].concat());
        assert_eq!(status, expected, "{arguments:?}: {stderr}");
        serde_json::from_str(&stdout).unwrap()
    };
    let recorded = json(&["record", "--port", "sim", "--seconds", "0.2", "--out", "a.csv"], 0);
    let facts = json(&["info", "a.csv"], 0);
    assert_eq!((&recorded["out"], &recorded["rows"]), (&"a.csv".into(), &facts[0]["rows"]));
    assert_eq!((&recorded["duration_s"], &recorded["tick_us"]), (&0.2.into(), &100.0.into()));

    // A short recording that is whole, and a torn one.
    std::fs::create_dir(folder.path().join("runs")).unwrap();
    let arguments =
        ["--reference", "sine", "--amplitude", "0.3", "--home", "--seconds", "3.1", "--every", "40"];
    let files = ["--out", "runs/whole.csv", "--rig", "runs/rig.toml", "--load", "2.5,0.03"];
    json(&[&["record", "--port", "sim"], &arguments[..], &files].concat(), 0);
    std::fs::write(folder.path().join("runs/torn.csv"), "t_s,duty\n0,x\n").unwrap();
    let survey = json(&["survey", "runs", "--out", "found", "--quiet"], 3);
    assert_eq!(
        (&survey["recordings"], &survey["diagnosed"], &survey["kept"], &survey["left"]),
        (&2.into(), &1.into(), &0.into(), &0.into())
    );
    let failed = &survey["failed"][0];
    assert!(failed["recording"].as_str().unwrap().ends_with("torn.csv"), "{failed}");
    assert!(failed["reason"].as_str().unwrap().contains("torn.csv:2"), "{failed}");
    assert_eq!(survey["page"], "found/survey.html");
}

#[test]
fn nothing_is_coloured_in_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [&[&str]; 5] =
        [&["--help"], &["record", "--help"], &["nonsense"], &["doctor"], &["params", "--port", "sim"]];
    for arguments in cases {
        let (_, stdout, stderr) = bowden(folder.path(), arguments);
        assert!(!stdout.contains('\u{1b}') && !stderr.contains('\u{1b}'), "{arguments:?}");
    }
}

/// A bar while work goes on, and nothing of it left on the screen behind it.
#[test]
fn long_work_shows_a_bar_on_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let t_s: Vec<f64> = (0..400_000).map(|row| f64::from(row) * 1e-4).collect();
    let values = t_s.iter().map(|t_s| (3.0 * t_s).sin()).collect();
    let recording = Recording::new("made", t_s).with(Channel::F1, values);
    recording.save(&folder.path().join("a.csv")).unwrap();
    let shown = |arguments: &[&str], stage: &str| {
        // The screen takes standard output alone; progress is on standard error.
        let mut command = Command::new("sh");
        command.current_dir(folder.path()).args(["-c", "exec \"$@\" 2>&1", "sh"]);
        command.arg(env!("CARGO_BIN_EXE_bowden")).args(arguments);
        let mut screen = Screen::start(&command, 100, 30);
        screen.wait_for(stage);
        let (status, _) = screen.end();
        assert_eq!(status, 0, "{}", screen.text());
        assert!(!screen.text().contains(stage), "{}", screen.text());
    };
    shown(&["convert", "a.csv", "a.mcap"], "converting");
    shown(&["recover", "a.csv", "--out", "b.mcap"], "recovering");
    shown(&["info", "a.csv"], "reading");
    shown(&["check", "a.csv"], "reading");
}
