//! Sums of the reduced Hessian over elements, pair of PARTs by pair, four functions at a time.
//!
//! With f_a the four functions of PART p and g_b those of PART q, an element adds to their pair
//!
//! - a triangle: A (a_u H_uu b_u + a_u H_uv b_v + a_v H_uvᵀ b_u + a_v H_vv b_v), a = ∇f_a and b = ∇g_b in its rest plane;
//! - a bending ring: Σ_c k_c (B f_a)_c (B g_b)_c on the diagonal, B its fit, c its three curvatures;
//! - a vertex: m ε f_a g_b on the diagonal, and K f_a g_b with K the Hessian of its contact and friction.
//!
//! The four f_a are one register. Contributions to the diagonal alone are summed separately, at a ninth of the work. Same bits on every machine
//! ([`lanes`](crate::base::simd)).

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::elements::Elements;
use super::motions::Functions;
use crate::base::simd::{Four, Lanes, Pack, Work, run};
use crate::mechanics::energy::HessianKind;
use crate::mechanics::newton::State;

/// The elements of a sum.
#[derive(Debug, Clone)]
pub(super) enum Element {
    /// The membrane of these triangles, by place among the sampled.
    Triangles(Range<usize>),
    /// Bending of the sampled rings.
    Rings,
    /// Masses times the damping, contact and friction.
    Vertices,
}

/// Sums by pair of PARTs.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// Entry by entry of the 3×3 block, column by column, for g_0, then g_1, ...
    full: Vec<[Four; 36]>,
    /// The diagonal alone, for g_0, g_1, ...
    scalar: Vec<[Four; 4]>,
}

impl Sums {
    pub(super) fn clear(&mut self, pairs: usize) {
        self.full.clear();
        self.full.resize(pairs, [Four::ZERO; 36]);
        self.scalar.clear();
        self.scalar.resize(pairs, [Four::ZERO; 4]);
    }

    pub(super) fn add(&mut self, functions: &[Functions], here: &State<'_>, elements: &Elements, what: Element) {
        run(Adding { sums: self, functions, here, elements, what });
    }

    pub(super) fn join(&mut self, other: &Self) {
        let full = self.full.as_flattened_mut().iter_mut().zip(other.full.as_flattened());
        let scalar = self.scalar.as_flattened_mut().iter_mut().zip(other.scalar.as_flattened());
        for (sum, other) in full.chain(scalar) {
            for (sum, other) in sum.0.iter_mut().zip(other.0) {
                *sum += other;
            }
        }
    }

    /// The block of functions f_a, g_b of a pair, N/m.
    pub(super) fn block(&self, pair: usize, a: usize, b: usize) -> DMat3 {
        let entries: [f64; 9] = std::array::from_fn(|i| self.full[pair][9 * b + i].0[a]);
        DMat3::from_cols_array(&entries) + DMat3::from_diagonal(DVec3::splat(self.scalar[pair][b].0[a]))
    }
}

struct Adding<'a, 'b> {
    sums: &'a mut Sums,
    functions: &'a [Functions],
    here: &'a State<'b>,
    elements: &'a Elements,
    what: Element,
}

impl Work for Adding<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        match self.what {
            Element::Triangles(sampled) => triangles(l, self.sums, self.functions, self.here, self.elements, sampled),
            Element::Rings => rings(l, self.sums, self.functions, self.here, self.elements),
            Element::Vertices => vertices(l, self.sums, self.functions, self.here, self.elements),
        }
    }
}

#[inline(always)]
fn triangles<L: Lanes>(
    l: L,
    sums: &mut Sums,
    functions: &[Functions],
    here: &State<'_>,
    all: &Elements,
    sampled: Range<usize>,
) {
    let State { cloth, x, .. } = *here;
    let mut gradients: Vec<[Four; 2]> = Vec::new();
    for k in sampled {
        let (i, standing_for) = all.sampled[k];
        let t = &cloth.triangles[i as usize];
        let [huu, huv, hvv] =
            t.by_gradient(cloth.stiffness_of(t), cloth.compression_ratios[i as usize], x, HessianKind::Projected);
        let scale = t.area * standing_for;
        let h = [huu * scale, huv * scale, huv.transpose() * scale, hvv * scale];
        gradients.clear();
        for (&p, weights) in all.parts.of(k).iter().zip(all.weights.of(k).chunks_exact(3)) {
            let (mut u, mut v) = (Pack::splat(l, 0.0), Pack::splat(l, 0.0));
            for ((&vertex, gradient), &w) in t.vertices.iter().zip(&t.gradients).zip(weights) {
                let f = functions[p as usize].at(l, w, x[vertex as usize]);
                u = u + f * gradient.x;
                v = v + f * gradient.y;
            }
            gradients.push([u.store(), v.store()]);
        }
        for pair in all.pairs.of(k) {
            let (a, b) = (&gradients[pair.row as usize], &gradients[pair.column as usize]);
            add_full(l, &mut sums.full[pair.number as usize], a, b, &h);
        }
    }
}

