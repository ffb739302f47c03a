//! Charts of a step: the histogram of distances with the range table's levels, scalars over the timeline, and the row of numbers.

use rerun::components::{Scalar, Text};
use rerun::{AnyValues, BarChart, Clear, ComponentIdentifier, Scalars, SeriesLines, SeriesPoints};

use super::error::RecordError;
use super::open_recording::OpenRecording;
use super::{meshes, paths};
use crate::picture::colour::map::Range;
use crate::picture::colour::palette;
use crate::study::metrics::LevelCount;

/// Number of bars of the histogram, about.
const BINS: usize = 80;
/// Depth of the strip of levels below the bars, relative to the highest bar.
const STRIP: f64 = 0.08;

/// A bar of a level.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bar {
    /// Number of vertices.
    height: f64,
    /// Left edge, where the viewer begins the bar, m.
    left: f64,
    /// Width, m.
    width: f64,
}

/// The bars of one level, at most `widest` wide. They tile the level's own range, so that no bar counts vertices of two levels. The
/// last level ends at `end`; its last bar counts the vertices beyond. Empty bars are left out.
fn bars(level: &LevelCount, distances_m: &[f64], widest: f64, end: f64) -> Vec<Bar> {
    let upper = level.upper_m().min(end.max(level.lower_m() + widest));
    let count = ((upper - level.lower_m()) / widest).ceil().max(1.0);
    let width = (upper - level.lower_m()) / count;
    let left = |i: usize| level.lower_m() + i as f64 * width;
    let mut bars: Vec<Bar> = (0..count as usize).map(|i| Bar { height: 0.0, left: left(i), width }).collect();
    let last = bars.len() - 1;
    for &d in distances_m.iter().filter(|d| (level.lower_m()..level.upper_m()).contains(*d)) {
        bars[(((d - level.lower_m()) / width) as usize).min(last)].height += 1.0;
    }
    bars.retain(|bar| bar.height > 0.0);
    bars
}

/// Logs the histogram and the PARTs per level. Levels that only the previous table had are cleared.
pub(super) fn log_levels(
    recording: &mut OpenRecording,
    levels: &[LevelCount],
    distances_m: &[f64],
) -> Result<(), RecordError> {
    let end = Range::to_quantile(distances_m.iter().copied(), 0.995).high;
    let positions = palette::level_positions(levels);
    let widest = end / BINS as f64;
    let all: Vec<Vec<Bar>> = levels.iter().map(|level| bars(level, distances_m, widest, end)).collect();
    let highest = all.iter().flatten().map(|bar| bar.height).fold(0.0, f64::max);
    for (index, (level, mut bars)) in levels.iter().zip(all).enumerate() {
        let upper = level.upper_m().min(end);
        if upper > level.lower_m() {
            bars.push(Bar { height: -STRIP * highest, left: level.lower_m(), width: upper - level.lower_m() });
        }
        let colour = meshes::colour(palette::shade(positions[index], 0));
        let chart = BarChart::new(bars.iter().map(|b| b.height).collect::<Vec<f64>>())
            .with_abscissa(bars.iter().map(|b| 100.0 * b.left).collect::<Vec<f64>>())
            .with_widths(bars.iter().map(|b| 100.0 * b.width as f32).collect::<Vec<f32>>())
            .with_color(colour);
        recording.log(&format!("{}/{index:02}", paths::HISTOGRAM), &chart)?;
        let parts = BarChart::new(vec![level.parts as f64]).with_abscissa(vec![index as f64 + 1.0]).with_color(colour);
        recording.log(&format!("{}/{index:02}", paths::LEVEL_PARTS), &parts)?;
    }
    for removed in levels.len()..recording.levels {
        for branch in [paths::HISTOGRAM, paths::LEVEL_PARTS] {
            recording.log(&format!("{branch}/{removed:02}"), &Clear::flat())?;
        }
    }
    recording.levels = levels.len();
    Ok(())
}

