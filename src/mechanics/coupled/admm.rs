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

use super::local_step::TensionField;
use super::motions::Motions;
use super::part_matrix::{PartFactor, PartMatrix};
use super::sampling::{parts_of, sample};
use crate::GRAVITY;
use crate::body::distance::Body;
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

/// α: 1.5 to 1.8 is usual.
const OVER_RELAXATION: f64 = 1.6;

/// Sampled elements of each kind for a PART, over the square root of its elements. On nine drapes in three tables 2 to 10 triangles
/// differ by 0.3 mm on average and 2 mm at most; with a fixed number a small PART takes all of its triangles, and 48 of a skirt in three
/// PARTs leave it 97 mm off instead of 35.
const TRIANGLES_PER_ROOT: f64 = 3.0;
const VERTICES_PER_ROOT: f64 = 1.5;

/// Distance to the body at the start, beyond that of the nearest vertex, within which vertices touch it, m. The penalty slows cloth that does not touch: with all vertices in
/// it, dresses end 5 to 10 mm farther off.
const NEAR_M: f64 = 0.03;

/// Distance that a vertex moves before its tangent plane of the body is updated, m, and the share of its distance to the body that
/// replaces it where larger. Heuristic: a larger one saves queries and makes contact on curved skin less accurate.
const PLANE_RADIUS_M: f64 = 2e-3;
const PLANE_RADIUS_SHARE: f64 = 0.3;

/// A sampled triangle.
#[derive(Debug, Clone, Copy)]
struct Membrane {
    number: u32,
    /// A, m².
    area: f64,
    field: TensionField,
    /// F at X.
    start: [DVec3; 2],
}

/// The copy Z and the multiplier U of a triangle.
#[derive(Debug, Clone, Copy)]
struct Split {
    z: [DVec3; 2],
    u: [DVec3; 2],
}

/// A sampled vertex near the body.
#[derive(Debug, Clone, Copy)]
struct Near {
    vertex: u32,
    /// a, m².
    area: f64,
    offset: f64,
    friction: f64,
    start: DVec3,
}

/// The copy C and the multiplier V of a near vertex, its tangent plane of the body, and the anchor of its friction.
#[derive(Debug, Clone, Copy)]
struct Touch {
    position: DVec3,
    v: DVec3,
    plane_at: DVec3,
    plane_distance: f64,
    normal: DVec3,
    anchor: DVec3,
}

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
    motions: &'a Motions,
    membranes: Vec<Membrane>,
    /// Unknowns of each membrane with the derivatives of their functions along weft and warp.
    membrane_terms: Csr<(u32, f64, f64)>,
    nears: Vec<Near>,
    near_terms: Csr<(u32, f64)>,
    /// Gravity, N.
    load: Vec<DVec3>,
    /// ε M, N/m.
    damping: Vec<f64>,
    penalty: f64,
    contact_penalty: f64,
    factor: PartFactor,
    splits: Vec<Split>,
    touches: Vec<Touch>,
    q: Vec<DVec3>,
}

