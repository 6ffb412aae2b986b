//! Questions to the person at the bench, one at a time.

use bowden_core::outcome::Failure;

use super::Trouble;

/// Who answers: a terminal, or lines of a file.
pub trait Dialog {
    /// Shows a text.
    ///
    /// # Errors
    /// When nothing can be shown any more.
    fn show(&mut self, text: &str) -> Result<(), Failure>;

    /// Asks a question; the answer without its line break, none where no more answers come.
    ///
    /// # Errors
    /// When nobody can be asked, or the user interrupts.
    fn ask(&mut self, question: &str) -> Result<Option<String>, Failure>;
}

/// Answer that ends the calibration everywhere.
const STOP: &str = "stop";

/// Asks until `read` takes the answer; what it refuses is shown with the reason.
pub(super) fn ask<T>(
    dialog: &mut dyn Dialog,
    question: &str,
    read: impl Fn(&str) -> Result<T, String>,
) -> Result<T, Trouble> {
    loop {
        let Some(answer) = dialog.ask(question)? else {
            return Err(Trouble::NoAnswer(question.trim().to_owned()));
        };
        let answer = answer.trim();
        if answer.eq_ignore_ascii_case(STOP) {
            return Err(Trouble::Stopped);
        }
        match read(answer) {
            Ok(value) => return Ok(value),
            Err(expected) => dialog.show(&format!("  got `{answer}`, expected {expected}, or {STOP}\n"))?,
        }
    }
}

/// Waits until the person has done what the text says.
pub(super) fn done(dialog: &mut dyn Dialog, what: &str) -> Result<(), Trouble> {
    ask(
        dialog,
        &format!("{what} [Enter] "),
        |answer| {
            if answer.is_empty() { Ok(()) } else { Err("Enter".to_owned()) }
        },
    )
}

/// Asks for yes or no.
pub(super) fn yes(dialog: &mut dyn Dialog, question: &str) -> Result<bool, Trouble> {
    ask(dialog, &format!("{question} [yes/no] "), |answer| match answer.to_lowercase().as_str() {
        "y" | "yes" => Ok(true),
        "n" | "no" => Ok(false),
        _ => Err("yes or no".to_owned()),
    })
}

/// Asks for a number in a range.
pub(super) fn number(
    dialog: &mut dyn Dialog,
    question: &str,
    [least, most]: [f64; 2],
    unit: &str,
) -> Result<f64, Trouble> {
    ask(dialog, &format!("{question} "), |answer| match answer.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number of {least} to {most} {unit}, such as {least}")),
    })
}
