//! Panels sewn into one garment.
//!
//! Both sides of a stitch are divided into the same number of segments, at equal lengths along each, so their vertices meet
//! one to one and become one vertex, at the mean of their positions. The rest shape of a triangle is the triangle in its
//! panel: where the sides of a stitch differ in length each keeps its own, which gathers the cloth. The outer side of the
//! cloth is where the placed loop runs counter-clockwise; panels that `right_wrong` turns over follow the panel they are sewn
//! to.
//!
//! Limits: where three pieces of cloth or more meet along an edge, the mesh is non-manifold; a note says so.

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::drawing::laid_out;
use super::error::PatternError;
use super::panel_mesh::{self, Meshed, Outline, divisions, outlines};
use super::panels::{EdgeAt, SewingPattern};
use crate::mesh::{RestShape, Topology, TriMesh, each_once};

/// Least and largest edge length of a garment, m.
const EDGES: [f64; 2] = [2e-3, 0.2];
/// Most vertices of a garment.
const MAX_VERTICES: usize = 250_000;

/// A panel in the sewn garment.
#[derive(Debug, Clone, PartialEq)]
pub struct SewnPanel {
    /// Positions of its vertices in its plane, m: those of the outline first, in the order of its loop.
    pub flat: Vec<DVec2>,
    /// Their vertices in the garment.
    pub vertices: Vec<u32>,
    /// Its triangles, by its own vertices, counter-clockwise in its plane.
    pub triangles: Vec<[u32; 3]>,
    /// The first outline vertex of each edge, and one past the last.
    starts: Vec<usize>,
}

/// A sewn garment at the placement of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct SewnGarment {
    /// Its mesh, m, z up; each panel a group.
    pub mesh: TriMesh,
    /// Its rest shape: the flat panels.
    pub rest: RestShape,
    /// Positions of each triangle's corners in its panel's plane, m.
    pub flat: Vec<[DVec2; 3]>,
    /// The panels, in the pattern's order.
    pub panels: Vec<SewnPanel>,
    /// Vertices of each stitch in order along its first side, in the pattern's order.
    pub seams: Vec<Vec<u32>>,
    /// Vertices of the edges of each label, ascending.
    pub labelled: BTreeMap<String, Vec<u32>>,
    /// Triangles that were left out, and non-manifold edges.
    pub notes: Vec<String>,
}

/// Meshes the panels with edges of about `edge_m` (m) and sews them together.
///
/// # Errors
/// [`PatternError`] where that makes too many vertices or a panel has no mesh.
pub fn sew(pattern: &SewingPattern, edge_m: f64) -> Result<SewnGarment, PatternError> {
    if !(EDGES[0]..=EDGES[1]).contains(&edge_m) {
        let [low_cm, high_cm] = EDGES.map(|m| 100.0 * m);
        let found_cm = 100.0 * edge_m;
        let found = format!("found an edge length of {found_cm} cm, expected {low_cm} to {high_cm} cm");
        return Err(PatternError::Invalid(found));
    }
    let counts = divisions(pattern, edge_m);
    let area: f64 = pattern.panels.iter().map(|p| p.signed_area().abs()).sum();
    let found = (area / (0.75_f64.sqrt() * edge_m * edge_m)) as usize + counts.iter().flatten().sum::<usize>();
    if found > MAX_VERTICES {
        let edge_cm = 100.0 * edge_m;
        return Err(PatternError::Invalid(format!(
            "an edge length of {edge_cm} cm makes about {found} vertices of this pattern, expected {MAX_VERTICES} at most; \
             ask for longer edges"
        )));
    }
    let outlines = outlines(pattern, &counts);
    let meshed: Vec<Meshed> = (pattern.panels.par_iter().zip(&outlines))
        .map(|(panel, outline)| {
            let failed = |reason: String| {
                let panel = &panel.name;
                PatternError::Invalid(format!("panel {panel}: no mesh: {reason}"))
            };
            if panel.signed_area() > 0.0 {
                return panel_mesh::mesh(&outline.points, &outline.class, edge_m).map_err(failed);
            }
            // A clockwise loop is meshed in reverse, and its outline restored to the order of the loop.
            let n = outline.points.len() as u32;
            let points: Vec<DVec2> = outline.points.iter().rev().copied().collect();
            let class: Vec<u32> = outline.class.iter().rev().copied().collect();
            let (mut points, mut triangles) = panel_mesh::mesh(&points, &class, edge_m).map_err(failed)?;
            points[..n as usize].reverse();
            triangles.as_flattened_mut().iter_mut().filter(|v| **v < n).for_each(|v| *v = n - 1 - *v);
            Ok((points, triangles))
        })
        .collect::<Result<_, PatternError>>()?;
    Ok(join(pattern, &outlines, meshed))
}

