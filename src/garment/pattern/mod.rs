//! Sewing patterns: flat panels, and which edge of which is sewn to which.
//!
//! Reads GarmentCode's JSON (`*_specification.json`), the open format that research garments come in
//! (Korosteleva and Sorkine-Hornung: "GarmentCode: Programming parametric sewing patterns", ACM TOG 42(6), 2023), checks
//! it, meshes the panels and sews them into one mesh that remembers its panels, its seams and where it lay flat.
//!
//! Lengths are metres; a panel lies in its own plane, x along the weft and y along the warp (the grain), as pattern makers
//! draw it. Panels are placed in space with z up and the body looking along −y, the body's left at +x: the file's y up and z to
//! the front become z and −y.
//!
//! Limits: a panel is one closed loop without holes or inner lines, as in the format; fabric, seam allowance and body are not
//! in the file.

mod check;
mod curve;
mod draw;
mod error;
mod layout;
mod outline;
mod panel_mesh;
mod read;
mod sew;
mod value;

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

pub use curve::Curve;
pub use error::PatternError;
pub use layout::laid_out;
pub use sew::{SewnGarment, SewnSeam};

use crate::base::files::{read_text, stem};

/// Edge length of a meshed pattern where none is asked for, m.
pub(crate) const DEFAULT_EDGE_M: f64 = 0.015;

/// One edge of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelEdge {
    /// Where it runs, m, from its start to its end.
    pub curve: Curve,
    /// What the file calls it: `lower_interface` for a waist, `left_armhole`.
    pub label: Option<String>,
}

/// One piece of cloth: a closed loop of edges.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternPanel {
    /// Its name in the file.
    pub name: String,
    /// The part of the body it is for, if the file says: `body`, `arm`, `leg`.
    pub label: Option<String>,
    /// Its edges: each begins where the one before ends, the first where the last does.
    pub edges: Vec<PanelEdge>,
    /// From its plane (z = 0) to the space about the body.
    pub rotation: DMat3,
    /// The same, m.
    pub translation: DVec3,
}

impl PatternPanel {
    /// A point of its plane (m) in space, m.
    #[must_use]
    pub fn place(&self, flat: DVec2) -> DVec3 {
        self.rotation * flat.extend(0.0) + self.translation
    }

    /// Its loop by points, m, sixteen parts an edge.
    fn points(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.edges.iter().flat_map(|edge| edge.curve.divided(16))
    }

    /// Area inside its loop, m²; negative where the loop runs clockwise.
    #[must_use]
    pub fn signed_area(&self) -> f64 {
        self.edges.iter().map(|edge| edge.curve.area()).sum()
    }
}

/// An edge by panel and place in it.
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
    /// Whether one piece is turned over: start meets start, and the right side of one the wrong side of the other.
    pub right_wrong: bool,
}

/// A pattern: panels and stitches, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct SewingPattern {
    /// What it is called: its file's name without `_specification.json`.
    pub name: String,
    /// The panels, in the file's order of preference, else by name.
    pub panels: Vec<PatternPanel>,
    /// The stitches, in the file's order.
    pub stitches: Vec<Stitch>,
    /// What was found that nothing is done about: keys that mean nothing here, lengths that gathering does not explain.
    pub notes: Vec<String>,
}

impl SewingPattern {
    /// Reads and checks a pattern.
    ///
    /// # Errors
    /// [`PatternError`] names the file, the panel and the edge.
    pub fn read(path: &Path) -> Result<Self, PatternError> {
        let file = path.display().to_string();
        let name = stem(&file);
        let name = name.strip_suffix("_specification").unwrap_or(&name);
        Self::parse(&read_text(path)?, name).map_err(|source| PatternError::In { file, source: Box::new(source) })
    }

    /// The same from a text.
    ///
    /// # Errors
    /// As there, without the file.
    pub fn parse(text: &str, name: &str) -> Result<Self, PatternError> {
        let mut pattern = read::pattern(text, name)?;
        check::pattern(&mut pattern)?;
        Ok(pattern)
    }

    /// The edge at a place.
    #[must_use]
    pub(crate) fn edge(&self, at: EdgeAt) -> &PanelEdge {
        &self.panels[at.panel].edges[at.edge]
    }

    /// Lengths of the two sides of a stitch, m.
    #[must_use]
    pub fn lengths(&self, stitch: &Stitch) -> [f64; 2] {
        stitch.sides.map(|side| self.edge(side).curve.length())
    }

    /// A stitch of which one edge is longer than the other by this is gathered, as a share.
    pub(crate) const GATHERED: f64 = 0.02;

    /// How much longer the longer side of a stitch is than the shorter, 1 and more.
    #[must_use]
    pub fn gathering(&self, stitch: &Stitch) -> f64 {
        let [a, b] = self.lengths(stitch);
        a.max(b) / a.min(b)
    }

    /// An edge as messages name it.
    #[must_use]
    pub(crate) fn edge_name(&self, at: EdgeAt) -> String {
        format!("{}.{}", self.panels[at.panel].name, at.edge)
    }
}
