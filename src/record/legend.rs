//! Colour bars: strips with numbers and unit in a drawing of their own, under or beside the views they explain.
//!
//! A strip in the scene would tilt, shrink and be cut off as one turns the view; one in a plane view stays where it is. Bars of
//! a tab lie in one drawing, in columns and rows, so that they cost one title bar.

use rerun::{Color, LineStrips2D, Points2D};

use super::colour_map::ColourMap;
use super::meshes::rerun_colours;
use super::{Open, Range, RecordError};

/// Texts in a view. The viewer draws a box behind them that lets two fifths through, dark in its dark theme and light grey in
/// its light one: white is read on both if what lies behind is dark. Without a colour of their own Rerun gives each path another.
pub(super) const TEXT: Color = Color(rerun::Rgba32(0xFFFF_FFFF));
/// A column's width and a row's height, in the drawing's units: two to four pixels of the viewer's.
const CELL: [f64; 2] = [150.0, 19.0];
/// Where in its cell the strip begins and ends, and how thick it is; the title stands before it, the numbers under it.
const STRIP: [f64; 2] = [56.0, 138.0];
const THICKNESS: f64 = 4.0;
/// How far under the strip the boxes of the numbers begin: the viewer's own begin above their point.
const DROP: f64 = 1.8;
/// Bands of the strip.
const BANDS: u32 = 48;

/// Column and row of a colour bar or a text in its drawing, from 0.
pub(crate) type Cell = [usize; 2];

/// What a drawing of so many columns and rows shows of its plane: x and y.
pub(crate) fn visible([columns, rows]: [usize; 2]) -> [[f64; 2]; 2] {
    [[0.0, columns as f64 * CELL[0]], [-2.0, rows as f64 * CELL[1]]]
}

/// What a colour bar says.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legend<'a> {
    /// Quantity.
    pub(crate) title: &'a str,
    /// Unit of the numbers.
    pub(crate) unit: &'a str,
    /// The map.
    pub(crate) map: ColourMap,
    /// The numbers at its ends.
    pub(crate) range: Range,
    /// Whether values beyond the upper end exist (they take its colour): the last number then reads "≥".
    pub(crate) open_end: bool,
}

impl Legend<'_> {
    /// Logs `{path}/bar` and `{path}/ticks` at a place of the drawing.
    pub(crate) fn log(&self, open: &Open, path: &str, [column, row]: Cell) -> Result<(), RecordError> {
        let [x, y] = [column as f64 * CELL[0], row as f64 * CELL[1]];
        let at = |t: f64| x + STRIP[0] + t * (STRIP[1] - STRIP[0]);
        let middles = (0..BANDS).map(|band| (f64::from(band) + 0.5) / f64::from(BANDS));
        let width = (STRIP[1] - STRIP[0]) / f64::from(BANDS);
        let bands = middles.clone().map(|t| vec![single([at(t), y]), single([at(t), y + THICKNESS])]);
        // Half a band wide, and a little more, lest the ground shows between them.
        let bar = LineStrips2D::new(bands)
            .with_colors(rerun_colours(middles.map(|t| self.map.at(t))))
            .with_radii([(0.55 * width) as f32]);
        open.log(&format!("{path}/bar"), &bar)?;

        // The viewer writes a text under its point.
        let mut places = vec![single([x + 0.5 * STRIP[0], y - 0.5])];
        let mut labels = vec![format!("{}, {}", self.title, self.unit)];
        for (t, label) in self.ticks() {
            places.push(single([at(t), y + THICKNESS + DROP]));
            labels.push(label);
        }
        open.log(&format!("{path}/ticks"), &texts(places, labels))
    }

    /// The numbers under the strip, and how far along it: in halves where more of them would lie over each other.
    fn ticks(&self) -> Vec<(f64, String)> {
        let by = |steps: u32| -> Vec<(f64, String)> {
            let all = (0..=steps).map(|tick| {
                let t = f64::from(tick) / f64::from(steps);
                let bound = if self.open_end && tick == steps { "≥" } else { "" };
                (t, format!("{bound}{}", number(self.range.low + t * (self.range.high - self.range.low))))
            });
            all.collect()
        };
        let round = by(steps(self.range.high));
        let widest = round.windows(2).map(|two| 0.5 * (width(&two[0].1) + width(&two[1].1))).fold(0.0, f64::max);
        if widest * (round.len() - 1) as f64 > ROOM { by(2) } else { round }
    }
}

