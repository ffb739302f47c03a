//! Garments worn over each other, inner to outer, as one cloth of several parts.
//!
//! Their meshes lie side by side in one [`TriMesh`]: PARTs, energy and contact need nothing more, since no PART goes from one to another and
//! cloth keeps off cloth. To be draped, each is taken out again and put over what lies below it (`drape/layers.rs`): along the way
//! out of the body, from the point c that is nearest to a vertex of the outer garment, the garments below are met last at a distance d;
//! the vertex is moved outward until it is d and a clearance away, and its neighbours follow smoothly, as for what starts inside the
//! body (`push_out.rs`). What lies below is then a surface like a body: whoever is over it keeps off it at its vertices.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | point of the body nearest to the vertex | m |
//! | d | where the way out from c leaves the garments below | m |
//!
//! Limits: what is tucked in is named before what it is tucked into; nothing is partly over and partly under.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::DVec3;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{FeatureId, TriMesh as ParryMesh};
use serde::{Deserialize, Serialize};

use super::{Scene, SceneError};
use crate::base::serde_name::word;
use crate::body::distance::{Body, DistanceError, SurfacePoint};
use crate::mesh::self_intersection::crossing_pairs;
use crate::mesh::{RestShape, Topology, TriMesh};

/// An outer garment begins so far outside the inner one, m: the sag of triangles of both, and some thicknesses.
const CLEARANCE: f64 = 6e-3;

/// Garments farther off the body than this are not felt from it, m.
const FARTHEST: f64 = 0.5;

/// A way out goes through no more sheets than this.
const SHEETS: usize = 16;

/// Share of the way to a sheet that its distance from the body is at least, where the way is its own: all of it but for rounding where the
/// body is convex.
const ITS_OWN: f64 = 0.8;

/// The next sheet is looked for so far behind the last, m.
const BEHIND: f64 = 1e-6;

/// Rounds of moving out and smoothing, and averages in each.
const ROUNDS: usize = 12;
const SWEEPS: usize = 3;

/// What is through a garment below is lifted by so much at a time, m, at most so many times.
const LIFT: f64 = 1.5e-3;
const LIFTS: usize = 40;

/// One of the garments of a scene: its share of the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layer {
    /// What it is called.
    pub name: String,
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its triangles.
    pub triangles: Range<usize>,
}

impl Layer {
    /// It alone, of these triangles of all and with their vertices at `x` (m).
    pub(crate) fn cut_out(&self, triangles: &[[u32; 3]], x: &[DVec3]) -> TriMesh {
        let first = self.vertices.start as u32;
        let own = triangles[self.triangles.clone()].iter().map(|t| t.map(|v| v - first)).collect();
        TriMesh::new(x[self.vertices.clone()].to_vec(), own)
    }
}

/// What the distances of stage one count to, where garments are worn over each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DistanceTo {
    /// To the body, whatever lies between.
    #[default]
    Body,
    /// To the body or a garment below, as placed, whichever is nearer.
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
        word(text).ok_or_else(|| format!("found `{text}`, expected body or below"))
    }
}

impl Scene {
    /// What garment number `k` lies on where the vertices are at `x` (m): the body, and the garments below it.
    pub(crate) fn below(&self, k: usize, x: &[DVec3]) -> Result<Body, SceneError> {
        if k == 0 {
            return Ok(self.body.clone());
        }
        Ok(self.body.wearing(&self.cut_out(&self.all_below(k), x))?)
    }

