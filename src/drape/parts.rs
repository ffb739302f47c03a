//! Stages one and two: everything of a drape that moves by PARTs.

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::result::PartOutcome;
use super::settings::{Model, Settings};
use crate::mechanics::coupled::{self, Asked, CoupledOptions, Garment};
use crate::mechanics::energy::Cloth;
use crate::mechanics::paper::{self, Cut, PartForces};
use crate::parts::range_table::RangeTable;
use crate::parts::{Parts, segment};
use crate::scene::Scene;

/// Result of stage two.
#[derive(Debug, Clone)]
pub(crate) struct StageTwo {
    pub(crate) parts: Parts,
    pub(crate) outcomes: Vec<PartOutcome>,
    pub(crate) positions: Vec<DVec3>,
    pub(crate) warnings: Vec<String>,
}

/// Stage one: the PARTs that the range table makes.
pub(crate) fn stage_one(scene: &Scene, min_part: usize, table: &RangeTable, distance: &[f64]) -> Parts {
    let parts = segment(&scene.topology, distance, table);
    let joined = if min_part > 1 { parts.join_small(&scene.topology, &scene.garment, min_part) } else { parts };
    joined.cut_to_table(&scene.garment, &scene.topology, &scene.rest, table)
}

/// Stage two: what the PARTs do; `cloth` is for the coupled model, which ends in [`CoupledError::Interrupted`](coupled::CoupledError) where `asked`
/// breaks off.
pub(crate) fn stage_two(
    scene: &Scene,
    settings: &Settings,
    ground: &Distances,
    parts: Parts,
    cloth: Option<&Cloth>,
    asked: Asked<'_>,
) -> Result<StageTwo, DrapeError> {
    let Scene { garment: mesh, topology, body, .. } = scene;
    let fabric = &settings.fabric;
    match &settings.model {
        Model::Coupled(options) => {
            let made;
            let cloth = match cloth {
                Some(cloth) => cloth,
                None => {
                    made = Cloth::new(mesh, topology, &scene.rest, &scene.fabrics(fabric), &scene.held)?;
                    &made
                }
            };
            couple(scene, cloth, ground, parts, options, asked)
        }
        Model::Paper(options) => {
            let cut = Cut { rest: &scene.rest, fabrics: &scene.fabrics(fabric) };
            let result = paper::solve_cut(mesh, topology, body, &ground.surface, &parts, &cut, options)?;
            let of_part =
                |p: &PartForces| PartOutcome { force_n: p.resultant, displacement: p.displacement, contact: p.contact };
            Ok(StageTwo {
                parts,
                outcomes: result.parts.iter().map(of_part).collect(),
                positions: result.positions,
                warnings: result.warnings.iter().map(ToString::to_string).collect(),
            })
        }
    }
}

/// Stage two of a garment laid flat: affine maps about the flat garment slide off what it will hang on.
const FLAT: &str = "the garment is laid flat, and PARTs cannot tell how it will hang: the two stages leave it as placed, and its drape takes \
     steps at full resolution";

/// Stage two by the coupled model: the PARTs of the table, or those cut to one extent after the other.
fn couple(
    scene: &Scene,
    cloth: &Cloth,
    ground: &Distances,
    parts: Parts,
    options: &CoupledOptions,
    asked: Asked<'_>,
) -> Result<StageTwo, DrapeError> {
    let Scene { garment: mesh, topology, body, .. } = scene;
    let placed = &mesh.positions;
    if coupled::is_flat(mesh) {
        let outcome = PartOutcome { force_n: DVec3::ZERO, displacement: DVec3::ZERO, contact: false };
        let outcomes = vec![outcome; parts.len()];
        let warnings = vec![FLAT.to_owned()];
        return Ok(StageTwo { parts, outcomes, positions: placed.clone(), warnings });
    }
    let garment = Garment { mesh, topology, cloth };
    let mut moved_surface;
    let mut surface = &ground.surface;
    let mut stage = StageTwo { parts, outcomes: Vec::new(), positions: placed.clone(), warnings: Vec::new() };
    let table = stage.parts.clone();
    let uncut = [f64::INFINITY];
    let extents = if options.extents_m.is_empty() { &uncut[..] } else { &options.extents_m };
    for (number, &extent) in extents.iter().enumerate() {
        stage.parts = table.cut_to_extent(mesh, topology, extent);
        if number > 0 {
            moved_surface = body.nearest_all(&stage.positions);
            surface = &moved_surface;
        }
        let start = (&stage.positions[..], &surface[..]);
        let result = coupled::solve_from(&garment, body, &stage.parts, start, &ground.bands, options, asked)?;
        stage.outcomes = result.parts.iter().map(outcome).collect();
        stage.positions = result.positions;
    }
    // Of a cascade the displacement of a PART counts from the garment as placed.
    for (part, outcome) in stage.parts.parts.iter().zip(&mut stage.outcomes) {
        let moved = part.vertices.iter().map(|&v| stage.positions[v as usize] - placed[v as usize]);
        outcome.displacement = moved.sum::<DVec3>() / part.vertices.len() as f64;
    }
    Ok(stage)
}

/// The outcome of a PART in the coupled model.
fn outcome(p: &coupled::PartResult) -> PartOutcome {
    PartOutcome { force_n: p.reaction, displacement: p.displacement, contact: p.in_contact }
}
