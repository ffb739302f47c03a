//! The extents that a level may have: uncut, or any combination of a width and a shape.

use crate::parts::range_table::Extent;

/// Extents of one shape. The sequence of seeds is the same for all of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// Factors for lengths along weft and warp; `None` if both are 1.
    pub(super) factors: Option<[f64; 2]>,
    /// Extents after scaling by the factors, m, descending.
    pub(super) extents_m: Vec<f64>,
}

/// Extents that a level may have. Entry 0 is uncut; then come the widths of each shape, widest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExtentGrid {
    extents: Vec<Extent>,
    /// The extents that cut, by shape.
    pub(super) shapes: Vec<Shape>,
}

impl ExtentGrid {
    /// Sorts widths and shapes; duplicates and values that are not positive and finite are dropped.
    pub(super) fn new(widths_cm: &[f64], heights_over_widths: &[f64]) -> Self {
        let widths = sorted(widths_cm);
        let mut grid = Self { extents: vec![Extent::UNCUT], shapes: Vec::new() };
        if widths.is_empty() {
            return grid;
        }
        for shape in sorted(heights_over_widths) {
            let extents: Vec<Extent> =
                widths.iter().map(|&width_cm| Extent { width_cm, height_cm: shape * width_cm }).collect();
            // Extents whose factors differ in the last bit are separate shapes, because stage one cuts them differently.
            for alike in extents.chunk_by(|a, b| a.evened().0 == b.evened().0) {
                let extents_m = alike.iter().map(|e| e.evened().1).collect();
                let factors = Some(alike[0].evened().0).filter(|f| *f != [1.0, 1.0]);
                grid.shapes.push(Shape { factors, extents_m });
            }
            grid.extents.extend(extents);
        }
        grid
    }

    /// A finer grid over the same ranges of widths and shapes; the given values stay in it.
    pub(super) fn fine(widths_cm: &[f64], shapes: &[f64]) -> Self {
        let (widths, shapes) = (sorted(widths_cm), sorted(shapes));
        let (Some(&widest), Some(&tallest), Some(&lowest)) = (widths.first(), shapes.first(), shapes.last()) else {
            return Self::new(&[], &[]);
        };
        // About 2 % apart, in eighths of a centimetre, so that a width and 1.5 times a width are exact.
        let next = |width: &f64| Some((8.0 * (1.02 * width).max(width + 0.125)).round() / 8.0);
        let fine = std::iter::successors(widths.last().copied(), next).take_while(|width| *width < widest);
        let widths: Vec<f64> = fine.chain(widths.iter().copied()).collect();
        let powers = (-4..5).map(|i| f64::exp2(f64::from(i))).flat_map(|power| [power, 1.5 * power]);
        let between = powers.filter(|shape| (lowest..=tallest).contains(shape));
        let shapes: Vec<f64> = between.chain(shapes.iter().copied()).collect();
        Self::new(&widths, &shapes)
    }

    /// Number of extents, the uncut one included.
    pub(super) fn len(&self) -> usize {
        self.extents.len()
    }

    /// Whether the grid has extents that cut.
    pub(super) fn cuts(&self) -> bool {
        !self.shapes.is_empty()
    }

    /// The extent at an index.
    pub(super) fn extent(&self, index: usize) -> Extent {
        self.extents.get(index).copied().unwrap_or(Extent::UNCUT)
    }
}

/// The distinct positive finite values, descending.
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
    fn a_fine_grid_covers_the_range_and_shares_its_seeds() {
        let coarse = ExtentGrid::new(&[10.0, 40.0, 10.0, f64::NAN, -1.0], &[1.0, 4.0]);
        assert_eq!((coarse.len(), coarse.shapes.len()), (5, 2));
        assert_eq!(coarse.extent(0), Extent::UNCUT);
        assert_eq!(coarse.extent(1), Extent { width_cm: 40.0, height_cm: 160.0 });
        let fine = ExtentGrid::fine(&[10.0, 40.0], &[1.0, 4.0]);
        // Ratios of height to width: 1, 1.5, 2, 3, 4, with one sequence of seeds each.
        assert_eq!(fine.shapes.len(), 5);
        assert!(fine.shapes.iter().all(|s| s.extents_m.windows(2).all(|w| w[1] < w[0] && w[0] < 1.03 * w[1])));
        let extents: Vec<Extent> = (0..fine.len()).map(|i| fine.extent(i)).collect();
        assert!((1..coarse.len()).all(|i| extents.contains(&coarse.extent(i))));
        let one = ExtentGrid::fine(&[30.0], &[1.0]);
        assert_eq!((one.len(), one.extent(1)), (2, Extent::even(30.0)));
        assert!(!ExtentGrid::fine(&[], &[1.0]).cuts());
    }
}
