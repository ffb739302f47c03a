//! Triangles of a mesh that cross each other, or those of another mesh: all pairs, exactly.
//!
//! Candidates come from parry3d's bounding volume hierarchy, one triangle a task. Pairs are sorted, so the list is the same
//! on any number of threads.
//!
//! Two triangles cross if an edge of one goes from strictly one side of the other's plane to strictly the other through the
//! triangle, or if both lie in one plane and their interiors overlap. Touching is not crossing: neighbours share an edge
//! or a vertex, and unjoined seams coincide. A fold so sharp that two neighbours coincide does cross. Every decision is the
//! sign of a determinant, computed exactly (Shewchuk: "Adaptive precision floating-point arithmetic and fast robust
//! geometric predicates", Discrete & Computational Geometry 18, 1997; the `robust` crate).
//!
//! Most candidates are neighbours in smooth cloth. If a plane through all that they share separates them by far more than
//! rounding, the exact test is skipped.
//!
//! Limits: a triangle without area crosses nothing in its own plane.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;
use robust::{Coord, Coord3D, orient2d, orient3d};

use super::TriMesh;

/// Neighbours over an edge may be folded onto each other if the cosine of the angle between them exceeds this: far from 1 by
/// rounding.
const MIN_FOLD_COSINE: f64 = 0.9;

/// Sine of an angle that is far from 0 by rounding: directions this far apart need no exact test.
const CLEAR_SINE: f64 = 1e-6;

/// Pairs of triangles of the mesh that cross, smaller number first, sorted. Neighbours that only share an edge or a
/// corner do not.
#[must_use]
pub fn self_intersecting_pairs(mesh: &TriMesh) -> Vec<[u32; 2]> {
    pairs(mesh, mesh, &tree_of(mesh), |t, u| t < u)
}

/// Pairs of a triangle of `a` and one of `b` that cross, sorted.
#[must_use]
pub fn crossing_pairs(a: &TriMesh, b: &TriMesh) -> Vec<[u32; 2]> {
    crossing_pairs_in(a, b, &tree_of(b))
}

/// The same where the tree of `b` is there already.
pub(crate) fn crossing_pairs_in(a: &TriMesh, b: &TriMesh, tree: &Bvh) -> Vec<[u32; 2]> {
    pairs(a, b, tree, |_, _| true)
}

/// The boxes of the triangles of a mesh as a tree.
pub(crate) fn tree_of(mesh: &TriMesh) -> Bvh {
    let boxes: Vec<Aabb> = (0..mesh.triangles.len()).map(|u| bounds(mesh, u)).collect();
    Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes)
}

fn pairs(a: &TriMesh, b: &TriMesh, tree: &Bvh, wanted: impl Fn(u32, u32) -> bool + Sync) -> Vec<[u32; 2]> {
    if a.triangles.is_empty() || b.triangles.is_empty() {
        return Vec::new();
    }
    (0..a.triangles.len())
        .into_par_iter()
        .with_min_len(128)
        .flat_map_iter(|t| {
            let (corners, near) = (a.corners(t), bounds(a, t));
            let t = t as u32;
            let mut found: Vec<u32> =
                tree.intersect_aabb(&near).filter(|&u| wanted(t, u) && cross(corners, b.corners(u as usize))).collect();
            found.sort_unstable();
            found.into_iter().map(move |u| [t, u])
        })
        .collect()
}

