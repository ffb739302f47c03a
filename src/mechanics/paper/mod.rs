//! Stage two as printed: the force balance of each PART along each axis, equations (2) to (9).
//!
//! Every PART k moves as one by D = (D_x, D_y, D_z). Sums run over its vertices; • is x, y or z.
//!
//! | equation | as computed |
//! |---|---|
//! | (2) | F⁰_z = Σ g g_f ΔV; F¹_• = Σ q_f cos(•_q) ΔV; F²_• = D_• Fᵃ_• with Fᵃ_• = Σ p_f cos(•_p) q ΔV |
//! | (3), (8) | cosines of e_q = ∇q, the body's outward unit normal at the closest point |
//! | (4), (8) | cosines of e_p = ∇p, the garment's vertex normal |
//! | (5) | F¹_z − F⁰_z − F²_z = 0 |
//! | (6), (7) | D_z = (F¹_z − F⁰_z)/Fᵃ_z, D_x = F¹_x/Fᵃ_x, D_y = F¹_y/Fᵃ_y |
//! | (9) | contactless: D_x = D_y = 0, D_z = −F⁰_z/Fᵃ_z |
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ΔV | volume of the point's cuboid, [`Volume`] | m³ |
//! | g_f | mass density of the garment, ρ over thickness | kg/m³ |
//! | q_f | force density of the body on the garment, [`BodyForce`] | N/m³ |
//! | p_f | internal line force coefficient, [`LineForce`] | N/m⁵ |
//! | q | signed distance to the body, [`Clearance`] | m |
//! | F⁰, F¹, F² | gravity, anti-force of the body, force of the adjacent PARTs | N |
//! | Fᵃ | equivalent coefficient of elasticity | N/m |
//! | D | displacement of the PART | m |
//!
//! Signs are the paper's: F⁰ is the weight as a positive figure that (5) subtracts, F² the pull that the neighbours take over.
//! The resultant is printed as the sum F⁰ + F¹ + F² all the same; with (5) it is 2 F¹, so it shows where the body carries.
//! What the page leaves open or gets wrong is a choice in [`PaperOptions`], each documented beside its equation.
//!
//! Source: Luo, Jiang, Cong, section 2.2. Limits: PARTs do not feel each other's displacement; a translation cannot fold; the
//! result is as good as one displacement per PART and a diagonal stiffness can be.

mod balance;
mod calibrate;
mod options;
mod outside;
mod solve;
mod volume;

pub use options::{BodyForce, Clearance, Contactless, Cosine, LineForce, PaperOptions, Untouched, Volume};
pub use solve::{Cut, solve, solve_cut};

use glam::DVec3;

/// Input that the equations cannot be evaluated on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PaperError {
    /// A list that is not one entry per garment vertex.
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

/// Something the caller should be told; the result stands.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PaperWarning {
    /// No vertex is within the contact distance; see [`Untouched::FromNearest`].
    #[error(
        "the garment touches the body nowhere: its nearest vertex is {:.1} mm off, so contact is what lies within \
         {:.1} mm",
        1e3 * .nearest_m,
        1e3 * .contact_m
    )]
    NotTouching {
        /// Distance of the nearest vertex, m.
        nearest_m: f64,
        /// The contact distance used, m.
        contact_m: f64,
    },
    /// No q_f balances the weight, so it is zero and no PART feels the body.
    #[error(
        "nothing carries the garment: over {contact_parts} contact PARTs the body's normals point up by {support:.3} of their \
         volume on average; the force density q_f is 0"
    )]
    NothingCarries {
        /// PARTs in contact.
        contact_parts: usize,
        /// Σ cos γ_q ΔV / Σ ΔV over the contact PARTs; 0 where there are none.
        support: f64,
    },
    /// Fᵃ_z vanishes everywhere: the cloth is vertical, or the reading fails.
    #[error("no PART has a stiffness along z, so the garment keeps its height")]
    NoVerticalStiffness,
    /// Axes without stiffness; the PARTs stay where they are along them.
    #[error("{parts} PARTs have an axis without stiffness and keep still along it")]
    Degenerate {
        /// How many.
        parts: usize,
    },
    /// Displacements beyond the garment's own size: the reading has failed there.
    #[error("{parts} PARTs move by more than the garment is large, the farthest by {largest_m:.2} m")]
    Explodes {
        /// How many.
        parts: usize,
        /// The largest displacement, m.
        largest_m: f64,
    },
    /// Vertices that are inside the body in the end, in a place too narrow to get out of.
    #[error("{vertices} vertices are left inside the body")]
    Penetrating {
        /// How many.
        vertices: usize,
    },
}

/// The forces on one PART, N, in the paper's signs, and what they do.
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
    /// F²: the force taken by the adjacent PARTs, N.
    pub adjacent: DVec3,
    /// Fᵃ: the equivalent coefficient of elasticity, N/m; infinite for a PART at the very top, which is held.
    pub stiffness: DVec3,
    /// F⁰ + F¹ + F², N.
    pub resultant: DVec3,
    /// D, m.
    pub displacement: DVec3,
    /// p_f of this PART, N/m⁵.
    pub line_force: f64,
    /// Whether a vertex is within the contact distance.
    pub contact: bool,
    /// Axes without stiffness, along which it keeps still.
    pub degenerate: [bool; 3],
}

impl PartForces {
    /// |F|, what Figure 6 colours, N.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.resultant.length()
    }

    /// F¹ − F⁰ − F², N: zero by (5) along axes that have a stiffness.
    #[must_use]
    pub fn imbalance(&self) -> DVec3 {
        self.anti_force - self.gravity - self.adjacent
    }
}

/// What [`solve`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperResult {
    /// One entry per PART, in their order.
    pub parts: Vec<PartForces>,
    /// |D_a − D_b| across each seam, m: what the paper reads as wrinkles.
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
    /// Vertices whose q the floor of [`Clearance::PlusThickness`] raised: those inside the body at the start.
    pub floored_vertices: usize,
    /// Vertices put back onto the body's surface plus thickness.
    pub projected_vertices: usize,
    /// Vertices left inside the body.
    pub penetrating_vertices: usize,
    /// What else to know.
    pub warnings: Vec<PaperWarning>,
}
