//! Garments worn over each other, each in a branch of its own: its PARTs, their forces and its drape.

use glam::DVec3;
use rerun::Mesh3D;

use super::colour_map::{ColourMap, Rgb};
use super::meshes::{self, CellMesh};
use super::step::FORCE_QUANTILE;
use super::{Open, Range, RecordError, colours, paths};
use crate::scene::Layer;

/// What the garments of an outfit do. Slices are per vertex of all of them.
#[derive(Debug, Clone, Copy)]
pub struct OutfitView<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Magnitude of the force on each vertex's PART, N.
    pub force_n: &'a [f64],
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
}

/// The branch of garment number `k`.
pub(super) fn branch(k: usize, worn: &Layer) -> String {
    format!("{}/{}-{}", paths::OUTFIT, k + 1, worn.name)
}

pub(super) fn log(open: &Open, view: &OutfitView<'_>) -> Result<(), RecordError> {
    let n = open.garment.positions.len();
    RecordError::unless_per_vertex(n, &[("forces", view.force_n.len()), ("displaced positions", view.draped.len())])?;
    let force = open.scale("force", || Range::to_quantile(view.force_n.iter().copied(), FORCE_QUANTILE));
    let force = ColourMap::FORCE.colours(view.force_n, force);
    for (k, worn) in open.layout().outfit.iter().enumerate() {
        let branch = branch(k, worn);
        let cut_out = |x: &[DVec3]| worn.cut_out(&open.garment.triangles, x);
        let placed = CellMesh::new(&cut_out(&open.garment.positions));
        let coloured = |of: &[Rgb]| -> Mesh3D {
            let own = &of[worn.vertices.clone()];
            placed.shape().with_vertex_colors(meshes::rerun_colours(placed.of_vertices(|v| own[v as usize])))
        };
        if open.vertex_colour.len() == n {
            open.at(view.index, 3);
            open.log(&format!("{branch}/parts"), &coloured(&open.vertex_colour))?;
        }
        open.at(view.index, 4);
        open.log(&format!("{branch}/force"), &coloured(&force))?;
        open.at(view.index, 5);
        open.log(&format!("{branch}/drape"), &meshes::plain(&cut_out(view.draped), colours::of_layer(k)))?;
    }
    Ok(())
}
