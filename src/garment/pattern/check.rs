//! Checks of a pattern: edges have a length, loops do not cross themselves, and each edge is sewn at most once, to one of
//! similar length.

use std::collections::BTreeMap;

use glam::DVec2;

use super::curve::Curve;
use super::error::PatternError;
use super::panels::{EdgeAt, SewingPattern};

/// Least length of an edge, m.
const MIN_LENGTH: f64 = 1e-4;

/// Ratio of a stitch's lengths from which a note is made: ruffles are cut two to three times as long.
const NOTED_RATIO: f64 = 3.0;
/// Largest accepted ratio. A heuristic.
const MAX_RATIO: f64 = 10.0;

/// Chords by which a curve is tested for crossings.
const CHORDS: usize = 16;

pub(super) fn check(pattern: &mut SewingPattern) -> Result<(), PatternError> {
    for panel in &pattern.panels {
        for (edge, e) in panel.edges.iter().enumerate() {
            let length = e.curve.length();
            // The negation also rejects NaN.
            if !(length >= MIN_LENGTH && length.is_finite()) {
                return Err(PatternError::Invalid(format!(
                    "panel {}, edge {edge}: its length is {:.4} cm, expected 0.01 cm or more; join its vertices, or leave it out",
                    panel.name,
                    100.0 * length
                )));
            }
        }
        let chords: Vec<Chord> = (panel.edges.iter().enumerate())
            .flat_map(|(edge, e)| {
                let count = if let Curve::Line { .. } = e.curve { 1 } else { CHORDS };
                let points = e.curve.divided(count);
                (0..count).map(|i| Chord { edge, from: points[i], to: points[i + 1] }).collect::<Vec<_>>()
            })
            .collect();
        if let Some((first, second, at)) = crossing(&chords) {
            let (panel, at_cm) = (&panel.name, 100.0 * at);
            return Err(PatternError::Invalid(format!(
                "panel {panel}: edges {first} and {second} cross near ({:.2}, {:.2}) cm, expected a loop that does not cross itself",
                at_cm.x, at_cm.y
            )));
        }
    }
    stitches(pattern)
}

struct Chord {
    edge: usize,
    from: DVec2,
    to: DVec2,
}

/// The first two chords that cross or overlap, and the point.
fn crossing(chords: &[Chord]) -> Option<(usize, usize, DVec2)> {
    let n = chords.len();
    for i in 0..n {
        for j in i + 1..n {
            let (a, b) = (&chords[i], &chords[j]);
            let neighbours = j == i + 1 || (i == 0 && j == n - 1);
            let at = if neighbours { folded(a, b, j == i + 1) } else { meeting(a, b) };
            if let Some(at) = at {
                return Some((a.edge, b.edge, at));
            }
        }
    }
    None
}

/// The point where two segments meet.
fn meeting(a: &Chord, b: &Chord) -> Option<DVec2> {
    let (low, high) = (a.from.min(a.to), a.from.max(a.to));
    if b.from.min(b.to).cmpgt(high).any() || b.from.max(b.to).cmplt(low).any() {
        return None;
    }
    let side = |c: &Chord, p: DVec2| (c.to - c.from).perp_dot(p - c.from);
    let (s, t) = (side(a, b.from), side(a, b.to));
    let (u, v) = (side(b, a.from), side(b, a.to));
    let apart = |x: f64, y: f64| (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0);
    if apart(s, t) || apart(u, v) {
        return None;
    }
    // Of collinear segments the boxes decide whether they meet.
    Some(if s == t { b.from } else { b.from.lerp(b.to, s / (s - t)) })
}

/// The start of an edge that runs straight back over the one before.
fn folded(a: &Chord, b: &Chord, in_order: bool) -> Option<DVec2> {
    let (a, b) = if in_order { (a, b) } else { (b, a) };
    let (back, on) = (a.from - a.to, b.to - b.from);
    let flat = back.perp_dot(on).abs() <= 1e-9 * back.length() * on.length();
    (flat && back.dot(on) > 0.0).then_some(b.from)
}

fn stitches(pattern: &mut SewingPattern) -> Result<(), PatternError> {
    let mut sewn: BTreeMap<EdgeAt, usize> = BTreeMap::new();
    let mut notes = Vec::new();
    for (number, stitch) in pattern.stitches.iter().enumerate() {
        for side in stitch.sides {
            if let Some(first) = sewn.insert(side, number) {
                let (panel, edge) = (&pattern.panels[side.panel].name, side.edge);
                return Err(PatternError::Invalid(format!(
                    "stitches {first} and {number} both sew edge {edge} of panel {panel}, \
                     expected each edge in one stitch at most; split the edge"
                )));
            }
        }
        let ([a_m, b_m], ratio) = (pattern.lengths(stitch), pattern.gathering(stitch));
        let [a, b] = stitch.sides.map(|side| pattern.edge_name(side));
        let (a_cm, b_cm) = (100.0 * a_m, 100.0 * b_m);
        if ratio > MAX_RATIO {
            return Err(PatternError::Invalid(format!(
                "stitch {number}: {a} is {a_cm:.1} cm long and {b} {b_cm:.1} cm, expected lengths within a factor of {MAX_RATIO}: \
                 gathering explains no more; are these the edges that were meant?"
            )));
        }
        if ratio > NOTED_RATIO {
            notes.push(format!(
                "stitch {number}: {a} ({a_cm:.1} cm) and {b} ({b_cm:.1} cm) differ by a factor of {ratio:.1}"
            ));
        }
    }
    pattern.notes.extend(notes);
    Ok(())
}
