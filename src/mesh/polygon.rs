//! Triangulates a polygon in space.
//!
//! A quad is cut along the inner diagonal with the larger smallest angle. Larger polygons are cut by ear clipping, the best
//! shaped ear first, in the plane of their Newell normal (Sutherland, Sproull, Schumacker: "A characterization of ten
//! hidden-surface algorithms", 1974, section on planes). Ear clipping handles concave polygons in at most O(n³) for n
//! corners, so polygons of more than [`MAX_EAR_CORNERS`] get a constrained Delaunay triangulation, O(n log n).
//!
//! The Delaunay triangulation chooses the same diagonals for the quads of the test bodies, but lists the triangles and
//! their corners in another order, which changes the sums of every later stage; ear clipping is kept for the same bits.
//!
//! Limits: a self-intersecting polygon may run out of ears; the rest is then cut as a fan.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

use crate::base::math;

/// Largest number of corners for ear clipping. Modelled faces have fewer; ear clipping of 5,000 corners took 25 s.
const MAX_EAR_CORNERS: usize = 32;

/// A triangulation constrained to the sides of an outline.
pub(crate) type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Corner indices of the triangles of a polygon, with its winding: n − 2 triangles for n ≥ 3 corners, else none.
pub(super) fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
    match corners.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        4..=MAX_EAR_CORNERS => clip_ears(&flatten(corners)),
        n => delaunay(&flatten(corners)).unwrap_or_else(|| (2..n).map(|i| [0, i - 1, i]).collect()),
    }
}

/// The constrained Delaunay triangles of a polygon; `None` if it touches or crosses itself.
fn delaunay(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let n = points.len();
    let places = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let mut crossed = false;
    let outline = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let plane = Plane::try_bulk_load_cdt(places, outline, |_| crossed = true).ok()?;
    // The triangulation merges corners at the same place.
    (!crossed && plane.num_vertices() == n).then_some(())?;
    let inside = within(&plane, n)?;
    // Another number of triangles means an outline that touches itself.
    (inside.len() == n - 2).then(|| inside.into_values().collect())
}

/// The faces inside the outline of a triangulation, by their index. The outline is its first `n` vertices,
/// counter-clockwise; `None` if one of its sides is not an edge of the triangulation.
pub(crate) fn within(plane: &Plane, n: usize) -> Option<BTreeMap<usize, [usize; 3]>> {
    let corner = |i: usize| FixedVertexHandle::from_index(i % n);
    // The faces to the left of the outline are inside, and so are all that are connected to them without crossing it.
    let mut inside = BTreeMap::new();
    let mut reached = Vec::new();
    for i in 0..n {
        reached.push(plane.get_edge_from_neighbors(corner(i), corner(i + 1))?.face().as_inner()?);
    }
    while let Some(face) = reached.pop() {
        if inside.insert(face.fix().index(), face.vertices().map(|v| v.fix().index())).is_some() {
            continue;
        }
        let open = face.adjacent_edges().into_iter().filter(|edge| !edge.is_constraint_edge());
        reached.extend(open.filter_map(|edge| edge.rev().face().as_inner()));
    }
    Some(inside)
}

/// The corners in the polygon's plane, counter-clockwise.
fn flatten(corners: &[DVec3]) -> Vec<DVec2> {
    let next = corners.iter().cycle().skip(1);
    let normal = corners.iter().zip(next).map(|(a, b)| (a - corners[0]).cross(b - corners[0])).sum::<DVec3>();
    let Some(normal) = normal.try_normalize() else { return corners.iter().map(|p| DVec2::new(p.x, p.y)).collect() };
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    corners.iter().map(|p| DVec2::new((p - corners[0]).dot(u), (p - corners[0]).dot(v))).collect()
}

