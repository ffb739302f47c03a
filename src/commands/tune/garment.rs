//! A garment to tune a table on, or to try one on: its distances, its reference drape, and what a table can hold of it.

use crate::drape::{Drape, DrapeError, Refine, Settings, drape, unobserved};
use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::Motion;
use crate::mechanics::refine::SolveError;
use crate::parts::range_table::RangeTable;
use crate::parts::{Grain, Parts, segment};
use crate::study::accuracy::{self, representable};
use crate::study::evaluate::{EvaluateError, EvaluateOptions, canonical, evaluate};
use crate::study::table_search::Sample;
use crate::{Scene, SceneSpec};
use glam::DVec3;

use crate::commands::runtime::refining;
use crate::commands::{FabricArgs, UserError, console};

/// PARTs of a table on a garment, and the error that guides the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TableFit {
    pub(crate) parts: usize,
    /// What a motion of each PART's own leaves, mm.
    pub(crate) rms_mm: f64,
}

/// What a table is worth on a garment: two bounds, which more freedom makes smaller whatever the table, and what comes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TableQuality {
    /// What a translation of each PART leaves, mm: the paper's bound.
    pub(crate) translation_mm: f64,
    /// What affine maps, blended over the seams, leave, mm: the coupled model's bound.
    pub(crate) affine_mm: f64,
    /// What the coupled model leaves of the canonical drape after both stages, mm. A garment has several rests, millimetres to
    /// centimetres apart, and where the model ends near another one this cannot be small.
    pub(crate) model_mm: f64,
    /// How far the model's result is from where it would settle itself, mm. What lies on the floor is near its rest, too, so it
    /// never stands alone. `None` where the user stopped it.
    pub(crate) own_mm: Option<f64>,
}

/// A garment with its reference drape.
pub(crate) struct Garment {
    /// As on the command line.
    pub(crate) name: String,
    /// The garment on its body.
    pub(crate) scene: Scene,
    /// Unsigned distance of each vertex to the body, m.
    pub(crate) distances_m: Vec<f64>,
    /// The canonical drape, m.
    pub(crate) reference: Vec<DVec3>,
    /// From undraped to the canonical drape, m.
    pub(crate) displacement: Vec<DVec3>,
    fabric: Fabric,
    options: EvaluateOptions,
    /// How PARTs move in the search.
    pub(crate) motion: Motion,
    /// Its grain, which pieces narrow and tall follow.
    grain: Grain,
    /// What Table 3 makes of it.
    pub(crate) table_3: TableFit,
    /// What Table 3 is worth on it.
    pub(crate) table_3_worth: TableQuality,
}

impl Garment {
    /// Makes or reads a garment and finds or computes its reference; `None` where the user stopped it.
    pub(crate) fn load(
        name: &str,
        body: &str,
        cloth: &FabricArgs,
        motion: Motion,
        options: &EvaluateOptions,
    ) -> anyhow::Result<Option<Self>> {
        let (loaded, fabric) = (SceneSpec::new(body, name).load()?, cloth.first()?);
        cloth.check_used(&loaded)?;
        let found = refining(&format!("{name}: reference drape"), |observer| {
            canonical(&loaded.scene, &fabric, options, observer)
        });
        let (reference, warnings) = match found {
            Ok(found) => found,
            Err(EvaluateError::Interrupted) => return Ok(None),
            Err(EvaluateError::Fallen) => {
                return Err(UserError::new(format!(
                    "{name}: it falls off the body, so there is no drape to find tables for; give one that stays on by itself"
                )));
            }
            Err(other) => return Err(other.into()),
        };
        for warning in loaded.warnings().iter().chain(&warnings) {
            console::warning(&format!("{name}: {warning}"));
        }
        let scene = loaded.scene;
        let start = &scene.garment.positions;
        let displacement = reference.positions.iter().zip(start).map(|(a, b)| *a - *b).collect();
        let mut garment = Self {
            name: name.to_owned(),
            grain: Grain::new(&scene.garment, &scene.topology, &scene.rest),
            distances_m: scene.distances_m()?,
            scene,
            reference: reference.positions,
            displacement,
            fabric,
            options: options.clone(),
            motion,
            table_3: TableFit { parts: 0, rms_mm: 0.0 },
            table_3_worth: TableQuality { translation_mm: 0.0, affine_mm: 0.0, model_mm: 0.0, own_mm: None },
        };
        let table_3 = RangeTable::table_3();
        garment.table_3 = garment.holds(&table_3);
        garment.table_3_worth = garment.worth(&table_3)?;
        Ok(Some(garment))
    }

