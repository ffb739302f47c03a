//! ∇²E of the whole cloth: its positive part, or with the compression that triangles bear, and every vertex's own block.
//!
//! Blocks are in the order of a [`HessianLayout`]: the cloth's own, or one with places for the gaps of the cloth with itself.

use glam::{DMat3, DVec3};

use super::sparsity::HELD;
use super::{Cloth, Contacts, HessianLayout};

/// What contact adds to the Hessian: unknowns with their shares, and the matrix between them, N/m.
pub(crate) type Held = (Vec<(u32, f64)>, DMat3);

impl Cloth {
    /// Blocks of the positive part of ∇²E at `x`, N/m, in the order of [`pattern`](Self::pattern).
    pub fn hessian(&self, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.hessian_in(self.layout(), false, x, contacts, blocks);
    }

    /// Blocks of ∇²E at `x`, N/m, with the compression that the triangles bear: see [`membrane`](super::membrane). Closer
    /// than [`hessian`](Self::hessian), and not always positive.
    pub fn hessian_bearing(&self, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.hessian_in(self.layout(), true, x, contacts, blocks);
    }

    /// Each vertex's own block of the positive part of ∇²E + ε M at `x`, N/m.
    pub(crate) fn own_blocks(&self, x: &[DVec3], contacts: &Contacts, damping: f64, blocks: &mut Vec<DMat3>) {
        blocks.clear();
        blocks.extend(
            self.masses
                .iter()
                .enumerate()
                .map(|(v, mass)| DMat3::from_diagonal(DVec3::splat(self.bending.plate.own(v) + damping * mass))),
        );
        for (t, &slack) in self.triangles.iter().zip(&*self.slack) {
            for (&v, block) in t.vertices.iter().zip(t.own_blocks(self.stiffness_of(t), slack, x)) {
                blocks[v as usize] += block;
            }
        }
        for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
            blocks[v as usize] += block;
        }
        for (gap, block) in contacts.proximity.iter().flat_map(|p| p.hessian(x)) {
            for (v, w) in gap.members() {
                blocks[v as usize] += block * (w * w);
            }
        }
    }

    /// One or the other, `bearing` compression or positive, in the blocks of any layout.
    pub(crate) fn hessian_in(
        &self,
        layout: &HessianLayout,
        bearing: bool,
        x: &[DVec3],
        contacts: &Contacts,
        blocks: &mut Vec<DMat3>,
    ) {
        blocks.clear();
        blocks.extend(layout.bending_blocks.iter().map(|&b| DMat3::from_diagonal(DVec3::splat(b))));
        for ((t, &slack), slots) in self.triangles.iter().zip(&*self.slack).zip(&layout.triangle_slots) {
            let parts = t.hessian(self.stiffness_of(t), slack, x, bearing);
            for (slot, part) in slots.iter().zip(&parts) {
                if slot.block != HELD {
                    blocks[slot.block as usize] += if slot.transposed { part.transpose() } else { *part };
                }
            }
        }
        for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
            let i = layout.unknown[v as usize];
            if i != HELD {
                blocks[layout.pattern.starts[i as usize] as usize] += block;
            }
        }
        for (gap, block) in contacts.proximity.iter().flat_map(|p| p.hessian(x)) {
            let members = layout.free(gap.members());
            layout.add(&members, block, blocks);
        }
    }

    /// What body, friction and gaps add to ∇²E at `x`, N/m: unknowns of a layout with their shares, and the matrix between them.
    pub(crate) fn held_in(&self, layout: &HessianLayout, x: &[DVec3], contacts: &Contacts) -> Vec<Held> {
        let on_body = contacts.hessian().chain(contacts.friction.hessian(x));
        let by_body = on_body.map(|(v, block)| (layout.free(std::iter::once((v, 1.0))), block));
        let gaps = contacts.proximity.iter().flat_map(|p| p.hessian(x));
        by_body.chain(gaps.map(|(gap, block)| (layout.free(gap.members()), block))).collect()
    }

    /// H d for a Hessian in [`hessian`](Self::hessian)'s blocks, both over the unknowns in elimination order.
    pub fn multiply(&self, blocks: &[DMat3], d: &[DVec3], out: &mut Vec<DVec3>) {
        self.pattern().multiply(blocks, d, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;

    /// A triangle and another over it, half an offset apart.
    fn one_over_the_other() -> (Cloth, Vec<DVec3>) {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let positions = vec![
            at(0.0, 0.0, 0.0),
            at(0.02, 0.0, 0.0),
            at(0.0, 0.02, 0.0),
            at(0.004, 0.003, 0.01),
            at(0.021, 0.006, 0.01),
            at(0.005, 0.023, 0.01),
        ];
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [3, 4, 5]]);
        let cloth = Cloth::sample(&mesh, "jersey", &[0]);
        let down = |(v, x): (usize, &DVec3)| if v < 3 { *x } else { *x - DVec3::Z * 9.2e-3 };
        let x = mesh.positions.iter().enumerate().map(down).collect();
        (cloth, x)
    }

    #[test]
    fn blocks_between_strangers_are_those_of_the_gradients_change() {
        let (cloth, at) = one_over_the_other();
        let mut contacts = Contacts::none();
        contacts.proximity = Some(cloth.proximity());
        contacts.refresh(&at);
        // Slid since, so that friction has something to say.
        let slid = |(v, x): (usize, &DVec3)| if v < 3 { *x } else { *x + DVec3::new(1.1e-4, 0.7e-4, -2e-5) };
        let x: Vec<DVec3> = at.iter().enumerate().map(slid).collect();
        let proximity = contacts.proximity.as_ref().unwrap();
        assert!(proximity.pressing(&x) > 2);
        let layout = cloth.layout_with(&x, proximity.pairs());
        assert!(layout.pattern.rows.len() > cloth.pattern().rows.len(), "no block was added for them");
        let (mut blocks, mut without) = (Vec::new(), Vec::new());
        cloth.hessian_in(&layout, false, &x, &contacts, &mut blocks);
        cloth.hessian_in(&layout, false, &x, &Contacts::none(), &mut without);
        blocks.iter_mut().zip(without).for_each(|(a, b)| *a -= b);
        let force = |x: &[DVec3]| -> Vec<DVec3> {
            let (mut with, mut without) = (Vec::new(), Vec::new());
            cloth.gradient(x, &contacts, &mut with);
            cloth.gradient(x, &Contacts::none(), &mut without);
            with.iter().zip(&without).map(|(a, b)| *a - *b).collect()
        };
        let step = 1e-9;
        for (i, &v) in layout.order.iter().enumerate() {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let at = |s: f64| {
                    let mut x = x.clone();
                    x[v as usize] += axis * s;
                    force(&x)
                };
                let (ahead, behind) = (at(step), at(-step));
                let mut d = vec![DVec3::ZERO; layout.order.len()];
                d[i] = axis;
                let mut told = Vec::new();
                layout.pattern.multiply(&blocks, &d, &mut told);
                let scale = told.iter().map(|f| f.length()).fold(1.0, f64::max);
                for (&w, told) in layout.order.iter().zip(&told) {
                    let measured = (ahead[w as usize] - behind[w as usize]) / (2.0 * step);
                    assert!(measured.distance(*told) < 1e-4 * scale, "{v} {w}: {measured} and {told}");
                }
            }
        }
    }
}
