//! A job: scene, settings, start and measurements of one drape.
//!
//! A [`Job`] is plain data. The flags of `run`, the points of a sweep, `compare` and scripts that send JSON all produce jobs.
//! `Job::default()` is `partwise run` without flags.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::base::serde_name;
use crate::drape::{Drape, DrapeError, Model, Prepared, Refine, Settings, drape, drape_again};
use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::CoupledOptions;
use crate::mechanics::paper::{BodyForce, LineForce, PaperOptions};
use crate::mechanics::refine::Observer;
use crate::mechanics::solver_options::NewtonOptions;
use crate::parts::range_table::TABLE_3;
use crate::scene::{FileRole, Scene, SceneSpec};
use crate::study::accuracy::{self, reference::ReferenceCache, representable::representable};
use crate::study::evaluate::{EvaluateError, EvaluateOptions, Evaluation, canonical, evaluate, perturbed};
use crate::study::metrics::{GirthEase, Metrics};

/// Reference that a drape is measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Against {
    /// No reference: no error is measured.
    #[default]
    None,
    /// The canonical drape: one reference for each body, garment and fabric.
    Canonical,
    /// The canonical drape and the result's own continuation. Each result needs a converged drape, which takes seconds.
    Own,
}

impl fmt::Display for Against {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for Against {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        serde_name::parse(text).ok_or_else(|| format!("found accuracy = {text}, expected none, canonical or own"))
    }
}

/// All inputs of a drape, and its measurements.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Job {
    /// Body and garments.
    pub scene: SceneSpec,
    /// Settings of the model.
    #[serde(deserialize_with = "checked")]
    pub settings: Settings,
    /// Seed of a perturbed start ([`perturbed`]); 0 for the unperturbed start.
    pub seed: u64,
    /// Reference of the result.
    pub accuracy: Against,
    /// Number of perturbed starts for the spread between equilibria; used with [`Against::Own`].
    pub spread_starts: u64,
}

/// Deserialises settings and validates the numbers of model and fabric. Jobs may come from files or the network.
fn checked<'de, D: Deserializer<'de>>(from: D) -> Result<Settings, D::Error> {
    let settings = Settings::deserialize(from)?;
    let wrong = numbers(&settings.model).into_iter().find(|(_, found, range)| !range.contains(found));
    if let Some((key, found, range)) = wrong {
        let (low, high) = range.into_inner();
        return Err(D::Error::custom(format!("settings.model: {key}: found {found:?}, expected {low:?} to {high:?}")));
    }
    settings.fabric.check("settings.fabric").map_err(D::Error::custom)?;
    settings.solver.check().map_err(|error| D::Error::custom(format!("settings.solver.{error}")))?;
    let extents = settings.model.extents_cm();
    if extents.is_sorted_by(|a, b| a > b) && extents.iter().all(|cm| cm.is_finite() && *cm > 0.0) {
        return Ok(settings);
    }
    let expected = "finite extents above 0, from coarse to fine, or no extent to keep the PARTs of the range table";
    Err(D::Error::custom(format!("settings.model: found extents of {extents:?} cm, expected {expected}")))
}

/// The numbers of a model, each with the range it can have. A new field does not compile until it is listed here.
fn numbers(model: &Model) -> Vec<(&'static str, f64, RangeInclusive<f64>)> {
    match model {
        Model::Coupled(options) => {
            let CoupledOptions { motion: _, extents_m: _, max_iterations, least_change_m } = options;
            vec![
                ("max_iterations", *max_iterations as f64, 1.0..=NewtonOptions::default().max_steps as f64),
                ("least_change_m", *least_change_m, 0.0..=1.0),
            ]
        }
        Model::Paper(options) => {
            let PaperOptions {
                volume: _,
                cosine: _,
                clearance: _,
                contactless: _,
                untouched: _,
                body_force,
                line_force,
                contact_distance_m,
                degenerate_below,
            } = options;
            let mut numbers = vec![
                ("contact_distance_m", *contact_distance_m, 0.0..=1.0),
                ("degenerate_below", *degenerate_below, 0.0..=1.0),
            ];
            if let BodyForce::Given(force) = body_force {
                numbers.push(("body_force", *force, 0.0..=1e12));
            }
            if let LineForce::Given(force) = line_force {
                numbers.push(("line_force", *force, 0.0..=1e12));
            }
            numbers
        }
    }
}

/// Measurements of a drape.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Metrics of the drape.
    pub metrics: Metrics,
    /// Ease at bust, waist, hip and hem.
    pub(crate) ease: Vec<GirthEase>,
    /// Distance of each vertex to its reference, mm; empty without a reference.
    pub error_mm: Vec<f64>,
    /// Comparison with the own continuation, with [`Against::Own`].
    pub(crate) evaluation: Option<Evaluation>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

