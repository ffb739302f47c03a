//! A scatter plot of one number over another, both axes logarithmic, a dot for each table or method.
//!
//! The viewer has no such plot, so axes, numbers and names are lines and points of a 2D view. A name overlaps neither dots nor other
//! names; a leader line joins it to its dot if they are apart. Places around the dot are tried from near to far, and the first free
//! one is taken. Lengths are in units of the picture, y upwards.
//!
//! Limits: the viewer's texts have a fixed size on screen, so that names may overlap after zooming out. Widths are estimated from the
//! number of letters.

use std::ops::RangeInclusive;

use rerun::{Color, LineStrips2D, Points2D};

use super::error::RecordError;
use super::legend::texts;
use super::open_recording::OpenRecording;
use super::{meshes, paths};
use crate::picture::colour::legend::number;
use crate::picture::colour::palette;

/// Path and axis titles of a scatter plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Picture<'a> {
    /// [`paths::SCATTER`] or [`paths::GROWTH`].
    pub(crate) path: &'a str,
    /// Title of the horizontal axis, with its unit (`time, ms`).
    pub(crate) x: &'a str,
    /// Title of the vertical axis.
    pub(crate) y: &'a str,
}

impl<'a> Picture<'a> {
    /// Error over cost.
    pub(crate) fn of_error(cost: &'a str) -> Self {
        Self { path: paths::SCATTER, x: cost, y: "error, mm" }
    }

    /// Time over number of vertices.
    pub(crate) fn of_growth() -> Self {
        Self { path: paths::GROWTH, x: "vertices", y: "time, ms" }
    }
}

/// A table or method in a scatter plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ScatterPoint<'a> {
    /// Name of the table or method.
    pub(crate) label: &'a str,
    /// Horizontal coordinate: the cost.
    pub(crate) x: f64,
    /// Vertical coordinate: the error.
    pub(crate) y: f64,
    /// Points of one group share a colour, such as those of the Pareto front.
    pub(crate) group: usize,
    /// Whether the name is written beside the dot, if there is room.
    pub(crate) named: bool,
}

/// Width and height of the plot, in units of about two pixels of the view.
const PICTURE: [f64; 2] = [400.0, 170.0];
/// The visible part of the plane, x and y, when the recording opens: the plot with the numbers around it.
pub(super) const VISIBLE: [[f64; 2]; 2] = [[-42.0, 428.0], [-PICTURE[1] - 22.0, 32.0]];
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
    /// The axis that contains all values with a margin; a decade without values.
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

    /// The multiples, 1 to 9, of each power of ten on the axis, with their values.
    fn ticks(&self) -> impl Iterator<Item = (i32, f64)> {
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let (low, high) = (self.low * 0.999, self.high * 1.001);
        (first..=last)
            .flat_map(|decade| (1..10).map(move |m| (m, f64::from(m) * 10f64.powi(decade))))
            .filter(move |&(_, value)| (low..=high).contains(&value))
    }
}

/// The nearest of 1, 2, 5 × 10ⁿ not below `value`, or not above it unless `up`.
fn round(value: f64, up: bool) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let mut steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter();
    if up {
        steps.find(|&s| s >= value * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
    } else {
        steps.rfind(|&s| s <= value * (1.0 + 1e-9)).unwrap_or(decade)
    }
}

/// Values that are drawn. An axis has 24 decades of ticks at most; without a bound, 5e-324 or 1e308 gives an axis without end,
/// whose ticks take all memory.
const DRAWN: RangeInclusive<f64> = 1e-12..=1e12;

