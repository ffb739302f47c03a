//! The Hessian in the PARTs' motions, H_r = Bᵀ (∇²E⁺ + ε M) B, and the Newton step by it.
//!
//! B is linear in the motions about the present positions ([`motions`](super::motions)); ∇²E⁺ is the positive Hessian of the whole
//! cloth. With a = ∇φ the gradient of a PART's function over a triangle, its membrane brings A (a_u H_uu b_u + a_u H_uv b_v + …) to each
//! pair of functions; bending and masses bring a scalar, contact and friction a block for each vertex that touches. Membrane and bending
//! are sampled ([`elements`](super::elements)): a step need not be Newton's to the last digit, since the energy that judges it
//! is whole.

use glam::{DMat3, DVec3};

use super::elements::{Elements, Layout};
use super::motions::{Motions, RIDGE, Values};
use crate::mechanics::energy::Cloth;
use crate::mechanics::newton::{SolveError, Solver, State, Tangent};

/// Newton steps in the PARTs' motions.
#[derive(Debug)]
pub(super) struct Reduced {
    motions: Motions,
    layout: Layout,
    solver: Solver,
    blocks: Vec<DMat3>,
    other: Vec<DMat3>,
    unknowns: Vec<DVec3>,
    undamped: Vec<f64>,
}

impl Reduced {
    pub(super) fn new(cloth: &Cloth, mut motions: Motions) -> Result<Self, SolveError> {
        let layout = Layout::new(cloth, &mut motions);
        let solver = Solver::new(&layout.pattern)?;
        let undamped = vec![0.0; motions.unknowns()];
        let (blocks, other, unknowns) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { motions, layout, solver, blocks, other, unknowns, undamped })
    }

    /// Unknown vectors.
    pub(super) fn unknowns(&self) -> usize {
        self.motions.unknowns()
    }

    /// ‖R‖₂ over the PARTs' displacements, N, with R the force on each PART by its weights: the first of its unknowns.
    pub(super) fn residual(&mut self, here: &State<'_>) -> f64 {
        self.motions.restrict(here.x, here.gradient, &mut self.unknowns);
        let moving = self.motions.first.iter().zip(&self.motions.count).filter(|(_, count)| **count > 0);
        moving.map(|(&first, _)| self.unknowns[first as usize].length_squared()).sum::<f64>().sqrt()
    }

    /// Fills the blocks: membrane on one core, the rest on the other, always so, for the same bits.
    fn assemble(&mut self, here: &State<'_>) {
        let Self { motions, layout, blocks, other, .. } = self;
        let sum = Sum { motions, starts: &layout.pattern.starts };
        for list in [&mut *blocks, &mut *other] {
            list.clear();
            list.resize(layout.pattern.rows.len(), DMat3::ZERO);
        }
        let (sampled, half) = (&layout.triangles.sampled, layout.triangles.sampled.len() / 2);
        rayon::join(
            || sum.membrane(here, &layout.triangles, &sampled[..half], blocks),
            || {
                sum.membrane(here, &layout.triangles, &sampled[half..], other);
                sum.bending(here, &layout.rings, other);
                sum.vertices(here, &layout.vertices, other);
            },
        );
        for (block, other) in blocks.iter_mut().zip(&*other) {
            *block += *other;
        }
        for &diagonal in &layout.pattern.starts[..self.undamped.len()] {
            let block = &mut blocks[diagonal as usize];
            let trace = block.x_axis.x + block.y_axis.y + block.z_axis.z;
            *block += DMat3::from_diagonal(DVec3::splat(RIDGE * trace + f64::MIN_POSITIVE.sqrt()));
        }
    }
}

impl Tangent for Reduced {
    fn step(&mut self, here: &State<'_>, d: &mut Vec<DVec3>, own: &mut Vec<DMat3>) -> Result<(), SolveError> {
        self.motions.centre_at(here.x);
        self.assemble(here);
        self.motions.restrict(here.x, here.gradient, &mut self.unknowns);
        for q in &mut self.unknowns {
            *q = -*q;
        }
        let Self { solver, layout, blocks, undamped, unknowns, .. } = self;
        let (solved, ()) = rayon::join(
            || solver.solve(&layout.pattern, blocks, undamped, true, unknowns),
            || here.cloth.own_blocks(here.x, here.contacts, here.damping, own),
        );
        solved?;
        self.motions.prolong(here.x, &self.unknowns, d);
        Ok(())
    }

    fn pause(&mut self) -> bool {
        false
    }
}

/// Adds elements up.
#[derive(Clone, Copy)]
struct Sum<'a> {
    motions: &'a Motions,
    starts: &'a [u32],
}

