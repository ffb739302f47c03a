//! The surface of a solid as a closed triangle mesh: marching tetrahedra.
//!
//! Each cube of a grid is cut into the six tetrahedra around its diagonal (Freudenthal), which match across cubes, so the surface is closed and
//! manifold by construction; it crosses a tetrahedron's edge where the field changes sign, linearly interpolated (Doi,
//! Koide 1991). Blocks whose centre is far from the surface are filled with its value unsampled.
//!
//! Limits: parts thinner than the spacing can be missed; the triangles are badly shaped and are there to be remeshed.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::solid::Solid;
use crate::mesh::TriMesh;

/// Nodes along a block's edge.
const BLOCK: i32 = 4;
/// A block is skipped if its centre's field is over this many block radii: the field is a distance only near the surface.
const FAR: f64 = 2.5;
/// The six tetrahedra: the order in which the three axes are walked from one corner of the cube to the opposite one.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
/// A crossing keeps this share of the edge from its ends, so that no triangle is of no size.
const END_GAP: f64 = 0.02;

/// The surface of `solid` within the box from `low` to `high`, sampled every `spacing` metres. Its winding is outward.
/// The box must hold the whole surface for the mesh to be closed.
pub(crate) fn contour(solid: &dyn Solid, low: DVec3, high: DVec3, spacing: f64) -> TriMesh {
    let blocks = ((high - low) / (spacing * f64::from(BLOCK))).ceil().as_ivec3().max(IVec3::ONE);
    let nodes = blocks * BLOCK;
    let position = |n: IVec3| low + n.as_dvec3() * spacing;
    let radius = 0.5 * 3f64.sqrt() * f64::from(BLOCK) * spacing;
    let sampled: Vec<Vec<f64>> = (0..blocks.x * blocks.y * blocks.z)
        .into_par_iter()
        .map(|b| {
            let corner = BLOCK * IVec3::new(b % blocks.x, b / blocks.x % blocks.y, b / (blocks.x * blocks.y));
            let centre = solid.at(position(corner) + DVec3::splat(0.5 * f64::from(BLOCK) * spacing)).value;
            let here = |i: i32| corner + IVec3::new(i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK));
            let far = centre.abs() > FAR * radius;
            (0..BLOCK * BLOCK * BLOCK).map(|i| if far { centre } else { solid.at(position(here(i))).value }).collect()
        })
        .collect();
    let value = |n: IVec3| {
        let (b, i) = (n / BLOCK, n % BLOCK);
        sampled[(b.x + blocks.x * (b.y + blocks.y * b.z)) as usize][(i.x + BLOCK * (i.y + BLOCK * i.z)) as usize]
    };
    let index = |n: IVec3| (n.x + nodes.x * (n.y + nodes.y * n.z)) as usize;
    let mut mesh = TriMesh::default();
    // One vertex per crossed edge: the edge's lower node and its direction, one of seven.
    let mut crossing = vec![u32::MAX; 7 * (nodes.x * nodes.y * nodes.z) as usize];
    for cell in 0..(nodes.x - 1) * (nodes.y - 1) * (nodes.z - 1) {
        let (w, d) = (nodes.x - 1, nodes.y - 1);
        let base = IVec3::new(cell % w, cell / w % d, cell / (w * d));
        let mut inside = 0;
        for i in 0..8 {
            inside += i32::from(value(base + IVec3::new(i & 1, i >> 1 & 1, i >> 2)) < 0.0);
        }
        if inside == 0 || inside == 8 {
            continue;
        }
        for order in ORDERS {
            let mut corners = [base; 4];
            for (i, &axis) in order.iter().enumerate() {
                corners[i + 1] = corners[i];
                corners[i + 1][axis] += 1;
            }
            let mut cut = |a: usize, b: usize| -> u32 {
                let (a, b) = (a.min(b), a.max(b));
                let step = corners[b] - corners[a];
                let slot = 7 * index(corners[a]) + (step.x + 2 * step.y + 4 * step.z - 1) as usize;
                if crossing[slot] == u32::MAX {
                    let (fa, fb) = (value(corners[a]), value(corners[b]));
                    let t = (fa / (fa - fb)).clamp(END_GAP, 1.0 - END_GAP);
                    crossing[slot] = mesh.positions.len() as u32;
                    mesh.positions.push(position(corners[a]).lerp(position(corners[b]), t));
                }
                crossing[slot]
            };
            let is_in = corners.map(|n| value(n) < 0.0);
            let (ins, outs): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| is_in[i]);
            let polygon: Vec<u32> = match (ins.as_slice(), outs.as_slice()) {
                (&[a], &[x, y, z]) | (&[x, y, z], &[a]) => vec![cut(a, x), cut(a, y), cut(a, z)],
                (&[a, b], &[x, y]) => vec![cut(a, x), cut(a, y), cut(b, y), cut(b, x)],
                _ => continue,
            };
            let outward: DVec3 = outs.iter().map(|&i| position(corners[i])).sum::<DVec3>() / outs.len() as f64
                - ins.iter().map(|&i| position(corners[i])).sum::<DVec3>() / ins.len() as f64;
            for i in 1..polygon.len() - 1 {
                let [a, b, c] = [polygon[0], polygon[i], polygon[i + 1]];
                let [pa, pb, pc] = [a, b, c].map(|v| mesh.positions[v as usize]);
                let facing = (pb - pa).cross(pc - pa).dot(outward) > 0.0;
                mesh.triangles.push(if facing { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::solid::Ellipsoid;
    use crate::mesh::Topology;

    #[test]
    fn an_ellipsoid_comes_out_closed_outward_and_of_its_volume() {
        let solid = Ellipsoid { centre: DVec3::splat(0.003), radii: DVec3::new(0.3, 0.2, 0.1), lean: 0.0 };
        let mesh = contour(&solid, DVec3::splat(-0.35), DVec3::splat(0.35), 0.02);
        let topology = Topology::new(&mesh);
        assert!(topology.edge_valence.iter().all(|&v| v == 2));
        assert_eq!(topology.components().1, 1);
        assert_eq!(mesh.positions.len() + mesh.triangles.len() - topology.edges.len(), 2);
        let volume: f64 = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.006;
        assert!((volume / exact - 1.0).abs() < 0.02, "{volume} {exact}");
    }
}
