//! The blueprint: the arrangement of views with which the viewer opens a recording.
//!
//! Rerun's typed blueprint cannot set the 3D eye, background, grid, axes or dataframe query, so the blueprint store is
//! written by hand: `view/{id}` and its properties, `container/{id}`, `viewport`, and the panels, on the sequence timeline
//! `blueprint` at 0; then one activation command.

use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, DataframeQuery, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis,
    SpatialInformation, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
use rerun::external::re_sdk_types::blueprint::components::{
    BackgroundKind, ColumnShare, ContainerKind, Corner2D, Eye3DKind, PanelState, PlayState, RootContainer, RowShare,
};
use rerun::external::re_sdk_types::datatypes::{Range2D, TimeRange, TimeRangeBoundary};
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, SerializedComponentBatch};
use uuid::Uuid;

use super::error::RecordError;
use super::eye::Eye;
use super::meshes::{colour, single};
use super::paths;

/// A view, or views in a container.
pub(super) enum Node {
    /// One view.
    View(Box<View>),
    /// Side by side, with the share of the width each.
    Row(&'static str, Vec<(f32, Node)>),
    /// One above the other, with the share of the height each.
    Column(&'static str, Vec<(f32, Node)>),
    /// One at a time; the recording opens on the one with this index.
    Tabs(usize, Vec<Node>),
}

impl From<View> for Node {
    fn from(view: View) -> Self {
        Self::View(Box::new(view))
    }
}

/// One view: its class, the entities that it shows, and its settings.
pub(super) struct View {
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

    /// Meshes and arrows seen from `eye`. The background is of one colour, which the viewer takes from its theme.
    pub(super) fn spatial(name: impl Into<String>, contents: &[&str], eye: &Eye) -> Self {
        let controls = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(single(eye.position))
            .with_look_target(single(eye.target))
            .with_eye_up([0.0, 0.0, 1.0]);
        Self::new("3D", name, contents)
            .with("EyeControls3D", &controls)
            .with("Background", &Background::new(BackgroundKind::SolidColor))
            .with("LineGrid3D", &LineGrid3D::new().with_visible(false))
            .with("SpatialInformation", &SpatialInformation::update_fields().with_show_axes(false))
    }

    /// The body with the entities at `path`, one share wide.
    pub(super) fn with_body(name: impl Into<String>, path: &str, eye: &Eye) -> (f32, Node) {
        (1.0, Self::spatial(name, &[paths::BODY, path], eye).into())
    }

    /// A plane drawing of which `[x, y]` is visible. Its background is black, so that its texts are legible in the light theme too.
    pub(super) fn plane(name: impl Into<String>, contents: &[&str], [x, y]: [[f64; 2]; 2]) -> Self {
        let backdrop = Background::new(BackgroundKind::SolidColor).with_color(colour([0; 3]));
        let visible = VisualBounds2D::new(Range2D { x_range: x.into(), y_range: y.into() });
        Self::new("2D", name, contents).with("Background", &backdrop).with("VisualBounds2D", &visible)
    }

    /// The text panel.
    pub(super) fn report() -> Self {
        Self { origin: paths::REPORT.to_owned(), ..Self::new("TextDocument", "Report", &[paths::REPORT]) }
    }

    /// Scalars over the active timeline. A plot of one line needs no legend, and in a small plot it hides the lines.
    pub(super) fn plot(name: impl Into<String>, contents: &[&str], legend: bool) -> Self {
        Self::new("TimeSeries", name, contents)
            .with("PlotLegend", &PlotLegend::new().with_corner(Corner2D::LeftTop).with_visible(legend))
            .with("ScalarAxis", &ScalarAxis::new().with_zoom_lock(false))
    }

    /// Shows a fixed range of the timeline.
    pub(super) fn between(self, first: i64, last: i64) -> Self {
        let [start, end] = [first, last].map(|step| TimeRangeBoundary::Absolute(step.into()));
        self.with("TimeAxis", &TimeAxis::new().with_view_range(TimeRange { start, end }))
    }

    pub(super) fn bars(name: impl Into<String>, contents: &[&str]) -> Self {
        Self::new("BarChart", name, contents).with("PlotLegend", &PlotLegend::new().with_visible(false))
    }

    /// Rows of numbers, one per step of `timeline`.
    pub(super) fn rows(name: impl Into<String>, contents: &[&str], timeline: &str) -> Self {
        let query = DataframeQuery::new().with_timeline(timeline).with_apply_latest_at(false);
        Self::new("Dataframe", name, contents).with("DataframeQuery", &query)
    }

    fn log(&self, stream: &RecordingStream, path: &str) -> Result<(), RecordError> {
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

/// The timeline and the state with which the time panel opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TimePanel {
    pub(super) timeline: &'static str,
    /// Whether the cursor follows the newest step (a live recording) or is paused.
    pub(super) follow: bool,
}

/// Writes the blueprint and sends it to the recording's own sinks.
pub(super) fn send(recording: &RecordingStream, root: &Node, time: TimePanel) -> Result<(), RecordError> {
    let Some(info) = recording.store_info() else { return Ok(()) };
    let (stream, storage) = RecordingStreamBuilder::new(info.application_id().clone()).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    // Ids are counted up, so that the same layout gives the same blueprint.
    let mut last_id = 0x7061_7274_7769_7365_u128 << 64;
    let (root, _) = log_node(&stream, root, &mut last_id)?;
    let root_id = rerun::external::re_sdk_types::datatypes::Uuid { bytes: root.into_bytes() };
    let viewport = ViewportBlueprint::new()
        .with_root_container(RootContainer::from(root_id))
        .with_auto_layout(false)
        .with_auto_views(false);
    stream.log("viewport", &viewport)?;
    for panel in ["selection_panel", "blueprint_panel"] {
        stream.log(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
    }
    let play = if time.follow { PlayState::Following } else { PlayState::Paused };
    let panel = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(time.timeline)
        .with_play_state(play)
        .with_fps(2.0);
    stream.log("time_panel", &panel)?;
    let messages = storage.take();
    if let Some(LogMsg::SetStoreInfo(first)) = messages.first() {
        let blueprint_id = first.info.store_id.clone();
        let command = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        recording.send_blueprint(messages, command);
    }
    Ok(())
}

/// Logs a node and all below it; returns its id and path. The root must be a container: a viewport takes no lone view.
fn log_node(stream: &RecordingStream, node: &Node, last_id: &mut u128) -> Result<(Uuid, String), RecordError> {
    let (name, kind, children): (&str, ContainerKind, Vec<(f32, &Node)>) = match node {
        Node::View(view) => {
            *last_id += 1;
            let id = Uuid::from_u128(*last_id);
            let path = format!("view/{id}");
            view.log(stream, &path)?;
            return Ok((id, path));
        }
        Node::Row(name, nodes) => (name, ContainerKind::Horizontal, nodes.iter().map(|(s, n)| (*s, n)).collect()),
        Node::Column(name, nodes) => (name, ContainerKind::Vertical, nodes.iter().map(|(s, n)| (*s, n)).collect()),
        Node::Tabs(_, nodes) => ("", ContainerKind::Tabs, nodes.iter().map(|n| (1.0, n)).collect()),
    };
    let mut paths = Vec::with_capacity(children.len());
    for (_, child) in &children {
        paths.push(log_node(stream, child, last_id)?.1);
    }
    *last_id += 1;
    let id = Uuid::from_u128(*last_id);
    let shares = children.iter().map(|(share, _)| *share);
    let mut container = ContainerBlueprint::new(kind).with_contents(paths.iter().map(String::as_str));
    if !name.is_empty() {
        container = container.with_display_name(name);
    }
    container = match node {
        Node::Row(..) => container.with_col_shares(shares.map(ColumnShare::from)),
        Node::Column(..) => container.with_row_shares(shares.map(RowShare::from)),
        Node::Tabs(open, _) if *open < paths.len() => container.with_active_tab(paths[*open].as_str()),
        Node::Tabs(..) | Node::View(_) => container,
    };
    let path = format!("container/{id}");
    stream.log(path.as_str(), &container)?;
    Ok((id, path))
}
