//! A bounding volume hierarchy over the triangles of a surface, four wide, that finds the triangle nearest to a point.
//!
//! Every node has four boxes, every leaf four triangles, so that a SIMD register holds one number of each: the squared
//! distances of a point to four boxes, or to four triangles, take one pass of the same operations. Nodes are split twice
//! along the longest side of the box around their triangles' centroids, which leaves all leaves full but the last.
//!
//! The squared distance from p to the triangle a, a + u, a + w is the one to its plane, (n·(p − a))²/n² with n = u × w, where
//! p projects into it, and otherwise the least of the squared distances to its three sides. The result depends on the point
//! alone: of equal squares the lower triangle index wins, independent of earlier queries.
//!
//! parry3d's own search took a quarter of a drape's time; this one takes half as long (`benches/stages.rs` measures both),
//! because it tests four at a time and starts at a triangle that is near. The point on the triangle and its pseudo-normals
//! are still parry's.
//!
//! Limits: at most 2³¹ triangles; points must be finite. A triangle with a corner of less than some millionths of a radian
//! counts by its sides alone; no point of it is farther from them than that share of its length.

use glam::DVec3;

use crate::base::simd::{Four, Lanes, Pack, Vectors, Work, run};
use crate::mesh::{TriMesh, box_about};

/// Boxes of a node, and triangles of a leaf.
const WIDTH: usize = 4;

/// Bit that marks a child's index as a leaf; without it the child is a node.
const LEAF: u32 = 1 << 31;

/// Squared sine of a corner below which a triangle counts by its sides alone: for a point a hundred sides away rounding
/// decides whether it projects into the triangle.
const THIN: f64 = 1e-11;

/// Four boxes and their children.
#[derive(Debug, Clone)]
struct Node {
    low: [Four; 3],
    high: [Four; 3],
    children: [u32; WIDTH],
}

/// Four triangles: a corner a, the sides u and w from it, and reciprocals that save divisions.
#[derive(Debug, Clone)]
struct Leaf {
    a: [Four; 3],
    u: [Four; 3],
    w: [Four; 3],
    /// 1/u², 1/w², 1/(w − u)²; zero for a side without length.
    per_side: [Four; 3],
    /// 1/n²; negative for a triangle with almost no area, into which no point projects.
    per_area: Four,
    /// Their indices; the last is repeated where there are fewer than four.
    triangles: [u32; WIDTH],
}

/// The hierarchy.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// The leaf of each triangle.
    leaf_of: Vec<u32>,
}

/// A triangle and the square of the distance to it, m².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    pub(super) square: f64,
    pub(super) triangle: u32,
}

impl Nearest {
    /// Whether this triangle is nearer, or as near with a lower index.
    fn comes_before(self, other: Self) -> bool {
        self.square < other.square || self.square == other.square && self.triangle < other.triangle
    }
}