impl<'a> Admm<'a> {
    /// Samples the elements about `start` (m) and factors the global step. `height_m` is that of the garment, `compression` the k_c of each
    /// triangle (N/m), `distance_m` the signed distance of each vertex.
    pub(super) fn new(
        cloth: &'a Cloth,
        body: &'a Body,
        motions: &'a Motions,
        start: &[DVec3],
        height_m: f64,
        compression: &[f64],
        distance_m: &[f64],
    ) -> Result<Self, SolveError> {
        let tension = cloth.weight / cloth.areas.iter().sum::<f64>() * height_m;
        let parts = motions.first.len();
        let functions = motions.functions_at(start);
        let (penalty, contact_penalty) = (MEMBRANE_PENALTY * tension, CONTACT_PENALTY * tension);
        let mut matrix = PartMatrix::new(&motions.first, &motions.count);
        let rate = |per_root: f64| move |size: f64| per_root / size.sqrt();

        let of_triangle = parts_of(&motions.weights, cloth.triangles.iter().map(|t| &t.vertices[..]));
        let mut membranes = Vec::new();
        let mut membrane_terms = Csr::default();
        let mut terms: Vec<(u32, f64, f64)> = Vec::new();
        let mut unknowns: Vec<u32> = Vec::new();
        for (number, stands_for) in sample(parts, &of_triangle, rate(TRIANGLES_PER_ROOT)) {
            let t = &cloth.triangles[number as usize];
            terms.clear();
            for (&v, b) in t.vertices.iter().zip(&t.gradients) {
                for &(unknown, value) in functions.of(v as usize) {
                    match terms.iter_mut().find(|term| term.0 == unknown) {
                        Some(term) => (term.1, term.2) = (term.1 + b.x * value, term.2 + b.y * value),
                        None => terms.push((unknown, b.x * value, b.y * value)),
                    }
                }
            }
            let area = t.area * stands_for;
            unknowns.clear();
            unknowns.extend(terms.iter().map(|term| term.0));
            let scale = penalty * area;
            matrix.add(&unknowns, |i, j| scale * (terms[i].1 * terms[j].1 + terms[i].2 * terms[j].2));
            membrane_terms.push(terms.iter().copied());
            let fabric = &cloth.fabrics[t.fabric as usize];
            let field = TensionField::new(fabric, cloth.stiffness_of(t), compression[number as usize]);
            membranes.push(Membrane { number, area, field, start: t.deformation(start) });
        }

        let near_m = NEAR_M + distance_m.iter().copied().fold(f64::INFINITY, f64::min).max(0.0);
        let mut near_part = Csr::default();
        for (v, &distance) in distance_m.iter().enumerate() {
            let heaviest = motions.weights.of(v).iter().max_by(|a, b| a.1.total_cmp(&b.1));
            near_part.push(heaviest.filter(|_| distance < near_m).map(|w| w.0));
        }
        let mut nears = Vec::new();
        let mut near_terms = Csr::default();
        for (vertex, stands_for) in sample(parts, &near_part, rate(VERTICES_PER_ROOT)) {
            let v = vertex as usize;
            let (area, own) = (cloth.areas[v] * stands_for, functions.of(v));
            unknowns.clear();
            unknowns.extend(own.iter().map(|term| term.0));
            let scale = contact_penalty * area;
            matrix.add(&unknowns, |i, j| scale * own[i].1 * own[j].1);
            near_terms.push(own.iter().copied());
            nears.push(Near { vertex, area, offset: cloth.offsets[v], friction: cloth.friction[v], start: start[v] });
        }

        let mut load = vec![DVec3::ZERO; motions.unknowns()];
        let mut damping = vec![MIN_DAMPING; motions.unknowns()];
        for (v, &mass) in cloth.masses.iter().enumerate() {
            for &(unknown, value) in functions.of(v) {
                load[unknown as usize].z -= mass * GRAVITY * value;
                damping[unknown as usize] += DAMPING * mass * value * value;
            }
        }
        let factor = matrix.factor(&damping)?;
        let splits = membranes.iter().map(|m| Split { z: m.start, u: [DVec3::ZERO; 2] }).collect();
        let touch = |near: &Near| Touch {
            position: near.start,
            v: DVec3::ZERO,
            plane_at: DVec3::INFINITY,
            plane_distance: f64::NEG_INFINITY,
            normal: DVec3::ZERO,
            anchor: near.start,
        };
        let touches = nears.iter().map(touch).collect();
        Ok(Self {
            q: vec![DVec3::ZERO; motions.unknowns()],
            cloth,
            body,
            motions,
            membranes,
            membrane_terms,
            nears,
            near_terms,
            load,
            damping,
            penalty,
            contact_penalty,
            factor,
            splits,
            touches,
        })
    }

    /// The unknown vectors, m.
    pub(super) fn unknowns(&self) -> &[DVec3] {
        &self.q
    }

