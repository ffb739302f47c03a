//! The equilibrium of the PARTs by local and global steps (ADMM) with one constant factor.
//!
//! With positions x = X + B q, B the blended affine maps of the PARTs ([`Motions`]) about the placed garment, the energy is
//!
//! E(q) = Σ A ψ(F) + g·m,
//!
//! with the relaxed membrane energy ψ of `local_step.rs`, where vertices stay out of the body. ADMM adds a copy Z of F for every sampled
//! triangle and a copy C of c for every sampled vertex, and repeats
//!
//! 1. local step: Z = argmin ψ(Z) + w/2 |Z − (F + U)|²; C from c + V out of the body, with friction;
//! 2. global step: K q = b, K = w Σ A (∇B)ᵀ ∇B + w_c Σ a BᵀB + ε M, three right sides;
//! 3. multipliers: U ← U + α (F − Z), V ← V + α (c − C).
//!
//! K does not change: it is factored once a table. Where vertices are pushed out of the body ([`Admm::rebase`]), X changes and K does not.
//! Without compression stiffness and body, E is convex in q: the result does not depend on the start.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | unknown vectors of the affine maps | m |
//! | F, Z | deformation gradient of a triangle; its local copy | – |
//! | c, C | position of a vertex; its local copy | m |
//! | U, V | scaled multipliers: w U is the stress, w_c V the pressure | –, m |
//! | A, a | rest areas that a sampled triangle and a sampled vertex stand for | m² |
//! | w, w_c | penalties | N/m, N/m³ |
//! | α, ε | over-relaxation; damping towards the last iterate | –, 1/s² |
//!
//! Source: Boyd, Parikh, Chu, Peleato, Eckstein: "Distributed optimization and statistical learning via the alternating direction
//! method of multipliers" (2011); Overby, Brown, Li, Narain: "ADMM ⊇ projective dynamics" (TVCG 2017).
//! Limits: vertices farther than [`NEAR_M`] from the body at the start than its nearest vertex touch it when they are pushed out, not before. Triangles and
//! vertices are sampled, and forces are those of the samples. Bending is left out: over PARTs wider than a fold it changed errors by at
//! most 0.3 mm, on one garment by 1.1 mm in either direction.

use glam::DVec3;
use rayon::prelude::*;

use super::clearance::TangentPlane;
use super::elements::{Half, Touch, padded, position, unpadded};
use super::motions::Motions;
use super::part_matrix::{PartFactor, PartMatrix};
use super::sampling::{sampled_triangles, sampled_vertices};
use crate::GRAVITY;
use crate::body::distance::{Body, SurfacePoint};
use crate::mechanics::energy::Cloth;
use crate::mechanics::newton::SolveError;
use crate::mesh::Csr;

/// w over ρ g H, the tension that the garment's weight makes over its height. At 1 stiff pullovers, at 2 dresses end farther off.
const MEMBRANE_PENALTY: f64 = 1.5;

/// w_c over ρ g H, 1/m². At 20 garments that hang from the shoulders fall through them.
const CONTACT_PENALTY: f64 = 1.5e3;

/// ε, 1/s²: limits the fall of PARTs without contact. With 10 a dress ends 0.1 mm farther off after thirty iterations.
const DAMPING: f64 = 1.0;

/// Least diagonal of the damping, N/m, for unknowns that move no mass.
const MIN_DAMPING: f64 = 1e-12;

/// Sampled elements of each kind for a PART, over the square root of its elements. On nine drapes in three tables 2 to 10 triangles
/// differ by 0.3 mm on average and 2 mm at most; with a fixed number a small PART takes all of its triangles, and 48 of a skirt in three
/// PARTs leave it 97 mm off instead of 35.
const TRIANGLES_PER_ROOT: f64 = 3.0;
const VERTICES_PER_ROOT: f64 = 1.5;

/// Distance to the body at the start, beyond that of the nearest vertex, within which vertices touch it, m. The penalty slows cloth that does not touch: with all vertices in
/// it, dresses end 5 to 10 mm farther off.
const NEAR_M: f64 = 0.03;

