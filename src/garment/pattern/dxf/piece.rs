//! One piece of cloth of a DXF pattern: its outline, divided into edges.
//!
//! The layers are those of ASTM D6673-10 and AAMA-292: 1 cut line, 2 turn points, 4 notches, 6 mirror line, 7 grain, 8 internal lines,
//! 11 cut-outs, 14 sew line. The outline is the sew line where that is closed, else the cut line. Turn points divide it into edges, or
//! its corners where it has none. A piece with a mirror line is half of one, and is unfolded. The grain becomes the y axis. In metres,
//! the centre of the box is the origin, the loop runs counter-clockwise, the right side of the cloth is seen.

use std::sync::Arc;

use glam::DVec2;

use super::drawing::{Block, Shape};
use crate::base::math;
use crate::garment::pattern::PatternError;
use crate::garment::pattern::curve::Curve;

/// Ends of lines this close, m, are one point.
const TOUCHING: f64 = 5e-4;
/// Widest gap of an outline that is closed, m; a wider one is a missing line.
const MAX_GAP: f64 = 3e-3;
/// Farthest distance of a turn point from its corner, and of a notch from the outline, m.
const TURN_POINT_REACH: f64 = 1e-3;
const NOTCH_REACH: f64 = 5e-3;
/// Least change of direction at a corner, radians: 25 degrees. Curves are drawn with some degrees a point.
const CORNER: f64 = 0.44;
/// Points of an outline closer than this, m, are one.
const SAME: f64 = 1e-6;
/// Most points of an outline, and most lines of which one is made; each is compared with the others.
const MAX_POINTS: usize = 20_000;
const MAX_LINES: usize = 4_000;

/// A piece, whose panels may be several.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub(super) name: String,
    pub(super) size: Option<String>,
    pub(super) quantity: Option<String>,
    /// Points of the closed outline, m.
    outline: Vec<DVec2>,
    /// Indices of the points at which edges begin, ascending.
    corners: Vec<usize>,
    /// Points at which edges begin if notches divide them.
    notched: Vec<usize>,
    /// Lines that are drawn only: the cut line around a sew line, notches, internal lines.
    drawn: Vec<Vec<DVec2>>,
    pub(super) notes: Vec<String>,
}

/// The value of a text such as "Piece Name: FRONT".
pub(super) fn text_value<'a>(texts: impl IntoIterator<Item = &'a str>, key: &str) -> Option<String> {
    texts.into_iter().find_map(|text| {
        let (name, value) = text.split_once(':')?;
        let value = value.trim();
        (name.trim().eq_ignore_ascii_case(key) && !value.is_empty()).then(|| value.to_owned())
    })
}