impl Sum<'_> {
    fn membrane(&self, here: &State<'_>, all: &Elements, sampled: &[(u32, f64)], blocks: &mut [DMat3]) {
        let State { cloth, x, .. } = *here;
        let mut gradients: Vec<[[f64; 2]; 4]> = Vec::new();
        let mut halves: Vec<[[DMat3; 2]; 4]> = Vec::new();
        for &(i, standing_for) in sampled {
            let i = i as usize;
            let (t, parts, weights) = (&cloth.triangles[i], all.parts(i), all.weights(i));
            let [huu, huv, hvv] = t.by_gradient(&cloth.stiffness, x, false).map(|h| h * (t.area * standing_for));
            let hvu = huv.transpose();
            gradients.clear();
            halves.clear();
            for (&p, weights) in parts.iter().zip(weights.chunks_exact(3)) {
                let mut gradient = [[0.0; 2]; 4];
                for c in 0..3 {
                    let values = self.motions.values(p, weights[c], x[t.vertices[c] as usize]);
                    for (g, f) in gradient.iter_mut().zip(values) {
                        g[0] += f * t.gradients[c].x;
                        g[1] += f * t.gradients[c].y;
                    }
                }
                gradients.push(gradient);
                halves.push(gradient.map(|[u, v]| [huu * u + hvu * v, huv * u + hvv * v]));
            }
            self.scatter(all, i, blocks, |row, a, column, b| {
                let [u, v] = gradients[column][b];
                let [left_u, left_v] = &halves[row][a];
                *left_u * u + *left_v * v
            });
        }
    }

    fn bending(&self, here: &State<'_>, all: &Elements, blocks: &mut [DMat3]) {
        let State { cloth, x, .. } = *here;
        let mut derivatives: Vec<[DVec3; 4]> = Vec::new();
        let mut sampled = all.sampled.iter().peekable();
        for (i, (vertices, ring, stiffness)) in cloth.bending.elements().enumerate() {
            let Some(&(_, standing_for)) = sampled.next_if(|s| s.0 as usize == i) else { continue };
            let stiffness = stiffness * standing_for;
            derivatives.clear();
            for (&p, weights) in all.parts(i).iter().zip(all.weights(i).chunks_exact(vertices.len())) {
                let mut derivative = [DVec3::ZERO; 4];
                for ((&v, r), &w) in vertices.iter().zip(ring).zip(weights).filter(|(_, w)| **w > 0.0) {
                    for (d, f) in derivative.iter_mut().zip(self.motions.values(p, w, x[v as usize])) {
                        *d += *r * f;
                    }
                }
                derivatives.push(derivative);
            }
            self.scatter(all, i, blocks, |row, a, column, b| {
                scalar((derivatives[row][a] * stiffness).dot(derivatives[column][b]))
            });
        }
    }

    /// Masses times the damping, contact and friction.
    fn vertices(&self, here: &State<'_>, all: &Elements, blocks: &mut [DMat3]) {
        let State { cloth, x, contacts, damping, .. } = *here;
        let functions = |v: usize| -> Vec<Values> {
            let of = |(&p, &w): (&u32, &f64)| self.motions.values(p, w, x[v]);
            all.parts(v).iter().zip(all.weights(v)).map(of).collect()
        };
        for v in 0..x.len() {
            let (values, mass) = (functions(v), cloth.masses[v] * damping);
            self.scatter(all, v, blocks, |row, a, column, b| scalar(mass * values[row][a] * values[column][b]));
        }
        for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
            let values = functions(v as usize);
            self.scatter(all, v as usize, blocks, |row, a, column, b| block * (values[row][a] * values[column][b]));
        }
    }

    /// Adds an element's block for every pair of its PARTs' functions.
    #[inline]
    fn scatter(
        &self,
        all: &Elements,
        element: usize,
        blocks: &mut [DMat3],
        block: impl Fn(usize, usize, usize, usize) -> DMat3,
    ) {
        let parts = all.parts(element);
        for pair in all.pairs(element) {
            let (row, column) = (pair.row as usize, pair.column as usize);
            let (p, q) = (parts[row] as usize, parts[column] as usize);
            let (rows, columns) = (self.motions.count[p] as usize, self.motions.count[q] as usize);
            for b in 0..columns {
                let start = self.starts[self.motions.first[q] as usize + b] as usize;
                let (from, start) = if p == q { (b, start) } else { (0, start + columns - b + pair.skip as usize) };
                for a in from..rows {
                    blocks[start + a - from] += block(row, a, column, b);
                }
            }
        }
    }
}

fn scalar(s: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(s))
}