    /// How much its squared error counts: relative to Table 3's, so that a wide skirt does not outweigh a pullover.
    pub(crate) fn weight(&self) -> f64 {
        1.0 / self.table_3.rms_mm.max(1e-3).powi(2)
    }

    /// As the search sees it, with the most PARTs it may have.
    pub(crate) fn sample(&self, max_parts: usize) -> Sample<'_> {
        Sample {
            mesh: &self.scene.garment,
            topology: &self.scene.topology,
            grain: &self.grain,
            distances_m: &self.distances_m,
            displacement: &self.displacement,
            weight: self.weight(),
            max_parts,
        }
    }

    /// The PARTs of a table, levels with an extent cut to it.
    pub(crate) fn parts(&self, table: &RangeTable) -> Parts {
        let scene = &self.scene;
        let parts = segment(&scene.topology, &self.distances_m, table);
        parts.cut_to_table(&scene.garment, &scene.topology, &scene.rest, table)
    }

    /// What a table holds of the reference.
    pub(crate) fn holds(&self, table: &RangeTable) -> TableFit {
        let parts = self.parts(table);
        TableFit { parts: parts.len(), rms_mm: self.unblended_mm(&parts, self.motion) }
    }

    fn unblended_mm(&self, parts: &Parts, motion: Motion) -> f64 {
        let start = &self.scene.garment.positions;
        1e3 * representable::unblended_rms_m(parts, start, &self.displacement, motion)
    }

    /// The displacement nearest to the reference's that these PARTs can hold, blended over the seams, m.
    pub(crate) fn nearest(&self, parts: &Parts, motion: Motion) -> Result<Vec<DVec3>, SolveError> {
        let Scene { garment, topology, held, .. } = &self.scene;
        let mut still = vec![false; garment.vertex_count()];
        held.iter().for_each(|&v| still[v as usize] = true);
        representable::blended(topology, parts, &still, &garment.positions, &self.displacement, motion)
    }

    /// The bound of the coupled model, mm.
    pub(crate) fn affine_mm(&self, parts: &Parts) -> Result<f64, SolveError> {
        Ok(accuracy::rms_mm(&self.nearest(parts, Motion::Affine)?, &self.displacement))
    }

    /// What a table is worth: takes a preview, and a drape from there until it has settled.
    pub(crate) fn worth(&self, table: &RangeTable) -> anyhow::Result<TableQuality> {
        let (settings, draped) = self.preview(table)?;
        let own = refining(&format!("{}: the rest of a preview", self.name), |observer| {
            evaluate(&self.scene, &settings, &draped, &self.options, observer)
        });
        let own_mm = match own {
            Ok(own) => Some(own.accuracy.vertices.rms_mm),
            // One table's preview may slide off where others stay: that is no end to the search.
            Err(EvaluateError::Interrupted | EvaluateError::Fallen) => None,
            Err(other) => return Err(other.into()),
        };
        Ok(TableQuality {
            translation_mm: self.unblended_mm(&draped.parts, Motion::Translation),
            affine_mm: self.affine_mm(&draped.parts)?,
            model_mm: accuracy::rms_mm(&draped.positions, &self.reference),
            own_mm,
        })
    }

    /// What the coupled model leaves of the reference, mm.
    pub(crate) fn model_mm(&self, table: &RangeTable) -> Result<f64, DrapeError> {
        Ok(accuracy::rms_mm(&self.preview(table)?.1.positions, &self.reference))
    }

    /// Both stages, and no step at full resolution.
    fn preview(&self, table: &RangeTable) -> Result<(Settings, Drape), DrapeError> {
        let (fabric, table) = (self.fabric.clone(), table.clone().into());
        let settings = Settings { fabric, table, refine: Refine::Steps(0), ..Settings::default() };
        let draped = drape(&self.scene, &settings, &mut unobserved)?;
        Ok((settings, draped))
    }
}