/// Digits that have room side by side under a strip, in a window 1280 wide.
const ROOM: f64 = 13.0;

/// Width of a number, in digits.
fn width(label: &str) -> f64 {
    label.chars().map(|c| if c == '.' { 0.5 } else { 1.0 }).sum()
}

/// A line of text in the middle of a place of the drawing.
pub(super) fn caption(open: &Open, path: &str, text: &str, [column, row]: Cell) -> Result<(), RecordError> {
    let place = [(column as f64 + 0.5) * CELL[0], row as f64 * CELL[1]];
    open.log(path, &texts(vec![single(place)], vec![text.to_owned()]))
}

/// Letters of a caption that fit over the bars in a window 1280 wide.
const CAPTION: usize = 40;

/// A table's name and its PARTs, the middle of a long name left out: names of one search begin alike, and end in their round.
pub(super) fn titled(table: &str, count: usize) -> String {
    let letters: Vec<char> = format!("{table}, {count} PARTs").chars().collect();
    match letters.len() {
        0..=33 => format!("table: {table}, {count} PARTs"),
        34..=CAPTION => letters.iter().collect(),
        n => letters[..CAPTION / 2 - 1].iter().chain(&['…']).chain(&letters[n - CAPTION / 2..]).collect(),
    }
}

fn single(place: [f64; 2]) -> [f32; 2] {
    place.map(|x| x as f32)
}

/// Points of the plane with a text each, drawn as text alone.
pub(super) fn texts<S: Into<rerun::components::Text>>(places: Vec<[f32; 2]>, labels: Vec<S>) -> Points2D {
    Points2D::new(places).with_labels(labels).with_radii([0.0]).with_colors([TEXT]).with_show_labels(true)
}

/// Into how many steps from zero a round number falls so that each is round too.
fn steps(high: f64) -> u32 {
    let mantissa = high / 10f64.powf(high.log10().floor());
    match (2.0 * mantissa).round() as u32 {
        3 | 6 | 12 => 3,
        5 | 10 => 5,
        _ => 4,
    }
}

/// Three significant digits, without trailing zeros.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    if digits == 9 {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{CAPTION, ColourMap, Legend, Range, number, steps, titled};

    #[test]
    fn ticks_are_round() {
        for (high, expected) in
            [(1.0, 4), (1.5, 3), (2.0, 4), (2.5, 5), (30.0, 3), (0.4, 4), (5.0, 5), (0.6, 3), (80.0, 4)]
        {
            assert_eq!(steps(high), expected, "{high}");
        }
    }

    #[test]
    fn numbers_lie_beside_each_other() {
        let told = |high: f64, open_end: bool| {
            let range = Range { low: 0.0, high };
            let legend = Legend { title: "error", unit: "mm", map: ColourMap::ALARM, range, open_end };
            legend.ticks().into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(told(25.0, false), "0 5 10 15 20 25");
        assert_eq!(told(2.5, false), "0 0.5 1 1.5 2 2.5");
        assert_eq!(told(250.0, true), "0 125 ≥250");
        assert_eq!(told(300.0, true), "0 100 200 ≥300");
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.25, "1.25"),
            (12.5, "12.5"),
            (2500.0, "2500"),
            (0.015, "0.015"),
            (3.0, "3"),
            (1e-9, "1.00e-9"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_title_fits_whatever_the_table_is_called() {
        assert_eq!(titled("Table 3", 95), "table: Table 3, 95 PARTs");
        for (name, count) in
            [("table-3 x0.5, 20 cm as in the file", 7), ("best after levels and extents, round 4", 1200)]
        {
            let said = titled(name, count);
            assert!(said.chars().count() <= CAPTION && said.ends_with(&format!("{count} PARTs")), "{said}");
            assert!(said.starts_with(&name[..18]), "{said}");
        }
    }
}
