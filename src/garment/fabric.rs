//! Fabrics: the measured constants of a cloth, with their source.
//!
//! A vertex between two fabrics has the mean of their constants, weighted by the rest area that it has of each:
//!
//! c_v = Σ A_t c_t / Σ A_t = c₀ + Σ A_t (c_t − c₀) / Σ A_t
//!
//! over its triangles t, with c₀ the constant of one of them. The second form gives a vertex within one fabric that fabric's
//! constant to the last bit.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ρ | areal density | kg/m² |
//! | k_u, k_v | membrane stiffness along weft and warp | N/m |
//! | μ | in-plane shear stiffness | N/m |
//! | ν | Poisson's ratio, couples weft and warp | – |
//! | B | bending stiffness along weft, on the bias and along warp | N·m |
//! | HB | Coulomb moment of the friction between yarns, per length | N |
//! | μ_f | Coulomb friction against the body | – |
//! | c | any of these constants | its own |
//! | A_t | rest area of a triangle | m² |

use serde::{Deserialize, Serialize};

use crate::base::error_text::did_you_mean;
use crate::base::files::{Unreadable, names_a_file, read_text};
use crate::mesh::{RestShape, TriMesh};

/// The constants of one fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// Its name on the command line and in reports.
    pub name: String,
    /// The source of the constants.
    pub source: String,
    /// Areal density ρ, kg/m².
    pub density_kg_per_m2: f64,
    /// Thickness, m; also the distance of its middle surface from the body.
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
    /// Coulomb moment per length HB of the friction between yarns along weft and warp, N: half of what KES reports as 2HB. Without it, the
    /// cloth bends elastically.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub bending_friction_n: [f64; 2],
    /// Coulomb friction coefficient against the body.
    pub friction: f64,
}

fn is_zero(moments: &[f64; 2]) -> bool {
    *moments == [0.0; 2]
}

/// Names of the built-in fabrics.
pub const BUILT_IN: [&str; 11] = [
    "interlock",
    "jersey",
    "rib-knit",
    "ponte",
    "denim",
    "trouser",
    "tablecloth",
    "polyester-jacket",
    "silk",
    "cotton",
    "wool",
];

/// The files of [`BUILT_IN`], in its order.
const FILES: [&str; BUILT_IN.len()] = [
    include_str!("../../assets/fabrics/interlock.toml"),
    include_str!("../../assets/fabrics/jersey.toml"),
    include_str!("../../assets/fabrics/rib-knit.toml"),
    include_str!("../../assets/fabrics/ponte.toml"),
    include_str!("../../assets/fabrics/denim.toml"),
    include_str!("../../assets/fabrics/trouser.toml"),
    include_str!("../../assets/fabrics/tablecloth.toml"),
    include_str!("../../assets/fabrics/polyester-jacket.toml"),
    include_str!("../../assets/fabrics/silk.toml"),
    include_str!("../../assets/fabrics/cotton.toml"),
    include_str!("../../assets/fabrics/wool.toml"),
];

/// Errors of fabrics and their files.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum FabricError {
    /// An unknown name.
    #[error("no fabric is called `{found}`{}; expected one of {known}, or a TOML file", did_you_mean(found, BUILT_IN))]
    Unknown { found: String, known: String },
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A file that is no fabric.
    #[error("{file}: {reason}; see assets/fabrics/ for examples")]
    Syntax { file: String, reason: String },
    /// A constant out of range.
    #[error("{file}: {key} is {}; expected {expected}", plain(*found))]
    Constant { file: String, key: &'static str, found: f64, expected: &'static str },
}

/// The default fabric.
pub(crate) const DEFAULT_FABRIC: &str = BUILT_IN[0];

impl Default for Fabric {
    /// `DEFAULT_FABRIC`, a knit.
    fn default() -> Self {
        // A test parses the built-in text.
        Self::parse(FILES[0], DEFAULT_FABRIC).unwrap_or_else(|e| unreachable!("{e}"))
    }
}

/// A number in its shorter notation: 1e200 has two hundred zeros.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-6..1e10).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