/// Forces of the elements on the vertices, N.
#[derive(Debug, Clone)]
pub(super) struct Forces {
    /// Of the cloth.
    pub(super) cloth: Vec<DVec3>,
    /// Of the body, friction included.
    pub(super) body: Vec<DVec3>,
}

/// The sampled problem of one table.
pub(super) struct Admm<'a> {
    cloth: &'a Cloth,
    body: &'a Body,
    /// The unknowns that move each vertex, with their values at X.
    functions: Csr<(u32, f64)>,
    halves: [Half; 2],
    /// Gravity, N.
    load: Vec<DVec3>,
    /// ε M, N/m.
    damping: Vec<f64>,
    penalty: f64,
    contact_penalty: f64,
    factor: PartFactor,
    q: Vec<DVec3>,
}

impl<'a> Admm<'a> {
    /// Samples the elements about `start` (m) and factors the global step. `height_m` is that of the garment, `compression` the k_c of each
    /// triangle (N/m), `surface` the point of the body for each vertex.
    pub(super) fn new(
        cloth: &'a Cloth,
        body: &'a Body,
        motions: &Motions,
        start: &[DVec3],
        height_m: f64,
        compression: &[f64],
        surface: &[SurfacePoint],
    ) -> Result<Self, SolveError> {
        let tension = cloth.weight / cloth.areas.iter().sum::<f64>() * height_m;
        let (penalty, contact_penalty) = (MEMBRANE_PENALTY * tension, CONTACT_PENALTY * tension);
        let parts = motions.first.len();
        let (functions, (triangles, vertices)) = rayon::join(
            || motions.functions_at(start),
            || {
                let near_m = NEAR_M + surface.iter().map(|s| s.signed_distance).fold(f64::INFINITY, f64::min).max(0.0);
                let heaviest = |(v, s): (usize, &SurfacePoint)| {
                    let weights = motions.weights.of(v).iter().filter(|_| s.signed_distance < near_m);
                    weights.max_by(|a, b| a.1.total_cmp(&b.1)).map(|w| w.0)
                };
                let near_part: Vec<Option<u32>> = surface.iter().enumerate().map(heaviest).collect();
                let triangles = sampled_triangles(parts, &motions.weights, &cloth.triangles, TRIANGLES_PER_ROOT);
                (triangles, sampled_vertices(parts, &near_part, VERTICES_PER_ROOT))
            },
        );
        let ((triangles_a, triangles_b), (vertices_a, vertices_b)) =
            (triangles.split_at(triangles.len() / 2), vertices.split_at(vertices.len() / 2));
        let half = |triangles: &[(u32, f64)], vertices: &[(u32, f64)]| {
            let mut half = Half::default();
            half.add_membranes(cloth, &functions, start, (penalty, compression), triangles);
            half.add_nears(cloth, &functions, (start, surface), vertices);
            half
        };
        let halves = rayon::join(|| half(triangles_a, vertices_a), || half(triangles_b, vertices_b));
        let halves = [halves.0, halves.1];
        let assembled = |half: &Half| {
            let mut matrix = PartMatrix::new(&motions.first, &motions.count);
            half.assemble_membranes(&mut matrix);
            half.assemble_nears(contact_penalty, &mut matrix);
            matrix
        };
        let loads = || {
            let mut load = vec![DVec3::ZERO; motions.unknowns()];
            let mut damping = vec![MIN_DAMPING; motions.unknowns()];
            for (v, &mass) in cloth.masses.iter().enumerate() {
                for &(unknown, value) in functions.of(v) {
                    load[unknown as usize].z -= mass * GRAVITY * value;
                    damping[unknown as usize] += DAMPING * mass * value * value;
                }
            }
            (load, damping)
        };
        let ((mut matrix, (load, damping)), second) =
            rayon::join(|| (assembled(&halves[0]), loads()), || assembled(&halves[1]));
        matrix.add_matrix(&second);
        let factor = matrix.factor(&damping)?;
        let q = vec![DVec3::ZERO; motions.unknowns()];
        Ok(Self { cloth, body, functions, halves, load, damping, penalty, contact_penalty, factor, q })
    }

