//! One entrant, once.

use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;

use super::ComparedMethod;
use crate::drape::{Model, Refine, Settings, StageTimes, drape};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::Stop;
use crate::methods::{self, Ended, MethodInput, RestRule};
use crate::scene::Scene;

/// A drape with what is told of it.
pub(super) struct Outcome {
    pub(super) positions: Vec<DVec3>,
    pub(super) time: Duration,
    pub(super) ended: String,
    pub(super) steps: usize,
    pub(super) simulated_s: Option<f64>,
    pub(super) counts: Vec<(String, u64)>,
}

/// Drapes once; the error says why not.
pub(super) fn run(
    entrant: ComparedMethod,
    scene: &Scene,
    fabric: &Fabric,
    cloth: &Cloth,
    rule: &RestRule,
    go_on: &mut (dyn FnMut() -> ControlFlow<()> + Send),
) -> Result<Outcome, String> {
    let (model, refine) = match entrant {
        ComparedMethod::Reference(name) => {
            return in_time(name, &MethodInput { scene, fabric: &cloth.fabrics[0], cloth }, rule, go_on);
        }
        ComparedMethod::Paper => ("paper", Refine::Steps(0)),
        ComparedMethod::Preview => ("coupled", Refine::Steps(0)),
        ComparedMethod::Converged => ("coupled", Refine::Converged),
    };
    let model = Model::by_name(model).unwrap_or_default();
    let settings = Settings { model, refine, fabric: fabric.clone(), ..Settings::default() };
    let made = drape(scene, &settings, &mut |_| go_on()).map_err(|e| e.to_string())?;
    let StageTimes { distance, segment, mechanics, refine, .. } = made.times;
    let state = made.state.as_ref();
    let ended = match (entrant, state.map(|s| s.stop)) {
        (_, Some(Stop::Interrupted)) => "interrupted",
        (ComparedMethod::Converged, Some(Stop::Converged)) => "converged",
        (ComparedMethod::Converged, Some(Stop::Stalled)) => "stalled",
        (ComparedMethod::Converged, _) => "steps-done",
        _ => "two-stages",
    };
    Ok(Outcome {
        positions: made.positions,
        time: distance + segment + mechanics + refine,
        ended: ended.to_owned(),
        steps: state.map_or(0, |s| s.steps),
        simulated_s: None,
        counts: vec![("PARTs".to_owned(), made.parts.len() as u64)],
    })
}

/// Drapes once by a reference method.
fn in_time(
    name: &str,
    dressing: &MethodInput<'_>,
    rule: &RestRule,
    go_on: &mut (dyn FnMut() -> ControlFlow<()> + Send),
) -> Result<Outcome, String> {
    let method = methods::by_name(name, false, None).ok_or_else(|| format!("there is no method {name}"))?;
    let made = method.drape(dressing, rule, &mut |_| go_on()).map_err(|e| e.to_string())?;
    let ended = match made.ended {
        Ended::AtRest => "at-rest",
        Ended::TimeOver => "time-over",
        Ended::Interrupted => "interrupted",
    };
    Ok(Outcome {
        positions: made.positions,
        time: made.total,
        ended: ended.to_owned(),
        steps: made.steps,
        simulated_s: Some(made.simulated_s),
        counts: made.counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect(),
    })
}
