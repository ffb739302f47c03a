//! The displaced garment as a file, coloured if asked.

use std::path::Path;

use crate::mesh::glb::write_glb;
use crate::record::{Overlay, by_parts};
use clap::ValueEnum;

use super::super::solved::Solved;
use crate::commands::UserError;

/// What the vertices of a displaced garment are coloured by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportColours {
    /// Its PARTs: the hue says the level
    Parts,
    /// Largest strain, %
    Strain,
    /// Pressure on the body, kPa
    Pressure,
    /// Excess length that folds take up, %
    Folds,
}

/// Refuses colours where the file has no place for them, before anything is computed.
pub(super) fn refuse(export: Option<&Path>, colours: Option<ExportColours>) -> anyhow::Result<()> {
    let glb = export.and_then(Path::extension).is_some_and(|ending| ending.eq_ignore_ascii_case("glb"));
    match (export, colours) {
        (Some(path), Some(_)) if !glb => Err(UserError::new(format!(
            "{}: found --export-colours for an OBJ, which has no colours, expected a name that ends in `.glb`",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// Writes the displaced garment of a run.
pub(super) fn write(solved: &Solved, path: &Path, colours: Option<ExportColours>) -> anyhow::Result<()> {
    let (scene, drape) = (&solved.loaded.scene, &solved.drape);
    let Some(colours) = colours else { return Ok(solved.loaded.write(path, &drape.positions)?) };
    let overlays = solved.overlays();
    let of = |name: &str| {
        let overlay = overlays.iter().find(|overlay| overlay.name == name);
        overlay.map(Overlay::vertex_colours).ok_or_else(|| {
            UserError::new(format!(
                "{}: found no {name} to colour it by, which this model does not tell; expected --export-colours parts, or --model coupled",
                path.display()
            ))
        })
    };
    let colours = match colours {
        ExportColours::Parts => {
            let levels = solved.summary.panel().levels;
            by_parts(&scene.garment, &drape.parts.part_of_vertex, drape.parts.len(), &levels)
        }
        ExportColours::Strain => of("strain")?,
        ExportColours::Pressure => of("pressure")?,
        ExportColours::Folds => of("folds")?,
    };
    Ok(write_glb(path, &scene.garment.with_positions(drape.positions.clone()), Some(&colours))?)
}