/// Logs a scatter plot. Points with a coordinate outside [`DRAWN`] are left out.
pub(super) fn log(
    recording: &OpenRecording,
    index: i64,
    picture: Picture<'_>,
    points: &[ScatterPoint<'_>],
) -> Result<(), RecordError> {
    let path = picture.path;
    recording.at(index, 6);
    let placed: Vec<&ScatterPoint<'_>> =
        points.iter().filter(|p| DRAWN.contains(&p.x) && DRAWN.contains(&p.y)).collect();
    let along = Axis::around(placed.iter().map(|p| p.x), PICTURE[0]);
    let up = Axis::around(placed.iter().map(|p| p.y), PICTURE[1]);
    log_axes(recording, [&along, &up], picture)?;
    let place = |p: &ScatterPoint<'_>| [along.place(p.x), up.place(p.y)];
    let palette = palette::palette();
    let dots = Points2D::new(placed.iter().map(|p| plane(place(p))))
        .with_colors(meshes::rerun_colours(placed.iter().map(|p| palette[p.group % palette.len()])))
        .with_radii([DOT as f32])
        .with_draw_order(30.0);
    recording.log(&format!("{path}/points"), &dots)?;
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
    recording.log(&format!("{path}/leaders"), &leaders)?;
    recording.log(&format!("{path}/names"), &texts(anchors, names))
}

/// Logs the grid, its numbers, and the titles of the axes.
fn log_axes(recording: &OpenRecording, [along, up]: [&Axis; 2], picture: Picture<'_>) -> Result<(), RecordError> {
    let [width, height] = PICTURE;
    let mut lines = Vec::new();
    let mut shades = Vec::new();
    let mut places = vec![plane([0.5 * width, -13.0]), plane([0.0, height + 16.0])];
    let mut labels = vec![picture.x.to_owned(), picture.y.to_owned()];
    // The line of each tick, and the place of its number.
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
    recording.log(&format!("{}/axes", picture.path), &axes)?;
    recording.log(&format!("{}/ticks", picture.path), &texts(places, labels))
}

/// A point of the viewer's plane, which has y downwards.
fn plane([x, y]: [f64; 2]) -> [f32; 2] {
    [x as f32, -y as f32]
}

/// Width of a letter and height of a line of text, including the viewer's box around it.
const LETTER: f64 = 3.5;
const LINE: f64 = 12.5;
/// Padding of the box, both sides together.
const PADDING: f64 = 6.0;
/// Distance of a text's box below its anchor in the viewer.
const DROP: f64 = 0.5;
/// Spacing of the samples of a leader line.
const SAMPLE: f64 = 2.0;
/// Rings of places around a dot.
const RINGS: i32 = 9;

/// An axis-parallel rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rect {
    low: [f64; 2],
    high: [f64; 2],
}

impl Rect {
    fn around([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Self {
        Self { low: [x - 0.5 * width, y - 0.5 * height], high: [x + 0.5 * width, y + 0.5 * height] }
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|i| self.low[i] < other.high[i] && other.low[i] < self.high[i])
    }

    fn within(&self, other: &Self) -> bool {
        (0..2).all(|i| self.low[i] >= other.low[i] && self.high[i] <= other.high[i])
    }

    /// The nearest point to `p`.
    fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| p[i].clamp(self.low[i], self.high[i]))
    }
}

/// The place of a name.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spot {
    /// The anchor, below which the viewer draws the text.
    anchor: [f64; 2],
    /// End of the leader line from the dot, if there is one.
    leader: Option<[f64; 2]>,
}

/// The names placed so far.
#[derive(Debug)]
struct Labels {
    frame: Rect,
    dots: Vec<Rect>,
    names: Vec<Rect>,
    lines: Vec<Rect>,
    radius: f64,
}

impl Labels {
    /// No names yet, in `frame`, among dots of this radius.
    fn new(frame: Rect, dots: impl Iterator<Item = [f64; 2]>, radius: f64) -> Self {
        let dots = dots.map(|dot| Rect::around(dot, [2.0 * radius; 2])).collect();
        Self { frame, dots, names: Vec::new(), lines: Vec::new(), radius }
    }

    /// Finds a place for the name of a dot, if there is one. Leader lines avoid names and other lines as long as there is room.
    fn place(&mut self, dot: [f64; 2], name: &str) -> Option<Spot> {
        let size = [LETTER * name.chars().count() as f64 + PADDING, LINE];
        let free = |rect: &Rect| !self.dots.iter().chain(&self.names).any(|other| rect.overlaps(other));
        let clear_of_lines = |rect: &Rect| !self.lines.iter().any(|other| rect.overlaps(other));
        let fits = |rect: &Rect| rect.within(&self.frame) && free(rect);
        let tidy =
            |rect: &Rect| clear_of_lines(rect) && self.leader(dot, rect).iter().all(|b| free(b) && clear_of_lines(b));
        let spots = |rings| self.spots(dot, size, rings).filter(fits);
        let next_to = spots(0..1).find(clear_of_lines);
        let in_a_ring = || spots(1..RINGS).find(tidy);
        let rect = next_to.or_else(in_a_ring).or_else(|| spots(1..RINGS).next())?;
        let leader = next_to.is_none().then(|| rect.nearest(dot));
        if leader.is_some() {
            let samples = self.leader(dot, &rect);
            self.lines.extend(samples);
        }
        self.names.push(rect);
        Some(Spot { anchor: [0.5 * (rect.low[0] + rect.high[0]), rect.high[1] + DROP], leader })
    }

