//! All stages in order, each timed: distance → PARTs → mechanics → draped garment.
//!
//! [`drape`] is the whole two-stage model; it reads as the paper's sections do. What it is given ([`Scene`], [`Settings`])
//! is plain data, and so is what it returns ([`Drape`]): recording, printing and comparing are other people's work.

use std::time::{Duration, Instant};

use glam::DVec3;

use crate::distance::{Body, SurfacePoint};
use crate::fabric::Fabric;
use crate::mechanics::paper::{self, PaperError, PaperOptions, PartForces};
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::{Parts, segment};
use crate::range_table::RangeTable;

/// What is draped over what; stays the same while tables and fabrics vary.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The body's surface, m.
    pub body_mesh: TriMesh,
    /// The same, ready for distance queries.
    pub body: Body,
    /// The garment as placed, undraped, m.
    pub garment: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// Vertices that stay where they are worn (a waistband's edge).
    pub held: Vec<u32>,
}

/// The two models of stage two.
#[derive(Debug, Clone, PartialEq)]
pub enum Model {
    /// Equations (2) to (9) as read in [`paper`].
    Paper(PaperOptions),
}

impl Model {
    /// The name on the command line.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
        }
    }
}

/// The dials of one run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The range table of stage one.
    pub table: RangeTable,
    /// PARTs with fewer vertices join a neighbour; 1 keeps the paper's definition.
    pub min_part: usize,
    /// The model of stage two.
    pub model: Model,
    /// The cloth.
    pub fabric: Fabric,
}

/// How long each stage took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StageTimes {
    /// Closest points on the body.
    pub distance: Duration,
    /// Equation (1): levels to connected PARTs.
    pub segment: Duration,
    /// Stage two.
    pub mechanics: Duration,
}

/// The outcome of stage two for one PART.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartOutcome {
    /// Resultant force F, N.
    pub force_n: DVec3,
    /// Displacement D, m.
    pub displacement: DVec3,
    /// Whether the body carries it.
    pub contact: bool,
}

/// What came out, stage by stage.
#[derive(Debug, Clone)]
pub struct Drape {
    /// Closest points on the body, per garment vertex, before draping.
    pub surface: Vec<SurfacePoint>,
    /// Unsigned distances to the body, m.
    pub distance: Vec<f64>,
    /// Stage one.
    pub parts: Parts,
    /// Stage two, per PART.
    pub outcomes: Vec<PartOutcome>,
    /// The displaced garment, m.
    pub positions: Vec<DVec3>,
    /// Vertices of the displaced garment inside the body.
    pub penetrating_vertices: usize,
    /// How deep the deepest of them is, m.
    pub penetration: f64,
    /// Stage times.
    pub times: StageTimes,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Why nothing came out.
#[derive(Debug, thiserror::Error)]
pub enum DrapeError {
    /// The equations refused their input.
    #[error(transparent)]
    Paper(#[from] PaperError),
}

/// Runs both stages.
///
/// # Errors
/// [`DrapeError`] where a constant of the fabric or an option cannot be used.
pub fn drape(scene: &Scene, settings: &Settings) -> Result<Drape, DrapeError> {
    let mut times = StageTimes::default();
    let surface = timed(&mut times.distance, || scene.body.nearest_all(&scene.garment.positions));
    // Equation (1) takes the distance without its sign: a vertex inside is as far from the surface as one outside.
    let distance: Vec<f64> = surface.iter().map(|s| s.signed_distance.abs()).collect();
    let parts = timed(&mut times.segment, || {
        let parts = segment(&scene.topology, &distance, &settings.table);
        if settings.min_part > 1 { parts.join_small(&scene.topology, &scene.garment, settings.min_part) } else { parts }
    });
    let mut warnings = unassigned_warning(&parts);
    let (outcomes, positions) = match &settings.model {
        Model::Paper(options) => {
            let Scene { garment, topology, body, .. } = scene;
            let result = timed(&mut times.mechanics, || {
                paper::solve(garment, topology, body, &surface, &parts, &settings.fabric, options)
            })?;
            warnings.extend(result.warnings.iter().map(ToString::to_string));
            let outcome =
                |p: &PartForces| PartOutcome { force_n: p.resultant, displacement: p.displacement, contact: p.contact };
            (result.parts.iter().map(outcome).collect(), result.positions)
        }
    };
    let inside =
        scene.body.nearest_all(&positions).into_iter().map(|s| -s.signed_distance).filter(|&depth| depth > 0.0);
    let (penetrating_vertices, penetration) = inside.fold((0, 0.0_f64), |(n, deepest), d| (n + 1, deepest.max(d)));
    Ok(Drape { surface, distance, parts, outcomes, positions, penetrating_vertices, penetration, times, warnings })
}

fn unassigned_warning(parts: &Parts) -> Vec<String> {
    if parts.unassigned == 0 {
        return Vec::new();
    }
    vec![format!(
        "{} vertices lie in no level of the range table and stay where they are; widen its first or last row",
        parts.unassigned
    )]
}

fn timed<T>(slot: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = work();
    *slot = start.elapsed();
    out
}
