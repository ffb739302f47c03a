//! GarmentCode's JSON to panels and stitches in metres.
//!
//! A control point [u, w] of an edge a → b is a + u d + w l with d = b − a and l = (−d.y, d.x); in files with
//! `curvature_coords` = `absolute` it is a coordinate. A panel point (x, y) is placed at Rz Ry Rx (x, y, 0) + translation,
//! angles in degrees.

use std::fmt;
use std::path::Path;

use glam::{DVec2, DVec3};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::error::Category;
use serde_json::{Map, Value};

use super::check;
use super::curve::Curve;
use super::dxf;
use super::error::PatternError;
use super::panels::{EdgeAt, PanelEdge, PatternPanel, SewingPattern, Stitch, upright};
use crate::base::files::{listed, read_text, stem};

/// Longest accepted file, MB. The 115,000 patterns of the public data set have at most 60 kB.
const MAX_MB: usize = 4;
/// Most panels, and most edges of a panel; a file with more is no sewing pattern.
const MAX_PANELS: usize = 500;
const MAX_EDGES: usize = 300;

/// Largest coordinate in the pattern's own unit: a hundred metres in centimetres.
const MAX_NUMBER: f64 = 1e4;

/// Most characters of a value that a message quotes.
const MAX_QUOTE: usize = 60;

/// The file's conventions.
struct Properties {
    metres_per_unit: f64,
    relative: bool,
}

/// Reads and checks the pattern in a file: GarmentCode's JSON, or a DXF with the TOML file beside it that says how it is sewn.
///
/// # Errors
/// [`PatternError`] names the file, the panel and the edge.
pub fn read(path: &Path) -> Result<SewingPattern, PatternError> {
    read_as(path, true)
}

/// [`read`], also of a DXF that nothing says how to sew; its pieces are panels then.
///
/// # Errors
/// As [`read`].
pub fn read_unsewn(path: &Path) -> Result<SewingPattern, PatternError> {
    read_as(path, false)
}

fn read_as(path: &Path, must_be_sewn: bool) -> Result<SewingPattern, PatternError> {
    let file = path.display().to_string();
    if dxf::is_dxf(path) {
        return dxf::read(path, must_be_sewn).map_err(|source| PatternError::In { file, source: Box::new(source) });
    }
    let name = stem(&file);
    let name = name.strip_suffix("_specification").unwrap_or(&name);
    parse(&read_text(path)?, name).map_err(|source| PatternError::In { file, source: Box::new(source) })
}

/// Reads and checks the pattern `name` in a text.
///
/// # Errors
/// As [`read`], without the file.
pub fn parse(text: &str, name: &str) -> Result<SewingPattern, PatternError> {
    let mut pattern = unchecked(text, name)?;
    check::check(&mut pattern)?;
    Ok(pattern)
}

fn unchecked(text: &str, name: &str) -> Result<SewingPattern, PatternError> {
    if text.len() > MAX_MB << 20 {
        let megabytes = text.len() as f64 / f64::from(1 << 20);
        return Err(PatternError::Invalid(format!(
            "found {megabytes:.1} MB of JSON, expected a sewing pattern of {MAX_MB} MB at most; is this another file?"
        )));
    }
    let Unique(value) = serde_json::from_str(text).map_err(|e| match e.classify() {
        Category::Data => PatternError::Invalid(e.to_string()),
        _ => PatternError::Invalid(format!(
            "this is no JSON: {e}; expected a sewing pattern as GarmentCode writes it (*_specification.json)"
        )),
    })?;
    let root = At::new(&value, "the file");
    let mut notes = Vec::new();
    let object = root.object("an object with \"pattern\" in it")?;
    unknown(
        object,
        &["pattern", "properties", "parameters", "parameter_order", "parameter_constraints"],
        "the file",
        &mut notes,
    );
    let inner = key(object, "pattern", "the file", "panels and stitches")?;
    let place = "pattern";
    let inner = At::new(inner, place).object("an object of panels and stitches")?;
    unknown(inner, &["panels", "stitches", "panel_order"], place, &mut notes);
    let properties = properties(object.get("properties"), &mut notes)?;
    let panels = At::new(key(inner, "panels", place, "the panels by name")?, "pattern.panels");
    let by_name = panels.object("the panels by name")?;
    if by_name.is_empty() || by_name.len() > MAX_PANELS {
        let found = format!("{} panels", by_name.len());
        return Err(PatternError::unexpected(&panels.place, &found, &format!("1 to {MAX_PANELS}")));
    }
    let mut read = Vec::new();
    for name in ordered(inner.get("panel_order"), by_name) {
        read.push(panel(&name, &by_name[&name], &properties, &mut notes)?);
    }
    let none = Value::Array(Vec::new());
    let stitches = At::new(inner.get("stitches").unwrap_or(&none), "pattern.stitches");
    let stitches = stitches.list("a list of pairs of edges")?;
    let stitches = stitches.iter().enumerate().map(|(i, s)| stitch(i, s, &read)).collect::<Result<Vec<_>, _>>()?;
    Ok(SewingPattern { name: name.to_owned(), panels: read, stitches, notes })
}

