//! The lines, points and texts of a DXF file (Autodesk, release 13 and later), by block and layer.
//!
//! A DXF text is a list of pairs of lines: a group code and a value. Of the entities those of ASTM D6673 are read: POLYLINE (as the
//! standard has it) and LWPOLYLINE with their arcs, LINE, POINT and TEXT. Curves that the standard does not allow are named, so that a
//! missing outline can be explained.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::base::math;
use crate::garment::pattern::PatternError;

/// Most pairs of a file; patterns of a hundred pieces have some hundred thousand.
const MAX_PAIRS: usize = 4_000_000;
/// Largest coordinate in any unit.
const MAX_NUMBER: f64 = 1e6;
/// Largest angle of a piece of an arc, radians: 3 degrees, which is 0.03 mm off an arc of 10 cm.
const ARC_STEP: f64 = TAU / 120.0;

/// The geometry or the text of an entity.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A line through points; the first stands again at the end of a closed one.
    Line(Vec<DVec2>),
    Point(DVec2),
    Text(String),
    /// A curve of a kind that the standard has not, by its name in the file.
    Other(String),
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entity {
    pub(super) layer: String,
    pub(super) shape: Shape,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Block {
    pub(super) name: String,
    pub(super) entities: Vec<Entity>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Drawing {
    /// `$INSUNITS` of the header: 1 for inches, 4 for millimetres, 5 for centimetres, 6 for metres.
    pub(super) units: Option<i64>,
    pub(super) blocks: Vec<Block>,
    /// Entities in no block.
    pub(super) loose: Vec<Entity>,
}

/// A group code, its value, and the number of the line of the value.
#[derive(Clone, Copy)]
struct Pair<'a> {
    code: i32,
    value: &'a str,
    line: usize,
}

impl Pair<'_> {
    fn number(&self) -> Result<f64, PatternError> {
        let number = self.value.parse().ok().filter(|x: &f64| x.abs() <= MAX_NUMBER);
        number.ok_or_else(|| self.wrong(&format!("a number from -{MAX_NUMBER:.0} to {MAX_NUMBER:.0}")))
    }

    fn whole(&self) -> Result<i64, PatternError> {
        self.value.parse().map_err(|_| self.wrong("a whole number"))
    }

    fn wrong(&self, expected: &str) -> PatternError {
        let found: String = self.value.chars().take(40).collect();
        PatternError::unexpected(
            &format!("line {}", self.line),
            &format!("\"{found}\" for code {}", self.code),
            expected,
        )
    }
}

fn pairs(text: &str) -> Result<Vec<Pair<'_>>, PatternError> {
    let mut pairs = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((number, code)) = lines.next() {
        let code = code.trim_start_matches('\u{feff}').trim();
        if code.is_empty() && lines.clone().all(|(_, line)| line.trim().is_empty()) {
            break;
        }
        let wrong = || {
            let found: String = code.chars().take(40).collect();
            let expected = "a group code, a whole number; is this a DXF as text?";
            PatternError::unexpected(&format!("line {}", number + 1), &format!("\"{found}\""), expected)
        };
        let code = code.parse().map_err(|_| wrong())?;
        let Some((_, value)) = lines.next() else {
            return Err(PatternError::Invalid(
                "the file ends after a group code, expected its value; it is cut off".to_owned(),
            ));
        };
        if pairs.len() == MAX_PAIRS {
            return Err(PatternError::Invalid(format!(
                "found more than {MAX_PAIRS} pairs of lines, expected a sewing pattern"
            )));
        }
        pairs.push(Pair { code, value: value.trim(), line: number + 2 });
    }
    Ok(pairs)
}

/// A polyline that is being read: its entity, its points with their bulges, and whether it is closed.
type Polyline = (Entity, Vec<(DVec2, f64)>, bool);

