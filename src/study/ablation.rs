//! Ablation: the effect of each option of the solver.
//!
//! Every option of [`SolverOptions`] is turned off where that means something, otherwise halved and doubled, one at a time; each variant drapes
//! one set of garments to rest. A mechanism whose absence changes neither steps nor time nor what ends at rest has no reason to exist.
//!
//! Times are processor times of the thread that drapes, so other load on the machine distorts them less than wall times.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use serde::Serialize;

use crate::base::files::bounded_text;
use crate::drape::Settings;
use crate::garment::MeshCache;
use crate::garment::fabric::{Fabric, FabricError};
use crate::mechanics::refine::Stop;
use crate::mechanics::solver_options::SolverOptions;
use crate::scene::{Scene, SceneError, SceneSpec};
use crate::study::evaluate::perturbed;

/// The built-in garments.
const GARMENTS: [&str; 5] = ["flared-skirt", "pullover-1", "pullover-2", "low-cut-dress", "long-sleeved-dress"];

/// A knit and a woven.
const FABRICS: [&str; 2] = ["jersey", "cotton"];

/// The vertex counts of the garments that start as placed, and of those that start perturbed, with the number of such starts.
#[derive(Debug, Clone, Copy)]
struct Sizes {
    placed: &'static [usize],
    perturbed: usize,
    starts: u64,
}

const ALL: Sizes = Sizes { placed: &[1_000, 3_000], perturbed: 800, starts: 3 };
const QUICK: Sizes = Sizes { placed: &[800], perturbed: 800, starts: 1 };

/// Values that turn a mechanism off, where an option has one.
const OFF: &[(&str, f64)] = &[
    ("nested_iteration.min_vertices", 1e5),
    ("softening.strain", 0.0),
    ("newton.stall_steps", 1e5),
    ("newton.max_extrapolation", 1.0),
    ("relaxation.iterations", 0.0),
    ("relaxation.trial_iterations", 0.0),
    ("relaxation.max_trials", 0.0),
    ("rest_check.max_checks", 0.0),
    ("cycles.max_residual", 0.0),
    ("cycles.min_step_share", 1.0),
    ("cycles.min_under_relaxation", 1.0),
    ("body_contact.stiffening", 1.0),
    ("body_contact.max_protrusion_fixes", 0.0),
    ("face_contact.max_residual", 0.0),
    ("face_contact.max_steps", 1e5),
    ("face_contact.max_offset_raise_m", 0.0),
    ("face_contact.max_idle_updates", 1e5),
    ("self_contact.neighbour_share", 0.0),
    ("self_contact.stiffening", 1.0),
    ("self_contact.max_stiffening", 1.0),
    ("collision_filter.max_cut_move", 0.0),
    ("collision_filter.max_halvings", 0.0),
    ("collision_filter.tangled_rings", 0.0),
];

/// A garment to drape to rest.
pub(crate) struct Case {
    scene: Scene,
    fabric: Fabric,
}

impl Case {
    /// The garments of `scene` in a built-in fabric, from a start perturbed by `seed` if it is not 0.
    fn load(scene: &SceneSpec, fabric: &str, seed: u64, meshes: &MeshCache) -> Result<Self, AblationError> {
        let mut loaded = scene.load_with(meshes)?.scene;
        if seed > 0 {
            let moved = perturbed(&loaded.garment.positions, &loaded.held, seed);
            loaded.garment = loaded.garment.with_positions(moved);
        }
        Ok(Self { scene: loaded, fabric: Fabric::by_name(fabric)? })
    }

    fn drape(&self, solver: SolverOptions) -> Outcome {
        let settings = Settings { fabric: self.fabric.clone(), solver, ..Settings::default() };
        let began = processor_seconds();
        let draped = self.scene.drape(&settings);
        let seconds = processor_seconds() - began;
        let Ok(draped) = draped else { return Outcome { seconds, ..Outcome::default() } };
        let state = draped.state.as_ref();
        Outcome {
            rests: state.is_some_and(|state| state.stop == Stop::Converged),
            steps: state.map_or(0, |state| state.steps),
            seconds,
            crossing: draped.self_intersecting_pairs,
            through: self.scene.body.crossing_pairs(&self.scene.garment.with_positions(draped.positions)).len(),
            inside: draped.penetrating_vertices,
        }
    }
}

