//! A knotted ribbon stays knotted; cloth that passes through itself could untie the knot.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use partwise::mesh::TriMesh;

use super::{crossings, rests};

/// Points along the ribbon, and across it.
const ALONG: u32 = 96;
const ACROSS: u32 = 3;

/// A ribbon closed to a trefoil, 12 mm wide.
fn trefoil() -> TriMesh {
    let at = |i: u32, j: u32| {
        let t = TAU * f64::from(i) / f64::from(ALONG);
        let line = DVec3::new(t.sin() + 2.0 * (2.0 * t).sin(), -(3.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos());
        line * 0.03 + DVec3::Y * (f64::from(j) - 1.0) * 0.006
    };
    let positions = (0..ACROSS).flat_map(|j| (0..ALONG).map(move |i| at(i, j))).collect();
    let squares = (0..ACROSS - 1).flat_map(|j| (0..ALONG).map(move |i| (i, j)));
    let triangles = squares
        .flat_map(|(i, j)| {
            let [a, b] = [j * ALONG + i, j * ALONG + (i + 1) % ALONG];
            [[a, b, b + ALONG], [a, b + ALONG, a + ALONG]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}

/// Number of Fox 3-colourings of the projection of a closed line, a knot invariant: the arcs get three colours so that at every crossing
/// all are equal or all differ. It is 3 for the unknot and 9 for a trefoil.
fn colourings(line: &[DVec3]) -> usize {
    let (u, v) = (DVec3::new(1.0, -0.031, 0.017).normalize(), DVec3::new(0.013, -0.022, 1.0).normalize());
    let flat: Vec<DVec2> = line.iter().map(|x| DVec2::new(x.dot(u), x.dot(v))).collect();
    let toward = v.cross(u);
    let n = line.len();
    let side = |i: usize| (i, (i + 1) % n);
    // Crossings: the parameters of the lower and of the upper strand.
    let mut under: Vec<(f64, f64)> = Vec::new();
    for i in 0..n {
        for j in i + 1..n {
            let ((a, b), (c, d)) = (side(i), side(j));
            let (p, q, r) = (flat[b] - flat[a], flat[d] - flat[c], flat[c] - flat[a]);
            let (s, t) = (r.perp_dot(q) / p.perp_dot(q), r.perp_dot(p) / p.perp_dot(q));
            if !(0.0..1.0).contains(&s) || !(0.0..1.0).contains(&t) || b == c || d == a {
                continue;
            }
            let height = |x: DVec3, y: DVec3, s: f64| x.lerp(y, s).dot(toward);
            let here = [i as f64 + s, j as f64 + t];
            let over = height(line[a], line[b], s) > height(line[c], line[d], t);
            under.push(if over { (here[1], here[0]) } else { (here[0], here[1]) });
        }
    }
    under.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Arc k ends at the k-th place where the line goes under.
    let arcs = under.len();
    let arc_at = |place: f64| under.iter().position(|(at, _)| place < *at).unwrap_or(0);
    let mut rows: Vec<Vec<u8>> = Vec::new();
    for (k, (_, over)) in under.iter().enumerate() {
        let mut row = vec![0u8; arcs];
        // 2 over = before + after, modulo 3.
        for (arc, times) in [(arc_at(*over), 2), (k, 2), ((k + 1) % arcs, 2)] {
            row[arc] = (row[arc] + times) % 3;
        }
        rows.push(row);
    }
    let mut rank = 0;
    for column in 0..arcs {
        let Some(found) = (rank..rows.len()).find(|&r| rows[r][column] != 0) else { continue };
        rows.swap(rank, found);
        let pivot = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            // The inverse of 1 is 1, of 2 is 2.
            let times = row[column] * pivot[column] % 3;
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x = (*x + 3 * 3 - times * p % 3) % 3);
        }
        rank += 1;
    }
    3usize.pow((arcs - rank) as u32)
}

#[test]
fn a_knotted_ribbon_stays_knotted() {
    let mesh = trefoil();
    let middle = |x: &[DVec3]| x[ALONG as usize..2 * ALONG as usize].to_vec();
    // The count tells a knot from none: a ring has three colourings.
    let ring = |i: u32| DVec3::new((TAU * f64::from(i) / 40.0).cos(), 0.3, (TAU * f64::from(i) / 40.0).sin());
    let figure_of_eight =
        |i: u32| ring(i) + DVec3::new(0.0, (TAU * f64::from(i) / 40.0).sin(), (TAU * f64::from(i) / 20.0).sin());
    assert_eq!(colourings(&(0..40).map(figure_of_eight).collect::<Vec<_>>()), 3);
    assert_eq!(colourings(&middle(&mesh.positions)), 9);
    assert_eq!(crossings(&mesh, &mesh.positions), 0);
    let top =
        (0..ALONG).max_by(|a, b| mesh.positions[*a as usize].z.total_cmp(&mesh.positions[*b as usize].z)).unwrap();
    let held: Vec<u32> = (0..ACROSS).flat_map(|j| [j * ALONG + top, j * ALONG + (top + 1) % ALONG]).collect();
    let end = rests(&mesh, &held, None, mesh.positions.clone());
    assert_eq!(colourings(&middle(&end.positions)), 9);
    // It has come down and pulled itself tight about where strands cross.
    let lowest = |x: &[DVec3]| x.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!(lowest(&end.positions) < lowest(&mesh.positions) - 0.02);
}