fn join(pattern: &SewingPattern, outlines: &[Outline], meshed: Vec<Meshed>) -> SewnGarment {
    let turned = turned_over(pattern);
    let mut vertex_of_class: BTreeMap<u32, u32> = BTreeMap::new();
    let mut places: Vec<(DVec3, f64)> = Vec::new();
    let mut panels = Vec::new();
    for ((panel, outline), (flat, triangles)) in pattern.panels.iter().zip(outlines).zip(meshed) {
        let mut vertices = Vec::with_capacity(flat.len());
        for (i, &p) in flat.iter().enumerate() {
            let next = places.len() as u32;
            let v = outline.class.get(i).map_or(next, |&class| *vertex_of_class.entry(class).or_insert(next));
            if v == next {
                places.push((DVec3::ZERO, 0.0));
            }
            places[v as usize].0 += panel.place(p);
            places[v as usize].1 += 1.0;
            vertices.push(v);
        }
        panels.push(SewnPanel { flat, vertices, triangles, starts: outline.starts.clone() });
    }
    let mut mesh = TriMesh::new(places.iter().map(|(sum, count)| sum / *count).collect(), Vec::new());
    mesh.groups = pattern.panels.iter().map(|p| p.name.clone()).collect();
    let (mut flat, mut corners, mut collapsed) = (Vec::new(), Vec::new(), 0);
    for (number, (panel, &turned)) in panels.iter().zip(&turned).enumerate() {
        for triangle in &panel.triangles {
            let [a, b, c] = if turned { [triangle[0], triangle[2], triangle[1]] } else { *triangle };
            let sewn = [a, b, c].map(|v| panel.vertices[v as usize]);
            if sewn[0] == sewn[1] || sewn[1] == sewn[2] || sewn[2] == sewn[0] {
                collapsed += 1;
                continue;
            }
            let places = [a, b, c].map(|v| panel.flat[v as usize]);
            mesh.triangles.push(sewn);
            mesh.triangle_group.push(number as u32);
            corners.push(if turned { places.map(|p| DVec2::new(-p.x, p.y)) } else { places });
            flat.push(places);
        }
    }
    let mut notes = Vec::new();
    if collapsed > 0 {
        notes.push(format!("{collapsed} triangles collapse where they are sewn, and were left out"));
    }
    let many = Topology::new(&mesh).edge_valence.iter().filter(|&&valence| valence > 2).count();
    if many > 0 {
        notes.push(format!("three pieces of cloth or more meet along {many} edges of the sewn garment"));
    }
    let on = |at: EdgeAt| panels[at.panel].along(at.edge);
    let seams = pattern.stitches.iter().map(|s| on(s.sides[0])).collect();
    let mut labelled: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for (panel, of) in pattern.panels.iter().enumerate() {
        for (edge, e) in of.edges.iter().enumerate() {
            if let Some(label) = &e.label {
                labelled.entry(label.clone()).or_default().extend(on(EdgeAt { panel, edge }));
            }
        }
    }
    labelled.values_mut().for_each(|vertices| *vertices = each_once(vertices.drain(..)));
    SewnGarment { mesh, rest: RestShape::new(corners), flat, panels, seams, labelled, notes }
}

/// Whether the outer side of each panel is the back of its plane.
fn turned_over(pattern: &SewingPattern) -> Vec<bool> {
    let clockwise: Vec<bool> = pattern.panels.iter().map(|p| p.signed_area() < 0.0).collect();
    let mut flipped = vec![None; clockwise.len()];
    for seed in 0..flipped.len() {
        if flipped[seed].is_some() {
            continue;
        }
        flipped[seed] = Some(false);
        let mut queue = VecDeque::from([seed]);
        while let Some(panel) = queue.pop_front() {
            for stitch in &pattern.stitches {
                let [a, b] = stitch.sides.map(|s| s.panel);
                let next = if a == panel { b } else { a };
                if (a == panel || b == panel) && flipped[next].is_none() {
                    flipped[next] = flipped[panel].map(|f| f ^ stitch.right_wrong);
                    queue.push_back(next);
                }
            }
        }
    }
    clockwise.iter().zip(flipped).map(|(clockwise, flipped)| clockwise ^ flipped.unwrap_or(false)).collect()
}