/// Why the garments of an ablation cannot be draped.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AblationError {
    /// A garment or a body cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A built-in fabric is missing.
    #[error(transparent)]
    Fabric(#[from] FabricError),
}

/// The result of one drape.
#[derive(Debug, Clone, Copy, Default)]
struct Outcome {
    rests: bool,
    steps: usize,
    seconds: f64,
    crossing: usize,
    through: usize,
    inside: usize,
}

/// The built-in set in a knit and a woven: five garments as placed and from perturbed starts, an outfit, and the garments of `more`; `quick`
/// for 21 small ones.
pub(crate) fn cases(quick: bool, more: &[SceneSpec]) -> Result<Vec<Case>, AblationError> {
    let sizes = if quick { QUICK } else { ALL };
    let meshes = MeshCache::in_user_cache();
    let body = SceneSpec::default().body;
    let built_in = |name: &str, vertices: usize| SceneSpec::new(body.clone(), format!("{name}@{vertices}"));
    let outfit = SceneSpec {
        over: vec![format!("pullover-1@{}", sizes.perturbed)],
        ..built_in("flared-skirt", sizes.perturbed)
    };
    let mut all = Vec::new();
    for fabric in FABRICS {
        for (name, vertices) in GARMENTS.iter().flat_map(|name| sizes.placed.iter().map(move |n| (name, *n))) {
            all.push(Case::load(&built_in(name, vertices), fabric, 0, &meshes)?);
        }
        for (name, seed) in GARMENTS.iter().flat_map(|name| (1..=sizes.starts).map(move |seed| (name, seed))) {
            all.push(Case::load(&built_in(name, sizes.perturbed), fabric, seed, &meshes)?);
        }
        // The small outfit takes some 470 steps in the woven: as long as all the other small drapes together.
        let outfit = (!quick || fabric == FABRICS[0]).then_some(&outfit);
        for scene in outfit.into_iter().chain(more) {
            all.push(Case::load(scene, fabric, 0, &meshes)?);
        }
    }
    Ok(all)
}

/// One change of the defaults.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variant {
    /// The option; `None` for the defaults.
    pub(crate) option: Option<(String, f64)>,
    solver: SolverOptions,
}

/// The defaults, then every option whose name begins with one of `only` (all if it is empty): off where a value turns its mechanism off,
/// otherwise halved and doubled.
pub(crate) fn variants(only: &[String]) -> Vec<Variant> {
    let default = SolverOptions::default();
    let mut all = vec![Variant { option: None, solver: default }];
    let wanted = |name: &str| only.is_empty() || only.iter().any(|start| name.starts_with(start.as_str()));
    for (name, value) in default.list().into_iter().filter(|(name, _)| wanted(name)) {
        let off = OFF.iter().find(|(of, _)| *of == name).map(|(_, off)| *off);
        for value in off.map_or_else(|| vec![0.5 * value, 2.0 * value], |off| vec![off]) {
            // Counts are halved to whole numbers.
            let set = default.with(&name, value).or_else(|_| default.with(&name, value.floor()));
            if let Some(solver) = set.ok().filter(|solver| all.iter().all(|known| known.solver != *solver)) {
                all.push(Variant { option: Some((name.clone(), value)), solver });
            }
        }
    }
    all
}

/// A row of the table: all drapes with one variant.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct AblationRow {
    /// The option that was changed; `defaults` for none.
    pub(crate) option: String,
    /// Its value; empty for the defaults.
    pub(crate) value: Option<f64>,
    /// Drapes at rest.
    pub(crate) at_rest: usize,
    /// Drapes at rest with the defaults that are not, and the reverse.
    pub(crate) lost: usize,
    pub(crate) gained: usize,
    /// Steps at full resolution, all drapes together.
    pub(crate) steps: usize,
    /// Processor time, s.
    pub(crate) seconds: f64,
    /// Median over the drapes of the ratio of the steps to those with the defaults.
    pub(crate) step_ratio: f64,
    /// Pairs of triangles that cross, and drapes with such pairs.
    pub(crate) crossing: usize,
    pub(crate) drapes_crossing: usize,
    /// Pairs of a triangle of the body and one of cloth that cross, and drapes with such pairs.
    pub(crate) through: usize,
    pub(crate) drapes_through: usize,
    /// Vertices inside the body.
    pub(crate) inside: usize,
}

