//! Equation (1): levels and connectivity against brute force, and the cuts and joins that build on it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod fixtures;

use fixtures::{Diagonals, flipped, grid, table};
use glam::DVec3;
use partwise::body::distance::Body;
use partwise::mesh::{RestShape, Topology, TriMesh};
use partwise::parts::range_table::{Extent, GapRule, RangeTable};
use partwise::parts::{Part, Parts, UNASSIGNED, segment};
use proptest::prelude::*;

/// Ericson's closest point on a triangle ("Real-Time Collision Detection", 5.1.5), written for this test.
fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

/// A tetrahedron with corners near those of a regular one, moved by `jitter`.
fn body_mesh(jitter: &[f64]) -> TriMesh {
    let base = [[0.1, 0.1, 0.1], [0.1, -0.1, -0.1], [-0.1, 0.1, -0.1], [-0.1, -0.1, 0.1]];
    let corner = |i: usize| DVec3::from_array(base[i]) + DVec3::from_slice(&jitter[3 * i..3 * i + 3]);
    TriMesh::new((0..4).map(corner).collect(), vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
}

/// A height field of `w` by `h` vertices without some of its triangles, so that it has several components.
fn sheet(w: u32, h: u32, heights: &[f64], missing: &[bool]) -> TriMesh {
    let position = |i: u32, j: u32| {
        DVec3::new(0.05 * f64::from(i) - 0.15, 0.05 * f64::from(j) - 0.15, heights[(j * w + i) as usize])
    };
    let mut mesh = grid(w - 1, h - 1, Diagonals::Parallel, position);
    let mut keep = missing.iter().cycle();
    mesh.triangles.retain(|_| !keep.next().copied().unwrap_or(false));
    mesh
}

/// Levels by reading the table from top to bottom, PARTs by union-find over triangle sides.
fn brute_force(garment: &TriMesh, body: &TriMesh, bounds_cm: &[f64]) -> Vec<Option<(usize, usize)>> {
    let level: Vec<Option<usize>> = garment
        .positions
        .iter()
        .map(|&x| {
            let near = |t| x.distance(closest_on_triangle(x, body.corners(t)));
            let d = (0..body.triangles.len()).map(near).fold(f64::INFINITY, f64::min);
            (0..bounds_cm.len() - 1).find(|&k| bounds_cm[k] <= 100.0 * d && 100.0 * d < bounds_cm[k + 1])
        })
        .collect();
    let mut parent: Vec<usize> = (0..level.len()).collect();
    fn root(parent: &[usize], mut v: usize) -> usize {
        while parent[v] != v {
            v = parent[v];
        }
        v
    }
    for t in &garment.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (a as usize, b as usize);
            if level[a] == level[b] {
                let (ra, rb) = (root(&parent, a), root(&parent, b));
                parent[ra.max(rb)] = ra.min(rb);
            }
        }
    }
    (0..level.len()).map(|v| level[v].map(|l| (l, root(&parent, v)))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn parts_are_the_connected_pieces_of_each_level(
        jitter in prop::collection::vec(-0.03f64..0.03, 12),
        heights in prop::collection::vec(-0.1f64..0.3, 49),
        missing in prop::collection::vec(prop::bool::weighted(0.2), 1..20),
        inner in prop::collection::btree_set(1u32..200, 1..6),
    ) {
        // Bounds in sixteenths of a centimetre; the last level ends, so that some vertices stay unassigned.
        let mut bounds_cm = vec![0.0];
        bounds_cm.extend(inner.iter().map(|&b| f64::from(b) / 16.0));
        let body = body_mesh(&jitter);
        let garment = sheet(7, 7, &heights, &missing);
        let topology = Topology::new(&garment);
        let searched = Body::new(&body).unwrap();
        let distances: Vec<f64> = searched.nearest_all(&garment.positions).iter().map(|s| s.signed_distance).collect();
        let table = table(&bounds_cm);
        let parts = segment(&topology, &distances, &table);

        let expected = brute_force(&garment, &body, &bounds_cm);
        let mut keys: Vec<_> = expected.iter().flatten().copied().collect();
        keys.sort_unstable();
        keys.dedup();
        // (level, smallest vertex) sorted is the numbering itself.
        let number = |key: &Option<(usize, usize)>| key.map_or(UNASSIGNED, |k| keys.binary_search(&k).unwrap() as u32);
        prop_assert_eq!(&parts.part_of_vertex, &expected.iter().map(number).collect::<Vec<_>>());
        prop_assert_eq!(parts.len(), keys.len());
        prop_assert_eq!(parts.unassigned, expected.iter().filter(|e| e.is_none()).count());
        consistent(&parts, &topology);
    }
}

