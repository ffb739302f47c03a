//! The Hessian in the PARTs' motions, H_r = Bᵀ (∇²E⁺ + ε M) B, and the Newton step by it.
//!
//! B is linear in the motions about the present positions ([`motions`](super::motions)); ∇²E⁺ is the positive Hessian of the whole
//! cloth. With a = ∇φ the gradient of a PART's function over a triangle, its membrane brings A (a_u H_uu b_u + a_u H_uv b_v + …) to each
//! pair of functions; bending and masses bring a scalar, contact and friction a block for each vertex that touches. Membrane and bending
//! are sampled ([`elements`](super::elements)): a step need not be Newton's to the last digit, since the energy that judges it
//! is whole. They are summed up in [`sums`](super::sums).

use glam::{DMat3, DVec3};

use super::elements::Layout;
use super::motions::{Motions, RIDGE};
use super::sums::{Element, Sums};
use crate::mechanics::energy::Cloth;
use crate::mechanics::newton::{SolveError, Solver, State, Tangent};

/// Newton steps in the PARTs' motions.
#[derive(Debug)]
pub(super) struct Reduced {
    motions: Motions,
    layout: Layout,
    solver: Solver,
    blocks: Vec<DMat3>,
    sums: [Sums; 2],
    unknowns: Vec<DVec3>,
    undamped: Vec<f64>,
}

impl Reduced {
    pub(super) fn new(cloth: &Cloth, mut motions: Motions) -> Self {
        let layout = Layout::new(cloth, &mut motions);
        let solver = Solver::new(&layout.pattern);
        let undamped = vec![0.0; motions.unknowns()];
        let sums = [Sums::default(), Sums::default()];
        Self { motions, layout, solver, blocks: Vec::new(), sums, unknowns: Vec::new(), undamped }
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
        let Self { motions, layout, blocks, sums, .. } = self;
        let functions = motions.functions();
        for sums in &mut *sums {
            sums.clear(layout.places.len());
        }
        let [first, second] = &mut *sums;
        let (all, half) = (layout.triangles.sampled.len(), layout.triangles.sampled.len() / 2);
        rayon::join(
            || first.add(&functions, here, &layout.triangles, Element::Triangles(0..half)),
            || {
                second.add(&functions, here, &layout.triangles, Element::Triangles(half..all));
                second.add(&functions, here, &layout.rings, Element::Rings);
                second.add(&functions, here, &layout.vertices, Element::Vertices);
            },
        );
        first.join(second);
        blocks.clear();
        blocks.resize(layout.pattern.rows.len(), DMat3::ZERO);
        for (number, place) in layout.places.iter().enumerate().skip(1) {
            let [rows, columns] = [place.row, place.column].map(|p| usize::from(motions.count[p as usize]));
            let column = motions.first[place.column as usize] as usize;
            for b in 0..columns {
                let start = layout.pattern.starts[column + b] as usize;
                // Of a PART's own block only the lower half is stored, before the blocks of its neighbours.
                let own = place.row == place.column;
                let (from, start) = if own { (b, start) } else { (0, start + columns - b + place.skip as usize) };
                for a in from..rows {
                    blocks[start + a - from] = first.block(number, a, b);
                }
            }
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
            || here.cloth.diagonal_blocks(here.x, here.contacts, here.damping, own),
        );
        solved?;
        self.motions.prolong(here.x, &self.unknowns, d);
        Ok(())
    }

    fn fall_back(&mut self) -> bool {
        false
    }
}