/// Logs the numbers of a step: as scalars, and as a row with the table's name.
pub(super) fn log_numbers(
    recording: &OpenRecording,
    table: &str,
    parts: usize,
    timings_ms: &[(String, f64)],
    scalars: &[(&str, f64)],
) -> Result<(), RecordError> {
    let count = parts as f64;
    log_scalar(recording, "/numbers/part_count", "PARTs", 0, count)?;
    let mut row = vec![("part_count".to_owned(), count)];
    for (i, (stage, ms)) in timings_ms.iter().enumerate() {
        log_scalar(recording, &format!("{}/{stage}", paths::STAGE_MS), stage, i, *ms)?;
        row.push((format!("time_{stage}_ms"), *ms));
    }
    for (i, (leaf, value)) in scalars.iter().enumerate() {
        log_scalar(recording, &format!("{}/{leaf}", paths::NUMBERS), &line_name(leaf), i, *value)?;
        // The columns have the names of a sweep's; see docs/columns.md.
        row.push((leaf.rsplit('/').next().unwrap_or(leaf).to_owned(), *value));
    }
    // The viewer sorts the columns by name, capitals first.
    let mut cells = AnyValues::default().with_component::<Text>("Table", [table]);
    for (name, value) in row {
        // Micrometres and microseconds: further digits are noise.
        let value = (1e3 * value).round() / 1e3;
        // The viewer cannot show a column without a name.
        if let Ok(column) = ComponentIdentifier::try_new(name) {
            cells = cells.with_component::<Scalar>(column, [value]);
        }
    }
    recording.log(paths::ROWS, &cells)
}

/// The name of a line in a plot, as the tables of `sweep` and `compare` name the number. A legend has room for few letters.
fn line_name(leaf: &str) -> String {
    match leaf {
        "error/rms_mm" => "own".to_owned(),
        "error/canonical_rms_mm" => "canonical".to_owned(),
        "error/representable_rms_mm" => "best translation".to_owned(),
        "error/representable_affine_rms_mm" => "best affine".to_owned(),
        other => other.trim_start_matches("error/").replace('_', " "),
    }
}

/// Letters of a name in the legend of a plot, in a window 1280 pixels wide: a longer one covers the lines.
#[cfg(test)]
const MAX_NAME: usize = 16;

/// Logs a scalar, drawn as a line with a dot at each step, so that a single step is visible. `hue`: an index into the palette.
pub(super) fn log_scalar(
    recording: &OpenRecording,
    path: &str,
    name: &str,
    hue: usize,
    value: f64,
) -> Result<(), RecordError> {
    if recording.first_use(path) {
        let colour = meshes::colour(palette::palette()[hue % palette::HUES]);
        let (lines, points) = (SeriesLines::new().with_names([name]), SeriesPoints::new().with_names([name]));
        recording.log_static(path, &lines.with_colors([colour]).with_widths([2.0]))?;
        recording.log_static(path, &points.with_colors([colour]).with_marker_sizes([4.0]))?;
    }
    recording.log(path, &Scalars::single(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_each_error_fits_its_legend() {
        for leaf in ["rms_mm", "canonical_rms_mm", "representable_rms_mm", "representable_affine_rms_mm"] {
            let name = line_name(&format!("error/{leaf}"));
            assert!(name.chars().count() <= MAX_NAME && !name.contains("rms"), "{name}");
        }
    }

    #[test]
    fn bars_tile_their_level_and_count_every_vertex_once() {
        let level = |lower_m: f64, upper_m: f64| {
            let [lower_cm, upper_cm] = [lower_m, upper_m].map(|m| 100.0 * m);
            LevelCount { level: 1, lower_cm, upper_cm, ..LevelCount::default() }
        };
        let distances = [0.0, 0.001, 0.0099, 0.01, 0.02, 0.049, 0.3];
        // A narrow level has one bar, as wide as the level.
        let narrow = bars(&level(0.0, 0.01), &distances, 0.02, 0.1);
        assert_eq!(narrow, [Bar { height: 3.0, left: 0.0, width: 0.01 }]);
        // A wide level is divided evenly, without empty bars.
        let wide = bars(&level(0.01, 0.05), &distances, 0.02, 0.1);
        assert_eq!(wide.iter().map(|b| b.height).sum::<f64>(), 3.0);
        assert!(wide.iter().all(|b| (b.width - 0.02).abs() < 1e-12));
        // The last level ends at the chart's end.
        let last = bars(&level(0.05, f64::INFINITY), &distances, 0.02, 0.1);
        assert_eq!(last.len(), 1);
        assert!(last[0].left < 0.1);
    }
}
