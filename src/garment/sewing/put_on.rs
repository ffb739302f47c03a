//! Closing of seams by levels: sewing patterns from coarse to fine, and garment meshes with open seams in place.
//!
//! # Garment meshes with open seams
//! A mesh that was sewn before it was put on bridges its open seams by long triangles (`mesh::bridges`). Where more than two
//! panels meet such a mesh intersects itself from the start, and as-rigid-as-possible steps, which have no bending, crumple it
//! beyond repair. So steps and fairing alternate, long waves first, as a splitting of the bending energy would. Where the cloth
//! still intersects itself it is faired over longer waves.
//!
//! Source: own; steps and fairing are those of [`arap`](super::arap). Limits: there is no coarser level, so a step costs what
//! the mesh costs. Self-intersections after the last round are left to the drape, which separates or reports them.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use super::arap::{Closing, close, faired};
use super::arrange::{Arranged, arrange};
use super::landmarks::Landmarks;
use crate::body::distance::Body;
use crate::garment::pattern::{PatternError, SewingPattern, SewnGarment, sew};
use crate::mesh::bridges::Bridges;
use crate::mesh::import::Imported;
use crate::mesh::report::{Remark, Repair};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::mesh::{RestShape, Topology, TriMesh, each_once, longest_side};

/// A level of closing: its edge length, m, its distance from the body, m, and its most steps.
struct Level {
    edge_m: f64,
    gap: f64,
    max_steps: usize,
}

/// The levels before the requested edge length. The most steps are three times those of six patterns.
const COARSER: [Level; 2] =
    [Level { edge_m: 0.06, gap: 0.01, max_steps: 150 }, Level { edge_m: 0.03, gap: 0.006, max_steps: 50 }];

/// Least ratio of a coarser level's edge length to the requested one. A heuristic.
const MIN_COARSENING: f64 = 1.4;

/// Distance from the body, m, and most steps at the requested edge length.
const LAST_GAP: f64 = 0.004;
const MAX_LAST_STEPS: usize = 25;

/// Steps end when no vertex moves farther, m.
const CONVERGED: f64 = 1e-3;

/// A garment whose top is farther below the armpits than this, m, has no shoulders to hang from.
const MIN_BELOW_ARMPITS: f64 = 0.03;

/// Prefixes of the labels of edges that hold a garment without shoulders, the upper edge first.
const HOLDING: [&str; 2] = ["strapless", "lower_interface"];

/// Least ratio of the longest side of the mesh to the longest at rest where open seams are closed at rest. A heuristic.
const OPEN_RATIO: f64 = 3.0;

/// Most steps until the seams are closed: three times those of a T-shirt's 34 cm.
const MAX_CLOSING_STEPS: usize = 100;

/// Fairings in a round, each followed by two steps; the first removes waves of [`WAVELENGTH`] (m), each further one
/// [`NARROWING`] times as long. With 2 to 3 cm GarmentCode's T-shirt ends without an intersection, with 1 cm it ends with 152.
const FAIRINGS: i32 = 12;
const WAVELENGTH: f64 = 0.025;
const NARROWING: f64 = 0.85;

/// Most rounds, each with waves twice as long.
const MAX_ROUNDS: i32 = 3;

/// A garment on a body, undraped.
#[derive(Debug, Clone)]
pub struct PutOn {
    /// The sewn garment, its mesh on the body.
    pub garment: SewnGarment,
    /// How its panels were moved to this body.
    pub arranged: Arranged,
    /// Vertices to hold until the drape is at rest: the waist of a garment without shoulders.
    pub held: Vec<u32>,
    /// The label of their edges, `top edge` where the file has none.
    pub held_by: Option<String>,
    /// Steps of closing in all levels.
    pub steps: usize,
    /// Wall-clock time.
    pub time: Duration,
}

/// Puts a pattern on a body, with edges of about `edge_m` (m). The body faces along `front`, found from its shape where it is not given.
///
/// # Errors
/// As [`sew`].
pub(crate) fn put_on(
    pattern: &SewingPattern,
    body: &Body,
    edge_m: f64,
    front: Option<DVec2>,
) -> Result<PutOn, PatternError> {
    let began = Instant::now();
    let landmarks = Landmarks::of_facing(body.mesh(), front);
    let mut pattern = pattern.clone();
    let (arranged, has_shoulders) = arrange(&mut pattern, &landmarks);
    // Without shoulders, the garment is closed and hangs between the arms.
    let armless = if has_shoulders { None } else { landmarks.without_arms(body.mesh()) };
    let armless = armless.and_then(|mesh| Body::new_open(&mesh).ok());
    let mut coarse: Option<(SewnGarment, Vec<DVec3>)> = None;
    let mut steps = 0;
    for Level { edge_m: coarse_m, gap, max_steps } in COARSER {
        // A small panel may have no mesh in edges as long as it is wide; the next level is then the first.
        let Ok(garment) = sew(&pattern, coarse_m) else { continue };
        if coarse_m < MIN_COARSENING * edge_m {
            continue;
        }
        let start = start(&garment, coarse.as_ref());
        let options = Closing { held: &[], gap, max_steps, converged: CONVERGED };
        let first = armless.as_ref().filter(|_| coarse.is_none());
        let (mut x, mut taken) = close(&garment.mesh, &garment.rest, first.unwrap_or(body), &start, options);
        if let Some(body) = first {
            let (held, _) = held(&garment, &x, &landmarks);
            let hung;
            (x, hung) = close(&garment.mesh, &garment.rest, body, &x, Closing { held: &held, ..options });
            taken += hung;
        }
        steps += taken;
        coarse = Some((garment, x));
    }
    let mut garment = sew(&pattern, edge_m)?;
    let start = start(&garment, coarse.as_ref());
    let max_steps = if coarse.is_some() { MAX_LAST_STEPS } else { COARSER[0].max_steps };
    let options = Closing { held: &[], gap: LAST_GAP, max_steps, converged: CONVERGED };
    let (x, taken) = close(&garment.mesh, &garment.rest, body, &start, options);
    garment.mesh.positions = x;
    let (held, held_by) = held(&garment, &garment.mesh.positions, &landmarks);
    Ok(PutOn { garment, arranged, held, held_by, steps: steps + taken, time: began.elapsed() })
}

