//! The extents a level may be cut to, widest first: not at all, then each of a list.

use crate::range_table::METRES_PER_CM;

/// Extents a level may have. Step 0 is not cut.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ladder {
    /// After step 0, cm, falling.
    cm: Vec<f64>,
    /// The same, m.
    m: Vec<f64>,
}

impl Ladder {
    /// In order and without doubles; what is no extent above 0 is left out.
    pub(super) fn new(extents_cm: &[f64]) -> Self {
        let mut cm: Vec<f64> = extents_cm.iter().copied().filter(|e| e.is_finite() && *e > 0.0).collect();
        cm.sort_unstable_by(|a, b| b.total_cmp(a));
        cm.dedup();
        // As a table's extent becomes metres when it cuts, to the bit.
        let m = cm.iter().map(|cm| cm * METRES_PER_CM).collect();
        Self { cm, m }
    }

    /// Number of steps, the uncut one included.
    pub(super) fn len(&self) -> usize {
        1 + self.cm.len()
    }

    /// Whether there is any step but the uncut one.
    pub(super) fn cuts(&self) -> bool {
        !self.cm.is_empty()
    }

    /// The steps after the uncut one, m.
    pub(super) fn extents_m(&self) -> &[f64] {
        &self.m
    }

    /// A step as a table writes it, cm: infinite for the uncut one.
    pub(super) fn cm(&self, step: usize) -> f64 {
        step.checked_sub(1).and_then(|i| self.cm.get(i)).copied().unwrap_or(f64::INFINITY)
    }
}
