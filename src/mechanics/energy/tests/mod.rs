//! Every term of the energy against finite differences, invariance under rigid motions, and self-contact.

mod derivatives;
mod invariance;
mod patch;
mod self_contact;
mod two_fabrics;
