//! `partwise validate`: every measured case and closed form beside its simulation.

use std::path::PathBuf;

use crate::record::{DrapeTestRecording, NamedOutline, Sink};
use crate::study::drape_test::{Drape, Figure, to_svg};
use crate::study::validation::{Outcome, ValidatedDrapes, Validation, cases};
use clap::Args;
use serde_json::json;

use super::console::{self, RowFormat};
use super::runtime::{check, control_flow, write};

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub(crate) struct ValidateArgs {
    /// Only cases whose name contains this text
    #[arg(value_name = "CASE")]
    case: Option<String>,
    /// Rows of the mesh of a drape test, from the edge of the disc to the rim
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(4..=100))]
    rows: u64,
    /// Drapes of each fabric, each from another start; a laboratory takes six
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=100))]
    starts: u32,
    /// Draw the outlines of all drapes from above, a figure for each fabric, over the circle of the measured coefficient
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
    /// Record the drapes, the outlines of the starts over one another and over the circle of the measured coefficient
    #[arg(long, value_name = "FILE.rrd")]
    save: Option<PathBuf>,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
}

impl ValidateArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if let Some(path) = &self.svg {
            check(path, "--svg")?;
        }
        let sink = self.save.clone().map(Sink::File);
        sink.iter().try_for_each(Sink::check)?;
        let mut chosen = cases()?;
        let known: Vec<String> = chosen.iter().map(|case| case.case.clone()).collect();
        if let Some(part) = &self.case {
            chosen.retain(|case| case.case.contains(part.as_str()));
            if chosen.is_empty() {
                super::runtime::refuse!(
                    "found no case with `{part}` in its name, expected one of {}",
                    known.join(", ")
                );
            }
        }
        let bar = console::progress(Some(chosen.len() as u64), "validation");
        let mut validation = Validation::default();
        for case in &chosen {
            if control_flow().is_break() {
                break;
            }
            bar.set_message(format!("{}, {}", case.case, case.test));
            validation.add(case, usize::try_from(self.rows)?, self.starts)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let Some(path) = &self.svg {
            write(path, to_svg(&validation.drapes.iter().map(figure).collect::<Vec<_>>()), "--svg")?;
        }
        if let Some(sink) = sink {
            record(sink, &validation)?;
        }
        self.print(&validation)
    }

    fn print(&self, validation: &Validation) -> anyhow::Result<()> {
        let outcomes = &validation.outcomes;
        match self.format {
            RowFormat::Json => {
                let [passed, of] = validation.passed("measured");
                console::json(&json!({ "cases": outcomes, "measured_passed": passed, "measured": of }))?;
            }
            RowFormat::Csv => {
                let mut csv = csv::Writer::from_writer(Vec::new());
                outcomes.iter().try_for_each(|outcome| csv.serialize(outcome))?;
                console::document(&csv.into_inner()?);
            }
            RowFormat::Text => {
                let header =
                    ["case", "test", "quantity", "measured", "simulated", "scatter", "difference", "tolerance", ""];
                for (kind, title) in [
                    ("measured", "Measured cloth, nothing set to it"),
                    ("band", "Published bands, nothing set to them"),
                    ("calibrated", "Calibrated: validates nothing"),
                    ("closed form", "Closed forms"),
                ] {
                    let rows: Vec<[String; 9]> = outcomes.iter().filter(|o| o.kind == kind).map(row).collect();
                    if rows.is_empty() {
                        continue;
                    }
                    let table = console::table(console::RULED, header, 3..8, rows);
                    let [passed, of] = validation.passed(kind);
                    console::result(&format!("{title}: {passed} of {of} within the tolerance\n{table}"));
                }
                let mut sources: Vec<&str> =
                    outcomes.iter().map(|o| o.source.as_str()).filter(|s| !s.is_empty()).collect();
                sources.dedup();
                sources.into_iter().for_each(console::note);
            }
        }
        Ok(())
    }
}

/// A row of the table.
fn row(outcome: &Outcome) -> [String; 9] {
    let one = |x: f64| format!("{x:.1}");
    // A tenth of a millimetre says nothing of a strip.
    let value = |x: f64| if outcome.quantity.ends_with("_mm") { format!("{x:.3}") } else { one(x) };
    [
        outcome.case.clone(),
        outcome.test.clone(),
        outcome.quantity.replace('_', " "),
        value(outcome.measured),
        value(outcome.simulated),
        outcome.scatter.map(one).unwrap_or_default(),
        format!("{}{}", if outcome.difference > 0.0 { "+" } else { "" }, value(outcome.difference)),
        value(outcome.tolerance),
        (if outcome.pass { "pass" } else { "FAIL" }).to_owned(),
    ]
}

/// Simulated and measured coefficient of a fabric, as a line of text.
fn coefficients(of: &ValidatedDrapes) -> String {
    let percent = |drape: &Drape| 100.0 * drape.coefficient;
    let mut text = format!("simulated {:.1} %", of.drapes.mean(percent));
    text += &of.drapes.deviation(percent).map_or_else(String::new, |points| format!(" ± {points:.1}"));
    text += &of.measured.map_or_else(String::new, |share| format!(", measured {:.1} %", 100.0 * share));
    text
}

/// The figure of a fabric, with the outlines of all starts.
fn figure(of: &ValidatedDrapes) -> Figure<'_> {
    Figure {
        title: format!("{}: {}", of.case, coefficients(of)),
        disc_m: of.test.disc_m,
        specimen_m: of.test.specimen_m,
        measured_m: of.measured_radius(),
        outlines: (0..).zip(&of.drapes.all).map(|(k, drape)| (format!("start {k}"), &drape.outline)).collect(),
    }
}

/// Records each fabric as a step: its first drape, and the outlines of all starts.
fn record(sink: Sink, validation: &Validation) -> anyhow::Result<()> {
    let reach = validation.drapes.iter().map(|of| of.test.specimen_m).fold(0.1, f64::max);
    let mut recording = DrapeTestRecording::open(sink, "validation", reach)?;
    for of in &validation.drapes {
        let Some(first) = of.drapes.all.first() else { continue };
        let mut outlines = vec![
            NamedOutline::circle("disc", of.test.disc_m),
            NamedOutline::circle("flat specimen", of.test.specimen_m),
        ];
        let text = format!("**{}**: {}", of.case, coefficients(of));
        let measured = of.measured_radius().map(|radius| NamedOutline::circle("measured coefficient", radius));
        outlines.extend(measured);
        let starts = (0..).zip(&of.drapes.all);
        outlines.extend(starts.map(|(start, drape)| NamedOutline {
            name: format!("start {start}"),
            points: drape.outline.points().collect(),
        }));
        recording.step(&text, &first.mesh, &outlines)?;
    }
    recording.finish()?.file_line().iter().for_each(|line| console::note(line));
    Ok(())
}