fn key<'a>(object: &'a Map<String, Value>, key: &str, place: &str, expected: &str) -> Result<&'a Value, PatternError> {
    object.get(key).ok_or_else(|| PatternError::Invalid(format!("{place}: found no \"{key}\", expected {expected}")))
}

fn unknown(object: &Map<String, Value>, known: &[&str], place: &str, notes: &mut Vec<String>) {
    let others: Vec<&str> = object.keys().map(String::as_str).filter(|key| !known.contains(key)).collect();
    if !others.is_empty() {
        notes.push(format!("{place}: {} not understood and left out", others.join(", ")));
    }
}

/// The panels' names in the preferred order if that has each of them once, else sorted.
fn ordered(order: Option<&Value>, panels: &Map<String, Value>) -> Vec<String> {
    let mut names: Vec<String> = panels.keys().cloned().collect();
    names.sort();
    let preferred: Option<Vec<String>> =
        order.and_then(Value::as_array).map(|list| list.iter().filter_map(Value::as_str).map(str::to_owned).collect());
    let Some(preferred) = preferred else { return names };
    let mut sorted = preferred.clone();
    sorted.sort();
    if sorted == names { preferred } else { names }
}

fn properties(value: Option<&Value>, notes: &mut Vec<String>) -> Result<Properties, PatternError> {
    let mut found = Properties { metres_per_unit: 0.01, relative: true };
    let Some(value) = value else {
        notes.push("the file has no properties: assumed centimetres and relative curvatures".to_owned());
        return Ok(found);
    };
    let place = "properties";
    let object = At::new(value, place).object("an object")?;
    let known = ["curvature_coords", "units_in_meter", "normalize_panel_translation", "normalized_edge_loops"];
    unknown(object, &known, place, notes);
    if let Some(units) = object.get("units_in_meter") {
        let at = At::new(units, "properties.units_in_meter");
        let units = at.number()?;
        if !(1e-3..=1e4).contains(&units) {
            return Err(at.wrong("how many units make a metre, 100 for centimetres"));
        }
        found.metres_per_unit = units.recip();
    }
    if let Some(coordinates) = object.get("curvature_coords") {
        let at = At::new(coordinates, "properties.curvature_coords");
        found.relative = match at.value.as_str() {
            Some("relative") => true,
            Some("absolute") => false,
            _ => return Err(at.wrong("\"relative\" or \"absolute\"")),
        };
    }
    Ok(found)
}

