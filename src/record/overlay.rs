//! Values on the draped garment, in colours that stand for the same from step to step.

use super::colour_map::ColourMap;
use super::legend::{Cell, Legend};
use super::{Open, Range, RecordError, meshes};
use crate::mesh::TriMesh;

/// Values above this quantile share the last colour.
pub(super) const QUANTILE: f64 = 0.99;

/// A value per vertex of the draped garment.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// `error`, or what the recording's layout lists under fit (`strain`, `pressure`).
    pub name: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// One value per vertex.
    pub values: &'a [f64],
}

/// The least that a colour map's upper end stands for: under it a small value would look like a large one.
fn least(quantity: &str) -> f64 {
    match quantity {
        "error" => 10.0,
        "strain" => 5.0,
        "folds" => 10.0,
        "pressure" => 0.1,
        _ => 0.0,
    }
}

/// The range of an overlay's colours, fixed by its first step.
pub(super) fn scale(open: &Open, overlay: &Overlay<'_>) -> Range {
    open.scale(overlay.name, || own_range(overlay))
}

/// The range that an overlay would have alone.
pub(super) fn own_range(overlay: &Overlay<'_>) -> Range {
    let own = Range::to_quantile(overlay.values.iter().copied(), QUANTILE);
    Range { high: own.high.max(least(overlay.name)), ..own }
}

/// Values on the draped garment: `{branch}/garment`, and a colour bar where `legend` says.
pub(super) fn overlay(
    open: &Open,
    branch: &str,
    draped: &TriMesh,
    overlay: &Overlay<'_>,
    (legend, cell): (&str, Cell),
) -> Result<(), RecordError> {
    let path = format!("{branch}/garment");
    open.triangles_once(&path)?;
    let range = scale(open, overlay);
    let map = ColourMap::ALARM;
    let coloured = meshes::shape(draped).with_vertex_colors(meshes::rerun_colours(map.colours(overlay.values, range)));
    open.log(&path, &coloured)?;
    let open_end = overlay.values.iter().any(|&v| v > range.high);
    Legend { title: overlay.name, unit: overlay.unit, map, range, open_end }.log(open, legend, cell)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::RecordOptions;

    #[test]
    fn colours_stand_for_the_same_in_every_step_and_a_small_error_is_no_alarm() {
        let open = Open::new(RecordOptions::default()).unwrap();
        let error = |values| Overlay { name: "error", unit: "mm", values };
        let first = scale(&open, &error(&[0.0, 40.0]));
        assert!(first.high >= 40.0);
        assert_eq!(scale(&open, &error(&[0.0, 0.4])), first);
        assert!(own_range(&error(&[0.0, 0.4])).high >= 10.0, "0.4 mm would be painted red");
    }
}
