//! A recording of a bench run that the firmware logged.

use std::collections::BTreeMap;

use bowden_core::outcome::Failure;
use bowden_core::recording::{RowColumn, TIME_ROLE};
use bowden_model::channel::Channel;

use super::LogLine;

/// Column of the lines that carry no row of numbers.
pub const EVENT: &str = "event";

/// Between two events of one row.
const SEPARATOR: &str = "; ";

/// Rows of numbers with what happened between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoggedRun {
    /// Names of the numbers.
    pub names: Vec<String>,
    /// Time, s, and the numbers in the order of `names`.
    pub rows: Vec<(f64, Vec<f64>)>,
    /// Events up to each row, those behind the last one among its own; empty where nothing happened.
    pub events: Vec<String>,
    /// What was repaired or left out, one line each.
    pub notes: Vec<String>,
}

impl LoggedRun {
    /// Makes rows of the statement that carries the most numbers: those named like a channel count first, then all.
    /// `choose` names another one by a piece of its text. All other lines are events.
    ///
    /// A time that steps back is a board that started again; the rows go on behind those before.
    ///
    /// # Errors
    /// Exit status 2: no line has a time or numbers with names. `source` is the log's name in messages.
    pub fn of(lines: &[LogLine], choose: Option<&str>, source: &str) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::bad_input(format!("{source}: {what}"));
        if let Some(line) = lines.iter().find(|line| line.time_s.is_none()) {
            return Err(refuse(format!(
                "the line at byte {} carries no time; build the firmware with defmt::timestamp!(\"{{=u64:us}}\", ...)",
                line.byte
            )));
        }
        let Some(statement) = statement_of(lines, choose) else {
            return Err(refuse(match choose {
                Some(text) => format!("no line with `{text}` carries numbers with names; leave out --rows, or name another line"),
                None => "no line carries numbers with names, so that there is nothing to make rows of; log them as `f1_n={=f32}`"
                    .to_owned(),
            }));
        };
        let mut run = Self::default();
        let (mut shift_s, mut clock_s, mut restarts, mut doubled) = (0.0, f64::NEG_INFINITY, 0, 0);
        let mut waiting: Vec<String> = Vec::new();
        for line in lines {
            let time_s = line.time_s.unwrap_or_default();
            if time_s < clock_s {
                restarts += 1;
                shift_s += clock_s;
                waiting.push(format!("{:.6} the board started again", time_s + shift_s));
            }
            clock_s = time_s;
            let at_s = time_s + shift_s;
            if line.statement != statement {
                waiting.push(format!("{at_s:.6} {} {}", line.level.unwrap_or("print"), line.text));
                continue;
            }
            if run.rows.last().is_some_and(|(last_s, _)| at_s <= *last_s) {
                doubled += 1;
                continue;
            }
            if run.names.is_empty() {
                run.names = names(line);
            }
            run.rows.push((at_s, line.values.iter().map(|(_, value)| *value).collect()));
            run.events.push(std::mem::take(&mut waiting).join(SEPARATOR));
        }
        if let Some(last) = run.events.last_mut() {
            waiting.splice(0..0, (!last.is_empty()).then(|| std::mem::take(last)));
            *last = waiting.join(SEPARATOR);
        }
        if restarts > 0 {
            run.notes
                .push(format!("the board started again {restarts} times; times go on behind those before"));
        }
        if doubled > 0 {
            run.notes.push(format!("{doubled} rows have the time of the row before and were left out"));
        }
        Ok(run)
    }

    /// Columns of the recording, [`EVENT`] last.
    pub fn columns(&self) -> Vec<RowColumn> {
        let column = |name: &String| {
            Channel::from_role(name).map_or_else(|| RowColumn::Unknown(name.clone()), RowColumn::Known)
        };
        self.names.iter().map(column).chain([RowColumn::Unknown(EVENT.to_owned())]).collect()
    }
}

