//! The methods that the paper compares itself with, as far as their sources describe them, behind one trait.
//!
//! | name | source |
//! |---|---|
//! | [`zhu2016`] | \[19\] Zhu, Li 2016: hybrid bounding volume hierarchy, masses and springs |
//! | [`gross2003`] | \[20\] Groß, Fuhrmann, Luckas 2003: pieces laid on developable surfaces, edge-length constraints |
//! | [`thomaszewski2006`] | \[21\] Thomaszewski, Wacker, Straßer 2006: corotational subdivision finite elements |
//!
//! A [`ReferenceMethod`] takes scene, fabric and a [`RestRule`], and returns the draped garment with its timings and counters. All
//! three simulate the cloth in time until it rests by the same rule; the head of each file lists what its source confirms and what is
//! our reading. Quantities that belong to no method are shared: the cloth's masses, areas and offset from the body, and the law of
//! the contact forces. A method that cannot run on a scene returns a [`MethodError`]; none falls back to another.

mod friction;
pub mod gross2003;
pub mod implicit_euler;
pub mod linear;
mod method;
mod segment;
mod spring_list;
pub mod thomaszewski2006;
pub mod zhu2016;

use crate::garment::pattern::SewnGarment;
pub use method::{Ended, Exhibit, MethodDrape, MethodError, MethodInput, MethodStep, ReferenceMethod, RestRule};

/// Names of the methods, in the order of the paper's references.
pub(crate) const METHODS: [&str; 3] = [zhu2016::NAME, gross2003::NAME, thomaszewski2006::NAME];

/// The method of this name with its defaults. `exhibit` requests its intermediate results; `sewn` holds the panels of a garment made
/// from a sewing pattern.
pub(crate) fn by_name(name: &str, exhibit: bool, sewn: Option<&SewnGarment>) -> Option<Box<dyn ReferenceMethod>> {
    match name {
        gross2003::NAME => Some(Box::new(gross2003::Gross2003 { exhibit, sewn: sewn.cloned(), ..Default::default() })),
        zhu2016::NAME => Some(Box::new(zhu2016::Zhu2016 { exhibit, ..Default::default() })),
        thomaszewski2006::NAME => Some(Box::new(thomaszewski2006::Thomaszewski2006 { exhibit, ..Default::default() })),
        _ => None,
    }
}
