//! Drapes of one fabric from several starts, and drape tests of several fabrics beside published bands.

use serde::Deserialize;

use super::drape::Drape;
use super::standards::{DrapeTest, DrapeTestError};
use crate::garment::fabric::Fabric;

/// Published bands, by fabric. They hold for the radii of [`DrapeTest::default`].
const TARGETS: &str = include_str!("../../../assets/cusick/targets.csv");

/// A published band.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Target {
    /// Name of a built-in fabric.
    pub fabric: String,
    /// Least published coefficient, percent.
    pub low_percent: f64,
    /// Greatest published coefficient, percent.
    pub high_percent: f64,
    /// Whether a constant of the fabric was calibrated to this band; the band does not validate the model then.
    pub calibrated_to: bool,
}

/// The published bands.
///
/// # Errors
/// [`DrapeTestError::Csv`] if the table does not parse.
pub(crate) fn targets() -> Result<Vec<Target>, DrapeTestError> {
    Ok(csv::Reader::from_reader(TARGETS.as_bytes()).deserialize().collect::<Result<_, _>>()?)
}

/// Drapes of one fabric in one test from several starts.
#[derive(Debug, Clone)]
pub(crate) struct Drapes {
    /// One for each start, in their order; at least one.
    pub all: Vec<Drape>,
}

impl Drapes {
    /// Drapes `fabric` from starts 0 to `starts` − 1 of `test`.
    ///
    /// # Errors
    /// As [`DrapeTest::run`].
    pub(crate) fn of(fabric: &Fabric, test: DrapeTest, starts: u32) -> Result<Self, DrapeTestError> {
        let all = (0..starts.max(1)).map(|start| DrapeTest { start, ..test }.run(fabric)).collect::<Result<_, _>>()?;
        Ok(Self { all })
    }

    /// Mean of a quantity over the drapes.
    pub(crate) fn mean(&self, of: impl Fn(&Drape) -> f64) -> f64 {
        self.all.iter().map(of).sum::<f64>() / self.all.len() as f64
    }

    /// Standard deviation of a quantity between the drapes; `None` for fewer than two.
    pub(crate) fn deviation(&self, of: impl Fn(&Drape) -> f64) -> Option<f64> {
        let mean = self.mean(&of);
        let squares: f64 = self.all.iter().map(|drape| (of(drape) - mean) * (of(drape) - mean)).sum();
        (self.all.len() > 1).then(|| (squares / (self.all.len() - 1) as f64).sqrt())
    }

    /// Number of nodes of each drape.
    pub(crate) fn node_counts(&self) -> Vec<usize> {
        self.all.iter().map(|drape| drape.nodes.count).collect()
    }
}

/// Results of drape tests by the fabric's name on the command line, as CSV. A band stands beside a result only for the radii it was
/// published for.
///
/// # Errors
/// [`DrapeTestError::Csv`] if the bands do not parse.
pub(crate) fn table_csv(test: &DrapeTest, results: &[(String, Drapes)]) -> Result<String, DrapeTestError> {
    let default = DrapeTest::default();
    let comparable = test.specimen_m == default.specimen_m && test.disc_m == default.disc_m;
    let targets = if comparable { targets()? } else { Vec::new() };
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record([
        "fabric",
        "coefficient_percent",
        "scatter_points",
        "low_percent",
        "high_percent",
        "calibrated_to",
        "verdict",
        "nodes",
        "depth_mm",
        "evenness",
        "residual_over_weight",
        "steps",
    ])?;
    for (name, drapes) in results {
        let percent = 100.0 * drapes.mean(|drape| drape.coefficient);
        let scatter = drapes.deviation(|drape| 100.0 * drape.coefficient);
        let target = targets.iter().find(|t| t.fabric == *name);
        let band = target.map_or_else(Default::default, |t| {
            [t.low_percent.to_string(), t.high_percent.to_string(), t.calibrated_to.to_string()]
        });
        let [low, high, calibrated_to] = band;
        let nodes: Vec<String> = drapes.node_counts().iter().map(usize::to_string).collect();
        let residual = drapes.all.iter().map(|drape| drape.residual_over_weight).fold(0.0, f64::max);
        csv.write_record([
            name.clone(),
            format!("{percent:.1}"),
            scatter.map_or_else(String::new, |points| format!("{points:.1}")),
            low,
            high,
            calibrated_to,
            target.map_or_else(|| "no published band".to_owned(), |t| verdict(percent, t)),
            nodes.join(" "),
            format!("{:.1}", 1e3 * drapes.mean(|drape| drape.nodes.depth_m)),
            format!("{:.2}", drapes.mean(|drape| drape.nodes.evenness)),
            format!("{residual:.1e}"),
            drapes.all.iter().map(|drape| drape.steps).sum::<usize>().to_string(),
        ])?;
    }
    let bytes = csv.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn verdict(percent: f64, target: &Target) -> String {
    if percent < target.low_percent {
        format!("{:.1} below", target.low_percent - percent)
    } else if percent > target.high_percent {
        format!("{:.1} above", percent - target.high_percent)
    } else {
        "inside".to_owned()
    }
}
