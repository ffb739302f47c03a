//! The named measurements of a body.
//!
//! Defaults are ANSUR II (women, n = 1,986) regressed on stature 168, bust 88, waist 72 and hip 96 cm, which is the European
//! size 38. ANSUR II has neither underbust nor knee girth: the underbust is the bust less the 13 cm of a B cup, the knee equals
//! the calf. Heights and lengths that are not given are proportional to stature. [`BodySpec`] is in centimetres, [`Measures`] in
//! metres.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::base::error_text::did_you_mean;

/// Invalid measurements of a body or lengths of a garment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum ShapeError {
    /// A spec that cannot be parsed.
    #[error("the spec cannot be read: {0}")]
    Spec(String),
    /// A measurement out of range.
    #[error("{name} is {found_cm} cm; a body's is from {low_cm:.0} to {high_cm:.0} cm")]
    Measurement { name: &'static str, found_cm: f64, low_cm: f64, high_cm: f64 },
    /// A length of a garment out of range.
    #[error("{name} is {found}; it must be from {low} to {high}")]
    Length { name: &'static str, found: f64, low: f64, high: f64 },
    /// Heights that do not ascend.
    #[error(
        "{upper} is {upper_cm:.1} cm, expected {gap_cm:.0} cm or more above {lower} at {lower_cm:.1} cm; give both heights, or neither"
    )]
    Order { lower: &'static str, lower_cm: f64, upper: &'static str, upper_cm: f64, gap_cm: f64 },
    /// Too few triangles or vertices.
    #[error("{found} {what} are too few to make out its shape; ask for {least} or more")]
    TooFew { what: &'static str, found: usize, least: usize },
    /// Too many triangles or vertices.
    #[error("{found} {what} are too many; ask for {most} or fewer")]
    TooMany { what: &'static str, found: usize, most: usize },
    /// An unknown name of a garment.
    #[error("no garment is called `{found}`{}; expected a file, or one of the built-in ones: {known}", did_you_mean(found, known.split(", ")))]
    Unknown { found: String, known: String },
    /// A surface that is not a manifold, which the ranges above should exclude.
    #[error("the {what} has no manifold surface at these measurements; bring them nearer to each other")]
    NotManifold { what: &'static str },
}

/// Declares [`BodySpec`] and [`Measures`] from one row per measurement: the name in metres, the name in centimetres, the value at
/// European size 38, and the accepted range. A proportional measurement is optional; its default is in proportion to stature, and
/// its range is 0.5 to 1.6 times the value at size 38.
macro_rules! measurements {
    (
        required { $($(#[$doc:meta])* $name:ident, $cm:ident = $default:literal in $range:expr;)* }
        proportional { $($(#[$proportional_doc:meta])* $proportional:ident, $proportional_cm:ident = $eu38:literal;)* }
    ) => {
        /// The measurements of a body, in centimetres. Defaults are European size 38; heights and lengths that are not given are
        /// proportional to stature.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct BodySpec {
            $($(#[$doc])* pub $cm: f64,)*
            $($(#[$proportional_doc])* #[serde(skip_serializing_if = "Option::is_none")] pub $proportional_cm: Option<f64>,)*
        }

        impl Default for BodySpec {
            fn default() -> Self {
                Self { $($cm: $default,)* $($proportional_cm: None,)* }
            }
        }

        /// A body's measurements in metres, complete.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Measures {
            $($(#[$doc])* pub $name: f64,)*
            $($(#[$proportional_doc])* pub $proportional: f64,)*
        }

        impl Measures {
            /// Converts and checks each measurement.
            fn in_range(spec: &BodySpec) -> Result<Self, ShapeError> {
                let metres = |name, found_cm: f64, range: RangeInclusive<f64>| {
                    let (low_cm, high_cm) = (*range.start(), *range.end());
                    let error = ShapeError::Measurement { name, found_cm, low_cm, high_cm };
                    if range.contains(&found_cm) { Ok(found_cm / 100.0) } else { Err(error) }
                };
                let proportional = |name, given: Option<f64>, eu38: f64| {
                    let cm = given.unwrap_or(eu38 * spec.stature_cm / BodySpec::default().stature_cm);
                    metres(name, cm, 0.5 * eu38..=1.6 * eu38)
                };
                Ok(Self {
                    $($name: metres(stringify!($name), spec.$cm, $range)?,)*
                    $($proportional: proportional(stringify!($proportional), spec.$proportional_cm, $eu38)?,)*
                })
            }
        }
    };
}

measurements! {
    required {
        /// Height of the crown above the floor.
        stature, stature_cm = 168.0 in 120.0..=220.0;
        /// Girth over the fullest part of the bust, by tape.
        bust, bust_cm = 88.0 in 60.0..=150.0;
        /// Girth right below the bust.
        underbust, underbust_cm = 75.0 in 55.0..=140.0;
        /// Girth of the waist.
        waist, waist_cm = 72.0 in 45.0..=150.0;
        /// Girth over the fullest part of the hip, by tape.
        hip, hip_cm = 96.0 in 65.0..=160.0;
        /// Girth of the middle of the neck, across its axis.
        neck, neck_cm = 31.7 in 24.0..=50.0;
        /// Girth of the thigh right below the crotch.
        thigh, thigh_cm = 57.0 in 35.0..=90.0;
        /// Girth of the knee.
        knee, knee_cm = 36.1 in 24.0..=60.0;
        /// Largest girth of the calf.
        calf, calf_cm = 36.1 in 24.0..=60.0;
        /// Smallest girth of the ankle.
        ankle, ankle_cm = 21.3 in 15.0..=35.0;
        /// Girth of the upper arm, across it.
        biceps, biceps_cm = 27.9 in 18.0..=50.0;
        /// Girth of the wrist, across the arm.
        wrist, wrist_cm = 15.4 in 11.0..=25.0;
    }
    proportional {
        /// Distance from the side of the neck to the end of the shoulder.
        shoulder_length, shoulder_length_cm = 13.9;
        /// Distance from the end of the shoulder to the wrist.
        arm_length, arm_length_cm = 56.1;
        /// Height of the vertebra at the nape.
        cervicale_height, cervicale_height_cm = 144.1;
        /// Height of the end of the shoulder.
        acromion_height, acromion_height_cm = 137.7;
        /// Height of the armpit.
        axilla_height, axilla_height_cm = 128.5;
        /// Height of the bust girth.
        bust_height, bust_height_cm = 122.0;
        /// Height of the waist girth.
        waist_height, waist_height_cm = 103.2;
        /// Height of the hip girth.
        hip_height, hip_height_cm = 85.8;
        /// Height of the crotch.
        crotch_height, crotch_height_cm = 81.6;
        /// Height of the knee girth.
        knee_height, knee_height_cm = 46.5;
    }
}

impl BodySpec {
    /// Parses TOML.
    pub fn from_toml(text: &str) -> Result<Self, ShapeError> {
        toml::from_str(text).map_err(|e| ShapeError::Spec(e.to_string()))
    }

    /// The same spec with one measurement, named as its field without `_cm`, set to `cm`.
    pub fn with(&self, name: &str, cm: f64) -> Result<Self, ShapeError> {
        let fault = |e: &dyn std::fmt::Display| ShapeError::Spec(e.to_string());
        let mut table = toml::Table::try_from(self).map_err(|e| fault(&e))?;
        table.insert(format!("{}_cm", name.replace('-', "_")), toml::Value::Float(cm));
        table.try_into().map_err(|e| fault(&e))
    }

    /// The measurements in metres, complete.
    ///
    /// # Errors
    /// [`ShapeError::Measurement`] for one out of range, [`ShapeError::Order`] for heights out of order.
    pub fn measures(&self) -> Result<Measures, ShapeError> {
        let measures = Measures::in_range(self)?;
        measures.check_order()?;
        Ok(measures)
    }
}

impl Measures {
    /// Stature relative to the default body's 1.68 m; scales head, hands and feet.
    pub(crate) fn scale(&self) -> f64 {
        self.stature / 1.68
    }

    /// Refuses heights whose sections would overlap. The gaps are those at which the stations of trunk and legs (see
    /// [`anatomy`](super::anatomy)) still ascend; 2 cm is the least that leaves a surface between two levels.
    fn check_order(&self) -> Result<(), ShapeError> {
        let k = self.scale();
        let ladder = [
            ("knee_height", self.knee_height, 0.0),
            ("crotch_height", self.crotch_height, 0.12 * k),
            ("hip_height", self.hip_height, 0.017 * k),
            ("waist_height", self.waist_height, 0.041 * k),
            ("bust_height", self.bust_height, 0.0),
            ("axilla_height", self.axilla_height, 0.0),
            ("acromion_height", self.acromion_height, 0.041 * k),
            ("cervicale_height", self.cervicale_height, 0.031 * k),
            ("stature", self.stature, 0.0),
        ];
        for pair in ladder.windows(2) {
            let [(lower, below, _), (upper, above, gap)] = [pair[0], pair[1]];
            let gap = gap.max(0.02);
            if above < below + gap {
                let [lower_cm, upper_cm, gap_cm] = [below, above, gap].map(|m| 100.0 * m);
                return Err(ShapeError::Order { lower, lower_cm, upper, upper_cm, gap_cm });
            }
        }
        Ok(())
    }
}