fn bounds(mesh: &TriMesh, t: usize) -> Aabb {
    let [a, b, c] = mesh.corners(t);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

/// Whether triangles `a` and `b` cross. Symmetric, and the same for any order of the corners.
pub(crate) fn cross(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    !neighbours_apart(a, b) && cross_exactly(a, b)
}

fn cross_exactly(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let a_sides = a.map(|p| side(b, p));
    if same_side(a_sides) {
        return false;
    }
    let b_sides = b.map(|p| side(a, p));
    if same_side(b_sides) {
        return false;
    }
    if a_sides == [0.0; 3] && b_sides == [0.0; 3] {
        return overlap(a, b);
    }
    pierces(a, a_sides, b) || pierces(b, b_sides, a)
}

/// Whether both surely share an edge or a corner and nothing else; `false` leaves the decision to the exact test.
fn neighbours_apart(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let is_shared = a.map(|p| b.contains(&p));
    match is_shared.iter().filter(|shared| **shared).count() {
        // Over an edge they cross only if one lies on the other: both heights above the edge point the same way.
        2 => {
            let own = is_shared.iter().position(|shared| !shared).unwrap_or(0);
            let ([p, q], Some(other)) = ([a[(own + 1) % 3], a[(own + 2) % 3]], b.into_iter().find(|p| !a.contains(p)))
            else {
                return false;
            };
            let above = |corner: DVec3| (q - p).cross(corner - p);
            let is_clear = |corner: DVec3| {
                let limit = (q - p).length_squared() * (corner - p).length_squared();
                above(corner).length_squared() > CLEAR_SINE * CLEAR_SINE * limit
            };
            let (one, two) = (above(a[own]), above(other));
            let along = one.dot(two);
            let folded = along > 0.0
                && along * along >= MIN_FOLD_COSINE * MIN_FOLD_COSINE * one.length_squared() * two.length_squared();
            !folded && is_clear(a[own]) && is_clear(other)
        }
        // At a corner they do not cross if a plane through it separates their other sides.
        1 => {
            let at = is_shared.iter().position(|shared| *shared).unwrap_or(0);
            let Some(other) = b.iter().position(|p| *p == a[at]) else { return false };
            let sides = |t: [DVec3; 3], i: usize| [t[(i + 1) % 3] - t[i], t[(i + 2) % 3] - t[i]];
            let (of_a, of_b) = (sides(a, at), sides(b, other));
            let across = of_b[0] + of_b[1] - of_a[0] - of_a[1];
            let ahead = |side: DVec3| {
                let along = side.dot(across);
                let limit = side.length_squared() * across.length_squared();
                along > 0.0 && along * along > CLEAR_SINE * CLEAR_SINE * limit
            };
            of_b.into_iter().all(ahead) && of_a.into_iter().all(|side| ahead(-side))
        }
        _ => false,
    }
}

/// Side of the triangle's plane that `p` is on: positive, zero or negative.
fn side(t: [DVec3; 3], p: DVec3) -> f64 {
    // Neighbours share corners. The determinant is zero then, but computing it exactly takes all its digits.
    if t.contains(&p) || t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
        return 0.0;
    }
    let [a, b, c, p] = [t[0], t[1], t[2], p].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, p)
}

fn same_side(sides: [f64; 3]) -> bool {
    sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
}

/// Whether an edge of `a`, with its corners on these sides of `b`, goes through `b`.
fn pierces(a: [DVec3; 3], sides: [f64; 3], b: [DVec3; 3]) -> bool {
    (0..3).any(|k| {
        let next = (k + 1) % 3;
        let through_plane = (sides[k] > 0.0 && sides[next] < 0.0) || (sides[k] < 0.0 && sides[next] > 0.0);
        through_plane && {
            let turns = [0, 1, 2].map(|i| side([a[k], a[next], b[i]], b[(i + 1) % 3]));
            turns.iter().all(|&s| s >= 0.0) || turns.iter().all(|&s| s <= 0.0)
        }
    })
}

