//! Closing of seams by levels: sewing patterns from coarse to fine, and garment meshes with open seams in place.
//!
//! # Garment meshes with open seams
//! A mesh that was sewn before it was put on bridges its open seams by long triangles (`mesh::bridges`). Where more than two
//! panels meet such a mesh intersects itself from the start, and as-rigid-as-possible steps, which have no bending, crumple it
//! beyond repair. So steps and fairing alternate, long waves first, as a splitting of the bending energy would. Where the cloth
//! still intersects itself, that is done once more.
//!
//! A skirt or another tube without shoulders starts around the trunk instead of where its panels stand ([`tube`](super::tube)); a garment with
//! shoulders starts on those of the body, its sleeves around the arms ([`shoulders`](super::shoulders)). Legs that reach below the instep start shortened
//! to there.
//!
//! # Wide skirts of dresses
//! In patterns and in meshes, such a skirt is hung around the trunk after the cloth above it is closed ([`skirt`](super::skirt)).
//!
//! Source: own; steps and fairing are those of [`arap`](super::arap). Limits: seams are closed without a coarser level, so a step
//! costs what the mesh costs. Self-intersections after the last round are left to the drape, which separates or reports them.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use super::arap::{Closing, Hold, close, faired};
use super::arrange::{Arranged, arrange};
use super::landmarks::{Landmarks, crotch_z};
use super::shoulders::moved_onto;
use super::skirt::Skirt;
use super::tube::hung_around;
use crate::body::distance::Body;
use crate::garment::pattern::{PatternError, SewingPattern, SewnGarment, sew};
use crate::mesh::bridges::Bridges;
use crate::mesh::import::Imported;
use crate::mesh::report::{Remark, Repair};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::mesh::{RestShape, Topology, TriMesh, box_about, each_once, longest_side};

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

/// Prefixes of the labels of edges that hold a garment without shoulders, the upper edge first.
const HOLDING: [&str; 2] = ["strapless", "lower_interface"];

/// Least ratio of the longest side of the mesh to the longest at rest where open seams are closed at rest. A heuristic.
const OPEN_RATIO: f64 = 3.0;

/// Most steps until the seams are closed: three times those of a T-shirt's 34 cm.
const MAX_CLOSING_STEPS: usize = 100;

/// Share of its resistance that a triangle of such a mesh has against compression: cloth buckles, and gathers are wider than what they are
/// sewn to. A heuristic.
const COMPRESSION: f64 = 0.1;

/// The same of a tube. Measured while tubes began compressed around the trunk, and not since they begin in folds. Pairs of triangles that
/// intersect when a skirt of one and a half circles is closed: 154 with 0.1, none with 0.03 and 0.01. Steps at full resolution of a narrower
/// circle skirt: 19, 9, 26.
const TUBE_COMPRESSION: f64 = 0.03;

/// Height of the instep over that of the body. Legs that reach lower enclose the feet as placed. A jumpsuit with such legs rests after
/// 25 steps, with 0.05 after 99, with 0.1 after 110; started as placed it did not rest in 155 s, with skin inside.
const INSTEP: f64 = 0.07;

/// Fairings in a round, each followed by two steps; the first removes waves of [`WAVELENGTH`] (m), each further one
/// [`NARROWING`] times as long. With 2 to 3 cm GarmentCode's T-shirt ends without an intersection, with 1 cm it ends with 152.
const FAIRINGS: i32 = 12;
const WAVELENGTH: f64 = 0.025;
const NARROWING: f64 = 0.85;

/// Most rounds. With waves of twice the length in each, rounds of a ruffled top go from 13 pairs of triangles that intersect to 3 and 496, and
/// to 4 and none with waves of the same length.
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
        let options = Closing { hold: Hold::Nothing, compression: 1.0, gap, max_steps, converged: CONVERGED };
        let first = armless.as_ref().filter(|_| coarse.is_none());
        let skirt = skirt_of(&garment, has_shoulders, &landmarks);
        let (mesh, rest) = skirt.as_ref().map_or((&garment.mesh, &garment.rest), Skirt::upper);
        let (mut x, mut taken) = close(mesh, rest, first.unwrap_or(body), &start, options);
        if let Some(body) = first {
            let (held, _) = held(&garment, &x, &landmarks);
            let hung;
            (x, hung) = close(&garment.mesh, &garment.rest, body, &x, Closing { hold: Hold::Place(&held), ..options });
            taken += hung;
        }
        steps += taken;
        coarse = Some((garment, x));
    }
    let mut garment = sew(&pattern, edge_m)?;
    let start = start(&garment, coarse.as_ref());
    let max_steps = if coarse.is_some() { MAX_LAST_STEPS } else { COARSER[0].max_steps };
    let options = Closing { hold: Hold::Nothing, compression: 1.0, gap: LAST_GAP, max_steps, converged: CONVERGED };
    let skirt = skirt_of(&garment, has_shoulders, &landmarks);
    let (mesh, rest) = skirt.as_ref().map_or((&garment.mesh, &garment.rest), Skirt::upper);
    let (mut x, mut taken) = close(mesh, rest, body, &start, options);
    if let Some(skirt) = skirt {
        let above = skirt.vertices_above();
        let options = if skirt.hang(&mut x, body.mesh(), &landmarks, LAST_GAP) {
            Closing { hold: Hold::Place(&above), compression: TUBE_COMPRESSION, ..options }
        } else {
            Closing { max_steps: COARSER[0].max_steps, ..options }
        };
        let hung;
        (x, hung) = close(&garment.mesh, &garment.rest, body, &x, options);
        taken += hung;
    }
    garment.mesh.positions = x;
    let (held, held_by) = held(&garment, &garment.mesh.positions, &landmarks);
    Ok(PutOn { garment, arranged, held, held_by, steps: steps + taken, time: began.elapsed() })
}

