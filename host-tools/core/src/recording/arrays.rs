//! Recordings from columns that are in memory already: arrays and data frames of other languages.

use super::build::Table;
use super::origin::Origin;
use super::place::Places;
use super::{ReadOptions, Recording};
use crate::outcome::Failure;

impl Recording {
    /// A recording of named columns, under the rules of a file: `t_s` strictly increasing, every number that is read finite, names and
    /// units mapped by `options`. Columns without a role are passed over; they may be `None`, as may any column that holds no numbers.
    ///
    /// # Errors
    /// One line that begins with `source` and, where one is to blame, the sample, counted from 0: no or double `t_s` column, columns of
    /// unequal length, a role without numbers, a number that is not finite, time that does not increase, no samples.
    pub fn from_columns(
        source: impl Into<String>,
        columns: &[(&str, Option<&[f64]>)],
        options: &ReadOptions,
    ) -> Result<Self, Failure> {
        let source = source.into();
        let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
        let values: Vec<Option<&[f64]>> = columns.iter().map(|(_, values)| *values).collect();
        let mut table = Table::from_header(&names, options)
            .map_err(|reason| Failure::bad_input(format!("{source}: {reason}")))?;
        let places = Places::samples();
        table.fill(&values).map_err(|(row, reason)| {
            let place = row.map_or_else(|| source.clone(), |row| places.describe(&source, row));
            Failure::bad_input(format!("{place}: {reason}"))
        })?;
        Origin::new(source, places).finish(table)
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;

    use super::*;
    use crate::recording::{ColumnMap, ColumnSource};

    type Given<'a> = (&'a str, Option<&'a [f64]>);

    fn of(columns: &[Given<'_>]) -> Result<Recording, String> {
        Recording::from_columns("frame", columns, &ReadOptions::default())
            .map_err(|failure| failure.message().to_owned())
    }

    #[test]
    fn columns_are_mapped_as_those_of_a_file_and_others_passed_over() {
        let degrees = ColumnSource { column: "angle".to_owned(), scale: 0.5, offset: 1.0 };
        let columns = ColumnMap { time: None, channels: vec![(Channel::ThetaOut, degrees)] };
        let options = ReadOptions { columns, only: None };
        let given: [Given<'_>; 4] = [
            ("label", None),
            ("t_s", Some(&[0.0, 0.1])),
            ("angle", Some(&[4.0, -2.0])),
            ("duty", Some(&[0.5, -0.0])),
        ];
        let recording = Recording::from_columns("frame", &given, &options).unwrap();
        assert_eq!(recording.channels().collect::<Vec<_>>(), [Channel::ThetaOut, Channel::Duty]);
        assert_eq!(recording.channel(Channel::ThetaOut), Some(&[3.0, 0.0][..]));
        assert!(recording.channel(Channel::Duty).unwrap()[1].is_sign_negative());
        assert_eq!(recording.columns().len(), 2);
    }

    #[test]
    fn what_cannot_be_a_recording_is_said_with_its_sample() {
        let t_s: Option<&[f64]> = Some(&[0.0, 0.1, 0.2]);
        let cases: [(&[Given<'_>], &str); 6] = [
            (&[("duty", t_s)], "frame: no column `t_s`; the header has duty"),
            (
                &[("t_s", Some(&[0.0, 0.2, 0.1])), ("duty", t_s)],
                "frame: sample 2: column `t_s`: got 0.1 s after 0.2 s",
            ),
            (
                &[("t_s", t_s), ("duty", Some(&[0.0, f64::NAN, 0.0]))],
                "frame: sample 1: column `duty`: got NaN, expected a finite number",
            ),
            (
                &[("t_s", t_s), ("duty", Some(&[0.0]))],
                "frame: column `duty`: got 1 values beside columns of 3",
            ),
            (&[("t_s", t_s), ("duty", None)], "frame: column `duty`: no numbers"),
            (&[("t_s", Some(&[]))], "frame: a header and no samples"),
        ];
        for (columns, expected) in cases {
            let message = of(columns).unwrap_err();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
