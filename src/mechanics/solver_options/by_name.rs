//! Options of the solver by their names: listed, set and checked.

use serde_json::Value;

use super::SolverOptions;

/// Largest number that an option takes.
const MAX_VALUE: f64 = 1e9;

/// Largest count that an option takes, so that no loop of the solver runs for hours.
const MAX_COUNT: f64 = 1e5;

/// Why an option cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SolverOptionError {
    /// The text is no assignment.
    #[error("found `{0}`, expected GROUP.KEY=VALUE such as newton.damping=3")]
    NoAssignment(String),
    /// No option has this name.
    #[error("found the option `{found}`, expected one of {expected}")]
    Unknown {
        /// The name.
        found: String,
        /// Names that are valid in its place.
        expected: String,
    },
    /// The value is not a number in the range of the option.
    #[error("{name}: found {found}, expected {expected}")]
    Value {
        /// The option.
        name: String,
        /// The value.
        found: String,
        /// The values that are valid.
        expected: String,
    },
}

impl SolverOptions {
    /// Every option by its name (`group.key`) and its value, sorted by name.
    #[must_use]
    pub fn list(&self) -> Vec<(String, f64)> {
        let Ok(Value::Object(groups)) = serde_json::to_value(self) else { return Vec::new() };
        let of_group = |(group, keys): (String, Value)| {
            let Value::Object(keys) = keys else { return Vec::new() };
            let named = |(key, value): (String, Value)| (format!("{group}.{key}"), value.as_f64().unwrap_or(f64::NAN));
            keys.into_iter().map(named).collect()
        };
        groups.into_iter().flat_map(of_group).collect()
    }

    /// The same with the option `name` (`group.key`) set to `value`.
    ///
    /// # Errors
    /// [`SolverOptionError`] names what is valid.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, SolverOptionError> {
        let unknown = |expected: Vec<String>| SolverOptionError::Unknown {
            found: name.to_owned(),
            expected: expected.join(", "),
        };
        let wrong = |expected: &str| SolverOptionError::Value {
            name: name.to_owned(),
            found: format!("{value:?}"),
            expected: expected.to_owned(),
        };
        let mut all = serde_json::to_value(self).unwrap_or_default();
        let (group, key) = name.split_once('.').unwrap_or((name, ""));
        let Some(keys) = all.get_mut(group).and_then(Value::as_object_mut) else {
            let groups = all.as_object().map(|all| all.keys().cloned().collect());
            return Err(unknown(groups.unwrap_or_default()));
        };
        let Some(slot) = keys.get_mut(key) else {
            return Err(unknown(keys.keys().map(|key| format!("{group}.{key}")).collect()));
        };
        if !(0.0..=MAX_VALUE).contains(&value) {
            return Err(wrong("a number from 0 to 1e9"));
        }
        *slot = match slot.is_u64() {
            true if value.fract() == 0.0 && value <= MAX_COUNT => Value::from(value as u64),
            true => return Err(wrong("a whole number from 0 to 100,000")),
            false => Value::from(value),
        };
        serde_json::from_value(all).map_err(|error| wrong(&error.to_string()))
    }

    /// The same after an assignment `group.key=value`.
    ///
    /// # Errors
    /// [`SolverOptionError`] names what is valid.
    pub fn assign(&self, assignment: &str) -> Result<Self, SolverOptionError> {
        let Some((name, text)) = assignment.split_once('=') else {
            return Err(SolverOptionError::NoAssignment(assignment.to_owned()));
        };
        let (name, text) = (name.trim().replace('-', "_"), text.trim());
        let wrong = || SolverOptionError::Value {
            name: name.clone(),
            found: format!("`{text}`"),
            expected: "a number from 0 to 1e9".to_owned(),
        };
        self.with(&name, text.parse().map_err(|_| wrong())?)
    }

    /// The first option with a value outside its range.
    ///
    /// # Errors
    /// [`SolverOptionError::Value`].
    pub fn check(&self) -> Result<(), SolverOptionError> {
        self.list().into_iter().try_for_each(|(name, value)| Self::default().with(&name, value).map(drop))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_listed_once_and_set_by_its_name() {
        let default = SolverOptions::default();
        let all = default.list();
        assert!(all.iter().all(|(_, value)| value.is_finite()) && all.len() > 20, "{all:?}");
        for (name, value) in &all {
            let set = default.assign(&format!("{}={}", name.replace('_', "-"), 2.0 * value + 1.0)).unwrap();
            let different: Vec<_> = set.list().into_iter().zip(&all).filter(|(now, before)| now != *before).collect();
            assert_eq!(different.len(), 1, "{name}");
            assert_eq!(different[0].0, (name.clone(), 2.0 * value + 1.0));
        }
    }

    #[test]
    fn unknown_options_and_values_out_of_range_are_refused_with_what_is_valid() {
        let default = SolverOptions::default();
        let message = |text: &str| default.assign(text).unwrap_err().to_string();
        assert!(message("newton.dampin=3").contains("newton.damping,"));
        assert!(message("newtons.damping=3").contains("relaxation"));
        assert!(message("newton=3").contains("newton.damping"));
        assert!(message("newton.damping").contains("GROUP.KEY=VALUE"));
        for wrong in ["-1", "nan", "inf", "1e300", "much"] {
            assert!(message(&format!("newton.damping={wrong}")).contains("0 to 1e9"), "{wrong}");
        }
        assert!(message("newton.max_steps=1.5").contains("whole number"));
    }
}
