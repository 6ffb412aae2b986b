//! Where samples stand in their file.

/// Kind of place that a format counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    Line,
    Message,
    Sample,
}

/// Place of every sample, kept as the few points where the distance between sample and place number changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    unit: Unit,
    /// Sample from which on the place number is the sample number plus the shift.
    shifts: Vec<(usize, u64)>,
}

impl Places {
    /// Samples that come from no file.
    pub(super) fn samples() -> Self {
        Self { unit: Unit::Sample, shifts: Vec::new() }
    }

    /// Lines of a text file.
    pub(super) fn lines() -> Self {
        Self { unit: Unit::Line, shifts: Vec::new() }
    }

    /// Messages of a topic.
    pub(super) fn messages() -> Self {
        Self { unit: Unit::Message, shifts: Vec::new() }
    }

    /// Says that sample `sample` stands at place `number`, in ascending order.
    pub(super) fn push(&mut self, sample: usize, number: u64) {
        let shift = number.saturating_sub(sample as u64);
        if self.shifts.last().is_none_or(|(_, last)| *last != shift) {
            self.shifts.push((sample, shift));
        }
    }

    /// Number of the place of a sample.
    pub fn number(&self, sample: usize) -> u64 {
        let next = self.shifts.partition_point(|(from, _)| *from <= sample);
        let shift = next.checked_sub(1).map_or(0, |last| self.shifts[last].1);
        sample as u64 + shift
    }

    /// The place as a message begins.
    pub(super) fn describe(&self, source: &str, sample: usize) -> String {
        self.unit.describe(source, self.number(sample))
    }

    /// A place by its number, as a message begins.
    pub(super) fn describe_number(&self, source: &str, number: u64) -> String {
        self.unit.describe(source, number)
    }

    /// The places of these samples, which rise.
    pub(super) fn of(&self, samples: &[usize]) -> Self {
        let mut places = Self { unit: self.unit, shifts: Vec::new() };
        for (sample, before) in samples.iter().enumerate() {
            places.push(sample, self.number(*before));
        }
        places
    }

    /// The places without the first samples.
    pub(super) fn after(&self, first: usize) -> Self {
        let mut places = Self { unit: self.unit, shifts: Vec::new() };
        places.push(0, self.number(first));
        for (sample, shift) in self.shifts.iter().filter(|(sample, _)| *sample > first) {
            places.push(sample - first, *sample as u64 + shift);
        }
        places
    }
}

impl Unit {
    fn describe(self, source: &str, number: u64) -> String {
        match self {
            Self::Line => format!("{source}:{number}"),
            Self::Message => format!("{source}: message {number}"),
            Self::Sample => format!("{source}: sample {number}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_survive_a_gap_and_a_slice() {
        let mut places = Places::lines();
        // Two samples after the header, a blank line, three more.
        for (sample, line) in [2, 3, 5, 6, 7].into_iter().enumerate() {
            places.push(sample, line);
        }
        assert_eq!((0..5).map(|sample| places.number(sample)).collect::<Vec<_>>(), [2, 3, 5, 6, 7]);
        assert_eq!(places.shifts.len(), 2);
        let later = places.after(1);
        assert_eq!((0..4).map(|sample| later.number(sample)).collect::<Vec<_>>(), [3, 5, 6, 7]);
        assert_eq!(later.describe("a.csv", 1), "a.csv:5");
        let some = places.of(&[0, 3, 4]);
        assert_eq!((0..3).map(|sample| some.number(sample)).collect::<Vec<_>>(), [2, 6, 7]);
    }
}