    /// Garment number `k` by itself, put over what lies below it where the vertices are at `x` (m).
    pub(crate) fn alone(&self, k: usize, x: &[DVec3]) -> Result<Self, SceneError> {
        let layer = self.layers[k].clone();
        let mut garment = self.cut_out(&layer, x);
        if k > 0 {
            put_over(&mut garment, &self.cut_out(&self.all_below(k), x), &self.body)?;
        }
        let first = layer.vertices.start as u32;
        let held = self.held.iter().filter(|&&v| layer.vertices.contains(&(v as usize))).map(|v| v - first).collect();
        let cut_from = self.rest.cut_from.get(layer.triangles.clone()).unwrap_or_default().to_vec();
        let rest = RestShape { corners: self.rest.corners[layer.triangles.clone()].to_vec(), cut_from };
        let whole = Layer { vertices: 0..layer.vertices.len(), triangles: 0..layer.triangles.len(), ..layer };
        Ok(Self {
            body: self.below(k, x)?,
            topology: Topology::new(&garment),
            garment,
            rest,
            held,
            let_go: false,
            layers: vec![whole],
            distance_to: self.distance_to,
            own_fabrics: self.own_fabrics.clone(),
        })
    }

    /// Where the vertices are once each garment, at `x` (m), is lifted off those below it where it was through them.
    #[must_use]
    pub(crate) fn lifted_off(&self, mut x: Vec<DVec3>) -> Vec<DVec3> {
        for k in 1..self.layers.len() {
            let mut outer = self.cut_out(&self.layers[k], &x);
            lift_off(&mut outer, &self.cut_out(&self.all_below(k), &x));
            x[self.layers[k].vertices.clone()].copy_from_slice(&outer.positions);
        }
        x
    }

    /// Takes the nearest point of the garments below, as placed, where that is nearer than what is there.
    pub(super) fn nearer_below(&self, surface: &mut [SurfacePoint]) -> Result<(), SceneError> {
        let placed = &self.garment.positions;
        for k in 1..self.layers.len() {
            let own = self.layers[k].vertices.clone();
            let below = Body::new_open(&self.cut_out(&self.all_below(k), placed))?.nearest_all(&placed[own.clone()]);
            for (there, found) in surface[own].iter_mut().zip(below) {
                if found.signed_distance.abs() < there.signed_distance.abs() {
                    *there = found;
                }
            }
        }
        Ok(())
    }

    fn all_below(&self, k: usize) -> Layer {
        let (vertices, triangles) = (self.layers[k].vertices.start, self.layers[k].triangles.start);
        Layer { name: String::new(), vertices: 0..vertices, triangles: 0..triangles }
    }

    fn cut_out(&self, layer: &Layer, x: &[DVec3]) -> TriMesh {
        layer.cut_out(&self.garment.triangles, x)
    }
}

/// Moves `outer` out of the way of `inner`, both placed around `body`: its vertices along the way out, their neighbours with them, and then
/// what of its triangles meets those below all the same.
fn put_over(outer: &mut TriMesh, inner: &TriMesh, body: &Body) -> Result<(), SceneError> {
    let refused = |e| SceneError::from(DistanceError::Refused(format!("{e:?}")));
    let below = ParryMesh::new(inner.positions.clone(), inner.triangles.clone()).map_err(refused)?;
    let topology = Topology::new(outer);
    let mut moves = vec![DVec3::ZERO; outer.vertex_count()];
    for _ in 0..ROUNDS {
        let there: Vec<DVec3> = outer.positions.iter().zip(&moves).map(|(x, m)| *x + *m).collect();
        let missing = missing(&there, inner, &below, body);
        if missing.iter().all(|m| *m == DVec3::ZERO) {
            break;
        }
        let bound: Vec<DVec3> = moves.iter().zip(&missing).map(|(m, more)| *m + *more).collect();
        moves.clone_from(&bound);
        for _ in 0..SWEEPS {
            moves = (0..moves.len()).map(|v| 0.5 * (moves[v] + mean(&topology, &moves, v))).collect();
        }
        // What had to move moves at least as far.
        for ((m, bound), missing) in moves.iter_mut().zip(&bound).zip(&missing) {
            if *missing != DVec3::ZERO && m.length_squared() < bound.length_squared() {
                *m = *bound;
            }
        }
    }
    outer.positions.iter_mut().zip(moves).for_each(|(x, m)| *x += m);
    lift_off(outer, inner);
    Ok(())
}

