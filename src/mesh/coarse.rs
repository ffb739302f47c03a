//! The same garment with fewer triangles, and the way back: what a drape goes through on its way to full resolution.
//!
//! Vertices of the coarse garment are vertices of the fine one (`decimate.rs`). Its triangles get the rest shape that the fine ones about them
//! have: with J_t the map from triangle t as placed to its rest shape, their squares JᵀJ, turned into the coarse triangle's plane, are
//! averaged by area, and so are the directions of their warp; the root of the mean, turned so that the warp runs along y, takes the coarse triangle to its
//! own rest shape, and the fabric that most of them are cut from is its own. A chord is shorter than the cloth above it, in both shapes alike.
//!
//! What the coarse garment does, the fine one follows:
//!
//! x_v = Σ_i b_i [x_i + F_i (X_v − X_i)],   F_i = argmin Σ_j |x_j − x_i − F (X_j − X_i)|² + h² |n_i − F N_i|²,
//!
//! over the corners i of the coarse triangle that vertex v lies on, so that the fine surface is bent between the coarse vertices instead of
//! creased along their edges.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | X, x | positions before and after | m |
//! | b_i | barycentric coordinates of v on its coarse triangle, as placed | – |
//! | F_i | deformation gradient about coarse vertex i, over its neighbours j | – |
//! | N_i, n_i | its normal before and after | – |
//! | h | mean length of its edges | m |
//!
//! Source: own. Limits: none for a mesh that is no manifold, nor for one whose triangles are far from their rest shape (seams that are
//! still open): there a mean says nothing.

use std::collections::BTreeMap;

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::Triangle;
use rayon::prelude::*;

use super::decimate::{Decimated, decimate};
use super::{Lists, RestShape, Topology, TriMesh, each_once, outer};

/// A triangle farther from its rest shape than by this factor, in any direction, is no cloth that merely hangs undraped.
const MOST_STRETCH: f64 = 3.0;

/// Share of the triangles that may be so all the same: at the points of darts a sewn garment has some. A jumpsuit has a five-hundredth.
const FEW: f64 = 0.005;

/// A garment with fewer triangles.
#[derive(Debug, Clone)]
pub struct Coarse {
    /// It, as placed.
    pub mesh: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// The fine vertex of each of its own.
    pub vertices: Vec<u32>,
    /// Corners of the coarse triangle under each fine vertex, and barycentric coordinates there; all zero where there is none.
    anchors: Vec<([u32; 3], [f64; 3])>,
}

impl Coarse {
    /// About `count` of the vertices of `mesh`; `None` where it cannot be made coarser, by half at least.
    #[must_use]
    pub fn new(mesh: &TriMesh, rest: &RestShape, count: usize) -> Option<Self> {
        let maps: Vec<Map> = mesh.triangles.par_iter().zip(&rest.corners).map(|(t, c)| Map::new(mesh, *t, c)).collect();
        let immoderate = maps.iter().filter(|map| !map.is_moderate()).count();
        if immoderate as f64 > FEW * maps.len() as f64 {
            return None;
        }
        let Decimated { mesh: coarse, vertices, onto } = decimate(mesh, count)?;
        // One hardly coarser saves nothing, and who asks for coarser ones until there is none would never end.
        if 2 * coarse.vertex_count() > mesh.vertex_count() {
            return None;
        }
        let topology = Topology::new(&coarse);
        let triangles_of = incidence(&coarse);
        // Who ended on a vertex is looked for in its triangles and those of its neighbours, each once.
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

    /// What the coarse vertices have of a list over the fine ones.
    #[must_use]
    pub(crate) fn restrict<T: Copy>(&self, fine: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&v| fine[v as usize]).collect()
    }

    /// Where the fine vertices go from `from` (m) when the coarse ones go to `to` (m).
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

/// From a triangle as placed to its rest shape.
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
        let most = MOST_STRETCH * MOST_STRETCH;
        half + apart <= most && (half - apart) * most >= 1.0
    }
}

/// Triangles at each vertex.
fn incidence(mesh: &TriMesh) -> Lists<u32> {
    let corners = || (0u32..).zip(&mesh.triangles).flat_map(|(t, triangle)| triangle.map(|v| (v, t)));
    Lists::gathered(mesh.vertex_count(), corners)
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
            let half = 0.5 * warp.y.atan2(warp.x);
            let along = (stretch * DVec2::from_angle(half)).try_normalize()?;
            // Turns `along` onto y.
            let turn = DMat2::from_cols(DVec2::new(along.y, along.x), DVec2::new(-along.x, along.y));
            Some([a, b, c].map(|p| turn * stretch * DVec2::new((p - a).dot(x), (p - a).dot(y))))
        })
        .collect::<Option<_>>()?;
    let most = |over: &Vec<u32>| {
        let mut areas: BTreeMap<u16, f64> = BTreeMap::new();
        for &f in over {
            *areas.entry(rest.cut_from[f as usize]).or_default() += maps[f as usize].area;
        }
        areas.into_iter().fold((0, 0.0), |most, of| if of.1 > most.1 { of } else { most }).0
    };
    let cut_from = if rest.cut_from.is_empty() { Vec::new() } else { over.iter().map(most).collect() };
    Some(RestShape { corners, cut_from })
}

/// The root of a positive symmetric matrix, by Cayley and Hamilton.
fn root(m: DMat2) -> DMat2 {
    let s = m.determinant().max(0.0).sqrt();
    let t = (m.x_axis.x + m.y_axis.y + 2.0 * s).sqrt();
    (m + DMat2::from_diagonal(DVec2::splat(s))) * t.recip()
}
