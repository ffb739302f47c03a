//! Down the hierarchy: to four boxes, or four triangles, at a time.

use glam::DVec3;

use super::{LEAF, Leaf, Nearest, Node, Tree};
use crate::base::simd::{Four, Lanes, Pack, Vectors, Work};

/// Below 1 by more than the square of a distance is rounded.
const ROUNDED: f64 = 1.0 - 1e-12;

/// The triangles nearest to points that follow each other.
pub(super) struct Search<'a> {
    pub(super) tree: &'a Tree,
    pub(super) points: &'a [DVec3],
}

impl Work for Search<'_> {
    type Output = Vec<Nearest>;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> Vec<Nearest> {
        let Tree { nodes, leaves, leaf_of } = self.tree;
        let mut found: Vec<Nearest> = Vec::with_capacity(self.points.len());
        let mut open: Vec<(f64, u32)> = Vec::new();
        for &p in self.points {
            let p = Vectors { x: Pack::splat(l, p.x), y: Pack::splat(l, p.y), z: Pack::splat(l, p.z) };
            let near = found.last().map_or(0, |before| before.triangle);
            let mut best = Nearest { square: f64::INFINITY, triangle: near };
            nearest_of(l, &leaves[leaf_of[near as usize] as usize], p, &mut best);
            open.push((0.0, 0));
            while let Some((square, number)) = open.pop() {
                if square * ROUNDED > best.square {
                    continue;
                }
                if number & LEAF != 0 {
                    nearest_of(l, &leaves[(number & !LEAF) as usize], p, &mut best);
                    continue;
                }
                let node = &nodes[number as usize];
                let Four(squares) = boxes(l, node, p).store();
                // The nearest comes out first.
                let first = open.len();
                for (square, child) in squares.into_iter().zip(node.children) {
                    if square * ROUNDED <= best.square && square < f64::INFINITY {
                        open.push((square, child));
                        let mut at = open.len() - 1;
                        while at > first && open[at - 1].0 < square {
                            open.swap(at - 1, at);
                            at -= 1;
                        }
                    }
                }
            }
            found.push(best);
        }
        found
    }
}

/// Squares of the distances to the boxes of a node.
#[inline(always)]
fn boxes<L: Lanes>(l: L, node: &Node, p: Vectors<L>) -> Pack<L> {
    let zero = Pack::splat(l, 0.0);
    let (below, above) = (Vectors::load(l, &node.low) - p, p - Vectors::load(l, &node.high));
    let x = below.x.max(above.x).max(zero);
    let y = below.y.max(above.y).max(zero);
    let z = below.z.max(above.z).max(zero);
    x * x + y * y + z * z
}

/// Takes a triangle of the leaf where it is nearer.
#[inline(always)]
fn nearest_of<L: Lanes>(l: L, leaf: &Leaf, p: Vectors<L>, best: &mut Nearest) {
    let Four(squares) = triangles(l, leaf, p).store();
    for (square, triangle) in squares.into_iter().zip(leaf.triangles) {
        let this = Nearest { square, triangle };
        if this.comes_before(*best) {
            *best = this;
        }
    }
}

/// Squares of the distances to the triangles of a leaf.
#[inline(always)]
fn triangles<L: Lanes>(l: L, leaf: &Leaf, p: Vectors<L>) -> Pack<L> {
    let (u, w) = (Vectors::load(l, &leaf.u), Vectors::load(l, &leaf.w));
    let q = p - Vectors::load(l, &leaf.a);
    let (uu, uw, ww, qu, qw) = (u.dot(u), u.dot(w), w.dot(w), q.dot(u), q.dot(w));
    // To the sides.
    let v = w - u;
    let along_u = unit(l, qu * Pack::load(l, &leaf.per_side[0]));
    let along_w = unit(l, qw * Pack::load(l, &leaf.per_side[1]));
    let along_v = unit(l, (qw - qu - uw + uu) * Pack::load(l, &leaf.per_side[2]));
    let [to_u, to_w, to_v] = [q - u * along_u, q - w * along_w, q - u - v * along_v];
    let sides = least(least(to_u.dot(to_u), to_w.dot(to_w)), to_v.dot(to_v));
    // To the plane, where all three coordinates of the point below are positive.
    let (second, third) = (ww * qu - uw * qw, uu * qw - uw * qu);
    let first = uu * ww - uw * uw - second - third;
    let per_area = Pack::load(l, &leaf.per_area);
    let over = least(least(first, second), least(third, per_area));
    let height = q.x * (u.y * w.z - u.z * w.y) + q.y * (u.z * w.x - u.x * w.z) + q.z * (u.x * w.y - u.y * w.x);
    over.if_negative(sides, height * height * per_area)
}

