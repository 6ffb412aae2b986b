//! A client of the websocket server of `bowden monitor --foxglove`, as Foxglove is one.

use std::collections::HashMap;
use std::net::TcpStream;
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// Topic of the samples.
pub const SAMPLES: &str = "/bowden/samples";

/// Real time in which something has to come.
const HANG_LIMIT: Duration = Duration::from_mins(10);

/// Number of the subscription.
const SUBSCRIPTION: u32 = 7;

/// A client.
pub struct Client {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    /// What the server announces, by topic.
    pub channels: HashMap<String, Value>,
}

/// Address of the server, once it stands on the screen.
pub fn address(screen: &str) -> Option<String> {
    screen.split_whitespace().find(|word| word.starts_with("ws://127.0.0.1:")).map(str::to_owned)
}

impl Client {
    /// Connects, and learns both channels.
    pub fn connect(address: &str) -> Self {
        let mut request = address.into_client_request().unwrap();
        // The protocol that Foxglove asks for.
        request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static("foxglove.sdk.v1"));
        let (mut socket, _) = connect(request).unwrap();
        // A server that falls silent fails the test instead of holding it up for ever.
        let MaybeTlsStream::Plain(stream) = socket.get_mut() else {
            panic!("a plain connection on the loopback")
        };
        stream.set_read_timeout(Some(HANG_LIMIT)).unwrap();
        let mut client = Self { socket, channels: HashMap::new() };
        while client.channels.len() < 2 {
            if let Message::Text(text) = client.socket.read().unwrap() {
                let said: Value = serde_json::from_str(&text).unwrap();
                for channel in said["channels"].as_array().into_iter().flatten() {
                    let topic = channel["topic"].as_str().unwrap();
                    client.channels.insert(topic.to_owned(), channel.clone());
                }
            }
        }
        client
    }

    /// Asks for the samples.
    pub fn subscribe(&mut self) {
        let subscriptions = [json!({ "id": SUBSCRIPTION, "channelId": self.channels[SAMPLES]["id"] })];
        let subscription = json!({ "op": "subscribe", "subscriptions": subscriptions });
        self.socket.send(Message::text(subscription.to_string())).unwrap();
    }

    /// The next sample.
    pub fn sample(&mut self) -> Value {
        loop {
            let Message::Binary(data) = self.socket.read().unwrap() else { continue };
            // Opcode 1, number of the subscription, time, message.
            if data[0] == 1 {
                assert_eq!(data[1..5], SUBSCRIPTION.to_le_bytes());
                return serde_json::from_slice(&data[13..]).unwrap();
            }
        }
    }
}