fn start(garment: &SewnGarment, coarse: Option<&(SewnGarment, Vec<DVec3>)>) -> Vec<DVec3> {
    coarse.map_or_else(|| garment.mesh.positions.clone(), |(coarse, x)| garment.over(coarse, x))
}

/// The vertices that hold a garment without shoulders, by label or of its highest edge, and the label.
fn held(garment: &SewnGarment, x: &[DVec3], body: &Landmarks) -> (Vec<u32>, Option<String>) {
    let top = x.iter().fold(f64::NEG_INFINITY, |top, x| top.max(x.z));
    let Some(armpit) = body.armpit_z.or(body.shoulder_z) else { return (Vec::new(), None) };
    if top > armpit - MIN_BELOW_ARMPITS {
        return (Vec::new(), None);
    }
    for holding in HOLDING {
        let found: Vec<&String> = garment.labelled.keys().filter(|label| label.starts_with(holding)).collect();
        let vertices = each_once(found.iter().flat_map(|label| &garment.labelled[*label]).copied());
        if let (Some(label), false) = (found.first(), vertices.is_empty()) {
            return (vertices, Some((*label).clone()));
        }
    }
    let topology = Topology::new(&garment.mesh);
    let height = |edge: &[u32]| edge.iter().map(|&v| x[v as usize].z).sum::<f64>() / edge.len().max(1) as f64;
    let highest = topology.boundary_loops().into_iter().max_by(|a, b| height(a).total_cmp(&height(b)));
    highest.map_or((Vec::new(), None), |edge| (edge, Some("top edge".to_owned())))
}

impl PutOn {
    /// Notes for the user.
    pub(crate) fn notes(&self) -> Vec<String> {
        let mesh = &self.garment.mesh;
        let mut moved = String::new();
        let Arranged { raised, sleeves, turned } = self.arranged;
        if raised != 0.0 {
            let direction = if raised > 0.0 { "up" } else { "down" };
            let _ = write!(moved, ", moved {direction} {:.1} cm to this body", 100.0 * raised.abs());
        }
        if sleeves != 0.0 {
            let _ = write!(moved, ", sleeves turned {:.0} degrees to its arms", sleeves.to_degrees());
        }
        if turned != 0.0 {
            let _ =
                write!(moved, ", turned {:.0} degrees to its front (--front turns it otherwise)", turned.to_degrees());
        }
        let mut notes = vec![format!(
            "{} panels sewn along {} seams, {} vertices; seams closed in {} steps{moved}",
            self.garment.panels.len(),
            self.garment.seams.len(),
            mesh.vertex_count(),
            self.steps
        )];
        if let Some(label) = &self.held_by {
            notes.push(format!("no shoulders to hang from: held by its {label} until it is at rest, then released"));
        }
        notes.extend(self.garment.notes.iter().cloned());
        notes
    }
}

/// Closes over `body` the seams that long triangles of `imported` bridge and that are closed in the rest shape, and adds the
/// repair to the report. Any other garment is left unchanged.
pub(crate) fn draw_shut(imported: &mut Imported, rest: &RestShape, body: &Body) {
    let Some(Bridges { longest_m, .. }) = Bridges::of(&imported.mesh) else { return };
    let at_rest = rest.corners.iter().map(|c| longest_side(c.map(|p| p.extend(0.0))));
    if OPEN_RATIO * at_rest.fold(0.0, f64::max) > longest_m {
        return;
    }
    let (x, steps) = closed(&imported.mesh, rest, body);
    let farthest_m = x.iter().zip(&imported.mesh.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    // This repairs the difference between worn and rest lengths.
    imported.report.remarks.retain(|remark| !matches!(remark, Remark::OtherThanWorn { .. }));
    imported.report.repairs.push(Repair::SeamsDrawnShut { longest_m, steps, farthest_m });
    imported.mesh.positions = x;
}

/// The closed positions, m, and the number of steps.
fn closed(mesh: &TriMesh, rest: &RestShape, body: &Body) -> (Vec<DVec3>, usize) {
    let mut taken = 0;
    let mut step = |x: &[DVec3], gap, steps| {
        let options = Closing { held: &[], gap, max_steps: steps, converged: CONVERGED };
        let (x, steps) = close(mesh, rest, body, x, options);
        taken += steps;
        x
    };
    let [_, Level { gap, .. }] = COARSER;
    let mut x = step(&mesh.positions, gap, MAX_CLOSING_STEPS);
    for round in 0..MAX_ROUNDS {
        if self_intersecting_pairs(&mesh.with_positions(x.clone())).is_empty() {
            break;
        }
        for fairing in 0..FAIRINGS {
            let length = WAVELENGTH * 2f64.powi(round) * NARROWING.powi(fairing);
            x = step(&faired(mesh, rest, &x, length), gap, 2);
        }
        x = step(&x, LAST_GAP, MAX_LAST_STEPS);
    }
    (x, taken)
}
