//! The exception of the package.

use std::error::Error as StdError;

use pyo3::create_exception;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::base::error_text::with_causes;

create_exception!(
    partwise,
    Error,
    PyRuntimeError,
    "Unusable input, or a computation that failed. The message says what was found, what was expected, and the remedy."
);

/// The exception for an error and its causes.
pub(super) fn exception(error: &(dyn StdError + 'static)) -> PyErr {
    Error::new_err(with_causes(error, ": "))
}