/// Whether the insides of two triangles in one plane overlap: no edge of either has the other all on its outer side.
fn overlap(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    // Projected along the axis of the largest area; dropping a coordinate keeps the others exact.
    let normal = (a[1] - a[0]).cross(a[2] - a[0]).abs();
    let (i, j) = match normal.max_element() {
        m if m == normal.x => (1, 2),
        m if m == normal.y => (0, 2),
        _ => (0, 1),
    };
    let flat = |t: [DVec3; 3]| {
        let t = t.map(|p| Coord { x: p[i], y: p[j] });
        let turn = orient2d(t[0], t[1], t[2]);
        (turn != 0.0).then_some(if turn < 0.0 { [t[0], t[2], t[1]] } else { t })
    };
    let (Some(a), Some(b)) = (flat(a), flat(b)) else { return false };
    let apart = |t: [Coord<f64>; 3], other: [Coord<f64>; 3]| {
        (0..3).any(|k| other.iter().all(|&p| orient2d(t[k], t[(k + 1) % 3], p) <= 0.0))
    };
    !apart(a, b) && !apart(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;
    use glam::Vec3Swizzles;
    use proptest::prelude::*;

    /// A sheet of n × n squares in the plane through `origin` spanned by `u` and `v`.
    fn plane(n: u32, origin: DVec3, u: DVec3, v: DVec3) -> TriMesh {
        sheet(n, n, |i, j| origin + u * i + v * j)
    }

    #[test]
    fn a_flat_sheet_does_not_cross_itself_and_a_folded_one_does() {
        let mut mesh = plane(12, DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1);
        assert!(self_intersecting_pairs(&mesh).is_empty());
        // One corner of the sheet is bent through the rest of it.
        mesh.positions[0] = DVec3::new(0.55, 0.55, -0.2);
        let positions = mesh.positions.clone();
        mesh.positions[1] = DVec3::new(0.62, 0.57, 0.2);
        assert!(!self_intersecting_pairs(&mesh).is_empty());
        assert_eq!(self_intersecting_pairs(&mesh.with_positions(positions)).len(), 0);
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let a = plane(9, DVec3::ZERO, DVec3::new(0.1, 0.01, 0.0), DVec3::new(0.0, 0.1, 0.02));
        let b = plane(7, DVec3::new(0.4, 0.1, -0.3), DVec3::new(0.01, 0.1, 0.02), DVec3::new(0.02, 0.0, 0.11));
        let all = (0..a.triangles.len()).flat_map(|t| (0..b.triangles.len()).map(move |u| (t, u)));
        let brute: Vec<[u32; 2]> =
            all.filter(|&(t, u)| cross(a.corners(t), b.corners(u))).map(|(t, u)| [t as u32, u as u32]).collect();
        assert!(brute.len() > 10);
        assert_eq!(crossing_pairs(&a, &b), brute);
        assert!(crossing_pairs(&a, &TriMesh::default()).is_empty());
    }

    const FLAT: [DVec3; 3] = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];

    fn p(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn piercing_triangles_cross_and_touching_ones_do_not() {
        assert!(cross(FLAT, [p(1.0, 1.0, -1.0), p(1.0, 1.0, 1.0), p(9.0, 9.0, 1.0)]));
        // Through its edge, exactly.
        assert!(cross(FLAT, [p(2.0, 2.0, -1.0), p(2.0, 2.0, 1.0), p(9.0, 9.0, 1.0)]));
        // Beside it, above it, a corner on it, an edge on it, an edge on its edge.
        assert!(!cross(FLAT, [p(3.0, 3.0, -1.0), p(3.0, 3.0, 1.0), p(9.0, 9.0, 1.0)]));
        assert!(!cross(FLAT, [p(1.0, 1.0, 0.1), p(1.0, 1.0, 1.0), p(9.0, 9.0, 1.0)]));
        assert!(!cross(FLAT, [p(1.0, 1.0, 0.0), p(1.0, 1.0, 1.0), p(2.0, 1.0, 1.0)]));
        assert!(!cross(FLAT, [p(1.0, 1.0, 0.0), p(2.0, 1.0, 0.0), p(2.0, 1.0, 1.0)]));
        assert!(!cross(FLAT, [p(1.0, 0.0, 0.0), p(2.0, 0.0, 0.0), p(2.0, -1.0, 1.0)]));
        // A corner in its plane, the opposite edge through it: a line of points in common.
        assert!(cross(FLAT, [p(-1.0, 1.0, 0.0), p(1.0, 1.0, 1.0), p(1.0, 1.0, -1.0)]));
    }

    #[test]
    fn neighbours_cross_only_beyond_their_common_corners() {
        // Over a shared edge: folded to any angle, and folded flat onto itself.
        assert!(!cross(FLAT, [FLAT[0], FLAT[1], p(0.0, -4.0, 0.0)]));
        assert!(!cross(FLAT, [FLAT[0], FLAT[1], p(0.0, 4.0, 1e-300)]));
        assert!(cross(FLAT, [FLAT[0], FLAT[1], p(1.0, 3.0, 0.0)]));
        // At a shared corner: in one plane beside and upon each other, and through each other.
        assert!(!cross(FLAT, [FLAT[0], p(-4.0, 0.0, 0.0), p(0.0, -4.0, 0.0)]));
        assert!(cross(FLAT, [FLAT[0], p(1.0, 2.0, 0.0), p(2.0, 1.0, 0.0)]));
        assert!(cross(FLAT, [FLAT[0], p(1.0, 1.0, 1.0), p(1.0, 1.0, -1.0)]));
        assert!(!cross(FLAT, [FLAT[0], p(1.0, 1.0, 1.0), p(-3.0, 1.0, -1.0)]));
        assert!(cross(FLAT, FLAT));
    }

    #[test]
    fn neighbours_in_a_smooth_sheet_need_no_exact_test() {
        let around = |k: u32| (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
        let corner = |k: u32| p(around(k).1, around(k).0, 0.1 * around(2 * k).0);
        let [one, beside, next, opposite] = [0, 1, 2, 3].map(|k| [DVec3::ZERO, corner(k), corner(k + 1)]);
        assert!([beside, next, opposite].iter().all(|other| neighbours_apart(one, *other)));
        assert!(!neighbours_apart(one, [one[0], one[1], one[2] * 0.9]));
    }

    #[test]
    fn a_triangle_without_area_crosses_nothing_in_its_plane() {
        let thin = [p(1.0, 1.0, 0.0), p(2.0, 1.0, 0.0), p(3.0, 1.0, 0.0)];
        assert!(!cross(FLAT, thin) && !cross(thin, FLAT) && !cross(thin, thin));
        // Standing, it still pierces.
        assert!(cross(FLAT, [p(1.0, 1.0, -1.0), p(1.0, 1.0, 0.5), p(1.0, 1.0, 1.0)]));
    }

    proptest! {
        /// On small whole numbers degenerate cases are common; the answer must not depend on the order of anything.
        #[test]
        fn the_order_of_corners_does_not_matter(c in prop::array::uniform18(-2i8..3)) {
            let at = |k: usize| p(c[k].into(), c[k + 1].into(), c[k + 2].into());
            let (a, b) = ([at(0), at(3), at(6)], [at(9), at(12), at(15)]);
            let expected = cross(a, b);
            for order in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                prop_assert_eq!(cross(order.map(|k| a[k]), b), expected);
                prop_assert_eq!(cross(b, order.map(|k| a[k])), expected);
            }
        }

        /// The quick test for neighbours never contradicts the exact one, flat or folded.
        #[test]
        fn neighbours_accepted_without_the_exact_test_do_not_cross(
            c in prop::array::uniform12(-1.0..1.0f64), flat in prop::sample::select(vec![1.0, 1e-3, 1e-9, 1e-14, 0.0]),
        ) {
            let at = |k: usize| p(c[k], c[k + 1], flat * c[k + 2]);
            let spare = p(c[2], c[5], flat * c[8]);
            for (a, b) in [([at(0), at(3), at(6)], [at(3), at(0), at(9)]), ([at(0), at(3), at(6)], [spare, at(9), at(0)])] {
                if neighbours_apart(a, b) {
                    prop_assert!(!cross_exactly(a, b) && !cross_exactly(b, a));
                }
            }
        }

        /// Against sampling: a common point well inside both, found on a grid, is a crossing.
        #[test]
        fn disjoint_boxes_never_cross_and_a_shared_inner_point_always_does(
            c in prop::array::uniform12(-1.0..1.0f64), w in prop::array::uniform4(0.1..0.45f64),
        ) {
            let at = |k: usize| p(c[k], c[k + 1], c[k + 2]);
            let a = [at(0), at(3), at(6)];
            let shared = a[0] + w[0] * (a[1] - a[0]) + w[1] * (a[2] - a[0]);
            // A triangle through that point, two corners free.
            let (q, r) = (at(9), at(9).yzx() - 0.5);
            let s = (shared - w[2] * q - w[3] * r) / (1.0 - w[2] - w[3]);
            let area = (q - s).cross(r - s).length().min((a[1] - a[0]).cross(a[2] - a[0]).length());
            prop_assume!(area > 1e-3);
            prop_assert!(cross(a, [q, r, s]));
            let beyond = DVec3::X * (1.0 + 2.0 * a.iter().chain(&[q, r, s]).map(|p| p.length()).fold(0.0, f64::max));
            prop_assert!(!cross(a, [q + beyond, r + beyond, s + beyond]));
        }
    }
}
