//! One panel meshed: even triangles inside, the outline's vertices as they are.
//!
//! Inside lie the points of a lattice of equilateral triangles, as far as they keep from the outline; a constrained Delaunay
//! triangulation joins them to it, and is refined (Ruppert's and Chew's algorithms, in `spade`) where its angles are small, without
//! touching the outline. What is sewn must not meet itself by a chord: an inner edge whose ends both lie on the outline is
//! divided, and so is one of two that end at vertices which are one when sewn.

use std::collections::BTreeMap;

use glam::DVec2;
use spade::handles::FixedVertexHandle;
use spade::{AngleLimit, Point2, RefinementParameters, Triangulation as _};

use super::layout::box_about;
use crate::mesh::each_once;
use crate::mesh::polygon::{Plane, within};

/// Lattice points nearer to the outline than this share of an edge are left out.
const CLEARANCE: f64 = 0.6;

/// Angles under this are refined away where the outline lets them, degrees.
const LEAST_ANGLE: f64 = 25.0;

/// Triangles of less than this share of an even one are let be.
const LEAST_AREA: f64 = 0.15;

/// Rounds of dividing chords: each halves them, so that no panel needs more.
const ROUNDS: usize = 12;

/// Points (the outline's first) and triangles, counter-clockwise.
pub(super) type Meshed = (Vec<DVec2>, Vec<[u32; 3]>);

/// Meshes what lies within a counter-clockwise `outline`, of which vertices of one `class` are one when sewn.
pub(super) fn mesh(outline: &[DVec2], class: &[u32], edge_m: f64) -> Result<Meshed, String> {
    let n = outline.len();
    let mut places: Vec<Point2<f64>> = outline.iter().map(|p| Point2::new(p.x, p.y)).collect();
    places.extend(lattice(outline, edge_m).into_iter().map(|p| Point2::new(p.x, p.y)));
    let all = places.len();
    let mut crossed = false;
    let sides = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let mut plane = Plane::try_bulk_load_cdt(places, sides, |_| crossed = true).map_err(|e| e.to_string())?;
    if crossed || plane.num_vertices() != all {
        return Err("its outline meets itself once it is divided into straight edges".to_owned());
    }
    let even = 3.0_f64.sqrt() / 4.0 * edge_m * edge_m;
    let parameters = RefinementParameters::new()
        .keep_constraint_edges()
        .exclude_outer_faces(true)
        .with_angle_limit(AngleLimit::from_deg(LEAST_ANGLE))
        .with_min_required_area(LEAST_AREA * even)
        .with_max_additional_vertices(all);
    plane.refine(parameters);
    for _ in 0..ROUNDS {
        let faces = inside(&plane, n)?;
        let chords = chords(&plane, &faces, class);
        if chords.is_empty() {
            break;
        }
        for middle in chords {
            plane.insert(middle).map_err(|e| e.to_string())?;
        }
    }
    let faces = inside(&plane, n)?;
    // Vertices of refined notches lie outside and are in no triangle.
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

/// Middles of the inner edges that must be divided.
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
    // Edges of an inner vertex to two vertices of the outline that are one.
    let mut met: BTreeMap<(usize, u32), usize> = BTreeMap::new();
    for &[a, b] in edges.iter().filter(|[a, b]| on_outline(*a) && !on_outline(*b)) {
        if met.insert((b, class[a]), a).is_some() {
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

/// Points of a lattice of equilateral triangles within the outline and away from it, row by row.
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
        // Sides near this row alone matter to it, left or right crossings among them.
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

/// Whether a point lies within an outline of these sides, of which those at its height matter.
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
