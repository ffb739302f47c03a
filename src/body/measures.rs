//! The named measurements of a body.
//!
//! Defaults are ANSUR II (women, n = 1,986) regressed on stature 168, bust 88, waist 72 and hip 96 cm, which is the European
//! size 38. ANSUR II has neither underbust nor knee girth: the underbust is the bust less the 13 cm of a B cup, the knee equals
//! the calf. Heights and lengths that are not given are proportional to stature. [`BodySpec`] is in centimetres, [`Measures`] in
//! metres.

use serde::{Deserialize, Serialize};

/// Measurements and descriptions that no mesh can be made of.
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
    #[error("there is no garment called {found:?}; the built-in ones are {known}")]
    Unknown { found: String, known: String },
    /// A surface that is not a manifold, which the ranges above should exclude.
    #[error("the {what} has no manifold surface at these measurements; bring them nearer to each other")]
    NotManifold { what: &'static str },
}

/// The measurements of a body, in centimetres. Defaults are European size 38; heights and lengths that are not given are
/// proportional to stature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BodySpec {
    /// Height of the crown above the floor.
    pub stature_cm: f64,
    /// Girth over the fullest part of the bust, by tape.
    pub bust_cm: f64,
    /// Girth right below the bust.
    pub underbust_cm: f64,
    /// Girth of the waist.
    pub waist_cm: f64,
    /// Girth over the fullest part of the hip, by tape.
    pub hip_cm: f64,
    /// Girth of the middle of the neck, across its axis.
    pub neck_cm: f64,
    /// Girth of the thigh right below the crotch.
    pub thigh_cm: f64,
    /// Girth of the knee.
    pub knee_cm: f64,
    /// Largest girth of the calf.
    pub calf_cm: f64,
    /// Smallest girth of the ankle.
    pub ankle_cm: f64,
    /// Girth of the upper arm, across it.
    pub biceps_cm: f64,
    /// Girth of the wrist, across the arm.
    pub wrist_cm: f64,
    /// Distance from the side of the neck to the end of the shoulder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shoulder_length_cm: Option<f64>,
    /// Distance from the end of the shoulder to the wrist.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm_length_cm: Option<f64>,
    /// Height of the vertebra at the nape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cervicale_height_cm: Option<f64>,
    /// Height of the end of the shoulder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acromion_height_cm: Option<f64>,
    /// Height of the armpit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axilla_height_cm: Option<f64>,
    /// Height of the bust girth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bust_height_cm: Option<f64>,
    /// Height of the waist girth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waist_height_cm: Option<f64>,
    /// Height of the hip girth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hip_height_cm: Option<f64>,
    /// Height of the crotch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crotch_height_cm: Option<f64>,
    /// Height of the knee girth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knee_height_cm: Option<f64>,
}

