//! A sewing pattern: flat panels, and which of their edges are sewn together.

use glam::{DMat3, DVec2, DVec3};

use super::curve::Curve;
use crate::base::math;

/// One edge of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelEdge {
    /// Its curve from start to end, m.
    pub curve: Curve,
    /// Its label in the file: `lower_interface` for a waist, `left_armhole`.
    pub label: Option<String>,
}

/// One piece of cloth: a closed loop of edges.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternPanel {
    /// Its name in the file.
    pub name: String,
    /// The part of the body it is for, if the file has it: `body`, `arm`, `leg`.
    pub label: Option<String>,
    /// Its edges in order: each starts at the end of the one before, the first at the end of the last.
    pub edges: Vec<PanelEdge>,
    /// Rotation from its plane (z = 0) to the space around the body.
    pub rotation: DMat3,
    /// The translation after it, m.
    pub translation: DVec3,
    /// Lines in its plane that a drawing shows and nothing else uses, m: notches, internal lines, the cut line around the sew line.
    pub drawn: Vec<Vec<DVec2>>,
}

impl PatternPanel {
    /// The position in space of a point of its plane, m.
    #[must_use]
    pub fn place(&self, flat: DVec2) -> DVec3 {
        self.rotation * flat.extend(0.0) + self.translation
    }

    /// Points along its loop, m, sixteen segments per edge.
    pub(super) fn points(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.edges.iter().flat_map(|edge| edge.curve.divided(16))
    }

    /// Area inside its loop, m²; negative for a clockwise loop.
    #[must_use]
    pub fn signed_area(&self) -> f64 {
        self.edges.iter().map(|edge| edge.curve.area()).sum()
    }
}

/// An edge by the indices of its panel and of itself in the panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeAt {
    /// Index of the panel.
    pub panel: usize,
    /// Index of the edge in it.
    pub edge: usize,
}

/// Two edges sewn together along their whole lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitch {
    /// The two edges.
    pub sides: [EdgeAt; 2],
    /// Whether one panel is turned over: start meets start, and the right side of one panel the wrong side of the other.
    pub right_wrong: bool,
}

/// Panels and stitches, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct SewingPattern {
    /// Its file's name without `_specification.json`.
    pub name: String,
    /// The panels, in the file's `panel_order`, else by name.
    pub panels: Vec<PatternPanel>,
    /// The stitches, in the file's order.
    pub stitches: Vec<Stitch>,
    /// Findings without consequences: unknown keys, lengths that gathering does not explain.
    pub notes: Vec<String>,
}

impl SewingPattern {
    /// Relative difference of the two lengths of a stitch from which it counts as gathered.
    pub(crate) const GATHERED: f64 = 0.02;

    /// The edge at these indices.
    pub(crate) fn edge(&self, at: EdgeAt) -> &PanelEdge {
        &self.panels[at.panel].edges[at.edge]
    }

    /// Lengths of the two sides of a stitch, m.
    #[must_use]
    pub fn lengths(&self, stitch: &Stitch) -> [f64; 2] {
        stitch.sides.map(|side| self.edge(side).curve.length())
    }

    /// Length of the longer side of a stitch over that of the shorter.
    #[must_use]
    pub fn gathering(&self, stitch: &Stitch) -> f64 {
        let [a, b] = self.lengths(stitch);
        a.max(b) / a.min(b)
    }

    /// An edge as messages name it.
    pub(crate) fn edge_name(&self, at: EdgeAt) -> String {
        format!("{}.{}", self.panels[at.panel].name, at.edge)
    }
}

/// The placement with z up and the front at −y.
pub(super) fn upright(degrees: DVec3, translation: DVec3) -> (DMat3, DVec3) {
    let [a, b, c] = degrees.to_array().map(f64::to_radians);
    let rotation = math::rotation(DVec3::Z, c) * math::rotation(DVec3::Y, b) * math::rotation(DVec3::X, a);
    let turn = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    (turn * rotation, turn * translation)
}
