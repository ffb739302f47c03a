//! ∇²E of the whole cloth: its positive part, or with the compression that triangles bear, and every vertex's own block.
//!
//! Blocks are in the order of a [`HessianLayout`]: the cloth's own, or one with places for the gaps of the cloth with itself.

use glam::{DMat3, DVec3};

use super::membrane::Triangle;
use super::pattern::HELD;
use super::{Cloth, Contacts, HessianLayout};

impl Cloth {
    /// Blocks of the positive part of ∇²E at `x`, N/m, in the order of [`pattern`](Self::pattern).
    pub fn hessian(&self, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.hessian_in(self.layout(), x, contacts, blocks);
    }

    /// The same in the blocks of another layout.
    pub(crate) fn hessian_in(&self, layout: &HessianLayout, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.assemble(layout, |t| t.hessian(&self.stiffness, x), x, contacts, blocks);
    }

    /// Blocks of ∇²E at `x`, N/m, with the compression that the triangles bear: see [`Triangle::hessian_bearing`]. Closer
    /// than [`hessian`](Self::hessian), and not always positive.
    pub fn hessian_bearing(&self, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.hessian_bearing_in(self.layout(), x, contacts, blocks);
    }

    /// The same in the blocks of another layout.
    pub(crate) fn hessian_bearing_in(
        &self,
        layout: &HessianLayout,
        x: &[DVec3],
        contacts: &Contacts,
        blocks: &mut Vec<DMat3>,
    ) {
        self.assemble(layout, |t| t.hessian_bearing(&self.stiffness, x), x, contacts, blocks);
    }

    /// Each vertex's own block of the positive part of ∇²E + ε M at `x`, N/m.
    pub(crate) fn own_blocks(&self, x: &[DVec3], contacts: &Contacts, damping: f64, blocks: &mut Vec<DMat3>) {
        blocks.clear();
        blocks.extend(
            self.masses
                .iter()
                .enumerate()
                .map(|(v, mass)| DMat3::from_diagonal(DVec3::splat(self.bending.own_scalar(v) + damping * mass))),
        );
        for t in &self.triangles {
            for (&v, block) in t.vertices.iter().zip(t.own_blocks(&self.stiffness, x)) {
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

    fn assemble(
        &self,
        layout: &HessianLayout,
        of_triangle: impl Fn(&Triangle) -> [DMat3; 6],
        x: &[DVec3],
        contacts: &Contacts,
        blocks: &mut Vec<DMat3>,
    ) {
        blocks.clear();
        blocks.extend(layout.bending_blocks.iter().map(|&b| DMat3::from_diagonal(DVec3::splat(b))));
        for (t, slots) in self.triangles.iter().zip(&layout.triangle_slots) {
            let parts = of_triangle(t);
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
            let members: Vec<(u32, f64)> =
                gap.members().map(|(v, w)| (layout.unknown[v as usize], w)).filter(|(i, _)| *i != HELD).collect();
            layout.add(&members, block, blocks);
        }
    }

    /// H d for a Hessian in [`hessian`](Self::hessian)'s blocks, both over the unknowns in elimination order.
    pub fn multiply(&self, blocks: &[DMat3], d: &[DVec3], out: &mut Vec<DVec3>) {
        self.pattern().multiply(blocks, d, out);
    }
}
