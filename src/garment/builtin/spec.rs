//! Descriptions of garments: a few lengths and eases, in centimetres.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::body::measures::ShapeError;

/// The names of the built-in garments, in the order of the paper's Table 4.
pub const BUILT_IN: [&str; 5] = ["pullover-1", "pullover-2", "flared-skirt", "low-cut-dress", "long-sleeved-dress"];

/// The two vertex counts of each built-in garment in the paper's Table 4.
pub const TABLE_4_SIZES: [[usize; 2]; 5] = [[5103, 4710], [4986, 4554], [3920, 3613], [6463, 5628], [10861, 9867]];

/// Specs of [`BUILT_IN`], in its order.
const SPECS: [&str; 5] = [
    include_str!("../../../assets/garments/pullover-1.toml"),
    include_str!("../../../assets/garments/pullover-2.toml"),
    include_str!("../../../assets/garments/flared-skirt.toml"),
    include_str!("../../../assets/garments/low-cut-dress.toml"),
    include_str!("../../../assets/garments/long-sleeved-dress.toml"),
];

/// The support of a garment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Support {
    /// It hangs from the shoulders.
    Shoulders,
    /// Its upper edge is held at the waist.
    Waist,
}

/// Excess girth of the garment over the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ease {
    /// At the bust, cm.
    pub bust_cm: f64,
    /// At the waist, cm.
    pub waist_cm: f64,
    /// At the hip, cm.
    pub hip_cm: f64,
}

impl Default for Ease {
    fn default() -> Self {
        Self { bust_cm: 8.0, waist_cm: 8.0, hip_cm: 8.0 }
    }
}

/// The opening for the head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Neckline {
    /// From shoulder to shoulder, cm.
    pub width_cm: f64,
    /// Depth below the shoulder in front, cm.
    pub front_depth_cm: f64,
    /// Depth below the shoulder behind, cm.
    pub back_depth_cm: f64,
}

/// Sleeves along the arms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sleeves {
    /// From the end of the shoulder, as a share of the arm's length to the wrist.
    pub length: f64,
    /// Excess girth at the upper arm, cm.
    pub ease_cm: f64,
    /// Excess girth at the lower end, cm.
    pub cuff_ease_cm: f64,
}

/// A garment's description.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GarmentSpec {
    /// Its name.
    pub name: String,
    /// Its support.
    pub carried_by: Support,
    /// From the shoulder at the neck, or from the waist, down to the hem, cm.
    pub length_cm: f64,
    /// Ease over the body.
    #[serde(default)]
    pub ease: Ease,
    /// Girth of the hem less the garment's girth at the hip (from the waist: at the waist), cm.
    #[serde(default)]
    pub flare_cm: f64,
    /// Excess width of the hem in the rest shape as a share of the placed hem, falling to none at the top; it folds when draped.
    #[serde(default)]
    pub fullness: f64,
    /// Default number of vertices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Edge length of the triangles instead of a number of vertices, cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_length_cm: Option<f64>,
    /// The opening for the head; required with `carried_by = "shoulders"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neckline: Option<Neckline>,
    /// Sleeves; without them there are armholes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleeves: Option<Sleeves>,
    /// Width of the cloth left on the shoulder of a garment without sleeves, cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strap_cm: Option<f64>,
}

impl GarmentSpec {
    /// One of the built-in garments.
    pub fn by_name(name: &str) -> Result<Self, ShapeError> {
        match BUILT_IN.iter().position(|&n| n == name) {
            Some(i) => Self::from_toml(SPECS[i]),
            None => Err(ShapeError::Unknown { found: name.to_owned(), known: BUILT_IN.join(", ") }),
        }
    }

    /// Reads a spec from TOML and checks it.
    pub fn from_toml(text: &str) -> Result<Self, ShapeError> {
        let spec: Self = toml::from_str(text).map_err(|e| ShapeError::Spec(e.to_string()))?;
        spec.check()?;
        Ok(spec)
    }

    /// Checks every length.
    pub(crate) fn check(&self) -> Result<(), ShapeError> {
        let (sleeves, neckline) = (self.sleeves.as_ref(), self.neckline.as_ref());
        let lengths = [
            ("length_cm", Some(self.length_cm), 15.0, 160.0),
            ("ease.bust_cm", Some(self.ease.bust_cm), 4.0, 80.0),
            ("ease.waist_cm", Some(self.ease.waist_cm), 4.0, 100.0),
            ("ease.hip_cm", Some(self.ease.hip_cm), 4.0, 100.0),
            ("flare_cm", Some(self.flare_cm), 0.0, 400.0),
            ("fullness", Some(self.fullness), 0.0, 3.0),
            ("edge_length_cm", self.edge_length_cm, 0.05, 8.0),
            ("sleeves.length", sleeves.map(|s| s.length), 0.2, 1.0),
            ("sleeves.ease_cm", sleeves.map(|s| s.ease_cm), 4.0, 40.0),
            ("sleeves.cuff_ease_cm", sleeves.map(|s| s.cuff_ease_cm), 4.0, 60.0),
            ("strap_cm", self.strap_cm, 2.0, 10.0),
            ("neckline.width_cm", neckline.map(|n| n.width_cm), 14.0, 30.0),
            ("neckline.front_depth_cm", neckline.map(|n| n.front_depth_cm), 3.0, 30.0),
            ("neckline.back_depth_cm", neckline.map(|n| n.back_depth_cm), 1.0, 30.0),
        ];
        for (name, found, low, high) in lengths {
            if let Some(found) = found.filter(|found| !(low..=high).contains(found)) {
                return Err(ShapeError::Length { name, found, low, high });
            }
        }
        if self.carried_by == Support::Shoulders && neckline.is_none() {
            return Err(ShapeError::Spec("a garment carried by the shoulders needs [neckline]".to_owned()));
        }
        Ok(())
    }
}

/// A garment as `NAME` or `NAME@VERTICES`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GarmentRequest {
    /// The name.
    pub name: String,
    /// The number of vertices; `None` takes the spec's.
    pub vertices: Option<usize>,
}

impl FromStr for GarmentRequest {
    type Err = ShapeError;

    fn from_str(text: &str) -> Result<Self, ShapeError> {
        let Some((name, count)) = text.split_once('@') else {
            return Ok(Self { name: text.to_owned(), vertices: None });
        };
        let vertices = count.parse().map_err(|_| {
            ShapeError::Spec(format!("{count:?} after the @ of {text:?} is no number of vertices; write {name}@5000"))
        })?;
        Ok(Self { name: name.to_owned(), vertices: Some(vertices) })
    }
}
