//! Comparing range tables: the chosen few side by side.

use glam::DVec3;

use super::colour_map::{ColourMap, Range};
use super::colours;
use super::error::RecordError;
use super::legend::caption;
use super::meshes;
use super::open::Open;
use super::paths;
use super::step::{Overlay, covering};
use crate::figures::LevelCount;
use crate::parts::UNASSIGNED;

/// One of two to six results shown side by side, each in a view of its own with the same eye.
#[derive(Debug, Clone, Copy)]
pub struct Chosen<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Place from the left, from 0; the layout's `compare` names it.
    pub slot: usize,
    /// What is written below it (`86 PARTs · 1.2 ms · 12 mm`).
    pub caption: &'a str,
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// PART of each vertex: their colours, where there is no overlay.
    pub part_of_vertex: &'a [u32],
    /// The levels that made them, for their hues.
    pub levels: &'a [LevelCount],
    /// A value per vertex shown instead, over the range the caller shares between the slots.
    pub overlay: Option<(Overlay<'a>, Range)>,
}

pub(super) fn chosen(open: &Open, chosen: &Chosen<'_>) -> Result<(), RecordError> {
    let lists = [("positions", chosen.draped.len()), ("PART numbers", chosen.part_of_vertex.len())];
    RecordError::unless_per_vertex(open.garment.positions.len(), &lists)?;
    let path = format!("{}/{}/garment", paths::COMPARE, chosen.slot);
    let draped = open.garment.with_positions(chosen.draped.to_vec());
    open.at(chosen.index, 6);
    if let Some((overlay, range)) = &chosen.overlay {
        open.triangles_once(&path)?;
        let shades = ColourMap::ALARM.colours(overlay.values, *range);
        open.log(&path, &meshes::shape(&draped).with_vertex_colors(meshes::rerun_colours(shades)))?;
    } else {
        let cells = meshes::CellMesh::new(&draped);
        let known = chosen.part_of_vertex.iter().filter(|p| **p != UNASSIGNED);
        let part_of_vertex = covering(chosen.part_of_vertex, known.max().map_or(0, |&p| p as usize + 1));
        let parts = part_of_vertex.iter().max().map_or(0, |&p| p as usize + 1);
        let triangles = &open.garment.triangles;
        let of_part = colours::colour_parts(&part_of_vertex, parts, chosen.levels, triangles, &open.vertex_shade);
        let shade = |v: u32| of_part.colour[part_of_vertex[v as usize] as usize];
        let shades = meshes::rerun_colours(cells.owner.iter().map(|&v| shade(v)));
        open.log(&path, &cells.shape().with_vertex_colors(shades))?;
    }
    caption(open, &format!("{}/{}", paths::COMPARE_CAPTIONS, chosen.slot), chosen.caption, [chosen.slot, 0])
}
