//! One number over another, drawn in the plane: cost against error, a dot for each table; both axes logarithmic.
//!
//! The viewer has no plot of one number over another, so that axes, numbers and names are lines and points of a 2D view.

use rerun::{Color, LineStrips2D, Points2D};

use super::labels::{Labels, Rect};
use super::legend::{number, texts};
use super::{Open, RecordError, colours, meshes, paths};

/// A picture: where it lies and what its axes are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture<'a> {
    /// Its path: [`paths::SCATTER`] or [`paths::GROWTH`].
    pub path: &'a str,
    /// Title of the horizontal axis, with its unit (`time, ms`).
    pub x: &'a str,
    /// Title of the vertical axis.
    pub y: &'a str,
}

impl<'a> Picture<'a> {
    /// What something costs against its error.
    #[must_use]
    pub fn of_error(cost: &'a str) -> Self {
        Self { path: paths::SCATTER, x: cost, y: "error, mm" }
    }

    /// How times grow.
    #[must_use]
    pub(crate) fn of_growth() -> Self {
        Self { path: paths::GROWTH, x: "vertices", y: "time, ms" }
    }
}

/// One table, or any other setting, in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterPoint<'a> {
    /// Its name.
    pub label: &'a str,
    /// Where it lies along the horizontal axis: what it costs.
    pub x: f64,
    /// Along the vertical one: its error.
    pub y: f64,
    /// Points of one group share a colour; the front, say, against the rest.
    pub group: usize,
    /// Whether its name is written beside it, where there is room.
    pub named: bool,
}

/// Width and height of the picture, in its own units: about two pixels of the view.
const PICTURE: [f64; 2] = [400.0, 170.0];
/// What the view shows of the plane when the recording opens: x and y, the picture and the numbers around it.
pub(crate) const VISIBLE: [[f64; 2]; 2] = [[-42.0, 428.0], [-PICTURE[1] - 22.0, 32.0]];
/// Radius of a dot.
const DOT: f64 = 2.6;

/// A logarithmic axis between two round numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    low: f64,
    high: f64,
    length: f64,
}

impl Axis {
    /// The axis that holds all values, with a little air; a decade where there are none.
    fn around(values: impl Iterator<Item = f64>, length: f64) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return Self { low: 1.0, high: 10.0, length };
        }
        let (low, high) = (round(low / 1.1, false), round(high * 1.1, true));
        Self { low, high, length }
    }

    fn place(&self, value: f64) -> f64 {
        (value / self.low).log10() / (self.high / self.low).log10() * self.length
    }

    /// 1 to 9 times each power of ten, as far as the axis goes, with the multiple.
    fn ticks(&self) -> impl Iterator<Item = (i32, f64)> {
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let (low, high) = (self.low * 0.999, self.high * 1.001);
        (first..=last)
            .flat_map(|decade| (1..10).map(move |m| (m, f64::from(m) * 10f64.powi(decade))))
            .filter(move |&(_, value)| (low..=high).contains(&value))
    }
}

/// The nearest of 1, 2, 5 × 10ⁿ at or beyond `value`.
fn round(value: f64, up: bool) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let mut steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter();
    if up {
        steps.find(|&s| s >= value * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
    } else {
        steps.rfind(|&s| s <= value * (1.0 + 1e-9)).unwrap_or(decade)
    }
}

