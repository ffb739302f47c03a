//! What was found in a mesh file and what was repaired, for people and for machines.

use std::fmt;

use serde::Serialize;

use super::frame::Frame;

/// Something changed on the way in.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum Repair {
    /// Faces with more than three corners were cut.
    PolygonsCut { quads: usize, larger: usize },
    /// Vertices at the same place were joined, as asked.
    Welded { vertices: usize },
    /// Triangles that name a vertex twice were dropped.
    DegenerateDropped { triangles: usize },
    /// Triangles without area in the rest shape were dropped; `first` is the file's face, from 1, of the first.
    NoAreaDropped { triangles: usize, first: usize },
    /// Triangles of the same three vertices as an earlier one were dropped.
    DuplicatesDropped { triangles: usize },
    /// Vertices that no face uses were dropped.
    UnusedDropped { vertices: usize },
    /// Triangles were turned round to agree with their neighbours.
    WindingTurned { triangles: usize },
    /// Parts of the surface were turned inside out to face outward.
    TurnedOutward { components: usize },
    /// Triangles that bridge open seams were given the size of the others at rest.
    BridgesShut { triangles: usize, longest_m: f64, usual_m: f64 },
    /// Open seams were drawn shut over the body.
    SeamsDrawnShut { longest_m: f64, steps: usize, farthest_m: f64 },
    /// A group was chosen and the rest left out.
    GroupChosen { name: String, left_out: usize },
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PolygonsCut { quads, larger } => {
                write!(f, "cut {quads} quads and {larger} larger polygons into triangles")
            }
            Self::Welded { vertices } => write!(f, "joined {vertices} vertices to another at the same place, as asked"),
            Self::DegenerateDropped { triangles } => {
                write!(f, "dropped {triangles} triangles that name the same vertex twice")
            }
            Self::NoAreaDropped { triangles, first } => {
                write!(f, "dropped {triangles} triangles that have no area at rest, the first of face {first}")
            }
            Self::DuplicatesDropped { triangles } => {
                write!(f, "dropped {triangles} triangles that were there already")
            }
            Self::UnusedDropped { vertices } => write!(f, "dropped {vertices} vertices that no face uses"),
            Self::WindingTurned { triangles } => {
                write!(f, "turned {triangles} triangles round to agree with their neighbours")
            }
            Self::TurnedOutward { components } => {
                write!(f, "turned {components} connected parts inside out, so that they face outward")
            }
            Self::BridgesShut { triangles, longest_m, usual_m } => write!(
                f,
                "took {triangles} triangles up to {:.0} cm long, where most sides are {:.1} cm, for bridges over open seams, which \
                 are as short as the others at rest (--rest own: as they are)",
                1e2 * longest_m,
                1e2 * usual_m
            ),
            Self::SeamsDrawnShut { longest_m, steps, farthest_m } => write!(
                f,
                "drew open seams, bridged by triangles up to {:.0} cm long, shut over the body in {steps} steps; a vertex went up to {:.0} cm",
                1e2 * longest_m,
                1e2 * farthest_m
            ),
            Self::GroupChosen { name, left_out } => write!(f, "took group \"{name}\" and left {left_out} faces out"),
        }
    }
}

/// Something worth knowing that was left as it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum Remark {
    /// Vertices at the place of another, not joined.
    Coincident { vertices: usize },
    /// Edges of three triangles and more.
    NonManifold { edges: usize },
    /// Vertices where the boundary meets itself.
    Pinched { vertices: usize },
    /// Neighbours that cannot agree on a side.
    OneSided { patches: usize },
    /// Triangles without area.
    NoArea { triangles: usize },
    /// Triangles much longer than high.
    Slivers { triangles: usize },
    /// Triangles of another size at rest than as worn; `first` is the file's face, from 1, of the one that is farthest off.
    OtherThanWorn { triangles: usize, first: usize, rest_m: f64, worn_m: f64 },
    /// The body has a boundary.
    Open { edges: usize, loops: usize },
    /// Points and lines, passed over.
    SmallFaces { count: usize },
    /// Lines of no known keyword, passed over.
    UnknownLines { count: usize, line: usize, text: String },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coincident { vertices } => write!(
                f,
                "{vertices} vertices lie exactly on another; they were not joined (--weld joins them), so the surface may come \
                 apart there"
            ),
            Self::NonManifold { edges } => write!(f, "{edges} edges belong to three triangles or more"),
            Self::Pinched { vertices } => write!(f, "the boundary touches itself at {vertices} vertices"),
            Self::OneSided { patches } => {
                write!(f, "{patches} patches have one side only; their winding was left as it is")
            }
            Self::NoArea { triangles } => write!(f, "{triangles} triangles have no area"),
            Self::Slivers { triangles } => write!(
                f,
                "{triangles} triangles are slivers, less than a fiftieth of their longest side high; they bear loads as if they \
                 were that high"
            ),
            Self::OtherThanWorn { triangles, first, rest_m, worn_m } => write!(
                f,
                "{triangles} triangles are of another size at rest than as worn, the farthest off in face {first}: {rest_m:.3} m \
                 long at rest, {worn_m:.3} m as worn; is the pattern torn there?"
            ),
            Self::Open { edges, loops } => write!(
                f,
                "the body is open: {edges} boundary edges in {loops} loops; inside and outside go by the normals alone, \
                 which is unreliable near the holes"
            ),
            Self::SmallFaces { count } => write!(f, "passed over {count} points and lines given as faces"),
            Self::UnknownLines { count, line, text } => {
                write!(f, "passed over {count} lines of no known keyword, the first on line {line}: \"{text}\"")
            }
        }
    }
}

/// What a mesh file holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "named as they are; what is not plain is said")]
pub struct MeshReport {
    pub file: String,
    /// How its numbers were read.
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
    /// What was changed.
    pub repairs: Vec<Repair>,
    /// What was left as it is.
    pub remarks: Vec<Remark>,
}

impl MeshReport {
    /// Whether the surface has no boundary.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} vertices, {} triangles from {} faces, {} connected parts, {} groups, {}",
            self.file,
            self.vertices,
            self.triangles,
            self.faces,
            self.components,
            self.groups,
            if self.is_closed() { "closed".to_owned() } else { format!("{} boundary loops", self.boundary_loops) }
        )?;
        writeln!(f, "  {} ({} up): {}", self.frame.unit, self.frame.up, self.frame.reason)?;
        self.repairs.iter().try_for_each(|repair| writeln!(f, "  {repair}"))?;
        self.remarks.iter().try_for_each(|remark| writeln!(f, "  note: {remark}"))
    }
}
