//! Flips of the edges of a triangle mesh, towards even neighbour counts or the better angles.

use glam::DVec3;

use super::NONE;
use super::half_edge::{HalfEdgeMesh, previous};

/// A flip may bend no pair of triangles further than this: cos 30°.
const FLAT_ENOUGH: f64 = 0.866;

/// Passes by angles, at most: a flip may make the next one wanted.
const SWEEPS: usize = 3;

/// What a flip is to improve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// Neighbour counts, towards six (four on the boundary).
    Valence,
    /// The two angles opposite the edge, towards a sum under 180°.
    Delaunay,
}

/// Flips every inner edge that the rule would rather have the other way.
pub(crate) fn flip(mesh: &mut HalfEdgeMesh, rule: Rule) {
    match rule {
        Rule::Valence => flip_by_valence(mesh),
        Rule::Delaunay => {
            for _ in 0..SWEEPS {
                let mut flips = 0;
                for h in 0..mesh.half_edge_count() as u32 {
                    flips +=
                        usize::from(is_inner(mesh, h) && opposes(mesh, h) && may_flip(mesh, h, rule) && mesh.flip(h));
                }
                if flips == 0 {
                    break;
                }
            }
        }
    }
}

/// Neighbours are counted once, in one pass over the edges, and then with every flip: to walk about four vertices for every edge of a large
/// mesh is to wait for memory.
fn flip_by_valence(mesh: &mut HalfEdgeMesh) {
    let mut over: Vec<i64> =
        (0..mesh.positions.len() as u32).map(|v| if mesh.is_boundary(v) { -4 } else { -6 }).collect();
    for h in (0..mesh.half_edge_count() as u32).filter(|&h| mesh.is_first(h)) {
        over[mesh.origin(h) as usize] += 1;
        over[mesh.target(h) as usize] += 1;
    }
    for h in 0..mesh.half_edge_count() as u32 {
        if !is_inner(mesh, h) {
            continue;
        }
        let [v0, v1, a, b] = diamond(mesh, h).map(|v| v as usize);
        let off = |change: i64| {
            let [less, more] = [-change, change];
            (over[v0] + less).pow(2) + (over[v1] + less).pow(2) + (over[a] + more).pow(2) + (over[b] + more).pow(2)
        };
        if off(1) < off(0) && may_flip(mesh, h, Rule::Valence) && mesh.flip(h) {
            for (v, change) in [(v0, -1), (v1, -1), (a, 1), (b, 1)] {
                over[v] += change;
            }
        }
    }
}

fn is_inner(mesh: &HalfEdgeMesh, h: u32) -> bool {
    mesh.is_first(h) && mesh.twin(h) != NONE
}

/// The ends of an inner edge, and the vertices opposite to it.
fn diamond(mesh: &HalfEdgeMesh, h: u32) -> [u32; 4] {
    let g = mesh.twin(h);
    [mesh.origin(h), mesh.target(h), mesh.origin(previous(h)), mesh.origin(previous(g))]
}

/// Whether the angles opposite an edge add up to more than 180°.
fn opposes(mesh: &HalfEdgeMesh, h: u32) -> bool {
    let [p0, p1, pa, pb] = diamond(mesh, h).map(|v| mesh.positions[v as usize]);
    let cot = |x: DVec3, y: DVec3| x.dot(y) / x.cross(y).length().max(1e-30);
    cot(p0 - pa, p1 - pa) + cot(p0 - pb, p1 - pb) < -1e-9
}

/// Whether the pair faces the same way when it is turned, and neither becomes a sliver.
fn may_flip(mesh: &HalfEdgeMesh, h: u32, rule: Rule) -> bool {
    let [p0, p1, pa, pb] = diamond(mesh, h).map(|v| mesh.positions[v as usize]);
    let old = (p1 - p0).cross(pa - p0).normalize_or_zero() + (p0 - p1).cross(pb - p1).normalize_or_zero();
    let old = old.normalize_or_zero();
    let (first, second) = ((p0 - pa).cross(pb - pa), (p1 - pb).cross(pa - pb));
    let thin = |n: DVec3, x: f64, y: f64, z: f64| n.length() < 0.3 * x.max(y).max(z).powi(2);
    let diagonal = pa.distance(pb);
    if rule == Rule::Valence
        && (thin(first, diagonal, p0.distance(pa), p0.distance(pb))
            || thin(second, diagonal, p1.distance(pa), p1.distance(pb)))
    {
        return false;
    }
    first.normalize_or_zero().dot(old) > FLAT_ENOUGH && second.normalize_or_zero().dot(old) > FLAT_ENOUGH
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    /// Σ (neighbours − those it should have)², from the triangles alone.
    fn uneven(mesh: &HalfEdgeMesh) -> i64 {
        let mut over: Vec<i64> = mesh.tags.iter().map(|&tag| if tag == 0 { -6 } else { -4 }).collect();
        for v in 0..over.len() as u32 {
            mesh.neighbours(v, |_| over[v as usize] += 1);
        }
        over.iter().map(|over| over * over).sum()
    }

    #[test]
    fn flips_by_neighbours_even_them_out() {
        let n: u32 = 12;
        let mut crossed = sheet(n, n, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        // Every other diagonal the other way: eight neighbours and four by turns.
        for (square, pair) in (0..).zip(crossed.triangles.as_chunks_mut::<2>().0) {
            let [[a, b, d], [_, _, c]] = *pair;
            if (square + square / n).is_multiple_of(2) {
                *pair = [[a, b, c], [b, d, c]];
            }
        }
        let rim = |p: &DVec3| u8::from([p.x, p.y].iter().any(|&x| x < 1e-9 || x > 0.01 * f64::from(n) - 1e-9));
        let tags = crossed.positions.iter().map(rim).collect();
        let mut mesh = HalfEdgeMesh::new(&crossed, tags).unwrap();
        let before = uneven(&mesh);
        flip(&mut mesh, Rule::Valence);
        let after = uneven(&mesh);
        assert!(after < before / 3, "{before} to {after}");
        // What it counted as it went is what there is: a second pass, which counts anew, can only go on downwards.
        flip(&mut mesh, Rule::Valence);
        assert!(uneven(&mesh) <= after, "{after} to {}", uneven(&mesh));
    }
}