impl Fabric {
    /// A built-in fabric, or one from a TOML file.
    pub fn by_name(name: &str) -> Result<Self, FabricError> {
        if names_a_file(name) {
            return Self::parse(&read_text(name.as_ref())?, name);
        }
        match BUILT_IN.iter().position(|known| *known == name) {
            Some(i) => Self::parse(FILES[i], name),
            None => Err(FabricError::Unknown { found: name.to_owned(), known: BUILT_IN.join(", ") }),
        }
    }

    /// Bending stiffness averaged over all directions, N·m.
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

    /// Warnings of constants that can be used but that no cloth has: most often they are in another unit.
    pub(crate) fn warnings(&self) -> Vec<String> {
        // Four numbers each: the range without a warning, at least ten times as wide at each end as that of the built-in fabrics, and
        // the latter.
        let [weft, bias, warp] = self.bending_nm;
        let (stretch, bending) = ([3.0, 5e4, 30.0, 5e3], [2e-7, 5e-3, 2e-6, 1.3e-4]);
        // Without friction, or a tenth of the least to ten times the most of the four fabrics of assets/validation.
        let friction = [0.0, 6e-3, 0.0, 6.1e-4];
        let constants = [
            ("density_kg_per_m2", self.density_kg_per_m2, [0.01, 3.0, 0.09, 0.33]),
            ("thickness_m", self.thickness_m, [1e-5, 1e-2, 1.5e-4, 1e-3]),
            ("stretch_weft_n_per_m", self.stretch_weft_n_per_m, stretch),
            ("stretch_warp_n_per_m", self.stretch_warp_n_per_m, stretch),
            ("shear_n_per_m", self.shear_n_per_m, [0.7, 5e3, 7.0, 52.0]),
            ("bending_nm, weft", weft, bending),
            ("bending_nm, bias", bias, bending),
            ("bending_nm, warp", warp, bending),
            ("bending_friction_n, weft", self.bending_friction_n[0], friction),
            ("bending_friction_n, warp", self.bending_friction_n[1], friction),
            ("friction", self.friction, [0.0, 3.0, 0.3, 0.3]),
        ];
        let odd = constants.into_iter().filter(|(_, found, [low, high, ..])| !(low..=high).contains(&found));
        odd.map(|(key, found, [_, _, least, most])| {
            let (name, found) = (&self.name, plain(found));
            format!(
                "fabric {name}: {key} is {found}, which no cloth has (the built-in fabrics have {} to {}); is it in another unit?",
                plain(least),
                plain(most)
            )
        })
        .collect()
    }

    /// Checks every constant; `file` is named in errors.
    pub(crate) fn check(&self, file: &str) -> Result<(), FabricError> {
        let positive = "a positive, finite number";
        // The upper and lower bounds run from far below gossamer to far above sheet steel; beyond, rounding dominates.
        let density = "kilograms per square metre, 0.0001 to 100; most cloth has 0.05 to 0.6";
        let stiffness = "newtons per metre, 0.001 to 1e9; most cloth has 5 to 10,000";
        let bending = "newton metres, 1e-12 to 1000; most cloth has 1e-6 to 1e-3";
        // Thicker cloth is upholstery, and probably has a wrong unit.
        let thickness = "metres, at most 0.02; is it in millimetres?";
        let constants = [
            ("density_kg_per_m2", self.density_kg_per_m2, 1e-4..=1e2, density),
            ("thickness_m", self.thickness_m, 0.0..=0.02, thickness),
            ("stretch_weft_n_per_m", self.stretch_weft_n_per_m, 1e-3..=1e9, stiffness),
            ("stretch_warp_n_per_m", self.stretch_warp_n_per_m, 1e-3..=1e9, stiffness),
            ("shear_n_per_m", self.shear_n_per_m, 1e-3..=1e9, stiffness),
            ("bending_nm, weft", self.bending_nm[0], 1e-12..=1e3, bending),
            ("bending_nm, bias", self.bending_nm[1], 1e-12..=1e3, bending),
            ("bending_nm, warp", self.bending_nm[2], 1e-12..=1e3, bending),
        ];
        let bending_friction = "newtons (newton metres per metre), 0 (none) to 1; most cloth has 0.00002 to 0.001";
        let others = [
            ("bending_friction_n, weft", self.bending_friction_n[0], 0.0..=1.0, bending_friction),
            ("bending_friction_n, warp", self.bending_friction_n[1], 0.0..=1.0, bending_friction),
            // Beyond √(k_u k_v) the membrane energy would have no lower bound; one half is the isotropic limit.
            ("poisson", self.poisson, 0.0..=0.5, "0 to 0.5"),
            ("friction", self.friction, 0.0..=10.0, "0 (none) to 10"),
        ];
        let wrong = |key, found, expected| FabricError::Constant { file: file.to_owned(), key, found, expected };
        if let Some(&(key, value, ..)) = constants.iter().find(|(_, value, ..)| !(value.is_finite() && *value > 0.0)) {
            return Err(wrong(key, value, positive));
        }
        match constants.into_iter().chain(others).find(|(_, value, range, _)| !range.contains(value)) {
            Some((key, value, _, expected)) => Err(wrong(key, value, expected)),
            None => Ok(()),
        }
    }
}

