//! Comparing range tables: the chosen few side by side, and speed against error of all.

use glam::DVec3;
use rerun::{Color, LineStrips2D, Points2D};

use super::colour_map::{ColourMap, Range};
use super::colours;
use super::error::RecordError;
use super::legend::{TEXT, number, texts};
use super::meshes::{self, single};
use super::open::Open;
use super::paths;
use super::step::Overlay;

/// One of two to six results shown side by side, each in a view of its own with the same eye.
#[derive(Debug, Clone, Copy)]
pub struct Chosen<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Place from the left, from 0; the layout's `compare` names it.
    pub slot: usize,
    /// What stands under it (`86 PARTs · 1.2 ms · 12 mm`).
    pub caption: &'a str,
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// PART of each vertex: their colours, where there is no overlay.
    pub part_of_vertex: &'a [u32],
    /// A value per vertex shown instead, over the range the caller shares between the slots.
    pub overlay: Option<(Overlay<'a>, Range)>,
}

pub(super) fn chosen(open: &Open, chosen: &Chosen<'_>) -> Result<(), RecordError> {
    let expected = open.garment.positions.len();
    for (what, found) in [("positions", chosen.draped.len()), ("PART numbers", chosen.part_of_vertex.len())] {
        if found != expected {
            let (what, of) = (format!("{what} of slot {}", chosen.slot), "vertices of the garment");
            return Err(RecordError::Mismatch { what, found, expected, of });
        }
    }
    let branch = format!("{}/{}", paths::COMPARE, chosen.slot);
    let path = format!("{branch}/garment");
    let draped = open.garment.with_positions(chosen.draped.to_vec());
    open.at(chosen.index, 6);
    if let Some((overlay, range)) = &chosen.overlay {
        open.triangles_once(&path)?;
        let shades = ColourMap::ALARM.colours(overlay.values, *range);
        open.log(&path, &meshes::shape(&draped).with_vertex_colors(meshes::rerun_colours(shades)))?;
    } else {
        let cells = meshes::CellMesh::new(&draped);
        let parts = chosen.part_of_vertex.iter().max().map_or(0, |&p| p as usize + 1);
        let palette = colours::palette();
        let of_part = colours::colour_parts(chosen.part_of_vertex, parts, &open.garment.triangles, &open.vertex_colour);
        let shade = |v: u32| palette[of_part[chosen.part_of_vertex[v as usize] as usize] as usize];
        let shades = meshes::rerun_colours(cells.owner.iter().map(|&v| shade(v)));
        open.log(&path, &cells.shape().with_vertex_colors(shades))?;
    }
    let eye = &open.eye;
    let below = eye.half_height + 0.1 * eye.half_height.max(eye.half_width);
    let place = eye.centre + eye.toward * eye.half_depth - eye.up * below;
    open.log(&format!("{branch}/caption"), &texts(vec![single(place)], vec![chosen.caption.to_owned()]))
}

/// One table, or any other setting, in the picture of speed against error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterPoint<'a> {
    /// Its name.
    pub label: &'a str,
    /// What it costs: time in ms, or whatever else the axis is called.
    pub cost: f64,
    /// Error, mm.
    pub error_mm: f64,
    /// Points of one group share a colour; the front, say, against the rest.
    pub group: usize,
    /// Whether its name is written beside it.
    pub named: bool,
}

/// The moment a picture belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// A step of the timeline `table`.
    Table(i64),
    /// A step of the timeline `iteration`: a search.
    Iteration(i64),
}

/// Width and height of the picture, in its own units.
const PICTURE: [f64; 2] = [440.0, 170.0];

/// A logarithmic axis over whole decades.
struct Axis {
    first: i32,
    last: i32,
    length: f64,
}

impl Axis {
    fn place(&self, value: f64) -> f64 {
        (value.log10() - f64::from(self.first)) / f64::from(self.last - self.first) * self.length
    }

    /// 1 to 9 times each power of ten, and the last power.
    fn ticks(&self) -> impl Iterator<Item = (i32, f64)> {
        let inner = (self.first..self.last).flat_map(|d| (1..10).map(move |m| (m, f64::from(m) * 10f64.powi(d))));
        inner.chain(std::iter::once((1, 10f64.powi(self.last))))
    }
}

