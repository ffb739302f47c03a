//! Values of one word, by the names that serde has for them.

use serde::Deserialize;
use serde::de::value::{Error, StrDeserializer};

/// The value that a word stands for, if any.
#[must_use]
pub(crate) fn word<'a, T: Deserialize<'a>>(text: &'a str) -> Option<T> {
    T::deserialize(StrDeserializer::<Error>::new(text)).ok()
}
