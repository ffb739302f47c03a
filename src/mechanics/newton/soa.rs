//! Vectors and matrices of all vertices as L-BFGS has them, for lanes of four.
//!
//! A [`Flat`] holds the coordinates of all vertices one after the other and zeros behind, in whole groups of sixteen vertices;
//! [`Blocks`] hold their matrices entry by entry, four vertices together.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::base::pool::VERTICES_PER_TASK;
use crate::base::simd::{Four, Lanes, Pack, Vectors};

/// Fours of a group: sixteen vertices, four registers a vector of four vertices.
const GROUP: usize = 12;

/// Fours of a stretch: of [`VERTICES_PER_TASK`], which are whole groups.
pub(super) const STRETCH: usize = VERTICES_PER_TASK / 16 * GROUP;

/// Coordinates of all vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Flat(pub(super) Vec<Four>);

impl Flat {
    /// Minus these vectors.
    pub(super) fn set_opposite(&mut self, vectors: &[DVec3]) {
        self.0.resize(vectors.len().div_ceil(16) * GROUP, Four::ZERO);
        let stretches = self.0.par_chunks_mut(STRETCH).zip(vectors.par_chunks(VERTICES_PER_TASK));
        stretches.for_each(|(to, vectors)| set_opposite(to, vectors));
    }

    /// x + t times these, for as many vertices as x has.
    pub(super) fn added_to(&self, x: &[DVec3], t: f64, out: &mut Vec<DVec3>) {
        out.resize(x.len(), DVec3::ZERO);
        let ends = out.par_chunks_mut(VERTICES_PER_TASK).zip(x.par_chunks(VERTICES_PER_TASK));
        ends.zip(self.0.par_chunks(STRETCH)).for_each(|((to, from), d)| add(from, t, d, to));
    }
}

fn set_opposite(to: &mut [Four], vectors: &[DVec3]) {
    let (fours, rest) = vectors.as_chunks::<4>();
    let (groups, _) = to.as_chunks_mut::<3>();
    for (group, four) in groups.iter_mut().zip(fours) {
        *group = opposite(four);
    }
    if !rest.is_empty() {
        let at = |i: usize| rest.get(i).copied().unwrap_or_default();
        groups[fours.len()] = opposite(&[at(0), at(1), at(2), at(3)]);
    }
}

/// x + t d.
fn add(x: &[DVec3], t: f64, d: &[Four], out: &mut [DVec3]) {
    let (groups, _) = d.as_chunks::<3>();
    let ((fours, rest), (x_fours, x_rest)) = (out.as_chunks_mut::<4>(), x.as_chunks::<4>());
    for ((to, from), group) in fours.iter_mut().zip(x_fours).zip(groups) {
        *to = moved(from, t, group);
    }
    if !rest.is_empty() {
        let at = |i: usize| x_rest.get(i).copied().unwrap_or_default();
        let last = moved(&[at(0), at(1), at(2), at(3)], t, &groups[x_fours.len()]);
        rest.copy_from_slice(&last[..x_rest.len()]);
    }
}

/// Minus these.
#[inline]
fn opposite([a, b, c, d]: &[DVec3; 4]) -> [Four; 3] {
    [Four([-a.x, -a.y, -a.z, -b.x]), Four([-b.y, -b.z, -c.x, -c.y]), Four([-c.z, -d.x, -d.y, -d.z])]
}

/// x + t d.
#[inline]
fn moved([p, q, r, s]: &[DVec3; 4], t: f64, [Four(a), Four(b), Four(c)]: &[Four; 3]) -> [DVec3; 4] {
    [
        *p + DVec3::new(a[0], a[1], a[2]) * t,
        *q + DVec3::new(a[3], b[0], b[1]) * t,
        *r + DVec3::new(b[2], b[3], c[0]) * t,
        *s + DVec3::new(c[1], c[2], c[3]) * t,
    ]
}

/// A symmetric 3×3 matrix for each vertex, by fours of vertices: xx, yy, zz, xy, xz, yz.
#[derive(Debug, Default)]
pub(super) struct Blocks(pub(super) Vec<[Four; 6]>);

impl Blocks {
    /// Sets the blocks of this number of vertices to zero.
    pub(super) fn clear(&mut self, vertices: usize) {
        self.0.clear();
        self.0.resize(vertices.div_ceil(16) * 4, [Four::ZERO; 6]);
    }

    /// That of a vertex.
    pub(super) fn get(&self, vertex: usize) -> DMat3 {
        let [xx, yy, zz, xy, xz, yz] = self.0[vertex / 4].map(|four| four.0[vertex % 4]);
        DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
    }

    /// Sets that of a vertex, of which the upper half is taken.
    pub(super) fn set(&mut self, vertex: usize, m: DMat3) {
        let entries = [m.x_axis.x, m.y_axis.y, m.z_axis.z, m.y_axis.x, m.z_axis.x, m.z_axis.y];
        for (four, entry) in self.0[vertex / 4].iter_mut().zip(entries) {
            four.0[vertex % 4] = entry;
        }
    }

    /// Those of four vertices times their vectors.
    #[inline(always)]
    pub(super) fn times<L: Lanes>(l: L, block: &[Four; 6], v: Vectors<L>) -> Vectors<L> {
        let [xx, yy, zz] = [Pack::load(l, &block[0]), Pack::load(l, &block[1]), Pack::load(l, &block[2])];
        let [xy, xz, yz] = [Pack::load(l, &block[3]), Pack::load(l, &block[4]), Pack::load(l, &block[5])];
        Vectors {
            x: xx * v.x + xy * v.y + xz * v.z,
            y: xy * v.x + yy * v.y + yz * v.z,
            z: xz * v.x + yz * v.y + zz * v.z,
        }
    }
}
