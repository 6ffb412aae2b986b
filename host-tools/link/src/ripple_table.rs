//! The board's ripple table, to and from a file.
//!
//! ```csv
//! angle_rad,torque_nm
//! 0.0,0.000000
//! 0.0017531,0.0042
//! ```
//!
//! A row is the torque that the motor makes at an angle of the input pulley, N·m there. Rows rise in angle and span less than a
//! period; no two neighbours, the last and the first among them, are further apart than a quarter of it. The rows are joined
//! by straight lines, the last one to the first one a period later, and sampled at the 256 angles `k/256` of the period from
//! angle zero on. Rows finer than that are not averaged. Lines that begin with `#` are comments.

use std::fmt::Write;
use std::path::Path;

use bowden_control::correction::ripple_table::{FULL_SCALE_NM, RippleTable};
use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_link::message::{TABLE_POINTS, TableHead};

use super::client::Client;

/// Columns of a file.
const ANGLE: &str = "angle_rad";
const TORQUE: &str = "torque_nm";

/// Largest angle of a row, rad.
const LARGEST_RAD: f64 = 1000.0;

/// Part of a period that neighbours may be apart, with room for rounding in the file.
const LARGEST_GAP: f64 = 0.25 + 1e-6;

/// Number that a point of the full scale would have.
const FULL: f64 = 32_768.0;

/// A table from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// What the board gets.
    pub table: RippleTable,
    /// Rows of the file.
    pub rows: usize,
    /// Largest difference between a row and the table at its angle, N·m.
    pub largest_error_nm: f64,
}

/// A row of the file.
#[derive(Clone, Copy, Debug)]
struct Row {
    line: u64,
    angle_rad: f64,
    torque_nm: f64,
}

impl Sampled {
    /// Reads a file over a period of the input pulley's angle.
    ///
    /// # Errors
    /// One line with file and line: a missing column, no number, an angle that does not rise, or is a period or more
    /// behind the first, a gap of more than a quarter of the period, a torque beyond what the board takes.
    pub fn load(path: &Path, period_rad: f64) -> Result<Self, Failure> {
        let shown = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| {
            let reason = output::describe(&error);
            Failure::bad_input(format!("{shown}: cannot be read: {reason}; check the path"))
        })?;
        Self::parse(&text, &shown, period_rad)
    }

    /// Reads the text of a file; `source` is its name in messages.
    ///
    /// # Errors
    /// See [`Sampled::load`].
    pub fn parse(text: &str, source: &str, period_rad: f64) -> Result<Self, Failure> {
        let rows = rows(text, source)?;
        check(&rows, source, period_rad)?;
        let nodes: Vec<f64> = (0..TABLE_POINTS)
            .map(|node| joined(&rows, period_rad, period_rad * node as f64 / TABLE_POINTS as f64))
            .collect();
        let largest_nm = nodes.iter().fold(0.0_f64, |largest, torque_nm| largest.max(torque_nm.abs()));
        // A point of 32767 is the largest.
        let [least_nm, most_nm] = FULL_SCALE_NM;
        let full_scale_nm = ((largest_nm * FULL / (FULL - 1.0)) as f32).clamp(least_nm, most_nm);
        let mut points_raw = [0; TABLE_POINTS];
        for (point, torque_nm) in points_raw.iter_mut().zip(&nodes) {
            *point = (torque_nm / f64::from(full_scale_nm) * FULL).round() as i16;
        }
        let table = RippleTable::new(period_rad as f32, full_scale_nm, &points_raw)
            .map_err(|refusal| Failure::bad_input(format!("{source}: {refusal}; check period and unit")))?;
        let off = |row: &Row| (at(&table, row.angle_rad) - row.torque_nm).abs();
        let largest_error_nm = rows.iter().map(off).fold(0.0, f64::max);
        Ok(Self { table, rows: rows.len(), largest_error_nm })
    }
}

/// Lines with their numbers and cells: no blank ones, no comments. Cells hold no comma; quotes around them are left out.
fn lines(text: &str) -> impl Iterator<Item = (u64, Vec<&str>)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let numbered = (1..).zip(text.lines().map(str::trim));
    numbered
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(number, line)| (number, line.split(',').map(|cell| cell.trim().trim_matches('"')).collect()))
}

fn rows(text: &str, source: &str) -> Result<Vec<Row>, Failure> {
    let refuse = |line: u64, what: String| Failure::bad_input(format!("{source}:{line}: {what}"));
    let mut lines = lines(text);
    let (line, header) = lines.next().unwrap_or((1, Vec::new()));
    let column = |name: &str| {
        header.iter().position(|column| *column == name).ok_or_else(|| {
            let got = header.join(",");
            refuse(line, format!("no column `{name}`: got `{got}`, expected {ANGLE},{TORQUE}; name it so"))
        })
    };
    let (angle, torque) = (column(ANGLE)?, column(TORQUE)?);
    lines
        .map(|(line, cells)| {
            let number = |name: &str, place: usize, largest: f64| {
                let cell = cells.get(place).copied().unwrap_or_default();
                let value: f64 = cell.parse().map_err(|_| {
                    refuse(line, format!("{name}: got `{cell}`, expected a number; correct it"))
                })?;
                if value.abs() <= largest {
                    return Ok(value);
                }
                let what =
                    format!("{name}: got {value}, allowed -{largest:.3} to {largest:.3}; check the unit");
                Err(refuse(line, what))
            };
            Ok(Row {
                line,
                angle_rad: number(ANGLE, angle, LARGEST_RAD)?,
                torque_nm: number(TORQUE, torque, f64::from(FULL_SCALE_NM[1]) * (1.0 - 1.0 / FULL))?,
            })
        })
        .collect()
}

