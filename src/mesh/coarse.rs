//! A garment with fewer triangles, and the deformation of the fine garment that follows from its own: nested iteration drapes
//! coarse garments on the way to full resolution.
//!
//! **Decimation.** Vertices of the coarse garment are vertices of the fine one. Edges are collapsed onto one of their ends, the
//! shortest first. A collapse keeps the surface a manifold with the same boundary loops (link condition), turns no
//! triangle by more than 60°, makes no sliver and turns no boundary by more than 45°. N vertices want edges of
//! ℓ = √(2A/(√3 N)); passes collapse what is shorter than a share of ℓ, so the edges are as even as the vertices allow.
//! Then edges are flipped towards the Delaunay condition.
//!
//! **Rest shape.** J_t maps triangle t as placed to its rest shape. The squares JᵀJ of the fine triangles around a coarse one, turned
//! into its plane, are averaged by area, and so are the directions of their warp. The root of the mean, turned so that the
//! warp runs along y, takes the coarse triangle to its rest shape. Its fabric is that of the largest area of them. A chord
//! is shorter than the cloth above it, in both shapes alike.
//!
//! **Prolongation.** The fine garment follows the coarse one by
//!
//! x_v = Σ_i b_i [x_i + F_i (X_v − X_i)],   F_i = argmin Σ_j |x_j − x_i − F (X_j − X_i)|² + h² |n_i − F N_i|²,
//!
//! over the corners i of the coarse triangle that vertex v lies on, so that the fine surface is bent between the coarse
//! vertices instead of creased along their edges.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A | area of the mesh | m² |
//! | X, x | positions before and after | m |
//! | b_i | barycentric coordinates of v on its coarse triangle, as placed | – |
//! | F_i | deformation gradient about coarse vertex i, over its neighbours j | – |
//! | N_i, n_i | its normal before and after | – |
//! | h | mean length of its edges | m |
//!
//! Source: collapses after Hoppe and others: "Mesh Optimization" (SIGGRAPH 1993); the rest is own. Limits: a mesh that is not
//! a manifold has no coarse one, nor has one whose triangles are far from their rest shape (open seams), where a mean
//! of their maps is meaningless. Where collapses are refused the count is not reached.

use std::collections::BTreeMap;

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::Triangle;
use rayon::prelude::*;

use super::half_edge::{HalfEdgeMesh, flip_to_delaunay, previous};
use super::{Csr, NONE, RestShape, Topology, TriMesh, each_once, outer, renumbered};

use crate::base::math;

/// A triangle stretched or compressed by more than this factor in any direction is not undraped cloth. A heuristic.
const MAX_STRETCH: f64 = 3.0;

/// Share of the triangles that may be stretched further, as at the points of darts: 0.002 in a sewn jumpsuit.
const MAX_STRETCHED_SHARE: f64 = 0.005;

/// A collapse may turn no boundary by more than 45°: the least cosine. A heuristic.
const MAX_BOUNDARY_TURN: f64 = 0.7;

/// Shape of a triangle, 4√3 A over the sum of its squared edges (1: equilateral), below which a collapse is refused unless it was
/// lower before. A heuristic.
const MIN_SHAPE: f64 = 0.35;

/// Edges shorter than these shares of ℓ are collapsed, pass after pass.
const PASSES: [f64; 8] = [0.7, 0.85, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5];

/// No edge grows beyond this share of ℓ.
const MAX_LENGTH: f64 = 1.7;

/// A garment with fewer triangles.
#[derive(Debug, Clone)]
pub struct Coarse {
    /// The mesh as placed.
    pub mesh: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// The fine vertex of each coarse vertex.
    pub vertices: Vec<u32>,
    /// Corners of the coarse triangle under each fine vertex, and its barycentric coordinates; all zero without a triangle.
    anchors: Vec<([u32; 3], [f64; 3])>,
}

