//! A scene: a body, and one garment or several worn over each other as one cloth.
//!
//! One [`TriMesh`] contains the meshes of all garments, inner to outer. PARTs, energy and contact need no other change: no PART
//! spans two garments, and self-contact separates the garments. The drape cuts out each [`Layer`] and puts it over
//! those below it (`drape/layers.rs`), which then act as a surface like the body.
//!
//! Edges to hold are named by the user: the highest edge of the garment or of one of its connected parts, or the edges of a
//! group. Connected parts of which nothing is held may fall off the body, which [`Scene::fallen`] reports.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::layering::{lift_off, put_over};
use super::placement::{check_near, facing_body};
use crate::base::files::first_of;
use crate::base::serde_name;
use crate::body::distance::push_out::{PushOutReport, push_out};
use crate::body::distance::{Body, SurfacePoint, pull_off_protrusions};
use crate::garment::fabric::Fabric;
use crate::garment::sewing::crotch_z;
use crate::mesh::{RestShape, Topology, TriMesh, each_once};

/// Distance from the body, m, of vertices that were pushed out: the thickness of a thick knit.
const PUSHED_CLEARANCE: f64 = 1e-3;

/// Most connected parts that one message names.
const MAX_NAMED: usize = 5;

/// Least descent, m, of a vertex of a garment that has slid off the trunk: a skirt settles by less.
const MIN_SLIDE_M: f64 = 0.1;

/// Edges whose mean heights differ by less than this, m, are equally high.
const SAME_HEIGHT: f64 = 0.005;

/// A body and the garments on it; stays the same while range tables and fabrics vary.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The body, ready for distance queries; its mesh is [`Body::mesh`].
    pub body: Body,
    /// The garment as placed, undraped, m.
    pub garment: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// Vertices that keep their positions (the edge of a waistband).
    pub held: Vec<u32>,
    /// Whether the held vertices are released once the garment is at rest, to find out whether it stays up by itself.
    pub releases_held: bool,
    /// The garments, inner to outer; usually one.
    pub layers: Vec<Layer>,
    /// The surface that distances are measured to.
    pub distance_to: DistanceTo,
    /// Heights at which the built-in form has its bust, waist and hip girths, m.
    pub girths_at_m: Option<[f64; 3]>,
    /// The fabrics that the rest shape numbers; `None` is the fabric of the settings, and the only one by default.
    pub own_fabrics: Vec<Option<Fabric>>,
}

/// One of the garments of a scene: its share of the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its triangles.
    pub triangles: Range<usize>,
}

impl Layer {
    /// Its mesh alone, where `triangles` and `positions` (m) are those of all garments.
    pub(crate) fn cut_out(&self, triangles: &[[u32; 3]], positions: &[DVec3]) -> TriMesh {
        let first = self.vertices.start as u32;
        let own = triangles[self.triangles.clone()].iter().map(|t| t.map(|v| v - first)).collect();
        TriMesh::new(positions[self.vertices.clone()].to_vec(), own)
    }
}

/// The surface that the distances of stage one are measured to, where garments are worn over each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DistanceTo {
    /// The body, through any garments between.
    #[default]
    Body,
    /// The body or a garment below, as placed, whichever is nearer.
    Below,
}

impl fmt::Display for DistanceTo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for DistanceTo {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        serde_name::parse(text).ok_or_else(|| format!("found `{text}`, expected body or below"))
    }
}

impl Scene {
    /// A body and a garment placed around it, both in metres with z up; the garment is at rest as it stands.
    ///
    /// # Errors
    /// [`SceneError`]: a body that is not closed, triangles without area, a garment that is not near the body.
    pub fn of_meshes(body: &TriMesh, mut garment: TriMesh) -> Result<Self, SceneError> {
        let body = Body::new(body)?;
        let inward = facing_body(&garment, &body);
        garment.triangles.iter_mut().zip(inward).filter(|(_, inward)| *inward).for_each(|(t, _)| t.swap(1, 2));
        let rest = RestShape::from_edges(&garment)?;
        Ok(Self::place(body, garment, rest, true)?.0)
    }

    /// A scene of one garment at its current positions, with nothing held.
    #[must_use]
    pub fn new(body: Body, garment: TriMesh, rest: RestShape) -> Self {
        let name = "garment".to_owned();
        let layer = Layer { name, vertices: 0..garment.vertex_count(), triangles: 0..garment.triangles.len() };
        Self {
            body,
            topology: Topology::new(&garment),
            garment,
            rest,
            held: Vec::new(),
            releases_held: false,
            layers: vec![layer],
            distance_to: DistanceTo::Body,
            girths_at_m: None,
            own_fabrics: vec![None],
        }
    }