fn clip_ears(points: &[DVec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut quality: Vec<f64> = (0..left.len()).map(|i| ear_quality(points, &left, i)).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    while left.len() > 3 {
        let n = left.len();
        let best = (0..n).fold(0, |best, i| if quality[i] > quality[best] { i } else { best });
        triangles.push([left[(best + n - 1) % n], left[best], left[(best + 1) % n]]);
        left.remove(best);
        quality.remove(best);
        let n = left.len();
        // The removal changes the ears of its two neighbours, and may empty an ear that held the removed corner, so
        // rejected ears are evaluated again.
        for (i, slot) in quality.iter_mut().enumerate() {
            if i == best % n || i == (best + n - 1) % n || *slot <= 0.0 {
                *slot = ear_quality(points, &left, i);
            }
        }
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// Quality of cutting off corner `i`, higher is better: the smallest angle of the ear (for a quad, of both halves), in
/// radians; zero or less if the ear is inverted or contains another corner.
fn ear_quality(points: &[DVec2], left: &[usize], i: usize) -> f64 {
    let n = left.len();
    let ear = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]].map(|c| points[c]);
    let turn = (ear[1] - ear[0]).perp_dot(ear[2] - ear[1]);
    if turn <= 0.0 {
        return turn.min(-f64::MIN_POSITIVE);
    }
    let holds = |p: DVec2| {
        p != ear[0]
            && p != ear[1]
            && p != ear[2]
            && (0..3).all(|k| (ear[(k + 1) % 3] - ear[k]).perp_dot(p - ear[k]) >= 0.0)
    };
    if left.iter().any(|&c| holds(points[c])) {
        return 0.0;
    }
    let mut worst = smallest_angle(ear);
    if n == 4 {
        let rest = [ear[2], points[left[(i + 2) % n]], ear[0]];
        if (rest[1] - rest[0]).perp_dot(rest[2] - rest[1]) <= 0.0 {
            return 0.0;
        }
        worst = worst.min(smallest_angle(rest));
    }
    worst
}

fn smallest_angle(t: [DVec2; 3]) -> f64 {
    (0..3)
        .map(|k| {
            let (a, b) = (t[(k + 1) % 3] - t[k], t[(k + 2) % 3] - t[k]);
            math::atan2(a.perp_dot(b).abs(), a.dot(b))
        })
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lift(points: &[(f64, f64)]) -> Vec<DVec3> {
        // A slanted plane, so that nothing depends on the axes.
        let (u, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Y);
        points.iter().map(|&(x, y)| DVec3::new(3.0, -1.0, 2.0) + x * u + y * v).collect()
    }

    fn area(corners: &[DVec3], t: [usize; 3]) -> DVec3 {
        0.5 * (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]])
    }

    fn assert_covers(points: &[(f64, f64)], expected: f64) {
        let corners = lift(points);
        let triangles = triangulate(&corners);
        assert_eq!(triangles.len(), points.len() - 2);
        let normal = DVec3::new(0.6, 0.0, 0.8).cross(DVec3::Y);
        let areas: Vec<f64> = triangles.iter().map(|&t| area(&corners, t).dot(normal)).collect();
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - expected).abs() < 1e-12, "{areas:?}");
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        assert_covers(&[(0.0, 0.0), (2.0, 0.0), (0.5, 0.5), (0.0, 2.0)], 1.0);
        assert_covers(
            &[(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)],
            7.0,
        );
        let star: Vec<_> = (0..10)
            .map(|i| {
                let (r, a) = (if i % 2 == 0 { 2.0 } else { 0.5 }, f64::from(i) * std::f64::consts::PI / 5.0);
                (r * a.cos(), r * a.sin())
            })
            .collect();
        assert_covers(&star, 5.0 * 2.0 * 0.5 * (std::f64::consts::PI / 5.0).sin());
    }

    #[test]
    fn a_quad_takes_the_better_diagonal() {
        // A kite, 1 wide and 4 long: the short diagonal joins corners 1 and 3.
        let kite = lift(&[(0.0, 0.0), (1.0, -0.5), (4.0, 0.0), (1.0, 0.5)]);
        let triangles = triangulate(&kite);
        assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{triangles:?}");
    }

    #[test]
    fn two_corners_give_no_triangle_and_polygons_that_cross_themselves_give_n_minus_two() {
        assert!(triangulate(&lift(&[(0.0, 0.0), (1.0, 0.0)])).is_empty());
        assert_eq!(triangulate(&lift(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])).len(), 2);
        assert_eq!(triangulate(&[DVec3::ONE; 6]).len(), 4);
    }

    #[test]
    fn faces_of_thousands_of_corners_are_covered_once() {
        // A comb: every tooth hides the corners behind it, the worst case of ear clipping.
        for teeth in [20, 5_000] {
            let tooth = |i: i32| {
                [(f64::from(i), 0.0), (f64::from(i) + 0.1, 9.0), (f64::from(i) + 0.2, 9.0), (f64::from(i) + 0.3, 0.0)]
            };
            let mut points: Vec<(f64, f64)> = (0..teeth).flat_map(tooth).collect();
            points.extend([(f64::from(teeth), -1.0), (0.0, -1.0)]);
            points.reverse();
            let corners = lift(&points);
            let triangles = triangulate(&corners);
            assert_eq!(triangles.len(), points.len() - 2);
            let whole =
                0.5 * points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>();
            let covered: f64 = triangles.iter().map(|&t| area(&corners, t).length()).sum();
            assert!((covered - whole.abs()).abs() < 1e-9 * whole.abs(), "{covered} of {whole}");
            let mut used = vec![false; points.len()];
            triangles.as_flattened().iter().for_each(|&c| used[c] = true);
            assert!(used.iter().all(|&u| u), "a corner in no triangle separates neighbours");
        }
        // A ring of equal corners, and one that crosses itself.
        assert_eq!(triangulate(&vec![DVec3::ONE; 20_000]).len(), 19_998);
        let crossed: Vec<_> = (0..999).map(|i| (f64::from(i * 500 % 999), f64::from(i * 77 % 999))).collect();
        assert_eq!(triangulate(&lift(&crossed)).len(), 997);
    }

    proptest! {
        /// A polygon that is star-shaped about the origin: any radii, ascending angles.
        #[test]
        fn star_shaped_polygons_are_covered_once(radii in prop::collection::vec(0.1..2.0f64, 3..90)) {
            let n = radii.len();
            let step = std::f64::consts::TAU / n as f64;
            let points: Vec<_> =
                radii.iter().enumerate().map(|(i, r)| (r * (i as f64 * step).cos(), r * (i as f64 * step).sin())).collect();
            let expected = (0..n).map(|i| 0.5 * radii[i] * radii[(i + 1) % n] * step.sin()).sum();
            assert_covers(&points, expected);
        }
    }
}
