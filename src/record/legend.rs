//! Colour bars with numbers and unit, in a plane drawing below or beside the views.
//!
//! In a 3D view a bar would tilt, shrink and be cut off as the view turns. All bars of a tab share one drawing of columns and rows, so
//! that they need one title bar.

use rerun::{Color, LineStrips2D, Points2D};

use super::error::RecordError;
use super::meshes::rerun_colours;
use super::open_recording::OpenRecording;
use super::panel::number;
use crate::colour::level_colours;
use crate::colour::map::{ColourMap, Range, Rgb};
use crate::study::metrics::LevelCount;

/// Colour of texts in a view: white, which is legible on the viewer's translucent boxes, dark in its dark theme and light grey in the
/// light one, over a dark background. By default each path would have another colour.
const TEXT: Color = Color(rerun::Rgba32(0xFFFF_FFFF));
/// Width of a column and height of a row, in the drawing's units of two to four pixels.
const CELL: [f64; 2] = [150.0, 19.0];
/// Start and end of the bar in its cell, and its thickness; the title is left of it, the numbers below.
const BAR: [f64; 2] = [56.0, 138.0];
const THICKNESS: f64 = 4.0;
/// Distance of the numbers' boxes below the bar: the viewer begins a box above its point.
const DROP: f64 = 1.8;
/// Number of colours in the bar.
const BANDS: u32 = 48;

/// Column and row of a colour bar or text in its drawing, from 0.
pub(super) type Cell = [usize; 2];

/// The visible part of the plane, x and y, of a drawing with these columns and rows.
pub(super) fn visible([columns, rows]: [usize; 2]) -> [[f64; 2]; 2] {
    [[0.0, columns as f64 * CELL[0]], [-2.0, rows as f64 * CELL[1]]]
}

/// A colour bar.
#[derive(Debug, Clone, Copy)]
pub(super) struct Legend<'a> {
    /// Quantity.
    pub(super) title: &'a str,
    /// Unit of the numbers.
    pub(super) unit: &'a str,
    /// The map.
    pub(super) map: ColourMap,
    /// The numbers at its ends.
    pub(super) range: Range,
    /// Whether there are values beyond the upper end, which have its colour: the last number then has a "≥".
    pub(super) open_end: bool,
}

impl<'a> Legend<'a> {
    /// The colour bar of values over `range`.
    pub(super) fn new(title: &'a str, unit: &'a str, map: ColourMap, range: Range, values: &[f64]) -> Self {
        Self { title, unit, map, range, open_end: values.iter().any(|&v| v > range.high) }
    }

    /// Logs `{path}/bar` and `{path}/ticks` in a cell of the drawing.
    pub(super) fn log(&self, recording: &OpenRecording, path: &str, cell: Cell) -> Result<(), RecordError> {
        log_bar(recording, path, cell, &format!("{}, {}", self.title, self.unit), &|t| self.map.at(t), self.ticks())
    }

    /// The numbers, with their positions along the bar; only three if more would overlap.
    fn ticks(&self) -> Vec<(f64, String)> {
        let divided = |steps: u32| -> Vec<(f64, String)> {
            let all = (0..=steps).map(|tick| {
                let t = f64::from(tick) / f64::from(steps);
                let bound = if self.open_end && tick == steps { "≥" } else { "" };
                (t, format!("{bound}{}", number(self.range.low + t * (self.range.high - self.range.low))))
            });
            all.collect()
        };
        let round = divided(steps(self.range.high));
        let widest = round.windows(2).map(|two| 0.5 * (width(&two[0].1) + width(&two[1].1))).fold(0.0, f64::max);
        if widest * (round.len() - 1) as f64 > MAX_DIGITS { divided(2) } else { round }
    }
}

/// Digits that fit below a bar, in a window 1280 pixels wide, where four drawings stand side by side.
const MAX_DIGITS: f64 = 12.0;

/// Bounds that are named below the bar of the levels.
const NAMED_LEVELS: usize = 5;

