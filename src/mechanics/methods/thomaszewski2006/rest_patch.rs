//! The rest shape of a patch: a triangle and its neighbours, flattened around it.
//!
//! Each triangle of the garment has its rest shape in its own frame. Around each corner the triangles are flattened
//! next to one another in both directions, starting from the middle triangle. Where the two directions meet, the two positions of a
//! vertex (equal on developable cloth) are blended by the number of triangles on each side.
//!
//! With the patch's flat positions P_I and the derivatives N of its functions: J = [Σ N_s P, Σ N_t P], A = ½ |det J|;
//! weights by the cloth's coordinates are b = N J⁻¹; and w = J⁻ᵀ (N'' − Γ·N') J⁻¹ with Γ the derivatives Σ N'' P in
//! terms of J's columns.

use glam::{DMat2, DVec2};

use super::elements::Element;
use super::patch::{Derivatives, VertexFan, beyond};
use crate::mesh::{RestShape, Topology, TriMesh};

/// The flat positions of the vertices around triangle `t`, its own first, in the frame of its rest shape, m.
pub(super) fn flattened(
    t: usize,
    mesh: &TriMesh,
    rest: &RestShape,
    topology: &Topology,
    fans: &[VertexFan],
) -> Vec<(u32, DVec2)> {
    let triangle = mesh.triangles[t];
    let own = rest.corners[t];
    let mut places: Vec<(u32, DVec2)> = triangle.into_iter().zip(own).collect();
    for k in 0..3 {
        let [v, next, last] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
        let [at, at_next, at_last] = [0, 1, 2].map(|i| own[(k + i) % 3]);
        let left = flattened_around(t as u32, (v, at), (last, at_last), mesh, rest, topology);
        let right = flattened_around(t as u32, (v, at), (next, at_next), mesh, rest, topology);
        let n = fans[v as usize].ring.len();
        for (i, &(w, place)) in left.iter().enumerate() {
            if w == next {
                break;
            }
            // The same vertex in the other direction, after the remaining triangles.
            let other = right.iter().position(|(u, _)| *u == w).filter(|_| fans[v as usize].closed && n > 3);
            let place = other.map_or(place, |j| place.lerp(right[j].1, i as f64 / (i + j).max(1) as f64));
            keep(&mut places, w, place);
        }
        for &(w, place) in right.iter().take_while(|(w, _)| *w != last) {
            keep(&mut places, w, place);
        }
    }
    places
}

/// Stores the first position of each vertex.
fn keep(places: &mut Vec<(u32, DVec2)>, v: u32, place: DVec2) {
    if !places.iter().any(|(known, _)| *known == v) {
        places.push((v, place));
    }
}

/// The vertices around `v` with their flat positions, starting from triangle `t` across its edge to `w`, until `t` or a boundary.
fn flattened_around(
    t: u32,
    (v, at): (u32, DVec2),
    (w, at_w): (u32, DVec2),
    mesh: &TriMesh,
    rest: &RestShape,
    topology: &Topology,
) -> Vec<(u32, DVec2)> {
    let mut found = Vec::new();
    let (mut s, mut w, mut at_w) = (t, w, at_w);
    while let Some(next) = beyond(topology, s, v, w) {
        if next == t {
            break;
        }
        let corners = mesh.triangles[next as usize];
        let of = |v: u32| corners.iter().position(|&c| c == v);
        let (Some(i), Some(j)) = (of(v), of(w)) else { break };
        let k = 3 - i - j;
        let flat = rest.corners[next as usize];
        // The rotation that takes its edge onto the flattened one.
        let (from, to) = (flat[j] - flat[i], at_w - at);
        let turn = DVec2::new(from.dot(to), from.perp_dot(to)).normalize_or(DVec2::X);
        at_w = at + turn.rotate(flat[k] - flat[i]);
        w = corners[k];
        s = next;
        found.push((w, at_w));
    }
    found
}

/// The element of a patch: its area and its weights by the cloth's coordinates; `None` without a positive area.
pub(super) fn element(found: &[(u32, Derivatives)], flat: &[(u32, DVec2)]) -> Option<Element> {
    let mut sums = [DVec2::ZERO; 5];
    for (v, d) in found {
        let place = flat.iter().find(|(w, _)| w == v)?.1;
        for k in 0..5 {
            sums[k] += place * d[k];
        }
    }
    let j = DMat2::from_cols(sums[0], sums[1]);
    let det = j.determinant();
    if det.is_nan() || det <= 0.0 {
        return None;
    }
    let inverse = j.inverse();
    let curving = [sums[2], sums[3], sums[4]].map(|second| inverse * second);
    let weighted = found.iter().map(|(v, [s, t, ss, st, tt])| {
        // The gradient by s, t times J⁻¹.
        let b = inverse.transpose() * DVec2::new(*s, *t);
        let second = [ss, st, tt];
        let [ss, st, tt] = std::array::from_fn(|k| second[k] - curving[k].dot(DVec2::new(*s, *t)));
        let w = inverse.transpose() * DMat2::from_cols(DVec2::new(ss, st), DVec2::new(st, tt)) * inverse;
        // κ_uv occurs once in the energy: H x_uv².
        (*v, [b.x, b.y, w.x_axis.x, w.x_axis.y, w.y_axis.y].map(|w| w as f32))
    });
    Some(Element { area: 0.5 * det, vertices: weighted.collect() })
}
