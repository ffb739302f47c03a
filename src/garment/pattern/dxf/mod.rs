//! Sewing patterns of pattern makers' programs: DXF as ASTM D6673 and AAMA-292 have it, and a TOML file beside it.
//!
//! The DXF has the pieces: a block each, with outline, grain and notches by layer (`piece`), its name, size and quantity as texts.
//! It does not say how they are sewn, and where they lie about the body: `NAME.sewing.toml` beside `NAME.dxf` does. Without that file
//! the pieces can be drawn, with numbered edges, and not be draped.

mod drawing;
mod piece;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;

use super::panels::{EdgeAt, PanelEdge, PatternPanel, SewingPattern, Stitch, upright};
use super::{PatternError, check};
use crate::base::files::{Unreadable, bounded, has_ending, listed, read_text, stem};
use crate::base::math;
use crate::mesh::{Unit, each_once};
use drawing::{Drawing, Entity, Shape};
use piece::{Piece, text_value};

/// Longest accepted file, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Most pieces of a file, all sizes together.
const MAX_PIECES: usize = 2_000;
/// Length of the longest side of the largest piece, m: from a doll's collar to a train.
const LONGEST: std::ops::RangeInclusive<f64> = 0.05..=10.0;

/// The contents of `NAME.sewing.toml`.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Sewing {
    /// Unit of the drawing, where it states none or a wrong one.
    unit: Option<Unit>,
    /// Size to take of a file of several.
    size: Option<String>,
    panels: BTreeMap<String, Placed>,
    /// Pairs of edges, "panel.edge".
    stitches: Vec<[String; 2]>,
    /// Edges by label.
    labels: BTreeMap<String, Vec<String>>,
}

/// A panel made of a piece, and its place about the body.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Placed {
    /// Name of the piece; by default the panel's.
    piece: Option<String>,
    /// Position of the middle of the panel: to the wearer's left, up from the floor, to the front.
    at_cm: [f64; 3],
    #[serde(default)]
    side: Side,
    /// Turns in degrees about the three axes of `at_cm`, first about the first, in place of `side`.
    rotation: Option<[f64; 3]>,
    /// Turn in the plane of the panel, in degrees, counter-clockwise as drawn.
    #[serde(default)]
    turn: f64,
    /// Whether the panel is the mirror image of the piece.
    #[serde(default)]
    mirror: bool,
    /// Whether notches divide edges.
    #[serde(default)]
    notches: bool,
    /// Part of the body: `body`, `arm`, `leg`.
    label: Option<String>,
}

/// Side of the body that a panel covers.
#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Side {
    #[default]
    Front,
    Back,
    Left,
    Right,
}

impl Side {
    /// The turns that show the right side of the panel outward.
    fn rotation(self) -> [f64; 3] {
        [0.0, [0.0, 180.0, 90.0, -90.0][self as usize], 0.0]
    }
}

/// Whether a file is a DXF by its name.
pub(crate) fn is_dxf(path: &Path) -> bool {
    has_ending(path, "dxf")
}

/// The file that says how the pieces of a DXF are sewn.
pub(crate) fn sewing_file(path: &Path) -> PathBuf {
    path.with_extension("sewing.toml")
}

/// Reads the DXF at `path` and the TOML file beside it. Without that, each piece is a panel and none is sewn, unless it `must_be_sewn`.
pub(super) fn read(path: &Path, must_be_sewn: bool) -> Result<SewingPattern, PatternError> {
    let bytes = bounded(path, MAX_BYTES).map_err(|e| Unreadable::new(path, &e))?;
    if bytes.starts_with(b"AutoCAD Binary DXF") {
        return Err(PatternError::Invalid("found a binary DXF, expected one as text; export it as ASCII".to_owned()));
    }
    let beside = sewing_file(path);
    let sewing = if beside.is_file() {
        let text = read_text(&beside)?;
        let in_file = |e: toml::de::Error| PatternError::Invalid(format!("{}: {e}", beside.display()));
        Some(toml::from_str::<Sewing>(&text).map_err(in_file)?)
    } else {
        None
    };
    if must_be_sewn && sewing.is_none() {
        return Err(PatternError::Invalid(format!(
            "found no {} beside it, expected one that says which edges are sewn and where the panels lie; `partwise pattern {} --svg \
             FILE.svg` draws the pieces with the numbers of their edges",
            beside.display(),
            path.display()
        )));
    }
    let mut pattern = assemble(&String::from_utf8_lossy(&bytes), &stem(&path.display().to_string()), sewing)?;
    check::check(&mut pattern)?;
    Ok(pattern)
}

/// The pattern `name` of a DXF and, where it is sewn, of the text of the TOML file beside it.
///
/// # Errors
/// [`PatternError`] names the piece, the panel and the edge.
pub fn parse(dxf: &str, sewing: Option<&str>, name: &str) -> Result<SewingPattern, PatternError> {
    let sewing = sewing.map(toml::from_str::<Sewing>).transpose().map_err(|e| PatternError::Invalid(e.to_string()))?;
    let mut pattern = assemble(dxf, name, sewing)?;
    check::check(&mut pattern)?;
    Ok(pattern)
}

