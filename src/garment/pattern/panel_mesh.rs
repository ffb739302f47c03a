//! One panel as a mesh: its outline in vertices, even triangles inside.
//!
//! Both sides of a stitch are divided into the same number of segments. Inside the outline stand the points of a lattice of
//! equilateral triangles, as far as they keep a distance from it. A constrained Delaunay triangulation joins them, and is
//! refined (Ruppert's and Chew's algorithms, in `spade`) where its angles are small, without changing the outline. A sewn
//! garment must stay a manifold: an inner edge with both ends on the outline could coincide with another one once sewn, so it
//! is divided, and so is one of two edges from an inner vertex to two outline vertices that become one.

use std::collections::BTreeMap;

use glam::DVec2;
use spade::handles::FixedVertexHandle;
use spade::{AngleLimit, InsertionError, Point2, RefinementParameters, Triangulation as _};

use super::panels::{PatternPanel, SewingPattern, Stitch};
use crate::mesh::each_once;
use crate::mesh::polygon::{Plane, within};

/// Least distance of lattice points from the outline, as a share of an edge. A heuristic.
const CLEARANCE: f64 = 0.6;

/// Least angle, degrees; smaller ones are refined where the outline permits. Larger values insert more vertices.
const MIN_ANGLE: f64 = 25.0;

/// Least area of a triangle that is refined, as a share of an equilateral one. A heuristic.
const MIN_AREA: f64 = 0.15;

/// Most rounds of dividing chords; each halves them.
const MAX_ROUNDS: usize = 12;

/// The vertices of a panel's outline, in the order of its loop.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    /// Their positions, m.
    pub(super) points: Vec<DVec2>,
    /// The first vertex of each edge, and one past the last.
    pub(super) starts: Vec<usize>,
    /// A number that is the same for vertices that are one vertex of the sewn garment.
    pub(super) class: Vec<u32>,
}

impl Outline {
    /// Indices of the vertices of an edge, both ends included.
    pub(super) fn along(&self, edge: usize) -> Vec<usize> {
        (self.starts[edge]..=self.starts[edge + 1]).map(|i| i % self.points.len()).collect()
    }
}

/// Number of segments of each edge of each panel at this edge length (m); both sides of a stitch have the greater number.
pub(super) fn divisions(pattern: &SewingPattern, edge_m: f64) -> Vec<Vec<usize>> {
    let own = |length: f64| ((length / edge_m).ceil() as usize).max(1);
    let of_panel = |panel: &PatternPanel| panel.edges.iter().map(|e| own(e.curve.length())).collect();
    let mut counts: Vec<Vec<usize>> = pattern.panels.iter().map(of_panel).collect();
    for Stitch { sides: [a, b], .. } in &pattern.stitches {
        let count = counts[a.panel][a.edge].max(counts[b.panel][b.edge]);
        (counts[a.panel][a.edge], counts[b.panel][b.edge]) = (count, count);
    }
    // A loop of two edges needs a third vertex.
    for counts in &mut counts {
        if counts.iter().sum::<usize>() < 3 {
            counts.iter_mut().for_each(|c| *c = 2);
        }
    }
    counts
}

/// Outlines of all panels, with the classes of sewn vertices joined by union-find.
pub(super) fn outlines(pattern: &SewingPattern, counts: &[Vec<usize>]) -> Vec<Outline> {
    let mut all = Vec::new();
    let mut next = 0;
    for (panel, counts) in pattern.panels.iter().zip(counts) {
        let (mut points, mut starts) = (Vec::new(), vec![0]);
        for (edge, &count) in panel.edges.iter().zip(counts) {
            let divided = edge.curve.divided(count);
            points.extend(&divided[..count]);
            starts.push(points.len());
        }
        let class = (next..next + points.len() as u32).collect();
        next += points.len() as u32;
        all.push(Outline { points, starts, class });
    }
    let mut root: Vec<u32> = (0..next).collect();
    for stitch in &pattern.stitches {
        let [a, b] = stitch.sides.map(|side| {
            let outline = &all[side.panel];
            outline.along(side.edge).into_iter().map(|i| outline.class[i]).collect::<Vec<_>>()
        });
        for (i, &one) in a.iter().enumerate() {
            let other = if stitch.right_wrong { b[i] } else { b[b.len() - 1 - i] };
            let (one, other) = (find(&root, one), find(&root, other));
            root[one.max(other) as usize] = one.min(other);
        }
    }
    for outline in &mut all {
        outline.class.iter_mut().for_each(|c| *c = find(&root, *c));
    }
    all
}

fn find(root: &[u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        v = root[v as usize];
    }
    v
}

/// Points (the outline's first) and triangles, counter-clockwise.
pub(super) type Meshed = (Vec<DVec2>, Vec<[u32; 3]>);

/// Why a point cannot be taken into a triangulation.
fn unusable(error: InsertionError) -> String {
    match error {
        InsertionError::TooSmall => {
            "found a coordinate nearer to 0 than can be computed with; write 0 for it".to_owned()
        }
        InsertionError::TooLarge | InsertionError::NAN => {
            "found a coordinate that is no finite length, expected one".to_owned()
        }
    }
}

