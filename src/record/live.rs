//! The data of a session for the viewer in the live page: complete sections of RRD, of which the newest replaces earlier ones.
//!
//! All data is logged without a time, so that a viewer keeps the newest of each component and its memory does not grow. Triangles,
//! body and layout are in one section ([`LiveEncoder::base`]), which a viewer loads once; colours ([`LiveEncoder::parts`]) and
//! positions with normals ([`LiveEncoder::shape`]) follow alone. A viewer that connects later loads the newest section of each.
//!
//! | path | contents |
//! |---|---|
//! | `/body` | the body |
//! | `/parts/selected`, `/preview/selected`, `/rest/selected` | outline of the PART that a page has selected ([`outlines`]) |
//! | `/parts/garment`, `/parts/arrows` | PARTs by colour on the garment as placed; the body's reaction on each |
//! | `/preview/garment` | the garment after both stages |
//! | `/rest/garment` | the garment at rest |
//! | `/pin/<n>/body`, `/pin/<n>/parts`, `/pin/<n>/preview` | a pinned state: PARTs by colour, and the garment after both stages |

use glam::DVec3;
use rerun::sink::MemorySinkStorage;
use rerun::{Arrows3D, Color, LineStrips3D, Radius, RecordingStream, RecordingStreamBuilder};

use super::blueprint::{self, Node, TimePanel, View};
use super::error::RecordError;
use super::eye::Eye;
use super::meshes;
use super::open_recording::application;
use super::{part_marks, paths};
use crate::mesh::{Topology, TriMesh};
use crate::parts::Parts;
use crate::picture::colour::FORCE_QUANTILE;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::{Range, Rgb};
use crate::picture::colour::palette::{self, colour_parts, with_outside};
use crate::study::metrics::LevelCount;

const PARTS: &str = "/parts";
/// Distance of the outline from the cloth, m, so that the cloth does not cover half of it.
const OUTLINE_M: f64 = 0.002;
/// Width over height of all views together, in a page of 1280 by 800 pixels.
const ASPECT: f64 = 1.2;
/// A garment whose positions change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LiveShape {
    /// After both stages.
    Preview,
    /// At full resolution.
    Rest,
}

impl LiveShape {
    fn path(self) -> &'static str {
        match self {
            Self::Preview => "/preview/garment",
            Self::Rest => "/rest/garment",
        }
    }
}

/// A pinned state: a column of two views.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PinnedView<'a> {
    /// Its body.
    pub(crate) body: &'a TriMesh,
    /// Its garment as placed.
    pub(crate) garment: &'a TriMesh,
    /// The PARTs that its model moved.
    pub(crate) parts: &'a Parts,
    /// Their levels.
    pub(crate) levels: &'a [LevelCount],
    /// The garment after both stages, m.
    pub(crate) preview: &'a [DVec3],
}

/// Encodes the sections. Its methods fail if Rerun rejects the data, and if slices do not fit the garment.
pub(crate) struct LiveEncoder {
    name: String,
    id: String,
    stream: RecordingStream,
    storage: MemorySinkStorage,
    front: DVec3,
    garment: TriMesh,
    cells: CellMesh,
    eye: Eye,
    vertex_shade: Vec<u8>,
}

impl LiveEncoder {
    /// An encoder for a session of this name, whose wearer looks along `front`; `id` is unique to the session.
    pub(crate) fn new(name: &str, id: &str, front: DVec3) -> Result<Self, RecordError> {
        let (stream, storage) = open(name, id)?;
        Ok(Self {
            name: name.to_owned(),
            id: id.to_owned(),
            stream,
            storage,
            front,
            garment: TriMesh::default(),
            cells: CellMesh::new(&TriMesh::default()),
            eye: Eye::default(),
            vertex_shade: Vec::new(),
        })
    }

