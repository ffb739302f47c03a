//! The drape against closed forms: a hanging strip, a cantilever, and Coulomb's slip angle.

mod bench;
mod cantilever;
mod cusick;
mod fit;
mod friction;
mod strip;
mod threads;
