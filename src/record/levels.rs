//! The range table over the garment's distances: a histogram, each level in the hue of its PARTs, and under it the levels themselves.

use rerun::{BarChart, Clear};

use super::{Open, Range, RecordError, StepView, colours, meshes, paths};
use crate::study::metrics::LevelCount;

/// Bars of the distance histogram, about.
const BINS: usize = 80;
/// Depth of the strip of levels below the bars, relative to the highest bar.
const STRIP: f64 = 0.08;

/// Bars of one level: how many vertices lie in each, and its left edge, where the viewer begins it, and width, m. A level's bars tile its own range, so
/// that no bar holds vertices of two.
fn bars(row: &LevelCount, distance_m: &[f64], widest: f64, end: f64) -> Vec<(f64, f64, f64)> {
    let upper = row.upper_m().min(end.max(row.lower_m() + widest));
    let count = ((upper - row.lower_m()) / widest).ceil().max(1.0);
    let width = (upper - row.lower_m()) / count;
    let mut bars: Vec<(f64, f64, f64)> =
        (0..count as usize).map(|i| (0.0, row.lower_m() + i as f64 * width, width)).collect();
    let last = bars.len() - 1;
    for &d in distance_m.iter().filter(|d| (row.lower_m()..row.upper_m()).contains(*d)) {
        bars[(((d - row.lower_m()) / width) as usize).min(last)].0 += 1.0;
    }
    bars.retain(|bar| bar.0 > 0.0);
    bars
}

/// Logs both charts; levels that the table before had and this one has not are cleared.
pub(super) fn log(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let rows = &step.panel.levels;
    let end = Range::to_quantile(step.distance_m.iter().copied(), 0.995).high;
    let places = colours::places(rows);
    let shade = |level: usize| meshes::colour(colours::shade(places[level], 0));
    let widest = end / BINS as f64;
    let all: Vec<Vec<(f64, f64, f64)>> = rows.iter().map(|row| bars(row, step.distance_m, widest, end)).collect();
    let highest = all.iter().flatten().map(|bar| bar.0).fold(0.0, f64::max);
    for (level, (row, mut bars)) in rows.iter().zip(all).enumerate() {
        let upper = row.upper_m().min(end);
        if upper > row.lower_m() {
            bars.push((-STRIP * highest, row.lower_m(), upper - row.lower_m()));
        }
        let chart = BarChart::new(bars.iter().map(|b| b.0).collect::<Vec<f64>>())
            .with_abscissa(bars.iter().map(|b| 100.0 * b.1).collect::<Vec<f64>>())
            .with_widths(bars.iter().map(|b| 100.0 * b.2 as f32).collect::<Vec<f32>>())
            .with_color(shade(level));
        open.log(&format!("{}/{level:02}", paths::HISTOGRAM), &chart)?;
        let parts =
            BarChart::new(vec![row.parts as f64]).with_abscissa(vec![level as f64 + 1.0]).with_color(shade(level));
        open.log(&format!("{}/{level:02}", paths::LEVEL_PARTS), &parts)?;
    }
    for gone in rows.len()..open.levels {
        for branch in [paths::HISTOGRAM, paths::LEVEL_PARTS] {
            open.log(&format!("{branch}/{gone:02}"), &Clear::flat())?;
        }
    }
    open.levels = rows.len();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_tile_their_level_and_count_every_vertex_once() {
        let row = |lower_m: f64, upper_m: f64| {
            let [lower_cm, upper_cm] = [lower_m, upper_m].map(|m| 100.0 * m);
            LevelCount { level: 1, lower_cm, upper_cm, ..LevelCount::default() }
        };
        let distances = [0.0, 0.001, 0.0099, 0.01, 0.02, 0.049, 0.3];
        // A narrow level has one bar of its own width.
        assert_eq!(bars(&row(0.0, 0.01), &distances, 0.02, 0.1), [(3.0, 0.0, 0.01)]);
        // A wide one is cut evenly; empty bars are left out.
        let wide = bars(&row(0.01, 0.05), &distances, 0.02, 0.1);
        assert_eq!(wide.iter().map(|b| b.0).sum::<f64>(), 3.0);
        assert!(wide.iter().all(|b| (b.2 - 0.02).abs() < 1e-12));
        // The open level ends at the picture's end; what lies beyond counts in its last bar.
        let open = bars(&row(0.05, f64::INFINITY), &distances, 0.02, 0.1);
        assert_eq!(open.len(), 1);
        assert!(open[0].1 < 0.1);
    }
}