impl Coarse {
    /// About `count` of the vertices of `mesh`; `None` where it cannot be made coarser, by half at least.
    #[must_use]
    pub fn new(mesh: &TriMesh, rest: &RestShape, count: usize) -> Option<Self> {
        let maps: Vec<Map> = mesh.triangles.par_iter().zip(&rest.corners).map(|(t, c)| Map::new(mesh, *t, c)).collect();
        let stretched = maps.iter().filter(|map| !map.is_moderate()).count();
        if stretched as f64 > MAX_STRETCHED_SHARE * maps.len() as f64 {
            return None;
        }
        let (coarse, vertices, onto) = decimate(mesh, count)?;
        // Halving at least also ends the sequence of coarser and coarser meshes.
        if 2 * coarse.vertex_count() > mesh.vertex_count() {
            return None;
        }
        let topology = Topology::new(&coarse);
        let triangles_of = incidence(&coarse);
        // The anchor of a fine vertex is searched among the triangles at its coarse vertex and at the neighbours of that.
        let about: Vec<Vec<u32>> = (0..coarse.vertex_count() as u32)
            .into_par_iter()
            .with_min_len(64)
            .map(|v| {
                let near = std::iter::once(&v).chain(topology.neighbours(v));
                each_once(near.flat_map(|&w| triangles_of.of(w as usize)).copied())
            })
            .collect();
        let anchors: Vec<_> = (mesh.positions.par_iter().zip(&onto).with_min_len(256))
            .map(|(x, &owner)| anchor(&coarse, about.get(owner as usize)?, *x))
            .collect();
        let rest = rest_shape(mesh, rest, &maps, &coarse, &vertices, &anchors)?;
        let anchors =
            anchors.into_iter().map(|a| a.map_or(([0; 3], [0.0; 3]), |a| (coarse.triangles[a.0], a.1))).collect();
        Some(Self { mesh: coarse, topology, rest, vertices, anchors })
    }

    /// The entries of the coarse vertices in a list over the fine ones.
    pub(crate) fn restrict<T: Copy>(&self, fine: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&v| fine[v as usize]).collect()
    }

    /// Positions of the fine vertices, m, that move from `from` as the coarse ones move to `to`.
    #[must_use]
    pub fn prolong(&self, from: &[DVec3], to: &[DVec3]) -> Vec<DVec3> {
        let before = self.mesh.with_positions(self.restrict(from));
        let after = self.mesh.with_positions(to.to_vec());
        let normals = before.vertex_normals().into_iter().zip(after.vertex_normals());
        let gradients: Vec<DMat3> = normals
            .enumerate()
            .map(|(i, (normal, turned))| {
                let (mut spread, mut moved, mut count) = (DMat3::ZERO, DMat3::ZERO, 0.0);
                for &j in self.topology.neighbours(i as u32) {
                    let edge = before.positions[j as usize] - before.positions[i];
                    spread += outer(edge, edge);
                    moved += outer(after.positions[j as usize] - after.positions[i], edge);
                    count += 1.0;
                }
                let square = (spread.x_axis.x + spread.y_axis.y + spread.z_axis.z) / f64::max(count, 1.0);
                let gradient =
                    (moved + outer(turned, normal) * square) * (spread + outer(normal, normal) * square).inverse();
                if gradient.is_finite() { gradient } else { DMat3::IDENTITY }
            })
            .collect();
        (self.anchors.par_iter().zip(from))
            .map(|((corners, b), x)| {
                if b.iter().all(|b| *b == 0.0) {
                    return *x;
                }
                let one = |(&i, b): (&u32, &f64)| {
                    let i = i as usize;
                    (after.positions[i] + gradients[i] * (*x - before.positions[i])) * *b
                };
                corners.iter().zip(b).map(one).sum()
            })
            .collect()
    }
}

/// The map from a triangle as placed to its rest shape.
struct Map {
    /// Gradients of the weft and warp coordinate, in the triangle's plane, 1.
    gradients: [DVec3; 2],
    normal: DVec3,
    area: f64,
}

impl Map {
    fn new(mesh: &TriMesh, triangle: [u32; 3], rest: &[DVec2; 3]) -> Self {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let double = (b - a).cross(c - a);
        let normal = double.normalize_or_zero();
        // The edges' duals: along(b − a) = 1 and along(c − a) = 0, and the other way round.
        let duals = [(c - a).cross(normal), normal.cross(b - a)].map(|d| d / double.length());
        let along = |of: fn(DVec2) -> f64| duals[0] * of(rest[1] - rest[0]) + duals[1] * of(rest[2] - rest[0]);
        Self { gradients: [along(|r| r.x), along(|r| r.y)], normal, area: 0.5 * double.length() }
    }

    fn is_moderate(&self) -> bool {
        let [u, v] = self.gradients;
        // Squares of the singular values, by their sum and product.
        let (half, product) = (0.5 * (u.length_squared() + v.length_squared()), u.cross(v).length_squared());
        let apart = (half * half - product).max(0.0).sqrt();
        let limit = MAX_STRETCH * MAX_STRETCH;
        half + apart <= limit && (half - apart) * limit >= 1.0
    }
}

/// Triangles at each vertex.
fn incidence(mesh: &TriMesh) -> Csr<u32> {
    let corners = || (0u32..).zip(&mesh.triangles).flat_map(|(t, triangle)| triangle.map(|v| (v, t)));
    Csr::gathered(mesh.vertex_count(), corners)
}

