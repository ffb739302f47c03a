//! A garment to tune a table on, or to try one on: its distances, its reference drape, and what a table can hold of it.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::assess::{AssessError, AssessOptions, canonical};
use partwise::fabric::Fabric;
use partwise::parts::{Grain, Parts, representable_rms_m, segment};
use partwise::range_table::RangeTable;
use partwise::table_search::Sample;
use partwise::{Scene, SceneSpec};

use crate::commands::work::refining;
use crate::commands::{console, interrupt};

/// PARTs and representable error of a table on a garment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Holds {
    /// PARTs.
    pub(crate) parts: usize,
    /// Representable error, mm.
    pub(crate) rms_mm: f64,
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
    /// Its grain, which pieces narrow and tall follow.
    grain: Grain,
    /// What Table 3 makes of it.
    pub(crate) table_3: Holds,
}

impl Garment {
    /// Makes or reads a garment and finds or computes its reference; `None` where the user stopped it.
    pub(crate) fn load(
        name: &str,
        body: &str,
        fabric: &Fabric,
        options: &AssessOptions,
    ) -> anyhow::Result<Option<Self>> {
        let loaded = SceneSpec::new(body, name).load()?;
        let found = refining(&format!("{name}: reference drape"), |observer| {
            canonical(&loaded.scene, fabric, options, &mut |step| {
                let _ = observer(step);
                if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        });
        let (reference, warnings) = match found {
            Ok(found) => found,
            Err(AssessError::Interrupted) => return Ok(None),
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
            distances_m: scene.distances_m(),
            scene,
            reference: reference.positions,
            displacement,
            table_3: Holds { parts: 0, rms_mm: 0.0 },
        };
        garment.table_3 = garment.holds(&RangeTable::table_3());
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
    pub(crate) fn holds(&self, table: &RangeTable) -> Holds {
        let parts = self.parts(table);
        Holds { parts: parts.len(), rms_mm: 1e3 * representable_rms_m(&parts, &self.displacement) }
    }
}