impl AsRef<[Fabric]> for Fabric {
    /// The fabrics of a garment that is cut from one.
    fn as_ref(&self) -> &[Self] {
        std::slice::from_ref(self)
    }
}

/// A constant of the fabrics at every vertex; at a vertex without triangles, that of the first fabric.
pub(crate) fn at_vertices(
    mesh: &TriMesh,
    rest: &RestShape,
    fabrics: &[Fabric],
    constant: impl Fn(&Fabric) -> f64,
) -> Vec<f64> {
    let of: Vec<f64> = fabrics.iter().map(constant).collect();
    let n = mesh.vertex_count();
    let first = of.first().copied().unwrap_or_default();
    let (mut base, mut more, mut area) = (vec![first; n], vec![0.0; n], vec![0.0; n]);
    for ((t, triangle), own) in mesh.triangles.iter().enumerate().zip(rest.areas()) {
        let c = of.get(rest.fabric_of(t)).copied().unwrap_or(first);
        for v in triangle.map(|v| v as usize) {
            if area[v] == 0.0 {
                base[v] = c;
            }
            area[v] += own.abs();
            more[v] += own.abs() * (c - base[v]);
        }
    }
    let mean = |((base, more), area): ((f64, f64), f64)| if area > 0.0 { base + more / area } else { base };
    base.into_iter().zip(more).zip(area).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_fabric_parses_and_has_its_name() {
        for name in BUILT_IN {
            assert_eq!(Fabric::by_name(name).unwrap().name, name);
        }
    }

    #[test]
    fn constants_of_no_cloth_are_warned_of_and_those_of_cloth_are_not() {
        for name in BUILT_IN {
            assert_eq!(Fabric::by_name(name).unwrap().warnings(), [""; 0], "{name}");
        }
        let stiff = Fabric { bending_nm: [1e-5, 1e-5, 100.0], thickness_m: 0.015, ..Fabric::default() };
        let [thick, bending] = stiff.warnings().try_into().unwrap();
        assert!(thick.contains("thickness_m is 0.015") && thick.contains("0.00015 to 0.001"), "{thick}");
        assert!(bending.contains("interlock: bending_nm, warp is 100, which no cloth has"), "{bending}");
        assert!(bending.contains("0.000002 to 0.00013"), "{bending}");
    }

    #[test]
    fn errors_name_the_constant_and_the_range() {
        let good = FILES[0];
        let error = |text: &str| Fabric::parse(text, "f.toml").unwrap_err().to_string();
        assert!(error(&good.replace("poisson = 0.3", "poisson = 0.9")).contains("poisson is 0.9"));
        assert!(error(&good.replace("8.00e-04", "0.8")).contains("millimetres"));
        assert!(error(&good.replace("friction", "frction")).contains("frction"));
        for (key, value) in
            [("stretch_warp_n_per_m", "1e200"), ("shear_n_per_m", "1e-9"), ("density_kg_per_m2", "1e-300")]
        {
            let start = good.find(key).unwrap();
            let line = good[start..].lines().next().unwrap();
            let text = error(&good.replace(line, &format!("{key} = {value}")));
            assert!(text.contains(key) && text.contains("most cloth"), "{text}");
        }
        assert!(error(&good.replace("density_kg_per_m2 = 0.187", "density_kg_per_m2 = nan")).contains("density"));
        assert!(Fabric::by_name("tweed").unwrap_err().to_string().contains("denim"));
    }
}
