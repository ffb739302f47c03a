//! Readings of equations (2) to (9): one option for each ambiguity or error of the printed equations. The defaults work; the
//! literal readings are available to reproduce their failure.

use serde::{Deserialize, Serialize};

/// ΔV in (2) and (7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Volume {
    /// Barycentric vertex area × thickness: the cloth's own volume, in any frame.
    #[default]
    #[serde(rename = "area")]
    AreaTimesThickness,
    /// Δx Δy Δz to the adjacent point, as printed. A triangle mesh has no next point, so each factor is the mean absolute
    /// difference to the neighbours. Fails: zero wherever the cloth lies along an axis, and another value in another frame.
    Cuboid,
}

/// cos(•_p) in Fᵃ of (2) and (7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cosine {
    /// |cos|: a stiffness is positive.
    #[default]
    Absolute,
    /// cos, as printed. Fails: around a closed ring the cosines cancel and D = F/Fᵃ grows without bound.
    Signed,
    /// sin(•_p) = √(1 − cos²): the share of the axis that lies in the cloth, where a membrane's force is. Not on the page; it
    /// gives hanging cloth, whose normal is horizontal, a vertical stiffness, which the other two do not.
    InSurface,
}

/// q as a factor of Fᵃ in (2) and (7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clearance {
    /// max(q, 0) + thickness: the cloth's outer face, at least a thickness away, so that a tight PART keeps a stiffness. The
    /// floor is reached by vertices inside the body, which are counted.
    #[default]
    PlusThickness,
    /// q, as printed. Fails: zero on the skin, negative inside, so a tight PART has no stiffness or a negative one.
    Literal,
}

/// The sign of D_z in (9).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contactless {
    /// −F⁰/Fᵃ, which is (6) with F¹ = 0: cloth moves down.
    #[default]
    #[serde(rename = "as-equation-6")]
    AsEquation6,
    /// F⁰/Fᵃ, as printed. Fails: cloth moves up.
    AsPrinted,
}

/// q_f in (2) and (7), N/m³.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyForce {
    /// One scalar from the vertical balance of the whole garment: Σ q_f cos γ_q ΔV over the contact PARTs = its weight.
    #[default]
    #[serde(rename = "balance")]
    FromBalance,
    /// This value.
    Given(f64),
}

/// p_f in (2) and (7), N/m⁵.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineForce {
    /// From the membrane stiffness of the fabric along the warp, so that a hanging strip stretches as its closed form for any
    /// number of PARTs.
    #[default]
    #[serde(rename = "membrane")]
    FromMembrane,
    /// This value, everywhere.
    Given(f64),
}

/// The meaning of "directly attached" for a garment without a vertex within the contact distance, as before a drape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Untouched {
    /// The contact distance counts from the nearest vertex of the garment; a warning is issued.
    #[default]
    FromNearest,
    /// All PARTs are contactless, as in (9), and nothing carries the garment; a warning is issued.
    Contactless,
}

/// The readings of equations (2) to (9).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperOptions {
    /// ΔV.
    pub volume: Volume,
    /// cos(•_p).
    pub cosine: Cosine,
    /// q as a factor.
    pub clearance: Clearance,
    /// The sign of (9).
    pub contactless: Contactless,
    /// q_f.
    pub body_force: BodyForce,
    /// p_f.
    pub line_force: LineForce,
    /// A PART is in contact if any of its vertices is at most this far from the body, m. Default 0.5 cm, the upper value of
    /// level 7 in Table 3: the paper only says "directly attached" and "contactless".
    pub contact_distance_m: f64,
    /// The PARTs in contact if no vertex is within that distance.
    pub untouched: Untouched,
    /// An axis has no stiffness where |Σ cos q ΔV| is at most this share of Σ |q| ΔV. Default 0.02: cloth within about one
    /// degree of the axis, less than the accuracy of the normals of a triangle mesh. The same share of Σ ΔV decides whether the
    /// contact PARTs can carry the garment at all.
    pub degenerate_below: f64,
}

impl Default for PaperOptions {
    fn default() -> Self {
        Self {
            volume: Volume::default(),
            cosine: Cosine::default(),
            clearance: Clearance::default(),
            contactless: Contactless::default(),
            body_force: BodyForce::default(),
            line_force: LineForce::default(),
            contact_distance_m: 0.005,
            untouched: Untouched::default(),
            degenerate_below: 0.02,
        }
    }
}