    /// Layout, body, garment and pinned states. A viewer loads this section first, and all others again after it.
    pub(crate) fn base(
        &mut self,
        body: &TriMesh,
        garment: &TriMesh,
        pins: &[PinnedView<'_>],
    ) -> Result<Vec<u8>, RecordError> {
        if self.garment != *garment {
            self.garment = garment.clone();
            self.cells = CellMesh::new(garment);
            self.vertex_shade.clear();
        }
        let (stream, storage) = open(&self.name, &self.id)?;
        // The layout first: a slow viewer takes seconds to read the triangles, and would meanwhile lay out the views itself.
        let seen = |aspect: f64| Eye::on(&self.garment, self.front, aspect).unwrap_or_default();
        let (views, eye) = views(&seen, pins.len());
        lay_out(&stream, views)?;
        stream.log_static(paths::BODY, &meshes::plain(body, palette::BODY))?;
        stream.log_static(format!("{PARTS}/garment"), &self.cells.shape())?;
        for (shape, colour) in [(LiveShape::Preview, palette::CLOTH), (LiveShape::Rest, palette::DRAPED)] {
            stream.log_static(shape.path(), &meshes::plain(garment, colour))?;
        }
        for (i, pin) in pins.iter().enumerate() {
            stream.log_static(format!("/pin/{i}/body"), &meshes::plain(pin.body, palette::BODY))?;
            let part_of_vertex = with_outside(&pin.parts.part_of_vertex, pin.parts.len());
            let all = pin.parts.len() + usize::from(part_of_vertex.contains(&(pin.parts.len() as u32)));
            let colours = colour_parts(&part_of_vertex, all, pin.levels, &pin.garment.triangles, &[]);
            let cells = CellMesh::of_values(pin.garment, &part_of_vertex);
            stream.log_static(format!("/pin/{i}/parts"), &cells.shape())?;
            stream.log_static(format!("/pin/{i}/parts"), &cells.colours(&colours.of_vertices))?;
            let preview = pin.garment.with_positions(pin.preview.to_vec());
            stream.log_static(format!("/pin/{i}/preview"), &meshes::plain(&preview, palette::CLOTH))?;
        }
        self.eye = eye;
        drain(&storage)
    }

    /// The PART of each vertex, the levels, and the body's reaction on each PART, N; an empty slice gives no arrows.
    pub(crate) fn parts(
        &mut self,
        part_of_vertex: &[u32],
        levels: &[LevelCount],
        part_count: usize,
        force_n: &[DVec3],
    ) -> Result<Vec<u8>, RecordError> {
        RecordError::unless_per_vertex(self.garment.vertex_count(), &[("PART numbers", part_of_vertex.len())])?;
        let part_of_vertex = with_outside(part_of_vertex, part_count);
        let all = part_count + usize::from(part_of_vertex.contains(&(part_count as u32)));
        let chosen = colour_parts(&part_of_vertex, all, levels, &self.garment.triangles, &self.vertex_shade);
        self.vertex_shade = chosen.vertex_shade;
        self.stream.log_static(format!("{PARTS}/garment"), &self.cells.colours(&chosen.of_vertices))?;
        let arrows = if force_n.len() == part_count {
            let mut force_n = force_n.to_vec();
            force_n.resize(all, DVec3::ZERO);
            let full_n = Range::to_quantile(force_n.iter().map(|f| f.length()), FORCE_QUANTILE).high;
            part_marks::arrows(&self.eye, &self.garment.positions, &part_of_vertex, &force_n, full_n)
        } else {
            Arrows3D::from_vectors([[0.0_f32; 3]; 0])
        };
        self.stream.log_static(format!("{PARTS}/arrows"), &arrows)?;
        drain(&self.storage)
    }

    /// The positions of a garment, m.
    pub(crate) fn shape(&mut self, shape: LiveShape, positions: &[DVec3]) -> Result<Vec<u8>, RecordError> {
        RecordError::unless_per_vertex(self.garment.vertex_count(), &[("positions", positions.len())])?;
        let moved = self.garment.with_positions(positions.to_vec());
        self.stream.log_static(shape.path(), &meshes::shape(&moved))?;
        drain(&self.storage)
    }
}

/// The three views of the newest state side by side, and the eye of its PARTs. Beside pinned states, its PARTs stand over its two stages as
/// theirs do. `seen` is the eye of a view of this width over height.
fn views(seen: &dyn Fn(f64) -> Eye, pins: usize) -> (Vec<(f32, Node)>, Eye) {
    let [parts, preview, rest] = [("PARTs", PARTS), ("Two stages", "/preview"), ("At rest", "/rest")];
    if pins == 0 {
        let eye = seen(ASPECT / 3.0);
        return ([parts, preview, rest].map(|(name, path)| View::with_body(name, path, &eye)).into(), eye);
    }
    let width = ASPECT / (pins + 2) as f64;
    // Lower views show less below the hem, to which the garment sinks.
    let eye = seen(2.0 * width).farther(1.1);
    let column = |views: [(f32, Node); 2]| (1.0, Node::Column("State", views.into()));
    let mut row = vec![column([parts, preview].map(|(name, path)| View::with_body(name, path, &eye)))];
    row.extend((0..pins).map(|i| {
        let of_pin = |name: &str, leaf: &str| {
            let paths = ["body", leaf].map(|leaf| format!("/pin/{i}/{leaf}"));
            (1.0, View::spatial(name, &[&paths[0], &paths[1]], &eye).into())
        };
        column([of_pin(parts.0, "parts"), of_pin(preview.0, "preview")])
    }));
    row.push(View::with_body(rest.0, rest.1, &seen(width)));
    (row, eye)
}

fn lay_out(stream: &RecordingStream, views: Vec<(f32, Node)>) -> Result<(), RecordError> {
    blueprint::send(stream, &Node::Row("Live", views), TimePanel { timeline: paths::TABLE, follow: false })
}

/// The layout with all views seen from the direction `toward` (unit, not vertical), beside this number of pinned states.
pub(crate) fn eyes(
    (name, id): (&str, &str),
    garment: &TriMesh,
    toward: DVec3,
    pins: usize,
) -> Result<Vec<u8>, RecordError> {
    let (stream, storage) = open(name, id)?;
    let seen = |aspect: f64| Eye::seen_from(garment, toward, aspect).unwrap_or_default();
    lay_out(&stream, views(&seen, pins).0)?;
    drain(&storage)
}

/// The garment at rest in these colours, one per vertex; without any in the colour of cloth.
pub(crate) fn rest_colours((name, id): (&str, &str), colours: &[Rgb]) -> Result<Vec<u8>, RecordError> {
    let (stream, storage) = open(name, id)?;
    let [r, g, b] = if colours.is_empty() { palette::DRAPED } else { [255; 3] };
    let tint = rerun::components::AlbedoFactor::from(rerun::Rgba32::from_rgb(r, g, b));
    let mesh = meshes::colours(colours.iter().copied()).with_albedo_factor(tint);
    stream.log_static(LiveShape::Rest.path(), &mesh)?;
    drain(&storage)
}

/// The outlines of a set of vertices on the garment as placed, after both stages, and at rest: a separate section, drawn in addition to the
/// newest of the session `name` and `id`. Shapes that do not exist yet, and an empty set, clear the outline.
pub(crate) fn outlines(
    (name, id): (&str, &str),
    garment: &TriMesh,
    topology: &Topology,
    chosen: &[bool],
    shapes: [Option<&[DVec3]>; 3],
) -> Result<Vec<u8>, RecordError> {
    let (stream, storage) = open(name, id)?;
    for (branch, positions) in [PARTS, "/preview", "/rest"].into_iter().zip(shapes) {
        let strips =
            positions.map_or_else(Vec::new, |x| outline(&garment.with_positions(x.to_vec()), topology, chosen));
        let lines = LineStrips3D::new(strips.iter().map(|strip| meshes::singles(strip)));
        let lines = lines.with_radii([Radius::new_ui_points(1.5)]).with_colors([Color::from_rgb(255, 255, 255)]);
        stream.log_static(format!("{branch}/selected"), &lines)?;
    }
    drain(&storage)
}

/// The border of the cells of the chosen vertices, as the colours of PARTs show it, a little outside the cloth.
fn outline(mesh: &TriMesh, topology: &Topology, chosen: &[bool]) -> Vec<Vec<DVec3>> {
    let normals = mesh.vertex_normals();
    let at = |v: u32| mesh.positions[v as usize] + OUTLINE_M * normals[v as usize];
    let is_in = |v: u32| chosen.get(v as usize) == Some(&true);
    let between = mesh.triangles.iter().filter_map(|&[a, b, c]| {
        // The corner that is alone on its side.
        let (alone, p, q) = match [a, b, c].map(is_in) {
            [x, y, z] if y == z && x != y => (a, b, c),
            [x, y, z] if x == z && x != y => (b, c, a),
            [x, y, z] if x == y && x != z => (c, a, b),
            _ => return None,
        };
        let [alone, p, q] = [alone, p, q].map(at);
        Some(vec![0.5 * (alone + p), (alone + p + q) / 3.0, 0.5 * (alone + q)])
    });
    let edges = topology.boundary_edges().filter(|&[a, b]| is_in(a) && is_in(b));
    between.chain(edges.map(|[a, b]| vec![at(a), at(b)])).collect()
}

fn open(name: &str, id: &str) -> Result<(RecordingStream, MemorySinkStorage), RecordError> {
    let builder = RecordingStreamBuilder::new(application(name)).recording_id(id).recording_name(name);
    let (stream, storage) = builder.memory()?;
    stream.set_log_tick_enabled(false);
    stream.set_log_time_enabled(false);
    Ok((stream, storage))
}

fn drain(storage: &MemorySinkStorage) -> Result<Vec<u8>, RecordError> {
    storage.drain_as_bytes().map_err(|error| RecordError::Incomplete { reason: error.to_string() })
}
