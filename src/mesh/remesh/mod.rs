//! Isotropic remeshing of a surface given by a field, to a vertex count or an edge length.
//!
//! Botsch, Kobbelt, "A Remeshing Approach to Multiresolution Modeling" (SGP 2004): split edges longer than 4/3 of the
//! target length ℓ, collapse those shorter than 4/5 ℓ, flip edges towards six neighbours a vertex (four on a boundary),
//! move each vertex to the weighted centroid of its triangles within the tangent plane, project it back to the surface; repeat.
//! The count N follows from the area A by N ≈ 2A/(√3 ℓ²); ℓ is corrected by √(N/N*) between rounds, and the last few
//! vertices are split or collapsed off one by one, so the count is met exactly.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ℓ | target edge length | m |
//! | N, N* | number of vertices there are, and are wanted | – |
//!
//! Boundary vertices slide along their cut and stay on it. Limits: features sharper than ℓ are lost.

mod passes;
mod relax;

use glam::DVec3;

use crate::mesh::flip::{Rule, flip};
use crate::mesh::half_edge::HalfEdgeMesh;
use crate::mesh::morton::mesh_along_a_curve;
use crate::mesh::{NONE, TriMesh};

/// The surface that is meshed.
pub(crate) trait Surface: Sync {
    /// The point of the surface near `p`, m; for a `tag` above 0 the point of that cut's edge near it.
    fn project(&self, p: DVec3, tag: u8) -> DVec3;
    /// Target edge length at `p` relative to the rest of the surface.
    fn relative_size(&self, p: DVec3) -> f64 {
        let _ = p;
        1.0
    }
}

/// How dense a mesh is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Density {
    /// This many vertices, exactly.
    Vertices(usize),
    /// Edges of about this length, m.
    EdgeLength(f64),
}

/// Rounds of split, collapse, flip and relaxation before the count is looked at: at most doubling the resolution each.
const ROUNDS: usize = 3;
/// Rounds that bring the count near its target.
const COUNT_ROUNDS: usize = 3;
/// Passes of flips and relaxation after the last change of count.
const POLISH: usize = 4;
/// Vertices from which on their order matters: fewer stay in the processor's caches wherever they are.
const SCATTERED: usize = 32_768;

/// Remeshes `mesh`, whose boundary vertices carry tags, to the wanted density. `None` where it is not a manifold, before or
/// after: a surface folded onto itself loses triangles whose vertices others still name.
pub(crate) fn remesh(
    mesh: &TriMesh,
    tags: Vec<u8>,
    surface: &dyn Surface,
    density: Density,
) -> Option<(TriMesh, Vec<u8>)> {
    let mut work = HalfEdgeMesh::new(mesh, tags)?;
    // Σ area/relative² is the area in units of the target edge, whatever the surface's own sizes.
    let area: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            0.5 * mesh.double_area_vector(t).length() / surface.relative_size((a + b + c) / 3.0).powi(2)
        })
        .sum();
    let mut edge = match density {
        Density::EdgeLength(length) => length,
        Density::Vertices(count) => (2.0 * area / (3f64.sqrt() * count as f64)).sqrt(),
    };
    let start = (area / (work.vertex_count() as f64)).sqrt();
    let refining = (start / edge).log2().ceil().max(0.0) as usize;
    for _ in 0..ROUNDS + refining {
        round(&mut work, surface, edge);
    }
    if let Density::Vertices(count) = density {
        for _ in 0..COUNT_ROUNDS {
            edge *= (work.vertex_count() as f64 / count as f64).sqrt();
            round(&mut work, surface, edge);
        }
        for _ in 0..2 {
            passes::trim(&mut work, surface, count);
            flip(&mut work, Rule::Valence);
            relax::relax(&mut work, surface);
        }
        passes::trim(&mut work, surface, count);
    }
    for _ in 0..POLISH {
        flip(&mut work, Rule::Delaunay);
        relax::relax(&mut work, surface);
    }
    flip(&mut work, Rule::Delaunay);
    let (mesh, tags) = work.compact();
    if mesh.triangles.iter().flatten().any(|&v| v == NONE) || !mesh.positions.iter().all(|p| p.is_finite()) {
        return None;
    }
    Some(if mesh.vertex_count() < SCATTERED { (mesh, tags) } else { mesh_along_a_curve(&mesh, &tags) })
}

fn round(work: &mut HalfEdgeMesh, surface: &dyn Surface, edge: f64) {
    passes::split(work, surface, edge * 4.0 / 3.0);
    passes::collapse(work, surface, edge * 4.0 / 5.0, edge * 4.0 / 3.0);
    flip(work, Rule::Valence);
    relax::relax(work, surface);
}
