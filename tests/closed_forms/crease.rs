//! A cloth in a hollow edge of the body, where the nearest triangle changes: it settles all the same.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::body::distance::Body;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::refine::{RefineOptions, Stop, refine};
use partwise::mesh::{RestShape, Topology, TriMesh};

use crate::bench::{fabric, rectangle};

/// A block with a groove along y, its sides sloping by `slope` towards the middle.
fn groove(slope: f64) -> Body {
    let half = 0.3;
    let profile = [(-half, half * slope), (0.0, 0.0), (half, half * slope), (half, -0.2), (-half, -0.2)];
    let mut positions: Vec<DVec3> = Vec::new();
    for y in [-0.3, 0.3] {
        positions.extend(profile.map(|(x, z)| DVec3::new(x, y, z)));
    }
    let mut triangles = Vec::new();
    for i in 0..5u32 {
        let j = (i + 1) % 5;
        triangles.extend([[i, j, 5 + j], [i, 5 + j, 5 + i]]);
    }
    // The ends, each split so that no triangle leaves the profile.
    for [a, b, c] in [[0, 1, 4], [1, 3, 4], [1, 2, 3]] {
        triangles.extend([[a, c, b], [5 + a, 5 + b, 5 + c]]);
    }
    Body::new(&TriMesh::new(positions, triangles)).unwrap()
}

#[test]
fn a_cloth_in_a_groove_settles_on_both_its_sides() {
    let body = groove(0.4);
    let mesh = rectangle(DVec3::X * 0.2, DVec3::Y * 0.1, 16, 8);
    let start: Vec<DVec3> = mesh.positions.iter().map(|p| *p + DVec3::new(-0.1, -0.05, 0.045)).collect();
    for (stretch, friction) in [(60.0, 0.0), (60.0, 0.3), (3000.0, 0.0)] {
        let fabric = fabric(0.2, stretch, 0.3, 2e-5, friction);
        let rest = RestShape::from_edges(&mesh).unwrap();
        let cloth = Cloth::new(&mesh, &Topology::new(&mesh), &rest, &fabric, &[]).unwrap();
        let end = refine(&cloth, &body, start.clone(), &RefineOptions::default(), &mut |step| {
            if step.iteration > 150 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
        assert_eq!(end.stop, Stop::Converged, "k {stretch}, μ {friction}: residual {:e}", end.residual_over_weight);
        // Both sides carry: no vertex is inside, and none floats farther than a cell of 12.5 mm bridges the crease.
        for x in &end.positions {
            let q = body.nearest(*x).signed_distance;
            assert!(q > 0.0 && q < cloth.offset + 4e-3, "k {stretch}, μ {friction}: {q} m from the groove at {x}");
        }
        let soft: Vec<bool> = end.history.iter().map(|h| h.softened).collect();
        assert_eq!(soft[0], stretch > 1000.0, "stiff cloth begins soft, a knit does not");
        assert!(!soft[soft.len() - 1], "and ends with its true stiffness");
    }
}
