//! The extents a level may have: not cut, then each width of a list in each of a list of shapes, widest first.

use crate::range_table::Extent;

/// Extents of one shape: seeds lie where they lie for all of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// Factors for horizontal and vertical lengths.
    pub(super) stretch: [f64; 2],
    /// Extents after these, m, falling.
    pub(super) extents_m: Vec<f64>,
}

/// Extents a level may have. Step 0 is not cut.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ladder {
    steps: Vec<Extent>,
    shapes: Vec<Shape>,
}

impl Ladder {
    /// In order and without doubles; what is no width or shape above 0 is left out.
    pub(super) fn new(widths_cm: &[f64], heights_over_widths: &[f64]) -> Self {
        let widths = sorted(widths_cm);
        let mut ladder = Self { steps: vec![Extent::UNCUT], shapes: Vec::new() };
        if widths.is_empty() {
            return ladder;
        }
        for shape in sorted(heights_over_widths) {
            let extents: Vec<Extent> =
                widths.iter().map(|&width_cm| Extent { width_cm, height_cm: shape * width_cm }).collect();
            // As a table's extents cut, to the bit: extents whose factors differ by a rounding are shapes of their own.
            for alike in extents.chunk_by(|a, b| a.evened().0 == b.evened().0) {
                let extents_m = alike.iter().map(|e| e.evened().1).collect();
                ladder.shapes.push(Shape { stretch: alike[0].evened().0, extents_m });
            }
            ladder.steps.extend(extents);
        }
        ladder
    }

    /// Number of steps, the uncut one included.
    pub(super) fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether there is any step but the uncut one.
    pub(super) fn cuts(&self) -> bool {
        !self.shapes.is_empty()
    }

    /// The steps after the uncut one, by shape.
    pub(super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// A step as a table has it.
    pub(super) fn extent(&self, step: usize) -> Extent {
        self.steps.get(step).copied().unwrap_or(Extent::UNCUT)
    }
}

/// Finite and above 0, falling, each once.
fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
    values.sort_unstable_by(|a, b| b.total_cmp(a));
    values.dedup();
    values
}
