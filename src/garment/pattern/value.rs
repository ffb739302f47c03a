//! JSON values with the place they stand at, for messages.

use serde_json::{Map, Value};

use super::PatternError;

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
