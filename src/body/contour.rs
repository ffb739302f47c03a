//! The surface of an implicit solid as a triangle mesh, clipped at openings.
//!
//! # Contouring
//! Marching tetrahedra: each cube of a grid is divided into the six tetrahedra around its diagonal (Freudenthal), which match
//! across cubes, so the surface is closed and manifold. It crosses a tetrahedron's edge where the linearly interpolated field
//! vanishes (Doi, Koide 1991). Blocks whose centre is far from the surface take the value of their centre.
//!
//! # Clipping
//! An opening is a region given by a field h, positive where cloth is removed. Triangles across h = 0 are clipped at the linear
//! zero of h on their edges. The new vertices have the opening's tag, and the remesher keeps them on the curve f = 0, h = 0 by
//! the smallest step that satisfies both to first order.
//!
//! Limits: parts thinner than the spacing can be missed; the triangles are badly shaped until they are remeshed.

use std::collections::BTreeMap;

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::jet::Jet;
use super::solid::Solid;
use crate::mesh::{Topology, TriMesh, renumbered, retain};

/// Nodes along the edge of a block.
const BLOCK: i32 = 4;
/// Field at the centre, in block radii, beyond which a block is not sampled. More than 1, because the field is a distance only
/// near the surface.
const FAR: f64 = 2.5;
/// The six tetrahedra: orders of the three axes along a path from one corner of the cube to the opposite one.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
/// Least distance of a crossing from the ends of its edge, as a share of the edge; keeps triangles from degenerating.
const END_GAP: f64 = 0.02;

/// Newton steps of a projection; the vertex starts within a fraction of an edge of the surface.
const PROJECTION_STEPS: usize = 3;
/// Length, m, below which a Newton step is the last: the next one is of the order of its square times the curvature.
pub(crate) const CONVERGED: f64 = 1e-4;

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

/// The mesh clipped to h < 0, and its tags with `tag` on the new boundary. Only the component with the most triangle corners is
/// kept.
pub(crate) fn clip(mesh: &TriMesh, tags: &[u8], h: impl Fn(DVec3) -> f64, tag: u8) -> (TriMesh, Vec<u8>) {
    let height: Vec<f64> = mesh.positions.iter().map(|&p| h(p)).collect();
    let keeps = |v: u32| height[v as usize] < 0.0;
    let mut out = TriMesh::new(mesh.positions.clone(), Vec::new());
    let mut out_tags = tags.to_vec();
    let mut crossings: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut crossing = |a: u32, b: u32, out: &mut TriMesh, out_tags: &mut Vec<u8>| -> u32 {
        let (a, b) = (a.min(b), a.max(b));
        *crossings.entry((a, b)).or_insert_with(|| {
            let (ha, hb) = (height[a as usize], height[b as usize]);
            let t = (ha / (ha - hb)).clamp(END_GAP, 1.0 - END_GAP);
            out.positions.push(mesh.positions[a as usize].lerp(mesh.positions[b as usize], t));
            out_tags.push(tag);
            out.positions.len() as u32 - 1
        })
    };
    for &triangle in &mesh.triangles {
        let kept = triangle.iter().filter(|&&v| keeps(v)).count();
        match kept {
            3 => out.triangles.push(triangle),
            1 | 2 => {
                let odd = (0..3).find(|&i| keeps(triangle[i]) == (kept == 1)).unwrap_or(0);
                let [a, b, c] = [0, 1, 2].map(|i| triangle[(odd + i) % 3]);
                let (ab, ca) = (crossing(a, b, &mut out, &mut out_tags), crossing(c, a, &mut out, &mut out_tags));
                if kept == 1 {
                    out.triangles.push([a, ab, ca]);
                } else {
                    out.triangles.extend([[ab, b, c], [ab, c, ca]]);
                }
            }
            _ => {}
        }
    }
    largest_component(&out, &out_tags)
}

