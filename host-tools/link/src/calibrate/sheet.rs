//! The file of a calibration: what was measured, when, with which spread, and who signed it off.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_core::output;
use serde::{Deserialize, Serialize};

/// Value of `schema`.
pub const CALIBRATION_SCHEMA: &str = "bowden-calibration/1";

/// A calibration, as its file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// [`CALIBRATION_SCHEMA`].
    pub schema: String,
    /// The board it is of.
    pub board: BoardName,
    /// Channels without load.
    pub zeros: Option<Zeros>,
    /// Which load cell is plugged in where.
    pub channel_order: Option<ChannelOrder>,
    /// Channels under a weight.
    pub gains: Option<Gains>,
    /// Directions and zeros of the encoders.
    pub encoders: Option<Encoders>,
    /// Tensions at rest.
    pub pretension: Option<Pretension>,
    /// Motor at low torque.
    pub motor: Option<Motor>,
    /// Present once the calibration is finished.
    pub signed_off: Option<SignedOff>,
}

/// Which board.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardName {
    /// Name.
    pub name: String,
    /// Serial number of the processor; empty for a simulated board.
    pub serial: String,
    /// Version of the firmware.
    pub firmware: String,
    /// Program that calibrated it.
    pub tool: String,
}

/// A measured value with its spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Mean, codes or counts.
    pub mean: f64,
    /// Standard deviation of a sample.
    pub spread: f64,
    /// Number of samples.
    pub samples: u64,
}

/// Channels without load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Zeros {
    /// When, UTC.
    pub at: String,
    /// Code of the current with the bridge off.
    pub current: Level,
    /// Codes of f1 to f4, as far as they are fitted.
    pub tension: BTreeMap<String, Level>,
}

/// Which load cell is plugged in where: checked, since the board has no parameter for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelOrder {
    /// When, UTC.
    pub at: String,
    /// Change of each input when its own load cell was pulled, codes.
    pub pulled: BTreeMap<String, f64>,
}

/// Channels under a weight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// When, UTC.
    pub at: String,
    /// Those of f1 to f4 that a weight was hung on.
    pub tension: BTreeMap<String, Gain>,
}

/// A channel under a weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gain {
    /// Mass of the weight, kg.
    pub mass_kg: f64,
    /// Code under it.
    pub level: Level,
    /// Gain.
    pub gain_n_per_code: f64,
    /// Standard deviation of the gain from the noise of both levels.
    pub spread_n_per_code: f64,
}

/// Both encoders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoders {
    /// When, UTC.
    pub at: String,
    /// At the input pulley.
    pub input: Encoder,
    /// At the joint.
    pub joint: Encoder,
}

/// An encoder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// 1 if it counts up towards +θ, else −1.
    pub direction: i8,
    /// Counts by which it was turned towards +θ by hand.
    pub turned_counts: f64,
    /// Count at angle zero, 0 to 4095.
    pub zero_count: u16,
    /// What it was rounded from; over all turns since the board was switched on.
    pub level: Level,
}

/// Tensions at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pretension {
    /// When, UTC.
    pub at: String,
    /// Mean over the fitted channels, N.
    pub mean_n: f64,
    /// Each of them, N.
    pub tension_n: BTreeMap<String, f64>,
    /// Standard deviation of a sample of each, N.
    pub spread_n: BTreeMap<String, f64>,
    /// The board's parameter is to become the mean.
    pub adopted: bool,
}

/// Motor at low torque.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// When, UTC.
    pub at: String,
    /// Torque of the joint that was asked for, N·m.
    pub torque_nm: f64,
    /// `bridge.direction` with which a positive duty turns towards +θ.
    pub direction: i8,
    /// Resistance of the winding and its leads, Ω.
    pub resistance_ohm: f64,
    /// Half the difference of both directions, Ω.
    pub spread_ohm: f64,
}

/// The end of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedOff {
    /// When, UTC.
    pub at: String,
    /// By whom.
    pub by: String,
    /// The board keeps it through a power cut.
    pub stored: bool,
    /// Parameters of the board that were set from it.
    pub parameters: BTreeMap<String, f64>,
}

