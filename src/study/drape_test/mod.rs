//! Simulation of the Cusick drape test, which measures the drape coefficient of a fabric.
//!
//! A disc of cloth 30 cm across is clamped between two plates 18 cm across; its rim hangs free and folds. The drape coefficient is
//!
//! DC = (A_p − A_d)/(A_s − A_d), the areas of the drape's shadow, of the plates and of the flat specimen
//!
//! (BS 5058; Cusick: "The measurement of fabric drape", J. Text. Inst. 59, 1968): 0 hangs straight down, 1 is a board. The
//! plates clamp the cloth, so its rim alone is computed, without contact.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A_p, A_d, A_s | shadow, disc, specimen | m² |
//! | DC | drape coefficient | – |
//!
//! Limits: no contact between folds, nor with the edge of the lower plate. A fabric with several equilibria gives the one reached from a
//! flat start with millimetre waves of two to nine folds; a laboratory takes the mean of six drapes.

mod shadow;
mod specimen;

use std::ops::ControlFlow;

use serde::Deserialize;

use crate::garment::fabric::{Fabric, FabricError};
use crate::mechanics::energy::{Cloth, Contacts, EnergyError};
use crate::mechanics::refine::{RefineOptions, SolveError, refine_with};
use crate::mesh::rest::RestError;
use crate::mesh::{RestShape, Topology};

pub(crate) use shadow::shadow_area;
pub(crate) use specimen::{PLATE_RADIUS, SPECIMEN_RADIUS, specimen};

/// Published bands, by fabric.
const TARGETS: &str = include_str!("../../../assets/cusick/targets.csv");

/// Why a drape test failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CusickError {
    /// The specimen is too coarse to fold.
    #[error("{rows} rows of cells across the rim cannot fold; expected at least 4")]
    TooCoarse {
        /// Rows asked for.
        rows: usize,
    },
    /// No such fabric.
    #[error(transparent)]
    Fabric(#[from] FabricError),
    /// The specimen has no rest shape.
    #[error(transparent)]
    Rest(#[from] RestError),
    /// The energy cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The table cannot be read or written.
    #[error("assets/cusick/targets.csv: {0}")]
    Csv(#[from] csv::Error),
}

/// One simulated drape test.
#[derive(Debug, Clone)]
pub(crate) struct CusickResult {
    /// Drape coefficient DC, 0 to 1.
    pub coefficient: f64,
    /// Folds: maxima of the rim's distance from the axis.
    pub folds: usize,
    /// ‖∇E‖₂ over the weight of the rim.
    pub residual_over_weight: f64,
    /// Newton steps.
    pub steps: usize,
}

/// Drapes `fabric` with `rows` rows of cells from the plates' edge to the rim.
///
/// # Errors
/// [`CusickError`] if the specimen is too coarse, or cloth or solver cannot be set up.
pub(crate) fn run(fabric: &Fabric, rows: usize) -> Result<CusickResult, CusickError> {
    if rows < 4 {
        return Err(CusickError::TooCoarse { rows });
    }
    let flat = specimen(rows);
    let cloth =
        Cloth::new(&flat.mesh, &Topology::new(&flat.mesh), &RestShape::from_edges(&flat.mesh)?, fabric, &flat.held)?;
    // The folds of a specimen do not touch.
    let options = RefineOptions { self_contact: false, ..RefineOptions::default() };
    let end =
        refine_with(&cloth, Contacts::none(), specimen::waved(&flat), &options, &mut |_| ControlFlow::Continue(()))?;
    let drape = flat.mesh.with_positions(end.positions);
    let circle = |r: f64| std::f64::consts::PI * r * r;
    let (plate, whole) = (circle(PLATE_RADIUS), circle(SPECIMEN_RADIUS));
    let rim: Vec<f64> = drape.positions[flat.rim].iter().map(|p| p.truncate().length()).collect();
    Ok(CusickResult {
        coefficient: (shadow_area(&drape, PLATE_RADIUS) - plate) / (whole - plate),
        folds: maxima(&rim),
        residual_over_weight: end.residual_over_weight,
        steps: end.steps,
    })
}

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
/// [`CusickError::Csv`] if the table does not parse.
pub(crate) fn targets() -> Result<Vec<Target>, CusickError> {
    Ok(csv::Reader::from_reader(TARGETS.as_bytes()).deserialize().collect::<Result<_, _>>()?)
}

/// Drapes fabrics, by built-in name or file, and writes the results beside the published bands as CSV.
///
/// # Errors
/// Errors of [`run`], and [`FabricError`] for an unknown name or an invalid file.
pub(crate) fn results_csv(fabrics: &[&str], rows: usize) -> Result<String, CusickError> {
    let targets = targets()?;
    let mut csv = String::from(
        "fabric,coefficient_percent,low_percent,high_percent,calibrated_to,verdict,folds,residual_over_weight,steps\n",
    );
    for name in fabrics {
        let result = run(&Fabric::by_name(name)?, rows)?;
        let percent = 100.0 * result.coefficient;
        let target = targets.iter().find(|t| t.fabric == *name);
        let band = target
            .map_or_else(|| ",,".to_owned(), |t| format!("{},{},{}", t.low_percent, t.high_percent, t.calibrated_to));
        let verdict = target.map_or_else(|| "no published band".to_owned(), |t| verdict(percent, t));
        let quoted = || format!("\"{}\"", name.replace('"', "\"\""));
        let label = if name.contains([',', '"', '\n', '\r']) { quoted() } else { (*name).to_owned() };
        csv += &format!(
            "{label},{percent:.1},{band},{verdict},{},{:.1e},{}\n",
            result.folds, result.residual_over_weight, result.steps
        );
    }
    Ok(csv)
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

/// Number of maxima of a closed sequence that exceed the neighbouring minima by more than a millimetre.
fn maxima(radii: &[f64]) -> usize {
    const PROMINENCE_M: f64 = 1e-3;
    let (mut count, mut rising) = (0, false);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    // Two rounds: the first finds a start, the second counts.
    for (i, &r) in radii.iter().chain(radii).enumerate() {
        (low, high) = (low.min(r), high.max(r));
        if rising && r < high - PROMINENCE_M {
            (rising, low) = (false, r);
            count += usize::from(i >= radii.len());
        } else if !rising && r > low + PROMINENCE_M {
            (rising, high) = (true, r);
        }
    }
    count
}

#[cfg(test)]
mod tests;