fn panel(name: &str, value: &Value, of: &Properties, notes: &mut Vec<String>) -> Result<PatternPanel, PatternError> {
    let place = format!("panel {name}");
    let object = At::new(value, place.clone()).object("an object of vertices and edges")?;
    unknown(object, &["translation", "rotation", "vertices", "edges", "label"], &place, notes);
    let at = |key: &str, value: &'_ Value| -> Result<DVec3, PatternError> {
        let at = At::new(value, format!("{place}, {key}"));
        at.numbers::<3>("three numbers").map(DVec3::from_array)
    };
    let translation = object.get("translation").map_or(Ok(DVec3::ZERO), |v| at("translation", v))?;
    let angles = object.get("rotation").map_or(Ok(DVec3::ZERO), |v| at("rotation", v))?;
    let list = At::new(key(object, "vertices", &place, "a list of points")?, format!("{place}, vertices"));
    let mut vertices = Vec::new();
    for (i, value) in list.list("a list of points [x, y]")?.iter().enumerate() {
        let point = At::new(value, format!("{place}, vertex {i}")).numbers::<2>("a point [x, y]")?;
        vertices.push(DVec2::from_array(point) * of.metres_per_unit);
    }
    let list = At::new(key(object, "edges", &place, "a list of edges")?, format!("{place}, edges"));
    let values = list.list("a list of edges")?;
    if !(2..=MAX_EDGES).contains(&values.len()) {
        let found = format!("{} edges", values.len());
        return Err(PatternError::unexpected(&list.place, &found, &format!("2 to {MAX_EDGES}")));
    }
    let mut edges = Vec::new();
    let mut ends: Vec<[usize; 2]> = Vec::new();
    for (i, value) in values.iter().enumerate() {
        let place = format!("{place}, edge {i}");
        let object = At::new(value, place.clone()).object("an object with endpoints")?;
        unknown(object, &["endpoints", "curvature", "label"], &place, notes);
        let at = At::new(key(object, "endpoints", &place, "two vertices")?, place.clone() + ", endpoints");
        let pair = at.list("two vertices [i, j]")?;
        let index = |v: &Value| v.as_u64().and_then(|v| usize::try_from(v).ok()).filter(|&v| v < vertices.len());
        let expected = || at.wrong(format!("two numbers of vertices, from 0 to {}", vertices.len().max(1) - 1));
        let [from, to] = pair else { return Err(expected()) };
        let (from, to) = (index(from).ok_or_else(expected)?, index(to).ok_or_else(expected)?);
        ends.push([from, to]);
        let label = label(object, &place)?;
        let curvature = object.get("curvature").filter(|v| !v.is_null());
        let straight = Curve::Line { a: vertices[from], b: vertices[to] };
        let curve = curvature.map_or(Ok(straight), |v| curve(&place, v, vertices[from], vertices[to], of))?;
        edges.push(PanelEdge { curve, label });
    }
    for (i, [from, _]) in ends.iter().enumerate() {
        let before = (i + ends.len() - 1) % ends.len();
        if *from != ends[before][1] {
            let expected = ends[before][1];
            return Err(PatternError::Invalid(format!(
                "panel {name}: edge {i} begins at vertex {from}, expected {expected}, where edge {before} ends: the loop is open"
            )));
        }
    }
    let label = label(object, &place)?;
    let (rotation, translation) = upright(angles, translation * of.metres_per_unit);
    Ok(PatternPanel { name: name.to_owned(), label, edges, rotation, translation, drawn: Vec::new() })
}

fn label(object: &Map<String, Value>, place: &str) -> Result<Option<String>, PatternError> {
    let Some(value) = object.get("label").filter(|v| !v.is_null()) else { return Ok(None) };
    let text = At::new(value, format!("{place}, label")).text("a text")?;
    Ok((!text.is_empty()).then(|| text.to_owned()))
}

fn curve(place: &str, value: &Value, a: DVec2, b: DVec2, of: &Properties) -> Result<Curve, PatternError> {
    let at = At::new(value, format!("{place}, curvature"));
    let d = b - a;
    let control = |value: &Value| -> Result<DVec2, PatternError> {
        let p = DVec2::from_array(At::new(value, at.place.clone()).numbers::<2>("a control point [u, w]")?);
        Ok(if of.relative { a + d * p.x + d.perp() * p.y } else { p * of.metres_per_unit })
    };
    // Older files have a bare control point.
    if value.is_array() {
        return Ok(Curve::Quadratic { a, c: control(value)?, b });
    }
    let kinds = "a curvature of type quadratic, cubic or circle with its params";
    let object = at.object(kinds)?;
    let params = object.get("params").and_then(Value::as_array).ok_or_else(|| at.wrong(kinds))?;
    match (object.get("type").and_then(Value::as_str), params.as_slice()) {
        (Some("quadratic"), [c]) => Ok(Curve::Quadratic { a, c: control(c)?, b }),
        (Some("cubic"), [c, d]) => Ok(Curve::Cubic { a, c: control(c)?, d: control(d)?, b }),
        (Some("circle"), [radius, large, right]) => {
            let number = |v: &Value, what: &str| At::new(v, format!("{}, {what}", at.place)).number();
            let flag = |v: &Value, what: &str| match v.as_bool() {
                Some(flag) => Ok(flag),
                None => number(v, what).map(|n| n != 0.0),
            };
            let radius = number(radius, "radius")?;
            let arc = Curve::arc(a, b, radius * of.metres_per_unit, flag(large, "large")?, flag(right, "right")?);
            arc.ok_or_else(|| {
                let least = 0.5 * d.length() / of.metres_per_unit;
                let expected = format!("one that reaches both ends, {least:.4} or more");
                PatternError::unexpected(&at.place, &format!("a circle of radius {radius}"), &expected)
            })
        }
        (kind, params) => {
            let found = format!("type {} with {} params", kind.unwrap_or("(none)"), params.len());
            Err(PatternError::unexpected(&at.place, &found, "quadratic with 1, cubic with 2 or circle with 3"))
        }
    }
}

