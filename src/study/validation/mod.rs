//! Validation: simulated tests of cloth beside what others measured, and beside closed forms.
//!
//! `assets/validation/cases.csv` lists the cases. Each is of one kind: `measured` (a cloth whose constants and whose drape were both
//! measured; nothing of the model was set to it), `band` (a published range for a kind of cloth), `calibrated` (a constant was set to
//! it, so that it validates nothing) or `closed form`. A case passes if simulated and measured value differ by no more than the
//! tolerance: for a drape coefficient 8 points, the largest standard deviation between drapes of one fabric in twelve drapes each of
//! five fabrics (Bayesian Differentiable Physics for Cloth Digitalization, CVPR 2024, silhouettes); for nodes one; for a closed form 2 %.
//!
//! Limits: the constants of a fabric that its source does not report are assumed, as the source in its file says.

mod error;
mod strips;

use serde::{Deserialize, Serialize};

use crate::garment::fabric::{BUILT_IN, Fabric, FabricError};
use crate::study::drape_test::{Drape, DrapeTest, Drapes, STANDARDS};
pub(crate) use error::ValidationError;
use strips::Deflection;

/// The cases.
const CASES: &str = include_str!("../../../assets/validation/cases.csv");

/// Tolerance of a closed form, as a share of it.
const CLOSED_FORM_TOLERANCE: f64 = 0.02;

/// The fabrics of the cases that are not built in, with their files.
const FABRICS: [(&str, &str); 10] = [
    ("cotton-broad", include_str!("../../../assets/validation/fabrics/cotton-broad.toml")),
    ("wool-tropical", include_str!("../../../assets/validation/fabrics/wool-tropical.toml")),
    ("polyester-tropical", include_str!("../../../assets/validation/fabrics/polyester-tropical.toml")),
    ("polyester-faille", include_str!("../../../assets/validation/fabrics/polyester-faille.toml")),
    ("polyester-twill", include_str!("../../../assets/validation/fabrics/polyester-twill.toml")),
    ("polyester-plain", include_str!("../../../assets/validation/fabrics/polyester-plain.toml")),
    ("wool-polyester-twill", include_str!("../../../assets/validation/fabrics/wool-polyester-twill.toml")),
    ("polyester-viscose-twill", include_str!("../../../assets/validation/fabrics/polyester-viscose-twill.toml")),
    ("polyester-elastane-plain", include_str!("../../../assets/validation/fabrics/polyester-elastane-plain.toml")),
    ("cotton-polyester-twill", include_str!("../../../assets/validation/fabrics/cotton-polyester-twill.toml")),
];

/// The sources by the short names of the cases. None was read itself: the figures are transcriptions found in public code.
const SOURCES: [(&str, &str); 3] = [
    (
        "matsudaira",
        "Matsudaira, Masuda, Wada, Yokura: J. Textile Eng. 61(6), 2015, doi 10.4188/jte.61.69, tables 1 and 2 (transcription)",
    ),
    (
        "petrak",
        "Petrak and others: Sustainability 17, 1388, 2025, doi 10.3390/su17041388, tables 1, 2, 4, 5 (transcription)",
    ),
    ("ppf", "bands collected in st-tech/ppf-contact-solver, calibration/cusick_drape/targets.csv (transcription)"),
];

/// One row of the list of cases.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Case {
    /// Name of the cloth or strip.
    pub case: String,
    /// Name of the test: a standard, or a strip.
    pub test: String,
    /// Name of the fabric.
    pub fabric: String,
    /// The quantity with its unit.
    pub quantity: String,
    /// The measured value; none for a closed form.
    pub measured: Option<f64>,
    /// Largest difference that passes; none for a closed form.
    pub tolerance: Option<f64>,
    /// `measured`, `band`, `calibrated` or `closed form`.
    pub kind: String,
    /// Short name of the source.
    pub source: String,
}