    /// The unknown vectors, m.
    #[cfg(test)]
    pub(super) fn unknowns(&self) -> &[DVec3] {
        &self.q
    }

    /// Sets the unknowns from which [`iterate`](Self::iterate) starts.
    #[cfg(test)]
    pub(super) fn set_unknowns(&mut self, q: Vec<DVec3>) {
        self.q = q;
        for half in &mut self.halves {
            for k in 0..4 * half.membranes.len() {
                let z = half.gradient(k, &self.q);
                half.splits[k / 4].set_z(k % 4, z);
            }
        }
    }

    /// Adds the displacements of the unknowns to the positions, m.
    pub(super) fn displace(&self, positions: &mut [DVec3]) {
        let displacement = |v| position(DVec3::ZERO, self.functions.of(v), &self.q);
        positions.par_iter_mut().with_min_len(1024).enumerate().for_each(|(v, x)| *x += displacement(v));
    }

    /// Restarts the maps from other positions x (m), keeping copies and multipliers.
    pub(super) fn rebase(&mut self, x: &[DVec3]) {
        self.q.fill(DVec3::ZERO);
        let triangles = &self.cloth.triangles;
        let restart = |half: &mut Half| {
            for membranes in &mut half.membranes {
                membranes.start = membranes.numbers.map(|t| triangles[t as usize].deformation(x).map(padded));
            }
            for near in &mut half.nears {
                near.start = x[near.vertex as usize];
            }
        };
        let [first, second] = &mut self.halves;
        rayon::join(|| restart(first), || restart(second));
    }

    /// One iteration. Returns the root mean square change of the unknowns, m.
    pub(super) fn iterate(&mut self) -> f64 {
        self.update_planes();
        let (q, penalties) = (&self.q, (self.penalty, self.contact_penalty));
        let [first, second] = &mut self.halves;
        let (a, b) = rayon::join(|| first.local_steps(q, penalties), || second.local_steps(q, penalties));
        let mut next: Vec<DVec3> = (0..self.q.len())
            .map(|i| self.load[i] + unpadded(a[i]) + unpadded(b[i]) + self.q[i] * self.damping[i])
            .collect();
        self.factor.solve(&mut next);
        let square: f64 = next.iter().zip(&self.q).map(|(next, q)| next.distance_squared(*q)).sum();
        self.q = next;
        (square / self.q.len() as f64).sqrt()
    }

    /// Renews the tangent planes of near vertices that have moved too far.
    fn update_planes(&mut self) {
        let all = self.halves.iter_mut().flat_map(|half| half.touches.iter_mut().zip(&half.nears));
        // At C, which is outside, and not at c: a vertex pulled deep into the body still leaves it where it entered.
        let stale = all.filter(|(touch, near)| touch.plane.is_stale(touch.position, near.offset));
        let stale: Vec<&mut Touch> = stale.map(|(touch, _)| touch).collect();
        let at: Vec<DVec3> = stale.iter().map(|touch| touch.position).collect();
        let hints: Vec<u32> = stale.iter().map(|touch| touch.plane.triangle).collect();
        for ((touch, &at), found) in stale.into_iter().zip(&at).zip(&self.body.nearest_all_from(&at, &hints)) {
            touch.plane = TangentPlane::new(at, found);
        }
    }

