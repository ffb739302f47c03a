//! Garments worn over each other: the whole drape as one piece of work, since each waits for what is below it.

use std::sync::Arc;
use std::time::Instant;

use super::rest::{Way, reactions};
use super::{Target, Workshop, ask};
use crate::drape::{Drape, DrapeError, drape};
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::Stop;
use crate::session::desk::ms_since;
use crate::session::results::{AtRest, Preview, Sectioned};
use crate::session::{EditError, Session};

impl Workshop {
    /// Drapes all of them, shown step by step at full resolution.
    pub(super) fn outfit(
        &mut self,
        session: &Session,
        target: &Target,
        sectioned: &Sectioned,
    ) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, settings) = (&sectioned.ground.loaded.scene, &target.job.settings);
        let way = Way { target, sectioned, warm: false, began };
        let all = drape(scene, settings, &mut |step| {
            let step = Arc::new(way.at(step.positions, step.residual_over_weight, step.iteration));
            session.publish(target.state, |desk| desk.view.rest = Some(step));
            ask(session, target.state)
        })?;
        let interrupted = |drape: &Drape| drape.state.as_ref().is_some_and(|s| s.stop == Stop::Interrupted);
        if interrupted(&all) && session.overtaken(target.state) {
            return Ok(());
        }
        let stages = all.times.total - all.times.refine;
        let preview = Preview {
            state: target.state,
            ground: Arc::clone(&sectioned.ground),
            warm: false,
            done: true,
            parts: Arc::new(all.parts.clone()),
            outcomes: Arc::new(all.outcomes.clone()),
            positions: Arc::new(all.preview.clone()),
            ms: 1e3 * stages.as_secs_f64(),
            after_ms: ms_since(target.accepted),
            warnings: Vec::new(),
        };
        let rest = all.state.as_ref().map(|state| -> Result<AtRest, EditError> {
            let cloth =
                Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(&settings.fabric), &scene.held)
                    .map_err(DrapeError::from)?;
            Ok(AtRest {
                done: true,
                balanced: state.stop == Stop::Converged,
                reaction_n: Arc::new(reactions(&cloth, &all.positions, &state.fit.pressure_kpa)),
                told: Some(Arc::new(state.clone())),
                ..way.at(&all.positions, state.residual_over_weight, state.steps)
            })
        });
        let rest = rest.transpose()?.map(Arc::new);
        session.publish(target.state, |desk| {
            desk.add_to_trail(|point| point.two_stages_ms = Some(preview.ms));
            desk.view.preview = Some(Arc::new(preview));
            if let Some(rest) = rest {
                desk.add_to_trail(|point| point.rest_ms = Some(rest.ms));
                desk.found_rest(rest);
            }
        });
        self.show(session, target, sectioned, all);
        Ok(())
    }
}
