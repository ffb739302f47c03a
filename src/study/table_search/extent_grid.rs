//! The extents a level may have: not cut, then each width of a list in each of a list of shapes, widest first.

use crate::parts::range_table::Extent;

/// Extents of one shape: seeds lie where they lie for all of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// Factors for lengths along weft and warp; `None` for those of 1.
    pub(super) factors: Option<[f64; 2]>,
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
                let factors = Some(alike[0].evened().0).filter(|f| *f != [1.0, 1.0]);
                ladder.shapes.push(Shape { factors, extents_m });
            }
            ladder.steps.extend(extents);
        }
        ladder
    }

    /// The same range of widths and shapes, but finely; what was given stays in.
    pub(super) fn fine(widths_cm: &[f64], shapes: &[f64]) -> Self {
        let (widths, shapes) = (sorted(widths_cm), sorted(shapes));
        let (Some(&widest), Some(&tallest), Some(&lowest)) = (widths.first(), shapes.first(), shapes.last()) else {
            return Self::new(&[], &[]);
        };
        // About 2 % apart, in eighths of a centimetre, so that widths, and one and a half times them, are exact.
        let next = |width: &f64| Some((8.0 * (1.02 * width).max(width + 0.125)).round() / 8.0);
        let fine = std::iter::successors(widths.last().copied(), next).take_while(|width| *width < widest);
        let widths: Vec<f64> = fine.chain(widths.iter().copied()).collect();
        let powers = (-4..5).map(|i| f64::exp2(f64::from(i))).flat_map(|power| [power, 1.5 * power]);
        let between = powers.filter(|shape| (lowest..=tallest).contains(shape));
        let shapes: Vec<f64> = between.chain(shapes.iter().copied()).collect();
        Self::new(&widths, &shapes)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fine_ladder_fills_the_range_and_shares_its_seeds() {
        let coarse = Ladder::new(&[10.0, 40.0, 10.0, f64::NAN, -1.0], &[1.0, 4.0]);
        assert_eq!((coarse.len(), coarse.shapes().len()), (5, 2));
        assert_eq!(coarse.extent(0), Extent::UNCUT);
        assert_eq!(coarse.extent(1), Extent { width_cm: 40.0, height_cm: 160.0 });
        let fine = Ladder::fine(&[10.0, 40.0], &[1.0, 4.0]);
        // 1, 1.5, 2, 3, 4 times as tall as wide; one run of seeds each.
        assert_eq!(fine.shapes().len(), 5);
        assert!(fine.shapes().iter().all(|s| s.extents_m.windows(2).all(|w| w[1] < w[0] && w[0] < 1.03 * w[1])));
        let steps: Vec<Extent> = (0..fine.len()).map(|i| fine.extent(i)).collect();
        assert!((1..coarse.len()).all(|i| steps.contains(&coarse.extent(i))));
        let one = Ladder::fine(&[30.0], &[1.0]);
        assert_eq!((one.len(), one.extent(1)), (2, Extent::even(30.0)));
        assert!(!Ladder::fine(&[], &[1.0]).cuts());
    }
}