/// Points that are not positive and finite cannot be placed and are left out.
pub(super) fn scatter(
    open: &Open,
    index: i64,
    picture: Picture<'_>,
    points: &[ScatterPoint<'_>],
) -> Result<(), RecordError> {
    let path = picture.path;
    open.at(index, 6);
    let placed: Vec<&ScatterPoint<'_>> =
        points.iter().filter(|p| p.x.is_finite() && p.y.is_finite() && p.x > 0.0 && p.y > 0.0).collect();
    let along = Axis::around(placed.iter().map(|p| p.x), PICTURE[0]);
    let up = Axis::around(placed.iter().map(|p| p.y), PICTURE[1]);
    axes(open, [&along, &up], picture)?;
    let place = |p: &ScatterPoint<'_>| [along.place(p.x), up.place(p.y)];
    let palette = colours::palette();
    let dots = Points2D::new(placed.iter().map(|p| plane(place(p))))
        .with_colors(meshes::rerun_colours(placed.iter().map(|p| palette[p.group % palette.len()])))
        .with_radii([DOT as f32])
        .with_draw_order(30.0);
    open.log(&format!("{path}/points"), &dots)?;
    let frame = Rect { low: [0.0, 0.0], high: PICTURE };
    let mut labels = Labels::new(frame, placed.iter().map(|p| place(p)), DOT);
    let named = placed.iter().filter(|p| p.named && !p.label.is_empty());
    let (mut anchors, mut names, mut leaders) = (Vec::new(), Vec::new(), Vec::new());
    for point in named {
        if let Some(spot) = labels.place(place(point), point.label) {
            anchors.push(plane(spot.anchor));
            names.push(point.label);
            leaders.extend(spot.leader.map(|end| vec![plane(place(point)), plane(end)]));
        }
    }
    let leaders = LineStrips2D::new(leaders).with_colors([Color::from_rgb(150, 156, 165)]).with_radii([0.25]);
    open.log(&format!("{path}/leaders"), &leaders)?;
    open.log(&format!("{path}/names"), &texts(anchors, names))
}

/// The grid, the numbers at it, and what they count.
fn axes(open: &Open, [along, up]: [&Axis; 2], picture: Picture<'_>) -> Result<(), RecordError> {
    let [width, height] = PICTURE;
    let mut lines = Vec::new();
    let mut shades = Vec::new();
    let mut places = vec![plane([0.5 * width, -13.0]), plane([0.0, height + 16.0])];
    let mut labels = vec![picture.x.to_owned(), picture.y.to_owned()];
    // The line of each tick, and where its number stands.
    let upright = along.ticks().map(|(multiple, value)| {
        let x = along.place(value);
        (multiple, value, [[x, 0.0], [x, height]], [x, -1.0])
    });
    let level = up.ticks().map(|(multiple, value)| {
        let y = up.place(value);
        (multiple, value, [[0.0, y], [width, y]], [-16.0, y + 6.0])
    });
    for (multiple, value, line, place) in upright.chain(level) {
        lines.push(line.map(plane).to_vec());
        shades.push(if multiple == 1 { Color::from_rgb(110, 117, 128) } else { Color::from_rgb(58, 62, 69) });
        if matches!(multiple, 1 | 2 | 5) {
            places.push(plane(place));
            labels.push(number(value));
        }
    }
    let axes = LineStrips2D::new(lines).with_colors(shades).with_radii([0.25]);
    open.log(&format!("{}/axes", picture.path), &axes)?;
    open.log(&format!("{}/ticks", picture.path), &texts(places, labels))
}

/// The viewer's plane has y downwards.
fn plane([x, y]: [f64; 2]) -> [f32; 2] {
    [x as f32, -y as f32]
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn axes_hold_all_values_between_round_numbers() {
        let ends = |values: &[f64]| {
            let axis = Axis::around(values.iter().copied(), 100.0);
            for &value in values {
                assert!((0.0..=100.0).contains(&axis.place(value)), "{value} {axis:?}");
            }
            [axis.low, axis.high].map(|v| (v * 1e6).round() / 1e6)
        };
        assert_eq!(ends(&[3.0, 250.0]), [2.0, 500.0]);
        assert_eq!(ends(&[10.0]), [5.0, 20.0]);
        assert_eq!(ends(&[0.024, 0.4]), [0.02, 0.5]);
        assert_eq!(ends(&[]), [1.0, 10.0]);
        let ticks: Vec<f64> = Axis::around([3.0, 15.0].into_iter(), 1.0).ticks().map(|t| t.1).collect();
        assert_eq!(ticks, [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 20.0]);
    }
}
