//! The table of a campaign, and the page `tests/docs/faults.md`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::catalogue::KINDS;
use super::healthy::{FACTOR, Healthy};
use super::judgement::{Judged, TENSION_EXCESS, Verdict, tension_limit_n};
use super::phase::Phase;

/// Row of the cases with two faults.
const PAIRS: &str = "two at once";

/// What cases came to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// The board says what happened.
    pub named: usize,
    /// Within the healthy envelope, or the motor stayed off.
    pub harmless: usize,
    /// Silently wrong.
    pub silent: usize,
    /// Nothing noticed the fault, or the run could not be made.
    pub unproved: usize,
    /// Cases with a late opening, a tension beyond its limit, or a restart.
    pub violations: usize,
}

impl Counts {
    /// Counts `cases`.
    pub fn of<'a>(cases: impl IntoIterator<Item = &'a Judged>) -> Self {
        let mut counts = Self::default();
        for case in cases {
            *match case.verdict {
                Verdict::Named(_) => &mut counts.named,
                Verdict::Harmless => &mut counts.harmless,
                Verdict::Silent(_) => &mut counts.silent,
                Verdict::Unproved | Verdict::Broken(_) => &mut counts.unproved,
            } += 1;
            counts.violations += usize::from(!case.violations.is_empty());
        }
        counts
    }

    /// A cell: named, harmless, and what should not be where there is some.
    fn cell(self) -> String {
        let mut parts = Vec::new();
        for (count, letter) in
            [(self.named, "n"), (self.harmless, "h"), (self.silent, "**S**"), (self.unproved, "**U**")]
        {
            if count > 0 {
                parts.push(format!("{count} {letter}"));
            }
        }
        parts.join(", ")
    }
}

fn row_of(case: &Judged) -> &'static str {
    if let [kind] = case.kinds.as_slice() { kind } else { PAIRS }
}

/// Largest value of some, as text; a dash without any.
fn worst(values: impl Iterator<Item = f64>, digits: usize) -> String {
    let largest = values.fold(f64::NEG_INFINITY, f64::max);
    if largest.is_finite() { format!("{largest:.digits$}") } else { "-".to_owned() }
}

fn excess_percent(case: &Judged) -> f64 {
    (100.0 * (case.tension_n / tension_limit_n() - 1.0)).max(0.0)
}

/// The table by kind and phase.
pub fn table(cases: &[Judged]) -> String {
    let mut text = String::from("| fault |");
    for phase in Phase::ALL {
        let _ = write!(text, " {phase} |");
    }
    text += " named as | motor off after, ms | behind detection, us | over the tension limit, % | angle, rad |\n|---|";
    text += &"---|".repeat(Phase::ALL.len() + 5);
    let names = KINDS.iter().map(|kind| kind.name).chain([PAIRS]);
    for name in names {
        let row: Vec<&Judged> = cases.iter().filter(|case| row_of(case) == name).collect();
        if row.is_empty() {
            continue;
        }
        let _ = write!(text, "\n| {name} |");
        for phase in Phase::ALL {
            let cell = Counts::of(row.iter().copied().filter(|case| case.phase == phase)).cell();
            let _ = write!(text, " {cell} |");
        }
        let mut faults: BTreeMap<u8, usize> = BTreeMap::new();
        for fault in row.iter().filter_map(|case| case.fault) {
            *faults.entry(fault).or_default() += 1;
        }
        let faults: Vec<String> =
            faults.into_iter().map(|(fault, count)| format!("{fault} ({count})")).collect();
        let _ = write!(
            text,
            " {} | {} | {} | {} | {} |",
            faults.join(", "),
            worst(row.iter().filter_map(|case| case.off_after_s).map(|off_s| 1e3 * off_s), 2),
            worst(row.iter().filter_map(|case| case.off_behind_s).map(|off_s| 1e6 * off_s), 1),
            worst(row.iter().copied().map(excess_percent), 1),
            worst(row.iter().map(|case| case.angle_rad), 2),
        );
    }
    text
}

/// A sentence with the sums.
pub fn sums(cases: &[Judged]) -> String {
    let Counts { named, harmless, silent, unproved, violations } = Counts::of(cases);
    format!(
        "{} cases: {named} named, {harmless} harmless, {silent} silently wrong, {unproved} without proof; in {violations} the motor was \
         off late, a tension beyond its limit, or the motor on again. Worst: motor off {} us behind the beginning of the tick that \
         found it, {} % over the limit of a tension.",
        cases.len(),
        worst(cases.iter().filter_map(|case| case.off_behind_s).map(|off_s| 1e6 * off_s), 1),
        worst(cases.iter().map(excess_percent), 1),
    )
}

/// The cases that are neither named nor harmless, or violate something, a line each.
pub fn wrong(cases: &[Judged]) -> String {
    let lines: Vec<String> =
        cases.iter().filter(|case| !case.is_good()).map(|case| format!("- {}", case.line())).collect();
    if lines.is_empty() { "None.".to_owned() } else { lines.join("\n") }
}

fn envelopes(healthy: &Healthy) -> String {
    let rows: Vec<String> = Phase::ALL
        .iter()
        .map(|phase| {
            let (seen, bounds) = (healthy.envelope(*phase), healthy.envelope(*phase).bounds());
            format!(
                "| {phase} | {:.4} | {:.4} | {:.1} | {:.1} | {:.2} | {:.2} |",
                seen.error_rad,
                bounds.error_rad,
                seen.tension_n,
                bounds.tension_n.min(tension_limit_n()),
                seen.current_a,
                bounds.current_a,
            )
        })
        .collect();
    format!(
        "| phase | error, rad | bound | tension, N | bound | current, A | bound |\n|---|---|---|---|---|---|---|\n{}",
        rows.join("\n")
    )
}

