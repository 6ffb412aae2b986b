//! What the board did, for comparison between runs: a hash of all outputs and the edges of watched pins.

/// A pin: port and number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pin {
    /// Port letter, `A` to `G`.
    pub port: char,
    /// Number, 0 to 15.
    pub number: u8,
}

impl Pin {
    /// The pin `number` of `port`.
    pub const fn new(port: char, number: u8) -> Self {
        Self { port, number }
    }

    /// Index of the port, A = 0.
    pub(crate) fn port_index(self) -> usize {
        (self.port as usize).wrapping_sub('A' as usize)
    }
}

/// A level change of an output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Board time \[s\].
    pub at_s: f64,
    /// Cycle of the core clock.
    pub cycle: u64,
    /// Level behind the edge.
    pub high: bool,
}

/// Kinds of events that enter the hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Store to a compare register of TIM1.
    Compare,
    /// Edge of an output pin.
    PinEdge,
    /// Bytes of the device to the host.
    UsbIn,
    /// Bytes of the host to the device.
    UsbOut,
    /// A reset.
    Reset,
}

/// FNV-1a over time, kind and value of every event, and edges of the watched pins.
#[derive(Debug, Clone)]
pub(crate) struct Trace {
    hash: u64,
    watched: Vec<(Pin, Vec<Edge>)>,
}

impl Trace {
    /// Nothing seen, nothing watched.
    pub(crate) fn new() -> Self {
        Self { hash: 0xcbf2_9ce4_8422_2325, watched: Vec::new() }
    }

    /// Takes in an event.
    pub(crate) fn event(&mut self, cycle: u64, kind: Kind, bytes: &[u8]) {
        let mut take = |byte: u8| self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        cycle.to_le_bytes().into_iter().for_each(&mut take);
        take(kind as u8);
        bytes.iter().copied().for_each(take);
    }

    /// Takes in an edge of `pin`.
    pub(crate) fn edge(&mut self, pin: Pin, edge: Edge) {
        self.event(edge.cycle, Kind::PinEdge, &[pin.port as u8, pin.number, u8::from(edge.high)]);
        if let Some((_, edges)) = self.watched.iter_mut().find(|(watched, _)| *watched == pin) {
            edges.push(edge);
        }
    }

    /// Hash of everything so far.
    pub(crate) fn hash(&self) -> u64 {
        self.hash
    }

    /// Keeps edges of `pin` from now on.
    pub(crate) fn watch(&mut self, pin: Pin) {
        if !self.watched.iter().any(|(watched, _)| *watched == pin) {
            self.watched.push((pin, Vec::new()));
        }
    }

    /// Edges of `pin` since it is watched.
    pub(crate) fn edges(&self, pin: Pin) -> &[Edge] {
        self.watched.iter().find(|(watched, _)| *watched == pin).map_or(&[], |(_, edges)| edges)
    }

    /// Takes out the edges of `pin`.
    pub(crate) fn take_edges(&mut self, pin: Pin) -> Vec<Edge> {
        let watched = self.watched.iter_mut().find(|(watched, _)| *watched == pin);
        watched.map_or_else(Vec::new, |(_, edges)| std::mem::take(edges))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(events: &[(u64, Kind, &[u8])]) -> u64 {
        let mut trace = Trace::new();
        for (cycle, kind, bytes) in events {
            trace.event(*cycle, *kind, bytes);
        }
        trace.hash()
    }

    #[test]
    fn time_kind_value_and_order_all_count() {
        let reference = hash(&[(5, Kind::UsbIn, b"a"), (9, Kind::UsbIn, b"b")]);
        assert_eq!(reference, hash(&[(5, Kind::UsbIn, b"a"), (9, Kind::UsbIn, b"b")]));
        assert_ne!(reference, hash(&[(6, Kind::UsbIn, b"a"), (9, Kind::UsbIn, b"b")]));
        assert_ne!(reference, hash(&[(5, Kind::UsbOut, b"a"), (9, Kind::UsbIn, b"b")]));
        assert_ne!(reference, hash(&[(5, Kind::UsbIn, b"a"), (9, Kind::UsbIn, b"c")]));
        assert_ne!(reference, hash(&[(9, Kind::UsbIn, b"b"), (5, Kind::UsbIn, b"a")]));
    }

    #[test]
    fn only_watched_pins_keep_their_edges() {
        let mut trace = Trace::new();
        trace.watch(Pin::new('C', 8));
        let edge = Edge { at_s: 0.0, cycle: 1, high: true };
        trace.edge(Pin::new('C', 8), edge);
        trace.edge(Pin::new('A', 8), edge);
        assert_eq!(trace.edges(Pin::new('C', 8)), [edge]);
        assert!(trace.edges(Pin::new('A', 8)).is_empty());
        assert_eq!(trace.take_edges(Pin::new('C', 8)).len(), 1);
        assert!(trace.edges(Pin::new('C', 8)).is_empty());
    }
}
