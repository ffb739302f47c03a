//! A polygon in space cut into triangles.
//!
//! A quad takes the diagonal whose worst angle is best among those that lie inside it. Larger polygons lose ears, the best
//! shaped first, in the plane of their Newell normal (Sutherland, Sproull, Schumacker: "A characterization of ten
//! hidden-surface algorithms", 1974, section on planes), so that concave ones come out right; up to O(n³) for n corners,
//! hence beyond some tens of corners a constrained Delaunay triangulation, O(n log n).
//!
//! Limits: a polygon that crosses itself has no ears left at some point, and no triangulation; the rest is then cut as a
//! fan.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

/// Polygons of more corners are cut by the triangulation. Modelled faces have fewer; an ear's shape is then nobody's
/// choice, and a face of 5,000 corners took 25 s.
const MANY_CORNERS: usize = 32;

/// A triangulation that has the sides of an outline.
pub(crate) type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Corner numbers of the triangles of a polygon, wound as it is; n − 2 of them for n ≥ 3 corners, else none.
pub(super) fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
    match corners.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        4..=MANY_CORNERS => clip_ears(&flatten(corners)),
        n => delaunay(&flatten(corners)).unwrap_or_else(|| (2..n).map(|i| [0, i - 1, i]).collect()),
    }
}

/// The triangles of a polygon of any size; `None` where it touches or crosses itself.
fn delaunay(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let n = points.len();
    let places = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let mut crossed = false;
    let outline = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let plane = Plane::try_bulk_load_cdt(places, outline, |_| crossed = true).ok()?;
    // Corners at one place would be one.
    (!crossed && plane.num_vertices() == n).then_some(())?;
    let inside = within(&plane, n)?;
    // Fewer or more mean an outline that touches itself.
    (inside.len() == n - 2).then(|| inside.into_values().collect())
}

/// The faces within the outline of a triangulation, its first `n` vertices counter-clockwise, by number; `None` where a side of it is none
/// of the triangulation's.
pub(crate) fn within(plane: &Plane, n: usize) -> Option<BTreeMap<usize, [usize; 3]>> {
    let corner = |i: usize| FixedVertexHandle::from_index(i % n);
    // What lies to the left of the outline is inside, and so is what can be reached from there without crossing it.
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
        // Only the two neighbours of the ear have changed, and on a concave polygon whoever it was that hid in it: an
        // ear's emptiness can only come true by a removal, so those that were refused are asked again.
        for (i, slot) in quality.iter_mut().enumerate() {
            if i == best % n || i == (best + n - 1) % n || *slot <= 0.0 {
                *slot = ear_quality(points, &left, i);
            }
        }
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// How good it is to cut corner `i` off, higher is better: for a true ear its own smallest angle (for a quad that of
/// both halves), in radians; zero or less where the ear is turned inside out or holds another corner.
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
            a.perp_dot(b).abs().atan2(a.dot(b))
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
    fn what_is_no_polygon_gives_nothing_and_what_crosses_itself_still_gives_n_minus_two() {
        assert!(triangulate(&lift(&[(0.0, 0.0), (1.0, 0.0)])).is_empty());
        assert_eq!(triangulate(&lift(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])).len(), 2);
        assert_eq!(triangulate(&[DVec3::ONE; 6]).len(), 4);
    }

    #[test]
    fn faces_of_thousands_of_corners_are_covered_once_and_at_once() {
        // A comb: every tooth hides the corners behind it, the worst case for clipping ears.
        let started = std::time::Instant::now();
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
            assert!(used.iter().all(|&u| u), "every corner stays a corner, or neighbours come apart");
        }
        // A ring of equal corners, and one that crosses itself, still end.
        assert_eq!(triangulate(&vec![DVec3::ONE; 20_000]).len(), 19_998);
        let crossed: Vec<_> = (0..999).map(|i| (f64::from(i * 500 % 999), f64::from(i * 77 % 999))).collect();
        assert_eq!(triangulate(&lift(&crossed)).len(), 997);
        assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
    }

    proptest! {
        /// A star seen from its middle: any radii, turns ascending.
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
