//! Relaxation: what a Newton step leaves in the stiff directions, taken off cheaply.
//!
//! A Newton step turns triangles, and a turn by θ stretches by θ²/2; it also carries vertices into the body that did not touch
//! where it began. Both are local and stiff, so a line search that judges the step with them in cuts it to a fraction, and a
//! factorisation is spent on a millimetre. A few iterations of L-BFGS on the same energy take them off,
//!
//! d = −H₀ ∇E updated by the last m pairs (s, y), H₀ = γ diag(D_i⁻¹), γ = sᵀy / yᵀ diag(D_i⁻¹) y, at first 1,
//!
//! each at the price of a gradient: a fiftieth of a factorisation. Every iteration lowers the energy (Armijo). Source: Nocedal,
//! Wright: "Numerical Optimization" (2006), algorithm 7.4; in a multigrid method this is the smoother.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s, y | change of positions and of the gradient over an iteration | m, N |
//! | D_i | diagonal block of the damped Hessian of vertex i | N/m |
//! | m | pairs kept, six: more cost more than they bring | – |
//!
//! Limits: reduces errors as short as a few triangles; a whole fold hardly moves.

use glam::{DMat3, DVec3};

use super::soa::{Blocks, Flat};
use super::vectors::{self, MEMORY, Pair};
use crate::mechanics::energy::membrane::outer;
use crate::mechanics::energy::{Cloth, Contacts, Scratch};

/// Armijo's constant: the share of the predicted decrease that an iteration or a step must bring.
pub(super) const ARMIJO: f64 = 1e-4;

/// Shorter than this share of an iteration is rounding.
const MIN_STEP_LENGTH: f64 = 1e-3;

/// D⁻¹ and the vectors of the iteration, kept from call to call; by vertex, zero where it is held.
#[derive(Debug, Default)]
pub(crate) struct Relaxation {
    inverse: Blocks,
    /// Vertices whose contact is in D⁻¹, and those that came to it in this call, with what they had before.
    known: Vec<bool>,
    touched: Vec<(u32, DMat3)>,
    pairs: Vec<Pair>,
    spare: Vec<Pair>,
    /// −∇E where it is, and at the trial.
    down: Flat,
    trial_down: Flat,
    direction: Flat,
    trial: Vec<DVec3>,
    gradient: Vec<DVec3>,
    scratch: Scratch,
}

impl Relaxation {
    /// Takes D from each vertex's own block (N/m), which must be positive where it is not held.
    pub(crate) fn prepare(&mut self, cloth: &Cloth, contacts: &Contacts<'_>, own: &[DMat3]) {
        self.touched.clear();
        self.known.clear();
        self.known.resize(cloth.vertex_count(), false);
        for t in contacts.touches() {
            self.known[t.vertex as usize] = true;
        }
        self.inverse.clear(cloth.vertex_count());
        for (v, (block, _)) in own.iter().zip(&cloth.held).enumerate().filter(|(_, (_, held))| !**held) {
            self.inverse.set(v, block.inverse());
        }
    }

    /// Up to `iterations` from `x`, where `contacts` must be up to date and are afterwards; returns the energy, J.
    pub(crate) fn run(
        &mut self,
        cloth: &Cloth,
        contacts: &mut Contacts<'_>,
        x: &mut Vec<DVec3>,
        iterations: usize,
    ) -> f64 {
        let mut energy = cloth.evaluate(x, contacts, &mut self.gradient, &mut self.scratch);
        self.down.set_opposite(&self.gradient);
        self.spare.append(&mut self.pairs);
        for (v, before) in self.touched.drain(..) {
            self.inverse.set(v as usize, before);
            self.known[v as usize] = false;
        }
        let options = cloth.solver.relaxation;
        let mut scale = 1.0;
        for _ in 0..iterations {
            self.touch(contacts);
            let [slope, longest] = vectors::turn(&self.pairs, &self.inverse, scale, &self.down, &mut self.direction);
            let mut t = (options.longest_move_m / longest).min(1.0);
            loop {
                self.direction.added_to(x, t, &mut self.trial);
                let there = cloth.evaluate_at(&self.trial, contacts, &mut self.gradient, &mut self.scratch);
                if there <= energy + ARMIJO * t * slope {
                    energy = there;
                    break;
                }
                t *= 0.3;
                // Also where t is not a number: nothing pulls any more.
                if t.is_nan() || t <= MIN_STEP_LENGTH {
                    contacts.update(x);
                    return energy;
                }
            }
            self.trial_down.set_opposite(&self.gradient);
            scale = self.remember(t, scale);
            std::mem::swap(x, &mut self.trial);
            std::mem::swap(&mut self.down, &mut self.trial_down);
        }
        energy
    }

