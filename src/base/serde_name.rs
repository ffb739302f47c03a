//! Parses an enum variant from the name that serde gives it.

use serde::Deserialize;
use serde::de::value::{Error, StrDeserializer};

/// The variant of this name.
pub(crate) fn parse<'a, T: Deserialize<'a>>(name: &'a str) -> Option<T> {
    T::deserialize(StrDeserializer::<Error>::new(name)).ok()
}