/// Adds a_u H_uu b_u + a_u H_uv b_v + a_v H_vu b_u + a_v H_vv b_v.
#[inline(always)]
fn add_full<L: Lanes>(l: L, sum: &mut [Four; 36], a: &[Four; 2], b: &[Four; 2], h: &[DMat3; 4]) {
    let [huu, huv, hvu, hvv] = [h[0].to_cols_array(), h[1].to_cols_array(), h[2].to_cols_array(), h[3].to_cols_array()];
    let (bu, bv) = (Pack::load(l, &b[0]), Pack::load(l, &b[1]));
    let (mut by_u, mut by_v) = ([Four::ZERO; 9], [Four::ZERO; 9]);
    for i in 0..9 {
        by_u[i] = (bu * huu[i] + bv * huv[i]).store();
        by_v[i] = (bu * hvu[i] + bv * hvv[i]).store();
    }
    let (au, av) = (Pack::load(l, &a[0]), Pack::load(l, &a[1]));
    for b in 0..4 {
        for i in 0..9 {
            let slot = &mut sum[9 * b + i];
            let more = au * by_u[i].0[b] + av * by_v[i].0[b];
            *slot = (Pack::load(l, slot) + more).store();
        }
    }
}

#[inline(always)]
fn rings<L: Lanes>(l: L, sums: &mut Sums, functions: &[Functions], here: &State<'_>, all: &Elements) {
    let State { cloth, x, .. } = *here;
    let mut fits: Vec<[Four; 3]> = Vec::new();
    for (k, &(i, standing_for)) in all.sampled.iter().enumerate() {
        let (vertices, ring, stiffness) = cloth.bending.element(i as usize);
        let stiffness = stiffness * standing_for;
        fits.clear();
        for (&p, weights) in all.parts.of(k).iter().zip(all.weights.of(k).chunks_exact(vertices.len())) {
            let zero = Pack::splat(l, 0.0);
            let (mut fx, mut fy, mut fz) = (zero, zero, zero);
            for ((&v, r), &w) in vertices.iter().zip(ring).zip(weights) {
                if w > 0.0 {
                    let f = functions[p as usize].at(l, w, x[v as usize]);
                    fx = fx + f * r.x;
                    fy = fy + f * r.y;
                    fz = fz + f * r.z;
                }
            }
            fits.push([fx.store(), fy.store(), fz.store()]);
        }
        for pair in all.pairs.of(k) {
            let (a, b) = (&fits[pair.row as usize], &fits[pair.column as usize]);
            let ax = Pack::load(l, &a[0]) * stiffness.x;
            let ay = Pack::load(l, &a[1]) * stiffness.y;
            let az = Pack::load(l, &a[2]) * stiffness.z;
            let sum = &mut sums.scalar[pair.number as usize];
            for (i, slot) in sum.iter_mut().enumerate() {
                let along = ax * b[0].0[i] + ay * b[1].0[i];
                *slot = (Pack::load(l, slot) + (along + az * b[2].0[i])).store();
            }
        }
    }
}

#[inline(always)]
fn vertices<L: Lanes>(l: L, sums: &mut Sums, functions: &[Functions], here: &State<'_>, all: &Elements) {
    let State { cloth, x, contacts, damping, .. } = *here;
    let mut values: Vec<Four> = Vec::new();
    for (v, x) in x.iter().enumerate() {
        values_at(l, functions, all, v, *x, &mut values);
        let mass = Pack::splat(l, cloth.masses[v] * damping);
        for pair in all.pairs.of(v) {
            let a = Pack::load(l, &values[pair.row as usize]) * mass;
            let b = &values[pair.column as usize];
            for (slot, b) in sums.scalar[pair.number as usize].iter_mut().zip(b.0) {
                *slot = (Pack::load(l, slot) + a * b).store();
            }
        }
    }
    for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
        let v = v as usize;
        values_at(l, functions, all, v, x[v], &mut values);
        let entries = block.to_cols_array();
        for pair in all.pairs.of(v) {
            let a = Pack::load(l, &values[pair.row as usize]);
            let b = &values[pair.column as usize];
            let sum = &mut sums.full[pair.number as usize];
            for (b, slots) in b.0.iter().zip(sum.chunks_exact_mut(9)) {
                let a = a * *b;
                for (slot, entry) in slots.iter_mut().zip(entries) {
                    *slot = (Pack::load(l, slot) + a * entry).store();
                }
            }
        }
    }
}

/// The functions of every PART at a vertex.
#[inline(always)]
fn values_at<L: Lanes>(l: L, functions: &[Functions], all: &Elements, v: usize, x: DVec3, values: &mut Vec<Four>) {
    values.clear();
    for (&p, &w) in all.parts.of(v).iter().zip(all.weights.of(v)) {
        values.push(functions[p as usize].at(l, w, x).store());
    }
}