/// The invariants of PARTs: they partition the vertices, are connected and numbered in order; seams are the edges between them.
fn consistent(parts: &Parts, topology: &Topology) {
    let mut seen = vec![0; parts.part_of_vertex.len()];
    for (number, part) in parts.parts.iter().enumerate() {
        assert!(part.vertices.is_sorted());
        for &v in &part.vertices {
            seen[v as usize] += 1;
            assert_eq!(parts.part_of_vertex[v as usize], number as u32);
        }
        let mut reached = vec![part.vertices[0]];
        let mut next = 0;
        while next < reached.len() {
            for &w in topology.neighbours(reached[next]) {
                if parts.part_of_vertex[w as usize] == number as u32 && !reached.contains(&w) {
                    reached.push(w);
                }
            }
            next += 1;
        }
        assert_eq!(reached.len(), part.vertices.len(), "PART {number} is not connected");
    }
    for (v, count) in seen.into_iter().enumerate() {
        assert_eq!(count, usize::from(parts.part_of_vertex[v] != UNASSIGNED));
    }
    assert!(parts.parts.is_sorted_by_key(|p| (p.level, p.vertices[0])));
    assert_eq!(parts.parts_per_level.iter().sum::<usize>(), parts.len());
    assert_eq!(parts.singletons, parts.parts.iter().filter(|p| p.vertices.len() == 1).count());
    let crossing = topology.edges.iter().filter(|e| {
        let [p, q] = e.map(|v| parts.part_of_vertex[v as usize]);
        p != q && p != UNASSIGNED && q != UNASSIGNED
    });
    assert_eq!(parts.seams.iter().map(|s| s.edges.len()).sum::<usize>(), crossing.count());
    for seam in &parts.seams {
        for &e in &seam.edges {
            let mut pair = topology.edges[e as usize].map(|v| parts.part_of_vertex[v as usize]);
            pair.sort_unstable();
            assert_eq!(pair, seam.parts);
        }
    }
}

/// A strip of `n + 1` rows of two vertices along x, rows 1 cm apart and 1 cm wide.
fn strip(n: u32) -> (TriMesh, Topology) {
    let mesh =
        flipped(grid(1, n, Diagonals::Parallel, |i, j| DVec3::new(0.01 * f64::from(j), 0.01 * f64::from(i), 0.0)));
    let topology = Topology::new(&mesh);
    (mesh, topology)
}

#[test]
fn two_equal_levels_apart_are_two_parts() {
    let (_, topology) = strip(4);
    let table = table(&[0.0, 1.0, f64::INFINITY]);
    let d = [0.0, 0.0, 0.0, -0.002, 0.05, 0.05, 0.0, 0.0, 0.0, 0.009];
    let parts = segment(&topology, &d, &table);
    assert_eq!(parts.part_of_vertex, [0, 0, 0, 0, 2, 2, 1, 1, 1, 1]);
    assert_eq!(parts.parts_per_level, [2, 1]);
    assert_eq!(parts.seams.iter().map(|s| s.parts).collect::<Vec<_>>(), [[0, 2], [1, 2]]);
}

#[test]
fn a_hole_is_given_away_and_counted() {
    let (_, topology) = strip(2);
    let d = [0.026, 0.026, 0.032, 0.033, 0.04, 0.04];
    let mut table = RangeTable::table_3();
    for (gap, expected) in [
        (GapRule::ExtendLower, [0, 0, 0, 0, 1, 1]),
        (GapRule::ExtendUpper, [0, 0, 1, 1, 1, 1]),
        (GapRule::OwnLevel, [0, 0, 1, 1, 2, 2]),
    ] {
        table.gap = gap;
        let parts = segment(&topology, &d, &table);
        assert_eq!(parts.part_of_vertex, expected, "{gap:?}");
        assert_eq!((parts.hole_vertices, parts.unassigned), (2, 0));
        assert_eq!(parts.parts_per_level.len(), if gap == GapRule::OwnLevel { 20 } else { 19 });
    }
}

#[test]
fn a_seam_across_a_strip_is_as_long_as_the_strip_is_wide() {
    let (mesh, topology) = strip(6);
    let d: Vec<f64> = (0..14).map(|v| if v < 6 { 0.001 } else { 0.05 }).collect();
    let table = table(&[0.0, 1.0, f64::INFINITY]);
    let parts = segment(&topology, &d, &table);
    assert_eq!(parts.seams.len(), 1);
    assert_eq!(parts.seams[0].edges.len(), 3);
    assert!((parts.seam_lengths_m(&mesh)[0] - 0.01).abs() < 1e-15);
}

#[test]
fn no_piece_is_wider_than_the_extent() {
    let (mesh, topology) = strip(100);
    let table = table(&[0.0, f64::INFINITY]);
    let whole = segment(&topology, &vec![0.0; mesh.vertex_count()], &table);
    assert_eq!(whole.len(), 1);
    for extent in [0.5, 0.1, 0.03] {
        let cut = whole.cut_to_extent(&mesh, &topology, extent);
        consistent(&cut, &topology);
        assert_eq!(cut.unassigned, 0);
        for part in &cut.parts {
            for &v in &part.vertices {
                for &w in &part.vertices {
                    assert!(mesh.positions[v as usize].distance(mesh.positions[w as usize]) <= extent + 1e-12);
                }
            }
        }
        // One metre of strip: no fewer than length over extent, no more than twice what farthest-point seeding allows.
        assert!(cut.len() as f64 >= 1.0 / extent && cut.len() as f64 <= 4.0 / extent + 1.0, "{extent}: {}", cut.len());
    }
    assert_eq!(whole.cut_to_extent(&mesh, &topology, f64::INFINITY), whole);
    assert_eq!(whole.cut_to_extent(&mesh, &topology, 0.0).len(), mesh.vertex_count());
}

