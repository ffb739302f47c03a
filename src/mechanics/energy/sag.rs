//! What is added to the cloth's thickness because contact is felt at vertices alone: a triangle of side l sags by l²/(6 R).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | l | side of a triangle, squared on average over the mesh | m |
//! | R | radius of the body, [`TIGHTEST_RADIUS`] | m |

use crate::mesh::TriMesh;

/// The tightest body the vertices alone keep off the triangles between them, m: a shoulder's ridge, a bust's apex.
const TIGHTEST_RADIUS: f64 = 0.03;

/// No mesh is so coarse that its cloth floats farther than this from the body, m: the gap cloth simulators commonly keep.
const LARGEST_SAG: f64 = 3e-3;

/// How far a round body reaches through the triangles of a mesh whose vertices touch it, m: contact is felt at the vertices
/// alone. A triangle of side l, and so of circumradius l/√3, sags by l²/(6 R) over a sphere of radius R.
pub(super) fn sag(mesh: &TriMesh) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        sum += a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        count += 3.0;
    }
    (sum / f64::max(count, 1.0) / (6.0 * TIGHTEST_RADIUS)).min(LARGEST_SAG)
}