/// Moves what of `outer` is through `inner` to its outer side, a little at a time, neighbours with it.
fn lift_off(outer: &mut TriMesh, inner: &TriMesh) {
    let topology = Topology::new(outer);
    for _ in 0..LIFTS {
        let crossing = crossing_pairs(outer, inner);
        if crossing.is_empty() {
            break;
        }
        let mut out = vec![DVec3::ZERO; outer.vertex_count()];
        for [t, u] in crossing {
            let normal = inner.double_area_vector(u as usize).normalize_or_zero();
            outer.triangles[t as usize].iter().for_each(|&v| out[v as usize] += normal);
        }
        let moves: Vec<DVec3> = out.iter().map(|out| out.normalize_or_zero() * LIFT).collect();
        for (v, x) in outer.positions.iter_mut().enumerate() {
            *x += if moves[v] == DVec3::ZERO { 0.5 * mean(&topology, &moves, v) } else { moves[v] };
        }
    }
}

fn mean(topology: &Topology, of: &[DVec3], v: usize) -> DVec3 {
    let neighbours = topology.neighbours(v as u32);
    neighbours.iter().map(|&w| of[w as usize]).sum::<DVec3>() / neighbours.len().max(1) as f64
}

/// What each vertex has to move outward, m.
fn missing(x: &[DVec3], inner: &TriMesh, below: &ParryMesh, body: &Body) -> Vec<DVec3> {
    let found = body.nearest_all(x);
    let missing = |nearest: &SurfacePoint| {
        let left = leaves(nearest.point, nearest.normal, (inner, below), body);
        nearest.normal * (left + CLEARANCE - nearest.signed_distance).max(0.0)
    };
    found.iter().map(missing).collect()
}

/// How far from `c` the way out leaves the last of the sheets it goes through, m. One met from its outside ends the way: out of an arm
/// one may come upon a skirt; and so does one that is another place's, to which the body is nearer by another way.
fn leaves(c: DVec3, out: DVec3, (inner, below): (&TriMesh, &ParryMesh), body: &Body) -> f64 {
    let (mut last, mut from) = (f64::NEG_INFINITY, 0.0);
    for _ in 0..SHEETS {
        let ray = Ray::new(c + out * from, out);
        let Some(met) = below.cast_local_ray_and_get_normal(&ray, FARTHEST - from, false) else { break };
        let FeatureId::Face(t) = met.feature else { break };
        let at = from + met.time_of_impact;
        let outward = inner.double_area_vector(t as usize % inner.triangles.len()).dot(out) > 0.0;
        if !outward || body.nearest(c + out * at).signed_distance < ITS_OWN * at {
            break;
        }
        (last, from) = (at, at + BEHIND);
        if from >= FARTHEST {
            break;
        }
    }
    last
}

/// Puts `more` beside `mesh`, with its groups; returns how many vertices there were before.
pub(super) fn join(mesh: &mut TriMesh, rest: &mut RestShape, more: TriMesh, more_rest: RestShape) -> u32 {
    let n = mesh.vertex_count() as u32;
    let named = |mesh: &mut TriMesh| {
        if mesh.groups.is_empty() {
            mesh.groups.push("garment".to_owned());
            mesh.triangle_group = vec![0; mesh.triangles.len()];
        }
    };
    let mut more = more;
    named(mesh);
    named(&mut more);
    let groups = mesh.groups.len() as u32;
    // A name that is there already gets a number, so that each stays findable.
    for name in more.groups {
        let taken = |name: &String| mesh.groups.contains(name);
        let numbered = (2..).map(|k| format!("{name}-{k}")).find(|name| !taken(name)).unwrap_or_default();
        mesh.groups.push(if taken(&name) { numbered } else { name });
    }
    mesh.triangle_group.extend(more.triangle_group.iter().map(|g| g + groups));
    mesh.positions.extend(more.positions);
    mesh.triangles.extend(more.triangles.iter().map(|t| t.map(|v| v + n)));
    rest.corners.extend(more_rest.corners);
    n
}
