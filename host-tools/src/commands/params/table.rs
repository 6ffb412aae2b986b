//! `bowden params table`: the table of the motor's torque ripple.

use std::f64::consts::TAU;
use std::io::Write as _;
use std::path::PathBuf;

use bowden_control::correction::ripple_table::{PERIOD_RAD, RippleTable};
use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_host_link::ripple_table::{Sampled, download, largest_nm, to_csv};
use bowden_host_link::{Client, ParameterSet};
use bowden_link::message::TableReport;
use serde::Serialize;

use super::super::{print, print_json};

/// Switch and limit of the table.
const ENABLE: &str = "correction.ripple_table.enable";
const LIMIT: &str = "correction.ripple_table.limit";

/// Arguments of `bowden params table`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct TableArguments {
    /// File to write to the board: CSV with the columns `angle_rad` and `torque_nm`, the torque that the motor makes at an
    /// angle of the input pulley, over less than a period. Its rows are joined by straight lines and sampled at 256 angles
    #[arg(value_name = "FILE.csv", conflicts_with_all = ["save", "clear"])]
    file: Option<PathBuf>,
    /// Angle of the input pulley over which the ripple repeats, rad [default: a turn, 2 pi]
    #[arg(long, value_name = "RAD", requires = "file", value_parser = period)]
    period: Option<f64>,
    /// Show what would be written, and change nothing
    #[arg(long, requires = "file")]
    dry_run: bool,
    /// Save the board's table to a file
    #[arg(long, value_name = "OUT.csv")]
    save: Option<PathBuf>,
    /// Have the board forget its table
    #[arg(long, conflicts_with = "save")]
    clear: bool,
}

fn period(text: &str) -> Result<f64, String> {
    let [shortest, longest] = PERIOD_RAD.map(f64::from);
    match text.parse::<f64>() {
        Ok(period_rad) if (shortest..=longest).contains(&period_rad) => Ok(period_rad),
        _ => Err(format!("allowed {shortest:.4} to {longest} rad")),
    }
}

impl TableArguments {
    /// Whether the board's table is shown, and nothing else done.
    pub(super) fn only_shows(&self) -> bool {
        self.file.is_none() && self.save.is_none() && !self.clear
    }

    /// Checks what can be checked without a board.
    pub(super) fn check(&self) -> Result<(), Failure> {
        match &self.save {
            Some(file) => output::check_file(file, &[]),
            None => Ok(()),
        }
    }

    /// Does what the arguments say.
    pub(super) fn run(
        &self,
        client: &mut Client,
        parameters: &ParameterSet,
        json: bool,
    ) -> Result<(), Failure> {
        if let Some(file) = &self.file {
            let sampled = Sampled::load(file, self.period.unwrap_or(TAU))?;
            let Sampled { table, rows, largest_error_nm } = &sampled;
            let text = format!(
                "{}sampled from {rows} rows, which it meets to within {largest_error_nm:.6} N·m\n",
                describe(table, parameters)?
            );
            if self.dry_run {
                return print(&format!("{text}would be written\n"));
            }
            client.write_ripple_table(table)?;
            return print(&format!("{text}written until the board is switched off; `store` keeps it\n"));
        }
        if self.clear {
            client.clear_ripple_table()?;
            return print("cleared until the board is switched off; `store` clears it there too\n");
        }
        let table = match client.ripple_table()? {
            TableReport::Whole(head) => Some(download(client, head)?),
            TableReport::Absent => None,
            TableReport::Unreadable => {
                return Err(Failure::failed(
                    "the stored ripple table cannot be read; write it anew, or clear it with --clear",
                ));
            }
        };
        match (&self.save, table) {
            (None, table) if json => {
                print_json(&table.as_ref().map(|table| Facts::of(table, parameters)).transpose()?)
            }
            (None, None) => print("no ripple table\n"),
            (None, Some(table)) => print(&describe(&table, parameters)?),
            (Some(_), None) => Err(Failure::failed("the board has no ripple table; write one first")),
            (Some(file), Some(table)) => {
                let text = to_csv(&table);
                output::write_file(file, |file| file.write_all(text.as_bytes()))
            }
        }
    }
}

/// What the board's table is.
#[derive(Serialize)]
struct Facts {
    points: usize,
    period_rad: f32,
    periods_per_turn: f64,
    largest_nm: f64,
    limit_nm: f64,
    crc: u32,
    /// It is switched on.
    acts: bool,
}

impl Facts {
    fn of(table: &RippleTable, parameters: &ParameterSet) -> Result<Self, Failure> {
        let head = table.head();
        Ok(Self {
            points: table.points_raw().len(),
            period_rad: head.period_rad,
            periods_per_turn: TAU / f64::from(head.period_rad),
            largest_nm: largest_nm(table),
            limit_nm: parameters.value(LIMIT)?,
            crc: head.crc,
            acts: parameters.value(ENABLE)? == 1.0,
        })
    }
}

/// Two lines: the table, and whether it acts.
fn describe(table: &RippleTable, parameters: &ParameterSet) -> Result<String, Failure> {
    let (head, largest_nm) = (table.head(), largest_nm(table));
    let (enable, limit_nm) = (parameters.value(ENABLE)?, parameters.value(LIMIT)?);
    let points = table.points_raw().len();
    let acts = match (enable == 1.0, largest_nm > limit_nm) {
        (false, _) => format!("switched off; `params set {ENABLE}=1.0` switches it on"),
        (true, false) => "switched on, in the place of the harmonics of correction.cogging".to_owned(),
        (true, true) => {
            format!("switched on; {LIMIT}: {limit_nm} N·m of it act; raise it if the joint may have more")
        }
    };
    Ok(format!(
        "ripple table: {points} points over {:.6} rad, {:.3} periods a turn of the input pulley, up to {largest_nm:.6} N·m, \
         CRC-32 {:08x}\n{acts}\n",
        head.period_rad,
        TAU / f64::from(head.period_rad),
        head.crc
    ))
}