/// Logs the hues of the occupied levels, from the nearest to the farthest, with the distances at which some of them begin, cm.
pub(super) fn log_level_hues(
    recording: &OpenRecording,
    path: &str,
    cell: Cell,
    levels: &[LevelCount],
) -> Result<(), RecordError> {
    let colours = level_colours(levels);
    let occupied: Vec<(&LevelCount, Rgb)> =
        levels.iter().zip(colours).filter(|(level, _)| level.vertices > 0).collect();
    let count = occupied.len();
    if count == 0 {
        return Ok(());
    }
    let hue = |t: f64| occupied[((t * count as f64) as usize).min(count - 1)].1;
    log_bar(recording, path, cell, "level, cm", &hue, level_ticks(&occupied))
}

/// Where the named levels begin along the bar, and their lower bounds. The last level is always named.
fn level_ticks(occupied: &[(&LevelCount, Rgb)]) -> Vec<(f64, String)> {
    let (count, named) = (occupied.len(), occupied.len().min(NAMED_LEVELS));
    let index = |i: usize| if named < 2 { 0 } else { i * (count - 1) / (named - 1) };
    (0..named)
        .map(index)
        .map(|i| {
            // Rounded to a tenth of a millimetre: a scaled bound has many digits.
            let cm = (100.0 * occupied[i].0.lower_cm).round() / 100.0;
            (i as f64 / count as f64, number(cm))
        })
        .collect()
}

/// Logs a bar with its title and its numbers, which have positions along the bar.
fn log_bar(
    recording: &OpenRecording,
    path: &str,
    [column, row]: Cell,
    title: &str,
    colour_at: &dyn Fn(f64) -> Rgb,
    ticks: Vec<(f64, String)>,
) -> Result<(), RecordError> {
    let [x, y] = [column as f64 * CELL[0], row as f64 * CELL[1]];
    let at = |t: f64| x + BAR[0] + t * (BAR[1] - BAR[0]);
    let middles = (0..BANDS).map(|band| (f64::from(band) + 0.5) / f64::from(BANDS));
    let width = (BAR[1] - BAR[0]) / f64::from(BANDS);
    let bands = middles.clone().map(|t| vec![single([at(t), y]), single([at(t), y + THICKNESS])]);
    // Half a band and a little more, so that there are no gaps.
    let bar =
        LineStrips2D::new(bands).with_colors(rerun_colours(middles.map(colour_at))).with_radii([(0.55 * width) as f32]);
    recording.log(&format!("{path}/bar"), &bar)?;

    // The viewer draws a text below its point.
    let mut places = vec![single([x + 0.5 * BAR[0], y - 0.5])];
    let mut labels = vec![title.to_owned()];
    for (t, label) in ticks {
        places.push(single([at(t), y + THICKNESS + DROP]));
        labels.push(label);
    }
    recording.log(&format!("{path}/ticks"), &texts(places, labels))
}

/// Width of a number, in digits.
fn width(label: &str) -> f64 {
    label.chars().map(|c| if c == '.' { 0.5 } else { 1.0 }).sum()
}

/// Distance of two rows of captions, in the drawing's units for each column: some 36 pixels in a window 1280 pixels wide.
const CAPTION_ROW: f64 = 4.2;

/// The visible part of a drawing of captions alone. It is wider for its height than its view, so that the columns are as wide as those of
/// the views above in a window of any size.
pub(super) fn visible_captions([columns, rows]: [usize; 2]) -> [[f64; 2]; 2] {
    let step = CAPTION_ROW * columns as f64;
    [[0.0, columns as f64 * CELL[0]], [0.0, (rows as f64 - 0.5) * step]]
}

/// Logs a line of text for the view in this column and row of `columns`.
pub(super) fn view_caption(
    recording: &OpenRecording,
    path: &str,
    text: &str,
    [column, row]: Cell,
    columns: usize,
) -> Result<(), RecordError> {
    let place = [(column as f64 + 0.5) * CELL[0], row as f64 * CAPTION_ROW * columns as f64];
    recording.log(path, &texts(vec![single(place)], vec![text.to_owned()]))
}

/// Logs a line of text in the middle of a cell.
pub(super) fn caption(
    recording: &OpenRecording,
    path: &str,
    text: &str,
    [column, row]: Cell,
) -> Result<(), RecordError> {
    let place = [(column as f64 + 0.5) * CELL[0], row as f64 * CELL[1]];
    recording.log(path, &texts(vec![single(place)], vec![text.to_owned()]))
}

/// Letters that fit above the bars, in a window 1280 pixels wide.
const MAX_CAPTION: usize = 40;

