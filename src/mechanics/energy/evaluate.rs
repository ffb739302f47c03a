//! E and ∇E of the whole cloth: what a drape spends most of its time on.
//!
//! The triangles and the bending pairs go in two halves, one a core, always the same two, so that sums are the same bits on any
//! number of threads; each half has forces of its own, and the rest is added where the two are joined. Nothing is
//! allocated once the [`Scratch`] has grown to the garment.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::membrane_simd::{self, TrianglePack};
use super::{Cloth, Contacts};
use crate::GRAVITY;
use crate::base::simd::{Four, Lanes, Work, run};

/// Vertices that a thread passes over at a time where nothing but memory is waited for; fewer are passed over by one.
const STRETCH: usize = 16_384;

/// Memory of an evaluation, kept from one to the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Positions, padded.
    x: Vec<Four>,
    /// The gradient of each half, padded.
    halves: [Vec<Four>; 2],
}

impl Cloth {
    /// E at `x`, J; `contacts` must have been updated at `x`.
    #[must_use]
    pub fn energy(&self, x: &[DVec3], contacts: &Contacts) -> f64 {
        self.evaluate(x, contacts, &mut Vec::new(), &mut Scratch::default())
    }

    /// ∇E at `x`, N, zero at held vertices; returns E, J. `contacts` must have been updated at `x`.
    pub fn gradient(&self, x: &[DVec3], contacts: &Contacts, gradient: &mut Vec<DVec3>) -> f64 {
        self.evaluate(x, contacts, gradient, &mut Scratch::default())
    }

    /// [`gradient`](Self::gradient) with memory to use again.
    pub fn evaluate(&self, x: &[DVec3], contacts: &Contacts, gradient: &mut Vec<DVec3>, scratch: &mut Scratch) -> f64 {
        let Scratch { x: padded, halves: [one, other] } = scratch;
        padded.resize(x.len(), Four::ZERO);
        let stretches = padded.par_chunks_mut(STRETCH).zip(x.par_chunks(STRETCH));
        stretches.for_each(|(to, x)| to.iter_mut().zip(x).for_each(|(to, p)| *to = Four([p.x, p.y, p.z, 0.0])));
        let middle = self.packs.len() / 2;
        let ((first, second), (slack, other_slack)) = (self.packs.split_at(middle), self.packed_slack.split_at(middle));
        let [above, below] = self.bending.plate.halves();
        let x_of_all = &*padded;
        let half = |packs, vertices, gradient| Half { cloth: self, packs, vertices, x: x_of_all, gradient };
        let (a, b) =
            rayon::join(|| run(half((first, slack), above, one)), || run(half((second, other_slack), below, other)));
        let weight = self.join(padded, [one, other], gradient);
        contacts.add_gradient(gradient);
        contacts.friction.add_gradient(x, gradient);
        let itself = contacts.proximity.as_ref().map_or(0.0, |p| p.add_gradient(x, &self.held, gradient));
        weight + (a + b) + contacts.energy() + contacts.friction.energy(x) + itself
    }

    /// Both halves' gradients and gravity's, where a vertex is not held; returns the energy of gravity.
    fn join(&self, x: &[Four], [one, other]: [&[Four]; 2], gradient: &mut Vec<DVec3>) -> f64 {
        gradient.resize(x.len(), DVec3::ZERO);
        let halves = one.par_chunks(STRETCH).zip(other.par_chunks(STRETCH));
        let own = self.masses.par_chunks(STRETCH).zip(self.held.par_chunks(STRETCH));
        let stretches = gradient.par_chunks_mut(STRETCH).zip(x.par_chunks(STRETCH)).zip(halves).zip(own);
        let weights = stretches.map(|(((gradient, x), (one, other)), (masses, held))| {
            let mut energy = 0.0;
            let vertices = x.iter().zip(one).zip(other).zip(masses).zip(held);
            for (out, ((((x, Four(a)), Four(b)), &mass), &held)) in gradient.iter_mut().zip(vertices) {
                let weight = mass * GRAVITY;
                energy += weight * x.0[2];
                *out = if held { DVec3::ZERO } else { DVec3::new(a[0] + b[0], a[1] + b[1], a[2] + b[2] + weight) };
            }
            energy
        });
        weights.collect::<Vec<f64>>().into_iter().sum()
    }
}

/// Membrane and bending of half the triangles and half the pairs.
struct Half<'a> {
    cloth: &'a Cloth,
    packs: (&'a [TrianglePack], &'a [Four]),
    vertices: Range<usize>,
    x: &'a [Four],
    gradient: &'a mut Vec<Four>,
}

impl Work for Half<'_> {
    type Output = f64;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> f64 {
        self.gradient.clear();
        self.gradient.resize(self.x.len(), Four::ZERO);
        let bending = self.cloth.bending.plate.add_gradient(l, self.vertices, self.x, self.gradient);
        bending + membrane_simd::add_gradient(l, self.packs, &self.cloth.stiffness, self.x, self.gradient)
    }
}