/// The wide skirt of a pattern with shoulders, which is hung after the cloth above it is closed.
fn skirt_of(garment: &SewnGarment, has_shoulders: bool, landmarks: &Landmarks) -> Option<Skirt> {
    let highest_z = landmarks.below_armpits_z().filter(|_| has_shoulders)?;
    Skirt::of(&garment.mesh, &garment.rest, highest_z)
}

fn start(garment: &SewnGarment, coarse: Option<&(SewnGarment, Vec<DVec3>)>) -> Vec<DVec3> {
    coarse.map_or_else(|| garment.mesh.positions.clone(), |(coarse, x)| garment.over(coarse, x))
}

/// The vertices that hold a garment without shoulders, by label or of its highest edge, and the label.
fn held(garment: &SewnGarment, x: &[DVec3], body: &Landmarks) -> (Vec<u32>, Option<String>) {
    let top = x.iter().fold(f64::NEG_INFINITY, |top, x| top.max(x.z));
    if !body.is_below_armpits(top) {
        return (Vec::new(), None);
    }
    for holding in HOLDING {
        let found: Vec<&String> = garment.labelled.keys().filter(|label| label.starts_with(holding)).collect();
        let vertices = each_once(found.iter().flat_map(|label| &garment.labelled[*label]).copied());
        if let (Some(label), false) = (found.first(), vertices.is_empty()) {
            return (vertices, Some((*label).clone()));
        }
    }
    top_edge(&garment.mesh, x).map_or((Vec::new(), None), |(edge, _)| (edge, Some("top edge".to_owned())))
}

