//! The data of a session for the viewer in the live page: complete sections of RRD, of which the newest replaces earlier ones.
//!
//! All data is logged without a time, so that a viewer keeps the newest of each component and its memory does not grow. Triangles,
//! body and layout are in one section ([`LiveEncoder::base`]), which a viewer loads once; colours ([`LiveEncoder::parts`]) and
//! positions with normals ([`LiveEncoder::shape`]) follow alone. A viewer that connects later loads the newest section of each.
//!
//! | path | contents |
//! |---|---|
//! | `/body` | the body |
//! | `/parts/garment`, `/parts/arrows` | PARTs by colour on the garment as placed; the body's reaction on each |
//! | `/preview/garment` | the garment after both stages |
//! | `/rest/garment` | the garment at rest |
//! | `/pin/<n>/body`, `/pin/<n>/garment` | a pinned state |

use glam::DVec3;
use rerun::sink::MemorySinkStorage;
use rerun::{Arrows3D, RecordingStream, RecordingStreamBuilder};

use super::blueprint::{self, Node, TimePanel, View};
use super::colour_map::{Range, Rgb};
use super::colours::{self, colour_parts, with_outside};
use super::error::RecordError;
use super::eye::Eye;
use super::meshes::{self, CellMesh};
use super::open_recording::application;
use super::step::FORCE_QUANTILE;
use super::{part_marks, paths};
use crate::mesh::TriMesh;
use crate::study::metrics::LevelCount;

const PARTS: &str = "/parts";
/// Width over height of all views together, in a page of 1280 by 800 pixels.
const ASPECT: f64 = 1.2;
/// Colour of pinned garments.
const PINNED: Rgb = [214, 164, 96];

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

/// A pinned state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PinnedView<'a> {
    /// Label of its view.
    pub(crate) label: &'a str,
    /// Its body.
    pub(crate) body: &'a TriMesh,
    /// Its draped garment.
    pub(crate) draped: &'a TriMesh,
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
        let views = 3 + pins.len();
        self.eye = Eye::on(garment, self.front, ASPECT / views as f64).unwrap_or_default();
        let (stream, storage) = open(&self.name, &self.id)?;
        let stages = [("PARTs", PARTS), ("Two stages", "/preview"), ("At rest", "/rest")];
        let mut row = Vec::from(stages.map(|(name, path)| View::with_body(name, path, &self.eye)));
        for (i, pin) in pins.iter().enumerate() {
            let (body, garment) = (format!("/pin/{i}/body"), format!("/pin/{i}/garment"));
            row.push((1.0, View::spatial(format!("Pin: {}", pin.label), &[&body, &garment], &self.eye).into()));
        }
        // The layout first: a slow viewer takes seconds to read the triangles, and would meanwhile lay out the views itself.
        blueprint::send(&stream, &Node::Row("Live", row), TimePanel { timeline: paths::TABLE, follow: false })?;
        stream.log_static(paths::BODY, &meshes::plain(body, colours::BODY))?;
        stream.log_static(format!("{PARTS}/garment"), &self.cells.shape())?;
        for (shape, colour) in [(LiveShape::Preview, colours::CLOTH), (LiveShape::Rest, colours::DRAPED)] {
            stream.log_static(shape.path(), &meshes::plain(garment, colour))?;
        }
        for (i, pin) in pins.iter().enumerate() {
            stream.log_static(format!("/pin/{i}/body"), &meshes::plain(pin.body, colours::BODY))?;
            stream.log_static(format!("/pin/{i}/garment"), &meshes::plain(pin.draped, PINNED))?;
        }
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
