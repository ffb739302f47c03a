//! Equations (2) and (5) to (9) for one PART, from its sums to its displacement.

use glam::DVec3;

use super::Contactless;

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

/// Forces and displacement of a PART along the three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Balance {
    pub(super) adjacent: DVec3,
    pub(super) stiffness: DVec3,
    pub(super) displacement: DVec3,
    pub(super) degenerate: [bool; 3],
}

/// Solves (6) and (7), or (9) without contact. `gravity` and `anti_force` are F⁰ and F¹ in N.
pub(super) fn balance(
    sums: &Sums,
    gravity: DVec3,
    anti_force: DVec3,
    line_force: f64,
    sign: Contactless,
    degenerate_below: f64,
) -> Balance {
    let mut out =
        Balance { adjacent: DVec3::ZERO, stiffness: DVec3::ZERO, displacement: DVec3::ZERO, degenerate: [false; 3] };
    let rises = !sums.contact && sign == Contactless::AsPrinted;
    let load = if rises { gravity } else { anti_force - gravity };
    for axis in 0..3 {
        if sums.garment[axis].abs() <= degenerate_below * sums.largest {
            // Without contact (9) asks nothing of the stiffness along x and y, so nothing is missing there.
            out.degenerate[axis] = sums.contact || axis == 2;
            continue;
        }
        out.stiffness[axis] = line_force * sums.garment[axis];
        out.displacement[axis] = load[axis] / out.stiffness[axis];
        // F² = D Fᵃ, which is the load itself; written so that a PART that is held (Fᵃ infinite) has one too.
        out.adjacent[axis] = load[axis];
    }
    out
}