/// The highest edge at `x` (m), by the mean of its vertices, and that height, m.
fn top_edge(mesh: &TriMesh, x: &[DVec3]) -> Option<(Vec<u32>, f64)> {
    let height = |edge: &[u32]| edge.iter().map(|&v| x[v as usize].z).sum::<f64>() / edge.len().max(1) as f64;
    let edges = Topology::new(mesh).boundary_loops().into_iter().map(|edge| (height(&edge), edge));
    edges.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(z, edge)| (edge, z))
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
/// repair to the report. Returns the vertices to hold until the drape is at rest: the top edge of a garment without shoulders. Any other
/// garment is left unchanged.
pub(crate) fn draw_shut(imported: &mut Imported, rest: &RestShape, body: &Body) -> Vec<u32> {
    let Some(Bridges { longest_m, .. }) = Bridges::of(&imported.mesh) else { return Vec::new() };
    let at_rest = rest.corners.iter().map(|c| longest_side(c.map(|p| p.extend(0.0))));
    if OPEN_RATIO * at_rest.fold(0.0, f64::max) > longest_m {
        return Vec::new();
    }
    let landmarks = Landmarks::of(body.mesh());
    let mesh = &imported.mesh;
    let top = top_edge(mesh, &mesh.positions).filter(|(_, z)| landmarks.is_below_armpits(*z));
    let held = top.map(|(edge, _)| edge).unwrap_or_default();
    let [_, Level { gap, .. }] = COARSER;
    let (hold, compression) =
        if held.is_empty() { (Hold::Nothing, COMPRESSION) } else { (Hold::Height(&held), COMPRESSION) };
    let options = Closing { hold, compression, gap, max_steps: MAX_CLOSING_STEPS, converged: CONVERGED };
    let (start, fixed, begun) = if held.is_empty() {
        start_on_shoulders(mesh, rest, body, &landmarks, options)
    } else {
        match hung_around(mesh, rest, &held, body.mesh(), &landmarks, LAST_GAP) {
            Some(hung) => (hung, held.clone(), 0),
            None => (above_feet(&mesh.positions, body.mesh()), Vec::new(), 0),
        }
    };
    let options = match &fixed[..] {
        [] => options,
        fixed => Closing { hold: Hold::Place(fixed), compression: TUBE_COMPRESSION, ..options },
    };
    let (x, closing) = close(mesh, rest, body, &start, options);
    let (x, fairing) = faired_apart(mesh, rest, body, x, options);
    let steps = begun + closing + fairing;
    let farthest_m = x.iter().zip(&imported.mesh.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    // This repairs the difference between worn and rest lengths.
    imported.report.remarks.retain(|remark| !matches!(remark, Remark::OtherThanWorn { .. }));
    imported.report.repairs.push(Repair::SeamsDrawnShut { longest_m, steps, farthest_m, held: held.len() });
    imported.mesh.positions = x;
    held
}

/// Where a garment with shoulders starts, m: moved onto shoulders and arms; with a wide skirt also the vertices above the skirt, which are closed and
/// are to be held while the skirt is, and the steps that this took.
fn start_on_shoulders(
    mesh: &TriMesh,
    rest: &RestShape,
    body: &Body,
    landmarks: &Landmarks,
    options: Closing<'_>,
) -> (Vec<DVec3>, Vec<u32>, usize) {
    let placed = above_feet(&moved_onto(&mesh.positions, body.mesh(), landmarks), body.mesh());
    if let Some(skirt) = landmarks.below_armpits_z().and_then(|z| Skirt::of(mesh, rest, z)) {
        let (upper, upper_rest) = skirt.upper();
        let (x, closing) = close(upper, upper_rest, body, &placed, options);
        let (mut x, fairing) = faired_apart(upper, upper_rest, body, x, options);
        let steps = closing + fairing;
        if skirt.hang(&mut x, body.mesh(), landmarks, LAST_GAP) {
            return (x, skirt.vertices_above(), steps);
        }
    }
    (placed, Vec::new(), 0)
}

/// The positions (m) with what is below the crotch shortened in height to end above the feet. Legs would otherwise be closed around them.
fn above_feet(x: &[DVec3], body: &TriMesh) -> Vec<DVec3> {
    let (low, high) = box_about(body.positions.iter().copied());
    let instep = low.z + INSTEP * (high.z - low.z);
    let end = x.iter().fold(f64::INFINITY, |end, x| end.min(x.z));
    let Some(crotch) = crotch_z(body).filter(|_| end < instep) else { return x.to_vec() };
    let share = (crotch - instep) / (crotch - end);
    x.iter().map(|x| DVec3 { z: if x.z < crotch { crotch - share * (crotch - x.z) } else { x.z }, ..*x }).collect()
}

/// Rounds of fairings and steps until the cloth at `x` does not intersect itself, or one makes it no better and is discarded; the positions, m, and
/// the number of steps.
fn faired_apart(
    mesh: &TriMesh,
    rest: &RestShape,
    body: &Body,
    mut x: Vec<DVec3>,
    options: Closing<'_>,
) -> (Vec<DVec3>, usize) {
    let pairs_at = |x: &[DVec3]| self_intersecting_pairs(&mesh.with_positions(x.to_vec())).len();
    let (mut taken, mut least) = (0, pairs_at(&x));
    for _ in 0..MAX_ROUNDS {
        if least == 0 {
            break;
        }
        let mut trial = x.clone();
        for fairing in 0..=FAIRINGS {
            let (start, options) = if fairing < FAIRINGS {
                let wavelength = WAVELENGTH * NARROWING.powi(fairing);
                let mut smooth = faired(mesh, rest, &trial, wavelength);
                options.hold.vertices().iter().for_each(|&v| smooth[v as usize] = trial[v as usize]);
                (smooth, Closing { max_steps: 2, ..options })
            } else {
                (trial, Closing { gap: LAST_GAP, max_steps: MAX_LAST_STEPS, ..options })
            };
            let steps;
            (trial, steps) = close(mesh, rest, body, &start, options);
            taken += steps;
        }
        let pairs = pairs_at(&trial);
        if pairs >= least {
            break;
        }
        (least, x) = (pairs, trial);
    }
    (x, taken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;

    #[test]
    fn what_reaches_below_the_instep_is_shortened_below_the_crotch() {
        // Two legs of 80 cm, a trunk on them up to 1.7 m.
        let parts = [
            ([-0.2, -0.1, 0.0], [-0.05, 0.1, 0.8]),
            ([0.05, -0.1, 0.0], [0.2, 0.1, 0.8]),
            ([-0.2, -0.1, 0.8], [0.2, 0.1, 1.7]),
        ];
        let mut body = TriMesh::new(Vec::new(), Vec::new());
        for (low, high) in parts {
            let first = body.positions.len() as u32;
            let part = cuboid(DVec3::from_array(low), DVec3::from_array(high));
            body.positions.extend(part.positions);
            body.triangles.extend(part.triangles.iter().map(|t| t.map(|v| first + v)));
        }
        let crotch = crotch_z(&body).unwrap();
        let leg = |end: f64| [1.2, crotch, 0.5, end].map(|z| DVec3::new(0.1, 0.2, z));
        let raised = above_feet(&leg(-0.1), &body);
        assert_eq!((raised[0], raised[1]), (leg(0.0)[0], leg(0.0)[1]));
        assert!((raised[3].z - INSTEP * 1.7).abs() < 1e-12 && (0.5..crotch).contains(&raised[2].z), "{raised:?}");
        assert_eq!(above_feet(&leg(0.2), &body), leg(0.2), "legs that end above the feet stay");
    }
}
