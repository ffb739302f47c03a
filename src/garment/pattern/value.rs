//! JSON values with the place they stand at, for messages.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::PatternError;

/// A JSON value in which no object has a key twice. `Value` itself keeps the last of two panels of one name and drops the first.
pub(super) struct Unique(pub(super) Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(UniqueVisitor).map(Self)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(Unique(value)) = list.next_element()? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some((key, Unique(value))) = entries.next_entry::<String, Unique>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(format!(
                    "found {key:?} twice in one object, expected each name once; rename one"
                )));
            }
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

/// A value and where it is.
#[derive(Clone)]
pub(super) struct At<'a> {
    pub(super) value: &'a Value,
    pub(super) place: String,
}

impl<'a> At<'a> {
    pub(super) fn new(value: &'a Value, place: impl Into<String>) -> Self {
        Self { value, place: place.into() }
    }

    pub(super) fn wrong(&self, expected: impl Into<String>) -> PatternError {
        PatternError::Wrong { place: self.place.clone(), found: shown(self.value), expected: expected.into() }
    }

    pub(super) fn object(&self, expected: &str) -> Result<&'a Map<String, Value>, PatternError> {
        self.value.as_object().ok_or_else(|| self.wrong(expected))
    }

    pub(super) fn list(&self, expected: &str) -> Result<&'a [Value], PatternError> {
        self.value.as_array().map(Vec::as_slice).ok_or_else(|| self.wrong(expected))
    }

    pub(super) fn text(&self, expected: &str) -> Result<&'a str, PatternError> {
        self.value.as_str().ok_or_else(|| self.wrong(expected))
    }

    /// A number no larger than lengths and angles of a pattern are.
    pub(super) fn number(&self) -> Result<f64, PatternError> {
        let number = self.value.as_f64().filter(|x| x.abs() <= MOST);
        number.ok_or_else(|| self.wrong(format!("a number from -{MOST:.0} to {MOST:.0}")))
    }

    pub(super) fn numbers<const N: usize>(&self, expected: &str) -> Result<[f64; N], PatternError> {
        let list = self.list(expected)?;
        if list.len() != N {
            return Err(self.wrong(expected));
        }
        let mut numbers = [0.0; N];
        for (slot, value) in numbers.iter_mut().zip(list) {
            *slot = At::new(value, self.place.clone()).number()?;
        }
        Ok(numbers)
    }
}

/// No coordinate of a pattern is larger, in its own unit: a hundred metres in centimetres.
const MOST: f64 = 1e4;

/// A value as a message quotes it.
fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    match value {
        Value::Object(_) => "an object".to_owned(),
        other => {
            let text = other.to_string();
            match text.char_indices().nth(LONGEST) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            }
        }
    }
}
