//! A recording of drape tests: the draped rim in space, and outlines from above over one another in a plane, a step for each test.

use glam::{DVec2, DVec3};
use rerun::{LineStrips2D, Radius, TextDocument};

use super::blueprint::{self, Node, TimePanel, View};
use super::error::RecordError;
use super::eye::Eye;
use super::meshes;
use super::open_recording::{OpenRecording, RecordOptions, RecordSummary};
use super::paths;
use super::sinks::Sink;
use crate::mesh::TriMesh;
use crate::picture::colour::palette;

/// Thickness of outlines on screen, points.
const THICKNESS: f32 = 1.2;

/// Width over height of each of the two views.
const ASPECT: f64 = 0.9;

/// A closed line seen from above, with its name.
pub(crate) struct NamedOutline {
    /// Name in the viewer.
    pub(crate) name: String,
    /// Its points, m.
    pub(crate) points: Vec<DVec2>,
}

impl NamedOutline {
    /// A circle about the axis.
    pub(crate) fn circle(name: &str, radius_m: f64) -> Self {
        let point = |k: i32| radius_m * crate::base::math::unit(f64::from(k) * std::f64::consts::TAU / 180.0);
        Self { name: name.to_owned(), points: (0..180).map(point).collect() }
    }
}

/// Drape tests in one recording.
pub(crate) struct DrapeTestRecording {
    recording: Box<OpenRecording>,
    steps: i64,
}

impl DrapeTestRecording {
    /// Opens the sink. `reach_m` is the largest radius that will be logged, m.
    ///
    /// # Errors
    /// An unwritable file.
    pub(crate) fn open(sink: Sink, name: &str, reach_m: f64) -> Result<Self, RecordError> {
        let options = RecordOptions { sinks: vec![sink], name: name.to_owned(), ..RecordOptions::default() };
        let recording = Box::new(OpenRecording::new(options)?);
        let corners = [DVec3::splat(-reach_m), DVec3::splat(reach_m)].map(|p| p * DVec3::new(1.0, 1.0, 0.4));
        let about = TriMesh::new(vec![corners[0], corners[1], corners[0].with_x(reach_m)], vec![[0, 1, 2]]);
        let eye = Eye::on(&about, DVec3::new(0.0, -1.0, 0.0), ASPECT).unwrap_or_default();
        let visible = [-1.1e3 * reach_m, 1.1e3 * reach_m];
        let views = vec![
            (1.0, View::spatial("drape", &[paths::DRAPE], &eye).into()),
            (1.0, View::plane("outlines from above, mm", &[paths::OUTLINES], [visible, visible]).into()),
        ];
        let report: Node = View::report().into();
        let root = Node::Column("drape tests", vec![(4.0, Node::Row("drape", views)), (1.0, report)]);
        blueprint::send(&recording.stream, &root, TimePanel { timeline: paths::TABLE, follow: false })?;
        Ok(Self { recording, steps: 0 })
    }

    /// Logs one step: a drape, outlines over one another, and a text in Markdown.
    ///
    /// # Errors
    /// Rerun rejects the data.
    pub(crate) fn step(&mut self, text: &str, drape: &TriMesh, outlines: &[NamedOutline]) -> Result<(), RecordError> {
        let recording = &self.recording;
        recording.at_table(self.steps, 0);
        self.steps += 1;
        recording.log(paths::DRAPE, &meshes::plain(drape, palette::DRAPED))?;
        let closed = |outline: &NamedOutline| {
            let points = outline.points.iter().chain(outline.points.first());
            points.map(|p| [1e3 * p.x as f32, -1e3 * p.y as f32]).collect::<Vec<_>>()
        };
        let hues = palette::palette();
        let lines = LineStrips2D::new(outlines.iter().map(closed).collect::<Vec<_>>())
            .with_colors((0..outlines.len()).map(|k| meshes::colour(hues[k % hues.len()])))
            .with_labels(outlines.iter().map(|outline| outline.name.as_str()))
            .with_show_labels(false)
            .with_radii([Radius::new_ui_points(THICKNESS)]);
        recording.log(paths::OUTLINES, &lines)?;
        recording.log(paths::REPORT, &TextDocument::from_markdown(text))
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// The file cannot be completed.
    pub(crate) fn finish(self) -> Result<RecordSummary, RecordError> {
        self.recording.finish()
    }
}