/// Drapes all cases with each variant, on `threads` threads, and hands each row to `done`, which may end the run.
pub(crate) fn run(
    cases: &[Case],
    variants: &[Variant],
    threads: usize,
    mut done: impl FnMut(AblationRow) -> ControlFlow<()>,
) {
    let mut defaults: Vec<Outcome> = Vec::new();
    for variant in variants {
        let outcomes = drape_all(cases, variant.solver, threads);
        if defaults.is_empty() {
            defaults.clone_from(&outcomes);
        }
        if done(row(variant, &outcomes, &defaults)).is_break() {
            return;
        }
    }
}

fn drape_all(cases: &[Case], solver: SolverOptions, threads: usize) -> Vec<Outcome> {
    let next = AtomicUsize::new(0);
    let outcomes = Mutex::new(vec![Outcome::default(); cases.len()]);
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                // Each drape on a pool of one thread, so that its processor time is that of this thread.
                let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { return };
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(number) else { return };
                    let outcome = pool.install(|| case.drape(solver));
                    outcomes.lock().unwrap_or_else(PoisonError::into_inner)[number] = outcome;
                }
            });
        }
    });
    outcomes.into_inner().unwrap_or_else(PoisonError::into_inner)
}

fn row(variant: &Variant, outcomes: &[Outcome], defaults: &[Outcome]) -> AblationRow {
    let count =
        |which: fn(&Outcome, &Outcome) -> bool| outcomes.iter().zip(defaults).filter(|(o, d)| which(o, d)).count();
    let mut ratios: Vec<f64> =
        outcomes.iter().zip(defaults).map(|(o, d)| o.steps as f64 / d.steps.max(1) as f64).collect();
    ratios.sort_by(f64::total_cmp);
    let (option, value) = variant.option.clone().map_or(("defaults".to_owned(), None), |(name, v)| (name, Some(v)));
    AblationRow {
        option,
        value,
        at_rest: count(|o, _| o.rests),
        lost: count(|o, d| d.rests && !o.rests),
        gained: count(|o, d| o.rests && !d.rests),
        steps: outcomes.iter().map(|o| o.steps).sum(),
        seconds: outcomes.iter().map(|o| o.seconds).sum(),
        step_ratio: ratios.get(ratios.len() / 2).copied().unwrap_or(1.0),
        crossing: outcomes.iter().map(|o| o.crossing).sum(),
        drapes_crossing: count(|o, _| o.crossing > 0),
        through: outcomes.iter().map(|o| o.through).sum(),
        drapes_through: count(|o, _| o.through > 0),
        inside: outcomes.iter().map(|o| o.inside).sum(),
    }
}

/// Processor time of this thread, s; wall time where the system does not tell.
fn processor_seconds() -> f64 {
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    let on_processor = bounded_text(Path::new("/proc/thread-self/schedstat")).ok();
    let nanoseconds = on_processor.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| BEGAN.get_or_init(Instant::now).elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_that_turns_a_mechanism_off_is_one_of_an_option() {
        let all = variants(&[]);
        for (name, value) in OFF {
            let off = SolverOptions::default().with(name, *value).unwrap();
            assert!(all.iter().any(|variant| variant.solver == off), "{name}");
        }
        assert!(variants(&["newton.".to_owned()]).len() > 10);
        assert_eq!(variants(&["nothing".to_owned()]).len(), 1);
    }

    #[test]
    fn a_variant_that_changes_nothing_has_the_steps_of_the_defaults_and_one_of_two_steps_loses_the_rest() {
        let meshes = MeshCache::in_user_cache();
        let scene = SceneSpec::new(SceneSpec::default().body, "flared-skirt@400");
        let cases = [Case::load(&scene, "jersey", 0, &meshes).unwrap()];
        let mut rows = Vec::new();
        let variants: Vec<Variant> = ["newton.max_steps=1900", "newton.max_steps=2"]
            .map(|text| Variant { option: None, solver: SolverOptions::default().assign(text).unwrap() })
            .to_vec();
        run(&cases, &[&variants[..1], &variants].concat(), 2, |row| {
            rows.push(row);
            ControlFlow::Continue(())
        });
        assert_eq!(rows.len(), 3);
        assert_eq!((rows[1].steps, rows[1].step_ratio, rows[1].lost), (rows[0].steps, 1.0, 0));
        assert_eq!((rows[0].at_rest, rows[2].at_rest, rows[2].lost, rows[2].steps), (1, 0, 1, 2), "{rows:?}");
    }
}