    /// Sets the unknowns from which [`iterate`](Self::iterate) starts.
    #[cfg(test)]
    pub(super) fn set_unknowns(&mut self, q: Vec<DVec3>) {
        self.q = q;
        for (k, split) in self.splits.iter_mut().enumerate() {
            split.z = gradient(self.membranes[k].start, self.membrane_terms.of(k), &self.q);
        }
    }

    /// Restarts the maps from other positions x (m), keeping copies and multipliers.
    pub(super) fn rebase(&mut self, x: &[DVec3]) {
        self.q.fill(DVec3::ZERO);
        for membrane in &mut self.membranes {
            membrane.start = self.cloth.triangles[membrane.number as usize].deformation(x);
        }
        for near in &mut self.nears {
            near.start = x[near.vertex as usize];
        }
    }

    /// One iteration. Returns the root mean square change of the unknowns, m.
    pub(super) fn iterate(&mut self) -> f64 {
        self.update_planes();
        let (membranes, nears) = (self.membranes.len() / 2, self.nears.len() / 2);
        let (mut splits, mut touches) = (std::mem::take(&mut self.splits), std::mem::take(&mut self.touches));
        let ((split_a, split_b), (touch_a, touch_b)) = (splits.split_at_mut(membranes), touches.split_at_mut(nears));
        // Always two halves, so that sums have the same bits on any number of threads.
        let (a, b) = rayon::join(
            || self.local_steps((0, split_a), (0, touch_a)),
            || self.local_steps((membranes, split_b), (nears, touch_b)),
        );
        (self.splits, self.touches) = (splits, touches);
        let mut next: Vec<DVec3> =
            (0..self.q.len()).map(|i| self.load[i] + a[i] + b[i] + self.q[i] * self.damping[i]).collect();
        self.factor.solve(&mut next);
        let square: f64 = next.iter().zip(&self.q).map(|(next, q)| next.distance_squared(*q)).sum();
        self.q = next;
        (square / self.q.len() as f64).sqrt()
    }

    /// Updates the tangent planes of near vertices that have moved too far.
    fn update_planes(&mut self) {
        let stale = |(touch, near): &(&mut Touch, &Near)| {
            let radius = (PLANE_RADIUS_SHARE * (touch.plane_distance - near.offset)).max(PLANE_RADIUS_M);
            touch.position.distance_squared(touch.plane_at) > radius * radius
        };
        let stale: Vec<&mut Touch> = self.touches.iter_mut().zip(&self.nears).filter(stale).map(|(t, _)| t).collect();
        // At C, which is outside, and not at c: a vertex pulled deep into the body still leaves it where it entered.
        let at: Vec<DVec3> = stale.iter().map(|touch| touch.position).collect();
        for (touch, found) in stale.into_iter().zip(self.body.nearest_all(&at)) {
            (touch.plane_at, touch.plane_distance, touch.normal) =
                (touch.position, found.signed_distance, found.normal);
        }
    }

    /// Multipliers and local steps of consecutive elements from these numbers on; returns what they give to the global step.
    fn local_steps(
        &self,
        (first_split, splits): (usize, &mut [Split]),
        (first_touch, touches): (usize, &mut [Touch]),
    ) -> Vec<DVec3> {
        let mut side = vec![DVec3::ZERO; self.q.len()];
        for (k, Split { z, u }) in (first_split..).zip(splits) {
            let m = &self.membranes[k];
            let terms = self.membrane_terms.of(k);
            let f = gradient(m.start, terms, &self.q);
            *u = [0, 1].map(|c| u[c] + (f[c] - z[c]) * OVER_RELAXATION);
            *z = m.field.proximal([f[0] + u[0], f[1] + u[1]], self.penalty);
            let [by_u, by_v] = [0, 1].map(|c| (z[c] - u[c] - m.start[c]) * (self.penalty * m.area));
            for &(unknown, along_u, along_v) in terms {
                side[unknown as usize] += by_u * along_u + by_v * along_v;
            }
        }
        for (k, touch) in (first_touch..).zip(touches) {
            let near = &self.nears[k];
            let x = position(near.start, self.near_terms.of(k), &self.q);
            touch.v += (x - touch.position) * OVER_RELAXATION;
            self.separate(near, touch, x);
            let target = (touch.position - touch.v - near.start) * (self.contact_penalty * near.area);
            for &(unknown, value) in self.near_terms.of(k) {
                side[unknown as usize] += target * value;
            }
        }
        side
    }