impl Sheet {
    /// A calibration of which nothing is done.
    #[must_use]
    pub fn new(board: BoardName) -> Self {
        Self {
            schema: CALIBRATION_SCHEMA.to_owned(),
            board,
            zeros: None,
            channel_order: None,
            gains: None,
            encoders: None,
            pretension: None,
            motor: None,
            signed_off: None,
        }
    }

    /// Reads the calibration of `board` in `path` to go on with, or begins one.
    ///
    /// # Errors
    /// Exit status 2: the file is none, one of another board, or one that is signed off.
    pub fn open(path: &Path, board: BoardName) -> Result<Self, Failure> {
        if !path.exists() {
            return Ok(Self::new(board));
        }
        let shown = path.display();
        let refuse = |what: String| Failure::bad_input(format!("{shown}: {what}"));
        let sheet = Self::load(path)?;
        if let Some(SignedOff { at, by, .. }) = &sheet.signed_off {
            return Err(refuse(format!(
                "signed off by {by} at {at}; name another file with --out, or remove this one"
            )));
        }
        let name = |board: &BoardName| format!("{} {}", board.name, board.serial).trim_end().to_owned();
        let (before, now) = (name(&sheet.board), name(&board));
        if before != now {
            return Err(refuse(format!("begun with {before}, this is {now}; name another file with --out")));
        }
        Ok(Self { board, ..sheet })
    }

    /// Reads a calibration.
    ///
    /// # Errors
    /// Exit status 2, with the place in the file: it is no calibration.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::bad_input(format!("{}: {what}", path.display()));
        let text = fs::read_to_string(path).map_err(|error| {
            refuse(format!("cannot be read: {}; check the path", output::describe(&error)))
        })?;
        let sheet: Self = toml::from_str(&text).map_err(|error| {
            let line =
                error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            Failure::bad_input(format!(
                "{}:{line}: no calibration: {}; name another file",
                path.display(),
                error.message()
            ))
        })?;
        if sheet.schema != CALIBRATION_SCHEMA {
            let got = &sheet.schema;
            return Err(refuse(format!(
                "schema: got `{got}`, expected `{CALIBRATION_SCHEMA}`; name another file"
            )));
        }
        Ok(sheet)
    }

    /// Writes it; the old file stays until the new one is whole.
    ///
    /// # Errors
    /// Exit status 1: the medium refuses.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let refuse =
            |reason: String| Failure::failed(format!("{}: cannot be written: {reason}", path.display()));
        let text = toml::to_string(self).map_err(|error| refuse(error.to_string()))?;
        output::write_text(path, &text).map_err(|error| refuse(output::describe(&error)))
    }

    /// Parameters of the board that follow from what is done, by name.
    #[must_use]
    pub fn parameters(&self) -> BTreeMap<String, f64> {
        let mut values = BTreeMap::new();
        if let Some(zeros) = &self.zeros {
            values.insert("bridge.current_zero".to_owned(), zeros.current.mean);
            let tension = zeros.tension.iter();
            values.extend(tension.map(|(name, zero)| (format!("tension.{name}.zero"), zero.mean)));
        }
        if let Some(gains) = &self.gains {
            let tension = gains.tension.iter();
            values.extend(tension.map(|(name, gain)| (format!("tension.{name}.gain"), gain.gain_n_per_code)));
        }
        if let Some(encoders) = &self.encoders {
            for (name, encoder) in [("input", &encoders.input), ("joint", &encoders.joint)] {
                values.insert(format!("encoder.{name}.direction"), encoder.direction.into());
                values.insert(format!("encoder.{name}.zero"), encoder.zero_count.into());
            }
        }
        if let Some(pretension) = self.pretension.as_ref().filter(|pretension| pretension.adopted) {
            values.insert("tendon.pretension".to_owned(), pretension.mean_n);
        }
        if let Some(motor) = &self.motor {
            values.insert("bridge.direction".to_owned(), motor.direction.into());
            values.insert("motor.resistance".to_owned(), motor.resistance_ohm);
        }
        values
    }
}
