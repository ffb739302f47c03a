//! Garments worn over each other: the whole drape as one piece of work, since each waits for what is below it.

use std::sync::Arc;
use std::time::Instant;

use super::rest::{Way, reactions};
use super::{Piece, Workshop};
use crate::drape::{Drape, DrapeError, drape};
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::Stop;
use crate::session::EditError;
use crate::session::results::{AtRest, Preview};

impl Workshop {
    /// Drapes all of them, shown step by step at full resolution.
    pub(super) fn outfit(&mut self, piece: Piece<'_>) -> Result<(), EditError> {
        let (scene, settings) = (piece.scene(), piece.settings());
        let way = Way { piece, warm: false, began: Instant::now() };
        let all = drape(scene, settings, &mut |step| {
            let step = Arc::new(way.at(step.positions, step.residual_over_weight, step.iteration));
            piece.publish(|desk| desk.view.rest = Some(step));
            piece.ask()
        })?;
        let interrupted = |drape: &Drape| drape.state.as_ref().is_some_and(|s| s.stop == Stop::Interrupted);
        if interrupted(&all) && piece.ask().is_break() {
            return Ok(());
        }
        let stages = all.times.total - all.times.refine;
        let preview = Preview {
            done: true,
            outcomes: Arc::new(all.outcomes.clone()),
            ..piece.preview(Arc::new(all.parts.clone()), all.preview.clone(), 1e3 * stages.as_secs_f64())
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
        piece.publish(|desk| {
            desk.add_to_trail(|point| point.two_stages_ms = Some(preview.ms));
            desk.view.preview = Some(Arc::new(preview));
            if let Some(rest) = rest {
                desk.add_to_trail(|point| point.rest_ms = Some(rest.ms));
                desk.found_rest(rest);
            }
        });
        self.show(piece, all);
        Ok(())
    }
}
