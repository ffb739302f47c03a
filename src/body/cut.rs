//! Openings: where a surface is cut, and the cutting of a mesh.
//!
//! An opening is a region given by a field h, positive where cloth is taken away. Triangles across h = 0 are clipped at
//! the linear zero of h on their edges; the new vertices carry the opening's tag, and the remesher keeps them on the curve
//! f = 0, h = 0 by the smallest step that meets both to first order.

use std::collections::BTreeMap;

use glam::DVec3;

use super::jet::Jet;
use super::solid::Solid;
use crate::mesh::{Topology, TriMesh, renumbered, retain};

/// Newton steps of a projection; the relaxation before it moves a vertex by a fraction of an edge.
const STEPS: usize = 3;
/// A Newton step this short, m, is the last: the next one is of the order of its square over a body's curvature.
pub(crate) const CLOSE: f64 = 1e-4;

/// The mesh without the parts where `h` is positive, and its tags with `tag` on the new boundary. Only the component
/// with the most vertices is kept.
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
            let t = (ha / (ha - hb)).clamp(0.02, 0.98);
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

/// The point near `p` on the surface of `solid`; a step shorter than `close`, m, is the last.
pub(crate) fn onto_surface(solid: &dyn Solid, mut p: DVec3, close: f64) -> DVec3 {
    for _ in 0..STEPS {
        let f = solid.at(p);
        let step = f.value / f.gradient.length_squared().max(0.05);
        p -= step * f.gradient;
        if step.abs() < close {
            break;
        }
    }
    p
}

/// The point near `p` on the surface of `solid` and on the edge h = 0 of an opening.
pub(crate) fn onto_edge(solid: &dyn Solid, h: impl Fn(DVec3) -> Jet, mut p: DVec3) -> DVec3 {
    for _ in 0..STEPS + 2 {
        let (f, h) = (solid.at(p), h(p));
        let (ff, hh, fh) = (f.gradient.length_squared(), h.gradient.length_squared(), f.gradient.dot(h.gradient));
        let determinant = ff * hh - fh * fh;
        if determinant <= 1e-4 * ff * hh {
            // Surface and opening touch, or the opening has no edge near: no crossing to go to, so the surface comes first.
            return onto_surface(solid, p, CLOSE);
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
    use crate::body::contour::contour;
    use crate::body::solid::Ellipsoid;

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