/// A case beside its simulation.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Outcome {
    /// Name of the cloth or strip.
    pub case: String,
    /// Name of the test.
    pub test: String,
    /// The quantity with its unit.
    pub quantity: String,
    /// Measured value, or closed form.
    pub measured: f64,
    /// Simulated value: the mean over the starts.
    pub simulated: f64,
    /// Standard deviation between the starts.
    pub scatter: Option<f64>,
    /// Simulated minus measured.
    pub difference: f64,
    /// Largest difference that passes.
    pub tolerance: f64,
    /// Whether the difference is within the tolerance.
    pub pass: bool,
    /// Kind of the case.
    pub kind: String,
    /// Source of the measurement.
    pub source: String,
}

/// The drapes behind the outcomes of one fabric in one test.
pub(crate) struct ValidatedDrapes {
    /// Name of the cloth.
    pub case: String,
    /// Radii and mesh.
    pub test: DrapeTest,
    /// Measured coefficient, 0 to 1.
    pub measured: Option<f64>,
    /// The simulated drapes.
    pub drapes: Drapes,
}

impl ValidatedDrapes {
    /// Radius of the circle whose shadow has the measured coefficient, m.
    pub(crate) fn measured_radius(&self) -> Option<f64> {
        let [disc, specimen] = [self.test.disc_m, self.test.specimen_m].map(|r| r * r);
        self.measured.map(|share| (disc + share * (specimen - disc)).sqrt())
    }
}

/// Outcomes, and the drapes behind them.
#[derive(Default)]
pub(crate) struct Validation {
    /// In the order of the cases.
    pub outcomes: Vec<Outcome>,
    /// In the order of their first case.
    pub drapes: Vec<ValidatedDrapes>,
}

/// The cases.
///
/// # Errors
/// [`ValidationError::Csv`] if the list does not parse.
pub(crate) fn cases() -> Result<Vec<Case>, ValidationError> {
    Ok(csv::Reader::from_reader(CASES.as_bytes()).deserialize().collect::<Result<_, _>>()?)
}

/// A fabric of the cases, or a built-in one.
pub(crate) fn fabric(name: &str) -> Result<Fabric, FabricError> {
    match FABRICS.iter().find(|(own, _)| *own == name) {
        Some((_, text)) => Fabric::parse(text, name),
        None if BUILT_IN.contains(&name) => Fabric::by_name(name),
        None => {
            let known = FABRICS.map(|(name, _)| name).join(", ");
            Err(FabricError::Unknown { found: name.to_owned(), known })
        }
    }
}

impl Validation {
    /// Simulates one case after the others. Cases of one fabric in one test share its drapes.
    ///
    /// # Errors
    /// The case cannot be simulated.
    pub(crate) fn add(&mut self, case: &Case, rows: usize, starts: u32) -> Result<(), ValidationError> {
        let fabric = fabric(&case.fabric)?;
        let strip = match case.test.as_str() {
            "cantilever" => Some(strips::cantilever(&fabric, false)?),
            "cantilever-friction" => Some(strips::cantilever(&fabric, true)?),
            "hanging-strip" => Some(strips::hanging(&fabric, false)?),
            "bias-strip" => Some(strips::hanging(&fabric, true)?),
            _ => None,
        };
        if let Some(Deflection { simulated_m, exact_m }) = strip {
            let exact = 1e3 * exact_m;
            self.outcomes.push(outcome(case, exact, 1e3 * simulated_m, None, CLOSED_FORM_TOLERANCE * exact.abs()));
            return Ok(());
        }
        let drapes = self.drapes_of(case, &fabric, rows, starts)?;
        let quantity: fn(&Drape) -> f64 = match case.quantity.as_str() {
            "nodes" => |drape| drape.nodes.count as f64,
            _ => |drape| 100.0 * drape.coefficient,
        };
        let (mean, scatter) = (drapes.mean(quantity), drapes.deviation(quantity));
        let (measured, tolerance) = (case.measured.unwrap_or_default(), case.tolerance.unwrap_or_default());
        self.outcomes.push(outcome(case, measured, mean, scatter, tolerance));
        Ok(())
    }