    /// Adds κ A n nᵀ to the D of vertices that have come to touch (Sherman and Morrison's formula).
    fn touch(&mut self, contacts: &Contacts<'_>) {
        for t in contacts.touches() {
            let v = t.vertex as usize;
            if !std::mem::replace(&mut self.known[v], true) {
                let before = self.inverse.get(v);
                let w = before * t.normal;
                let less = outer(w, w) * (t.stiffness / (1.0 + t.stiffness * t.normal.dot(w)));
                self.inverse.set(v, before - less);
                self.touched.push((t.vertex, before));
            }
        }
    }

    /// Keeps the pair of the move by t times the direction; returns γ.
    fn remember(&mut self, t: f64, scale: f64) -> f64 {
        let mut pair =
            if self.pairs.len() == MEMORY { self.pairs.remove(0) } else { self.spare.pop().unwrap_or_default() };
        std::mem::swap(&mut pair.s, &mut self.direction);
        let [curvature, scaled] = vectors::difference(&mut pair, t, &self.down, &self.trial_down, &self.inverse);
        if curvature <= 0.0 {
            self.spare.push(pair);
            return scale;
        }
        pair.rho = 1.0 / curvature;
        self.pairs.push(pair);
        curvature / scaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    /// A hanging sheet of 30 by 30 vertices, a centimetre apart, its upper edge held.
    fn hanging() -> (Cloth, Vec<DVec3>) {
        let mesh = sheet(29, 29, |i, j| DVec3::new(i, 0.0, j) * 0.01);
        (Cloth::sample(&mesh, "cotton", &(29 * 30..30 * 30).collect::<Vec<_>>()), mesh.positions)
    }

    fn relaxed(cloth: &Cloth, x: &mut Vec<DVec3>, iterations: usize) -> [f64; 2] {
        let mut contacts = Contacts::none();
        let (mut blocks, mut relaxation) = (Vec::new(), Relaxation::default());
        cloth.diagonal_blocks(x, &contacts, 100.0, &mut blocks);
        relaxation.prepare(cloth, &contacts, &blocks);
        let before = cloth.energy(x, &contacts);
        let after = relaxation.run(cloth, &mut contacts, x, iterations);
        assert!((after - cloth.energy(x, &contacts)).abs() < 1e-12 * before.abs());
        [before, after]
    }

    #[test]
    fn relaxation_removes_displacements_of_the_length_of_a_triangle() {
        let (cloth, flat) = hanging();
        let weight_alone = cloth.energy(&flat, &Contacts::none());
        let mut x = flat.clone();
        for (i, x) in x.iter_mut().enumerate() {
            if !cloth.held[i] {
                *x += DVec3::new(1e-3, 1e-3, 0.0) * if (i + i / 30) % 2 == 0 { 1.0 } else { -1.0 };
            }
        }
        let [before, after] = relaxed(&cloth, &mut x, 15);
        assert!(after - weight_alone < 0.01 * (before - weight_alone), "{before} to {after} J, flat {weight_alone} J");
        for (i, held) in cloth.held.iter().enumerate() {
            assert!(!held || x[i] == flat[i], "held vertex {i} moved");
        }
    }

    #[test]
    fn energy_falls_with_every_iteration() {
        let (cloth, mut x) = hanging();
        for (i, x) in x.iter_mut().enumerate().filter(|(i, _)| !cloth.held[*i]) {
            x.y += 2e-3 * (0.7 * i as f64).sin();
        }
        let mut last = f64::INFINITY;
        for iterations in 0..12 {
            let [_, after] = relaxed(&cloth, &mut x.clone(), iterations);
            assert!(after < last, "{iterations} iterations: {last} to {after} J");
            last = after;
        }
    }

    #[test]
    fn relaxation_of_several_chunks_has_the_same_bits_on_one_thread_and_on_two() {
        let n = 150;
        let mesh = sheet(n - 1, n - 1, |i, j| DVec3::new(i, 0.1 * (i * j).sin(), j) * 0.01);
        let cloth = Cloth::sample(&mesh, "cotton", &(n * (n - 1)..n * n).collect::<Vec<_>>());
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut x = mesh.positions.clone();
            let energies = pool.install(|| relaxed(&cloth, &mut x, 8));
            (energies, x)
        };
        let (energies, x) = on(1);
        assert!(energies[1] < energies[0], "{energies:?}");
        assert!((energies, x) == on(2));
    }
}
