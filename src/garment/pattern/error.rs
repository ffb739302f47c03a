//! Errors of sewing patterns, by panel and edge.

use crate::base::files::{Unreadable, listed};

/// A pattern that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum PatternError {
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// Any of the others, with the file.
    #[error("{file}: {source}")]
    In { file: String, source: Box<PatternError> },
    /// A text that is no JSON.
    #[error("this is no JSON: {reason}; expected a sewing pattern as GarmentCode writes it (*_specification.json)")]
    NotJson { reason: String },
    /// A panel or any other key that occurs twice.
    #[error("{reason}")]
    Repeated { reason: String },
    /// A text too long for a pattern.
    #[error(
        "found {megabytes:.1} MB of JSON, expected a sewing pattern of {most_mb} MB at most; is this another file?"
    )]
    TooLong { megabytes: f64, most_mb: usize },
    /// A missing key.
    #[error("{place}: found no \"{key}\", expected {expected}")]
    Missing { place: String, key: &'static str, expected: &'static str },
    /// A value of another type or out of range.
    #[error("{place}: found {found}, expected {expected}")]
    Wrong { place: String, found: String, expected: String },
    /// A loop that is not closed.
    #[error(
        "panel {panel}: edge {edge} begins at vertex {found}, expected {expected}, where edge {before} ends: the loop is open"
    )]
    Open { panel: String, edge: usize, before: usize, found: usize, expected: usize },
    /// An edge without length.
    #[error(
        "panel {panel}, edge {edge}: its length is {length_cm:.4} cm, expected 0.01 cm or more; join its vertices, or leave it out"
    )]
    Short { panel: String, edge: usize, length_cm: f64 },
    /// A loop that crosses itself.
    #[error(
        "panel {panel}: edges {first} and {second} cross near ({x_cm:.2}, {y_cm:.2}) cm, expected a loop that does not cross itself"
    )]
    Crossing { panel: String, first: usize, second: usize, x_cm: f64, y_cm: f64 },
    /// A stitch to a panel that does not exist.
    #[error("stitch {stitch}: found no panel \"{found}\", expected one of {}", listed(known))]
    NoPanel { stitch: usize, found: String, known: Vec<String> },
    /// A stitch to an edge that does not exist.
    #[error("stitch {stitch}: found edge {found} of panel {panel}, expected one of its edges 0 to {last}")]
    NoEdge { stitch: usize, panel: String, found: u64, last: usize },
    /// An edge in two stitches.
    #[error(
        "stitches {first} and {second} both sew edge {edge} of panel {panel}, expected each edge in one stitch at most; split the edge"
    )]
    Twice { panel: String, edge: usize, first: usize, second: usize },
    /// A stitch whose lengths differ too much.
    #[error(
        "stitch {stitch}: {a} is {a_cm:.1} cm long and {b} {b_cm:.1} cm, expected lengths within a factor of {most}: \
         gathering explains no more; are these the edges that were meant?"
    )]
    Lengths { stitch: usize, a: String, a_cm: f64, b: String, b_cm: f64, most: f64 },
    /// An edge length that makes too many vertices.
    #[error(
        "an edge length of {edge_cm} cm makes about {found} vertices of this pattern, expected {most} at most; ask for longer edges"
    )]
    TooFine { edge_cm: f64, found: usize, most: usize },
    /// An edge length out of range.
    #[error("found an edge length of {found_cm} cm, expected {low_cm} to {high_cm} cm")]
    EdgeLength { found_cm: f64, low_cm: f64, high_cm: f64 },
    /// A panel that cannot be triangulated.
    #[error("panel {panel}: it cannot be meshed: {reason}")]
    NoMesh { panel: String, reason: String },
}
