//! The page about the first hour against the release image: its lines in their order, with the emulated board on the port.
//!
//! `bowden diagnose` takes most of the page's time and needs no board: the tests of the host tools run it. What follows it is given the rig file that
//! the recording left.

use bowden_board::Board;
use bowden_core::recording::{ReadOptions, Recording};
use bowden_on_board_tests::tool::Plugged;
use bowden_on_board_tests::{Outcome, image};
use virtual_bench::{BenchConfig, ConcealedEffect};

#[path = "../../../../host-tools/tests/common/first_hour.rs"]
#[expect(dead_code, reason = "another part of it is for the tests of the host tools")]
mod page;

use page::{arguments, blocks, expected_status};

/// Seed of the joint of the page, its spring, and how far it is off its data sheet, per cent: `sim:joint_spring:2,seed=3`.
const SEED: u64 = 3;
const STRENGTH: f64 = 2.0;
const PERCENT_OFF: f64 = 3.0;

#[test]
fn every_line_of_the_first_hour_runs_on_the_board() -> Outcome {
    let bench = BenchConfig::default().perturbed(SEED, PERCENT_OFF);
    let spring = ConcealedEffect::drawn("joint_spring", STRENGTH, SEED).expect("a spring");
    let board = Board::builder(&image::firmware()?).bench(&bench, &[spring]).seed(SEED).build()?;
    let mut board = Plugged::new(board)?;
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut ran = Vec::new();
    for line in blocks().concat() {
        if line.starts_with("bowden diagnose") {
            continue;
        }
        let line = &line.replace("found/rig.diagnosed.toml", "rig.toml");
        let flash_operations = board.board.flash_operations();
        let port = board.port();
        // Neither side of a line depends on how fast this machine is.
        let words = arguments(line, &[port.as_str(), "--timeout", "600"]);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let run = board.run_in(place, &words)?;
        let (stdout, stderr) = (run.output.as_str(), run.errors.as_str());
        assert_eq!(run.status, Some(expected_status(line, stdout)), "{line}\n{stdout}{stderr}");
        let says = |text: &str| assert!(stdout.contains(text), "{line}\n{stdout}");
        match words[0] {
            "doctor" if words.len() > 1 => says("ok     board: nucleo-g474re, firmware "),
            "faults" => says("no fault"),
            "params" if words.contains(&"store") => {
                assert!(board.board.flash_operations() > flash_operations, "{line}");
            }
            "send" => assert_eq!(stdout, "state: ready\n"),
            "record" => says("first.mcap: 10000 rows over 20.000 s, tick 100.0 us\n"),
            _ => {}
        }
        assert_eq!(board.board.pwm().duty, None, "{line}: the bridge is on behind it");
        ran.push(words[0].to_owned());
    }
    let count = |command: &str| ran.iter().filter(|ran| *ran == command).count();
    assert_eq!((ran.len(), count("params"), count("doctor")), (16, 5, 2), "{ran:?}");
    // The same rows in every form, without a gap, of the joint that the page drives.
    let load = |name: &str| Recording::load(&place.join(name), &ReadOptions::default()).expect("a recording");
    let [first, whole, parquet] = ["first.mcap", "whole.mcap", "first.parquet"].map(load);
    assert!(whole == first && parquet == first);
    assert_eq!(first.len(), 10_000);
    assert!(first.t_s().windows(2).all(|pair| (pair[1] - pair[0] - 2e-3).abs() < 1e-8));
    let said = |name| first.metadata().entry("bowden.recording", name);
    assert_eq!((said("board"), said("note")), (Some("nucleo-g474re"), Some("first hour")));
    assert_eq!(first.metadata().entry("bowden.end", "end"), Some("complete"));
    assert!(place.join("bench.toml").exists());
    Ok(())
}