fn largest_component(mesh: &TriMesh, tags: &[u8]) -> (TriMesh, Vec<u8>) {
    let (component, count) = Topology::new(mesh).components();
    let mut sizes = vec![0usize; count];
    let mut used = vec![false; mesh.positions.len()];
    for &v in mesh.triangles.iter().flatten() {
        used[v as usize] = true;
        sizes[component[v as usize] as usize] += 1;
    }
    let largest = (0..count).max_by_key(|&c| (sizes[c], std::cmp::Reverse(c))).unwrap_or(0) as u32;
    let keep = |v: usize| used[v] && component[v] == largest;
    let number = renumbered(mesh.positions.len(), keep);
    let (mut kept, mut kept_tags) = (TriMesh::new(mesh.positions.clone(), Vec::new()), tags.to_vec());
    retain(&mut kept.positions, keep);
    retain(&mut kept_tags, keep);
    let of_largest = mesh.triangles.iter().filter(|t| component[t[0] as usize] == largest);
    kept.triangles = of_largest.map(|t| t.map(|v| number[v as usize])).collect();
    (kept, kept_tags)
}

/// The point near `p` on the surface of `solid`; a step shorter than `converged`, m, is the last.
pub(crate) fn onto_surface(solid: &dyn Solid, mut p: DVec3, converged: f64) -> DVec3 {
    for _ in 0..PROJECTION_STEPS {
        let f = solid.at(p);
        let step = f.value / f.gradient.length_squared().max(0.05);
        p -= step * f.gradient;
        if step.abs() < converged {
            break;
        }
    }
    p
}

/// The point near `p` on the surface of `solid` and on the edge h = 0 of an opening.
pub(crate) fn onto_edge(solid: &dyn Solid, h: impl Fn(DVec3) -> Jet, mut p: DVec3) -> DVec3 {
    for _ in 0..PROJECTION_STEPS + 2 {
        let (f, h) = (solid.at(p), h(p));
        let (ff, hh, fh) = (f.gradient.length_squared(), h.gradient.length_squared(), f.gradient.dot(h.gradient));
        let determinant = ff * hh - fh * fh;
        if determinant <= 1e-4 * ff * hh {
            // Surface and opening are tangent or the edge is far: project onto the surface alone.
            return onto_surface(solid, p, CONVERGED);
        }
        let a = (f.value * hh - h.value * fh) / determinant;
        let b = (h.value * ff - f.value * fh) / determinant;
        let step = a * f.gradient + b * h.gradient;
        p -= step.clamp_length_max(0.03);
        if step.length_squared() < 1e-14 {
            break;
        }
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::solid::Ellipsoid;

    #[test]
    fn an_ellipsoid_is_closed_oriented_outward_and_has_its_volume() {
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

    #[test]
    fn a_sphere_cut_twice_is_a_tube_whose_edges_lie_on_the_cuts() {
        let solid = Ellipsoid { centre: DVec3::ZERO, radii: DVec3::ONE, lean: 0.0 };
        let mesh = contour(&solid, DVec3::splat(-1.13), DVec3::splat(1.13), 0.1);
        let tags = vec![0; mesh.positions.len()];
        let (mesh, tags) = clip(&mesh, &tags, |p| p.z - 0.5, 1);
        let (mesh, tags) = clip(&mesh, &tags, |p| -0.4 - p.z, 2);
        let loops = Topology::new(&mesh).boundary_loops();
        assert_eq!(loops.len(), 2);
        for boundary in loops {
            let tag = tags[boundary[0] as usize];
            assert!(tag != 0 && boundary.iter().all(|&v| tags[v as usize] == tag));
        }
        let at = onto_edge(&solid, |p| Jet::new(p.z - 0.5, DVec3::Z), DVec3::new(0.9, 0.1, 0.45));
        assert!((at.length() - 1.0).abs() < 1e-6 && (at.z - 0.5).abs() < 1e-9);
    }
}
