//! States kept beside those after them.

use std::sync::Arc;

use super::EditError;
use super::results::Pin;
use super::state::Desk;

/// States that can be pinned.
const MOST_PINS: usize = 8;

impl Desk {
    pub(super) fn pin(&mut self, label: Option<String>) -> Result<u64, EditError> {
        let view = &mut self.view;
        if view.pins.len() >= MOST_PINS {
            return Err(EditError::value("pin", format!("{MOST_PINS} pinned states"), "fewer; let one go first"));
        }
        let state = view.state;
        let rest = view.rest.as_ref().filter(|rest| rest.state == state && rest.done);
        let preview = view.preview.as_ref().filter(|preview| preview.state == state && preview.done);
        let shape = rest.map(|rest| (&rest.positions, &rest.ground));
        let Some((positions, ground)) = shape.or(preview.map(|p| (&p.positions, &p.ground))) else {
            return Err(EditError::value("pin", format!("no drape of state {state} yet"), "one; wait a moment"));
        };
        self.pins_made += 1;
        let pin = Pin {
            id: self.pins_made,
            label: label.unwrap_or_else(|| format!("state {state}")),
            state,
            job: Arc::clone(&view.job),
            positions: Arc::clone(positions),
            ground: Arc::clone(ground),
            numbers: view.trail.last().copied().filter(|point| point.state == state).unwrap_or_default(),
        };
        Arc::make_mut(&mut view.pins).push(Arc::new(pin));
        Ok(self.pins_made)
    }

    pub(super) fn unpin(&mut self, id: u64) -> bool {
        let pins = Arc::make_mut(&mut self.view.pins);
        let before = pins.len();
        pins.retain(|pin| pin.id != id);
        pins.len() < before
    }
}