    /// A garment that is near the body, nothing held; with `push`, vertices that start inside the body are pushed out.
    pub(super) fn place(
        body: Body,
        garment: TriMesh,
        rest: RestShape,
        push: bool,
    ) -> Result<(Self, PushOutReport), SceneError> {
        check_near(&garment, &body)?;
        let (garment, report) =
            if push { push_out(&garment, &body, PUSHED_CLEARANCE) } else { (garment, PushOutReport::default()) };
        Ok((Self::new(body, garment, rest), report))
    }

    /// Pulls the garment off protrusions of the body; returns the longest displacement, m.
    pub(super) fn pull_off_protrusions(&mut self) -> f64 {
        let Some(pulled) = pull_off_protrusions(&self.body, &self.garment, &self.is_held()) else { return 0.0 };
        let farthest = self.garment.positions.iter().zip(&pulled).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        self.garment.positions = pulled;
        farthest
    }

    /// Whether each garment vertex is held.
    pub(crate) fn is_held(&self) -> Vec<bool> {
        let mut held = vec![false; self.garment.vertex_count()];
        for &v in &self.held {
            // The cloth reports a vertex that does not exist.
            if let Some(held) = held.get_mut(v as usize) {
                *held = true;
            }
        }
        held
    }

    /// The point nearest to each garment vertex, as placed, on the surface that [`DistanceTo`] selects.
    ///
    /// # Errors
    /// [`SceneError`] where no distance to a garment can be measured.
    pub(crate) fn surface(&self) -> Result<Vec<SurfacePoint>, SceneError> {
        let positions = &self.garment.positions;
        let mut surface = self.body.nearest_all(positions);
        let outer = if self.distance_to == DistanceTo::Below { 1..self.layers.len() } else { 0..0 };
        for k in outer {
            let own = self.layers[k].vertices.clone();
            let below = Body::new_open(&self.mesh_below(k, positions))?.nearest_all(&positions[own.clone()]);
            for (nearest, found) in surface[own].iter_mut().zip(below) {
                if found.signed_distance.abs() < nearest.signed_distance.abs() {
                    *nearest = found;
                }
            }
        }
        Ok(surface)
    }

    /// Unsigned distance of each garment vertex to that surface, m. Equation (1) takes it without its sign, as a vertex
    /// inside is as far from the surface as one outside.
    ///
    /// # Errors
    /// [`SceneError`] where no distance to a garment can be measured.
    pub fn distances_m(&self) -> Result<Vec<f64>, SceneError> {
        Ok(self.surface()?.iter().map(|s| s.signed_distance.abs()).collect())
    }

    /// The body under garment number `k`, covered by the garments below it with the vertices at `positions` (m).
    pub(crate) fn body_below(&self, k: usize, positions: &[DVec3]) -> Result<Body, SceneError> {
        if k == 0 {
            return Ok(self.body.clone());
        }
        Ok(self.body.covered_by(&self.mesh_below(k, positions))?)
    }

    /// A scene of garment number `k` alone, put over those below it with the vertices at `positions` (m).
    pub(crate) fn layer_scene(&self, k: usize, positions: &[DVec3]) -> Result<Self, SceneError> {
        let layer = self.layers[k].clone();
        let mut garment = layer.cut_out(&self.garment.triangles, positions);
        if k > 0 {
            put_over(&mut garment, &self.mesh_below(k, positions), &self.body)?;
        }
        let first = layer.vertices.start as u32;
        let rest = RestShape {
            corners: self.rest.corners[layer.triangles.clone()].to_vec(),
            cut_from: self.rest.cut_from.get(layer.triangles.clone()).unwrap_or_default().to_vec(),
            guessed: self.rest.guessed.get(layer.triangles.clone()).unwrap_or_default().to_vec(),
        };
        let mut scene = Self::new(self.body_below(k, positions)?, garment, rest);
        scene.held = self.held.iter().filter(|&&v| layer.vertices.contains(&(v as usize))).map(|v| v - first).collect();
        scene.layers[0].name = layer.name;
        scene.distance_to = self.distance_to;
        scene.own_fabrics.clone_from(&self.own_fabrics);
        Ok(scene)
    }

