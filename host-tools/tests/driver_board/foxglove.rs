//! `bowden monitor --foxglove`: what a client of its websocket server gets.

use std::fs;
use std::net::TcpListener;
use std::path::Path;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;
use serde_json::Value;

use crate::bowden;
use crate::fake::Fake;
use crate::foxglove_client::{Client, SAMPLES, address};
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::screen::Screen;

/// A client of the server whose address stands on the screen.
fn client(screen: &mut Screen) -> Client {
    screen.wait_until("an address", |text| address(text).is_some());
    Client::connect(&address(&screen.text()).unwrap())
}

/// Schema of a topic's messages.
fn schema(client: &Client, topic: &str) -> Value {
    serde_json::from_str(client.channels[topic]["schema"].as_str().unwrap()).unwrap()
}

#[test]
fn a_client_gets_the_live_samples_that_the_layout_shows() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let command = terminal.command(folder.path(), "monitor", &["--foxglove=0"]);
    let mut screen = Screen::start(&command, 100, 30);
    let mut client = client(&mut screen);
    assert_eq!(client.channels[SAMPLES]["encoding"], "json");
    assert_eq!(schema(&client, SAMPLES)["properties"]["f4_n"]["description"], "N");

    client.subscribe();
    let mut before_s = 0.0;
    for _ in 0..50 {
        let sample = client.sample();
        // By hand from codes and parameters of the fake, as the recording has them.
        let close = |name: &str, expected: f64| {
            assert!((sample[name].as_f64().unwrap() - expected).abs() < 1e-6, "{name}: {sample}");
        };
        close("f4_n", (1450.0 - 620.5) * 0.035_037);
        close("bus_v", 2707.0 * 0.008_864_5);
        let [f2, f4] = ["f2_n", "f4_n"].map(|name| sample[name].as_f64().unwrap());
        close("torque_out_nm", (f2 - f4) * 0.015);
        // A sample a millisecond, in their order.
        let t_s = sample["t_s"].as_f64().unwrap();
        assert!(t_s > before_s + 0.9e-3, "{t_s} after {before_s}");
        before_s = t_s;
    }

    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/foxglove-layout.json");
    let layout: Value = serde_json::from_str(&fs::read_to_string(layout).unwrap()).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let mut shown = 0;
    for path in panels.values().flat_map(|panel| panel["paths"].as_array().unwrap()) {
        let (topic, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
        assert!(schema(&client, topic)["properties"][field].is_object(), "{topic} {field}");
        shown += 1;
    }
    drop(client);
    assert!(shown >= 15, "{shown}");
    let tree = layout["layout"].to_string();
    assert!(panels.keys().all(|panel| tree.contains(&format!("\"{panel}\""))), "{tree}");

    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
}

#[test]
fn a_client_sees_the_simulated_joint_move_as_it_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["monitor", "--port", "sim", "--foxglove=0", "--record", "a.csv"];
    let course = ["--reference", "sine", "--amplitude", "0.2", "--frequency", "1"];
    let command = crate::command(folder.path(), &[&arguments[..], &course].concat());
    let mut screen = Screen::start(&command, 100, 30);
    let mut client = client(&mut screen);
    client.subscribe();
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("r");
    // A client that is slow misses samples: it looks until it has seen both turns of the sine.
    let mut samples = Vec::new();
    let mut seen = [0.0_f64; 2];
    while seen[0] > -0.15 || seen[1] < 0.15 {
        let sample = client.sample();
        let angle = sample["theta_out_rad"].as_f64().unwrap();
        seen = [seen[0].min(angle), seen[1].max(angle)];
        samples.push(sample);
        assert!(!screen.has_ended() && samples.len() < 600_000, "{seen:?}");
    }
    drop(client);
    screen.press(" ");
    screen.wait_for("stopped");
    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));

    let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
    let mut before_s = -1.0;
    for sample in &samples {
        let t_s = sample["t_s"].as_f64().unwrap();
        assert!(t_s > before_s, "{t_s} after {before_s}");
        before_s = t_s;
        let row = recording.t_s().partition_point(|recorded_s| *recorded_s < t_s - 5e-5);
        assert!((recording.t_s()[row] - t_s).abs() < 1e-8, "{sample}");
        for channel in [Channel::ThetaOut, Channel::F1, Channel::F4, Channel::MotorCurrent] {
            let recorded = recording.channel(channel).unwrap()[row];
            let shown = sample[channel.role()].as_f64().unwrap();
            assert!((shown - recorded).abs() < 1e-6, "{}: {recorded} recorded, {sample}", channel.role());
        }
    }
    assert!(seen[0] > -0.25 && seen[1] < 0.25, "{seen:?}");
}

#[test]
fn a_port_that_is_taken_is_told() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::start(
        &crate::command(folder.path(), &["monitor", "--port", "sim", &format!("--foxglove={port}")]),
        80,
        24,
    );
    let (status, stderr) = screen.end();
    assert_eq!(status, 2);
    assert!(stderr.starts_with(&format!("bowden: --foxglove {port}: cannot be served: ")), "{stderr}");
    assert!(stderr.trim_end().ends_with("; name another port"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1);
    let (status, _, _) = bowden(folder.path(), &["monitor", "--port", "sim", "--foxglove=70000"]);
    assert_eq!(status, 2);
}