/// The nearest of some coarse triangles, the first of those as near, with barycentric coordinates.
fn anchor(coarse: &TriMesh, about: &[u32], x: DVec3) -> Option<(usize, [f64; 3])> {
    let mut best: Option<(f64, usize, [f64; 3])> = None;
    for &t in about {
        let [a, b, c] = coarse.corners(t as usize);
        let (found, place) = Triangle::new(a, b, c).project_local_point_and_get_location(x, false);
        let distance = found.point.distance_squared(x);
        if let (true, Some(coordinates)) = (best.is_none_or(|best| distance < best.0), place.barycentric_coordinates())
        {
            best = Some((distance, t as usize, coordinates));
        }
        if distance == 0.0 {
            break;
        }
    }
    best.map(|(_, t, coordinates)| (t, coordinates))
}

/// Rest corners of the coarse triangles, and their fabrics.
fn rest_shape(
    mesh: &TriMesh,
    rest: &RestShape,
    maps: &[Map],
    coarse: &TriMesh,
    vertices: &[u32],
    anchors: &[Option<(usize, [f64; 3])>],
) -> Option<RestShape> {
    let triangles_of = incidence(mesh);
    let mut over: Vec<Vec<u32>> = (coarse.triangles.iter())
        .map(|t| t.iter().flat_map(|&v| triangles_of.of(vertices[v as usize] as usize)).copied().collect())
        .collect();
    for (v, (t, _)) in anchors.iter().enumerate().filter_map(|(v, anchor)| Some((v, anchor.as_ref()?))) {
        over[*t].extend(triangles_of.of(v));
    }
    let corners = (0..coarse.triangles.len())
        .map(|t| {
            let [a, b, c] = coarse.corners(t);
            let normal = (b - a).cross(c - a).try_normalize()?;
            let x = (b - a).try_normalize()?;
            let y = normal.cross(x);
            let (mut square, mut warp) = (DMat2::ZERO, DVec2::ZERO);
            for map in over[t].iter().map(|&f| &maps[f as usize]) {
                let turn = DQuat::from_rotation_arc(map.normal, normal);
                let [u, v] = map.gradients.map(|g| turn * g).map(|g| DVec2::new(g.dot(x), g.dot(y)));
                let outer = |g: DVec2| DMat2::from_cols(g * g.x, g * g.y);
                square += (outer(u) + outer(v)) * map.area;
                // Along the warp the weft coordinate stays; twice its angle, since up and down are one direction.
                let along = u.perp().normalize_or_zero();
                warp += DVec2::new(along.x * along.x - along.y * along.y, 2.0 * along.x * along.y) * map.area;
            }
            let area: f64 = over[t].iter().map(|&f| maps[f as usize].area).sum();
            let stretch = root(square * area.recip());
            let half = 0.5 * math::atan2(warp.y, warp.x);
            let along = (stretch * math::unit(half)).try_normalize()?;
            // Turns `along` onto y.
            let turn = DMat2::from_cols(DVec2::new(along.y, along.x), DVec2::new(-along.x, along.y));
            Some([a, b, c].map(|p| turn * stretch * DVec2::new((p - a).dot(x), (p - a).dot(y))))
        })
        .collect::<Option<_>>()?;
    let fabric = |over: &Vec<u32>| {
        let mut areas: BTreeMap<u16, f64> = BTreeMap::new();
        for &f in over {
            *areas.entry(rest.cut_from[f as usize]).or_default() += maps[f as usize].area;
        }
        areas.into_iter().fold((0, 0.0), |largest, of| if of.1 > largest.1 { of } else { largest }).0
    };
    let cut_from = if rest.cut_from.is_empty() { Vec::new() } else { over.iter().map(fabric).collect() };
    Some(RestShape { cut_from, ..RestShape::new(corners) })
}

/// The root of a positive symmetric matrix, by Cayley and Hamilton.
fn root(m: DMat2) -> DMat2 {
    let s = m.determinant().max(0.0).sqrt();
    let t = (m.x_axis.x + m.y_axis.y + 2.0 * s).sqrt();
    (m + DMat2::from_diagonal(DVec2::splat(s))) * t.recip()
}