/// Meshes the inside of a counter-clockwise `outline`; vertices of one `class` become one vertex when sewn.
pub(super) fn mesh(outline: &[DVec2], class: &[u32], edge_m: f64) -> Result<Meshed, String> {
    let n = outline.len();
    let mut places: Vec<Point2<f64>> = outline.iter().map(|p| Point2::new(p.x, p.y)).collect();
    places.extend(lattice(outline, edge_m).into_iter().map(|p| Point2::new(p.x, p.y)));
    let all = places.len();
    let mut crossed = false;
    let sides = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let mut plane = Plane::try_bulk_load_cdt(places, sides, |_| crossed = true).map_err(unusable)?;
    if crossed || plane.num_vertices() != all {
        return Err(
            "found an outline that meets itself once it is divided into straight edges, expected one without thin places; \
             widen it there, or ask for shorter edges (--edge-length)"
                .to_owned()
        );
    }
    let even = 3.0_f64.sqrt() / 4.0 * edge_m * edge_m;
    let parameters = RefinementParameters::new()
        .keep_constraint_edges()
        .exclude_outer_faces(true)
        .with_angle_limit(AngleLimit::from_deg(MIN_ANGLE))
        .with_min_required_area(MIN_AREA * even)
        .with_max_additional_vertices(all);
    plane.refine(parameters);
    for _ in 0..MAX_ROUNDS {
        let faces = inside(&plane, n)?;
        let chords = chords(&plane, &faces, class);
        if chords.is_empty() {
            break;
        }
        for middle in chords {
            plane.insert(middle).map_err(unusable)?;
        }
    }
    let faces = inside(&plane, n)?;
    // Vertices that refinement inserted in notches lie outside and are in no triangle.
    let mut number = vec![u32::MAX; plane.num_vertices()];
    (0..n).for_each(|i| number[i] = i as u32);
    let mut points = outline.to_vec();
    for v in each_once(faces.values().flatten().copied().filter(|&v| v >= n)) {
        number[v] = points.len() as u32;
        let p = plane.vertex(FixedVertexHandle::from_index(v)).position();
        points.push(DVec2::new(p.x, p.y));
    }
    let triangles: Vec<[u32; 3]> = faces.values().map(|face| face.map(|v| number[v])).collect();
    Ok((points, triangles))
}

/// The faces within the outline, by number.
fn inside(plane: &Plane, n: usize) -> Result<BTreeMap<usize, [usize; 3]>, String> {
    within(plane, n).ok_or_else(|| "its outline is lost in the triangulation".to_owned())
}

/// Midpoints of the inner edges that must be divided.
fn chords(plane: &Plane, faces: &BTreeMap<usize, [usize; 3]>, class: &[u32]) -> Vec<Point2<f64>> {
    let n = class.len();
    let on_outline = |v: usize| v < n;
    let edges = faces
        .values()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| !(on_outline(*a) && on_outline(*b) && (a.abs_diff(*b) == 1 || a.abs_diff(*b) == n - 1)))
        .map(|[a, b]| [a.min(b), a.max(b)]);
    let edges = each_once(edges);
    let mut found: Vec<[usize; 2]> = edges.iter().filter(|e| e.iter().all(|&v| on_outline(v))).copied().collect();
    // Edges of an inner vertex to two outline vertices of one class.
    let mut seen: BTreeMap<(usize, u32), usize> = BTreeMap::new();
    for &[a, b] in edges.iter().filter(|[a, b]| on_outline(*a) && !on_outline(*b)) {
        if seen.insert((b, class[a]), a).is_some() {
            found.push([a, b]);
        }
    }
    let place = |v: usize| plane.vertex(FixedVertexHandle::from_index(v)).position();
    let middle = |&[a, b]: &[usize; 2]| {
        let (p, q) = (place(a), place(b));
        Point2::new(0.5 * (p.x + q.x), 0.5 * (p.y + q.y))
    };
    found.iter().map(middle).collect()
}

/// Points of a lattice of equilateral triangles inside the outline and clear of it, row by row.
fn lattice(outline: &[DVec2], edge_m: f64) -> Vec<DVec2> {
    let [low, high] = box_about(outline.iter().copied());
    let middle = 0.5 * (low + high);
    let step = DVec2::new(edge_m, 0.75_f64.sqrt() * edge_m);
    let reach = (0.5 * (high - low) / step).ceil();
    let (columns, rows) = (reach.x as i64 + 1, reach.y as i64);
    let clear = CLEARANCE * edge_m;
    let n = outline.len();
    let mut points = Vec::new();
    for row in -rows..=rows {
        let y = middle.y + row as f64 * step.y;
        // Only sides near this row can contain its points or be close to them.
        let near: Vec<[DVec2; 2]> = (0..n)
            .map(|i| [outline[i], outline[(i + 1) % n]])
            .filter(|[a, b]| a.y.min(b.y) <= y + clear && a.y.max(b.y) >= y - clear)
            .collect();
        for column in -columns..=columns {
            let shift = if row.rem_euclid(2) == 0 { 0.0 } else { 0.5 };
            let p = DVec2::new(middle.x + (column as f64 + shift) * step.x, y);
            if is_within(p, &near) && near.iter().all(|[a, b]| to_segment(p, *a, *b) >= clear) {
                points.push(p);
            }
        }
    }
    points
}

/// Whether a point lies inside an outline; `sides` must have all sides at its height.
pub(super) fn is_within(p: DVec2, sides: &[[DVec2; 2]]) -> bool {
    let crossed =
        |[a, b]: &&[DVec2; 2]| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
    sides.iter().filter(crossed).count() % 2 == 1
}

/// Distance of a point to a segment, m.
fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let t = ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0);
    p.distance(a + t * d)
}

/// Lower and upper corner of the box around some points, m.
pub(super) fn box_about(points: impl IntoIterator<Item = DVec2>) -> [DVec2; 2] {
    let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    points.into_iter().fold(none, |[low, high], p| [low.min(p), high.max(p)])
}
