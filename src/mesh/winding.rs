//! The winding of triangles: agreement of neighbours and the outside of closed surfaces.
//!
//! Two neighbours agree if they run along their common edge in opposite directions. Each patch (triangles joined by edges
//! of exactly two) is traversed from its first triangle, every neighbour turned to agree; the whole patch is turned back if
//! that turns fewer triangles. A closed surface faces outward if its signed volume
//! V = ⅙ Σ a · (b × c) is positive.
//!
//! Limits: a one-sided patch (a Möbius strip) has no consistent winding: it is left as found and counted.

use super::topology::{NONE, Topology};
use super::{DVec3, TriMesh};

/// The triangles to turn so that neighbours agree, the fewest in each patch, and the number of one-sided patches.
pub(super) fn agree(mesh: &TriMesh) -> (Vec<usize>, usize) {
    let topology = Topology::new(mesh);
    let n = mesh.triangles.len();
    let mut across = vec![[NONE; 3]; n];
    for (e, &[a, b]) in topology.edges.iter().enumerate() {
        let [s, t] = topology.edge_triangles[e];
        if topology.edge_valence[e] == 2 && s != t {
            for (from, to) in [(s, t), (t, s)] {
                if let Some(k) = side(mesh.triangles[from as usize], a, b) {
                    across[from as usize][k] = to;
                }
            }
        }
    }
    let mut turn = vec![false; n];
    let mut visited = vec![false; n];
    let mut one_sided = 0;
    for seed in 0..n {
        if std::mem::replace(&mut visited[seed], true) {
            continue;
        }
        let mut members = vec![seed];
        let (mut next, mut consistent) = (0, true);
        while let Some(&t) = members.get(next) {
            next += 1;
            for (k, &other) in across[t].iter().enumerate() {
                let other = other as usize;
                if other >= n {
                    continue;
                }
                let (a, b) = (mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
                let same_direction = runs_along(mesh.triangles[other], a, b);
                let wanted = turn[t] ^ same_direction;
                if !std::mem::replace(&mut visited[other], true) {
                    turn[other] = wanted;
                    members.push(other);
                } else if turn[other] != wanted {
                    consistent = false;
                }
            }
        }
        let count = members.iter().filter(|&&t| turn[t]).count();
        if !consistent {
            one_sided += 1;
            members.iter().for_each(|&t| turn[t] = false);
        } else if 2 * count > members.len() {
            members.iter().for_each(|&t| turn[t] = !turn[t]);
        }
    }
    ((0..n).filter(|&t| turn[t]).collect(), one_sided)
}

/// Number of edges along which two triangles run in the same direction.
pub(super) fn disagreeing_edges(mesh: &TriMesh, topology: &Topology) -> usize {
    topology
        .edges
        .iter()
        .zip(&topology.edge_triangles)
        .zip(&topology.edge_valence)
        .filter(|((edge, pair), valence)| {
            let runs = |t: u32| runs_along(mesh.triangles[t as usize], edge[0], edge[1]);
            **valence == 2 && runs(pair[0]) == runs(pair[1])
        })
        .count()
}

/// Signed volume of each vertex-connected component about its own middle, m³; positive where it faces outward. For an
/// open component, the volume of the cone from its middle, whose sign still finds the outside of a bowl.
pub(crate) fn signed_volumes(mesh: &TriMesh, component: &[u32], count: usize) -> Vec<f64> {
    let mut middle = vec![(DVec3::ZERO, 0.0); count];
    for (p, &c) in mesh.positions.iter().zip(component) {
        middle[c as usize].0 += p;
        middle[c as usize].1 += 1.0;
    }
    let mut volume = vec![0.0; count];
    for triangle in &mesh.triangles {
        let c = component[triangle[0] as usize] as usize;
        let [p, q, r] = triangle.map(|v| mesh.positions[v as usize] - middle[c].0 / middle[c].1);
        volume[c] += p.dot(q.cross(r)) / 6.0;
    }
    volume
}

fn side(triangle: [u32; 3], a: u32, b: u32) -> Option<usize> {
    (0..3).find(|&k| {
        let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
        (from == a && to == b) || (from == b && to == a)
    })
}

fn runs_along(triangle: [u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|k| triangle[k] == a && triangle[(k + 1) % 3] == b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    }

    #[test]
    fn a_disagreeing_triangle_is_turned_and_the_volume_is_positive() {
        let mut mesh = tetrahedron();
        assert!((signed_volumes(&mesh, &[0; 4], 1)[0] - 1.0 / 6.0).abs() < 1e-15);
        mesh.triangles[2].reverse();
        assert_eq!(disagreeing_edges(&mesh, &Topology::new(&mesh)), 3);
        assert_eq!(agree(&mesh), (vec![2], 0));
    }

    #[test]
    fn a_moebius_strip_is_left_alone() {
        // Five triangles around a ring, the last joined with a half turn (the five-vertex Möbius strip).
        let triangles: Vec<[u32; 3]> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let positions = (0..5).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i * i * i))).collect();
        assert_eq!(agree(&TriMesh::new(positions, triangles)), (vec![], 1));
    }
}
