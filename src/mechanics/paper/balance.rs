//! Equations (2) and (5) to (9) for one PART, from its sums to its displacement.

use glam::DVec3;

use super::{Contactless, PaperOptions, PartForces};

/// The sums of (2) over one PART, before p_f and q_f.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sums {
    /// Barycentric area, m².
    pub(super) area: f64,
    /// Σ ΔV, m³.
    pub(super) volume: f64,
    /// Mass beyond that of this volume of the first vertex's fabric, kg.
    pub(super) more: f64,
    /// Σ (cos α_q, cos β_q, cos γ_q) ΔV, m³.
    pub(super) body: DVec3,
    /// Σ (cos α_p, cos β_p, cos γ_p) q ΔV, m⁴.
    pub(super) garment: DVec3,
    /// Σ |q| ΔV, m⁴: what `garment` would be if the normal lay along the axis throughout.
    pub(super) largest: f64,
    /// Whether a vertex is within the contact distance.
    pub(super) contact: bool,
}

/// Solves (6) and (7), or (9) without contact, from the F⁰, F¹ and p_f of a PART.
pub(super) fn balance(part: &mut PartForces, sums: &Sums, options: &PaperOptions) {
    let rises = !sums.contact && options.contactless == Contactless::AsPrinted;
    let load = if rises { part.gravity } else { part.anti_force - part.gravity };
    for axis in 0..3 {
        if sums.garment[axis].abs() <= options.degenerate_below * sums.largest {
            // Without contact (9) asks nothing of the stiffness along x and y, so nothing is missing there.
            part.degenerate[axis] = sums.contact || axis == 2;
            continue;
        }
        part.stiffness[axis] = part.line_force * sums.garment[axis];
        part.displacement[axis] = load[axis] / part.stiffness[axis];
        // F² = D Fᵃ, which is the load itself; written so that a PART that is held (Fᵃ infinite) has one too.
        part.adjacent[axis] = load[axis];
    }
    part.resultant = part.gravity + part.anti_force + part.adjacent;
}
