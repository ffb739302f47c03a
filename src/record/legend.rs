//! Colour bars: a standing strip beside the garment, in the plane of the picture, with numbers and the unit.
//!
//! A strip in the scene is seen in every view, screenshot and web page; a legend in a view of its own costs the room of one.

use rerun::{Color, Mesh3D, Points3D};

use super::colour_map::{ColourMap, Range};
use super::meshes::{rerun_colours, single};
use super::{Open, RecordError};

/// Bands of the strip.
const BANDS: u32 = 48;
/// Numbers along the strip, the ends included.
const TICKS: u32 = 5;

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
    /// Logs `{path}/bar` and `{path}/ticks` beside the garment.
    pub(crate) fn log(&self, open: &Open, path: &str) -> Result<(), RecordError> {
        let eye = &open.eye;
        let height = 1.3 * eye.half_height;
        let width = 0.045 * height;
        let foot = eye.centre + eye.right * (eye.half_width + 1.2 * width) - eye.up * (0.5 * height);
        let at = |across: f64, along: f64| single(foot + eye.right * (across * width) + eye.up * (along * height));
        let mut corners = Vec::new();
        let mut colours = Vec::new();
        let mut triangles = Vec::new();
        for band in 0..BANDS {
            let (low, high) = (f64::from(band) / f64::from(BANDS), f64::from(band + 1) / f64::from(BANDS));
            corners.extend([at(0.0, low), at(1.0, low), at(1.0, high), at(0.0, high)]);
            colours.extend([self.map.at(0.5 * (low + high)); 4]);
            triangles.extend([[4 * band, 4 * band + 1, 4 * band + 2], [4 * band, 4 * band + 2, 4 * band + 3]]);
        }
        // No normals: the strip is to keep its colours in any light.
        let bar = Mesh3D::new(corners).with_triangle_indices(triangles).with_vertex_colors(rerun_colours(colours));
        open.log(&format!("{path}/bar"), &bar)?;

        let mut places = vec![at(1.6, 1.09)];
        let mut labels = vec![format!("{}, {}", self.title, self.unit)];
        for tick in 0..TICKS {
            let t = f64::from(tick) / f64::from(TICKS - 1);
            let value = self.range.low + t * (self.range.high - self.range.low);
            let bound = if self.open_end && tick == TICKS - 1 { "≥ " } else { "" };
            places.push(at(2.4, t));
            labels.push(format!("{bound}{}", number(value)));
        }
        open.log(&format!("{path}/ticks"), &texts(places, labels))
    }
}

/// Points with a text each, drawn as text alone.
fn texts(places: Vec<[f32; 3]>, labels: Vec<String>) -> Points3D {
    Points3D::new(places)
        .with_labels(labels)
        .with_radii([0.0])
        .with_colors([Color::from_rgb(225, 228, 232)])
        .with_show_labels(true)
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
    use super::number;

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