impl Tree {
    /// Builds the hierarchy over a mesh with at least one triangle.
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let corners = |t: u32| mesh.triangles[t as usize].map(|v| mesh.positions[v as usize]);
        let centroids: Vec<DVec3> =
            (0..mesh.triangles.len() as u32).map(|t| corners(t).iter().sum::<DVec3>()).collect();
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let leaves = Vec::with_capacity(order.len().div_ceil(WIDTH));
        let mut tree = Self { nodes: Vec::new(), leaves, leaf_of: vec![0; order.len()] };
        if order.len() <= WIDTH {
            // The root is a node.
            let child = tree.leaf(&order, &corners);
            tree.nodes.push(Node::of(&[child]));
        } else {
            tree.node(&mut order, &centroids, &corners);
        }
        tree
    }

    /// Adds a node over these triangles and all below it; the root is node 0.
    fn node(&mut self, order: &mut [u32], centroids: &[DVec3], corners: &impl Fn(u32) -> [DVec3; 3]) -> Child {
        let number = self.nodes.len();
        self.nodes.push(Node::of(&[]));
        let (left, right) = halves(order, centroids);
        let mut children = Vec::with_capacity(WIDTH);
        for half in [left, right] {
            let quarters = if half.len() > WIDTH { halves(half, centroids) } else { (half, &mut [][..]) };
            for quarter in [quarters.0, quarters.1] {
                match quarter.len() {
                    0 => {}
                    1..=WIDTH => children.push(self.leaf(quarter, corners)),
                    _ => children.push(self.node(quarter, centroids, corners)),
                }
            }
        }
        self.nodes[number] = Node::of(&children);
        let (low, high) = box_about(children.iter().flat_map(|child| [child.low, child.high]));
        Child { low, high, number: number as u32 }
    }

    fn leaf(&mut self, triangles: &[u32], corners: &impl Fn(u32) -> [DVec3; 3]) -> Child {
        let number = self.leaves.len() as u32;
        let mut leaf = Leaf {
            a: [Four::ZERO; 3],
            u: [Four::ZERO; 3],
            w: [Four::ZERO; 3],
            per_side: [Four::ZERO; 3],
            per_area: Four::ZERO,
            triangles: [0; WIDTH],
        };
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for i in 0..WIDTH {
            let triangle = triangles[i.min(triangles.len() - 1)];
            let [a, b, c] = corners(triangle);
            (low, high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            let (u, w) = (b - a, c - a);
            for axis in 0..3 {
                (leaf.a[axis].0[i], leaf.u[axis].0[i], leaf.w[axis].0[i]) = (a[axis], u[axis], w[axis]);
            }
            let per = |square: f64, none: f64| if (1.0 / square).is_finite() { 1.0 / square } else { none };
            for (slot, side) in leaf.per_side.iter_mut().zip([u, w, w - u]) {
                slot.0[i] = per(side.length_squared(), 0.0);
            }
            let area = u.cross(w).length_squared();
            let thin = area <= THIN * u.length_squared() * w.length_squared();
            leaf.per_area.0[i] = if thin { -1.0 } else { per(area, -1.0) };
            leaf.triangles[i] = triangle;
            self.leaf_of[triangle as usize] = number;
        }
        self.leaves.push(leaf);
        Child { low, high, number: number | LEAF }
    }

    /// The triangle nearest to each point. Each search starts at the result of the one before, so consecutive points should be
    /// near each other.
    pub(super) fn nearest(&self, points: &[DVec3]) -> Vec<Nearest> {
        self.nearest_from(points, &[])
    }

    /// The same, where each search starts at a triangle of `hints`; any number is a hint, and a bad one takes time alone.
    pub(super) fn nearest_from(&self, points: &[DVec3], hints: &[u32]) -> Vec<Nearest> {
        run(Search { tree: self, points, hints })
    }

    /// The triangle of the least `square`, the squared distance from `p` to a triangle, m²: for slivers, whose distance
    /// [`nearest`](Self::nearest) does not resolve.
    pub(super) fn nearest_by(&self, p: DVec3, square: impl Fn(u32) -> f64) -> u32 {
        let mut best = Nearest { square: f64::INFINITY, triangle: 0 };
        let mut open = vec![(0.0, 0)];
        while let Some((least, number)) = open.pop() {
            if least * ROUNDED > best.square {
                continue;
            }
            if number & LEAF != 0 {
                for triangle in self.leaves[(number & !LEAF) as usize].triangles {
                    let this = Nearest { square: square(triangle), triangle };
                    if this.comes_before(best) {
                        best = this;
                    }
                }
                continue;
            }
            let node = &self.nodes[number as usize];
            let first = open.len();
            for (i, &child) in node.children.iter().enumerate() {
                let [low, high] = [node.low, node.high].map(|corner| DVec3::from_array(corner.map(|axis| axis.0[i])));
                let to_box = (low - p).max(p - high).max(DVec3::ZERO).length_squared();
                if to_box < f64::INFINITY {
                    open.push((to_box, child));
                }
            }
            // The nearest child is popped first.
            open[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
        best.triangle
    }
}

/// Splits the triangles into two halves of whole leaves.
fn halves<'a>(order: &'a mut [u32], centroids: &[DVec3]) -> (&'a mut [u32], &'a mut [u32]) {
    let (low, high) = box_about(order.iter().map(|&t| centroids[t as usize]));
    let extent = high - low;
    let axis = (0..3).fold(0, |most, axis| if extent[axis] > extent[most] { axis } else { most });
    let half = WIDTH * order.len().div_ceil(WIDTH).div_ceil(2);
    let along = |t: &u32| centroids[*t as usize][axis];
    if half < order.len() {
        order.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    }
    let at = half.min(order.len());
    order.split_at_mut(at)
}

/// A node or a leaf, and the box about it.
#[derive(Debug, Clone, Copy)]
struct Child {
    low: DVec3,
    high: DVec3,
    number: u32,
}

impl Node {
    fn of(children: &[Child]) -> Self {
        // An empty slot is infinitely far.
        let mut node =
            Self { low: [Four([f64::INFINITY; 4]); 3], high: [Four([f64::NEG_INFINITY; 4]); 3], children: [0; WIDTH] };
        for (i, child) in children.iter().enumerate() {
            for axis in 0..3 {
                (node.low[axis].0[i], node.high[axis].0[i]) = (child.low[axis], child.high[axis]);
            }
            node.children[i] = child.number;
        }
        node
    }
}

/// Less than 1 by more than the relative rounding error of a squared distance.
const ROUNDED: f64 = 1.0 - 1e-12;

/// The triangles nearest to points that follow each other.
pub(super) struct Search<'a> {
    pub(super) tree: &'a Tree,
    pub(super) points: &'a [DVec3],
    /// A triangle to start from for each point, or none.
    pub(super) hints: &'a [u32],
}