fn assemble(text: &str, name: &str, sewing: Option<Sewing>) -> Result<SewingPattern, PatternError> {
    let drawing = Drawing::parse(text)?;
    let mut notes = Vec::new();
    let unit = unit(&drawing, sewing.as_ref().and_then(|sewing| sewing.unit), &mut notes);
    let pieces = pieces(&drawing, unit, sewing.as_ref().and_then(|sewing| sewing.size.as_deref()), &mut notes)?;
    let longest = pieces.iter().map(|piece| piece.size_m().max_element()).fold(0.0, f64::max);
    if !LONGEST.contains(&longest) {
        return Err(PatternError::Invalid(format!(
            "the largest piece is {longest:.3} m long in {unit}, expected 0.05 to 10 m; name the unit by `unit = \"cm\"` in {name}.sewing.toml"
        )));
    }
    for piece in &pieces {
        notes.extend(piece.notes.iter().map(|note| format!("piece {}: {note}", piece.name)));
    }
    let is_sewn = sewing.is_some();
    let sewing = sewing.unwrap_or_else(|| Sewing {
        panels: pieces.iter().map(|piece| (piece.name.clone(), Placed::flat())).collect(),
        ..Sewing::default()
    });
    let mut pattern = SewingPattern { name: name.to_owned(), panels: Vec::new(), stitches: Vec::new(), notes };
    for (name, placed) in &sewing.panels {
        pattern.panels.push(placed.panel(name, &pieces)?);
    }
    if pattern.panels.is_empty() {
        return Err(PatternError::Invalid(format!(
            "found no [panels.NAME], expected one for each of {}",
            names(&pieces)
        )));
    }
    if is_sewn {
        pattern.notes.extend(quantities(&pieces, &sewing));
    }
    for (number, sides) in sewing.stitches.iter().enumerate() {
        let edge = |text: &String| {
            edge(text, &pattern.panels).map_err(|e| PatternError::Invalid(format!("stitch {number}: {e}")))
        };
        let sides = [edge(&sides[0])?, edge(&sides[1])?];
        if sides[0] == sides[1] {
            let found = pattern.edge_name(sides[0]);
            return Err(PatternError::Invalid(format!(
                "stitch {number}: found {found} on both sides, expected two edges"
            )));
        }
        pattern.stitches.push(Stitch { sides, right_wrong: false });
    }
    for (label, edges) in &sewing.labels {
        for text in edges {
            let at = edge(text, &pattern.panels).map_err(|e| PatternError::Invalid(format!("label {label}: {e}")))?;
            pattern.panels[at.panel].edges[at.edge].label = Some(label.clone());
        }
    }
    Ok(pattern)
}

/// The unit: the given one, else that of the texts of ASTM D6673, else that of the header, else millimetres.
fn unit(drawing: &Drawing, given: Option<Unit>, notes: &mut Vec<String>) -> Unit {
    let blocks = drawing.blocks.iter().flat_map(|block| &block.entities);
    let texts: Vec<&str> = drawing.loose.iter().chain(blocks).filter_map(text).collect();
    let stated = text_value(texts, "units").and_then(|units| match units.to_ascii_lowercase().as_str() {
        "english" | "inch" | "inches" => Some(Unit::In),
        "metric" | "mm" => Some(Unit::Mm),
        "cm" => Some(Unit::Cm),
        _ => None,
    });
    let of_header = match drawing.units {
        Some(1) => Some(Unit::In),
        Some(4) => Some(Unit::Mm),
        Some(5) => Some(Unit::Cm),
        Some(6) => Some(Unit::M),
        _ => None,
    };
    given.or(stated).or(of_header).unwrap_or_else(|| {
        notes.push("the drawing states no unit: took millimetres (`unit` in the TOML file names another)".to_owned());
        Unit::Mm
    })
}

fn text(entity: &Entity) -> Option<&str> {
    if let Shape::Text(text) = &entity.shape { Some(text) } else { None }
}

fn names(pieces: &[Piece]) -> String {
    listed(&pieces.iter().map(|piece| piece.name.clone()).collect::<Vec<_>>())
}

