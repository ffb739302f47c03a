//! A session as a viewer in a page takes it: pieces of RRD, each whole, of which the newest replaces those before.
//!
//! Everything is logged without a time, so a viewer keeps the newest of each component and its memory stays as it is. Triangles, the
//! body and the layout go into one piece ([`LiveEncoder::base`]), which a viewer needs once; after it colours
//! ([`LiveEncoder::parts`]) and positions with normals ([`LiveEncoder::shape`]) are sent alone. Whoever attaches later gets the
//! newest of each.
//!
//! | path | what |
//! |---|---|
//! | `/body` | the body |
//! | `/parts/garment`, `/parts/arrows` | PARTs by colour on the garment as placed; the body's reaction on each |
//! | `/preview/garment` | the garment after the two stages |
//! | `/rest/garment` | the garment at rest |
//! | `/pin/<n>/body`, `/pin/<n>/garment` | a state that was pinned |

use glam::DVec3;
use rerun::sink::MemorySinkStorage;
use rerun::{Arrows3D, RecordingStream, RecordingStreamBuilder};

use super::blueprint::view::{View, on_the_body};
use super::blueprint::{self, Node, TimePanel};
use super::colour_map::Rgb;
use super::colours::{self, colour_parts};
use super::eye::Eye;
use super::meshes::{self, CellMesh};
use super::open::application;
use super::step::{FORCE_QUANTILE, covering, part_arrows};
use super::{Range, RecordError, paths};
use crate::mesh::TriMesh;
use crate::study::metrics::LevelCount;

const PARTS: &str = "/parts";
/// Width over height of the room for all views of a page of 1280 by 800 pixels.
const ROOM: f64 = 1.2;
/// The colour of what was pinned.
const PINNED: Rgb = [214, 164, 96];

/// Which garment moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiveShape {
    /// The one after the two stages.
    Preview,
    /// The one at full resolution.
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

/// A state kept beside the others.
#[derive(Debug, Clone, Copy)]
pub struct PinnedView<'a> {
    /// What its view is called.
    pub label: &'a str,
    /// Its body.
    pub body: &'a TriMesh,
    /// Its garment, draped.
    pub draped: &'a TriMesh,
}

/// Makes the pieces. What it is asked for fails with what Rerun refuses, and where lists do not fit the garment.
pub struct LiveEncoder {
    stream: RecordingStream,
    storage: MemorySinkStorage,
    builder: Box<dyn Fn() -> RecordingStreamBuilder + Send>,
    front: DVec3,
    garment: TriMesh,
    cells: CellMesh,
    eye: Eye,
    vertex_shade: Vec<u8>,
}

impl LiveEncoder {
    /// An encoder for a session of this name, whose wearer looks along `front`; `id` tells it from other sessions.
    pub(crate) fn new(name: &str, id: &str, front: DVec3) -> Result<Self, RecordError> {
        let (name, id) = (name.to_owned(), id.to_owned());
        let builder = move || {
            RecordingStreamBuilder::new(application(&name)).recording_id(id.clone()).recording_name(name.as_str())
        };
        let (stream, storage) = open(builder())?;
        Ok(Self {
            stream,
            storage,
            builder: Box::new(builder),
            front,
            garment: TriMesh::default(),
            cells: CellMesh::new(&TriMesh::default()),
            eye: Eye::default(),
            vertex_shade: Vec::new(),
        })
    }

    /// Body, garment, what is pinned, and the layout: a viewer needs it before anything else, and all else after it again.
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
        self.eye = Eye::on(garment, self.front, ROOM / views as f64).unwrap_or_default();
        let (stream, storage) = open((self.builder)())?;
        let seen = |(name, path)| on_the_body(name, path, &self.eye);
        let mut row = Vec::from([("PARTs", PARTS), ("Two stages", "/preview"), ("At rest", "/rest")].map(seen));
        for (i, pin) in pins.iter().enumerate() {
            let (body, garment) = (format!("/pin/{i}/body"), format!("/pin/{i}/garment"));
            row.push((1.0, View::spatial(format!("Pin: {}", pin.label), &[&body, &garment], &self.eye).into()));
        }
        // The layout first: a slow viewer takes seconds to read the triangles, and would lay out by itself what it has.
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
        drained(&storage)
    }

    /// Which PART each vertex belongs to, the levels that made them, and the body's reaction on each, N (none: no arrows).
    pub(crate) fn parts(
        &mut self,
        part_of_vertex: &[u32],
        levels: &[LevelCount],
        part_count: usize,
        force_n: &[DVec3],
    ) -> Result<Vec<u8>, RecordError> {
        RecordError::unless_per_vertex(self.garment.vertex_count(), &[("PART numbers", part_of_vertex.len())])?;
        let part_of_vertex = covering(part_of_vertex, part_count);
        let with_rest = part_count + usize::from(part_of_vertex.contains(&(part_count as u32)));
        let chosen = colour_parts(&part_of_vertex, with_rest, levels, &self.garment.triangles, &self.vertex_shade);
        self.vertex_shade = part_of_vertex.iter().map(|&p| chosen.shade[p as usize]).collect();
        let coloured = self.cells.colours(|v| chosen.colour[part_of_vertex[v as usize] as usize]);
        self.stream.log_static(format!("{PARTS}/garment"), &coloured)?;
        let arrows = if force_n.len() == part_count {
            let mut force_n = force_n.to_vec();
            force_n.resize(with_rest, DVec3::ZERO);
            let full = Range::to_quantile(force_n.iter().map(|f| f.length()), FORCE_QUANTILE).high;
            part_arrows(&self.eye, &self.garment.positions, &part_of_vertex, &force_n, full)
        } else {
            Arrows3D::from_vectors([[0.0_f32; 3]; 0])
        };
        self.stream.log_static(format!("{PARTS}/arrows"), &arrows)?;
        drained(&self.storage)
    }

    /// Where a garment is, m.
    pub(crate) fn shape(&mut self, which: LiveShape, positions: &[DVec3]) -> Result<Vec<u8>, RecordError> {
        RecordError::unless_per_vertex(self.garment.vertex_count(), &[("positions", positions.len())])?;
        let moved = self.garment.with_positions(positions.to_vec());
        self.stream.log_static(which.path(), &meshes::shape(&moved))?;
        drained(&self.storage)
    }
}

fn open(builder: RecordingStreamBuilder) -> Result<(RecordingStream, MemorySinkStorage), RecordError> {
    let (stream, storage) = builder.memory()?;
    stream.set_log_tick_enabled(false);
    stream.set_log_time_enabled(false);
    Ok((stream, storage))
}

fn drained(storage: &MemorySinkStorage) -> Result<Vec<u8>, RecordError> {
    storage.drain_as_bytes().map_err(|error| RecordError::Incomplete { reason: error.to_string() })
}
