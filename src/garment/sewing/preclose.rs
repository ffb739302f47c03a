//! A garment that was sewn before it was put on, its open seams drawn shut: what its file bridges by long triangles (`mesh::bridges`).
//!
//! Where more than two panels meet such a mesh crosses itself from the start, and as-rigid-as-possible steps, which feel no bending, make a
//! crumple of it that nothing opens again. So steps and fairing take turns, wide waves first: as a bending energy would, split off from
//! the rest. Where cloth crosses itself still it is faired wider.
//!
//! Source: own; steps and fairing are those of `close.rs`. Limits: no level is coarser, so a step costs what the mesh costs; what crosses
//! itself after the last round is left to the drape, which draws it apart or says that it crosses.

use glam::DVec3;

use super::arap::{Closing, close, faired};
use super::{COARSER, LAST, STILL};
use crate::body::distance::Body;
use crate::mesh::bridges::Bridges;
use crate::mesh::import::Imported;
use crate::mesh::report::{Remark, Repair};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::mesh::{RestShape, TriMesh, longest_side};

/// A mesh has open seams that are shut at rest where it has sides so many times as long as any at rest.
const SHUT: f64 = 3.0;

/// Steps until the seams are shut at most: three times as many as a T-shirt's 34 cm took.
const FIRST: usize = 100;

/// Turns of fairing and of two steps; waves of this length (m) are worn down in the first, and each time of this share of it. From two
/// or three centimetres GarmentCode's T-shirt comes out of them without a crossing, from one with 152 pairs.
const TURNS: usize = 12;
const WAVES: f64 = 0.025;
const NARROWER: f64 = 0.85;

/// Rounds of such turns at most, each with waves twice as wide.
const ROUNDS: i32 = 3;

/// Draws the seams that long triangles of `imported` bridge, and that are shut at rest, shut over `body`, and says so; any other garment stays
/// as it is.
pub(crate) fn draw_shut(imported: &mut Imported, rest: &RestShape, body: &Body) {
    let Some(Bridges { longest_m, .. }) = Bridges::of(&imported.mesh) else { return };
    let at_rest = rest.corners.iter().map(|c| longest_side(c.map(|p| p.extend(0.0))));
    if SHUT * at_rest.fold(0.0, f64::max) > longest_m {
        return;
    }
    let (x, steps) = drawn_shut(&imported.mesh, rest, body);
    let farthest_m = x.iter().zip(&imported.mesh.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    // That they are longer as worn than at rest is what is mended.
    imported.report.remarks.retain(|remark| !matches!(remark, Remark::OtherThanWorn { .. }));
    imported.report.repairs.push(Repair::SeamsDrawnShut { longest_m, steps, farthest_m });
    imported.mesh.positions = x;
}

/// Where the vertices come to lie, m, and steps in all.
fn drawn_shut(mesh: &TriMesh, rest: &RestShape, body: &Body) -> (Vec<DVec3>, usize) {
    let mut taken = 0;
    let mut step = |x: &[DVec3], gap, steps| {
        let (x, steps) = close(mesh, rest, body, x, Closing { held: &[], gap, steps, still: STILL });
        taken += steps;
        x
    };
    let [_, (_, gap, _)] = COARSER;
    let mut x = step(&mesh.positions, gap, FIRST);
    for round in 0..ROUNDS {
        if self_intersecting_pairs(&mesh.with_positions(x.clone())).is_empty() {
            break;
        }
        for turn in 0..TURNS {
            let length = WAVES * 2f64.powi(round) * NARROWER.powi(turn as i32);
            x = step(&faired(mesh, rest, &x, length), gap, 2);
        }
        x = step(&x, LAST.0, LAST.1);
    }
    (x, taken)
}
