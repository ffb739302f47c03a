//! The Python module `partwise._native`. The package in `partwise/` beside this file wraps it in typed Python.
//!
//! Keyword arguments cross the boundary as JSON and are read by serde, as those of job files and of the live interface; arrays cross as
//! NumPy arrays. Every computation runs without the GIL, ends at a signal, and turns a panic into `partwise.Error`.

mod call;
mod drape;
mod error;
mod keywords;
mod mesh;
mod sweep;

use pyo3::prelude::pymodule;

/// The native part of `partwise`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::call::panics;
    #[pymodule_export]
    use super::drape::{Drape, drape};
    #[pymodule_export]
    use super::error::Error;
    #[pymodule_export]
    use super::mesh::{Mesh, load};
    #[pymodule_export]
    use super::sweep::{Plan, Store, run_point};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