/// `mesh` with about `count` vertices, the old vertex of each, and the vertex that each old one was collapsed onto ([`NONE`] for
/// one without triangles); `None` where `mesh` is not a manifold.
fn decimate(mesh: &TriMesh, count: usize) -> Option<(TriMesh, Vec<u32>, Vec<u32>)> {
    let n = mesh.vertex_count();
    let area: f64 = mesh.triangle_areas().iter().sum();
    let edge = (2.0 * area / (3f64.sqrt() * count.max(1) as f64)).sqrt();
    let mut work = HalfEdgeMesh::new(mesh, vec![0; n])?;
    for h in 0..work.half_edge_count() as u32 {
        if work.twin(h) == NONE {
            let ends = [work.origin(h), work.target(h)];
            ends.into_iter().for_each(|v| work.tags[v as usize] = 1);
        }
    }
    let locked = pinched(mesh, &work);
    let mut onto: Vec<u32> = (0..n as u32).collect();
    for share in PASSES {
        if work.vertex_count() <= count {
            break;
        }
        let mut short: Vec<(f64, u32)> = (0..work.half_edge_count() as u32)
            .filter(|&h| work.is_first(h))
            .map(|h| (work.vector(h).length(), h))
            .filter(|e| e.0 < share * edge)
            .collect();
        short.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, h) in short {
            if work.vertex_count() <= count {
                break;
            }
            if work.is_alive(h) && work.vector(h).length() < share * edge {
                collapse(&mut work, h, &locked, MAX_LENGTH * edge, &mut onto);
            }
        }
    }
    flip_to_delaunay(&mut work);
    let vertices: Vec<u32> = (0..n as u32).filter(|&v| work.is_vertex_alive(v)).collect();
    let number = renumbered(n, |v| work.is_vertex_alive(v as u32));
    let end = |mut v: u32| {
        while onto[v as usize] != v {
            v = onto[v as usize];
        }
        number[v as usize]
    };
    let onto = (0..n as u32).map(end).collect();
    Some((work.compact().0, vertices, onto))
}

/// Vertices where two pieces of surface meet in a point: the triangles around them are not all connected by edges.
fn pinched(mesh: &TriMesh, work: &HalfEdgeMesh) -> Vec<bool> {
    let mut fans = vec![0i32; mesh.vertex_count()];
    for &v in mesh.triangles.iter().flatten() {
        fans[v as usize] += 1;
    }
    for (v, fan) in fans.iter_mut().enumerate() {
        work.around(v as u32, |_| *fan -= 1);
    }
    fans.into_iter().map(|missed| missed != 0).collect()
}

/// Collapses an edge onto the end that leaves the better triangles, if a collapse is allowed.
fn collapse(work: &mut HalfEdgeMesh, h: u32, locked: &[bool], longest: f64, onto: &mut [u32]) {
    let best = [h, work.twin(h)]
        .into_iter()
        .filter(|&h| h != NONE)
        .filter_map(|h| Some((worst_shape(work, h, locked, longest)?, h)))
        .reduce(|a, b| if b.0 > a.0 { b } else { a });
    // A boundary edge has one half only, and is collapsed in its direction only.
    if let Some((_, h)) = best {
        let (gone, stays) = (work.origin(h), work.target(h));
        onto[gone as usize] = stays;
        work.collapse(h, work.positions[stays as usize]);
    }
}

/// The worst shape of a triangle after `h` is collapsed onto its target; `None` if that is not allowed.
fn worst_shape(work: &HalfEdgeMesh, h: u32, locked: &[bool], longest: f64) -> Option<f64> {
    let (v0, v1) = (work.origin(h), work.target(h));
    if locked[v0 as usize] || locked[v1 as usize] || !work.can_collapse(h) || !straight(work, h) {
        return None;
    }
    let at = work.positions[v1 as usize];
    let mut worst = Some(f64::INFINITY);
    work.around_moved(v0, v1, at, |triangle| {
        let [from, b, c] = triangle.corners;
        let (was, is) = (shape(from, b, c), shape(at, b, c));
        let allowed = !triangle.turns && triangle.longest <= longest && (is >= MIN_SHAPE || is >= was);
        worst = worst.filter(|_| allowed).map(|worst| worst.min(is));
    });
    worst
}

/// Whether the boundary, if `h` starts on one, turns by less than 45° at the origin of `h`.
fn straight(work: &HalfEdgeMesh, h: u32) -> bool {
    let (v0, v1) = (work.origin(h), work.target(h));
    if !work.is_boundary(v0) {
        return true;
    }
    let at = work.positions[v0 as usize];
    let ahead = (work.positions[v1 as usize] - at).normalize_or_zero();
    let mut straight = false;
    work.around(v0, |k| {
        let before = previous(k);
        if work.twin(before) == NONE {
            let behind = (at - work.positions[work.origin(before) as usize]).normalize_or_zero();
            straight |= behind.dot(ahead) > MAX_BOUNDARY_TURN;
        }
    });
    straight
}

/// 4√3 A over the sum of squared edges.
fn shape(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    2.0 * 3f64.sqrt() * (b - a).cross(c - a).length() / squares.max(f64::MIN_POSITIVE)
}
