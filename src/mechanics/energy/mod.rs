//! The energy of the whole drape: E(x) = gravity + membrane + bending + contact + friction.
//!
//! [`Cloth`] holds the constant data of a garment: rest shape, masses, bending elements, held vertices and the pattern of the Hessian.
//! [`Contacts`] holds the state of contact with the body and of the cloth with itself. Forces are −∇E. The projected Hessian is positive
//! semi-definite, so Newton's method with it always has a descent direction; the true one may be indefinite ([`membrane`]).
//!
//! | term | module | energy |
//! |---|---|---|
//! | gravity | [`Cloth`] | Σ m g z |
//! | membrane | [`membrane`] | Σ A ψ(F), orthotropic |
//! | bending | `bending` | Σ ½ A (B_u \|x_uu\|² + H \|x_uv\|² + B_v \|x_vv\|²) |
//! | contact | `contact`, `face_contacts` | Σ ½ κ A (h − q)² |
//! | friction | `friction` | Σ μ N φ(\|u\|) |
//! | self-contact | `proximity` | Σ ½ κ A (h − n·Σ w x)², and friction |

pub(crate) mod bending;
mod bending_friction;
mod bending_matrix;
mod cloth;
mod contact;
mod error;
mod face_contacts;
pub(crate) mod field;
pub(crate) mod friction;
pub mod membrane;
mod membrane_simd;
pub(crate) mod ordering;
mod passage;
mod proximity;
mod separator;
pub mod sparsity;
mod vertex_ring;

pub(crate) use cloth::MIN_BODY_RADIUS_M;
pub use cloth::{Cloth, Scratch};
pub use contact::Contacts;
pub(crate) use contact::{FaceUpdate, TOUCH_MARGIN_M};
pub use error::EnergyError;
pub use friction::{Friction, Touch};
pub(crate) use membrane::HessianKind;
pub use proximity::Proximity;
pub(crate) use proximity::StepCheck;
pub use sparsity::HessianLayout;

#[cfg(test)]
mod tests;
