//! How the simulated board is wired, as the name of the port says it: `sim:swap=f1-f3,reversed=motor`.

/// Names of the load cells and of the board's inputs for them.
const CELLS: [&str; 4] = ["f1", "f2", "f3", "f4"];

/// Largest count of an encoder.
const LARGEST_COUNT: u16 = 4095;

/// Wires and mountings of the simulated board.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wiring {
    /// Load cell that is plugged into each tension input; none: the wire is broken.
    pub cell: [Option<usize>; 4],
    /// The encoders count the other way round: input pulley, joint.
    pub encoder_reversed: [bool; 2],
    /// Each encoder is plugged into the other one's place.
    pub encoders_swapped: bool,
    /// Counts of the encoders at angle zero; none: as the board's parameters have them.
    pub mounted_counts: Option<[u16; 2]>,
    /// The motor's leads are the wrong way round.
    pub motor_reversed: bool,
}

impl Default for Wiring {
    /// Everything where it belongs.
    fn default() -> Self {
        Self {
            cell: [0, 1, 2, 3].map(Some),
            encoder_reversed: [false; 2],
            encoders_swapped: false,
            mounted_counts: None,
            motor_reversed: false,
        }
    }
}

impl Wiring {
    /// Takes `key=value` of the port's name; false if the key is none of the wiring's.
    ///
    /// # Errors
    /// What is wrong with the value.
    pub(super) fn take(&mut self, key: &str, value: &str) -> Result<bool, String> {
        let cell = |name: &str| {
            CELLS
                .iter()
                .position(|cell| *cell == name)
                .ok_or_else(|| format!("{key}: got `{value}`, expected f1, f2, f3 or f4"))
        };
        match key {
            "swap" if value == "encoders" => self.encoders_swapped = true,
            "swap" => {
                let (one, other) = value.split_once('-').ok_or_else(|| {
                    format!("swap: got `{value}`, expected two cells such as f1-f3, or encoders")
                })?;
                self.cell.swap(cell(one)?, cell(other)?);
            }
            "dead" => self.cell[cell(value)?] = None,
            "reversed" => match value {
                "input" => self.encoder_reversed[0] = true,
                "joint" => self.encoder_reversed[1] = true,
                "motor" => self.motor_reversed = true,
                _ => return Err(format!("reversed: got `{value}`, expected input, joint or motor")),
            },
            "mounted" => {
                let counts = value.split_once('-').and_then(|(input, joint)| {
                    Some([input.parse().ok()?, joint.parse().ok()?])
                        .filter(|counts: &[u16; 2]| counts.iter().all(|count| *count <= LARGEST_COUNT))
                });
                let expected =
                    || format!("mounted: got `{value}`, expected counts 0 to 4095 such as 300-3500");
                self.mounted_counts = Some(counts.ok_or_else(expected)?);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_are_read_and_nonsense_is_named() {
        let mut wiring = Wiring::default();
        for (key, value) in [
            ("swap", "f1-f3"),
            ("swap", "encoders"),
            ("dead", "f4"),
            ("reversed", "joint"),
            ("reversed", "motor"),
            ("mounted", "300-3500"),
        ] {
            assert_eq!(wiring.take(key, value), Ok(true));
        }
        assert_eq!(wiring.cell, [Some(2), Some(1), Some(0), None]);
        assert_eq!((wiring.encoder_reversed, wiring.encoders_swapped), ([false, true], true));
        assert_eq!((wiring.motor_reversed, wiring.mounted_counts), (true, Some([300, 3500])));
        assert_eq!(wiring.take("seed", "1"), Ok(false));
        for (key, value) in
            [("swap", "f1"), ("swap", "f1-f5"), ("dead", "a"), ("reversed", "f1"), ("mounted", "1-4096")]
        {
            assert!(wiring.take(key, value).unwrap_err().starts_with(&format!("{key}: got `")), "{value}");
        }
    }
}