    /// The local step of a near vertex at x: C from x + V. Returns whether it touches.
    fn separate(&self, near: &Near, touch: &mut Touch, x: DVec3) -> bool {
        let free = x + touch.v;
        let depth = near.offset - touch.plane_distance - touch.normal.dot(free - touch.plane_at);
        if depth <= 0.0 {
            (touch.position, touch.anchor) = (free, x);
            return false;
        }
        let moved = free + touch.normal * depth;
        let slip = (moved - touch.anchor).reject_from_normalized(touch.normal);
        let held = slip.clamp_length_max(near.friction * depth);
        touch.position = moved - held;
        true
    }

    /// Forces on the vertices at the last iterate, by its multipliers.
    pub(super) fn forces(&self) -> Forces {
        let vertices = self.cloth.vertex_count();
        let mut cloth = vec![DVec3::ZERO; vertices];
        for (k, (m, split)) in self.membranes.iter().zip(&self.splits).enumerate() {
            let f = gradient(m.start, self.membrane_terms.of(k), &self.q);
            let full = [0, 1].map(|c| f[c] + split.u[c] + (f[c] - split.z[c]));
            let z = m.field.proximal(full, self.penalty);
            let stress = [0, 1].map(|c| (full[c] - z[c]) * (self.penalty * m.area));
            let t = &self.cloth.triangles[m.number as usize];
            for (&v, b) in t.vertices.iter().zip(&t.gradients) {
                cloth[v as usize] -= stress[0] * b.x + stress[1] * b.y;
            }
        }
        let mut body = vec![DVec3::ZERO; vertices];
        for (k, near) in self.nears.iter().enumerate() {
            let mut touch = self.touches[k];
            let here = position(near.start, self.near_terms.of(k), &self.q);
            touch.v += here - touch.position;
            if self.separate(near, &mut touch, here) {
                let scale = self.contact_penalty * near.area;
                body[near.vertex as usize] = (touch.position - here - touch.v) * scale;
            }
        }
        Forces { cloth, body }
    }

    /// ‖Bᵀ(gravity + forces)‖ over the weight: what does not balance on the PARTs.
    pub(super) fn residual_over_weight(&self, start: &[DVec3], forces: &Forces) -> f64 {
        let sum = |((cloth, body), mass): ((&DVec3, &DVec3), &f64)| *cloth + *body - DVec3::Z * (mass * GRAVITY);
        let all: Vec<DVec3> = forces.cloth.iter().zip(&forces.body).zip(&self.cloth.masses).map(sum).collect();
        let mut reduced = Vec::new();
        self.motions.restrict(start, &all, &mut reduced);
        reduced.iter().map(|r| r.length_squared()).sum::<f64>().sqrt() / self.cloth.weight
    }
}

/// F = F(X) + ∇B q.
fn gradient([mut u, mut v]: [DVec3; 2], terms: &[(u32, f64, f64)], q: &[DVec3]) -> [DVec3; 2] {
    for &(unknown, by_u, by_v) in terms {
        let q = q[unknown as usize];
        (u, v) = (u + q * by_u, v + q * by_v);
    }
    [u, v]
}

/// x = X + B q.
fn position(start: DVec3, terms: &[(u32, f64)], q: &[DVec3]) -> DVec3 {
    terms.iter().fold(start, |x, &(unknown, value)| x + q[unknown as usize] * value)
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
        let (none, distances) = (vec![0.0; mesh.triangles.len()], vec![100.0; mesh.vertex_count()]);
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            0.4 * ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
        };
        let mut first: Option<Vec<DVec3>> = None;
        for start in 0..50 {
            let mut admm = Admm::new(&cloth, &far, &motions, &mesh.positions, 0.3, &none, &distances).unwrap();
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
