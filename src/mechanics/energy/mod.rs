//! One energy for the whole drape: E(x) = gravity + membrane + bending + contact + friction.
//!
//! [`Cloth`] holds what does not change while a garment settles: rest shape, masses, bending rings, the held vertices and the
//! pattern of the Hessian. [`Contacts`] holds what does: which vertices touch the body, and how they hold on to it.
//! Forces are −∇E. Every Hessian here is positive semi-definite, but for the compression that a triangle bears
//! ([`Cloth::hessian_bearing`]), so a Newton step always descends.
//!
//! | term | file | equation |
//! |---|---|---|
//! | gravity | [`gravity`] | Σ m g z |
//! | membrane | [`membrane`] | Σ A ψ(F), orthotropic |
//! | bending | [`bending`] | Σ ½ A (B_u \|x_uu\|² + H \|x_uv\|² + B_v \|x_vv\|²) |
//! | contact | [`contact`] | Σ ½ κ A (h − q)² |
//! | friction | [`friction`] | Σ μ N φ(\|u\|) |
//! | cloth on cloth | [`proximity`] | Σ ½ κ A (h − n·Σ w x)², and friction |

pub mod bending;
mod bending_matrix;
mod cloth;
pub mod contact;
mod error;
mod evaluate;
mod face_contacts;
pub mod field;
mod fit;
pub mod friction;
pub mod gravity;
mod hessian;
mod layout;
pub mod membrane;
mod membrane_simd;
pub mod ordering;
mod penetration;
pub mod proximity;
mod seeded_contacts;
pub mod sparsity;
pub mod vertex_ring;

pub use cloth::Cloth;
pub use contact::Contacts;
pub use error::EnergyError;
pub use evaluate::Scratch;
pub(crate) use face_contacts::Covered;
pub use friction::Friction;
pub(crate) use hessian::Held;
pub use layout::HessianLayout;
pub use proximity::Proximity;
