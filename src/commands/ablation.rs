//! `partwise bench ablation`: every option of the solver off, or halved and doubled.

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::mechanics::solver_options::SolverOptions;
use crate::scene::SceneSpec;
use crate::study::ablation::{AblationRow, cases, run, variants};
use clap::Args;
use serde_json::json;

use super::console::{self, RowFormat};
use super::runtime::{check, control_flow, keep_results, refuse, use_threads, write};

/// Arguments of `bench ablation`.
#[derive(Debug, Args)]
pub(crate) struct AblationArgs {
    /// Options to change: beginnings of their names, such as `cycles` or `newton.damping` [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// 21 small drapes for 52
    #[arg(long)]
    quick: bool,
    /// Drape this sewing pattern on the dress form as well
    #[arg(long = "pattern", value_name = "FILE")]
    patterns: Vec<String>,
    /// Drape this garment on this body as well
    #[arg(long = "pair", value_name = "BODY,GARMENT")]
    pairs: Vec<String>,
    /// List the options with their defaults, and drape nothing
    #[arg(long)]
    list: bool,
    /// Also write the rows to this CSV file, each as it is done
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text)]
    format: RowFormat,
    /// Drapes at a time [default: one per core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl AblationArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        let variants = variants(&self.only);
        if variants.len() == 1 {
            refuse!("--only {}: found no option that begins so; --list prints all", self.only.join(","));
        }
        if self.list {
            return self.list_options();
        }
        use_threads(self.threads)?;
        if let Some(path) = &self.csv {
            check(path, "--csv")?;
        }
        let mut more: Vec<SceneSpec> =
            self.patterns.iter().map(|file| SceneSpec::new(SceneSpec::default().body, file.clone())).collect();
        for pair in &self.pairs {
            let Some((body, garment)) = pair.split_once(',') else {
                refuse!("--pair {pair}: found one name, expected a body and a garment, separated by a comma");
            };
            more.push(SceneSpec::new(body, garment));
        }
        let cases = cases(self.quick, &more)?;
        keep_results();
        let bar = console::progress(Some(variants.len() as u64), "ablation");
        let mut rows: Vec<AblationRow> = Vec::new();
        let mut written = Ok(());
        run(&cases, &variants, rayon::current_num_threads(), |row| {
            bar.set_message(format!("{} drapes with each variant", cases.len()));
            bar.inc(1);
            rows.push(row);
            // After each variant, so that a run which is ended keeps its rows.
            if let Some(path) = &self.csv {
                written = csv_lines(&rows).and_then(|csv| write(path, &csv, "--csv"));
            }
            if written.is_ok() { control_flow() } else { ControlFlow::Break(()) }
        });
        bar.finish_and_clear();
        written?;
        if rows.len() < variants.len() {
            console::warning(&format!("{} of {} variants are missing", variants.len() - rows.len(), variants.len()));
        }
        match self.format {
            RowFormat::Csv => console::result(&csv_lines(&rows)?),
            RowFormat::Json => console::json(&json!({ "drapes": cases.len(), "rows": rows }))?,
            RowFormat::Text => console::result(&text(cases.len(), &rows)),
        }
        Ok(())
    }

    fn list_options(&self) -> anyhow::Result<()> {
        let all = SolverOptions::default().list();
        let lines: Vec<Vec<String>> = all.iter().map(|(name, value)| vec![name.clone(), value.to_string()]).collect();
        match self.format {
            RowFormat::Json => {
                let all: serde_json::Map<_, _> = all.into_iter().map(|(name, value)| (name, json!(value))).collect();
                console::json(&json!({ "options": all }))?;
            }
            RowFormat::Csv => {
                let lines: Vec<String> = lines.iter().map(|line| line.join(",")).collect();
                console::result(&format!("option,default\n{}", lines.join("\n")));
            }
            RowFormat::Text => {
                let header = ["option", "default"].map(str::to_owned);
                console::result(&console::table(console::RULED, &header, 1.., &lines));
            }
        }
        Ok(())
    }
}

fn csv_lines(rows: &[AblationRow]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

fn text(drapes: usize, rows: &[AblationRow]) -> String {
    let header =
        ["option", "value", "at rest", "lost", "gained", "steps", "median ratio", "s", "crossing", "skin", "inside"];
    let line = |row: &AblationRow| {
        vec![
            row.option.clone(),
            row.value.map_or_else(String::new, |value| value.to_string()),
            row.at_rest.to_string(),
            row.lost.to_string(),
            row.gained.to_string(),
            row.steps.to_string(),
            format!("{:.2}", row.step_ratio),
            format!("{:.1}", row.seconds),
            format!("{} in {}", row.crossing, row.drapes_crossing),
            format!("{} in {}", row.through, row.drapes_through),
            row.inside.to_string(),
        ]
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    format!("{drapes} drapes\n{}", console::table(console::RULED, header.map(str::to_owned), 1.., &lines))
}
