//! Results side by side: the drapes of a few range tables or methods.

use glam::DVec3;

use super::error::RecordError;
use super::legend::{Legend, shortened, view_caption};
use super::meshes::{self, rerun_colours};
use super::open_recording::OpenRecording;
use super::paths;
use crate::parts::UNASSIGNED;
use crate::picture::colour::Overlay;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::{ColourMap, Range};
use crate::picture::colour::palette::{colour_parts, with_outside};
use crate::study::metrics::LevelCount;

/// One of two to six results side by side. All views have the same eye.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compared<'a> {
    /// Step of the timeline `table`.
    pub(crate) index: i64,
    /// Place from the left, from 0; its title is in the layout's `compare`.
    pub(crate) slot: usize,
    /// Text below the view (`86 PARTs · 1.2 ms · 12 mm`), or empty.
    pub(crate) caption: &'a str,
    /// Draped vertices, m.
    pub(crate) draped: &'a [DVec3],
    /// Colours of the garment.
    pub(crate) colours: Colours<'a>,
}

/// The colours of a garment beside others.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Colours<'a> {
    /// By PART.
    Parts {
        /// PART of each vertex.
        part_of_vertex: &'a [u32],
        /// Their levels, which determine the hues.
        levels: &'a [LevelCount],
    },
    /// By a value per vertex, over a range that all slots share.
    Overlay(Overlay<'a>, Range),
}

/// Logs one of the results.
pub(super) fn log(recording: &OpenRecording, compared: &Compared<'_>) -> Result<(), RecordError> {
    let (what, values) = match &compared.colours {
        Colours::Parts { part_of_vertex, .. } => ("PART numbers", part_of_vertex.len()),
        Colours::Overlay(overlay, _) => (overlay.name, overlay.values.len()),
    };
    recording.check_lengths(&[("positions", compared.draped.len()), (what, values)])?;
    let [columns, _] = recording.layout().captions(&recording.eye);
    let path = format!("{}/{}/garment", paths::COMPARE, compared.slot);
    let draped = recording.garment.with_positions(compared.draped.to_vec());
    recording.at(compared.index, 6);
    match compared.colours {
        Colours::Overlay(overlay, range) => {
            recording.triangles_once(&path)?;
            let map = ColourMap::ALARM;
            let colours = rerun_colours(map.colours(overlay.values, range));
            recording.log(&path, &meshes::shape(&draped).with_vertex_colors(colours))?;
            let bar = format!("{}/colours", paths::COMPARE_CAPTIONS);
            if recording.first_use(&bar) {
                let legend = Legend { title: overlay.name, unit: overlay.unit, map, range, open_end: true };
                legend.log(recording, &bar, [0, 0])?;
            }
        }
        Colours::Parts { part_of_vertex, levels } => {
            let count = |parts: &[u32]| parts.iter().filter(|p| **p != UNASSIGNED).max().map_or(0, |&p| p as usize + 1);
            let part_of_vertex = with_outside(part_of_vertex, count(part_of_vertex));
            let (parts, triangles) = (count(&part_of_vertex), &recording.garment.triangles);
            let chosen = colour_parts(&part_of_vertex, parts, levels, triangles, &recording.vertex_shade);
            let cells = CellMesh::of_values(&draped, &part_of_vertex);
            let colours = rerun_colours(cells.of_vertices(&chosen.of_vertices));
            recording.log(&path, &cells.shape().with_vertex_colors(colours))?;
        }
    }
    if compared.caption.is_empty() {
        return Ok(());
    }
    let place = [compared.slot % columns, compared.slot / columns];
    let path = format!("{}/{}", paths::COMPARE_CAPTIONS, compared.slot);
    let title = recording.layout().compare.get(compared.slot).map_or("", String::as_str);
    view_caption(recording, &path, &titled(title, compared.caption, columns), place, columns)
}

/// The caption of a view, in one of `columns`, below its title if the view's own title bar cuts that.
fn titled(title: &str, caption: &str, columns: usize) -> String {
    if title.chars().count() <= letters(columns, TITLE_BUTTONS) {
        return caption.to_owned();
    }
    format!("{}\n{caption}", shortened(title, letters(columns, CAPTION_MARGIN)))
}

/// Width of a window, its letters, what a title bar has beside the title, and the margins of a caption's box, pixels.
const WINDOW: usize = 1280;
const LETTER: usize = 7;
const TITLE_BUTTONS: usize = 110;
const CAPTION_MARGIN: usize = 20;

/// Letters that fit in one of `columns`, beside other things of this width in pixels.
fn letters(columns: usize, beside: usize) -> usize {
    (WINDOW / columns.max(1)).saturating_sub(beside) / LETTER
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_name_that_its_view_cuts_stands_in_the_caption() {
        let caption = "380 PARTs · 217 ms · 29.5 mm";
        assert_eq!(titled("table-3", caption, 6), caption);
        assert_eq!(titled("20 quantile levels, 24 cm", caption, 2), caption);
        let titled = titled("20 quantile levels, 24 cm then 12 cm", caption, 6);
        let lines: Vec<&str> = titled.lines().collect();
        assert_eq!(lines[1], caption);
        assert!(lines[0].starts_with("20 quantile") && lines[0].ends_with("then 12 cm"), "{titled}");
        assert!(lines.iter().all(|line| line.chars().count() <= letters(6, 0)), "{titled}");
    }
}