    /// The positions at which each garment, at `positions` (m), is lifted off those below it where it crossed them.
    pub(crate) fn lift_layers(&self, mut positions: Vec<DVec3>) -> Vec<DVec3> {
        for k in 1..self.layers.len() {
            let mut outer = self.layers[k].cut_out(&self.garment.triangles, &positions);
            lift_off(&mut outer, &self.mesh_below(k, &positions));
            positions[self.layers[k].vertices.clone()].copy_from_slice(&outer.positions);
        }
        positions
    }

    /// All garments below number `k` as one mesh.
    fn mesh_below(&self, k: usize, positions: &[DVec3]) -> TriMesh {
        let (vertices, triangles) = (self.layers[k].vertices.start, self.layers[k].triangles.start);
        TriMesh::new(positions[..vertices].to_vec(), self.garment.triangles[..triangles].to_vec())
    }

    /// The fabrics that the rest shape numbers; `default_fabric` stands in for those that are not assigned.
    #[must_use]
    pub fn fabrics(&self, default_fabric: &Fabric) -> Vec<Fabric> {
        self.own_fabrics.iter().map(|own| own.as_ref().unwrap_or(default_fabric).clone()).collect()
    }

    /// The number of the fabric of each vertex; between several, the highest.
    pub(crate) fn fabric_of_vertices(&self) -> Vec<u16> {
        let mut fabric = vec![0; self.garment.vertex_count()];
        for (t, triangle) in self.garment.triangles.iter().enumerate() {
            let of = self.rest.fabric_of(t) as u16;
            triangle.iter().for_each(|&v| fabric[v as usize] = of.max(fabric[v as usize]));
        }
        fabric
    }

    /// The names of the fabrics in one line.
    #[must_use]
    pub fn fabric_names(&self, default_fabric: &Fabric) -> String {
        self.fabrics(default_fabric).iter().map(|fabric| fabric.name.as_str()).collect::<Vec<_>>().join(" + ")
    }

    /// Whether any of it is cut from the fabric of the settings.
    #[must_use]
    pub fn takes_the_settings_fabric(&self) -> bool {
        self.own_fabrics.contains(&None)
    }

    /// The vertices of several edges, their names separated by commas. A group whose name contains a comma is one name.
    ///
    /// # Errors
    /// As [`edge`](Self::edge).
    pub fn edges(&self, names: &str) -> Result<Vec<u32>, SceneError> {
        let edges = Edges::new(self);
        let held = self.edge_names(names).into_iter().map(|name| edges.named(name)).collect::<Result<Vec<_>, _>>()?;
        Ok(each_once(held.into_iter().flatten()))
    }