fn stitch(number: usize, value: &Value, panels: &[PatternPanel]) -> Result<Stitch, PatternError> {
    let at = At::new(value, format!("stitch {number}"));
    let expected =
        "two edges, each {\"panel\": name, \"edge\": number}, and \"right_wrong\" after them if one is turned over";
    let (pair, right_wrong) = match at.list(expected)? {
        [a, b] => ([a, b], false),
        [a, b, Value::String(flag)] if flag == "right_wrong" => ([a, b], true),
        _ => return Err(at.wrong(expected)),
    };
    let side = |value: &Value| -> Result<EdgeAt, PatternError> {
        let at = At::new(value, at.place.clone());
        let object = at.object(expected)?;
        let (Some(Value::String(name)), Some(edge)) = (object.get("panel"), object.get("edge").and_then(Value::as_u64))
        else {
            return Err(at.wrong(expected));
        };
        let Some(panel) = panels.iter().position(|p| p.name == *name) else {
            let known = listed(&panels.iter().map(|p| p.name.clone()).collect::<Vec<_>>());
            let message = format!("stitch {number}: found no panel \"{name}\", expected one of {known}");
            return Err(PatternError::Invalid(message));
        };
        let last = panels[panel].edges.len() - 1;
        if edge > last as u64 {
            let message =
                format!("stitch {number}: found edge {edge} of panel {name}, expected one of its edges 0 to {last}");
            return Err(PatternError::Invalid(message));
        }
        Ok(EdgeAt { panel, edge: edge as usize })
    };
    Ok(Stitch { sides: [side(pair[0])?, side(pair[1])?], right_wrong })
}

/// A JSON value in which no object has a key twice. `Value` itself keeps the last of two panels of one name and drops the first.
struct Unique(Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(UniqueVisitor).map(Self)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(Unique(value)) = list.next_element()? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some((key, Unique(value))) = entries.next_entry::<String, Unique>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(format!(
                    "found {key:?} twice in one object, expected each name once; rename one"
                )));
            }
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

/// A JSON value with its place in the file, for messages.
struct At<'a> {
    value: &'a Value,
    place: String,
}

impl<'a> At<'a> {
    fn new(value: &'a Value, place: impl Into<String>) -> Self {
        Self { value, place: place.into() }
    }

    fn wrong(&self, expected: impl AsRef<str>) -> PatternError {
        PatternError::unexpected(&self.place, &shown(self.value), expected.as_ref())
    }

    fn object(&self, expected: &str) -> Result<&'a Map<String, Value>, PatternError> {
        self.value.as_object().ok_or_else(|| self.wrong(expected))
    }

    fn list(&self, expected: &str) -> Result<&'a [Value], PatternError> {
        self.value.as_array().map(Vec::as_slice).ok_or_else(|| self.wrong(expected))
    }

    fn text(&self, expected: &str) -> Result<&'a str, PatternError> {
        self.value.as_str().ok_or_else(|| self.wrong(expected))
    }

    /// A number within the bounds of lengths and angles.
    fn number(&self) -> Result<f64, PatternError> {
        let number = self.value.as_f64().filter(|x| x.abs() <= MAX_NUMBER);
        number.ok_or_else(|| self.wrong(format!("a number from -{MAX_NUMBER:.0} to {MAX_NUMBER:.0}")))
    }

    fn numbers<const N: usize>(&self, expected: &str) -> Result<[f64; N], PatternError> {
        let list = self.list(expected)?;
        if list.len() != N {
            return Err(self.wrong(expected));
        }
        let mut numbers = [0.0; N];
        for (slot, value) in numbers.iter_mut().zip(list) {
            *slot = At::new(value, self.place.clone()).number()?;
        }
        Ok(numbers)
    }
}

/// A value as messages quote it.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(_) => "an object".to_owned(),
        other => {
            let text = other.to_string();
            match text.char_indices().nth(MAX_QUOTE) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            }
        }
    }
}
