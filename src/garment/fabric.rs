//! Fabrics: the measured constants of a cloth, with their source.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ρ | areal density | kg/m² |
//! | k_u, k_v | membrane stiffness along weft and warp | N/m |
//! | μ | in-plane shear stiffness | N/m |
//! | ν | Poisson's ratio, couples weft and warp | – |
//! | B | bending stiffness along weft, on the bias and along warp | N·m |
//! | μ_f | Coulomb friction against the body | – |

mod mean;

use serde::{Deserialize, Serialize};

pub(crate) use mean::at_vertices;

use crate::base::files::{Unreadable, names_a_file, read_text};

/// The constants of one fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// What it is called on the command line and in reports.
    pub name: String,
    /// Where the figures come from.
    pub source: String,
    /// Areal density ρ, kg/m².
    pub density_kg_per_m2: f64,
    /// Thickness, m: also how far its middle surface stays off the body.
    pub thickness_m: f64,
    /// Membrane stiffness along the weft k_u, N/m.
    pub stretch_weft_n_per_m: f64,
    /// Membrane stiffness along the warp k_v, N/m.
    pub stretch_warp_n_per_m: f64,
    /// Shear stiffness μ, N/m.
    pub shear_n_per_m: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Bending stiffness along weft, at 45 degrees and along warp, N·m.
    pub bending_nm: [f64; 3],
    /// Coulomb friction coefficient against the body.
    pub friction: f64,
}

/// The fabrics inside the binary, as they stand in `assets/fabrics/`.
const FILES: [(&str, &str); 11] = [
    ("interlock", include_str!("../../assets/fabrics/interlock.toml")),
    ("jersey", include_str!("../../assets/fabrics/jersey.toml")),
    ("rib-knit", include_str!("../../assets/fabrics/rib-knit.toml")),
    ("ponte", include_str!("../../assets/fabrics/ponte.toml")),
    ("denim", include_str!("../../assets/fabrics/denim.toml")),
    ("trouser", include_str!("../../assets/fabrics/trouser.toml")),
    ("tablecloth", include_str!("../../assets/fabrics/tablecloth.toml")),
    ("polyester-jacket", include_str!("../../assets/fabrics/polyester-jacket.toml")),
    ("silk", include_str!("../../assets/fabrics/silk.toml")),
    ("cotton", include_str!("../../assets/fabrics/cotton.toml")),
    ("wool", include_str!("../../assets/fabrics/wool.toml")),
];

/// Names of the built-in fabrics.
pub const BUILT_IN: [&str; FILES.len()] = {
    let mut names = [""; FILES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = FILES[i].0;
        i += 1;
    }
    names
};

/// What can be wrong with a fabric.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum FabricError {
    /// No such name.
    #[error("no fabric is called `{found}`; expected one of {known}, or a TOML file")]
    Unknown { found: String, known: String },
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// Not a fabric file.
    #[error("{file}: {reason}; see assets/fabrics/ for examples")]
    Syntax { file: String, reason: String },
    /// A constant no cloth can have.
    #[error("{file}: {key} is {}; expected {expected}", plain(*found))]
    Constant { file: String, key: &'static str, found: f64, expected: &'static str },
}

/// The fabric unless asked otherwise.
pub(crate) const DEFAULT_FABRIC: &str = BUILT_IN[0];

impl Default for Fabric {
    /// The first of the built-in ones, a knit.
    fn default() -> Self {
        // The text is part of the program and a test reads it, so it always parses.
        Self::parse(FILES[0].1, DEFAULT_FABRIC).unwrap_or_else(|e| unreachable!("{e}"))
    }
}

/// A number with as few digits as it needs: 1e200 has two hundred zeros.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-6..1e10).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

impl Fabric {
    /// A built-in fabric, or one from a TOML file.
    pub fn by_name(name: &str) -> Result<Self, FabricError> {
        if names_a_file(name) {
            return Self::parse(&read_text(name.as_ref())?, name);
        }
        match FILES.iter().find(|(known, _)| *known == name) {
            Some((known, text)) => Self::parse(text, known),
            None => Err(FabricError::Unknown { found: name.to_owned(), known: BUILT_IN.join(", ") }),
        }
    }