impl SewnPanel {
    /// Vertices of the garment along an edge, both ends included.
    #[must_use]
    pub fn along(&self, edge: usize) -> Vec<u32> {
        let n = self.starts.last().copied().unwrap_or(1).max(1);
        (self.starts[edge]..=self.starts[edge + 1]).map(|i| self.vertices[i % n]).collect()
    }

    /// The edge that an outline vertex lies on, and its share of the edge's length, 0 to 1.
    fn on_edge(&self, vertex: usize) -> Option<(usize, f64)> {
        let edge = self.starts.partition_point(|&s| s <= vertex).checked_sub(1)?;
        let (from, to) = (*self.starts.get(edge)?, *self.starts.get(edge + 1)?);
        Some((edge, (vertex - from) as f64 / (to - from) as f64))
    }

    /// The position of a flat point of this panel, on an edge or inside, with the garment's vertices at `positions`.
    fn interpolate(&self, flat: DVec2, on_edge: Option<(usize, f64)>, positions: &[DVec3]) -> Option<DVec3> {
        if let Some((edge, share)) = on_edge {
            let along = self.along(edge);
            let place = share * (along.len() - 1) as f64;
            let first = (place as usize).min(along.len() - 2);
            let [a, b] = [along[first], along[first + 1]].map(|v| positions[v as usize]);
            return Some(a.lerp(b, place - first as f64));
        }
        // In the triangle that contains it, or else the one with the largest least barycentric coordinate.
        let mut best: Option<(f64, DVec3)> = None;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| self.flat[v as usize]);
            let area = (b - a).perp_dot(c - a);
            let weights = [(b - flat).perp_dot(c - flat), (c - flat).perp_dot(a - flat), (a - flat).perp_dot(b - flat)];
            let weights = weights.map(|w| w / area);
            let least = weights.into_iter().fold(f64::INFINITY, f64::min);
            if best.is_none_or(|(most, _)| least > most) {
                let x = triangle.iter().zip(weights).map(|(&v, w)| positions[self.vertices[v as usize] as usize] * w);
                best = Some((least, x.sum()));
            }
            if least >= 0.0 {
                break;
            }
        }
        best.map(|(_, x)| x)
    }
}

impl SewnGarment {
    /// Positions of each triangle's corners with the panels laid out beside each other ([`laid_out`]), m.
    #[must_use]
    pub fn laid_out(&self, pattern: &SewingPattern) -> Vec<[DVec2; 3]> {
        let offsets = laid_out(pattern);
        let corners = self.flat.iter().zip(&self.mesh.triangle_group);
        corners.map(|(corners, &panel)| corners.map(|p| p + offsets[panel as usize])).collect()
    }

    /// The panels laid out and not sewn, m, x to the right and z up, and for each of their vertices the garment's.
    pub(crate) fn unsewn(&self, pattern: &SewingPattern) -> (TriMesh, Vec<u32>) {
        let (mut mesh, mut of) = (TriMesh::default(), Vec::new());
        for (panel, offset) in self.panels.iter().zip(laid_out(pattern)) {
            let first = of.len() as u32;
            mesh.positions.extend(panel.flat.iter().map(|p| DVec3::new(p.x + offset.x, 0.0, p.y + offset.y)));
            mesh.triangles.extend(panel.triangles.iter().map(|t| t.map(|v| first + v)));
            of.extend(&panel.vertices);
        }
        (mesh, of)
    }

    /// Positions of this garment interpolated from `coarse`, the same pattern in longer edges with its vertices at `positions`
    /// (m).
    pub(crate) fn over(&self, coarse: &Self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut placed = vec![None; self.mesh.vertex_count()];
        for (fine, coarse) in self.panels.iter().zip(&coarse.panels) {
            for (i, &v) in fine.vertices.iter().enumerate() {
                if placed[v as usize].is_none() {
                    placed[v as usize] = coarse.interpolate(fine.flat[i], fine.on_edge(i), positions);
                }
            }
        }
        placed.into_iter().zip(&self.mesh.positions).map(|(p, own)| p.unwrap_or(*own)).collect()
    }
}