impl Job {
    /// A job that ends after the two stages, where range tables differ. Sweeps and comparisons start from it. Its table has the name
    /// by which sweep files request it.
    #[must_use]
    pub fn preview() -> Self {
        let Settings { table, .. } = Settings::default();
        let settings = Settings { refine: Refine::Steps(0), table: table.named(TABLE_3), ..Settings::default() };
        Self { settings, ..Self::default() }
    }

    /// Every value that is opened as a file, with the field it stands in; see [`SceneSpec::file_names`]. A new field does not compile
    /// until it is listed here.
    #[must_use]
    pub fn file_names(&self) -> Vec<(FileRole, &str)> {
        let Self { scene, settings, seed: _, accuracy: _, spread_starts: _ } = self;
        // Tables, models and fabrics of a job are their values, never names.
        let Settings { table: _, min_part: _, model: _, refine: _, fabric: _, self_contact: _, solver: _ } = settings;
        scene.file_names()
    }

    /// Drapes `scene`, loaded from the job's own by [`SceneSpec::load`]. Points of a sweep share loaded scenes.
    pub fn drape(&self, scene: &Scene, observer: Observer<'_>) -> Result<Drape, DrapeError> {
        if self.seed == 0 {
            return drape(scene, &self.settings, observer);
        }
        // A table by rule is resolved on the unperturbed garment, so that all starts have the same table.
        let settings = self.settings.resolved(&scene.distances_m()?)?;
        let positions = perturbed(&scene.garment.positions, &scene.held, self.seed);
        let moved = Scene { garment: scene.garment.with_positions(positions), ..scene.clone() };
        drape(&moved, &settings, observer)
    }

    /// [`Job::drape`] with distances and cloth of an earlier drape; a perturbed start has its own.
    ///
    /// # Errors
    /// As there.
    pub fn drape_again(&self, scene: &Scene, prepared: &Prepared, observer: Observer<'_>) -> Result<Drape, DrapeError> {
        if self.seed == 0 {
            drape_again(scene, prepared, &self.settings, observer)
        } else {
            self.drape(scene, observer)
        }
    }

