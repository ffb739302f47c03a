//! The blueprint: how the viewer lays a recording out when it opens.
//!
//! Rerun's typed blueprint cannot set the 3D eye, background, grid, axes or dataframe query, so the blueprint store is
//! written by hand: `view/{id}` and its properties, `container/{id}`, `viewport`, and the panels, on the sequence timeline
//! `blueprint` at 0; then one activation command. `layout` says which views there are, `view` what each holds.

mod detail_tabs;
pub(crate) mod layout;
mod rows;
mod table4;
pub(crate) mod view;

use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, PanelBlueprint, TimePanelBlueprint, ViewportBlueprint,
};
use rerun::external::re_sdk_types::blueprint::components::{
    ColumnShare, ContainerKind, PanelState, PlayState, RootContainer, RowShare,
};
use rerun::{RecordingStream, RecordingStreamBuilder};
use uuid::Uuid;

use super::RecordError;
use view::View;

/// A view, or views in a container.
pub(crate) enum Node {
    /// One view.
    View(Box<View>),
    /// Side by side, with the share of the width each.
    Row(&'static str, Vec<(f32, Node)>),
    /// One above the other, with the share of the height each.
    Column(&'static str, Vec<(f32, Node)>),
    /// One at a time; the one with this index is shown when the recording opens.
    Tabs(usize, Vec<Node>),
}

impl From<View> for Node {
    fn from(view: View) -> Self {
        Self::View(Box::new(view))
    }
}

/// The timeline and the state the time panel opens with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimePanel {
    pub(crate) timeline: &'static str,
    /// Whether the cursor follows the newest step (a live recording) or rests.
    pub(crate) follow: bool,
}

/// Ids counted up, so that the same layout gives the same blueprint.
struct Ids(u128);

impl Ids {
    fn next(&mut self) -> Uuid {
        self.0 += 1;
        Uuid::from_u128(self.0)
    }
}

/// Writes the layout and sends it down the recording's own sinks.
pub(crate) fn send(recording: &RecordingStream, root: &Node, time: TimePanel) -> Result<(), RecordError> {
    let Some(info) = recording.store_info() else { return Ok(()) };
    let (stream, storage) = RecordingStreamBuilder::new(info.application_id().clone()).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    let (root, _) = log_node(&stream, root, &mut Ids(0x7061_7274_7769_7365_u128 << 64))?;
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
        let command = BlueprintActivationCommand {
            blueprint_id: first.info.store_id.clone(),
            make_active: true,
            make_default: true,
        };
        recording.send_blueprint(messages, command);
    }
    Ok(())
}

/// Logs a node and all below it; returns its id and its path. A lone view is wrapped in tabs: a viewport's root must be a
/// container.
fn log_node(stream: &RecordingStream, node: &Node, ids: &mut Ids) -> Result<(Uuid, String), RecordError> {
    let (name, kind, children): (&str, ContainerKind, Vec<(f32, &Node)>) = match node {
        Node::View(view) => {
            let id = ids.next();
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
        paths.push(log_node(stream, child, ids)?.1);
    }
    let id = ids.next();
    let shares = children.iter().map(|(share, _)| *share);
    let mut container = ContainerBlueprint::new(kind).with_contents(paths.iter().map(String::as_str));
    if !name.is_empty() {
        container = container.with_display_name(name);
    }
    container = match kind {
        ContainerKind::Horizontal => container.with_col_shares(shares.map(ColumnShare::from)),
        ContainerKind::Vertical => container.with_row_shares(shares.map(RowShare::from)),
        ContainerKind::Tabs => match paths.get(if let Node::Tabs(open, _) = node { *open } else { 0 }) {
            Some(open) => container.with_active_tab(open.as_str()),
            None => container,
        },
        ContainerKind::Grid => container,
    };
    let path = format!("container/{id}");
    stream.log(path.as_str(), &container)?;
    Ok((id, path))
}
