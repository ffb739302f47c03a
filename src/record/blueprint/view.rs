//! One view of the layout: its class, what it shows and its own settings.

use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, DataframeQuery, EyeControls3D, LineGrid3D, PlotLegend, ScalarAxis, SpatialInformation, TimeAxis,
    ViewBlueprint, ViewContents, VisualBounds2D,
};
use rerun::external::re_sdk_types::blueprint::components::{BackgroundKind, Corner2D, Eye3DKind};
use rerun::external::re_sdk_types::datatypes::{Range2D, TimeRange, TimeRangeBoundary};
use rerun::{AsComponents, RecordingStream, SerializedComponentBatch};

use super::super::RecordError;
use super::super::eye::Eye;
use super::super::meshes::{colour, single};
use super::super::paths;
use super::Node;

/// A view of what lies at `path` on the body, one share wide.
pub(crate) fn on_the_body(name: impl Into<String>, path: &str, eye: &Eye) -> (f32, Node) {
    (1.0, View::spatial(name, &[paths::BODY, path], eye).into())
}

/// Behind the garments: a calm dark grey, a shade lighter than the viewer's own panels.
const BACKDROP: [u8; 3] = [31, 34, 39];

pub(crate) struct View {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Vec<SerializedComponentBatch>)>,
}

impl View {
    fn new(class: &'static str, name: impl Into<String>, contents: &[&str]) -> Self {
        let contents = contents.iter().map(|path| format!("+ {path}/**")).collect();
        Self { class, name: name.into(), origin: "/".to_owned(), contents, properties: Vec::new() }
    }

    fn with(mut self, name: &'static str, archetype: &dyn AsComponents) -> Self {
        self.properties.push((name, archetype.as_serialized_batches()));
        self
    }

    /// Meshes and arrows seen from `eye`.
    pub(crate) fn spatial(name: impl Into<String>, contents: &[&str], eye: &Eye) -> Self {
        let controls = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(single(eye.position))
            .with_look_target(single(eye.target))
            .with_eye_up([0.0, 0.0, 1.0]);
        let backdrop = Background::new(BackgroundKind::SolidColor).with_color(colour(BACKDROP));
        Self::new("3D", name, contents)
            .with("EyeControls3D", &controls)
            .with("Background", &backdrop)
            .with("LineGrid3D", &LineGrid3D::new().with_visible(false))
            .with("SpatialInformation", &SpatialInformation::update_fields().with_show_axes(false))
    }

    /// A drawing in the plane, of which `[x, y]` is seen. Black, so that its texts read in the light theme too.
    pub(crate) fn plane(name: impl Into<String>, contents: &[&str], [x, y]: [[f64; 2]; 2]) -> Self {
        let backdrop = Background::new(BackgroundKind::SolidColor).with_color(colour([0; 3]));
        let seen = VisualBounds2D::new(Range2D { x_range: x.into(), y_range: y.into() });
        Self::new("2D", name, contents).with("Background", &backdrop).with("VisualBounds2D", &seen)
    }

    pub(crate) fn text(name: impl Into<String>, path: &str) -> Self {
        let mut view = Self::new("TextDocument", name, &[path]);
        path.clone_into(&mut view.origin);
        view
    }

    /// Scalars over the active timeline, with a legend or without: one line needs none, and in a small plot it hides the lines.
    pub(crate) fn plot(name: impl Into<String>, contents: &[&str], legend: bool) -> Self {
        Self::new("TimeSeries", name, contents)
            .with("PlotLegend", &PlotLegend::new().with_corner(Corner2D::LeftTop).with_visible(legend))
            .with("ScalarAxis", &ScalarAxis::new().with_zoom_lock(false))
    }

    /// Shows these steps of the timeline, whatever there is.
    pub(crate) fn between(self, first: i64, last: i64) -> Self {
        let [start, end] = [first, last].map(|step| TimeRangeBoundary::Absolute(step.into()));
        self.with("TimeAxis", &TimeAxis::new().with_view_range(TimeRange { start, end }))
    }

    pub(crate) fn bars(name: impl Into<String>, contents: &[&str]) -> Self {
        Self::new("BarChart", name, contents).with("PlotLegend", &PlotLegend::new().with_visible(false))
    }

    /// Rows of numbers, one per step of `timeline`.
    pub(crate) fn rows(name: impl Into<String>, contents: &[&str], timeline: &str) -> Self {
        let query = DataframeQuery::new().with_timeline(timeline).with_apply_latest_at(false);
        Self::new("Dataframe", name, contents).with("DataframeQuery", &query)
    }

    /// Logs the view to a blueprint store.
    pub(super) fn log(&self, stream: &RecordingStream, path: &str) -> Result<(), RecordError> {
        let blueprint = ViewBlueprint::new(self.class)
            .with_display_name(self.name.as_str())
            .with_space_origin(self.origin.as_str());
        stream.log(path, &blueprint)?;
        stream.log(format!("{path}/ViewContents"), &ViewContents::new(self.contents.iter().map(String::as_str)))?;
        for (name, batches) in &self.properties {
            stream.log_serialized_batches(format!("{path}/{name}"), false, batches.iter().cloned())?;
        }
        Ok(())
    }
}
