//! The report of an import: counts, repairs and remarks, as text and as JSON.

use std::fmt;

use serde::Serialize;

use super::frame::{Axis, Frame, Unit};

/// A change made by the import.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum Repair {
    /// Faces with more than three corners were cut.
    #[error("cut {quads} quads and {larger} larger polygons into triangles")]
    PolygonsCut { quads: usize, larger: usize },
    /// Vertices at the same place were welded on request.
    #[error("joined {vertices} vertices to another at the same place, as asked")]
    Welded { vertices: usize },
    /// Vertices that the format stores once for each normal or texture coordinate were merged.
    #[error("merged {vertices} vertices with another at the same position, which the format stores for each corner")]
    Merged { vertices: usize },
    /// Triangles that name a vertex twice were dropped.
    #[error("dropped {triangles} triangles that name the same vertex twice")]
    DegenerateDropped { triangles: usize },
    /// Triangles without area in the rest shape were dropped; `first` is the file's face, from 1, of the first.
    #[error("dropped {triangles} triangles that have no area at rest, the first of face {first}")]
    NoAreaDropped { triangles: usize, first: usize },
    /// Triangles of the same three vertices as an earlier one were dropped.
    #[error("dropped {triangles} triangles that were there already")]
    DuplicatesDropped { triangles: usize },
    /// Connected parts that coincide with another were left out.
    #[error(
        "left out {parts} connected parts, {triangles} triangles, that lie exactly on another, as if they were there twice; an export moves them with it"
    )]
    #[serde(rename = "twins_dropped")]
    DuplicatePartsDropped { parts: usize, triangles: usize },
    /// Vertices that no face uses were dropped.
    #[error("dropped {vertices} vertices that no face uses")]
    UnusedDropped { vertices: usize },
    /// Triangles were turned round to agree with their neighbours.
    #[error("turned {triangles} triangles round to agree with their neighbours")]
    WindingTurned { triangles: usize },
    /// Parts of the surface were turned inside out to face outward.
    #[error("turned {components} connected parts inside out, so that they face outward")]
    TurnedOutward { components: usize },
    /// Triangles that bridge open seams were given the size of the others at rest.
    #[error(
        "took {triangles} triangles up to {:.0} cm long, where most sides are {:.1} cm, for bridges over open seams, which \
         are as short as the others at rest and left out of strains (--rest own: as they are)",
        1e2 * .longest_m,
        1e2 * .usual_m
    )]
    BridgesShut { triangles: usize, longest_m: f64, usual_m: f64 },
    /// Open seams were drawn shut over the body.
    #[error(
        "drew open seams, bridged by triangles up to {:.0} cm long, shut over the body in {steps} steps; a vertex went up to {:.0} cm{}",
        1e2 * .longest_m,
        1e2 * .farthest_m,
        if *.held > 0 { "; no shoulders to hang from: held by its top edge until it is at rest, then released" } else { "" }
    )]
    SeamsDrawnShut { longest_m: f64, steps: usize, farthest_m: f64, held: usize },
    /// Faces outside the chosen group were left out.
    #[error("took group \"{name}\" and left {left_out} faces out")]
    GroupChosen { name: String, left_out: usize },
}

/// An irregularity that the import left unchanged.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum Remark {
    /// Vertices at the place of another, not joined.
    #[error(
        "{vertices} vertices lie exactly on another; they were not joined (--weld joins them), so the surface may come \
         apart there"
    )]
    Coincident { vertices: usize },
    /// Edges of three triangles and more.
    #[error("{edges} edges belong to three triangles or more")]
    NonManifold { edges: usize },
    /// Vertices where the boundary meets itself.
    #[error("the boundary touches itself at {vertices} vertices")]
    Pinched { vertices: usize },
    /// Neighbours that cannot agree on a side.
    #[error("{patches} patches have one side only; their winding was left as it is")]
    OneSided { patches: usize },
    /// Triangles without area.
    #[error("{triangles} triangles have no area")]
    NoArea { triangles: usize },
    /// Triangles much longer than high.
    #[error(
        "{triangles} triangles are slivers, less than a fiftieth of their longest side high; they bear loads as if they \
         were that high"
    )]
    Slivers { triangles: usize },
    /// Triangles of another size at rest than as worn; `first` is the file's face, from 1, of the one with the largest ratio.
    #[error(
        "{triangles} triangles are of another size at rest than as worn, the farthest off in face {first}: {rest_m:.3} m \
         long at rest, {worn_m:.3} m as worn; is the pattern torn there?"
    )]
    OtherThanWorn { triangles: usize, first: usize, rest_m: f64, worn_m: f64 },
    /// The body has a boundary.
    #[error(
        "the body is open: {edges} boundary edges in {loops} loops; inside and outside go by the normals alone, which is \
         unreliable near the holes"
    )]
    Open { edges: usize, loops: usize },
    /// Points and lines, passed over.
    #[error("passed over {count} points and lines given as faces")]
    SmallFaces { count: usize },
    /// The unit or the axis that the format prescribes does not fit.
    #[error("{format} is in {declared_unit}, {declared_up} up, and this file is not: it was taken in {unit}, {up} up")]
    OtherThanDeclared { format: &'static str, declared_unit: Unit, declared_up: Axis, unit: Unit, up: Axis },
    /// Elements and properties of no known name, passed over.
    #[error("passed over {}", crate::base::files::listed(.names))]
    Ignored { names: Vec<String> },
    /// Lines of no known keyword, passed over.
    #[error("passed over {count} lines of no known keyword, the first on line {line}: \"{text}\"")]
    UnknownLines { count: usize, line: usize, text: String },
}

/// The report of an imported mesh.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names are the documentation")]
pub struct MeshReport {
    pub file: String,
    /// Unit and axes of the file.
    pub frame: Frame,
    pub vertices: usize,
    pub triangles: usize,
    /// Faces they came from.
    pub faces: usize,
    pub components: usize,
    pub groups: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Loops they form.
    pub boundary_loops: usize,
    /// Changes made.
    pub repairs: Vec<Repair>,
    /// Irregularities left unchanged.
    pub remarks: Vec<Remark>,
}

impl MeshReport {
    /// Whether the surface has no boundary.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0
    }
}

/// "1 group", "2 groups".
fn counted(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} vertices, {} triangles from {} faces, {}, {}, {}",
            self.file,
            self.vertices,
            self.triangles,
            self.faces,
            counted(self.components, "connected part"),
            counted(self.groups, "group"),
            if self.is_closed() { "closed".to_owned() } else { counted(self.boundary_loops, "boundary loop") }
        )?;
        writeln!(f, "  {} ({} up): {}", self.frame.unit, self.frame.up, self.frame.reason)?;
        self.repairs.iter().try_for_each(|repair| writeln!(f, "  {repair}"))?;
        self.remarks.iter().try_for_each(|remark| writeln!(f, "  note: {remark}"))
    }
}
