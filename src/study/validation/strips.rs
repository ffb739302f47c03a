//! Strips with a closed form: a cantilever, elastic and with friction between yarns, and hanging strips along the warp and on the bias.
//!
//! | strip | closed form |
//! |---|---|
//! | cantilever of length L in small bending | end sags by W g/(8 B) (L² − 2 HB/(W g))² |
//! | hanging strip | stretches by W g L² S/2 |
//!
//! S is 1/k_v along the warp, and on the bias ¼ (1/k_u + 1/k_v − 2 ν/√(k_u k_v) + 1/μ), the compliance of the membrane at 45 degrees.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | W | areal density | kg/m² |
//! | L | length | m |
//! | B, HB | bending stiffness along the weft, Coulomb moment of the friction | N·m, N |
//! | k_u, k_v, μ, ν | membrane stiffness along weft and warp, shear stiffness, Poisson's ratio | N/m, – |
//!
//! Limits: a strip on the bias is also held against its contraction at the upper end, which the closed form does not know; it is twenty times
//! as long as wide.

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use super::error::ValidationError;
use crate::GRAVITY;
use crate::base::math;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::refine::{RefineOptions, refine_with};
use crate::mesh::{RestShape, Topology, TriMesh};

/// Residual over weight: a hundredth of that of a drape, since the deflection of a strip is small.
const TOLERANCE: f64 = 1e-5;

/// Sag of a cantilever over its length, small enough for the linear closed form.
const SAG_SHARE: f64 = 0.05;

/// Cells along a strip.
const CELLS: usize = 40;

/// Simulated and closed-form deflection of a strip, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Deflection {
    pub(super) simulated_m: f64,
    pub(super) exact_m: f64,
}

/// A rectangle of `along` × `across` cells of side `cell` (m), rows across first, every cell split along the same diagonal: a mesh of
/// alternating diagonals has vertices with four neighbours, which do not determine the twist.
fn rectangle(cell: f64, along: usize, across: usize, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let row = across + 1;
    let corner = |k: usize| at(cell * (k / row) as f64, cell * (k % row) as f64);
    let cells = (0..along).flat_map(|i| (0..across).map(move |j| (i * row + j) as u32));
    let below = row as u32;
    let triangles = cells.flat_map(|a| [[a, a + below, a + below + 1], [a, a + below + 1, a + 1]]).collect();
    TriMesh::new((0..(along + 1) * row).map(corner).collect(), triangles)
}

/// Rests a strip of `mesh` whose first `held` vertices are held; `rest` are its flat triangles.
fn rested(mesh: TriMesh, rest: &RestShape, fabric: &Fabric, held: usize) -> Result<Vec<DVec3>, ValidationError> {
    let held: Vec<u32> = (0..held as u32).collect();
    let mut cloth = Cloth::new(&mesh, &Topology::new(&mesh), rest, fabric, &held)?;
    (cloth.solver.newton.tolerance, cloth.solver.softening.strain) = (TOLERANCE, 0.0);
    let options = RefineOptions { self_contact: false, ..RefineOptions::default() };
    let end = refine_with(&cloth, Contacts::none(), mesh.positions, &options, &mut |_| ControlFlow::Continue(()))?;
    Ok(end.positions)
}

/// A strip of `fabric` along the weft that juts out as far as it sags by a twentieth of its length; with friction, of which the clamp bears half.
pub(super) fn cantilever(fabric: &Fabric, with_friction: bool) -> Result<Deflection, ValidationError> {
    let (weight, bending) = (fabric.density_kg_per_m2 * GRAVITY, fabric.bending_nm[0]);
    // Sag W g L⁴/(8 B) times (1 − share)², where the friction bears that share of the moment W g L²/2 at the clamp.
    let share: f64 = if with_friction { 0.5 } else { 0.0 };
    let length = (8.0 * bending * SAG_SHARE / weight).cbrt() * math::powf(1.0 - share, -2.0 / 3.0);
    let moment = 0.5 * share * weight * length * length;
    let fabric = Fabric { bending_friction_n: [moment; 2], ..fabric.clone() };
    // A ring bends for half a cell to either side, so the clamp lies half a cell inside the last of three held rows.
    let (cell, across) = (length / (CELLS as f64 + 0.5), 8);
    let mesh = rectangle(cell, CELLS + 2, across, |x, y| DVec3::new(x, y, 0.0));
    let corners = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize].truncate());
    let rest = RestShape::new(mesh.triangles.iter().map(corners).collect());
    let end = rested(mesh.clone(), &rest, &fabric, 3 * (across + 1))?;
    let free = length * length - 2.0 * moment / weight;
    let last = &end[end.len() - across - 1..];
    let simulated_m = -last.iter().map(|p| p.z).sum::<f64>() / last.len() as f64;
    Ok(Deflection { simulated_m, exact_m: weight / (8.0 * bending) * free * free })
}

/// A strip of `fabric` 50 cm long that hangs along its warp, or on the bias.
pub(super) fn hanging(fabric: &Fabric, on_bias: bool) -> Result<Deflection, ValidationError> {
    let (length, across) = (0.5, 8);
    let along = 20 * across;
    let mesh = rectangle(length / along as f64, along, across, |z, x| DVec3::new(x, 0.0, -z));
    let turn = math::unit(if on_bias { std::f64::consts::FRAC_PI_4 } else { 0.0 });
    let flat = |p: DVec3| turn.rotate(DVec2::new(p.x, p.z));
    let corners = |t: &[u32; 3]| t.map(|v| flat(mesh.positions[v as usize]));
    // Seen from the front the triangles are counter-clockwise.
    let rest = RestShape::new(mesh.triangles.iter().map(corners).collect());
    let end = rested(mesh, &rest, fabric, across + 1)?;
    let [weft, warp] = [fabric.stretch_weft_n_per_m, fabric.stretch_warp_n_per_m].map(f64::recip);
    let bias = 0.25 * (weft + warp - 2.0 * fabric.poisson * (weft * warp).sqrt() + fabric.shear_n_per_m.recip());
    let compliance = if on_bias { bias } else { warp };
    let last = &end[end.len() - across - 1..];
    let simulated_m = -last.iter().map(|p| p.z).sum::<f64>() / last.len() as f64 - length;
    Ok(Deflection { simulated_m, exact_m: 0.5 * fabric.density_kg_per_m2 * GRAVITY * length * length * compliance })
}