impl Drawing {
    /// Parses a DXF text.
    pub(super) fn parse(text: &str) -> Result<Self, PatternError> {
        let mut drawing = Self::default();
        let pairs = pairs(text)?;
        let mut block: Option<Block> = None;
        let mut polyline: Option<Polyline> = None;
        let mut section = "";
        let mut rest = &pairs[..];
        while let [first, others @ ..] = rest {
            let length = others.iter().position(|pair| pair.code == 0).unwrap_or(others.len());
            let (body, next) = others.split_at(length);
            rest = next;
            if first.code != 0 {
                continue;
            }
            let value = |code| body.iter().find(|pair| pair.code == code);
            match (first.value, section) {
                ("SECTION", _) => {
                    section = value(2).map_or("", |pair| pair.value);
                    if section == "HEADER" {
                        let units = body.iter().skip_while(|pair| pair.value != "$INSUNITS").nth(1);
                        drawing.units = units.map(Pair::whole).transpose()?;
                    }
                }
                ("ENDSEC", _) => section = "",
                ("BLOCK", "BLOCKS") => {
                    let name = value(2).map_or("", |pair| pair.value).to_owned();
                    block = Some(Block { name, entities: Vec::new() });
                }
                ("ENDBLK", _) => drawing.blocks.extend(block.take()),
                (kind, "BLOCKS" | "ENTITIES") => {
                    let layer = value(8).map_or("", |pair| pair.value).to_owned();
                    let done = match kind {
                        "POLYLINE" => {
                            let closed = value(70).map_or(Ok(0), Pair::whole)? & 1 == 1;
                            polyline = Some((Entity { layer, shape: Shape::Line(Vec::new()) }, Vec::new(), closed));
                            None
                        }
                        "VERTEX" => {
                            if let Some((_, points, _)) = &mut polyline {
                                points.push((point(body, [10, 20])?, value(42).map_or(Ok(0.0), Pair::number)?));
                            }
                            None
                        }
                        "SEQEND" => polyline.take().map(|(entity, points, closed)| Entity {
                            shape: Shape::Line(line(&points, closed)),
                            ..entity
                        }),
                        "LWPOLYLINE" => {
                            let closed = value(70).map_or(Ok(0), Pair::whole)? & 1 == 1;
                            Some(Entity { layer, shape: Shape::Line(line(&light_points(body)?, closed)) })
                        }
                        "LINE" => {
                            let ends = vec![point(body, [10, 20])?, point(body, [11, 21])?];
                            Some(Entity { layer, shape: Shape::Line(ends) })
                        }
                        "POINT" => Some(Entity { layer, shape: Shape::Point(point(body, [10, 20])?) }),
                        "TEXT" | "MTEXT" => {
                            let text = value(1).map_or("", |pair| pair.value).to_owned();
                            Some(Entity { layer, shape: Shape::Text(text) })
                        }
                        "SPLINE" | "ARC" | "CIRCLE" | "ELLIPSE" => {
                            Some(Entity { layer, shape: Shape::Other(kind.to_owned()) })
                        }
                        _ => None,
                    };
                    block.as_mut().map_or(&mut drawing.loose, |block| &mut block.entities).extend(done);
                }
                _ => {}
            }
        }
        if drawing.blocks.is_empty() && drawing.loose.is_empty() {
            return Err(PatternError::Invalid(
                "found neither blocks nor entities, expected a DXF with a block for each piece (ASTM D6673, AAMA)"
                    .to_owned(),
            ));
        }
        Ok(drawing)
    }
}

fn point(body: &[Pair<'_>], codes: [i32; 2]) -> Result<DVec2, PatternError> {
    let number = |code| body.iter().find(|pair| pair.code == code).map_or(Ok(0.0), Pair::number);
    Ok(DVec2::new(number(codes[0])?, number(codes[1])?))
}

/// Vertices and bulges of an LWPOLYLINE, whose codes repeat.
fn light_points(body: &[Pair<'_>]) -> Result<Vec<(DVec2, f64)>, PatternError> {
    let mut points: Vec<(DVec2, f64)> = Vec::new();
    for pair in body {
        match (pair.code, points.last_mut()) {
            (10, _) => points.push((DVec2::new(pair.number()?, 0.0), 0.0)),
            (20, Some((p, _))) => p.y = pair.number()?,
            (42, Some((_, bulge))) => *bulge = pair.number()?,
            _ => {}
        }
    }
    Ok(points)
}

/// The points of a polyline; an arc with the bulge b (the tangent of a quarter of its angle) in short pieces.
fn line(vertices: &[(DVec2, f64)], closed: bool) -> Vec<DVec2> {
    let Some(&(first, _)) = vertices.first() else { return Vec::new() };
    let mut points = vec![first];
    let next = vertices.iter().skip(1).map(|(p, _)| *p).chain(closed.then_some(first));
    for (&(a, bulge), b) in vertices.iter().zip(next) {
        let turn = 4.0 * math::atan2(bulge, 1.0);
        if bulge != 0.0 && a != b {
            // The centre is on the bisector of the chord.
            let half = 0.5 * (b - a);
            let centre = a + half + half.perp() * (1.0 - bulge * bulge) / (2.0 * bulge);
            let count = (turn.abs() / ARC_STEP).ceil().max(1.0) as usize;
            let radius = a - centre;
            points.extend((1..count).map(|i| {
                let (sin, cos) = math::sin_cos(turn * i as f64 / count as f64);
                centre + DVec2::new(cos * radius.x - sin * radius.y, sin * radius.x + cos * radius.y)
            }));
        }
        points.push(b);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_of_a_polyline_keeps_its_radius_and_side() {
        // Bulge 1: half a circle, to the right of a → b.
        let points = line(&[(DVec2::ZERO, 1.0), (DVec2::new(2.0, 0.0), 0.0)], false);
        assert!(points.len() > 50 && points.iter().all(|p| (p.distance(DVec2::X) - 1.0).abs() < 1e-12));
        assert!(points[points.len() / 2].distance(DVec2::new(1.0, -1.0)) < 1e-3, "{:?}", points[points.len() / 2]);
        // A quarter the other way.
        let points = line(&[(DVec2::ZERO, -(TAU / 16.0).tan()), (DVec2::new(1.0, 1.0), 0.0)], false);
        assert!(points.iter().all(|p| (p.distance(DVec2::X) - 1.0).abs() < 1e-12), "{points:?}");
    }
}
