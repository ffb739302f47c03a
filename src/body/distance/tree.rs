//! A hierarchy of boxes over the triangles of a surface, four by four, to find the one that is nearest to a point.
//!
//! Every node has four boxes, every leaf four triangles, so that a register holds one number of each: the squares of a point's
//! distances to four boxes, or to four triangles, are one pass of the same few operations. Nodes are halved twice along the
//! longest side of their triangles' middles, which leaves all leaves full but the last.
//!
//! The square of the distance from p to the triangle a, a + u, a + w is that to its plane, (n·(p − a))²/n² with n = u × w, where
//! p lies over it, and otherwise the least of those to its three sides. Which triangle is found depends on the point alone:
//! of equal squares the first triangle's counts, whatever was looked at before.
//!
//! A quarter of a drape's time went into closest points by parry3d's own search; this one takes half as long (`benches/stages.rs` has
//! both), since it looks at four at a time and begins with a triangle that is near. The point on the triangle and its
//! pseudo-normals are parry's still.
//!
//! Limits: surfaces of up to 2³¹ triangles; points must be finite. A sliver with a corner of less than some millionths counts by its sides
//! alone, from which no point of it is farther than that share of its length.

mod search;

use glam::DVec3;

use search::Search;

use crate::base::simd::{Four, run};
use crate::mesh::{TriMesh, box_about};

/// Boxes of a node, triangles of a leaf.
const WIDE: usize = 4;

/// Set in the number of a leaf; a child without it is a node.
const LEAF: u32 = 1 << 31;

/// Square of the sine of a corner under which a triangle is all sides: of a point a hundred sides away rounding tells no better where over
/// it that lies.
const THIN: f64 = 1e-11;

/// Four boxes and what is in them.
#[derive(Debug, Clone)]
struct Node {
    low: [Four; 3],
    high: [Four; 3],
    children: [u32; WIDE],
}

/// Four triangles: a corner a, the sides u and w from it, and what of them would cost a division.
#[derive(Debug, Clone)]
struct Leaf {
    a: [Four; 3],
    u: [Four; 3],
    w: [Four; 3],
    /// 1/u², 1/w², 1/(w − u)²; zero for a side without length.
    per_side: [Four; 3],
    /// 1/n²; negative for a triangle next to without area, over which nothing lies.
    per_area: Four,
    /// Which they are; the last repeated where there are fewer.
    triangles: [u32; WIDE],
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
    /// Nearer, or as near and before.
    fn comes_before(self, other: Self) -> bool {
        self.square < other.square || self.square == other.square && self.triangle < other.triangle
    }
}

impl Tree {
    /// Over all triangles of a mesh that has some.
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let corners = |t: u32| mesh.triangles[t as usize].map(|v| mesh.positions[v as usize]);
        let middles: Vec<DVec3> = (0..mesh.triangles.len() as u32).map(|t| corners(t).iter().sum::<DVec3>()).collect();
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let mut tree = Self { nodes: Vec::new(), leaves: Vec::new(), leaf_of: vec![0; order.len()] };
        if order.len() <= WIDE {
            // The root is a node.
            let child = tree.leaf(&order, &corners);
            tree.nodes.push(Node::of(&[child]));
        } else {
            tree.node(&mut order, &middles, &corners);
        }
        tree
    }

    /// Adds a node over these triangles and all below it; the root is node 0.
    fn node(&mut self, order: &mut [u32], middles: &[DVec3], corners: &impl Fn(u32) -> [DVec3; 3]) -> Child {
        let number = self.nodes.len();
        self.nodes.push(Node::of(&[]));
        let (left, right) = halves(order, middles);
        let mut children = Vec::with_capacity(WIDE);
        for half in [left, right] {
            let quarters = if half.len() > WIDE { halves(half, middles) } else { (half, &mut [][..]) };
            for quarter in [quarters.0, quarters.1] {
                match quarter.len() {
                    0 => {}
                    1..=WIDE => children.push(self.leaf(quarter, corners)),
                    _ => children.push(self.node(quarter, middles, corners)),
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
            triangles: [0; WIDE],
        };
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for i in 0..WIDE {
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

    /// The triangle nearest to each point. Points that follow each other had better be near each other: each search begins where the one
    /// before ended.
    pub(super) fn nearest(&self, points: &[DVec3]) -> Vec<Nearest> {
        run(Search { tree: self, points })
    }
}

/// Half of the triangles and the other half, whole leaves but the last.
fn halves<'a>(order: &'a mut [u32], middles: &[DVec3]) -> (&'a mut [u32], &'a mut [u32]) {
    let (low, high) = box_about(order.iter().map(|&t| middles[t as usize]));
    let extent = high - low;
    let axis = (0..3).fold(0, |most, axis| if extent[axis] > extent[most] { axis } else { most });
    let half = WIDE * order.len().div_ceil(WIDE).div_ceil(2);
    let along = |t: &u32| middles[*t as usize][axis];
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
        // A place without a box is infinitely far.
        let mut node =
            Self { low: [Four([f64::INFINITY; 4]); 3], high: [Four([f64::NEG_INFINITY; 4]); 3], children: [0; WIDE] };
        for (i, child) in children.iter().enumerate() {
            for axis in 0..3 {
                (node.low[axis].0[i], node.high[axis].0[i]) = (child.low[axis], child.high[axis]);
            }
            node.children[i] = child.number;
        }
        node
    }
}
