//! The sums of L-BFGS over all coordinates, in lanes: each passes over memory once, for that is what they wait for.
//!
//! A [`Flat`] holds the coordinates of all vertices one after the other and zeros behind, in whole groups of sixteen vertices. Sums
//! go in four registers that do not wait for each other, in an order that depends on the length alone.

use glam::{DMat3, DVec3};

use crate::mechanics::lanes::{Four, Lanes, Pack, Vectors, Work, run};

/// Fours of a group: sixteen vertices, four registers a vector of four vertices.
const GROUP: usize = 12;

/// Coordinates of all vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Flat(Vec<Four>);

impl Flat {
    /// Minus these vectors.
    pub(super) fn set_opposite(&mut self, vectors: &[DVec3]) {
        self.0.resize(vectors.len().div_ceil(16) * GROUP, Four::ZERO);
        let (fours, rest) = vectors.as_chunks::<4>();
        let (groups, _) = self.0.as_chunks_mut::<3>();
        for (group, four) in groups.iter_mut().zip(fours) {
            *group = opposite(four);
        }
        if !rest.is_empty() {
            let at = |i: usize| rest.get(i).copied().unwrap_or_default();
            groups[fours.len()] = opposite(&[at(0), at(1), at(2), at(3)]);
        }
    }

    /// x + t times these, for as many vertices as x has.
    pub(super) fn added_to(&self, x: &[DVec3], t: f64, out: &mut Vec<DVec3>) {
        out.resize(x.len(), DVec3::ZERO);
        let (groups, _) = self.0.as_chunks::<3>();
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
pub(super) struct Blocks(Vec<[Four; 6]>);

impl Blocks {
    /// Zero for so many vertices.
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

    #[inline(always)]
    fn times<L: Lanes>(l: L, block: &[Four; 6], v: Vectors<L>) -> Vectors<L> {
        let [xx, yy, zz] = [Pack::load(l, &block[0]), Pack::load(l, &block[1]), Pack::load(l, &block[2])];
        let [xy, xz, yz] = [Pack::load(l, &block[3]), Pack::load(l, &block[4]), Pack::load(l, &block[5])];
        Vectors {
            x: xx * v.x + xy * v.y + xz * v.z,
            y: xy * v.x + yy * v.y + yz * v.z,
            z: xz * v.x + yz * v.y + zz * v.z,
        }
    }
}

/// A pair of L-BFGS: s and y, and 1 / sᵀy, 1/J.
#[derive(Debug, Default)]
pub(super) struct Pair {
    pub(super) s: Flat,
    pub(super) y: Flat,
    pub(super) rho: f64,
}

/// Pairs kept at most.
pub(super) const MEMORY: usize = 6;

/// Turns `down` = −∇E into the direction: the two loops of L-BFGS. Returns the slope along it, dᵀ∇E (J), and its longest move (m).
pub(super) fn turn(pairs: &[Pair], inverse: &Blocks, scale: f64, down: &Flat, direction: &mut Flat) -> [f64; 2] {
    run(Turn { pairs, inverse, scale, down, direction })
}

struct Turn<'a> {
    pairs: &'a [Pair],
    inverse: &'a Blocks,
    scale: f64,
    down: &'a Flat,
    direction: &'a mut Flat,
}

impl Work for Turn<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> [f64; 2] {
        let Self { pairs, inverse, scale, down: Flat(down), direction: Flat(d) } = self;
        d.clear();
        d.extend_from_slice(down);
        let mut shares = [0.0; MEMORY];
        // Each pass subtracts one pair and multiplies with the next.
        if let [.., last] = pairs {
            let mut product = dot(l, d, &last.s.0);
            for k in (0..pairs.len()).rev() {
                shares[k] = pairs[k].rho * product;
                let next = if k > 0 { &pairs[k - 1].s.0 } else { down };
                product = add_and_dot(l, d, -shares[k], &pairs[k].y.0, next);
            }
        }
        precondition(l, d, inverse, scale);
        if let [first, ..] = pairs {
            let mut product = dot(l, d, &first.y.0);
            for (k, pair) in pairs.iter().enumerate() {
                let back = pair.rho * product;
                let next = pairs.get(k + 1).map_or(down, |next| &next.y.0);
                product = add_and_dot(l, d, shares[k] - back, &pair.s.0, next);
            }
            [-product, longest(l, d)]
        } else {
            [-dot(l, d, down), longest(l, d)]
        }
    }
}