/// Whether the rows say what the ripple is over a whole period.
fn check(rows: &[Row], source: &str, period_rad: f64) -> Result<(), Failure> {
    let refuse = |line: u64, what: String| Err(Failure::bad_input(format!("{source}:{line}: {what}")));
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return refuse(1, format!("no row, expected {ANGLE} and {TORQUE} over a period; add them"));
    };
    let gap = |line: u64, from_rad: f64, to_rad: f64| {
        if to_rad - from_rad <= LARGEST_GAP * period_rad {
            return Ok(());
        }
        refuse(
            line,
            format!(
                "no row from {from_rad} to {to_rad} rad, expected one a quarter of the period ({:.6} rad) at least; add rows, \
                 or name the period with --period",
                period_rad / 4.0
            ),
        )
    };
    for (before, row) in rows.iter().zip(&rows[1..]) {
        let Row { line, angle_rad, .. } = *row;
        if angle_rad <= before.angle_rad {
            return refuse(
                line,
                format!("{ANGLE}: got {angle_rad} behind {}, expected more; sort the rows", before.angle_rad),
            );
        }
        if angle_rad - first.angle_rad >= period_rad {
            return refuse(
                line,
                format!(
                    "{ANGLE}: got {angle_rad}, a period of {period_rad:.6} rad or more behind the first row at {}; leave the \
                     row out, or name the period with --period",
                    first.angle_rad
                ),
            );
        }
        gap(line, before.angle_rad, angle_rad)?;
    }
    gap(last.line, last.angle_rad, first.angle_rad + period_rad)
}

/// Straight lines between the rows at an angle, N·m.
fn joined(rows: &[Row], period_rad: f64, angle_rad: f64) -> f64 {
    let Some(first) = rows.first() else { return 0.0 };
    // From the first row on, less than a period.
    let angle_rad = first.angle_rad + (angle_rad - first.angle_rad).rem_euclid(period_rad);
    let behind = rows.partition_point(|row| row.angle_rad <= angle_rad);
    let start = rows.get(behind.saturating_sub(1)).unwrap_or(first);
    let (end_rad, end_nm) = match rows.get(behind) {
        Some(end) => (end.angle_rad, end.torque_nm),
        None => (first.angle_rad + period_rad, first.torque_nm),
    };
    let part = (angle_rad - start.angle_rad) / (end_rad - start.angle_rad);
    start.torque_nm + (end_nm - start.torque_nm) * part
}

/// Torque of a table at an angle, N·m, in `f64`: what the board computes but for its steps.
fn at(table: &RippleTable, angle_rad: f64) -> f64 {
    let TableHead { period_rad, full_scale_nm, .. } = table.head();
    let place = (angle_rad / f64::from(period_rad)).rem_euclid(1.0) * TABLE_POINTS as f64;
    let points_raw = table.points_raw();
    let point = |node: usize| f64::from(points_raw[node % TABLE_POINTS]);
    let (node, part) = (place as usize, place.fract());
    f64::from(full_scale_nm) / FULL * (point(node) + (point(node + 1) - point(node)) * part)
}

/// Largest torque of a table, N·m.
pub fn largest_nm(table: &RippleTable) -> f64 {
    let largest = table.points_raw().iter().map(|point| point.unsigned_abs()).max().unwrap_or(0);
    f64::from(table.head().full_scale_nm) / FULL * f64::from(largest)
}

/// The file that [`Sampled::parse`] makes the same table of, with the period in its first line.
pub fn to_csv(table: &RippleTable) -> String {
    let TableHead { period_rad, full_scale_nm, crc } = table.head();
    let period = f64::from(period_rad);
    let mut text = format!(
        "# ripple table, CRC-32 {crc:08x}; to write it: bowden params --port PORT table FILE.csv --period {period:?}\n\
         {ANGLE},{TORQUE}\n"
    );
    for (node, point) in table.points_raw().iter().enumerate() {
        let angle_rad = period * node as f64 / TABLE_POINTS as f64;
        let torque_nm = f64::from(full_scale_nm) / FULL * f64::from(*point);
        let _ = writeln!(text, "{angle_rad:?},{torque_nm:?}");
    }
    text
}

/// Reads the board's table, whose head is known.
///
/// # Errors
/// When the board does not answer, or the points are not those of the head, because another program wrote a table meanwhile.
pub fn download(client: &mut Client, head: TableHead) -> Result<RippleTable, Failure> {
    let mut points_raw = Vec::with_capacity(TABLE_POINTS);
    while points_raw.len() < TABLE_POINTS {
        let part = client.ripple_points(points_raw.len() as u16)?;
        if part.is_empty() {
            break;
        }
        points_raw.extend(part);
    }
    let whole: Option<[i16; TABLE_POINTS]> = points_raw.try_into().ok();
    let table = whole.and_then(|points| RippleTable::new(head.period_rad, head.full_scale_nm, &points).ok());
    table
        .filter(|table| table.head() == head)
        .ok_or_else(|| Failure::failed("the ripple table changed while it was read; read it again"))
}