/// Names of a line's numbers; one that comes again, or has the name of the time, is numbered.
fn names(line: &LogLine) -> Vec<String> {
    let mut seen: BTreeMap<&str, u32> = BTreeMap::from([(TIME_ROLE, 1), (EVENT, 1)]);
    line.values
        .iter()
        .map(|(name, _)| {
            let count = seen.entry(name).or_default();
            *count += 1;
            if *count == 1 { name.clone() } else { format!("{name}_{count}") }
        })
        .collect()
}

fn statement_of(lines: &[LogLine], choose: Option<&str>) -> Option<u64> {
    let mut numbers: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    let is_role = |name: &str| Channel::from_role(name).is_some();
    for line in lines.iter().filter(|line| !line.values.is_empty()) {
        if choose.is_some_and(|text| !line.text.contains(text)) {
            continue;
        }
        let (roles, all) = numbers.entry(line.statement).or_default();
        *roles += line.values.iter().filter(|(name, _)| is_role(name)).count();
        *all += line.values.len();
    }
    let best = numbers.into_iter().max_by_key(|(statement, count)| (*count, u64::MAX - statement));
    best.map(|(statement, _)| statement)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(time_s: f64, statement: u64, text: &str, values: &[(&str, f64)]) -> LogLine {
        let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        LogLine {
            byte: 0,
            time_s: Some(time_s),
            level: Some("info"),
            text: text.to_owned(),
            values,
            statement,
        }
    }

    #[test]
    fn rows_are_of_the_line_with_channels_and_the_rest_are_events() {
        let lines = [
            line(0.1, 1, "start", &[]),
            line(0.2, 2, "a", &[("f1_n", 30.0), ("load", 1.0)]),
            line(0.25, 3, "tick 7, 8, 9", &[("tick", 7.0), ("x", 8.0), ("y", 9.0)]),
            line(0.3, 2, "b", &[("f1_n", 31.0), ("load", 2.0)]),
            line(0.3, 2, "b", &[("f1_n", 32.0), ("load", 2.0)]),
            line(0.35, 1, "end", &[]),
        ];
        let run = LoggedRun::of(&lines, None, "a.log").unwrap();
        assert_eq!(run.names, ["f1_n", "load"]);
        assert_eq!(run.rows, [(0.2, vec![30.0, 1.0]), (0.3, vec![31.0, 2.0])]);
        assert_eq!(run.events, ["0.100000 info start", "0.250000 info tick 7, 8, 9; 0.350000 info end"]);
        assert_eq!(run.notes, ["1 rows have the time of the row before and were left out"]);
        assert_eq!(run.columns()[0], RowColumn::Known(Channel::F1));
        let chosen = LoggedRun::of(&lines, Some("tick"), "a.log").unwrap();
        assert_eq!((chosen.names.len(), chosen.rows.len()), (3, 1));
    }

    #[test]
    fn times_go_on_where_the_board_started_again() {
        let lines: Vec<LogLine> = [0.5, 1.0, 0.25, 0.75]
            .into_iter()
            .map(|time_s| line(time_s, 1, "", &[("tick", time_s)]))
            .collect();
        let run = LoggedRun::of(&lines, None, "a.log").unwrap();
        let times: Vec<f64> = run.rows.iter().map(|(time_s, _)| *time_s).collect();
        assert_eq!(times, [0.5, 1.0, 1.25, 1.75]);
        assert_eq!(run.events[2], "1.250000 the board started again");
        assert_eq!(run.notes.len(), 1);
    }

    #[test]
    fn a_log_without_numbers_is_refused() {
        let message = |lines: &[LogLine], choose| {
            LoggedRun::of(lines, choose, "a.log").unwrap_err().message().to_owned()
        };
        let mut silent = line(0.0, 1, "on", &[]);
        assert!(message(&[silent.clone()], None).starts_with("a.log: no line carries numbers with names"));
        assert!(message(&[silent.clone()], Some("x")).starts_with("a.log: no line with `x` carries numbers"));
        silent.time_s = None;
        assert!(message(&[silent], None).starts_with("a.log: the line at byte 0 carries no time"));
    }
}
