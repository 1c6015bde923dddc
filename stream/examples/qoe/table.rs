//! The results as tables and as CSV.

use std::io::{Result, Write};

use splatstream_stream::qoe::Score;

use crate::Row;

/// A column: its title, and its value in a score.
type Column = (&'static str, fn(&Score) -> f64);

const COLUMNS: [Column; 13] = [
    ("experience", |score| score.experience),
    ("quality_db", |score| score.quality),
    ("startup_s", |score| score.startup_seconds),
    ("stalled_s", |score| score.stalled_seconds),
    ("stalls", |score| score.stalls as f64),
    ("switches", |score| score.switches as f64),
    ("change_db_min", |score| score.change_per_minute),
    ("latency_s", |score| score.latency_seconds),
    ("megabytes", |score| score.megabytes),
    ("unplayed", |score| score.unplayed),
    ("sabre_utility", |score| score.sabre_utility),
    ("sabre_score", |score| score.sabre_score),
    ("lolp", |score| score.lolp),
];

/// Prints means for each ladder and class, over all, and over the traces that were tuned on and those that were not.
pub(crate) fn print(out: &mut impl Write, rows: &[Row]) -> Result<()> {
    let mut groups: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        if !groups.contains(&(row.ladder.as_str(), row.class)) {
            groups.push((&row.ladder, row.class));
        }
    }
    for (ladder, class) in groups {
        section(out, &format!("{class}, ladder {ladder}"), rows, |row| {
            row.ladder == ladder && row.class == class
        })?;
    }
    section(out, "all", rows, |_| true)?;
    section(out, "all, tuned on", rows, |row| !row.held_out)?;
    section(out, "all, held out", rows, |row| row.held_out)
}

fn section(out: &mut impl Write, title: &str, rows: &[Row], keep: impl Fn(&Row) -> bool) -> Result<()> {
    let kept: Vec<&Row> = rows.iter().filter(|row| keep(row)).collect();
    let mut rules: Vec<&str> = Vec::new();
    for row in &kept {
        if !rules.contains(&row.rule.as_str()) {
            rules.push(&row.rule);
        }
    }
    let playbacks = kept.len().checked_div(rules.len()).unwrap_or(0);
    writeln!(out, "\n== {title}: means of {playbacks} playbacks")?;
    write!(out, "{:24}", "rule")?;
    for (name, _) in COLUMNS {
        write!(out, " {name:>13}")?;
    }
    writeln!(out)?;
    let mut lines: Vec<(f64, String)> = Vec::new();
    for rule in rules {
        let own: Vec<&&Row> = kept.iter().filter(|row| row.rule == rule).collect();
        let mean =
            |of: fn(&Score) -> f64| own.iter().map(|row| of(&row.score)).sum::<f64>() / own.len() as f64;
        let values: String = COLUMNS.iter().map(|(_, of)| format!(" {:13.3}", mean(*of))).collect();
        lines.push((mean(|score| score.experience), format!("{rule:24}{values}")));
    }
    lines.sort_by(|a, b| b.0.total_cmp(&a.0));
    lines.iter().try_for_each(|(_, line)| writeln!(out, "{line}"))
}

/// Writes a line for each playback.
pub(crate) fn write_csv(out: &mut impl Write, rows: &[Row]) -> Result<()> {
    write!(out, "ladder,class,trace,held_out,rule,requests,abandoned")?;
    COLUMNS.iter().try_for_each(|(name, _)| write!(out, ",{name}"))?;
    writeln!(out)?;
    for row in rows {
        let rule = row.rule.replace(',', "");
        write!(out, "{},{},{},{},{rule}", row.ladder, row.class, row.trace, row.held_out)?;
        write!(out, ",{},{}", row.requests, row.abandoned)?;
        COLUMNS.iter().try_for_each(|(_, of)| write!(out, ",{:.6}", of(&row.score)))?;
        writeln!(out)?;
    }
    Ok(())
}
