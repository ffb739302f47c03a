//! A garment of the search: its distances, its reference drape, and the errors of a range table on it.

use crate::drape::{Drape, DrapeError, Prepared, Refine, Settings, drape_again, unobserved};
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

use crate::commands::console;
use crate::commands::inputs::FabricArgs;
use crate::commands::runtime::{refuse, with_progress};

/// PARTs of a table on a garment, and the error that the search minimises.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TableFit {
    pub(crate) parts: usize,
    /// RMS distance from the reference if each PART moves by its own best motion, mm.
    pub(crate) rms_mm: f64,
}

/// Errors of a table on a garment: two bounds, and the errors of the coupled model. More PARTs always reduce the bounds.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TableQuality {
    /// RMS distance from the reference with the best translation of each PART, mm: the bound of the paper's model.
    pub(crate) translation_mm: f64,
    /// RMS distance from the reference with the best affine maps, blended over the seams, mm: the bound of the coupled model.
    pub(crate) affine_mm: f64,
    /// RMS distance of the coupled model's drape, without refinement, from the canonical drape, mm. A garment has several equilibria,
    /// millimetres to centimetres apart, and a drape near another equilibrium has a large error.
    pub(crate) model_mm: f64,
    /// RMS distance of the coupled model's drape from the equilibrium it converges to, mm. A garment that fell off has a small one, so
    /// it is reported beside the other errors. `None` if the continuation was interrupted or fell off.
    pub(crate) own_mm: Option<f64>,
}

/// A garment with its reference drape.
pub(crate) struct Garment {
    /// The name on the command line.
    pub(crate) name: String,
    /// The garment on its body.
    pub(crate) scene: Scene,
    /// Unsigned distance of each vertex to the body, m.
    pub(crate) distances_m: Vec<f64>,
    /// The canonical drape, m.
    pub(crate) reference: Vec<DVec3>,
    /// Displacement from the undraped garment to the canonical drape, m.
    pub(crate) displacement: Vec<DVec3>,
    fabric: Fabric,
    prepared: Prepared,
    options: EvaluateOptions,
    /// Motion of PARTs in the search.
    pub(crate) motion: Motion,
    /// The grain, along which PARTs are cut to an extent.
    grain: Grain,
    /// PARTs and error of Table 3.
    pub(crate) table_3: TableFit,
    /// Errors of Table 3.
    pub(crate) table_3_quality: TableQuality,
}

impl Garment {
    /// Loads a garment and loads or computes its reference; `None` if interrupted.
    pub(crate) fn load(
        name: &str,
        body: &str,
        fabric: &FabricArgs,
        motion: Motion,
        options: &EvaluateOptions,
    ) -> anyhow::Result<Option<Self>> {
        let loaded = SceneSpec::new(body, name).load()?;
        fabric.check_used(&loaded)?;
        let fabric = fabric.first()?;
        let found = with_progress(&format!("{name}: reference drape"), |observer| {
            canonical(&loaded.scene, &fabric, options, observer)
        });
        let (reference, warnings) = match found {
            Ok(found) => found,
            Err(EvaluateError::Interrupted) => return Ok(None),
            Err(EvaluateError::Fallen) => {
                refuse!(
                    "{name}: it falls off the body, so it has no reference drape; use a garment that stays on by itself"
                );
            }
            Err(other) => return Err(other.into()),
        };
        for warning in loaded.warnings().iter().chain(&warnings) {
            console::warning(&format!("{name}: {warning}"));
        }
        let scene = loaded.scene;
        let start = &scene.garment.positions;
        let displacement = reference.positions.iter().zip(start).map(|(a, b)| *a - *b).collect();
        let settings = Settings { fabric: fabric.clone(), refine: Refine::Steps(0), ..Settings::default() };
        let mut garment = Self {
            prepared: Prepared::new(&scene, &settings)?,
            name: name.to_owned(),
            grain: Grain::new(&scene.garment, &scene.topology, &scene.rest),
            distances_m: scene.distances_m()?,
            scene,
            reference: reference.positions,
            displacement,
            fabric,
            options: options.clone(),
            motion,
            table_3: TableFit::default(),
            table_3_quality: TableQuality::default(),
        };
        let table_3 = RangeTable::table_3();
        garment.table_3 = garment.fit(&table_3);
        garment.table_3_quality = garment.quality(&table_3)?;
        Ok(Some(garment))
    }

    /// Weight of the squared error in the search: errors are relative to Table 3's, so that a wide skirt does not outweigh a pullover.
    pub(crate) fn weight(&self) -> f64 {
        1.0 / self.table_3.rms_mm.max(1e-3).powi(2)
    }

    /// The input of the search, with a bound on the number of PARTs.
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

    /// The PARTs of a table, cut to the extents of its levels.
    pub(crate) fn parts(&self, table: &RangeTable) -> Parts {
        let scene = &self.scene;
        let parts = segment(&scene.topology, &self.distances_m, table);
        parts.cut_to_table(&scene.garment, &scene.topology, &scene.rest, table)
    }

    /// PARTs and search error of a table.
    pub(crate) fn fit(&self, table: &RangeTable) -> TableFit {
        let parts = self.parts(table);
        TableFit { parts: parts.len(), rms_mm: self.unblended_mm(&parts, self.motion) }
    }

    fn unblended_mm(&self, parts: &Parts, motion: Motion) -> f64 {
        let start = &self.scene.garment.positions;
        1e3 * representable::unblended_rms_m(parts, start, &self.displacement, motion)
    }

    /// The displacement of these PARTs, blended over the seams, that is nearest to the reference's, m.
    pub(crate) fn nearest(&self, parts: &Parts, motion: Motion) -> Result<Vec<DVec3>, SolveError> {
        let Scene { garment, topology, held, .. } = &self.scene;
        let mut fixed = vec![false; garment.vertex_count()];
        held.iter().for_each(|&v| fixed[v as usize] = true);
        representable::blended(topology, parts, &fixed, &garment.positions, &self.displacement, motion)
    }

    /// The bound of the coupled model, mm.
    pub(crate) fn affine_mm(&self, parts: &Parts) -> Result<f64, SolveError> {
        Ok(accuracy::rms_mm(&self.nearest(parts, Motion::Affine)?, &self.displacement))
    }

    /// The errors of a table; computes a preview and its continuation to convergence.
    pub(crate) fn quality(&self, table: &RangeTable) -> anyhow::Result<TableQuality> {
        let (settings, draped) = self.preview(table)?;
        let own = with_progress(&format!("{}: continuation of a preview", self.name), |observer| {
            evaluate(&self.scene, &settings, &draped, &self.options, observer)
        });
        let own_mm = match own {
            Ok(own) => Some(own.accuracy.vertices.rms_mm),
            // The preview of one table may slide off while others stay on; the search continues.
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

    /// RMS distance of the coupled model's drape from the reference, mm.
    pub(crate) fn model_mm(&self, table: &RangeTable) -> Result<f64, DrapeError> {
        Ok(accuracy::rms_mm(&self.preview(table)?.1.positions, &self.reference))
    }

    /// The drape of both stages without refinement.
    fn preview(&self, table: &RangeTable) -> Result<(Settings, Drape), DrapeError> {
        let (fabric, table) = (self.fabric.clone(), table.clone().into());
        let settings = Settings { fabric, table, refine: Refine::Steps(0), ..Settings::default() };
        let draped = drape_again(&self.scene, &self.prepared, &settings, &mut unobserved)?;
        Ok((settings, draped))
    }
}
