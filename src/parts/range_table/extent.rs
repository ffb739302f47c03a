//! The extent of a level: how wide and how tall a PART of it may be, measured along the cloth.
//!
//! Width is measured across the grain, height along it: the warp, which runs up the garment and along a sleeve. Cloth that hangs
//! folds around the body and the arm far more than along them (its displacement varies four times as fast on the flared skirt, six
//! times on the sleeve of pullover-1), so a PART may be taller than wide. Not in the paper, whose PARTs are as large as their level.

use super::METRES_PER_CM;

/// The widest and tallest a PART may be along the cloth, cm; infinite for a direction that is never cut.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Extent {
    /// Along the weft, around the body or the arm, cm.
    pub width_cm: f64,
    /// Along the warp, cm.
    pub height_cm: f64,
}

impl Extent {
    /// For a level that is never cut.
    pub const UNCUT: Self = Self { width_cm: f64::INFINITY, height_cm: f64::INFINITY };

    /// The same in all directions.
    #[must_use]
    pub fn even(cm: f64) -> Self {
        Self { width_cm: cm, height_cm: cm }
    }

    /// Whether it cuts at all.
    #[must_use]
    pub fn cuts(&self) -> bool {
        self.width_cm < f64::INFINITY || self.height_cm < f64::INFINITY
    }

    /// Whether both are above 0.
    #[must_use]
    pub(crate) fn is_valid(&self) -> bool {
        self.width_cm > 0.0 && self.height_cm > 0.0
    }

    /// Factors for lengths along weft and warp after which the extent is the same in all directions, and that extent, m.
    #[must_use]
    pub(crate) fn evened(&self) -> ([f64; 2], f64) {
        let Self { width_cm, height_cm } = *self;
        if width_cm == height_cm {
            ([1.0, 1.0], width_cm * METRES_PER_CM)
        } else if width_cm.is_finite() {
            ([1.0, width_cm / height_cm], width_cm * METRES_PER_CM)
        } else {
            ([0.0, 1.0], height_cm * METRES_PER_CM)
        }
    }

    /// The smaller of two in either direction.
    #[must_use]
    pub(crate) fn smaller(self, other: Self) -> Self {
        Self { width_cm: self.width_cm.min(other.width_cm), height_cm: self.height_cm.min(other.height_cm) }
    }

    /// As a row of a table has it: one number where both are the same.
    #[must_use]
    pub(crate) fn numbers_cm(&self) -> Vec<f64> {
        if self.width_cm == self.height_cm { vec![self.width_cm] } else { vec![self.width_cm, self.height_cm] }
    }

    /// The same in a column: `12`, `6x24`, `inf`.
    #[must_use]
    pub(crate) fn in_a_column(&self) -> String {
        self.numbers_cm().iter().map(f64::to_string).collect::<Vec<_>>().join("x")
    }
}

/// For people: `12`, `6 × 24`, `not cut`.
impl std::fmt::Display for Extent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // A table's own numbers are short; those that were metres in between are off by an ulp.
        let short = |cm: f64| if cm.is_finite() { ((cm * 1e4).round() / 1e4).to_string() } else { "∞".to_owned() };
        match (self.cuts(), self.width_cm == self.height_cm) {
            (false, _) => f.write_str("not cut"),
            (true, true) => f.write_str(&short(self.width_cm)),
            (true, false) => write!(f, "{} × {}", short(self.width_cm), short(self.height_cm)),
        }
    }
}

impl From<Extent> for String {
    fn from(extent: Extent) -> Self {
        extent.in_a_column()
    }
}

impl TryFrom<String> for Extent {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split('x').map(str::parse).collect();
        let extent = match numbers.as_deref() {
            Ok([cm]) => Self::even(*cm),
            Ok([width_cm, height_cm]) => Self { width_cm: *width_cm, height_cm: *height_cm },
            _ => return Err(format!("found \"{text}\", expected an extent in centimetres such as 12, 6x24 or inf")),
        };
        Ok(extent)
    }
}
