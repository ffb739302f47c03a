//! Colour bars: a strip under the hem, in the plane of the picture, with numbers and the unit.
//!
//! A strip in the scene is seen in every view, screenshot and web page; a legend in a view of its own costs the room of one.

use glam::DVec3;
use rerun::{Color, Mesh3D, Points3D};

use super::colour_map::{ColourMap, Range, Rgb};
use super::eye::Eye;
use super::meshes::{rerun_colours, single};
use super::{Open, RecordError};

/// Texts in a view. The viewer draws a box behind them that lets two fifths through, dark in its dark theme and light grey in
/// its light one: white is read on both if what lies behind is dark. Without a colour of their own Rerun gives each path another.
pub(super) const TEXT: Color = Color(rerun::Rgba32(0xFFFF_FFFF));
/// Behind the texts: black leaves white 4.7 times as bright as the light theme's box, legs behind it 1.5 times.
const PLATE: Rgb = [0, 0, 0];
/// Two triangles of a rectangle's four corners.
const PLATE_TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
/// Thickness of the strip, height of a text with its box, and where the title hangs above the strip's lower edge, pixels: texts
/// have one size on screen, and the strip must fit between them in wide views and narrow ones.
const STRIP_PX: f64 = 9.0;
const TEXT_PX: f64 = 24.0;
const TITLE_PX: f64 = STRIP_PX + TEXT_PX + 3.0;
/// Bands of the strip.
const BANDS: u32 = 48;

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
    /// Logs `{path}/bar` and `{path}/ticks` under the garment, for a view in which a pixel there is `pixel_m` long.
    pub(crate) fn log(&self, open: &Open, path: &str, pixel_m: f64) -> Result<(), RecordError> {
        let eye = &open.eye;
        let (length, thickness) = (1.65 * eye.half_width.max(0.36 * eye.half_height), STRIP_PX * pixel_m);
        let start = under(eye, (TITLE_PX + TEXT_PX) * pixel_m) - eye.right * (0.5 * length);
        let at = |along: f64, above: f64| single(start + eye.right * (along * length) + eye.up * above);
        let edges = [-1.2 * TEXT_PX, TITLE_PX].map(|px| px * pixel_m);
        let mut corners = plate(eye, start + eye.right * (0.5 * length), length + 2.2 * TEXT_PX * pixel_m, edges);
        let mut colours = vec![PLATE; 4];
        let mut triangles = PLATE_TRIANGLES.to_vec();
        for band in 0..BANDS {
            let first = 4 * (band + 1);
            let (low, high) = (f64::from(band) / f64::from(BANDS), f64::from(band + 1) / f64::from(BANDS));
            corners.extend([at(low, 0.0), at(high, 0.0), at(high, thickness), at(low, thickness)]);
            colours.extend([self.map.at(0.5 * (low + high)); 4]);
            triangles.extend(PLATE_TRIANGLES.map(|t| t.map(|c| first + c)));
        }
        // No normals: the strip is to keep its colours in any light.
        let bar = Mesh3D::new(corners).with_triangle_indices(triangles).with_vertex_colors(rerun_colours(colours));
        open.log(&format!("{path}/bar"), &bar)?;

        // The viewer writes a text under its point.
        let mut places = vec![at(0.5, TITLE_PX * pixel_m)];
        let mut labels = vec![format!("{}, {}", self.title, self.unit)];
        let steps = steps(self.range.high);
        for tick in 0..=steps {
            let t = f64::from(tick) / f64::from(steps);
            let value = self.range.low + t * (self.range.high - self.range.low);
            let bound = if self.open_end && tick == steps { "≥" } else { "" };
            places.push(at(t, 0.0));
            labels.push(format!("{bound}{}", number(value)));
        }
        open.log(&format!("{path}/ticks"), &texts(places, labels))
    }
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

/// The point so far under the middle of the hem, m, in the plane of the garment's nearest point: in front of the legs.
fn under(eye: &Eye, below_m: f64) -> DVec3 {
    eye.centre + eye.toward * eye.half_depth - eye.up * (eye.half_height + below_m)
}

/// The corners of an upright rectangle facing the eye, a hair farther than `middle`: its width, and its lower and upper edge
/// relative to `middle`, m.
fn plate(eye: &Eye, middle: DVec3, width: f64, edges: [f64; 2]) -> Vec<[f32; 3]> {
    let behind = middle - eye.toward * (0.01 * eye.half_height.max(eye.half_width));
    let [low, high] = edges.map(|edge| eye.up * edge);
    let aside = eye.right * (0.5 * width);
    [low - aside, low + aside, high + aside, high - aside].map(|off| single(behind + off)).to_vec()
}

/// A text under the garment, on a plate of its own: `{path}` and `{path}/plate`.
pub(super) fn caption(open: &Open, path: &str, text: &str, pixel_m: f64) -> Result<(), RecordError> {
    let place = under(&open.eye, 0.3 * TEXT_PX * pixel_m);
    let width = 0.4 * TEXT_PX * text.chars().count() as f64 * pixel_m;
    let corners = plate(&open.eye, place, width, [-1.2 * TEXT_PX * pixel_m, 0.0]);
    let plate =
        Mesh3D::new(corners).with_triangle_indices(PLATE_TRIANGLES).with_vertex_colors(rerun_colours([PLATE; 4]));
    open.log(&format!("{path}/plate"), &plate)?;
    open.log(path, &texts(vec![single(place)], vec![text.to_owned()]))
}

/// Points with a text each, drawn as text alone.
fn texts(places: Vec<[f32; 3]>, labels: Vec<String>) -> Points3D {
    Points3D::new(places).with_labels(labels).with_radii([0.0]).with_colors([TEXT]).with_show_labels(true)
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
    use super::{number, steps};

    #[test]
    fn ticks_are_round() {
        for (high, expected) in
            [(1.0, 4), (1.5, 3), (2.0, 4), (2.5, 5), (30.0, 3), (0.4, 4), (5.0, 5), (0.6, 3), (80.0, 4)]
        {
            assert_eq!(steps(high), expected, "{high}");
        }
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
}