impl Piece {
    /// The piece in a block, `None` where it has no outline layer.
    pub(super) fn of(block: &Block, metres_per_unit: f64) -> Result<Option<Self>, PatternError> {
        let texts: Vec<&str> = block
            .entities
            .iter()
            .filter_map(|e| if let Shape::Text(t) = &e.shape { Some(t.as_str()) } else { None })
            .collect();
        let name = text_value(texts.iter().copied(), "piece name").unwrap_or_else(|| block.name.clone());
        let wrong = |problem: String| PatternError::Invalid(format!("piece {name}: {problem}"));
        let lines = |layer: &str| -> Vec<Vec<DVec2>> {
            let of_layer = block.entities.iter().filter(|e| e.layer == layer);
            let lines = of_layer.filter_map(|e| if let Shape::Line(points) = &e.shape { Some(points) } else { None });
            lines.filter(|p| p.len() > 1).map(|p| p.iter().map(|p| metres_per_unit * *p).collect()).collect()
        };
        let points = |layer: &str| -> Vec<DVec2> {
            let of_layer = block.entities.iter().filter(|e| e.layer == layer);
            let points = of_layer.filter_map(|e| match &e.shape {
                Shape::Point(p) => Some(*p),
                Shape::Line(points) if layer == "4" => points.first().copied(),
                _ => None,
            });
            points.map(|p| metres_per_unit * p).collect()
        };
        let other = block.entities.iter().find_map(|e| match &e.shape {
            Shape::Other(kind) if e.layer == "1" || e.layer == "14" => Some((kind, &e.layer)),
            _ => None,
        });
        if let Some((kind, layer)) = other {
            return Err(wrong(format!(
                "found a {kind} on layer {layer}, expected polylines, as ASTM D6673 has them; export curves as polylines"
            )));
        }
        let (cut, sew) = (lines("1"), lines("14"));
        if cut.is_empty() && sew.is_empty() {
            return Ok(None);
        }
        if let Some(found) = [cut.len(), sew.len()].into_iter().find(|&count| count > MAX_LINES) {
            return Err(wrong(format!(
                "found {found} lines on layer 1 or 14, expected {MAX_LINES} at most; join them to polylines"
            )));
        }
        let mut notes = Vec::new();
        let (cut, sew) = (closed(cut), closed(sew));
        let (outline, gap) = match (sew, cut) {
            (Some(Ok(sew)), _) => sew,
            (Some(Err(_)), Some(Ok(cut))) => {
                notes.push("its sew lines (layer 14) form no closed outline; took the cut line (layer 1), with any seam allowance".to_owned());
                cut
            }
            (None, Some(Ok(cut))) => {
                notes.push(
                    "it has no sew line (layer 14); took the cut line (layer 1), with any seam allowance".to_owned(),
                );
                cut
            }
            (_, Some(Err(open))) | (Some(Err(open)), None) => return Err(wrong(open.message(metres_per_unit))),
            (None, None) => return Ok(None),
        };
        if gap > TOUCHING {
            notes.push(format!("closed a gap of {:.1} mm in its outline", 1e3 * gap));
        }
        if outline.len() > MAX_POINTS {
            return Err(wrong(format!("found an outline of {} points, expected {MAX_POINTS} at most", outline.len())));
        }
        let mut drawn: Vec<Vec<DVec2>> = ["1", "8", "11", "4"].iter().flat_map(|layer| lines(layer)).collect();
        let turn_points = points("2");
        let mut piece = Self {
            size: text_value(texts.iter().copied(), "size"),
            quantity: text_value(texts, "quantity"),
            corners: corners(&outline, &turn_points),
            notched: Vec::new(),
            outline,
            drawn: Vec::new(),
            notes,
            name: name.clone(),
        };
        piece.add_notches(&points("4"));
        // A notch is drawn as a cross of 4 mm.
        let arms = [DVec2::new(2e-3, 0.0), DVec2::new(0.0, 2e-3)];
        drawn.extend(points("4").iter().flat_map(|&p| arms.map(|arm| vec![p - arm, p + arm])));
        piece.drawn = drawn;
        if let Some(mirror) = lines("6").first() {
            piece.unfold(mirror[0], mirror[mirror.len() - 1]).map_err(wrong)?;
        }
        match lines("7").first() {
            Some(grain) => piece.turn_grain(grain[grain.len() - 1] - grain[0]),
            None => piece.notes.push("it has no grain line (layer 7); took y for the grain".to_owned()),
        }
        piece.centre();
        if piece.area() < 0.0 {
            piece.reverse();
        }
        Ok(Some(piece))
    }

    fn area(&self) -> f64 {
        let n = self.outline.len();
        (0..n).map(|i| 0.5 * self.outline[i].perp_dot(self.outline[(i + 1) % n])).sum()
    }

    /// Width and height, m.
    pub(super) fn size_m(&self) -> DVec2 {
        let (low, high) = self.bounds();
        high - low
    }

    fn bounds(&self) -> (DVec2, DVec2) {
        let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        self.outline.iter().fold(none, |(low, high), p| (low.min(*p), high.max(*p)))
    }

    fn map(&mut self, to: impl Fn(DVec2) -> DVec2) {
        let drawn = self.drawn.iter_mut().flatten();
        self.outline.iter_mut().chain(drawn).for_each(|p| *p = to(*p));
    }

    fn centre(&mut self) {
        let (low, high) = self.bounds();
        self.map(|p| p - 0.5 * (low + high));
    }

    /// Turns the piece by the smaller angle that lays the grain along y; a grain along x becomes +y.
    fn turn_grain(&mut self, grain: DVec2) {
        let along = grain.normalize_or(DVec2::Y);
        let along = if along.y < -1e-9 || (along.y.abs() <= 1e-9 && along.x < 0.0) { -along } else { along };
        self.map(|p| DVec2::new(p.x * along.y - p.y * along.x, p.x * along.x + p.y * along.y));
    }

    /// Reverses the loop; edges keep their points, and are numbered from the same first corner on.
    fn reverse(&mut self) {
        let n = self.outline.len();
        let turned = |corners: &[usize]| {
            let mut corners: Vec<usize> = corners.iter().map(|&c| (n - c) % n).collect();
            corners.sort_unstable();
            corners
        };
        (self.corners, self.notched) = (turned(&self.corners), turned(&self.notched));
        self.outline[1..].reverse();
    }

