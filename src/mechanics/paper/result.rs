//! Errors, warnings and result of the paper's stage two.

use glam::DVec3;

/// Input for which the equations cannot be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PaperError {
    /// A list whose length is not the number of garment vertices.
    #[error("{what} has {found} entries, expected {expected}, one per garment vertex; compute it from this garment")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of garment vertices.
        expected: usize,
    },
    /// A constant that must be positive and finite.
    #[error("{what} is {found}, expected a positive, finite number; correct it in the fabric or the options")]
    Constant {
        /// Which one, with its unit.
        what: &'static str,
        /// Its value.
        found: f64,
    },
}

/// A property of the result that the user should know.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PaperWarning {
    /// No vertex is within the contact distance; see [`Untouched::FromNearest`](super::Untouched::FromNearest).
    #[error(
        "the garment does not touch the body: its nearest vertex is {:.1} mm away, so vertices within {:.1} mm count as \
         contact",
        1e3 * .nearest_m,
        1e3 * .contact_m
    )]
    NotTouching {
        /// Distance of the nearest vertex, m.
        nearest_m: f64,
        /// The contact distance used, m.
        contact_m: f64,
    },
    /// No q_f balances the weight; it is zero, and the body exerts no force.
    #[error(
        "nothing carries the garment: the normals of the body over {contact_parts} contact PARTs have a mean upward component of \
         {support:.3}; the force density q_f is 0"
    )]
    NothingCarries {
        /// PARTs in contact.
        contact_parts: usize,
        /// Σ cos γ_q ΔV / Σ ΔV over the contact PARTs; 0 without contact PARTs.
        support: f64,
    },
    /// Fᵃ_z is zero for all PARTs: the cloth is vertical, or the reading fails.
    #[error("no PART has a stiffness along z, so no PART moves vertically")]
    NoVerticalStiffness,
    /// PARTs with an axis without stiffness, along which they do not move.
    #[error("{parts} PARTs have an axis without stiffness and do not move along it")]
    Degenerate {
        /// How many.
        parts: usize,
    },
    /// Displacements larger than the garment: the reading fails there.
    #[error("{parts} PARTs move by more than the size of the garment, the farthest by {largest_m:.2} m")]
    Explodes {
        /// How many.
        parts: usize,
        /// The largest displacement, m.
        largest_m: f64,
    },
    /// Vertices that remain inside the body, in a fold too narrow to leave.
    #[error("{vertices} vertices remain inside the body")]
    Penetrating {
        /// How many.
        vertices: usize,
    },
}

/// The forces on one PART, N, in the signs of the paper, and its displacement.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartForces {
    /// Its level, from 0.
    pub level: u32,
    /// Its number of vertices.
    pub vertices: usize,
    /// Its barycentric area, m².
    pub area_m2: f64,
    /// F⁰: the weight, positive along z, N.
    pub gravity: DVec3,
    /// F¹: the anti-force of the body, N.
    pub anti_force: DVec3,
    /// F²: the load transferred to the adjacent PARTs, N.
    pub adjacent: DVec3,
    /// Fᵃ: the equivalent coefficient of elasticity, N/m; infinite for a PART at the top of the garment, which is held.
    pub stiffness: DVec3,
    /// F⁰ + F¹ + F², N.
    pub resultant: DVec3,
    /// D, m.
    pub displacement: DVec3,
    /// p_f of this PART, N/m⁵.
    pub line_force: f64,
    /// Whether a vertex is within the contact distance.
    pub contact: bool,
    /// Axes without stiffness, along which it does not move.
    pub degenerate: [bool; 3],
}

/// The result of [`solve`](super::solve).
#[derive(Debug, Clone, PartialEq)]
pub struct PaperResult {
    /// One entry per PART, in their order.
    pub parts: Vec<PartForces>,
    /// |D_a − D_b| across each seam, m, which the paper interprets as wrinkles.
    pub seam_jumps_m: Vec<f64>,
    /// Displaced vertex positions, outside the body, m.
    pub positions: Vec<DVec3>,
    /// Weight of the garment, N.
    pub weight_n: f64,
    /// q_f, N/m³.
    pub body_force: f64,
    /// PARTs in contact.
    pub contact_parts: usize,
    /// PARTs with at least one axis without stiffness.
    pub degenerate_parts: usize,
    /// Vertices inside the body at the start, whose q is raised by [`Clearance::PlusThickness`](super::Clearance::PlusThickness).
    pub floored_vertices: usize,
    /// Vertices projected onto the surface of the body plus the thickness.
    pub projected_vertices: usize,
    /// Vertices that remain inside the body.
    pub penetrating_vertices: usize,
    /// Warnings.
    pub warnings: Vec<PaperWarning>,
}
