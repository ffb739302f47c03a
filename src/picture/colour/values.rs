//! Per-vertex values of a drape in the colours of a recording, for meshes that are exported or logged by others. It is independent of
//! Rerun.

use glam::DVec3;

use super::map::{ColourMap, Range};
use super::palette::{by_parts, opaque};
use crate::drape::Drape;
use crate::mesh::TriMesh;
use crate::study::metrics::LevelCount;

/// Values above this quantile share the last colour.
pub(crate) const QUANTILE: f64 = 0.99;
/// Forces above this quantile share the last colour: a PART of one vertex may have any force.
pub(crate) const FORCE_QUANTILE: f64 = 0.95;

/// A value per vertex of the draped garment.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// `error`, or a name of the fit: `strain`, `pressure`.
    pub name: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// One value per vertex.
    pub values: &'a [f64],
    /// Positions to draw it at, m, if not those of the draped garment.
    pub positions: Option<&'a [DVec3]>,
}

impl Overlay<'_> {
    /// The range of the colour map. It has a lower bound, so that a small value does not look like a large one.
    pub(crate) fn own_range(&self) -> Range {
        let least = match self.name {
            "error" | "folds" => 10.0,
            "strain" => 5.0,
            "pressure" => 0.1,
            _ => 0.0,
        };
        let own = Range::to_quantile(self.values.iter().copied(), QUANTILE);
        Range { high: own.high.max(least), ..own }
    }

    /// Colour of each vertex of an exported mesh: red, green, blue and opacity.
    pub(crate) fn vertex_colours(&self) -> Vec<[u8; 4]> {
        ColourMap::ALARM.colours(self.values, self.own_range()).into_iter().map(opaque).collect()
    }
}

/// The colour of each vertex of a drape by `quantity`, as in a recording: `distance`, `parts`, `force`, `strain`, `pressure` or `folds`.
/// `None` for another name, and for a quantity that the model does not compute.
pub(crate) fn of_drape(garment: &TriMesh, drape: &Drape, quantity: &str) -> Option<Vec<[u8; 4]>> {
    let mapped = |map: ColourMap, values: &[f64], share| {
        let range = Range::to_quantile(values.iter().copied(), share);
        map.colours(values, range).into_iter().map(opaque).collect()
    };
    let parts = &drape.parts;
    let fit = drape.state.as_ref().map(|state| &state.fit);
    let overlay = |name, unit, values| Overlay { name, unit, values, positions: None }.vertex_colours();
    match quantity {
        "distance" => {
            let cm: Vec<f64> = drape.distance.iter().map(|m| 100.0 * m).collect();
            Some(mapped(ColourMap::DISTANCE, &cm, QUANTILE))
        }
        "parts" => {
            let levels = LevelCount::all(&drape.table, parts);
            Some(by_parts(garment, &parts.part_of_vertex, parts.len(), &levels))
        }
        "force" => {
            let of = |&part: &u32| drape.outcomes.get(part as usize).map_or(0.0, |outcome| outcome.force_n.length());
            let newtons: Vec<f64> = parts.part_of_vertex.iter().map(of).collect();
            Some(mapped(ColourMap::FORCE, &newtons, FORCE_QUANTILE))
        }
        "strain" => fit.map(|fit| overlay("strain", "%", &fit.strain_percent)),
        "pressure" => fit.map(|fit| overlay("pressure", "kPa", &fit.pressure_kpa)),
        "folds" => drape.folds.as_ref().map(|folds| overlay("folds", "%", &folds.excess_percent)),
        _ => None,
    }
}