/// Makes the pair of a move by t times `s`, from where −∇E was `before` to where it is `after`: s becomes t s. Returns sᵀy and
/// yᵀ D⁻¹ y, J.
pub(super) fn difference(pair: &mut Pair, t: f64, before: &Flat, after: &Flat, inverse: &Blocks) -> [f64; 2] {
    run(Difference { pair, t, before, after, inverse })
}

struct Difference<'a> {
    pair: &'a mut Pair,
    t: f64,
    before: &'a Flat,
    after: &'a Flat,
    inverse: &'a Blocks,
}

impl Work for Difference<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> [f64; 2] {
        let Self { pair, t, before: Flat(before), after: Flat(after), inverse } = self;
        let (s, y) = (&mut pair.s.0, &mut pair.y.0);
        y.resize(s.len(), Four::ZERO);
        let t = Pack::splat(l, t);
        let (mut curvature, mut scaled) = (Pack::splat(l, 0.0), Pack::splat(l, 0.0));
        let (s, y) = (s.as_chunks_mut::<3>().0.iter_mut(), y.as_chunks_mut::<3>().0.iter_mut());
        let ends = before.as_chunks::<3>().0.iter().zip(after.as_chunks::<3>().0);
        for (((s, y), (before, after)), block) in s.zip(y).zip(ends).zip(&inverse.0) {
            for i in 0..3 {
                let move_by = t * Pack::load(l, &s[i]);
                let change = Pack::load(l, &before[i]) - Pack::load(l, &after[i]);
                curvature = curvature + move_by * change;
                (s[i], y[i]) = (move_by.store(), change.store());
            }
            let change = Vectors::from_flat(l, y);
            scaled = scaled + change.dot(Blocks::times(l, block, change));
        }
        [curvature.sum(), scaled.sum()]
    }
}

/// a·b.
#[inline(always)]
fn dot<L: Lanes>(l: L, a: &[Four], b: &[Four]) -> f64 {
    let mut sums = [Pack::splat(l, 0.0); 4];
    for (a, b) in a.as_chunks::<4>().0.iter().zip(b.as_chunks::<4>().0) {
        for i in 0..4 {
            sums[i] = sums[i] + Pack::load(l, &a[i]) * Pack::load(l, &b[i]);
        }
    }
    ((sums[0] + sums[1]) + (sums[2] + sums[3])).sum()
}

/// a ← a + t b; returns a·c.
#[inline(always)]
fn add_and_dot<L: Lanes>(l: L, a: &mut [Four], t: f64, b: &[Four], c: &[Four]) -> f64 {
    let t = Pack::splat(l, t);
    let mut sums = [Pack::splat(l, 0.0); 4];
    let others = b.as_chunks::<4>().0.iter().zip(c.as_chunks::<4>().0);
    for (a, (b, c)) in a.as_chunks_mut::<4>().0.iter_mut().zip(others) {
        for i in 0..4 {
            let moved = Pack::load(l, &a[i]) + t * Pack::load(l, &b[i]);
            sums[i] = sums[i] + moved * Pack::load(l, &c[i]);
            a[i] = moved.store();
        }
    }
    ((sums[0] + sums[1]) + (sums[2] + sums[3])).sum()
}

/// d ← scale D⁻¹ d.
#[inline(always)]
fn precondition<L: Lanes>(l: L, d: &mut [Four], inverse: &Blocks, scale: f64) {
    let scale = Pack::splat(l, scale);
    for (d, block) in d.as_chunks_mut::<3>().0.iter_mut().zip(&inverse.0) {
        *d = (Blocks::times(l, block, Vectors::from_flat(l, d)) * scale).flat(l);
    }
}

/// The longest vector.
#[inline(always)]
fn longest<L: Lanes>(l: L, d: &[Four]) -> f64 {
    let mut most = Pack::splat(l, 0.0);
    for d in d.as_chunks::<3>().0 {
        let d = Vectors::from_flat(l, d);
        most = d.dot(d).max(most);
    }
    let Four([a, b, c, d]) = most.store();
    a.max(b).max(c.max(d)).sqrt()
}
