//! Stage two as printed: the force balance of each PART along each axis, equations (2) to (9).
//!
//! Every PART moves by one translation D = (D_x, D_y, D_z). Sums run over its vertices; • is x, y or z.
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
//! Signs are the paper's: F⁰ is the weight as a positive number that (5) subtracts, F² the load transferred to the neighbours.
//! The paper prints the resultant as the sum F⁰ + F¹ + F²; by (5) it equals 2 F¹, so it shows where the body supports the cloth.
//! Where the equations are ambiguous or wrong, [`PaperOptions`] selects a reading, documented beside its equation.
//!
//! Source: Luo, Jiang, Cong, section 2.2. Limits: a PART is not affected by the displacement of others; a translation cannot fold; the
//! accuracy is that of one displacement per PART and a diagonal stiffness.

mod calibrate;
mod options;
mod result;
mod solve;

pub use options::{BodyForce, Clearance, Contactless, Cosine, LineForce, PaperOptions, Untouched, Volume};
pub use result::{PaperError, PaperResult, PaperWarning, PartForces};
pub use solve::{Cut, solve, solve_cut};