    /// The places around a dot, ring by ring.
    fn spots(&self, dot: [f64; 2], size: [f64; 2], rings: std::ops::Range<i32>) -> impl Iterator<Item = Rect> + Clone {
        let radius = self.radius + 1.0;
        rings.flat_map(move |ring| {
            let far = f64::from(ring) * 0.8 * LINE;
            let (aside, above) = (0.5 * size[0] + radius + far, 0.5 * LINE + radius + far);
            let half = 0.5 * aside;
            [[0.0, -above], [aside, 0.0], [0.0, above], [-aside, 0.0]]
                .into_iter()
                .chain([[half, -above], [-half, -above], [half, above], [-half, above]])
                .chain([[aside, -above], [-aside, -above], [aside, above], [-aside, above]])
                .map(move |[x, y]| Rect::around([dot[0] + x, dot[1] + y], size))
        })
    }

    /// Samples of the line between a dot and its name.
    fn leader(&self, dot: [f64; 2], name: &Rect) -> Vec<Rect> {
        let end = name.nearest(dot);
        let length = (end[0] - dot[0]).hypot(end[1] - dot[1]);
        let samples = (length / SAMPLE).floor();
        (1..samples as i32)
            .map(|i| f64::from(i) / samples)
            .filter(|along| along * length > self.radius + SAMPLE)
            .map(|along| Rect::around([0, 1].map(|i| dot[i] + along * (end[i] - dot[i])), [0.5 * SAMPLE; 2]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ticks_of_all_that_is_drawn_come_to_an_end() {
        let (low, high) = DRAWN.into_inner();
        let axis = Axis::around([low, high].into_iter(), 100.0);
        assert!((200..300).contains(&axis.ticks().count()));
        assert!(!DRAWN.contains(&5e-324) && !DRAWN.contains(&1e308) && !DRAWN.contains(&f64::NAN));
    }

    #[test]
    fn axes_contain_all_values_between_round_numbers() {
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

    const FRAME: Rect = Rect { low: [0.0, 0.0], high: [400.0, 170.0] };

    #[test]
    fn names_are_below_their_dots_and_do_not_overlap() {
        let mut alone = Labels::new(FRAME, [[200.0, 100.0]].into_iter(), 2.0);
        let spot = alone.place([200.0, 100.0], "table-3").unwrap();
        assert_eq!(spot.anchor[0], 200.0);
        assert!(spot.anchor[1] < 98.0 && spot.leader.is_none());

        let dots: Vec<[f64; 2]> = (0..8).map(|i| [200.0 + 3.0 * f64::from(i), 90.0 + f64::from(i % 3)]).collect();
        let mut labels = Labels::new(FRAME, dots.iter().copied(), 2.0);
        let spots: Vec<Spot> = dots.iter().filter_map(|&dot| labels.place(dot, "table-3 x0.75")).collect();
        assert_eq!(spots.len(), 8, "there is room for all");
        assert!(spots.iter().any(|s| s.leader.is_some()));
        for (i, a) in labels.names.iter().enumerate() {
            assert!(a.within(&FRAME));
            assert!(labels.dots.iter().chain(&labels.names[..i]).all(|b| !a.overlaps(b)));
        }
    }

    #[test]
    fn a_name_without_room_is_left_out() {
        let mut labels = Labels::new(Rect { low: [0.0; 2], high: [20.0; 2] }, [[10.0; 2]].into_iter(), 2.0);
        assert!(labels.place([10.0; 2], "far too long a name").is_none());
    }
}
