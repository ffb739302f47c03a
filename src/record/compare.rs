//! Comparing range tables: the chosen few side by side.

use glam::DVec3;

use super::colour_map::ColourMap;
use super::legend::{Legend, caption};
use super::step::covering;
use super::{Open, Overlay, Range, RecordError, colours, meshes, paths};
use crate::parts::UNASSIGNED;
use crate::study::metrics::LevelCount;

/// One of two to six results shown side by side, each in a view of its own with the same eye.
#[derive(Debug, Clone, Copy)]
pub struct Chosen<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Place from the left, from 0; the layout's `compare` names it.
    pub slot: usize,
    /// What is written below it (`86 PARTs · 1.2 ms · 12 mm`); nothing where it is empty.
    pub caption: &'a str,
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// What it is coloured by.
    pub colours: Colours<'a>,
}

/// What a garment shown side by side with others is coloured by.
#[derive(Debug, Clone, Copy)]
pub enum Colours<'a> {
    /// Its PARTs.
    Parts {
        /// PART of each vertex.
        part_of_vertex: &'a [u32],
        /// The levels that made them, for their hues.
        levels: &'a [LevelCount],
    },
    /// A value per vertex, over the range the caller shares between the slots.
    Overlay(Overlay<'a>, Range),
}

pub(super) fn chosen(open: &Open, chosen: &Chosen<'_>) -> Result<(), RecordError> {
    let (what, values) = match &chosen.colours {
        Colours::Parts { part_of_vertex, .. } => ("PART numbers", part_of_vertex.len()),
        Colours::Overlay(overlay, _) => (overlay.name, overlay.values.len()),
    };
    let lists = [("positions", chosen.draped.len()), (what, values)];
    RecordError::unless_per_vertex(open.garment.positions.len(), &lists)?;
    let [columns, _] = open.layout().captions(&open.eye);
    let path = format!("{}/{}/garment", paths::COMPARE, chosen.slot);
    let draped = open.garment.with_positions(chosen.draped.to_vec());
    open.at(chosen.index, 6);
    match chosen.colours {
        Colours::Overlay(overlay, range) => {
            open.triangles_once(&path)?;
            let shades = ColourMap::ALARM.colours(overlay.values, range);
            open.log(&path, &meshes::shape(&draped).with_vertex_colors(meshes::rerun_colours(shades)))?;
            let bar = format!("{}/colours", paths::COMPARE_CAPTIONS);
            if open.first_use(&bar) {
                let Overlay { name: title, unit, .. } = overlay;
                let legend = Legend { title, unit, map: ColourMap::ALARM, range, open_end: true };
                legend.log(open, &bar, [0, 0])?;
            }
        }
        Colours::Parts { part_of_vertex, levels } => {
            let cells = meshes::CellMesh::new(&draped);
            let known = part_of_vertex.iter().filter(|p| **p != UNASSIGNED);
            let part_of_vertex = covering(part_of_vertex, known.max().map_or(0, |&p| p as usize + 1));
            let parts = part_of_vertex.iter().max().map_or(0, |&p| p as usize + 1);
            let triangles = &open.garment.triangles;
            let of_part = colours::colour_parts(&part_of_vertex, parts, levels, triangles, &open.vertex_shade);
            let shade = |v: u32| of_part.colour[part_of_vertex[v as usize] as usize];
            let shades = meshes::rerun_colours(cells.owner.iter().map(|&v| shade(v)));
            open.log(&path, &cells.shape().with_vertex_colors(shades))?;
        }
    }
    if chosen.caption.is_empty() {
        return Ok(());
    }
    let place = [chosen.slot % columns, chosen.slot / columns];
    caption(open, &format!("{}/{}", paths::COMPARE_CAPTIONS, chosen.slot), chosen.caption, place)
}