/// The pieces of one size.
fn pieces(
    drawing: &Drawing,
    unit: Unit,
    size: Option<&str>,
    notes: &mut Vec<String>,
) -> Result<Vec<Piece>, PatternError> {
    let mut pieces = Vec::new();
    for block in &drawing.blocks {
        pieces.extend(Piece::of(block, unit.metres())?);
        if pieces.len() > MAX_PIECES {
            return Err(PatternError::Invalid(format!(
                "found more than {MAX_PIECES} pieces, expected a sewing pattern"
            )));
        }
    }
    if pieces.is_empty() {
        let all = drawing.blocks.iter().flat_map(|block| &block.entities).chain(&drawing.loose);
        let layers = each_once(all.map(|entity| entity.layer.clone()));
        return Err(PatternError::Invalid(format!(
            "found the layers {} in {} blocks, expected blocks with lines on layer 1 (cut line) or 14 (sew line), as ASTM D6673 and AAMA \
             have them; export the pattern by one of these standards",
            listed(&layers),
            drawing.blocks.len()
        )));
    }
    let sizes = each_once(pieces.iter().filter_map(|piece| piece.size.clone()));
    let sample = text_value(drawing.loose.iter().filter_map(text), "sample size");
    let wanted = match (size.map(str::to_owned), sample) {
        _ if sizes.len() < 2 && size.is_none() => return Ok(pieces),
        (Some(size), _) => size,
        (None, Some(sample)) if sizes.contains(&sample) => {
            notes.push(format!("took size {sample}, the sample size, of {}", listed(&sizes)));
            sample
        }
        (None, _) => {
            let found = listed(&sizes);
            return Err(PatternError::Invalid(format!(
                "found the sizes {found}, expected one; name it by `size` in the TOML file"
            )));
        }
    };
    if !sizes.contains(&wanted) {
        let found = listed(&sizes);
        return Err(PatternError::Invalid(format!("found no size \"{wanted}\", expected one of {found}")));
    }
    // A piece without a size is of all.
    pieces.retain(|piece| piece.size.as_ref().is_none_or(|size| *size == wanted));
    Ok(pieces)
}

/// Notes on pieces that are cut another number of times than there are panels of them.
fn quantities(pieces: &[Piece], sewing: &Sewing) -> Vec<String> {
    let of = |piece: &&Piece| {
        let is_of = |(name, placed): &(&String, &Placed)| {
            placed.piece.as_ref().unwrap_or(name).eq_ignore_ascii_case(&piece.name)
        };
        let panels = sewing.panels.iter().filter(is_of).count();
        // "2", or left and right: "1,1".
        let quantity: Option<Vec<usize>> =
            piece.quantity.as_ref()?.split(',').map(|number| number.trim().parse().ok()).collect();
        let quantity: usize = quantity?.into_iter().fold(0, usize::saturating_add);
        let name = &piece.name;
        (panels != quantity)
            .then(|| format!("piece {name}: its quantity is {quantity}, expected {panels}, the number of its panels"))
    };
    pieces.iter().filter_map(|piece| of(&piece)).collect()
}

/// The edge that "panel.edge" names.
fn edge(text: &str, panels: &[PatternPanel]) -> Result<EdgeAt, String> {
    let (name, number) =
        text.rsplit_once('.').ok_or_else(|| format!("found \"{text}\", expected PANEL.EDGE, such as front.0"))?;
    let panel = panels.iter().position(|panel| panel.name == name).ok_or_else(|| {
        let all: Vec<String> = panels.iter().map(|panel| panel.name.clone()).collect();
        format!("found the panel \"{name}\", expected one of {}", listed(&all))
    })?;
    let count = panels[panel].edges.len();
    let edge = number.parse().ok().filter(|&edge| edge < count);
    let edge =
        edge.ok_or_else(|| format!("found edge {number} of panel {name}, expected one from 0 to {}", count - 1))?;
    Ok(EdgeAt { panel, edge })
}

impl Placed {
    /// A panel in its own plane.
    fn flat() -> Self {
        let (at_cm, side) = ([0.0; 3], Side::Front);
        Self { piece: None, at_cm, side, rotation: None, turn: 0.0, mirror: false, notches: false, label: None }
    }

    fn panel(&self, name: &str, pieces: &[Piece]) -> Result<PatternPanel, PatternError> {
        let wanted = self.piece.as_deref().unwrap_or(name);
        let piece = pieces.iter().find(|piece| piece.name.eq_ignore_ascii_case(wanted)).ok_or_else(|| {
            PatternError::Invalid(format!("panel {name}: found no piece {wanted}, expected one of {}", names(pieces)))
        })?;
        let numbers = self.at_cm.iter().chain(self.rotation.iter().flatten()).chain([&self.turn]);
        if let Some(found) = numbers.copied().find(|x| x.is_nan() || x.abs() > 1e4) {
            return Err(PatternError::unexpected(
                &format!("panel {name}"),
                &found.to_string(),
                "centimetres or degrees up to 10000",
            ));
        }
        let piece = if self.mirror { piece.clone().mirrored() } else { piece.clone() };
        let (curves, drawn) = piece.edges(self.notches);
        let edges = curves.into_iter().map(|curve| PanelEdge { curve, label: None }).collect();
        let angles = DVec3::from_array(self.rotation.unwrap_or_else(|| self.side.rotation()));
        let (rotation, translation) = upright(angles, 0.01 * DVec3::from_array(self.at_cm));
        let rotation = rotation * math::rotation(DVec3::Z, self.turn.to_radians());
        Ok(PatternPanel { name: name.to_owned(), label: self.label.clone(), edges, rotation, translation, drawn })
    }
}