impl Work for Search<'_> {
    type Output = Vec<Nearest>;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> Vec<Nearest> {
        let Tree { nodes, leaves, leaf_of } = self.tree;
        let mut found: Vec<Nearest> = Vec::with_capacity(self.points.len());
        let mut open: Vec<(f64, u32)> = Vec::new();
        for (i, &p) in self.points.iter().enumerate() {
            if !p.is_finite() {
                // Nothing is near it. Empty slots of a node would be as near as any other and lead back to the root.
                found.push(Nearest { square: f64::INFINITY, triangle: 0 });
                continue;
            }
            let p = Vectors { x: Pack::splat(l, p.x), y: Pack::splat(l, p.y), z: Pack::splat(l, p.z) };
            let hint = self.hints.get(i).copied().filter(|hint| (*hint as usize) < leaf_of.len());
            let near = hint.unwrap_or_else(|| found.last().map_or(0, |before| before.triangle));
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
                // The nearest child is popped first.
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

/// Squared distances to the boxes of a node.
#[inline(always)]
fn boxes<L: Lanes>(l: L, node: &Node, p: Vectors<L>) -> Pack<L> {
    let zero = Pack::splat(l, 0.0);
    let (below, above) = (Vectors::load(l, &node.low) - p, p - Vectors::load(l, &node.high));
    let x = below.x.max(above.x).max(zero);
    let y = below.y.max(above.y).max(zero);
    let z = below.z.max(above.z).max(zero);
    x * x + y * y + z * z
}

/// Updates `best` by the triangles of a leaf.
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

/// Squared distances to the triangles of a leaf.
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
    // To the plane, where all three barycentric coordinates of the projection are positive.
    let (second, third) = (ww * qu - uw * qw, uu * qw - uw * qu);
    let first = uu * ww - uw * uw - second - third;
    let per_area = Pack::load(l, &leaf.per_area);
    let over = least(least(first, second), least(third, per_area));
    let height = q.x * (u.y * w.z - u.z * w.y) + q.y * (u.z * w.x - u.x * w.z) + q.z * (u.x * w.y - u.y * w.x);
    over.if_negative(sides, height * height * per_area)
}

/// Clamps to 0..=1.
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

    #[test]
    fn a_point_that_is_no_number_ends_the_search() {
        // Five triangles leave slots of the root empty.
        let mut mesh = ball(3, 4, 0.0);
        mesh.triangles.truncate(5);
        let points = [DVec3::NAN, DVec3::X, DVec3::new(0.0, f64::INFINITY, 0.0)];
        let found = Tree::new(&mesh).nearest(&points);
        assert!([0, 2].map(|i| found[i].square) == [f64::INFINITY; 2]);
        assert!((found[1].square.sqrt() - by_brute_force(&mesh, DVec3::X)).abs() < 1e-12);
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
        fn the_found_triangle_is_the_nearest_by_brute_force(
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
            // The result does not depend on earlier queries.
            let backwards: Vec<DVec3> = points.iter().rev().copied().collect();
            prop_assert!(tree.nearest(&backwards).iter().eq(found.iter().rev()));
            prop_assert!(points.iter().zip(&found).all(|(p, near)| tree.nearest(&[*p])[0] == *near));
            let hints: Vec<u32> = (0..points.len() as u32).map(|i| i * 7919 % (mesh.triangles.len() as u32 + 3)).collect();
            prop_assert_eq!(tree.nearest_from(&points, &hints), found);
        }
    }

    #[test]
    fn a_single_triangle_and_triangles_without_area_are_found() {
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
