//! Stages one and two, and the way from there to full resolution: everything of a drape that moves by PARTs.

use std::ops::ControlFlow;

use glam::DVec3;

use super::error::DrapeError;
use super::levels::{Level, Levels};
use super::result::PartOutcome;
use super::settings::{Model, Settings};
use crate::body::distance::SurfacePoint;
use crate::mechanics::coupled::{self, CoupledError, CoupledOptions, CoupledResult, Folding, Garment, Known, Method};
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

/// Asked between steps whether to go on.
pub(crate) type Asked<'a> = &'a (dyn Fn() -> ControlFlow<()> + Sync);

/// Stage one: the PARTs that the range table makes.
pub(crate) fn stage_one(scene: &Scene, min_part: usize, table: &RangeTable, distance: &[f64]) -> Parts {
    let parts = segment(&scene.topology, distance, table);
    let joined = if min_part > 1 { parts.join_small(&scene.topology, &scene.garment, min_part) } else { parts };
    joined.cut_to_table(&scene.garment, &scene.topology, &scene.rest, table)
}

/// Stage two: what the PARTs do; where `asked` breaks off, the coupled model ends in [`CoupledError::Interrupted`].
pub(crate) fn stage_two(
    scene: &Scene,
    settings: &Settings,
    surface: &[SurfacePoint],
    parts: Parts,
    levels: Option<&Levels>,
    asked: Asked<'_>,
) -> Result<StageTwo, DrapeError> {
    let Scene { garment: mesh, topology, body, .. } = scene;
    let fabric = &settings.fabric;
    match &settings.model {
        Model::Coupled(options) => {
            let made = if levels.is_none() { Some(Levels::new(scene, fabric)?) } else { None };
            let Some(levels) = levels.or(made.as_ref()) else { return Err(CoupledError::NoParts.into()) };
            couple(scene, levels, surface, parts, options, asked)
        }
        Model::Paper(options) => {
            let cut = Cut { rest: &scene.rest, fabrics: &scene.fabrics(fabric) };
            let result = paper::solve_cut(mesh, topology, body, surface, &parts, &cut, options)?;
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

/// Stage two by the coupled model: the PARTs of the table, or those cut to one extent after the other.
fn couple(
    scene: &Scene,
    levels: &Levels,
    surface: &[SurfacePoint],
    parts: Parts,
    options: &CoupledOptions,
    asked: Asked<'_>,
) -> Result<StageTwo, DrapeError> {
    let Scene { garment: mesh, topology, .. } = scene;
    let placed = &mesh.positions;
    let mut stage = StageTwo { parts, outcomes: Vec::new(), positions: placed.clone(), warnings: Vec::new() };
    let table = stage.parts.clone();
    let uncut = [f64::INFINITY];
    for &extent in if options.extents_m.is_empty() { &uncut[..] } else { &options.extents_m } {
        stage.parts = table.cut_to_extent(mesh, topology, extent);
        let result = through_levels(scene, levels, surface, (&stage.parts, &stage.positions), options, asked)?;
        stage.outcomes = result.parts.iter().map(outcome).collect();
        stage.positions = result.positions;
        stage.warnings.extend(result.warnings);
    }
    // Of a cascade the displacement of a PART counts from the garment as placed.
    for (part, outcome) in stage.parts.parts.iter().zip(&mut stage.outcomes) {
        let moved = part.vertices.iter().map(|&v| stage.positions[v as usize] - placed[v as usize]);
        outcome.displacement = moved.sum::<DVec3>() / part.vertices.len() as f64;
    }
    Ok(stage)
}

/// The outcome of a PART in the coupled model.
pub(crate) fn outcome(p: &coupled::PartResult) -> PartOutcome {
    PartOutcome { force_n: p.reaction, displacement: p.displacement, contact: p.in_contact }
}

/// Vertices for each PART that the first coarser cloth needs. PARTs of three or fewer are shifted alone there; they have their maps again
/// in the steps after. With eight, three of six sewn patterns took 1.6 to 2.6 times as many evaluations and ended farther from their rest.
pub(crate) const ENOUGH: usize = 2;

/// The same for still coarser ones, a PART being then some three vertices wide: with two a dress in cotton ends 29 mm from its rest for 24.
const ENOUGH_BELOW: usize = 8;

/// Edges of a fold's width that a cloth needs to make folds: a knit skirt of 4,000 vertices in PARTs of 14 cm ends 15 mm from its rest, and
/// 40 where it starts on a quarter of them, as it would with five.
const EDGES_A_FOLD: f64 = 8.0;

/// Share of the garment in PARTs that make folds from which these count.
const FOLDING: f64 = 0.5;

/// Steps of a level after the coarsest: they take off what the prolongation strained, and tell the forces. With two a pullover ends 2 mm
/// farther from its rest, with four one of nine garments ends over half a millimetre nearer (a dress in cotton, 1.4 of 30).
const STEPS_AFTER_COARSE: usize = 3;

/// The same for the levels between. A solve ends where its last steps bring little beside all before; where all is little, as after a coarser
/// level, it goes on for 40, a fifth of a millimetre each: a skirt of 250,000 spent two thirds of its preview so.
const STEPS_BETWEEN: usize = 8;

/// A coarser level ends where its last steps bring less than this share of what all have: what is left is less than what it is off by.
const LEAST_SHARE: f64 = 0.01;

/// The coupled model on the coarsest cloth whose vertices still tell these PARTs apart, then on the finer ones.
fn through_levels(
    scene: &Scene,
    levels: &Levels,
    surface: &[SurfacePoint],
    (parts, start): (&Parts, &[DVec3]),
    options: &CoupledOptions,
    asked: Asked<'_>,
) -> Result<CoupledResult, CoupledError> {
    let distance: Vec<f64> = surface.iter().map(|s| s.signed_distance).collect();
    let garment = Garment { mesh: &scene.garment, topology: &scene.topology, cloth: &levels.cloth };
    let given = Known { distance_m: &distance, least_share: 0.0 };
    let by = |method| CoupledOptions { method, ..options.clone() };
    if coupled::solved_by_admm(&scene.garment, parts, &levels.cloth, options.method) {
        let admm = by(Method::Admm);
        let solved = coupled::solve_given(&garment, &scene.body, parts, start, given, &admm, &mut |_| asked())?;
        // A garment that falls off by steps of centimetres may stay on by steps of millimetres.
        if options.method == Method::Admm || scene.fallen(&solved.positions).is_none() {
            return Ok(solved);
        }
    }
    let options = &by(Method::Newton);
    let folding = Folding::of(&scene.garment, parts, &levels.cloth);
    let enough = |(below, level): &(usize, &Level)| {
        let least = if *below == 0 { ENOUGH } else { ENOUGH_BELOW };
        level.mesh().vertex_count() >= least * parts.len()
            && (folding.share < FOLDING || EDGES_A_FOLD * level.edge_m() <= folding.width_m)
    };
    let coarsest = levels.coarser(scene).iter().enumerate().take_while(enough).count();
    let mut x = start.to_vec();
    for number in (1..=coarsest).rev() {
        let level = &levels.coarser(scene)[number - 1];
        let parts = levels.parts(number, parts);
        let (garment, start) = (level.garment(), levels.restrict(number, &x));
        let distance_m = &levels.restrict(number, &distance);
        let given = Known { distance_m, least_share: LEAST_SHARE };
        let most = if number == coarsest { options.max_steps } else { options.max_steps.min(STEPS_BETWEEN) };
        let options = CoupledOptions { max_steps: most, ..options.clone() };
        let solved = coupled::solve_given(&garment, &scene.body, &parts, &start, given, &options, &mut |_| asked())?;
        x = levels.prolong(number, &x, solved.positions);
    }
    if coarsest == 0 {
        return coupled::solve_given(&garment, &scene.body, parts, &x, given, options, &mut |_| asked());
    }
    let max_steps = options.max_steps.min(STEPS_AFTER_COARSE);
    let fewer = CoupledOptions { max_steps, ..options.clone() };
    let mut solved = coupled::solve_given(&garment, &scene.body, parts, &x, given, &fewer, &mut |_| asked())?;
    // That they go on moving after so few steps is meant.
    solved.warnings.clear();
    Ok(solved)
}