/// Both axes are logarithmic and span whole decades. Points that are not positive and finite cannot be placed and are left
/// out.
pub(super) fn scatter(open: &Open, when: When, cost: &str, points: &[ScatterPoint<'_>]) -> Result<(), RecordError> {
    match when {
        When::Table(index) => open.at(index, 6),
        When::Iteration(iteration) => open.at_iteration(iteration),
    }
    let placed: Vec<&ScatterPoint<'_>> = points
        .iter()
        .filter(|p| p.cost.is_finite() && p.error_mm.is_finite() && p.cost > 0.0 && p.error_mm > 0.0)
        .collect();
    let [width, height] = PICTURE;
    let (first, last) = decades(placed.iter().map(|p| p.cost));
    let time = Axis { first, last, length: width };
    let (first, last) = decades(placed.iter().map(|p| p.error_mm));
    let error = Axis { first, last, length: height };
    // The viewer's plane has y downwards.
    let at = |x: f64, y: f64| [x as f32, -y as f32];
    let mut lines = Vec::new();
    let mut shades = Vec::new();
    let mut places = vec![at(0.5 * width, -15.0), at(0.0, height + 13.0)];
    let mut labels = vec![cost.to_owned(), "error, mm".to_owned()];
    let mut line = |from: [f32; 2], to: [f32; 2], major: bool| {
        lines.push(vec![from, to]);
        shades.push(if major { Color::from_rgb(110, 117, 128) } else { Color::from_rgb(58, 62, 69) });
    };
    for (multiple, value) in time.ticks() {
        let x = time.place(value);
        line(at(x, 0.0), at(x, height), multiple == 1);
        if matches!(multiple, 1 | 2 | 5) {
            places.push(at(x, -3.0));
            labels.push(number(value));
        }
    }
    for (multiple, value) in error.ticks() {
        let y = error.place(value);
        line(at(0.0, y), at(width, y), multiple == 1);
        if matches!(multiple, 1 | 2 | 5) {
            places.push(at(-10.0, y + 3.5));
            labels.push(number(value));
        }
    }
    let axes = LineStrips2D::new(lines).with_colors(shades).with_radii([0.25]);
    open.log(&format!("{}/axes", paths::SCATTER), &axes)?;
    let ticks = Points2D::new(places).with_labels(labels).with_radii([0.0]).with_colors([TEXT]).with_show_labels(true);
    open.log(&format!("{}/ticks", paths::SCATTER), &ticks)?;
    let palette = colours::palette();
    let dots = Points2D::new(placed.iter().map(|p| at(time.place(p.cost), error.place(p.error_mm))))
        .with_colors(meshes::rerun_colours(placed.iter().map(|p| palette[p.group % palette.len()])))
        .with_radii([2.6])
        .with_draw_order(30.0);
    open.log(&format!("{}/points", paths::SCATTER), &dots)?;
    let named: Vec<&ScatterPoint<'_>> = placed.into_iter().filter(|p| p.named).collect();
    // The viewer writes a text under its point.
    let names = Points2D::new(named.iter().map(|p| at(time.place(p.cost), error.place(p.error_mm) - 2.5)))
        .with_labels(named.iter().map(|p| p.label))
        .with_radii([0.0])
        .with_colors([TEXT])
        .with_show_labels(true);
    open.log(&format!("{}/names", paths::SCATTER), &names)
}

/// The whole decades that hold all values; one decade where there are none.
fn decades(values: impl Iterator<Item = f64>) -> (i32, i32) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return (0, 1);
    }
    let first = low.log10().floor() as i32;
    (first, (high.log10().ceil() as i32).max(first + 1))
}

#[cfg(test)]
mod tests {
    use super::decades;

    #[test]
    fn decades_hold_all_values() {
        assert_eq!(decades([3.0, 250.0].into_iter()), (0, 3));
        assert_eq!(decades([10.0].into_iter()), (1, 2));
        assert_eq!(decades([0.02, 0.5].into_iter()), (-2, 0));
        assert_eq!(decades(std::iter::empty()), (0, 1));
    }
}