#[test]
fn a_level_is_cut_to_its_own_extent_and_the_others_to_the_runs() {
    let (mesh, topology) = strip(40);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (first, all) = (mesh.positions[0], mesh.vertex_count());
    let d: Vec<f64> = (0..all).map(|v| [0.005, 0.015, 0.025, 0.035][4 * v / all]).collect();
    let table = table(&[0.0, 1.0, 2.0, 3.0, f64::INFINITY]);
    let whole = segment(&topology, &d, &table);
    assert_eq!(whole.cut_to_table(&mesh, &topology, &rest, &table), whole);
    let length = mesh.positions[all - 1].distance(first);
    let widest = |parts: &Parts, level: usize| {
        let width = |p: &Part| {
            let along = p.vertices.iter().map(|&v| mesh.positions[v as usize].distance(first));
            along.clone().fold(0.0, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        parts.parts.iter().filter(|p| p.level as usize == level).map(width).fold(0.0, f64::max)
    };
    // In tenths of the strip, a quarter of which is each level.
    let tenth_cm = 10.0 * length;
    let extents = [Some(Extent::even(tenth_cm)), None, Some(Extent::even(0.5 * tenth_cm)), Some(Extent::UNCUT)];
    let table = table.with_extents(&extents).unwrap();
    let own = segment(&topology, &d, &table).cut_to_table(&mesh, &topology, &rest, &table);
    consistent(&own, &topology);
    assert_eq!(own.own_extent, [true, false, true, true]);
    assert!(widest(&own, 0) <= 0.1 * length && widest(&own, 2) <= 0.05 * length);
    assert!(own.parts_per_level[0] > 1 && own.parts_per_level[2] > own.parts_per_level[0]);
    assert_eq!((own.parts_per_level[1], own.parts_per_level[3]), (1, 1));
    // The run's extent reaches only the level that has none.
    let both = own.cut_to_extent(&mesh, &topology, 0.02 * length);
    consistent(&both, &topology);
    assert!(both.parts_per_level[1] > 5 && widest(&both, 1) <= 0.02 * length);
    for level in [0, 2, 3] {
        assert_eq!(both.parts_per_level[level], own.parts_per_level[level]);
    }
    assert_eq!(own.join_small(&topology, &mesh, 3).own_extent, own.own_extent);
}

#[test]
fn small_parts_join_along_the_longest_seam() {
    let (mesh, topology) = strip(6);
    let table = table(&[0.0, 1.0, 2.0, f64::INFINITY]);
    // Rows 0–2 level 0, rows 3–6 level 2; vertex 6 alone at level 1 touches both.
    let mut d: Vec<f64> = (0..14).map(|v| if v < 6 { 0.001 } else { 0.05 }).collect();
    d[6] = 0.015;
    let parts = segment(&topology, &d, &table);
    assert_eq!((parts.len(), parts.singletons), (3, 1));
    let lengths = parts.seam_lengths_m(&mesh);
    let to = |p| lengths[parts.seam_between(1, p).unwrap()];
    let joined = parts.join_small(&topology, &mesh, 2);
    consistent(&joined, &topology);
    assert_eq!((joined.len(), joined.singletons), (2, 0));
    assert_eq!(joined.part_of_vertex[6], u32::from(to(2) > to(0)));
    assert_eq!(parts.join_small(&topology, &mesh, 1), parts);
    assert_eq!(parts.join_small(&topology, &mesh, 100).len(), 1);
}

#[test]
fn threads_do_not_change_the_parts() {
    let heights: Vec<f64> = (0..900).map(|v| 0.1 + 0.08 * (f64::from(v) * 0.7).sin()).collect();
    let garment = sheet(30, 30, &heights, &[false]);
    let topology = Topology::new(&garment);
    let body = Body::new(&body_mesh(&[0.0; 12])).unwrap();
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let d: Vec<f64> = body.nearest_all(&garment.positions).iter().map(|s| s.signed_distance).collect();
            let parts = segment(&topology, &d, &RangeTable::table_3());
            let joined = parts.join_small(&topology, &garment, 4);
            let cut = joined.cut_to_extent(&garment, &topology, 0.12);
            let lengths: Vec<u64> = cut.seam_lengths_m(&garment).iter().map(|l| l.to_bits()).collect();
            (parts, joined, cut, lengths)
        })
    };
    assert_eq!(run(1), run(2));
}