    /// The piece seen from the other side, for the panel of the other side of the body.
    pub(super) fn mirrored(mut self) -> Self {
        self.map(|p| DVec2::new(-p.x, p.y));
        self.reverse();
        self
    }

    /// Inserts points where notches are.
    fn add_notches(&mut self, notches: &[DVec2]) {
        for &notch in notches {
            let n = self.outline.len();
            let nearest = (0..n).map(|i| {
                let (a, b) = (self.outline[i], self.outline[(i + 1) % n]);
                let share = ((notch - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                (a.lerp(b, share).distance(notch), i, a.lerp(b, share))
            });
            let Some((distance, i, at)) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
            if distance > NOTCH_REACH {
                self.notes.push(format!("a notch is {:.1} mm off its outline, and divides no edge", 1e3 * distance));
                continue;
            }
            let next = (i + 1) % n;
            let place = if at.distance(self.outline[i]) < TURN_POINT_REACH {
                i
            } else if at.distance(self.outline[next]) < TURN_POINT_REACH {
                next
            } else {
                self.outline.insert(i + 1, at);
                let moved = |c: &mut usize| *c += usize::from(*c > i);
                self.corners.iter_mut().for_each(moved);
                self.notched.iter_mut().for_each(moved);
                i + 1
            };
            self.notched.push(place);
        }
    }

    /// Adds the mirror image of a half piece: the edge on the line goes, the others are there twice.
    fn unfold(&mut self, a: DVec2, b: DVec2) -> Result<(), String> {
        let along = (b - a).normalize_or_zero();
        let n = self.outline.len();
        let off = |i: usize| (self.outline[i % n] - a).perp_dot(along).abs();
        let on_fold = |i: usize| off(i) < TURN_POINT_REACH && off(i + 1) < TURN_POINT_REACH;
        // The points after the edge on the fold up to the one before it.
        let Some(last) = (0..n).filter(|&i| on_fold(i)).max_by(|&i, &j| {
            let length = |i: usize| self.outline[i].distance(self.outline[(i + 1) % n]);
            length(i).total_cmp(&length(j))
        }) else {
            return Err(
                "found a mirror line (layer 6) that is no edge of it, expected the fold of a half piece; unfold it"
                    .to_owned(),
            );
        };
        let half: Vec<usize> = (1..=n).map(|k| (last + k) % n).collect();
        let image = |p: DVec2| a + 2.0 * along * (p - a).dot(along) - (p - a);
        let ends = [half[0], half[n - 1]];
        let second = || half.iter().rev().filter(|i| !ends.contains(i));
        let place = |i: usize| half.iter().position(|&h| h == i).unwrap_or(0);
        let twice = |corners: &[usize]| {
            let first = corners.iter().map(|&c| place(c));
            let mut all: Vec<usize> =
                first.clone().filter(|&k| k > 0 && k < n - 1).flat_map(|k| [k, 2 * n - 2 - k]).collect();
            all.sort_unstable();
            all
        };
        let mut corners = twice(&self.corners);
        let notched = twice(&self.notched);
        let outline: Vec<DVec2> =
            half.iter().map(|&i| self.outline[i]).chain(second().map(|&i| image(self.outline[i]))).collect();
        // An end on the fold is a corner if the whole piece has one there.
        for end in [0, n - 1] {
            if is_corner(&outline, end) {
                corners.push(end);
            }
        }
        corners.sort_unstable();
        (self.outline, self.corners, self.notched) = (outline, corners, notched);
        let images: Vec<Vec<DVec2>> = self.drawn.iter().map(|line| line.iter().map(|p| image(*p)).collect()).collect();
        self.drawn.extend(images);
        self.notes.push("unfolded along its mirror line (layer 6)".to_owned());
        Ok(())
    }

    /// The edges of its loop, and the lines that are drawn only.
    pub(super) fn edges(&self, with_notches: bool) -> (Vec<Curve>, Vec<Vec<DVec2>>) {
        let mut corners = self.corners.clone();
        if with_notches {
            corners.extend(&self.notched);
        }
        corners.sort_unstable();
        corners.dedup();
        let n = self.outline.len();
        // A loop has two edges at least.
        while corners.len() < 2 {
            corners.push((corners.first().copied().unwrap_or(0) + corners.len() * n / 2) % n);
            corners.sort_unstable();
        }
        let curve = |k: usize| {
            let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
            let to = if to > from { to } else { to + n };
            let points: Arc<[DVec2]> = (from..=to).map(|i| self.outline[i % n]).collect();
            if let [a, b] = points[..] { Curve::Line { a, b } } else { Curve::Polyline { points } }
        };
        ((0..corners.len()).map(curve).collect(), self.drawn.clone())
    }
}

/// An outline that does not close.
struct Open {
    from: DVec2,
    to: DVec2,
}

impl Open {
    fn message(&self, metres_per_unit: f64) -> String {
        let [from, to] = [self.from, self.to].map(|p| p / metres_per_unit);
        format!(
            "its outline is open: found a gap of {:.1} mm from ({:.3}, {:.3}) to ({:.3}, {:.3}) of the file, expected a closed line on \
             layer 1 or 14; close it",
            1e3 * self.from.distance(self.to),
            from.x,
            from.y,
            to.x,
            to.y
        )
    }
}

/// The loop of largest area that lines form, and the widest gap that was closed in it, m; `None` without lines.
fn closed(mut lines: Vec<Vec<DVec2>>) -> Option<Result<(Vec<DVec2>, f64), Open>> {
    // Area, points and widest gap.
    let mut best: Option<(f64, Vec<DVec2>, f64)> = None;
    let mut open: Option<Open> = None;
    while let Some(mut chain) = lines.pop() {
        let mut widest = 0.0_f64;
        loop {
            let (first, last) = (chain[0], chain[chain.len() - 1]);
            if chain.len() > 2 && first.distance(last) <= TOUCHING {
                break;
            }
            let end = |line: &Vec<DVec2>| last.distance(line[0]).min(last.distance(line[line.len() - 1]));
            let next = (0..lines.len()).min_by(|&i, &j| end(&lines[i]).total_cmp(&end(&lines[j])));
            let Some(next) = next.filter(|&i| end(&lines[i]) <= MAX_GAP) else { break };
            let mut line = lines.swap_remove(next);
            widest = widest.max(end(&line));
            if last.distance(line[0]) > last.distance(line[line.len() - 1]) {
                line.reverse();
            }
            // The ends are one point.
            chain.extend(line.drain(1..));
        }
        let (first, last) = (chain[0], chain[chain.len() - 1]);
        if first.distance(last) > MAX_GAP || chain.len() < 3 {
            open = open.or(Some(Open { from: last, to: first }));
            continue;
        }
        widest = widest.max(first.distance(last));
        if first.distance(last) > TOUCHING {
            // A side across the gap could run back over the first one.
            chain.pop();
        }
        chain.dedup_by(|a, b| a.distance(*b) < SAME);
        while chain.len() > 1 && chain[0].distance(chain[chain.len() - 1]) <= TOUCHING {
            chain.pop();
        }
        let n = chain.len();
        let area: f64 = (0..n).map(|i| 0.5 * chain[i].perp_dot(chain[(i + 1) % n])).sum();
        if n >= 3 && best.as_ref().is_none_or(|(most, ..)| area.abs() > *most) {
            best = Some((area.abs(), chain, widest));
        }
    }
    match (best, open) {
        (Some((_, chain, gap)), _) => Some(Ok((chain, gap))),
        (None, Some(open)) => Some(Err(open)),
        (None, None) => None,
    }
}

/// Whether the direction changes at a point of a closed outline by [`CORNER`] or more.
fn is_corner(outline: &[DVec2], i: usize) -> bool {
    let n = outline.len();
    let (before, after) = (outline[i] - outline[(i + n - 1) % n], outline[(i + 1) % n] - outline[i]);
    math::atan2(before.perp_dot(after), before.dot(after)).abs() >= CORNER
}

/// The points nearest to the turn points of a piece, or its corners where fewer than two lie on the outline.
fn corners(outline: &[DVec2], turn_points: &[DVec2]) -> Vec<usize> {
    let nearest = |p: &DVec2| {
        let all = (0..outline.len()).map(|i| (outline[i].distance(*p), i));
        all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(distance, _)| *distance < TURN_POINT_REACH).map(|(_, i)| i)
    };
    let found = crate::mesh::each_once(turn_points.iter().filter_map(nearest));
    if found.len() >= 2 { found } else { (0..outline.len()).filter(|&i| is_corner(outline, i)).collect() }
}
