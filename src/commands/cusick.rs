//! `partwise cusick`: the simulated Cusick drape test of fabrics, compared with published ranges.

use std::path::PathBuf;

use crate::garment::fabric::{BUILT_IN, Fabric};
use crate::record::{DrapeTestRecording, NamedOutline, Sink};
use crate::study::drape_test::{DrapeTest, Drapes, Figure, STANDARDS, Standard, table_csv, to_svg};
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::console::{self, RowFormat};
use super::runtime::{check, control_flow, write};

/// Bound on the rows of the mesh; 100 rows are 30,000 vertices, and more take hours.
const MAX_ROWS: u64 = 100;

/// Arguments of `cusick`.
#[derive(Debug, Args)]
pub(crate) struct CusickArgs {
    /// Fabrics to test: built-in names or TOML files [default: all built-in fabrics]
    #[arg(value_name = "NAME|FILE")]
    fabrics: Vec<String>,
    /// Diameters of specimen and disc: iso-30, iso-24, iso-36 (BS 5058 and ISO 9073-9: that many cm on 18 cm), jis (JIS L 1096: 25.4 cm
    /// on 12.7 cm)
    #[arg(long, value_name = "NAME", default_value = STANDARDS[0].name, hide_possible_values = true,
          value_parser = PossibleValuesParser::new(STANDARDS.map(|standard| standard.name)))]
    standard: String,
    /// Diameter of the specimen, instead of the standard's
    #[arg(long, value_name = "CM")]
    specimen: Option<f64>,
    /// Diameter of the disc, instead of the standard's
    #[arg(long, value_name = "CM")]
    disc: Option<f64>,
    /// Rows of the mesh from the edge of the disc to the rim, 4 to 100; 12 rows have edges of half a centimetre
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(4..=MAX_ROWS))]
    rows: u64,
    /// Angle by which weft and warp are turned through the directions of the mesh
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = finite)]
    turn: f64,
    /// Drapes of each fabric, each from other waves; the result is their mean, with their standard deviation
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100))]
    starts: u32,
    /// Also write the results to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Draw the outlines from above in true size
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
    /// Record the drapes with their outlines
    #[arg(long, value_name = "FILE.rrd")]
    save: Option<PathBuf>,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
}

/// Parses a finite number.
fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("expected a finite number".to_owned()) }
}

impl CusickArgs {
    fn test(&self) -> anyhow::Result<DrapeTest> {
        let named = |standard: &&Standard| standard.name == self.standard;
        let standard = STANDARDS.iter().find(named).unwrap_or(&STANDARDS[0]);
        let radius = |diameter_cm: f64| 0.005 * diameter_cm;
        let test = DrapeTest {
            specimen_m: self.specimen.map_or(standard.specimen_m, radius),
            disc_m: self.disc.map_or(standard.disc_m, radius),
            rows: usize::try_from(self.rows)?,
            turned: self.turn.to_radians(),
            start: 0,
        };
        test.check()?;
        Ok(test)
    }

    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        for (path, flag) in [(&self.csv, "--csv"), (&self.svg, "--svg")] {
            path.iter().try_for_each(|path| check(path, flag))?;
        }
        let recording = self.save.clone().map(Sink::File);
        recording.iter().try_for_each(Sink::check)?;
        let test = self.test()?;
        let names: Vec<&str> = match self.fabrics.as_slice() {
            [] => BUILT_IN.to_vec(),
            some => some.iter().map(String::as_str).collect(),
        };
        // Every name is checked before the first drape.
        let fabrics = names.iter().map(|name| Fabric::by_name(name)).collect::<Result<Vec<_>, _>>()?;
        let bar = console::progress(Some(names.len() as u64), "drape test");
        let mut results = Vec::new();
        for (name, fabric) in names.iter().zip(&fabrics) {
            if control_flow().is_break() {
                break;
            }
            results.push(((*name).to_owned(), Drapes::of(fabric, test, self.starts)?));
            bar.inc(1);
        }
        bar.finish_and_clear();
        let csv = table_csv(&test, &results)?;
        if let Some(path) = &self.csv {
            write(path, &csv, "--csv")?;
        }
        let drapes: Vec<(String, &_)> = results
            .iter()
            .flat_map(|(name, drapes)| drapes.all.iter().enumerate().map(move |(start, drape)| (name, start, drape)))
            .map(|(name, start, drape)| {
                (if self.starts > 1 { format!("{name}, start {start}") } else { name.clone() }, drape)
            })
            .collect();
        if let Some(path) = &self.svg {
            let DrapeTest { specimen_m, disc_m, .. } = test;
            let title = format!("specimen {:.1} cm, disc {:.1} cm, true size", 200.0 * specimen_m, 200.0 * disc_m);
            let outlines = drapes.iter().map(|(name, drape)| (name.clone(), &drape.outline)).collect();
            write(path, to_svg(&[Figure { title, disc_m, specimen_m, measured_m: None, outlines }]), "--svg")?;
        }
        if let Some(sink) = recording {
            let mut recording = DrapeTestRecording::open(sink, "drape tests", test.specimen_m)?;
            for (name, drape) in &drapes {
                let text = format!(
                    "**{name}**: drape coefficient {:.1} %, {} nodes {:.1} mm deep, evenness {:.2}",
                    100.0 * drape.coefficient,
                    drape.nodes.count,
                    1e3 * drape.nodes.depth_m,
                    drape.nodes.evenness
                );
                let outlines = [
                    NamedOutline::circle("disc", test.disc_m),
                    NamedOutline::circle("flat specimen", test.specimen_m),
                    NamedOutline { name: name.clone(), points: drape.outline.points().collect() },
                ];
                recording.step(&text, &drape.mesh, &outlines)?;
            }
            recording.finish()?.file_line().iter().for_each(|line| console::note(line));
        }
        print(&csv, self.format)
    }
}

/// Prints CSV as a table, as JSON or as it is.
pub(super) fn print(csv: &str, format: RowFormat) -> anyhow::Result<()> {
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let header = reader.headers()?.clone();
    let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>()?;
    match format {
        RowFormat::Csv => console::document(csv.as_bytes()),
        RowFormat::Json => {
            let value = |text: &str| match text.parse::<f64>() {
                _ if text.is_empty() => Value::Null,
                Ok(number) if number.is_finite() => json!(number),
                _ => text.parse::<bool>().map_or_else(|_| json!(text), |truth| json!(truth)),
            };
            let row = |row: &csv::StringRecord| -> Value {
                header
                    .iter()
                    .zip(row)
                    .map(|(name, text)| (name.to_owned(), value(text)))
                    .collect::<serde_json::Map<_, _>>()
                    .into()
            };
            console::json(&rows.iter().map(row).collect::<Vec<_>>())?;
        }
        RowFormat::Text => {
            let header: Vec<String> = header.iter().map(|name| name.replace('_', " ")).collect();
            let table = console::table(console::RULED, &header, [], rows.iter().map(csv::StringRecord::iter));
            console::result(&table);
        }
    }
    Ok(())
}
