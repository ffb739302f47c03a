//! Sampled elements of a table: triangles and vertices near the body, their copies and multipliers, and the local steps.
//!
//! For the energy and the symbols see [`admm`](super::admm). With F = F(X) + ∇B q of a triangle and c = X + B q of a vertex, an iteration updates
//!
//! U ← U + α (F − Z), Z = argmin ψ(Z) + w/2 |Z − (F + U)|²; V ← V + α (c − C), C from c + V out of the body, with friction;
//!
//! and adds w A (∇B)ᵀ (Z − U − F(X)) and w_c a Bᵀ (C − V − X) to the right side of the global step. Triangles are taken four at a time.
//!
//! Limits: a vertex is kept outside of a tangent plane of the body, which is renewed when the vertex has moved.

use glam::DVec3;

use super::clearance::TangentPlane;
use super::local_step::TensionFields;
use super::part_matrix::PartMatrix;
use crate::base::simd::{Four, Lanes, Pack, Vectors, Work, run};
use crate::body::distance::SurfacePoint;
use crate::mechanics::energy::Cloth;
use crate::mesh::Csr;

/// α: 1.5 to 1.8 is usual.
const OVER_RELAXATION: f64 = 1.6;

/// Unknowns of a sampled triangle with the derivatives of their functions along weft and warp.
type MembraneTerm = (u32, f64, f64);

/// Four sampled triangles; the last of a half are padded by triangles without terms.
#[derive(Debug, Clone, Copy)]
pub(super) struct Membranes {
    fields: TensionFields,
    /// w A, N·m.
    scale: Four,
    /// F at X of each: its columns, padded.
    pub(super) start: [[Four; 2]; 4],
    pub(super) numbers: [u32; 4],
}

/// The copies Z and the multipliers U of four triangles, their columns by coordinate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Splits {
    z: [[Four; 3]; 2],
    u: [[Four; 3]; 2],
}

/// A sampled vertex near the body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    pub(super) vertex: u32,
    /// a, m².
    pub(super) area: f64,
    pub(super) offset: f64,
    pub(super) friction: f64,
    pub(super) start: DVec3,
}

/// The copy C and the multiplier V of a near vertex, its tangent plane of the body, and the anchor of its friction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pub(super) position: DVec3,
    pub(super) v: DVec3,
    pub(super) plane: TangentPlane,
    pub(super) anchor: DVec3,
}

/// Half of the samples: always the same two halves, so that sums have the same bits on any number of threads.
#[derive(Default)]
pub(super) struct Half {
    pub(super) membranes: Vec<Membranes>,
    /// Of each triangle, the padding included.
    pub(super) membrane_terms: Csr<MembraneTerm>,
    pub(super) splits: Vec<Splits>,
    pub(super) nears: Vec<Near>,
    pub(super) near_terms: Csr<(u32, f64)>,
    pub(super) touches: Vec<Touch>,
}

impl Half {
    /// Adds sampled triangles, each with the number of elements that it stands for.
    pub(super) fn add_membranes(
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
    pub(super) fn add_nears(
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
                plane: TangentPlane::new(start[v], &surface[v]),
                anchor: start[v],
            });
        }
    }

    /// Adds w Σ A (∇B)ᵀ ∇B.
    pub(super) fn assemble_membranes(&self, matrix: &mut PartMatrix) {
        let mut unknowns: Vec<u32> = Vec::new();
        for k in 0..self.membrane_terms.len() {
            let (terms, scale) = (self.membrane_terms.of(k), self.membranes[k / 4].scale.0[k % 4]);
            unknowns.clear();
            unknowns.extend(terms.iter().map(|term| term.0));
            matrix.add(&unknowns, |i, j| scale * (terms[i].1 * terms[j].1 + terms[i].2 * terms[j].2));
        }
    }

    /// Adds w_c Σ a BᵀB.
    pub(super) fn assemble_nears(&self, contact_penalty: f64, matrix: &mut PartMatrix) {
        let mut unknowns: Vec<u32> = Vec::new();
        for (k, near) in self.nears.iter().enumerate() {
            let (terms, scale) = (self.near_terms.of(k), contact_penalty * near.area);
            unknowns.clear();
            unknowns.extend(terms.iter().map(|term| term.0));
            matrix.add(&unknowns, |i, j| scale * terms[i].1 * terms[j].1);
        }
    }

    /// Multipliers and local steps; returns their share of the global step's right side, padded.
    pub(super) fn local_steps(&mut self, q: &[DVec3], (penalty, contact_penalty): (f64, f64)) -> Vec<Four> {
        let q: Vec<Four> = q.iter().copied().map(padded).collect();
        let mut side = vec![Four::ZERO; q.len()];
        run(MembraneSteps { half: self, penalty, q: &q, side: &mut side });
        run(ContactSteps { half: self, contact_penalty, q: &q, side: &mut side });
        side
    }

    /// Number, and stress times area at q by its multiplier (N), of the triangle k; of zero for padding.
    pub(super) fn stress(&self, k: usize, q: &[DVec3], penalty: f64) -> (u32, [DVec3; 2]) {
        let (i, membranes, splits) = (k % 4, &self.membranes[k / 4], &self.splits[k / 4]);
        let column = |of: &[Four; 3]| DVec3::from_array([0, 1, 2].map(|axis| of[axis].0[i]));
        let f = self.gradient(k, q);
        let full = [0, 1].map(|c| f[c] + column(&splits.u[c]) + (f[c] - column(&splits.z[c])));
        let z = membranes.fields.proximal_of(i, full, penalty);
        (membranes.numbers[i], [0, 1].map(|c| (full[c] - z[c]) * membranes.scale.0[i]))
    }

    /// F = F(X) + ∇B q of the triangle k.
    pub(super) fn gradient(&self, k: usize, q: &[DVec3]) -> [DVec3; 2] {
        let [mut u, mut v] = self.membranes[k / 4].start[k % 4].map(unpadded);
        for &(unknown, by_u, by_v) in self.membrane_terms.of(k) {
            let q = q[unknown as usize];
            (u, v) = (u + q * by_u, v + q * by_v);
        }
        [u, v]
    }
}

impl Splits {
    pub(super) fn set_z(&mut self, i: usize, columns: [DVec3; 2]) {
        for (slot, column) in self.z.iter_mut().zip(columns) {
            (0..3).for_each(|axis| slot[axis].0[i] = column[axis]);
        }
    }
}

impl Near {
    /// The local step at x: C from x + V. Returns whether it touches.
    #[inline(always)]
    pub(super) fn separate(&self, touch: &mut Touch, x: DVec3) -> bool {
        let free = x + touch.v;
        let depth = self.offset - touch.plane.distance(free);
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
pub(super) fn padded(v: DVec3) -> Four {
    Four([v.x, v.y, v.z, 0.0])
}

#[inline(always)]
pub(super) fn unpadded(Four([x, y, z, _]): Four) -> DVec3 {
    DVec3::new(x, y, z)
}

/// x = X + B q.
pub(super) fn position(start: DVec3, terms: &[(u32, f64)], q: &[DVec3]) -> DVec3 {
    terms.iter().fold(start, |x, &(unknown, value)| x + q[unknown as usize] * value)
}