    /// The drapes of a fabric in a test, simulated at the first call.
    fn drapes_of(
        &mut self,
        case: &Case,
        fabric: &Fabric,
        rows: usize,
        starts: u32,
    ) -> Result<&Drapes, ValidationError> {
        let standard = STANDARDS.iter().find(|standard| standard.name == case.test);
        let standard = standard.ok_or_else(|| ValidationError::Test { test: case.test.clone() })?;
        let (specimen_m, disc_m) = (standard.specimen_m, standard.disc_m);
        let test = DrapeTest { specimen_m, disc_m, rows, ..DrapeTest::default() };
        let known = self.drapes.iter().position(|known| known.case == case.case && known.test == test);
        let at = match known {
            Some(at) => at,
            None => {
                let measured = (case.quantity == "coefficient_percent").then(|| case.measured.map(|p| 0.01 * p));
                let drapes = Drapes::of(fabric, test, starts)?;
                self.drapes.push(ValidatedDrapes {
                    case: case.case.clone(),
                    test,
                    measured: measured.flatten(),
                    drapes,
                });
                self.drapes.len() - 1
            }
        };
        Ok(&self.drapes[at].drapes)
    }

    /// How many cases of a kind pass, and how many there are.
    pub(crate) fn passed(&self, kind: &str) -> [usize; 2] {
        let of_kind = || self.outcomes.iter().filter(|outcome| outcome.kind == kind);
        [of_kind().filter(|outcome| outcome.pass).count(), of_kind().count()]
    }
}

fn outcome(case: &Case, measured: f64, simulated: f64, scatter: Option<f64>, tolerance: f64) -> Outcome {
    let source = SOURCES.iter().find(|(short, _)| *short == case.source).map_or("", |(_, long)| long);
    let difference = simulated - measured;
    Outcome {
        case: case.case.clone(),
        test: case.test.clone(),
        quantity: case.quantity.clone(),
        measured,
        simulated,
        scatter,
        difference,
        tolerance,
        pass: difference.abs() <= tolerance,
        kind: case.kind.clone(),
        source: source.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(choose: impl Fn(&Case) -> bool) -> Validation {
        let mut validation = Validation::default();
        for case in cases().unwrap().iter().filter(|case| choose(case)) {
            validation.add(case, 8, 1).unwrap();
        }
        validation
    }

    #[test]
    fn every_case_names_a_fabric_a_kind_and_a_source() {
        let cases = cases().unwrap();
        for case in &cases {
            fabric(&case.fabric).unwrap();
            let closed = case.kind == "closed form";
            assert!(["measured", "band", "calibrated", "closed form"].contains(&case.kind.as_str()), "{case:?}");
            assert_eq!(case.measured.is_none(), closed, "{case:?}");
            assert_eq!(case.tolerance.is_none(), closed, "{case:?}");
            assert!(closed || SOURCES.iter().any(|(short, _)| *short == case.source), "{case:?}");
        }
        assert!(cases.iter().filter(|case| case.kind == "measured").count() >= 8);
        for (name, text) in FABRICS {
            assert_eq!(Fabric::parse(text, name).unwrap().warnings(), [""; 0], "{name}");
        }
    }

    #[test]
    fn strips_deflect_as_their_closed_forms() {
        let validation = run(|case| case.kind == "closed form");
        assert_eq!(validation.passed("closed form"), [4, 4], "{:#?}", validation.outcomes);
    }

    #[test]
    fn friction_between_yarns_raises_the_coefficient_of_a_cotton_broad_towards_the_measured_one() {
        let mut validation = run(|case| case.fabric == "cotton-broad");
        let [coefficient, nodes] = &validation.outcomes[..] else { panic!("{:?}", validation.outcomes) };
        assert!(coefficient.pass && coefficient.simulated > 80.0, "{coefficient:?}");
        assert_eq!((validation.drapes.len(), nodes.quantity.as_str()), (1, "nodes"));
        let ValidatedDrapes { test, .. } = validation.drapes.remove(0);
        let elastic = Fabric { bending_friction_n: [0.0; 2], ..fabric("cotton-broad").unwrap() };
        assert!(100.0 * test.run(&elastic).unwrap().coefficient < coefficient.simulated - 10.0);
    }
}
