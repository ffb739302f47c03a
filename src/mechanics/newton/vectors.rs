//! The sums of L-BFGS over all coordinates, in lanes: each passes over memory once, for that is what they wait for.
//!
//! Sums go in four registers that do not wait for each other, in stretches of [`STRETCH`] on all threads, in an order that depends on the
//! length alone.

use rayon::prelude::*;

use super::soa::{Blocks, Flat, STRETCH};
use crate::base::simd::{Four, Lanes, Pack, Vectors, Work, run};

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
    let (Flat(down), Flat(d)) = (down, direction);
    d.resize(down.len(), Four::ZERO);
    stretches(d).zip(down.par_chunks(STRETCH)).for_each(|(d, down)| d.copy_from_slice(down));
    let mut shares = [0.0; MEMORY];
    // Each pass subtracts one pair and multiplies with the next.
    if let [.., last] = pairs {
        let mut product = dot(d, &last.s.0);
        for k in (0..pairs.len()).rev() {
            shares[k] = pairs[k].rho * product;
            let next = if k > 0 { &pairs[k - 1].s.0 } else { down };
            product = add_and_dot(d, -shares[k], &pairs[k].y.0, next);
        }
    }
    let blocks = inverse.0.par_chunks(STRETCH / 3);
    stretches(d).zip(blocks).for_each(|(d, blocks)| run(Precondition { d, blocks, scale }));
    let slope = if let [first, ..] = pairs {
        let mut product = dot(d, &first.y.0);
        for (k, pair) in pairs.iter().enumerate() {
            let back = pair.rho * product;
            let next = pairs.get(k + 1).map_or(down, |next| &next.y.0);
            product = add_and_dot(d, shares[k] - back, &pair.s.0, next);
        }
        -product
    } else {
        -dot(d, down)
    };
    let longest = d.par_chunks(STRETCH).map(|d| run(Longest(d))).reduce(|| 0.0, f64::max);
    [slope, longest]
}

/// Makes the pair of a move by t times `s`, from where −∇E was `before` to where it is `after`: s becomes t s. Returns sᵀy and
/// yᵀ D⁻¹ y, J.
pub(super) fn difference(pair: &mut Pair, t: f64, before: &Flat, after: &Flat, inverse: &Blocks) -> [f64; 2] {
    let (s, y) = (&mut pair.s.0, &mut pair.y.0);
    y.resize(s.len(), Four::ZERO);
    let ends = before.0.par_chunks(STRETCH).zip(after.0.par_chunks(STRETCH));
    let all = stretches(s).zip(stretches(y)).zip(ends).zip(inverse.0.par_chunks(STRETCH / 3));
    let sums = all.map(|(((s, y), (before, after)), blocks)| run(Difference { s, y, t, before, after, blocks }));
    let sums: Vec<[f64; 2]> = sums.collect();
    sums.into_iter().reduce(|a, b| [a[0] + b[0], a[1] + b[1]]).unwrap_or_default()
}

/// a·b.
fn dot(a: &[Four], b: &[Four]) -> f64 {
    summed(a.par_chunks(STRETCH).zip(b.par_chunks(STRETCH)).map(|(a, b)| run(Dot { a, b })))
}

/// a ← a + t b; returns a·c.
fn add_and_dot(a: &mut [Four], t: f64, b: &[Four], c: &[Four]) -> f64 {
    let others = b.par_chunks(STRETCH).zip(c.par_chunks(STRETCH));
    summed(stretches(a).zip(others).map(|(a, (b, c))| run(AddAndDot { a, t, b, c })))
}

fn stretches(a: &mut [Four]) -> impl IndexedParallelIterator<Item = &mut [Four]> {
    a.par_chunks_mut(STRETCH)
}

/// Sum of the stretches' sums, in their order.
fn summed(sums: impl IndexedParallelIterator<Item = f64>) -> f64 {
    sums.collect::<Vec<_>>().into_iter().sum()
}

struct Difference<'a> {
    s: &'a mut [Four],
    y: &'a mut [Four],
    t: f64,
    before: &'a [Four],
    after: &'a [Four],
    blocks: &'a [[Four; 6]],
}

impl Work for Difference<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> [f64; 2] {
        let Self { s, y, t, before, after, blocks } = self;
        let t = Pack::splat(l, t);
        let (mut curvature, mut scaled) = (Pack::splat(l, 0.0), Pack::splat(l, 0.0));
        let (s, y) = (s.as_chunks_mut::<3>().0.iter_mut(), y.as_chunks_mut::<3>().0.iter_mut());
        let ends = before.as_chunks::<3>().0.iter().zip(after.as_chunks::<3>().0);
        for (((s, y), (before, after)), block) in s.zip(y).zip(ends).zip(blocks) {
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

struct Dot<'a> {
    a: &'a [Four],
    b: &'a [Four],
}

impl Work for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> f64 {
        let mut sums = [Pack::splat(l, 0.0); 4];
        for (a, b) in self.a.as_chunks::<4>().0.iter().zip(self.b.as_chunks::<4>().0) {
            for i in 0..4 {
                sums[i] = sums[i] + Pack::load(l, &a[i]) * Pack::load(l, &b[i]);
            }
        }
        ((sums[0] + sums[1]) + (sums[2] + sums[3])).sum()
    }
}