/// A table's name and number of PARTs. A long name is shortened in its middle: names of a table search differ at the end.
pub(super) fn table_title(table: &str, count: usize) -> String {
    let letters: Vec<char> = format!("{table}, {count} PARTs").chars().collect();
    match letters.len() {
        0..=33 => format!("table: {table}, {count} PARTs"),
        34..=MAX_CAPTION => letters.iter().collect(),
        n => letters[..MAX_CAPTION / 2 - 1].iter().chain(&['…']).chain(&letters[n - MAX_CAPTION / 2..]).collect(),
    }
}

fn single(place: [f64; 2]) -> [f32; 2] {
    place.map(|x| x as f32)
}

/// Texts at points of the plane.
pub(super) fn texts<S: Into<rerun::components::Text>>(places: Vec<[f32; 2]>, labels: Vec<S>) -> Points2D {
    Points2D::new(places).with_labels(labels).with_radii([0.0]).with_colors([TEXT]).with_show_labels(true)
}

/// The number of steps from zero to a round number such that each step is round.
fn steps(high: f64) -> u32 {
    let mantissa = high / 10f64.powf(high.log10().floor());
    match (2.0 * mantissa).round() as u32 {
        3 | 6 | 12 => 3,
        5 | 10 => 5,
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        for (high, expected) in
            [(1.0, 4), (1.5, 3), (2.0, 4), (2.5, 5), (30.0, 3), (0.4, 4), (5.0, 5), (0.6, 3), (80.0, 4)]
        {
            assert_eq!(steps(high), expected, "{high}");
        }
    }

    #[test]
    fn ticks_do_not_overlap() {
        let ticks = |high: f64, open_end: bool| {
            let range = Range { low: 0.0, high };
            let legend = Legend { title: "error", unit: "mm", map: ColourMap::ALARM, range, open_end };
            legend.ticks().into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(ticks(25.0, false), "0 5 10 15 20 25");
        assert_eq!(ticks(2.5, false), "0 0.5 1 1.5 2 2.5");
        assert_eq!(ticks(25.0, true), "0 12.5 ≥25");
        assert_eq!(ticks(250.0, true), "0 125 ≥250");
        assert_eq!(ticks(300.0, true), "0 100 200 ≥300");
    }

    #[test]
    fn hues_are_named_by_the_distances_at_which_their_levels_begin() {
        let level =
            |i: usize| LevelCount { level: i + 1, lower_cm: 0.5 * i as f64, vertices: 1, ..LevelCount::default() };
        let ticks = |count: usize| {
            let levels: Vec<LevelCount> = (0..count).map(level).collect();
            let occupied: Vec<(&LevelCount, Rgb)> = levels.iter().map(|level| (level, [0; 3])).collect();
            level_ticks(&occupied)
        };
        assert_eq!(ticks(1), [(0.0, "0".to_owned())]);
        assert_eq!(ticks(2), [(0.0, "0".to_owned()), (0.5, "0.5".to_owned())]);
        let many = ticks(12);
        assert_eq!(many.len(), NAMED_LEVELS);
        assert_eq!(many.last(), Some(&(11.0 / 12.0, "5.5".to_owned())));
    }

    #[test]
    fn columns_of_captions_are_as_wide_as_the_views_above_them() {
        use crate::record::layout::{ASPECT, BARS_HEIGHT};
        for (columns, rows) in [(2, 1), (3, 1), (6, 1), (2, 2), (3, 2)] {
            let [x, y] = visible_captions([columns, rows]);
            // A view fits its bounds; bounds that are relatively wider than the view fill its width.
            let view = ASPECT / (f64::from(BARS_HEIGHT) * rows as f64);
            assert!((x[1] - x[0]) / (y[1] - y[0]) >= 0.95 * view, "{columns} columns, {rows} rows");
        }
    }

    #[test]
    fn a_title_of_any_table_fits() {
        assert_eq!(table_title("Table 3", 95), "table: Table 3, 95 PARTs");
        for (name, count) in
            [("table-3 x0.5, 20 cm as in the file", 7), ("best after levels and extents, round 4", 1200)]
        {
            let title = table_title(name, count);
            assert!(title.chars().count() <= MAX_CAPTION && title.ends_with(&format!("{count} PARTs")), "{title}");
            assert!(title.starts_with(&name[..18]), "{title}");
        }
    }
}
