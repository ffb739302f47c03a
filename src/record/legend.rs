//! Colour bars with numbers and unit, in a plane drawing below or beside the views.
//!
//! In a 3D view a bar would tilt, shrink and be cut off as the view turns. All bars of a tab share one drawing of columns and rows, so
//! that they need one title bar.

use rerun::{Color, LineStrips2D, Points2D};

use super::error::RecordError;
use super::meshes::rerun_colours;
use super::open_recording::OpenRecording;
pub(super) use crate::picture::colour::legend::Legend;
use crate::picture::colour::legend::{BANDS, ColourBar, level_bar};
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

/// Column and row of a colour bar or text in its drawing, from 0.
pub(super) type Cell = [usize; 2];

/// The visible part of the plane, x and y, of a drawing with these columns and rows.
pub(super) fn visible([columns, rows]: [usize; 2]) -> [[f64; 2]; 2] {
    [[0.0, columns as f64 * CELL[0]], [-2.0, rows as f64 * CELL[1]]]
}

impl Legend<'_> {
    /// Logs `{path}/bar` and `{path}/ticks` in a cell of the drawing.
    pub(super) fn log(&self, recording: &OpenRecording, path: &str, cell: Cell) -> Result<(), RecordError> {
        log_bar(recording, path, cell, &self.bar())
    }
}

/// Logs the hues of the occupied levels, from the nearest to the farthest, with the distances at which some of them begin, cm.
pub(super) fn log_level_hues(
    recording: &OpenRecording,
    path: &str,
    cell: Cell,
    levels: &[LevelCount],
) -> Result<(), RecordError> {
    level_bar(levels).map_or(Ok(()), |bar| log_bar(recording, path, cell, &bar))
}

/// Logs a bar with its title and its numbers.
fn log_bar(recording: &OpenRecording, path: &str, [column, row]: Cell, bar: &ColourBar) -> Result<(), RecordError> {
    let [x, y] = [column as f64 * CELL[0], row as f64 * CELL[1]];
    let at = |t: f64| x + BAR[0] + t * (BAR[1] - BAR[0]);
    let width = (BAR[1] - BAR[0]) / BANDS as f64;
    let middles = (0..BANDS).map(|band| at((band as f64 + 0.5) / BANDS as f64));
    let bands = middles.map(|x| vec![single([x, y]), single([x, y + THICKNESS])]);
    // Half a band and a little more, so that there are no gaps.
    let strips = LineStrips2D::new(bands)
        .with_colors(rerun_colours(bar.bands.iter().copied()))
        .with_radii([(0.55 * width) as f32]);
    recording.log(&format!("{path}/bar"), &strips)?;

    // The viewer draws a text below its point.
    let mut places = vec![single([x + 0.5 * BAR[0], y - 0.5])];
    let mut labels = vec![bar.title.clone()];
    for (t, label) in &bar.ticks {
        places.push(single([at(*t), y + THICKNESS + DROP]));
        labels.push(label.clone());
    }
    recording.log(&format!("{path}/ticks"), &texts(places, labels))
}

/// Distance of two rows of captions, in the drawing's units for each column: some 36 pixels in a window 1280 pixels wide.
const CAPTION_ROW: f64 = 4.2;

/// The visible part of a drawing of captions alone. It is wider for its height than its view, so that the columns are as wide as those of
/// the views above in a window of any size.
pub(super) fn visible_captions([columns, rows]: [usize; 2]) -> [[f64; 2]; 2] {
    let step = CAPTION_ROW * columns as f64;
    [[0.0, columns as f64 * CELL[0]], [0.0, (rows as f64 - 0.5) * step]]
}

/// Logs one or two lines of text for the view in this column and row of `columns`.
pub(super) fn view_caption(
    recording: &OpenRecording,
    path: &str,
    text: &str,
    [column, row]: Cell,
    columns: usize,
) -> Result<(), RecordError> {
    // A second line begins half as high again, so that both are in the middle of the row.
    let line = row as f64 - 0.25 * text.matches('\n').count() as f64;
    let place = [(column as f64 + 0.5) * CELL[0], line * CAPTION_ROW * columns as f64];
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

/// A table's name and number of PARTs.
pub(super) fn table_title(table: &str, count: usize) -> String {
    let text = format!("{table}, {count} PARTs");
    if text.chars().count() <= MAX_CAPTION - 7 { format!("table: {text}") } else { shortened(&text, MAX_CAPTION) }
}

/// A text of at most `most` letters. A long one is shortened in its middle: names of a table search differ at the end.
pub(super) fn shortened(text: &str, most: usize) -> String {
    let letters: Vec<char> = text.chars().collect();
    let n = letters.len();
    if n <= most {
        return text.to_owned();
    }
    let half = most / 2;
    letters[..most - half - 1].iter().chain(&['…']).chain(&letters[n - half..]).collect()
}

fn single(place: [f64; 2]) -> [f32; 2] {
    place.map(|x| x as f32)
}

/// Texts at points of the plane.
pub(super) fn texts<S: Into<rerun::components::Text>>(places: Vec<[f32; 2]>, labels: Vec<S>) -> Points2D {
    Points2D::new(places).with_labels(labels).with_radii([0.0]).with_colors([TEXT]).with_show_labels(true)
}

#[cfg(test)]
mod tests {
    use super::*;

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
