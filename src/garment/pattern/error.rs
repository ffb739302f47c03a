//! Errors of sewing patterns, by panel and edge.

use crate::base::files::Unreadable;

/// A pattern that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PatternError {
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A pattern that breaks a rule of the format: place, found, expected and, where it is not obvious, the remedy.
    #[error("{0}")]
    Invalid(String),
    /// The same with the file.
    #[error("{file}: {source}")]
    #[allow(missing_docs, reason = "the message says what each field is")]
    In { file: String, source: Box<PatternError> },
}

impl PatternError {
    /// A value of another type or out of range.
    pub(super) fn unexpected(place: &str, found: &str, expected: &str) -> Self {
        Self::Invalid(format!("{place}: found {found}, expected {expected}"))
    }
}
