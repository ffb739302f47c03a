//! A garment of the search in each fabric: its canonical drapes, and the errors of a range table on it.

use std::cmp::Reverse;
use std::ops::ControlFlow;

use crate::drape::{Distances, DrapeError, Settings, StageTwo, stage_one, stage_two};
use crate::mechanics::energy::Cloth;
use crate::parts::Parts;
use crate::parts::range_table::{Extent, RangeTable};
use crate::study::accuracy;
use crate::study::evaluate::{EvaluateError, EvaluateOptions, canonical};
use crate::{Scene, SceneSpec};
use glam::DVec3;
use rayon::prelude::*;

use crate::commands::console;
use crate::commands::inputs::FabricArgs;
use crate::commands::runtime::{refuse, with_progress};

/// A garment in one fabric.
pub(super) struct Tailored {
    /// The fabric, as on the command line.
    pub(super) fabric: String,
    settings: Settings,
    cloth: Cloth,
    /// The canonical drape, m.
    pub(super) reference: Vec<DVec3>,
    /// Error of Table 3, mm.
    pub(super) table_3_mm: f64,
}

/// A garment on its body, in all fabrics.
pub(super) struct Garment {
    /// The name on the command line.
    pub(super) name: String,
    pub(super) scene: Scene,
    pub(super) distances: Distances,
    /// One for each fabric.
    pub(super) tailored: Vec<Tailored>,
    /// PARTs of Table 3.
    pub(super) table_3_parts: usize,
}

impl Garment {
    /// Loads a garment, and loads or computes its canonical drapes; `None` if interrupted.
    pub(super) fn load(
        name: &str,
        body: &str,
        fabrics: &[String],
        options: &EvaluateOptions,
    ) -> anyhow::Result<Option<Self>> {
        let loaded = SceneSpec::new(body, name).load()?;
        let mut garment = Self {
            name: name.to_owned(),
            distances: Distances::of(&loaded.scene)?,
            scene: loaded.scene.clone(),
            tailored: Vec::new(),
            table_3_parts: 0,
        };
        let mut warnings = loaded.warnings();
        for fabric_name in fabrics {
            let arguments = FabricArgs { fabric: vec![fabric_name.clone()] };
            arguments.check_used(&loaded)?;
            let fabric = arguments.first()?;
            let title = format!("{name}, {fabric_name}: reference drape");
            let found = with_progress(&title, |observer| canonical(&loaded.scene, &fabric, options, observer));
            let (reference, found_warnings) = match found {
                Ok(found) => found,
                Err(EvaluateError::Interrupted) => return Ok(None),
                Err(EvaluateError::Fallen) => refuse!(
                    "{name}: it falls off the body, so it has no reference drape; use a garment that stays on by itself"
                ),
                Err(other) => return Err(other.into()),
            };
            warnings.extend(found_warnings);
            let Scene { garment: mesh, topology, rest, held, .. } = &garment.scene;
            garment.tailored.push(Tailored {
                fabric: fabric_name.clone(),
                cloth: Cloth::new(mesh, topology, rest, &garment.scene.fabrics(&fabric), held)?,
                settings: Settings { fabric, ..Settings::default() },
                reference: reference.positions,
                table_3_mm: f64::NAN,
            });
        }
        for warning in &warnings {
            console::warning(&format!("{name}: {warning}"));
        }
        let table_3 = garment.parts(&RangeTable::table_3());
        garment.table_3_parts = table_3.len();
        for i in 0..garment.tailored.len() {
            garment.tailored[i].table_3_mm = garment.error_mm(i, &table_3)?;
        }
        Ok(Some(garment))
    }

    /// The PARTs of a table.
    pub(super) fn parts(&self, table: &RangeTable) -> Parts {
        stage_one(&self.scene, Settings::default().min_part, table, &self.distances.unsigned_m)
    }

    /// Stage two in one of the fabrics.
    pub(super) fn preview(&self, fabric: usize, parts: &Parts) -> Result<StageTwo, DrapeError> {
        let Tailored { settings, cloth, .. } = &self.tailored[fabric];
        let go_on = || ControlFlow::Continue(());
        stage_two(&self.scene, settings, &self.distances, parts.clone(), Some(cloth), &go_on)
    }

    /// RMS distance of stage two from the canonical drape, mm.
    pub(super) fn error_mm(&self, fabric: usize, parts: &Parts) -> Result<f64, DrapeError> {
        Ok(accuracy::rms_mm(&self.preview(fabric, parts)?.positions, &self.tailored[fabric].reference))
    }

    /// The factor, and the table with its extents scaled by it, that gives the most PARTs without exceeding Table 3's number; of equal ones
    /// that nearest to 1. `None` if that is 1, or every factor exceeds the number.
    pub(super) fn fit_extents(&self, table: &RangeTable) -> anyhow::Result<Option<(f64, RangeTable)>> {
        let tried: Vec<(usize, i32, f64, RangeTable)> = FACTOR_STEPS
            .into_par_iter()
            .map(|step| {
                let factor = 1.02f64.powi(step);
                let scale = |e: Extent| Extent { width_cm: factor * e.width_cm, height_cm: factor * e.height_cm };
                let extents: Vec<_> = table.levels.iter().map(|level| level.extent.map(scale)).collect();
                let table = table.clone().with_extents(&extents)?;
                Ok((self.parts(&table).len(), step, factor, table))
            })
            .collect::<anyhow::Result<_>>()?;
        let allowed = tried.into_iter().filter(|(parts, ..)| *parts <= self.table_3_parts);
        let best = allowed.max_by_key(|(parts, step, ..)| (*parts, Reverse(step.abs())));
        Ok(best.filter(|(_, step, ..)| *step != 0).map(|(_, _, factor, table)| (factor, table)))
    }
}

/// Exponents of the factors tried, 2 % apart: 1/8 to 8.
const FACTOR_STEPS: std::ops::RangeInclusive<i32> = -105..=105;
