//! What came out: one row a case, strength and tool.

use super::cases::Case;
use super::sample::Quality;
use super::tools::Tool;

/// How far pictures may be below those of the base before it counts, decibels.
const MISSED_DB: f64 = 3.0;

/// What a tool did about a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Pictures are as good as those of the base, or nearly.
    Ok,
    /// They are not, and the tool says that something is wrong.
    Warned,
    /// They are not, and nobody says so.
    Silent,
}

impl Verdict {
    /// All of them.
    pub(super) const ALL: [Self; 3] = [Self::Ok, Self::Warned, Self::Silent];

    /// Of pictures and of what is wanted of them.
    pub(super) fn of(quality: Option<Quality>, wanted: &Quality, said: bool) -> Self {
        match quality {
            Some(quality) if quality.below(wanted) <= MISSED_DB => Self::Ok,
            _ if said => Self::Warned,
            _ => Self::Silent,
        }
    }

    /// In words.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warned => "warned",
            Self::Silent => "silent failure",
        }
    }
}

/// A tool on a case at a strength.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// The tool.
    pub(super) tool: Tool,
    /// The strength.
    pub(super) strength: f64,
    /// Pictures in the views of the inner scene; none if the tool shows nothing.
    pub(super) quality: Option<Quality>,
    /// What the tool gives for the base.
    pub(super) wanted: Quality,
    /// Bits per Gaussian of the source; none if the tool packs nothing.
    pub(super) bpg: Option<f64>,
    /// Who noticed what.
    pub(super) detected: String,
    /// What was done instead.
    pub(super) fallback: String,
    /// What to think of it.
    pub(super) verdict: Verdict,
}

/// A case on a base.
pub(super) struct CaseReport {
    /// The case.
    pub(super) case: &'static Case,
    /// By strength, then by tool.
    pub(super) rows: Vec<Row>,
}

/// All cases on a base.
pub(super) struct BaseReport {
    /// What the page calls it.
    pub(super) name: String,
    /// What it is, in a sentence.
    pub(super) facts: String,
    /// The cases.
    pub(super) cases: Vec<CaseReport>,
}

impl BaseReport {
    /// All rows.
    pub(super) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.cases.iter().flat_map(|case| &case.rows)
    }
}

/// Rows of a tool with a verdict, over all bases.
pub(super) fn count(reports: &[BaseReport], tool: Tool, verdict: Verdict) -> usize {
    let rows = reports.iter().flat_map(BaseReport::rows);
    rows.filter(|row| row.tool == tool && row.verdict == verdict).count()
}

/// A strength in few letters.
pub(super) fn strength(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missed_without_a_word_is_silent() {
        let quality = |psnr, covered| Quality { psnr, covered };
        let verdict =
            |quality, said| Verdict::of(quality, &Quality { psnr: 50.0, covered: 45.0 }, said).name();
        assert_eq!(verdict(Some(quality(47.5, 40.0)), false), "ok");
        assert_eq!(verdict(Some(quality(45.0, 45.0)), false), "ok");
        assert_eq!(verdict(Some(quality(46.9, 41.9)), false), "silent failure");
        assert_eq!(verdict(Some(quality(15.0, 15.0)), true), "warned");
        assert_eq!([verdict(None, true), verdict(None, false)], ["warned", "silent failure"]);
    }

    #[test]
    fn strengths_are_short() {
        assert_eq!(
            [0.0, 0.001, 0.03, 100.0, 1e10, 1e-6].map(strength),
            ["0", "0.001", "0.03", "100", "1e10", "1e-6"]
        );
    }
}