    /// The names of several edges, one by one.
    fn edge_names<'a>(&self, names: &'a str) -> Vec<&'a str> {
        let known = self.garment.groups.iter().any(|g| g == names);
        if known { vec![names] } else { names.split(',').map(str::trim).collect() }
    }

    /// Notes on names that mean both a group of the garment and its highest edge: [`edge`](Self::edge) takes the group.
    pub(super) fn ambiguous_edges(&self, names: &str) -> Vec<String> {
        let is_both = |name: &&str| {
            (*name == "top" || name.starts_with("top:")) && self.garment.groups.iter().any(|group| group == *name)
        };
        let note = |name| {
            format!(
                "--hold {name}: the group `{name}` of the garment is held, not the highest edge, which has the same name; rename the \
                 group to hold that edge"
            )
        };
        self.edge_names(names).into_iter().filter(is_both).map(note).collect()
    }

    /// The vertices of the garment's highest edge (`top`), of the highest edge of one of its connected parts (`top:2`,
    /// numbered from 1 in the order of their first vertices), or of the boundary edges of a group.
    ///
    /// # Errors
    /// [`SceneError`] where there is no such part or group, or no edge.
    pub fn edge(&self, name: &str) -> Result<Vec<u32>, SceneError> {
        Edges::new(self).named(name)
    }

    /// The highest of some edges, by mean height as placed. Of several that are equally high, the shortest: the neckline of
    /// a poncho that is laid flat, and not its hem.
    fn highest(&self, edges: Vec<Vec<u32>>) -> Option<Vec<u32>> {
        let at = |v: &u32| self.garment.positions[*v as usize];
        let height = |edge: &[u32]| edge.iter().map(|v| at(v).z).sum::<f64>() / edge.len() as f64;
        let length = |edge: &[u32]| {
            edge.iter().zip(edge.iter().cycle().skip(1)).map(|(a, b)| at(a).distance(at(b))).sum::<f64>()
        };
        let top = edges.iter().map(|edge| height(edge)).max_by(f64::total_cmp)?;
        let highest = edges.into_iter().filter(|edge| height(edge) >= top - SAME_HEIGHT);
        highest.min_by(|a, b| length(a).total_cmp(&length(b)))
    }

    /// The highest edge of each connected part; `None` for a part without boundary.
    pub(crate) fn tops(&self) -> Vec<Option<Vec<u32>>> {
        let (part_of, parts) = self.topology.components();
        let mut edges = vec![Vec::new(); parts];
        for edge in self.topology.boundary_loops() {
            edges[part_of[edge[0] as usize] as usize].push(edge);
        }
        edges.into_iter().map(|edges| self.highest(edges)).collect()
    }

    /// Numbers, from 1, of the connected parts of which no vertex is held.
    pub(crate) fn loose_parts(&self) -> Vec<usize> {
        let (part_of, parts) = self.topology.components();
        let held: BTreeSet<u32> = self.held.iter().filter_map(|&v| part_of.get(v as usize)).copied().collect();
        (0..parts as u32).filter(|part| !held.contains(part)).map(|part| part as usize + 1).collect()
    }

    /// Area of the garment at `positions` (m) over its area at rest.
    pub(crate) fn area_share(&self, positions: &[DVec3]) -> f64 {
        let at_rest: f64 = self.rest.areas().into_iter().map(f64::abs).sum();
        self.garment.with_positions(positions.to_vec()).triangle_areas().iter().sum::<f64>() / at_rest
    }

    /// A warning about connected parts that have come off the body at `positions` (m).
    pub(crate) fn fallen(&self, positions: &[DVec3]) -> Option<String> {
        let fallen = self.fallen_parts(positions);
        (!fallen.is_empty()).then(|| {
            let have = if fallen.len() > 1 { "have" } else { "has" };
            let (parts, off, remedy) = (self.named(&fallen), self.off(positions), self.how_to_hold(&fallen));
            format!("{parts} {have} {off}; {remedy}, or place it better")
        })
    }

    /// Where a fallen garment with its vertices at `positions` (m) has come off.
    pub(crate) fn off(&self, positions: &[DVec3]) -> &'static str {
        let low = self.body.mesh().bounds().map_or(f64::NEG_INFINITY, |(low, _)| low.z);
        let past_the_feet = !self.parts_below(low, positions).is_empty();
        if past_the_feet { "fallen off the body" } else { "slid off the trunk, down to the legs" }
    }

    /// Numbers, from 1, of the connected parts that have come off the body at `positions` (m): nothing of them is held, and every vertex is
    /// below the body, where they touch nothing and would fall for ever, or below the crotch, though they were placed above it. There they
    /// would slide on, and rest at best on the feet.
    pub(crate) fn fallen_parts(&self, positions: &[DVec3]) -> Vec<usize> {
        let Some((low, high)) = self.body.mesh().bounds() else { return Vec::new() };
        let mut fallen = self.parts_below(low.z, positions);
        let middle = 0.5 * (low.z + high.z);
        // The common case first, as this runs at every step: no vertex has sunk from the upper half into the lower one.
        let sank = |(x, placed): (&DVec3, &DVec3)| x.z < middle && placed.z > f64::max(middle, x.z + MIN_SLIDE_M);
        if positions.iter().zip(&self.garment.positions).any(sank) {
            let placed = self.parts_below(middle, &self.garment.positions);
            let mut slid = self.parts_below(middle, positions);
            slid.retain(|part| !placed.contains(part) && !fallen.contains(part));
            if let Some(crotch) = (!slid.is_empty()).then(|| crotch_z(self.body.mesh())).flatten() {
                let below = self.parts_below(crotch.min(middle), positions);
                fallen.extend(slid.into_iter().filter(|part| below.contains(part)));
                fallen.sort_unstable();
            }
        }
        fallen
    }

    /// Numbers, from 1, of the connected parts without held vertices that lie below height `z` with all vertices at `positions` (m).
    fn parts_below(&self, z: f64, positions: &[DVec3]) -> Vec<usize> {
        if positions.iter().all(|x| x.z >= z) {
            return Vec::new();
        }
        let (part_of, _) = self.topology.components();
        let above: BTreeSet<u32> =
            part_of.iter().zip(positions).filter(|(_, x)| x.z >= z).map(|(part, _)| *part).collect();
        self.loose_parts().into_iter().filter(|&part| !above.contains(&(part as u32 - 1))).collect()
    }

    /// Connected parts, numbered from 1, as the subject of a sentence.
    pub(crate) fn named(&self, parts: &[usize]) -> String {
        let (part_of, count) = self.topology.components();
        if count == 1 {
            return "the garment".to_owned();
        }
        let outfit = self.layers.len() > 1;
        let numbered = |part: &usize| {
            let first = part_of.iter().position(|&of| of as usize + 1 == *part);
            let layer = self.layers.iter().find(|layer| first.is_some_and(|v| layer.vertices.contains(&v)));
            layer.filter(|_| outfit).map_or(part.to_string(), |layer| format!("{part} ({})", layer.name))
        };
        let numbers: Vec<String> = parts.iter().map(numbered).collect();
        let whole = if outfit { "outfit" } else { "garment" };
        let s = if parts.len() == 1 { "" } else { "s" };
        format!("connected part{s} {} of the {whole}'s {count}", first_of(&numbers, MAX_NAMED))
    }

    /// The remedy for connected parts of which nothing is held, as the user would type it.
    pub(crate) fn how_to_hold(&self, parts: &[usize]) -> String {
        let tops = self.tops();
        let open = parts.iter().filter(|part| tops[*part - 1].is_some()).take(MAX_NAMED);
        let names: Vec<String> = open.map(|part| format!("top:{part}")).collect();
        if names.is_empty() {
            return "it has no edge that could be held: join it to what stays on".to_owned();
        }
        let names = if tops.len() == 1 { "top".to_owned() } else { names.join(",") };
        let (part_of, _) = self.topology.components();
        let groups: BTreeSet<u32> = (self.garment.triangles.iter().zip(&self.garment.triangle_group))
            .filter(|(corners, _)| parts.contains(&(part_of[corners[0] as usize] as usize + 1)))
            .map(|(_, group)| *group)
            .collect();
        let groups: Vec<String> = groups.iter().filter_map(|&g| self.garment.groups.get(g as usize)).cloned().collect();
        let or_group = match &groups[..] {
            [] => String::new(),
            some => format!(", or one of its groups: {}", first_of(some, MAX_NAMED)),
        };
        format!("hold its edge (--hold {names}{or_group})")
    }
}

