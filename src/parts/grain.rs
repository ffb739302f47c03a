//! Lengths of garment edges across and along the grain, so that a PART can be cut narrow and tall.
//!
//! ```text
//! l² = (a l_u)² + (b l_v)²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | l_u, l_v | extent of an edge along weft and warp, placed | m |
//! | a, b | factors that make a level's extent as wide as tall | – |
//!
//! Source: own. The direction is that of the rest shape (the warp runs up the garment and along a sleeve), the length that of the
//! garment as placed; an edge between two triangles takes the mean of both directions. Limits: as good as the rest shape's grain.

use crate::mesh::{Lists, RestShape, Topology, TriMesh};

/// Squared extents of every garment edge along weft and warp.
#[derive(Debug, Clone, PartialEq)]
pub struct Grain {
    /// l_u², l_v² from each vertex to its neighbours, in the order of [`Topology::neighbours`], m².
    squares: Lists<[f64; 2]>,
}

impl Grain {
    /// Reads the grain off the rest shape, which has the triangles of the mesh.
    #[must_use]
    pub fn new(mesh: &TriMesh, topology: &Topology, rest: &RestShape) -> Self {
        let of_edge: Vec<[f64; 2]> = (0..topology.edges.len()).map(|e| squares(mesh, topology, rest, e)).collect();
        let mut squares = Lists::default();
        for v in 0..mesh.vertex_count() as u32 {
            let edges = topology.neighbours(v).iter().filter_map(|&w| topology.edge_between(v, w));
            squares.push(edges.map(|e| of_edge[e]));
        }
        Self { squares }
    }
}

fn squares(mesh: &TriMesh, topology: &Topology, rest: &RestShape, edge: usize) -> [f64; 2] {
    let [a, b] = topology.edges[edge];
    let along = |&t: &u32| {
        let (triangle, corners) = (mesh.triangles.get(t as usize)?, rest.corners.get(t as usize)?);
        let corner = |v: u32| triangle.iter().position(|&c| c == v).map(|i| corners[i]);
        let d = corner(b)? - corner(a)?;
        (d.length_squared() > 0.0).then(|| d.y * d.y / d.length_squared())
    };
    let shares: Vec<f64> = topology.edge_triangles[edge].iter().filter_map(along).collect();
    // No rest shape at hand: the same in both directions.
    let warp = if shares.is_empty() { 0.5 } else { shares.iter().sum::<f64>() / shares.len() as f64 };
    let square = mesh.positions[a as usize].distance_squared(mesh.positions[b as usize]);
    [square * (1.0 - warp), square * warp]
}

/// What distances along the cloth are measured by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ruler<'a> {
    /// The garment.
    pub(crate) mesh: &'a TriMesh,
    /// Its connectivity.
    pub(crate) topology: &'a Topology,
    /// The grain, with the factors for lengths along weft and warp; `None` for lengths as they are.
    pub(crate) grain: Option<(&'a Grain, [f64; 2])>,
}

impl Ruler<'_> {
    /// The neighbours of a vertex with their distances, m.
    pub(crate) fn neighbours(&self, v: u32) -> impl Iterator<Item = (u32, f64)> {
        let x = self.mesh.positions[v as usize];
        self.topology.neighbours(v).iter().enumerate().map(move |(i, &w)| {
            let length = match self.grain {
                None => x.distance(self.mesh.positions[w as usize]),
                Some((grain, [weft, warp])) => {
                    let [u, v] = grain.squares.of(v as usize)[i];
                    (weft * weft * u + warp * warp * v).sqrt()
                }
            };
            (w, length)
        })
    }
}
