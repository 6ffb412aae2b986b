//! The page about the first hour: every line of it that needs no hardware runs, in the order of the page.

mod common;

use std::path::Path;

use common::bowden;

const PAGE: &str = include_str!("../docs/first-hour.md");

/// Board in place of the one on USB.
const BOARD: &str = "sim:joint_spring:2,seed=3";

/// Blocks of commands of the page.
fn blocks() -> Vec<Vec<&'static str>> {
    let mut blocks = Vec::new();
    let mut lines = PAGE.lines();
    while lines.by_ref().any(|line| line == "```sh") {
        blocks
            .push(lines.by_ref().take_while(|line| *line != "```").filter(|line| !line.is_empty()).collect());
    }
    blocks
}

/// Arguments of a line: words, with quotes around those that have spaces; a comment or redirection ends it.
fn arguments(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut quoted = false;
    let mut word = String::new();
    for c in line.chars().chain([' ']) {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.extend((!word.is_empty()).then(|| std::mem::take(&mut word))),
            c => word.push(c),
        }
    }
    let end = words.iter().position(|word| word == "#" || word == ">").unwrap_or(words.len());
    words.truncate(end);
    words
}

fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let words = arguments(line);
    assert_eq!(words[0], "bowden", "{line}");
    let words: Vec<&str> =
        words[1..].iter().map(|word| if word == "auto" { BOARD } else { word.as_str() }).collect();
    bowden(folder, &words)
}

/// Held-out losses before and after in "held-out loss ... from A to B".
fn losses(text: &str) -> [f64; 2] {
    let after = text.split("the held-out loss").nth(1).unwrap();
    let mut numbers =
        after.split_whitespace().filter_map(|word| word.trim_end_matches(['.', ',']).parse::<f64>().ok());
    [numbers.next().unwrap(), numbers.next().unwrap()]
}

/// Tenths, as the page gives them.
fn rounded(loss: f64) -> i64 {
    (loss * 10.0).round() as i64
}

#[test]
fn every_line_of_the_first_hour_runs() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let mut ran = 0;
    for block in blocks() {
        if block[0].starts_with("# with a board") {
            let needs_none = |line: &&str| line.starts_with("bowden ") && !line.starts_with("bowden flash ");
            assert!(!block.iter().any(needs_none), "{block:?}");
            continue;
        }
        for line in block {
            let (status, stdout, stderr) = run(place, line);
            // A probe or port of this machine that may not be opened is no fault of the page.
            let expected = i32::from(line.starts_with("bowden doctor") && stdout.contains("WRONG"));
            assert_eq!(status, expected, "{line}\n{stdout}{stderr}");
            if line.starts_with("bowden send") {
                assert_eq!(stdout, "state: ready\n");
            }
            if line.starts_with("bowden diagnose") {
                assert!(stdout.contains("lacks joint_spring: "), "{stdout}");
                assert_eq!(losses(&stdout).map(rounded), losses(PAGE).map(rounded), "{stdout}");
            }
            ran += 1;
        }
    }
    assert_eq!(ran, 17);
    for file in ["bench.toml", "first.mcap", "rig.toml", "found/report.html", "whole.mcap", "first.parquet"] {
        assert!(place.join(file).exists(), "{file}");
    }
}