    /// Bending stiffness of all directions on average, N·m.
    pub(crate) fn mean_bending_nm(&self) -> f64 {
        let [weft, bias, warp] = self.bending_nm;
        0.25 * (weft + 2.0 * bias + warp)
    }

    /// Reads a fabric from TOML; `file` is named in errors.
    pub fn parse(text: &str, file: &str) -> Result<Self, FabricError> {
        let fabric: Self = toml::from_str(text)
            .map_err(|e| FabricError::Syntax { file: file.to_owned(), reason: e.to_string().trim_end().to_owned() })?;
        fabric.check(file)?;
        Ok(fabric)
    }

    /// Whether every constant can be used; `file` is named in errors.
    pub(crate) fn check(&self, file: &str) -> Result<(), FabricError> {
        let positive = [
            ("density_kg_per_m2", self.density_kg_per_m2),
            ("thickness_m", self.thickness_m),
            ("stretch_weft_n_per_m", self.stretch_weft_n_per_m),
            ("stretch_warp_n_per_m", self.stretch_warp_n_per_m),
            ("shear_n_per_m", self.shear_n_per_m),
            ("bending_nm, weft", self.bending_nm[0]),
            ("bending_nm, bias", self.bending_nm[1]),
            ("bending_nm, warp", self.bending_nm[2]),
        ];
        let wrong = |key, found, expected| FabricError::Constant { file: file.to_owned(), key, found, expected };
        for (key, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(wrong(key, value, "a positive, finite number"));
            }
        }
        // From far below gossamer to far above sheet steel: beyond, rounding decides and not the cloth.
        let density = ("density_kg_per_m2", self.density_kg_per_m2);
        if !(1e-4..=1e2).contains(&density.1) {
            return Err(wrong(
                density.0,
                density.1,
                "kilograms per square metre, 0.0001 to 100; most cloth has 0.05 to 0.6",
            ));
        }
        for (key, value) in positive.into_iter().filter(|(key, _)| key.ends_with("n_per_m")) {
            if !(1e-3..=1e9).contains(&value) {
                return Err(wrong(key, value, "newtons per metre, 0.001 to 1e9; most cloth has 5 to 10,000"));
            }
        }
        for (key, value) in positive.into_iter().filter(|(key, _)| key.starts_with("bending_nm")) {
            if !(1e-12..=1e3).contains(&value) {
                return Err(wrong(key, value, "newton metres, 1e-12 to 1000; most cloth has 1e-6 to 1e-3"));
            }
        }
        // Beyond √(k_u k_v) the membrane's energy would have no lower bound; one half is the isotropic limit.
        if !(0.0..=0.5).contains(&self.poisson) {
            return Err(wrong("poisson", self.poisson, "0 to 0.5"));
        }
        if !(0.0..=10.0).contains(&self.friction) {
            return Err(wrong("friction", self.friction, "0 (none) to 10"));
        }
        // Thicker than this is upholstery, and a likely slip of the unit.
        if self.thickness_m > 0.02 {
            return Err(wrong("thickness_m", self.thickness_m, "metres, at most 0.02; is it in millimetres?"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_fabric_reads_and_bears_its_name() {
        for name in BUILT_IN {
            assert_eq!(Fabric::by_name(name).unwrap().name, name);
        }
    }

    #[test]
    fn mistakes_are_named() {
        let good = FILES[0].1;
        let said = |text: &str| Fabric::parse(text, "f.toml").unwrap_err().to_string();
        assert!(said(&good.replace("poisson = 0.3", "poisson = 0.9")).contains("poisson is 0.9"));
        assert!(said(&good.replace("8.00e-04", "0.8")).contains("millimetres"));
        assert!(said(&good.replace("friction", "frction")).contains("frction"));
        for (key, value) in
            [("stretch_warp_n_per_m", "1e200"), ("shear_n_per_m", "1e-9"), ("density_kg_per_m2", "1e-300")]
        {
            let start = good.find(key).unwrap();
            let line = good[start..].lines().next().unwrap();
            let text = said(&good.replace(line, &format!("{key} = {value}")));
            assert!(text.contains(key) && text.contains("most cloth"), "{text}");
        }
        assert!(said(&good.replace("density_kg_per_m2 = 0.187", "density_kg_per_m2 = nan")).contains("density"));
        assert!(Fabric::by_name("tweed").unwrap_err().to_string().contains("denim"));
    }
}
