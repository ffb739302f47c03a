//! Several fabrics in one garment: what a vertex between them has.
//!
//! A vertex on a seam stands for cloth of both sides, each by the rest area that the vertex has of it:
//!
//! c_v = Σ A_t c_t / Σ A_t = c₀ + Σ A_t (c_t − c₀) / Σ A_t
//!
//! over its triangles t. In the second form, c₀ being that of one of them, a vertex within one fabric has that fabric's constant to the last bit.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | thickness, friction, ... | its own |
//! | A_t | rest area of a triangle | m² |

use super::Fabric;
use crate::mesh::{RestShape, TriMesh};

impl AsRef<[Fabric]> for Fabric {
    /// A garment all of one fabric.
    fn as_ref(&self) -> &[Self] {
        std::slice::from_ref(self)
    }
}

/// A constant of the fabrics at every vertex; where there is no triangle, the first fabric's.
pub(crate) fn at_vertices(
    mesh: &TriMesh,
    rest: &RestShape,
    fabrics: &[Fabric],
    constant: impl Fn(&Fabric) -> f64,
) -> Vec<f64> {
    let of: Vec<f64> = fabrics.iter().map(constant).collect();
    let n = mesh.vertex_count();
    let first = of.first().copied().unwrap_or_default();
    let (mut base, mut more, mut area) = (vec![first; n], vec![0.0; n], vec![0.0; n]);
    // A rest shape of no triangles is one of one fabric.
    for ((t, triangle), own) in mesh.triangles.iter().enumerate().zip(rest.areas()) {
        let c = of.get(rest.fabric_of(t)).copied().unwrap_or(first);
        for v in triangle.map(|v| v as usize) {
            if area[v] == 0.0 {
                base[v] = c;
            }
            area[v] += own.abs();
            more[v] += own.abs() * (c - base[v]);
        }
    }
    let mean = |((base, more), area): ((f64, f64), f64)| if area > 0.0 { base + more / area } else { base };
    base.into_iter().zip(more).zip(area).map(mean).collect()
}
