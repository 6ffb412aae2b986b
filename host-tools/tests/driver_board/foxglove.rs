//! `bowden monitor --foxglove`: what a client of its websocket server gets.

use std::collections::HashMap;
use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, connect};

use crate::bowden;
use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::screen::Screen;

/// Real time in which something has to come.
const HANG_LIMIT: Duration = Duration::from_mins(10);

/// Address that stands on the screen.
fn address(screen: &mut Screen) -> String {
    screen.wait_until("an address", |text| text.contains("ws://127.0.0.1:"));
    let text = screen.text();
    let address = text.split_whitespace().find(|word| word.starts_with("ws://")).unwrap();
    address.to_owned()
}

#[test]
fn a_client_gets_the_live_samples_that_the_layout_shows() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let command = terminal.command(folder.path(), "monitor", &["--foxglove=0"]);
    let mut screen = Screen::start(&command, 100, 30);
    let address = address(&mut screen);
    let mut request = address.into_client_request().unwrap();
    // The protocol that Foxglove asks for.
    request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static("foxglove.sdk.v1"));
    let (mut client, _) = connect(request).unwrap();
    // A server that falls silent fails the test instead of holding it up for ever.
    let MaybeTlsStream::Plain(stream) = client.get_mut() else {
        panic!("a plain connection on the loopback")
    };
    stream.set_read_timeout(Some(HANG_LIMIT)).unwrap();

    let mut channels: HashMap<String, Value> = HashMap::new();
    while channels.len() < 2 {
        if let Message::Text(text) = client.read().unwrap() {
            let said: Value = serde_json::from_str(&text).unwrap();
            for channel in said["channels"].as_array().into_iter().flatten() {
                channels.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
            }
        }
    }
    let samples = &channels["/bowden/samples"];
    assert_eq!(samples["encoding"], "json");
    let schema: Value = serde_json::from_str(samples["schema"].as_str().unwrap()).unwrap();
    assert_eq!(schema["properties"]["f4_n"]["description"], "N");

    let subscription =
        json!({ "op": "subscribe", "subscriptions": [{ "id": 7, "channelId": samples["id"] }] });
    client.send(Message::text(subscription.to_string())).unwrap();
    let mut before_s = 0.0;
    let mut got = 0;
    while got < 50 {
        let Message::Binary(data) = client.read().unwrap() else { continue };
        // Opcode 1, number of the subscription, time, message.
        if data[0] != 1 {
            continue;
        }
        assert_eq!(data[1..5], 7_u32.to_le_bytes());
        let sample: Value = serde_json::from_slice(&data[13..]).unwrap();
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
        got += 1;
    }
    drop(client);

    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/foxglove-layout.json");
    let layout: Value = serde_json::from_str(&fs::read_to_string(layout).unwrap()).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let mut shown = 0;
    for path in panels.values().flat_map(|panel| panel["paths"].as_array().unwrap()) {
        let (topic, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
        let schema: Value = serde_json::from_str(channels[topic]["schema"].as_str().unwrap()).unwrap();
        assert!(schema["properties"][field].is_object(), "{topic} {field}");
        shown += 1;
    }
    assert!(shown >= 15, "{shown}");
    let tree = layout["layout"].to_string();
    assert!(panels.keys().all(|panel| tree.contains(&format!("\"{panel}\""))), "{tree}");

    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
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