fn kinds() -> String {
    let rows: Vec<String> = KINDS
        .iter()
        .map(|kind| format!("| {} | {} | {} |", kind.subject.name(), kind.name, kind.words))
        .collect();
    format!("| subject | name | what it is |\n|---|---|---|\n{}", rows.join("\n"))
}

/// Heading of the part of the page that people write; a campaign keeps it.
const FOUND: &str = "## What was found";

/// The part of a page that people wrote, from its heading to the next one; the bare heading if there is none.
pub fn written_by_hand(page: &str) -> String {
    let Some((_, behind)) = page.split_once(FOUND) else { return format!("{FOUND}\n") };
    let text = behind.split("\n## ").next().unwrap_or_default();
    format!("{FOUND}{}\n", text.trim_end())
}

/// What the words of the table mean.
fn words() -> String {
    format!(
        "- **Named** (n): the board has a fault record, or says what started it anew. *Named as* lists the numbers of the faults with\n  \
           their counts.\n\
         - **Harmless** (h): no stop, and from the fault to the end nothing beyond {FACTOR} times the largest value of three healthy runs of\n  \
           the same phase, plus one encoder count for the angle, and never beyond a limit of the board; or a fault of the link by which\n  \
           no order reaches the board, so that the motor stays off. The error is that of the bench's true angle against the reference\n  \
           of the healthy run with the same noise.\n\
         - **Silently wrong** (**S**): neither, 3 s later too.\n\
         - **Without proof** (**U**): the emulated chip counted nothing that the fault altered: no conversion, frame, request of DMA,\n  \
           transaction, step of the bench or reset. It counts at each place; of two faults both have to be there.\n\
         - **Violation**: motor off more than one tick (100 us) behind the beginning of the tick in the record, a true tension more than\n  \
           {:.0} % over the {} N of `tension.over`, or the bridge closed again without an order.\n\
         - *Motor off after* counts from the fault, *behind detection* from the beginning of the control tick in the record (0 where\n  \
           hardware was faster); both are the worst of the row, and so are tension and angle, up to 0.2 s behind the stop.",
        100.0 * TENSION_EXCESS,
        tension_limit_n()
    )
}

/// The page; `found` is the part that people write.
pub fn page(cases: &[Judged], healthy: &Healthy, asked: usize, provenance: &str, found: &str) -> String {
    let part = if cases.len() < asked {
        format!(" The campaign asked for {asked} cases; {} ran in the time that it had.", cases.len())
    } else {
        String::new()
    };
    format!(
        "# Faults on the emulated board\n\n\
         `cargo xtask faults` breaks one or two things at a time on the emulated board and judges what the release image makes of it; it\n\
         wrote this page, but for the next section: {provenance}.{part}\n\n\
         {}\n\n\
         Each case is a fresh board with the virtual bench. The joint is brought into a phase, the faults begin at a drawn moment, and\n\
         the true joint is watched while it is driven on for about 1 s (3 s more where it is off its reference), and for 0.2 s behind a\n\
         stop. All of a case follows from its name: `cargo xtask faults --only tension-stuck/fast/1001` runs it alone.\n\n\
         {found}\n\
         ## Result\n\n{}\n\n{}\n\n\
         ## Neither named nor harmless, or with a violation\n\n{}\n\n\
         ## Healthy runs\n\n{}\n\n\
         `supervisor.homing_timeout` is 2.5 s in the campaign; all other parameters are the defaults.\n\n\
         ## Faults\n\n{}\n",
        sums(cases),
        table(cases),
        words(),
        wrong(cases),
        envelopes(healthy),
        kinds(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::case::Case;

    fn judged(name: &str, verdict: Verdict) -> Judged {
        Judged { verdict, tension_n: 80.0, ..Judged::broken(&Case::named(name).unwrap(), "") }
    }

    #[test]
    fn cases_are_counted_by_kind_and_phase() {
        let cases = [
            judged("encoder-stuck/fast/1", Verdict::Named("fault 5".into())),
            judged("encoder-stuck/fast/2", Verdict::Harmless),
            judged("encoder-stuck/hold/1", Verdict::Silent("angle off".into())),
            judged("encoder-stuck+flood/hold/1", Verdict::Unproved),
        ];
        let table = table(&cases);
        assert!(table.contains("| encoder-stuck |  |  |  | 1 **S** |  | 1 n, 1 h |  |"), "{table}");
        assert!(table.contains("| two at once |  |  |  | 1 **U** |"), "{table}");
        assert!(sums(&cases).starts_with("4 cases: 1 named, 1 harmless, 1 silently wrong, 1 without proof"));
        assert_eq!(wrong(&cases).lines().count(), 2);
        assert_eq!(wrong(&cases[..2]), "None.");
    }

    #[test]
    fn what_people_wrote_is_kept() {
        let found = "## What was found\n\n- A gap.\n";
        let page = page(&[], &Healthy::default(), 3, "now", found);
        assert!(page.contains("asked for 3 cases; 0 ran"));
        assert_eq!(written_by_hand(&page), found);
        assert_eq!(written_by_hand("# Faults\n"), "## What was found\n");
    }

    #[test]
    fn a_tension_over_its_limit_is_told_in_percent_and_a_violation_is_no_good_case() {
        let mut case = judged("joint-push/fast/1", Verdict::Named("fault 12".into()));
        assert!(case.is_good() && excess_percent(&case) == 0.0);
        case.tension_n = 99.0;
        case.violations.push("99.0 N".into());
        assert!(!case.is_good() && (excess_percent(&case) - 10.0).abs() < 1e-9);
    }
}