impl Default for BodySpec {
    fn default() -> Self {
        Self {
            stature_cm: 168.0,
            bust_cm: 88.0,
            underbust_cm: 75.0,
            waist_cm: 72.0,
            hip_cm: 96.0,
            neck_cm: 31.7,
            thigh_cm: 57.0,
            knee_cm: 36.1,
            calf_cm: 36.1,
            ankle_cm: 21.3,
            biceps_cm: 27.9,
            wrist_cm: 15.4,
            shoulder_length_cm: None,
            arm_length_cm: None,
            cervicale_height_cm: None,
            acromion_height_cm: None,
            axilla_height_cm: None,
            bust_height_cm: None,
            waist_height_cm: None,
            hip_height_cm: None,
            crotch_height_cm: None,
            knee_height_cm: None,
        }
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
        let in_range = |name: &'static str, cm: f64, low: f64, high: f64| {
            if (low..=high).contains(&cm) {
                Ok(cm / 100.0)
            } else {
                Err(ShapeError::Measurement { name, found_cm: cm, low_cm: low, high_cm: high })
            }
        };
        let stature = in_range("stature", self.stature_cm, 120.0, 220.0)?;
        // The EU 38 column has a stature of 168 cm.
        let part = |name, given: Option<f64>, eu38: f64| {
            in_range(name, given.unwrap_or(eu38 * self.stature_cm / 168.0), 0.5 * eu38, 1.6 * eu38)
        };
        let m = Measures {
            stature,
            bust: in_range("bust", self.bust_cm, 60.0, 150.0)?,
            underbust: in_range("underbust", self.underbust_cm, 55.0, 140.0)?,
            waist: in_range("waist", self.waist_cm, 45.0, 150.0)?,
            hip: in_range("hip", self.hip_cm, 65.0, 160.0)?,
            neck: in_range("neck", self.neck_cm, 24.0, 50.0)?,
            thigh: in_range("thigh", self.thigh_cm, 35.0, 90.0)?,
            knee: in_range("knee", self.knee_cm, 24.0, 60.0)?,
            calf: in_range("calf", self.calf_cm, 24.0, 60.0)?,
            ankle: in_range("ankle", self.ankle_cm, 15.0, 35.0)?,
            biceps: in_range("biceps", self.biceps_cm, 18.0, 50.0)?,
            wrist: in_range("wrist", self.wrist_cm, 11.0, 25.0)?,
            shoulder_length: part("shoulder_length", self.shoulder_length_cm, 13.9)?,
            arm_length: part("arm_length", self.arm_length_cm, 56.1)?,
            cervicale: part("cervicale_height", self.cervicale_height_cm, 144.1)?,
            acromion: part("acromion_height", self.acromion_height_cm, 137.7)?,
            axilla: part("axilla_height", self.axilla_height_cm, 128.5)?,
            bust_height: part("bust_height", self.bust_height_cm, 122.0)?,
            waist_height: part("waist_height", self.waist_height_cm, 103.2)?,
            hip_height: part("hip_height", self.hip_height_cm, 85.8)?,
            crotch: part("crotch_height", self.crotch_height_cm, 81.6)?,
            knee_height: part("knee_height", self.knee_height_cm, 46.5)?,
        };
        m.check_order()?;
        Ok(m)
    }
}

/// A body's measurements in metres, complete.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "the same names as in BodySpec, which documents them")]
pub struct Measures {
    pub stature: f64,
    pub bust: f64,
    pub underbust: f64,
    pub waist: f64,
    pub hip: f64,
    pub neck: f64,
    pub thigh: f64,
    pub knee: f64,
    pub calf: f64,
    pub ankle: f64,
    pub biceps: f64,
    pub wrist: f64,
    pub shoulder_length: f64,
    pub arm_length: f64,
    pub cervicale: f64,
    pub acromion: f64,
    pub axilla: f64,
    pub bust_height: f64,
    pub waist_height: f64,
    pub hip_height: f64,
    pub crotch: f64,
    pub knee_height: f64,
}

impl Measures {
    /// Stature relative to the default body's 1.68 m; scales what is not measured (head, hands, feet).
    #[must_use]
    pub(crate) fn scale(&self) -> f64 {
        self.stature / 1.68
    }

    /// Refuses heights whose sections would overlap. The gaps are those at which the stations of trunk and legs (see
    /// [`anatomy`](super::anatomy)) still ascend; 2 cm is the least that leaves a surface between two levels.
    fn check_order(&self) -> Result<(), ShapeError> {
        let k = self.scale();
        let ladder = [
            ("knee_height", self.knee_height, 0.0),
            ("crotch_height", self.crotch, 0.12 * k),
            ("hip_height", self.hip_height, 0.017 * k),
            ("waist_height", self.waist_height, 0.041 * k),
            ("bust_height", self.bust_height, 0.0),
            ("axilla_height", self.axilla, 0.0),
            ("acromion_height", self.acromion, 0.041 * k),
            ("cervicale_height", self.cervicale, 0.031 * k),
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