    /// Forces on the vertices at the last iterate, by its multipliers.
    pub(super) fn forces(&self) -> Forces {
        let vertices = self.cloth.vertex_count();
        let (mut cloth, mut body) = (vec![DVec3::ZERO; vertices], vec![DVec3::ZERO; vertices]);
        for half in &self.halves {
            for k in 0..half.membrane_terms.len() {
                let (number, stress) = half.stress(k, &self.q, self.penalty);
                let t = &self.cloth.triangles[number as usize];
                for (&v, b) in t.vertices.iter().zip(&t.gradients) {
                    cloth[v as usize] -= stress[0] * b.x + stress[1] * b.y;
                }
            }
            for (k, near) in half.nears.iter().enumerate() {
                let mut touch = half.touches[k];
                let here = position(near.start, half.near_terms.of(k), &self.q);
                touch.v += here - touch.position;
                if near.separate(&mut touch, here) {
                    let scale = self.contact_penalty * near.area;
                    body[near.vertex as usize] = (touch.position - here - touch.v) * scale;
                }
            }
        }
        Forces { cloth, body }
    }

    /// ‖Bᵀ(gravity + forces)‖ over the weight: what does not balance on the PARTs.
    pub(super) fn residual_over_weight(&self, forces: &Forces) -> f64 {
        let mut reduced = vec![DVec3::ZERO; self.q.len()];
        for (v, ((cloth, body), mass)) in forces.cloth.iter().zip(&forces.body).zip(&self.cloth.masses).enumerate() {
            let force = *cloth + *body - DVec3::Z * (mass * GRAVITY);
            for &(unknown, value) in self.functions.of(v) {
                reduced[unknown as usize] += force * value;
            }
        }
        reduced.iter().map(|r| r.length_squared()).sum::<f64>().sqrt() / self.cloth.weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::fabric::Fabric;
    use crate::mechanics::coupled::{Motion, Weights};
    use crate::mesh::samples::{cuboid, sheet};
    use crate::mesh::{RestShape, Topology};
    use crate::parts::Parts;

    #[test]
    fn without_compression_and_body_fifty_random_starts_have_one_result() {
        // A trampoline of 30 cm in four PARTs, its edge held: all of it is in tension, so that the minimum is one point.
        let n = 12;
        let mesh = sheet(n, n, |i, j| DVec3::new(i, j, 0.0) * 0.025);
        let on_edge = |v: &u32| [v % (n + 1), v / (n + 1)].iter().any(|&k| k == 0 || k == n);
        let held: Vec<u32> = (0..mesh.vertex_count() as u32).filter(on_edge).collect();
        let topology = Topology::new(&mesh);
        let rest = RestShape::from_edges(&mesh).unwrap();
        let cloth = Cloth::new(&mesh, &topology, &rest, &Fabric::by_name("jersey").unwrap(), &held).unwrap();
        let quarter = |v: u32| 2 * u32::from(v % (n + 1) > n / 2) + u32::from(v / (n + 1) > n / 2);
        let label: Vec<u32> = (0..mesh.vertex_count() as u32).map(quarter).collect();
        let parts = Parts::from_labels(&topology, &label, |_| 0, Vec::new(), 0);
        let weights = Weights::new(&topology, &mesh.positions, &parts).without(&cloth.held);
        let motions = Motions::new(&parts, weights, &mesh.positions, Motion::Affine);
        let far = Body::new(&cuboid(DVec3::splat(90.0), DVec3::splat(91.0))).unwrap();
        let (none, surface) = (vec![0.0; mesh.triangles.len()], far.nearest_all(&mesh.positions));
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            0.4 * ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
        };
        let mut first: Option<Vec<DVec3>> = None;
        for start in 0..50 {
            let mut admm = Admm::new(&cloth, &far, &motions, &mesh.positions, 0.3, &none, &surface).unwrap();
            admm.set_unknowns((0..motions.unknowns()).map(|_| DVec3::new(random(), random(), random())).collect());
            let mut iterations = 0;
            while admm.iterate() > 1e-10 && iterations < 20_000 {
                iterations += 1;
            }
            let mut moves = Vec::new();
            motions.prolong(&mesh.positions, admm.unknowns(), &mut moves);
            let first = first.get_or_insert_with(|| moves.clone());
            let off = moves.iter().zip(first).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(off < 1e-6, "start {start}: {off} m from that of the first, after {iterations} iterations");
            assert!(moves.iter().any(|d| d.z < -5e-3), "it sags");
        }
    }
}
