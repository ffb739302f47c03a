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

use super::local_step::TensionFields;
use super::motions::Motions;
use super::part_matrix::{PartFactor, PartMatrix};
use super::sampling::{parts_of, sample};
use crate::GRAVITY;
use crate::base::simd::{Four, Lanes, Pack, Vectors, Work, run};
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

/// Unknowns of a sampled triangle with the derivatives of their functions along weft and warp.
type MembraneTerm = (u32, f64, f64);

/// Four sampled triangles; the last of a half are padded by triangles without terms.
#[derive(Debug, Clone, Copy)]
struct Membranes {
    fields: TensionFields,
    /// w A, N·m.
    scale: Four,
    /// F at X of each: its columns, padded.
    start: [[Four; 2]; 4],
    numbers: [u32; 4],
}

/// The copies Z and the multipliers U of four triangles, their columns by coordinate.
#[derive(Debug, Clone, Copy)]
struct Splits {
    z: [[Four; 3]; 2],
    u: [[Four; 3]; 2],
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
    plane: SurfacePoint,
    anchor: DVec3,
}

/// Half of the samples: always the same two halves, so that sums have the same bits on any number of threads.
#[derive(Default)]
struct Half {
    membranes: Vec<Membranes>,
    /// Of each triangle, the padding included.
    membrane_terms: Csr<MembraneTerm>,
    splits: Vec<Splits>,
    nears: Vec<Near>,
    near_terms: Csr<(u32, f64)>,
    touches: Vec<Touch>,
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
        let rate = |per_root: f64| move |size: f64| per_root / size.sqrt();
        let parts = motions.first.len();
        let (functions, (triangles, vertices)) = rayon::join(
            || motions.functions_at(start),
            || {
                let of_triangle = parts_of(&motions.weights, &cloth.triangles);
                let triangles = sample(parts, &of_triangle, rate(TRIANGLES_PER_ROOT));
                let near_m = NEAR_M + surface.iter().map(|s| s.signed_distance).fold(f64::INFINITY, f64::min).max(0.0);
                let mut near_part = Csr::default();
                for (v, s) in surface.iter().enumerate() {
                    let heaviest = motions.weights.of(v).iter().max_by(|a, b| a.1.total_cmp(&b.1));
                    near_part.push(heaviest.filter(|_| s.signed_distance < near_m).map(|w| w.0));
                }
                (triangles, sample(parts, &near_part, rate(VERTICES_PER_ROOT)))
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
        let assembled = || {
            let mut matrix = PartMatrix::new(&motions.first, &motions.count);
            halves.iter().for_each(|half| half.assemble_membranes(&mut matrix));
            halves.iter().for_each(|half| half.assemble_nears(contact_penalty, &mut matrix));
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
        let (matrix, (load, damping)) = rayon::join(assembled, loads);
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
        for half in &mut self.halves {
            for membranes in &mut half.membranes {
                membranes.start =
                    membranes.numbers.map(|t| self.cloth.triangles[t as usize].deformation(x).map(padded));
            }
            for near in &mut half.nears {
                near.start = x[near.vertex as usize];
            }
        }
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

    /// Updates the tangent planes of near vertices that have moved too far.
    fn update_planes(&mut self) {
        let stale = |(touch, near): &(&mut Touch, &Near)| {
            let radius = (PLANE_RADIUS_SHARE * (touch.plane.signed_distance - near.offset)).max(PLANE_RADIUS_M);
            touch.position.distance_squared(touch.plane_at) > radius * radius
        };
        let all = self.halves.iter_mut().flat_map(|half| half.touches.iter_mut().zip(&half.nears));
        let stale: Vec<&mut Touch> = all.filter(stale).map(|(touch, _)| touch).collect();
        // At C, which is outside, and not at c: a vertex pulled deep into the body still leaves it where it entered.
        let at: Vec<DVec3> = stale.iter().map(|touch| touch.position).collect();
        let hints: Vec<u32> = stale.iter().map(|touch| touch.plane.triangle).collect();
        for (touch, found) in stale.into_iter().zip(self.body.nearest_all_from(&at, &hints)) {
            (touch.plane_at, touch.plane) = (touch.position, found);
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

impl Half {
    /// Adds sampled triangles, each with the number of elements that it stands for.
    fn add_membranes(
        &mut self,
        cloth: &Cloth,
        functions: &Csr<(u32, f64)>,
        start: &[DVec3],
        (penalty, compression): (f64, &[f64]),
        sampled: &[(u32, f64)],
    ) {
        let mut terms: Vec<MembraneTerm> = Vec::new();
        for four in sampled.chunks(4) {
            let mut membranes = Membranes {
                fields: TensionFields::default(),
                scale: Four::ZERO,
                start: [[Four::ZERO; 2]; 4],
                numbers: [four[0].0; 4],
            };
            for (i, &(number, stands_for)) in four.iter().enumerate() {
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
                self.membrane_terms.push(terms.iter().copied());
                let fabric = &cloth.fabrics[t.fabric as usize];
                membranes.fields.set(i, fabric, cloth.stiffness_of(t), compression[number as usize]);
                membranes.scale.0[i] = penalty * (t.area * stands_for);
                membranes.numbers[i] = number;
            }
            (four.len()..4).for_each(|_| self.membrane_terms.push([]));
            membranes.start = membranes.numbers.map(|t| cloth.triangles[t as usize].deformation(start).map(padded));
            let mut splits = Splits { z: [[Four::ZERO; 3]; 2], u: [[Four::ZERO; 3]; 2] };
            for (i, columns) in membranes.start.iter().enumerate() {
                splits.set_z(i, columns.map(unpadded));
            }
            self.membranes.push(membranes);
            self.splits.push(splits);
        }
    }

    /// Adds sampled vertices, each with the number of vertices that it stands for.
    fn add_nears(
        &mut self,
        cloth: &Cloth,
        functions: &Csr<(u32, f64)>,
        (start, surface): (&[DVec3], &[SurfacePoint]),
        sampled: &[(u32, f64)],
    ) {
        for &(vertex, stands_for) in sampled {
            let v = vertex as usize;
            self.near_terms.push(functions.of(v).iter().copied());
            let (area, offset, friction) = (cloth.areas[v] * stands_for, cloth.offsets[v], cloth.friction[v]);
            self.nears.push(Near { vertex, area, offset, friction, start: start[v] });
            self.touches.push(Touch {
                position: start[v],
                v: DVec3::ZERO,
                plane_at: start[v],
                plane: surface[v],
                anchor: start[v],
            });
        }
    }

    /// Adds w Σ A (∇B)ᵀ ∇B.
    fn assemble_membranes(&self, matrix: &mut PartMatrix) {
        let mut unknowns: Vec<u32> = Vec::new();
        for k in 0..self.membrane_terms.len() {
            let (terms, scale) = (self.membrane_terms.of(k), self.membranes[k / 4].scale.0[k % 4]);
            unknowns.clear();
            unknowns.extend(terms.iter().map(|term| term.0));
            matrix.add(&unknowns, |i, j| scale * (terms[i].1 * terms[j].1 + terms[i].2 * terms[j].2));
        }
    }

    /// Adds w_c Σ a BᵀB.
    fn assemble_nears(&self, contact_penalty: f64, matrix: &mut PartMatrix) {
        let mut unknowns: Vec<u32> = Vec::new();
        for (k, near) in self.nears.iter().enumerate() {
            let (terms, scale) = (self.near_terms.of(k), contact_penalty * near.area);
            unknowns.clear();
            unknowns.extend(terms.iter().map(|term| term.0));
            matrix.add(&unknowns, |i, j| scale * terms[i].1 * terms[j].1);
        }
    }

    /// Multipliers and local steps; returns their share of the global step's right side, padded.
    fn local_steps(&mut self, q: &[DVec3], (penalty, contact_penalty): (f64, f64)) -> Vec<Four> {
        let q: Vec<Four> = q.iter().copied().map(padded).collect();
        let mut side = vec![Four::ZERO; q.len()];
        run(MembraneSteps { half: self, penalty, q: &q, side: &mut side });
        run(ContactSteps { half: self, contact_penalty, q: &q, side: &mut side });
        side
    }

    /// Number, and stress times area at q by its multiplier (N), of the triangle k; of zero for padding.
    fn stress(&self, k: usize, q: &[DVec3], penalty: f64) -> (u32, [DVec3; 2]) {
        let (i, membranes, splits) = (k % 4, &self.membranes[k / 4], &self.splits[k / 4]);
        let column = |of: &[Four; 3]| DVec3::from_array([0, 1, 2].map(|axis| of[axis].0[i]));
        let f = self.gradient(k, q);
        let full = [0, 1].map(|c| f[c] + column(&splits.u[c]) + (f[c] - column(&splits.z[c])));
        let z = membranes.fields.proximal_of(i, full, penalty);
        (membranes.numbers[i], [0, 1].map(|c| (full[c] - z[c]) * membranes.scale.0[i]))
    }

    /// F = F(X) + ∇B q of the triangle k.
    fn gradient(&self, k: usize, q: &[DVec3]) -> [DVec3; 2] {
        let [mut u, mut v] = self.membranes[k / 4].start[k % 4].map(unpadded);
        for &(unknown, by_u, by_v) in self.membrane_terms.of(k) {
            let q = q[unknown as usize];
            (u, v) = (u + q * by_u, v + q * by_v);
        }
        [u, v]
    }
}

impl Splits {
    fn set_z(&mut self, i: usize, columns: [DVec3; 2]) {
        for (slot, column) in self.z.iter_mut().zip(columns) {
            (0..3).for_each(|axis| slot[axis].0[i] = column[axis]);
        }
    }
}

impl Near {
    /// The local step at x: C from x + V. Returns whether it touches.
    #[inline(always)]
    fn separate(&self, touch: &mut Touch, x: DVec3) -> bool {
        let free = x + touch.v;
        let depth = self.offset - touch.plane.signed_distance - touch.plane.normal.dot(free - touch.plane_at);
        if depth <= 0.0 {
            (touch.position, touch.anchor) = (free, x);
            return false;
        }
        let moved = free + touch.plane.normal * depth;
        let slip = (moved - touch.anchor).reject_from_normalized(touch.plane.normal);
        let held = slip.clamp_length_max(self.friction * depth);
        touch.position = moved - held;
        true
    }
}

/// Multipliers and local steps of the triangles of a half, four at a time.
struct MembraneSteps<'a> {
    half: &'a mut Half,
    penalty: f64,
    q: &'a [Four],
    side: &'a mut [Four],
}

impl Work for MembraneSteps<'_> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        let Self { half: Half { membranes, membrane_terms, splits, .. }, penalty, q, side } = self;
        // Equal lengths let one bounds check serve both slices.
        let side = &mut side[..q.len()];
        let (w, alpha) = (Pack::splat(l, penalty), Pack::splat(l, OVER_RELAXATION));
        for (p, (m, split)) in membranes.iter().zip(splits).enumerate() {
            let start = m.start;
            let mut f = [[l.splat(0.0); 4]; 2];
            for i in 0..4 {
                let (mut u, mut v) = (l.load(&start[i][0]), l.load(&start[i][1]));
                for &(unknown, by_u, by_v) in membrane_terms.of(4 * p + i) {
                    let q = l.load(&q[unknown as usize]);
                    u = l.add(u, l.mul(q, l.splat(by_u)));
                    v = l.add(v, l.mul(q, l.splat(by_v)));
                }
                (f[0][i], f[1][i]) = (u, v);
            }
            let [fu, fv] = [Vectors::from_rows(l, f[0]), Vectors::from_rows(l, f[1])];
            let [zu, zv] = [Vectors::load(l, &split.z[0]), Vectors::load(l, &split.z[1])];
            let uu = Vectors::load(l, &split.u[0]) + (fu - zu) * alpha;
            let uv = Vectors::load(l, &split.u[1]) + (fv - zv) * alpha;
            let [zu, zv] = m.fields.proximal(l, [fu + uu, fv + uv], w);
            (split.u, split.z) = ([uu.store(), uv.store()], [zu.store(), zv.store()]);
            let scale = Pack::load(l, &m.scale);
            let rows = |i: usize| [0, 1, 2, 3].map(|k| l.load(&start[k][i]));
            let by_u = ((zu - uu - Vectors::from_rows(l, rows(0))) * scale).rows(l);
            let by_v = ((zv - uv - Vectors::from_rows(l, rows(1))) * scale).rows(l);
            for i in 0..4 {
                for &(unknown, along_u, along_v) in membrane_terms.of(4 * p + i) {
                    let slot = &mut side[unknown as usize];
                    let pull = l.add(l.mul(by_u[i], l.splat(along_u)), l.mul(by_v[i], l.splat(along_v)));
                    *slot = l.store(l.add(l.load(slot), pull));
                }
            }
        }
    }
}

/// Multipliers and local steps of the near vertices of a half.
struct ContactSteps<'a> {
    half: &'a mut Half,
    contact_penalty: f64,
    q: &'a [Four],
    side: &'a mut [Four],
}

impl Work for ContactSteps<'_> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        let Self { half: Half { nears, near_terms, touches, .. }, contact_penalty, q, side } = self;
        let side = &mut side[..q.len()];
        for (k, (near, touch)) in nears.iter().zip(touches).enumerate() {
            let terms = near_terms.of(k);
            let mut x = l.load(&padded(near.start));
            for &(unknown, value) in terms {
                x = l.add(x, l.mul(l.load(&q[unknown as usize]), l.splat(value)));
            }
            let x = unpadded(l.store(x));
            touch.v += (x - touch.position) * OVER_RELAXATION;
            near.separate(touch, x);
            let target = (touch.position - touch.v - near.start) * (contact_penalty * near.area);
            let target = l.load(&padded(target));
            for &(unknown, value) in terms {
                let slot = &mut side[unknown as usize];
                *slot = l.store(l.add(l.load(slot), l.mul(target, l.splat(value))));
            }
        }
    }
}

/// A vector and a zero.
#[inline(always)]
fn padded(v: DVec3) -> Four {
    Four([v.x, v.y, v.z, 0.0])
}

#[inline(always)]
fn unpadded(Four([x, y, z, _]): Four) -> DVec3 {
    DVec3::new(x, y, z)
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
