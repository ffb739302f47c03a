//! A draped garment and its values, and the figures that show them.

use std::borrow::Cow;

use glam::DVec3;

use super::figure::Figure;
use super::raster::{Paint, Surface};
use super::viewpoint::Viewpoint;
use crate::mesh::TriMesh;
use crate::picture::colour::legend::{ColourBar, Legend, level_bar};
use crate::picture::colour::map::{ColourMap, Range, Rgb};
use crate::picture::colour::palette::{CLOTH, by_component, by_parts};
use crate::picture::colour::{FORCE_QUANTILE, Overlay, QUANTILE};
use crate::study::metrics::LevelCount;

/// The body: light beside a white ground, and unlike any shade of a PART.
const BODY: Rgb = [205, 198, 191];

/// The colours of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// The draped garment, a colour for each layer.
    Drape,
    /// The garment as placed.
    Placed,
    /// Distance to the body, on the garment as placed.
    Distance,
    /// PARTs, on the draped garment.
    Parts,
    /// Force on each PART, on the draped garment.
    Force,
    /// Largest strain.
    Strain,
    /// Pressure on the body.
    Pressure,
    /// Excess length.
    Folds,
    /// Distance to the reference drape.
    Error,
}

impl Quantity {
    /// All of them, in the order of a run.
    pub(crate) const ALL: [Self; 9] = [
        Self::Drape,
        Self::Placed,
        Self::Distance,
        Self::Parts,
        Self::Force,
        Self::Strain,
        Self::Pressure,
        Self::Folds,
        Self::Error,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Drape => "drape",
            Self::Placed => "placed",
            Self::Distance => "distance",
            Self::Parts => "parts",
            Self::Force => "force",
            Self::Strain => "strain",
            Self::Pressure => "pressure",
            Self::Folds => "folds",
            Self::Error => "error",
        }
    }

    /// The caption of a figure.
    fn caption(self) -> &'static str {
        match self {
            Self::Placed => "as placed",
            Self::Parts => "PARTs",
            Self::Force => "force per PART",
            other => other.name(),
        }
    }
}

/// A draped garment and its values.
#[derive(Debug, Clone)]
pub(crate) struct Subject<'a> {
    pub(crate) body: &'a TriMesh,
    /// The garment as placed.
    pub(crate) placed: &'a TriMesh,
    pub(crate) draped: TriMesh,
    /// Angle from −y to the front of the body, radians.
    pub(crate) facing: f64,
    /// Distance of each vertex to the body as placed, m.
    pub(crate) distances_m: &'a [f64],
    pub(crate) levels: Vec<LevelCount>,
    pub(crate) part_of_vertex: &'a [u32],
    pub(crate) part_force_n: Cow<'a, [DVec3]>,
    /// Further values per vertex, by name.
    pub(crate) overlays: Vec<Overlay<'a>>,
    /// The panels of a pattern laid out, and the garment's vertex of each of theirs.
    pub(crate) flat: Option<(TriMesh, Vec<u32>)>,
}

/// A value per vertex with its colours.
struct Field<'a> {
    values: Cow<'a, [f64]>,
    title: &'a str,
    unit: &'a str,
    map: ColourMap,
    range: Range,
    /// Whether all vertices of a PART share a value.
    of_parts: bool,
}

impl Subject<'_> {
    /// The values of a quantity; `None` where it has none or they were not computed.
    fn field(&self, quantity: Quantity) -> Option<Field<'_>> {
        let field = |values: Vec<f64>, title, unit, map, share| {
            let range = Range::to_quantile(values.iter().copied(), share);
            Some(Field { values: values.into(), title, unit, map, range, of_parts: quantity == Quantity::Force })
        };
        match quantity {
            Quantity::Drape | Quantity::Placed | Quantity::Parts => None,
            Quantity::Distance => {
                let cm = self.distances_m.iter().map(|m| 100.0 * m).collect();
                field(cm, "distance", "cm", ColourMap::DISTANCE, QUANTILE)
            }
            Quantity::Force => {
                let of = |&part: &u32| self.part_force_n.get(part as usize).map_or(0.0, |force| force.length());
                let newtons = self.part_of_vertex.iter().map(of).collect();
                field(newtons, "|F|", "N", ColourMap::FORCE, FORCE_QUANTILE)
            }
            _ => {
                let overlay = self.overlays.iter().find(|overlay| overlay.name == quantity.name())?;
                let (values, range) = (overlay.values.into(), overlay.own_range());
                let Overlay { name, unit, .. } = *overlay;
                Some(Field { values, title: name, unit, map: ColourMap::ALARM, range, of_parts: false })
            }
        }
    }

    /// Whether a quantity can be shown.
    pub(crate) fn has(&self, quantity: Quantity) -> bool {
        matches!(quantity, Quantity::Drape | Quantity::Placed | Quantity::Parts) || self.field(quantity).is_some()
    }

    /// The colours of the garment's vertices, and their bar. `high` is the upper end of the range.
    fn paint(&self, quantity: Quantity, high: Option<f64>) -> (Paint, Option<ColourBar>) {
        if let Some(Field { values, title, unit, map, range, of_parts }) = self.field(quantity) {
            let range = Range { high: high.unwrap_or(range.high), ..range };
            let colours = map.colours(&values, range);
            let bar = Legend::new(title, unit, map, range, &values).bar();
            return (if of_parts { Paint::Cells(colours) } else { Paint::Blended(colours) }, Some(bar));
        }
        match quantity {
            Quantity::Parts => {
                let colours = by_parts(self.placed, self.part_of_vertex, self.part_force_n.len(), &self.levels);
                let colours = colours.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
                (Paint::Cells(colours), level_bar(&self.levels))
            }
            Quantity::Placed => (Paint::Plain(CLOTH), None),
            _ => (Paint::Cells(by_component(self.placed)), None),
        }
    }

    /// The figure of a quantity. `high` is the upper end of its colours, by default its own.
    pub(crate) fn figure(&self, quantity: Quantity, view: Viewpoint, high: Option<f64>) -> Figure<'_> {
        let (paint, bar) = self.paint(quantity, high);
        let caption = match view {
            Viewpoint::From(_) => format!("{} from {view}", quantity.caption()),
            side => format!("{}, {side}", quantity.caption()),
        };
        if let (Viewpoint::Flat, Some((flat, garment_vertex))) = (view, &self.flat) {
            let of = |colours: Vec<Rgb>| garment_vertex.iter().map(|&v| colours[v as usize]).collect();
            let paint = match paint {
                Paint::Plain(colour) => Paint::Plain(colour),
                Paint::Blended(colours) => Paint::Blended(of(colours)),
                Paint::Cells(colours) => Paint::Cells(of(colours)),
            };
            return Figure { garment: Surface::new(flat, paint), body: None, toward: DVec3::NEG_Y, caption, bar };
        }
        let garment =
            if matches!(quantity, Quantity::Distance | Quantity::Placed) { self.placed } else { &self.draped };
        let toward = match view {
            Viewpoint::From(direction) => direction,
            side => side.toward(self.facing),
        };
        let body = Some(Surface::new(self.body, Paint::Plain(BODY)));
        Figure { garment: Surface::new(garment, paint), body, toward, caption, bar }
    }

    /// The upper end of a quantity's colours over several subjects, so that they compare.
    pub(crate) fn common_high(subjects: &[Self], quantity: Quantity) -> Option<f64> {
        subjects.iter().filter_map(|subject| Some(subject.field(quantity)?.range.high)).reduce(f64::max)
    }
}