/// The edges of a scene's garment by name, for names by the thousand.
struct Edges<'a> {
    scene: &'a Scene,
    /// The highest edge of each connected part.
    tops: Vec<Option<Vec<u32>>>,
    /// Vertices of the boundary edges of each group.
    of_group: Vec<Vec<u32>>,
}

impl<'a> Edges<'a> {
    fn new(scene: &'a Scene) -> Self {
        let Scene { garment: mesh, topology, .. } = scene;
        let on_edge = topology.boundary_vertices();
        let mut of_group = vec![Vec::new(); mesh.groups.len()];
        for (triangle, &group) in mesh.triangles.iter().zip(&mesh.triangle_group) {
            of_group[group as usize].extend(triangle.iter().filter(|&&v| on_edge[v as usize]));
        }
        Self { scene, tops: scene.tops(), of_group }
    }

    /// As [`Scene::edge`].
    fn named(&self, name: &str) -> Result<Vec<u32>, SceneError> {
        let no_edge = || SceneError::NoEdge { what: name.to_owned() };
        let groups = &self.scene.garment.groups;
        if let Some(group) = groups.iter().position(|g| g == name) {
            let held = each_once(self.of_group[group].iter().copied());
            return if held.is_empty() { Err(no_edge()) } else { Ok(held) };
        }
        let parts = self.tops.len();
        match name.strip_prefix("top:").map(str::parse::<usize>) {
            _ if name == "top" => self.scene.highest(self.scene.topology.boundary_loops()).ok_or_else(no_edge),
            Some(Ok(part)) if (1..=parts).contains(&part) => self.tops[part - 1].clone().ok_or_else(no_edge),
            Some(_) => Err(SceneError::UnknownPart { found: name.to_owned(), parts }),
            None => Err(SceneError::UnknownGroup { found: name.to_owned(), known: groups.clone() }),
        }
    }
}