    /// Measures a drape of `scene`. References are cached in `cache`.
    ///
    /// # Errors
    /// [`EvaluateError`]; [`EvaluateError::Interrupted`] if `observer` stops the solver of a reference.
    pub fn measure(
        &self,
        scene: &Scene,
        drape: &Drape,
        cache: Option<&ReferenceCache>,
        observer: Observer<'_>,
    ) -> Result<Measured, EvaluateError> {
        let (ease, metrics) = rayon::join(|| GirthEase::all(scene, &drape.positions), || Metrics::of(scene, drape));
        let metrics = metrics.with_ease(&ease);
        let of_fabrics = scene.fabrics(&self.settings.fabric).iter().flat_map(Fabric::warnings).collect();
        let warnings = [metrics.warnings(scene), of_fabrics].concat();
        let options = EvaluateOptions { cache: cache.cloned(), spread_starts: self.spread_starts };
        let (reference, evaluation, of_reference) = match self.accuracy {
            Against::None => {
                return Ok(Measured { metrics, ease, error_mm: Vec::new(), evaluation: None, warnings });
            }
            Against::Canonical => {
                let (reference, warnings) = canonical(scene, &self.settings.fabric, &options, observer)?;
                (reference.positions, None, warnings)
            }
            Against::Own => {
                let found = evaluate(scene, &self.settings, drape, &options, observer)?;
                (found.canonical.positions.clone(), Some(found.clone()), found.warnings)
            }
        };
        let best = representable(&scene.topology, &drape.parts, &scene.is_held(), &scene.garment.positions, &reference);
        let affine = Some(best.blended_affine_rms_mm).filter(|mm| mm.is_finite());
        let mut metrics = Metrics {
            canonical_rms_mm: Some(accuracy::rms_mm(&drape.positions, &reference)),
            representable_rms_mm: Some(best.translation_rms_mm),
            representable_affine_rms_mm: affine,
            ..metrics
        };
        let error_mm = match &evaluation {
            Some(found) => {
                metrics = metrics.with_evaluation(found);
                found.error_mm.clone()
            }
            None => accuracy::vertex_errors_mm(&drape.positions, &reference),
        };
        Ok(Measured { metrics, ease, error_mm, evaluation, warnings: [warnings, of_reference].concat() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drape::{DEFAULT_EXTENTS_CM, Model};

    #[test]
    fn a_job_round_trips_through_json_and_omitted_fields_are_defaults() {
        let mut job = Job { seed: 3, accuracy: Against::Own, ..Job::default() };
        job.settings.refine = Refine::Steps(2);
        job.settings.model = Model::default().with_extents_cm(&[12.0, 6.0]);
        let text = serde_json::to_string(&job).unwrap();
        assert_eq!(serde_json::from_str::<Job>(&text).unwrap(), job);
        let short = r#"{"scene": {"garment": "flared-skirt@900"}, "settings": {"refine": {"steps": 2}}}"#;
        let short: Job = serde_json::from_str(short).unwrap();
        assert_eq!(short.settings.model.extents_cm(), DEFAULT_EXTENTS_CM);
        assert_eq!((short.scene.body.as_str(), short.accuracy), ("form", Against::None));
        let message = serde_json::from_str::<Job>(r#"{"scene": {"colour": 3}}"#).unwrap_err().to_string();
        assert!(message.contains("colour"), "{message}");
    }

    /// Puts each of `values` in the place of each number below `at` of the same type, and hands the whole to `see`.
    fn each_number(
        whole: &toml::Value,
        at: &[String],
        values: &[toml::Value],
        see: &mut dyn FnMut(&str, &toml::Value),
    ) {
        let here =
            at.iter().fold(whole, |value, key| key.parse().map_or_else(|_| &value[key.as_str()], |i: usize| &value[i]));
        let below: Vec<String> = match here {
            toml::Value::Table(table) => table.keys().cloned().collect(),
            toml::Value::Array(list) => (0..list.len()).map(|i| i.to_string()).collect(),
            _ => Vec::new(),
        };
        for key in below {
            each_number(whole, &[at, &[key]].concat(), values, see);
        }
        for value in values.iter().filter(|value| value.same_type(here)) {
            let mut edited = whole.clone();
            let slot = at.iter().fold(&mut edited, |value, key| match key.parse::<usize>() {
                Ok(i) => &mut value[i],
                Err(_) => &mut value[key.as_str()],
            });
            *slot = value.clone();
            see(&at.join("."), &edited);
        }
    }

    #[test]
    fn no_number_of_the_settings_is_taken_out_of_its_range() {
        let paper = PaperOptions {
            body_force: BodyForce::Given(3.0),
            line_force: LineForce::Given(4.0),
            ..PaperOptions::default()
        };
        let mut tried = Vec::new();
        for model in [Model::default().with_extents_cm(&[12.0, 6.0]), Model::Paper(paper)] {
            let settings = Settings { model, refine: Refine::Steps(3), ..Settings::default() };
            let whole = toml::Value::try_from(Job { settings, ..Job::default() }).unwrap();
            assert!(whole.clone().try_into::<Job>().is_ok());
            let whole = toml::Value::Table([("settings".to_owned(), whole["settings"].clone())].into_iter().collect());
            let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e308, 1e308, -1.0].map(toml::Value::Float);
            each_number(&whole, &[], &[&bad[..], &[toml::Value::Integer(-1)]].concat(), &mut |place, edited| {
                // Distances in the body are negative, and the last level may reach to infinity.
                if !place.starts_with("settings.table") {
                    assert!(edited.clone().try_into::<Job>().is_err(), "{place}: {edited}");
                }
                tried.push(place.to_owned());
            });
            let nan = [toml::Value::Float(f64::NAN)];
            each_number(&whole, &[], &nan, &mut |place, edited| {
                assert!(edited.clone().try_into::<Job>().is_err(), "{place}");
            });
        }
        for place in [
            "model.coupled.least_change_m",
            "model.coupled.max_iterations",
            "model.paper.line_force.given",
            "fabric.bending_nm.2",
        ] {
            assert!(tried.contains(&format!("settings.{place}")), "{place} is not among {tried:?}");
        }
        let message =
            toml::from_str::<Job>("[settings.model.coupled]\nleast_change_m = nan\n").unwrap_err().to_string();
        assert!(message.contains("least_change_m: found NaN, expected 0.0 to 1.0"), "{message}");
    }

    #[test]
    fn extents_that_are_not_positive_and_falling_are_rejected() {
        let with = |extents: &str| {
            let text = format!("[settings.model.coupled]\nextents_m = {extents}\n");
            toml::from_str::<Job>(&text).map_err(|e| e.to_string())
        };
        assert_eq!(with("[0.12, 0.06]").unwrap().settings.model.extents_cm(), [12.0, 6.0]);
        assert!(with("[]").is_ok());
        for wrong in ["[-0.1]", "[nan]", "[0.0]", "[inf]", "[0.06, 0.12]", "[0.12, -0.06]"] {
            let message = with(wrong).unwrap_err();
            assert!(message.contains("above 0") && message.contains("coarse to fine"), "{wrong}: {message}");
        }
        let json = r#"{"settings": {"model": {"coupled": {"extents_m": [-0.06]}}}}"#;
        let message = serde_json::from_str::<Job>(json).unwrap_err().to_string();
        assert!(message.contains("-6"), "{message}");
    }
}
