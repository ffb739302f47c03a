//! Vertices in the order of a curve that fills space, so that what is near in space is near in memory.
//!
//! A remesher numbers vertices as it makes them, by splits all over the surface. What then goes from neighbour to neighbour, as every sum over
//! triangles does, waits for memory once the positions outgrow the processor's caches: at a million vertices a gradient took half as long again.
//! The curve is Morton's: the bits of the three coordinates by turns. Source: Morton: "A Computer Oriented Geodetic Data Base" (1966).
//! Limits: where the curve leaps, neighbours lie apart.

use glam::DVec3;

use super::{TriMesh, box_about};

/// Steps of each coordinate: 21 bits, so that three fill a word.
const STEPS: f64 = ((1_u64 << 21) - 1) as f64;

/// The same mesh with vertices and triangles in the curve's order, and what belongs to its vertices.
pub(crate) fn along_curve<T: Copy>(mesh: &TriMesh, of_vertex: &[T]) -> (TriMesh, Vec<T>) {
    let (low, high) = box_about(mesh.positions.iter().copied());
    let scale = STEPS / (high - low).max_element().max(f64::MIN_POSITIVE);
    let place = |p: DVec3| {
        let [x, y, z] = ((p - low) * scale).to_array().map(|x| spread(x as u64));
        x | y << 1 | z << 2
    };
    let mut order: Vec<(u64, u32)> = mesh.positions.iter().map(|p| place(*p)).zip(0..).collect();
    order.sort_unstable();
    let mut number = vec![0; order.len()];
    for (new, &(_, old)) in (0..).zip(&order) {
        number[old as usize] = new;
    }
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
    triangles.sort_unstable_by_key(|t| (t.iter().min().copied(), *t));
    let positions = order.iter().map(|o| mesh.positions[o.1 as usize]).collect();
    (TriMesh::new(positions, triangles), order.iter().map(|o| of_vertex[o.1 as usize]).collect())
}

/// Two zeros after each of the lower 21 bits.
fn spread(x: u64) -> u64 {
    let x = x & 0x1f_ffff;
    let x = (x | x << 32) & 0x1f_0000_0000_ffff;
    let x = (x | x << 16) & 0x1f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    #[test]
    fn bits_by_turns_keep_every_bit() {
        for bit in 0..21 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread(0x1f_ffff), 0x1249_2492_4924_9249);
    }

    #[test]
    fn neighbours_come_near_each_other_and_nothing_else_changes() {
        let n = 48;
        let rows = sheet(n, n, |i, j| DVec3::new(i, j, 0.0));
        // As far from any order as numbers go: multiples of the golden section.
        let count = rows.vertex_count() as u32;
        let mixed = |v: u32| (u64::from(v) * 1487 % u64::from(count)) as u32;
        let mut positions = rows.positions.clone();
        (0..count).for_each(|v| positions[mixed(v) as usize] = rows.positions[v as usize]);
        let mixed = TriMesh::new(positions, rows.triangles.iter().map(|t| t.map(mixed)).collect());
        let names: Vec<u32> = (0..count).collect();
        let (ordered, names) = along_curve(&mixed, &names);
        let far = |mesh: &TriMesh| {
            let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [a.abs_diff(b), b.abs_diff(c), c.abs_diff(a)]);
            let mut apart: Vec<u32> = edges.collect();
            apart.sort_unstable();
            apart[apart.len() / 2]
        };
        assert!(far(&ordered) < far(&rows) && far(&ordered) < far(&mixed) / 20, "{}, {}", far(&ordered), far(&mixed));
        assert!(names.iter().zip(&ordered.positions).all(|(&v, p)| mixed.positions[v as usize] == *p));
        let back = |t: &[u32; 3]| t.map(|v| names[v as usize]);
        let mut there: Vec<[u32; 3]> = ordered.triangles.iter().map(back).collect();
        let mut before = mixed.triangles.clone();
        there.sort_unstable();
        before.sort_unstable();
        assert_eq!(there, before);
    }
}