/// Between 0 and 1.
#[inline(always)]
fn unit<L: Lanes>(l: L, t: Pack<L>) -> Pack<L> {
    let (zero, one) = (Pack::splat(l, 0.0), Pack::splat(l, 1.0));
    least(t.max(zero), one)
}

/// The lesser of both.
#[inline(always)]
fn least<L: Lanes>(a: Pack<L>, b: Pack<L>) -> Pack<L> {
    (a - b).if_negative(a, b)
}

#[cfg(test)]
mod tests {
    use parry3d_f64::query::PointQuery;
    use parry3d_f64::shape::{Segment, Triangle};
    use proptest::prelude::*;

    use super::super::Tree;
    use super::*;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::tube;

    /// A ball of `rings` by `around` quads, dented; the pole's triangles are slivers where there are many.
    fn ball(rings: u32, around: u32, dent: f64) -> TriMesh {
        tube(around, rings, |angle, ring| {
            let (s, c) = (std::f64::consts::PI * (1.0 - ring / f64::from(rings))).sin_cos();
            let (y, x) = angle.sin_cos();
            DVec3::new(s * x, s * y, c) * (0.3 + dent * (7.0 * c + 3.0 * x).sin())
        })
    }

    fn by_brute_force(mesh: &TriMesh, p: DVec3) -> f64 {
        mesh.triangles
            .iter()
            .map(|t| to_triangle(t.map(|v| mesh.positions[v as usize]), p))
            .fold(f64::INFINITY, f64::min)
    }

    /// By parry3d, of whose points on a triangle without area those on its sides count.
    fn to_triangle([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
        let sides = [[a, b], [b, c], [c, a]].map(|[a, b]| Segment::new(a, b).distance_to_local_point(p, false));
        let over = Triangle::new(a, b, c).project_local_point(p, false).point.distance(p);
        let flat = (b - a).cross(c - a).length() <= 1e-12;
        sides.into_iter().fold(if flat { f64::INFINITY } else { over }, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn nothing_is_nearer_than_what_is_found(
            rings in 2u32..24,
            around in 3u32..40,
            dent in 0.0..0.1f64,
            directions in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), 20),
            scale in prop::sample::select(vec![1e-7, 0.02, 0.3, 0.35, 2.0]),
        ) {
            let mesh = ball(rings, around, dent);
            let tree = Tree::new(&mesh);
            let points: Vec<DVec3> = directions.into_iter().map(|(x, y, z)| DVec3::new(x, y, z) * scale).collect();
            let found = tree.nearest(&points);
            for (p, near) in points.iter().zip(&found) {
                let corners = mesh.triangles[near.triangle as usize].map(|v| mesh.positions[v as usize]);
                let distance = to_triangle(corners, *p);
                let least = by_brute_force(&mesh, *p);
                prop_assert!((distance - least).abs() <= 1e-12, "{p}: {distance} and {least}");
                prop_assert!((near.square.sqrt() - least).abs() <= 1e-9);
            }
            // The same triangles whatever was asked before.
            let backwards: Vec<DVec3> = points.iter().rev().copied().collect();
            prop_assert!(tree.nearest(&backwards).iter().eq(found.iter().rev()));
            prop_assert!(points.iter().zip(&found).all(|(p, near)| tree.nearest(&[*p])[0] == *near));
        }
    }

    #[test]
    fn a_triangle_alone_and_what_has_no_area_are_found() {
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(2.0, 0.0, 0.0), DVec3::Z * 5.0];
        for triangles in [vec![[0, 1, 2]], vec![[0, 1, 3]], vec![[4, 4, 4], [0, 1, 3], [0, 1, 2]]] {
            let mesh = TriMesh::new(corners.clone(), triangles);
            let tree = Tree::new(&mesh);
            for p in [DVec3::new(0.2, 0.2, 1.0), DVec3::new(3.0, 0.1, 0.0), DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO] {
                let near = tree.nearest(&[p])[0];
                assert!((near.square.sqrt() - by_brute_force(&mesh, p)).abs() < 1e-12, "{p}: {near:?}");
            }
        }
    }
}