struct AddAndDot<'a> {
    a: &'a mut [Four],
    t: f64,
    b: &'a [Four],
    c: &'a [Four],
}

impl Work for AddAndDot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> f64 {
        let Self { a, t, b, c } = self;
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
}

/// d ← scale D⁻¹ d.
struct Precondition<'a> {
    d: &'a mut [Four],
    blocks: &'a [[Four; 6]],
    scale: f64,
}

impl Work for Precondition<'_> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        let scale = Pack::splat(l, self.scale);
        for (d, block) in self.d.as_chunks_mut::<3>().0.iter_mut().zip(self.blocks) {
            *d = (Blocks::times(l, block, Vectors::from_flat(l, d)) * scale).flat(l);
        }
    }
}

/// The longest vector.
struct Longest<'a>(&'a [Four]);

impl Work for Longest<'_> {
    type Output = f64;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> f64 {
        let mut most = Pack::splat(l, 0.0);
        for d in self.0.as_chunks::<3>().0 {
            let d = Vectors::from_flat(l, d);
            most = d.dot(d).max(most);
        }
        let Four([a, b, c, d]) = most.store();
        a.max(b).max(c.max(d)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::base::pool::VERTICES_PER_TASK;
    use crate::mechanics::linear_algebra::dot as product;
    use crate::mesh::outer;

    fn noise(vertices: usize, seed: f64) -> Vec<DVec3> {
        let at = |i: usize, k: f64| (seed + 1.7 * i as f64 + k).sin();
        (0..vertices).map(|i| DVec3::new(at(i, 0.0), at(i, 0.5), at(i, 2.1))).collect()
    }

    fn flat(vectors: &[DVec3]) -> Flat {
        let mut flat = Flat::default();
        flat.set_opposite(&vectors.iter().map(|v| -*v).collect::<Vec<_>>());
        flat
    }

    fn block(i: usize) -> DMat3 {
        let v = DVec3::new(0.3, 0.1 * (i % 21) as f64, -0.4);
        DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0 + (i % 21) as f64)) + outer(v, v)
    }

    #[test]
    fn the_direction_is_that_of_the_two_loops_vertex_by_vertex() {
        // A group of sixteen, one of four and one left over; the same after two whole stretches.
        for vertices in [21, 2 * VERTICES_PER_TASK + 21] {
            agrees_with_the_two_loops(vertices);
        }
    }

    fn agrees_with_the_two_loops(n: usize) {
        let (gradient, x) = (noise(n, 0.3), noise(n, 9.0));
        let mut inverse = Blocks::default();
        inverse.clear(n);
        (0..n).for_each(|i| inverse.set(i, block(i)));
        let (mut pairs, mut plain) = (Vec::new(), Vec::new());
        for k in [0.0, 1.0, 2.0] {
            let (s, before, t) = (noise(n, k), noise(n, 5.0 + k), 0.3 + k);
            let after: Vec<DVec3> = before.iter().zip(&s).map(|(b, s)| *b - *s * (2.0 + t) - DVec3::X).collect();
            let mut pair = Pair { s: flat(&s), ..Pair::default() };
            let [curvature, scaled] = difference(&mut pair, t, &flat(&before), &flat(&after), &inverse);
            let s: Vec<DVec3> = s.iter().map(|s| *s * t).collect();
            let y: Vec<DVec3> = before.iter().zip(&after).map(|(b, a)| *b - *a).collect();
            let by_block: Vec<DVec3> = y.iter().enumerate().map(|(i, y)| block(i) * *y).collect();
            assert!((curvature - product(&s, &y)).abs() < 1e-12 * curvature);
            assert!((scaled - product(&y, &by_block)).abs() < 1e-12 * scaled);
            pair.rho = 1.0 / curvature;
            pairs.push(pair);
            plain.push((s, y));
        }
        let mut direction = Flat::default();
        let down: Vec<DVec3> = gradient.iter().map(|g| -*g).collect();
        let [slope, longest] = turn(&pairs, &inverse, 0.7, &flat(&down), &mut direction);
        let add = |d: &mut [DVec3], t: f64, b: &[DVec3]| d.iter_mut().zip(b).for_each(|(d, b)| *d += *b * t);
        let (mut d, mut shares) = (down, [0.0; 3]);
        for (k, (s, y)) in plain.iter().enumerate().rev() {
            shares[k] = product(s, &d) / product(s, y);
            add(&mut d, -shares[k], y);
        }
        d.iter_mut().enumerate().for_each(|(i, d)| *d = block(i) * *d * 0.7);
        for ((s, y), share) in plain.iter().zip(shares) {
            let back = product(y, &d) / product(s, y);
            add(&mut d, share - back, s);
        }
        let most = d.iter().map(|d| d.length()).fold(0.0, f64::max);
        assert!((slope - product(&gradient, &d)).abs() < 1e-12 * slope.abs(), "{slope}");
        assert!((longest - most).abs() < 1e-12 * most, "{longest} and {most}");
        let mut moved = Vec::new();
        direction.added_to(&x, 0.5, &mut moved);
        for ((moved, x), d) in moved.iter().zip(&x).zip(&d) {
            assert!(moved.distance(*x + *d * 0.5) < 1e-12 * most, "{moved}");
        }
    }
}
