//! Accuracy and wrinkles against cases worked by hand.

use std::slice::from_ref;

use crate::body::distance::Body;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::range_table::RangeTable;
use crate::parts::segment;
use crate::study::accuracy::reference::{Reference, ReferenceCache, ReferenceInput, ReferenceKey};
use crate::study::accuracy::representable::representable;
use crate::study::accuracy::shape::{hausdorff, hem_heights, section_length};
use crate::study::accuracy::{AccuracyError, Comparison, compare, rms_mm};
use crate::study::wrinkles;
use glam::DVec3;

/// A tube of radius `r` about the z axis from z = 0 to `height`, `n` vertices around and `m + 1` rings.
fn tube(r: f64, height: f64, n: u32, m: u32) -> TriMesh {
    let at = |i: u32, j: u32| {
        let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        DVec3::new(r * a.cos(), r * a.sin(), height * f64::from(j) / f64::from(m))
    };
    let positions = (0..=m).flat_map(|j| (0..n).map(move |i| at(i, j))).collect();
    let quads = (0..m).flat_map(|j| (0..n).map(move |i| (j * n + i, j * n + (i + 1) % n)));
    TriMesh::new(positions, quads.flat_map(|(a, b)| [[a, b, b + n], [a, b + n, a + n]]).collect())
}

/// A sphere of radius `r` from a cube of `n`² squares a side.
fn sphere(r: f64, n: u32) -> TriMesh {
    let mut positions: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    let mut index = std::collections::BTreeMap::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let mut vertex = |i: u32, j: u32| {
                let mut p = [side; 3];
                p[(axis + 1) % 3] = 2.0 * f64::from(i) / f64::from(n) - 1.0;
                p[(axis + 2) % 3] = 2.0 * f64::from(j) / f64::from(n) - 1.0;
                let key = p.map(|c| (c * f64::from(n)).round() as i64);
                *index.entry(key).or_insert_with(|| {
                    positions
                        .push(DVec3::from(p.map(|c: f64| (c * std::f64::consts::FRAC_PI_4).tan())).normalize() * r);
                    positions.len() as u32 - 1
                })
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                let faces = [[a, b, c], [a, c, d]];
                triangles.extend(faces.map(|[a, b, c]| if side > 0.0 { [a, b, c] } else { [a, c, b] }));
            }
        }
    }
    TriMesh::new(positions, triangles)
}

fn fabric() -> Fabric {
    Fabric {
        name: "test".into(),
        source: "round figures".into(),
        density_kg_per_m2: 0.2,
        thickness_m: 0.001,
        stretch_weft_n_per_m: 100.0,
        stretch_warp_n_per_m: 100.0,
        shear_n_per_m: 40.0,
        poisson: 0.0,
        bending_nm: [1e-6; 3],
        bending_friction_n: [0.0; 2],
        friction: 0.0,
    }
}

#[test]
fn a_tube_moved_sideways_has_the_errors_of_its_shift() {
    let mesh = tube(0.2, 0.5, 40, 10);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let cloth = Cloth::new(&mesh, &topology, &rest, &fabric(), &[]).unwrap();
    let body = Body::new(&sphere(0.05, 6)).unwrap();
    let shift = DVec3::new(0.003, 0.004, 0.0);
    let moved: Vec<DVec3> = mesh.positions.iter().map(|&x| x + shift).collect();
    let table = RangeTable::from_bounds("one", &[0.0, f64::INFINITY]).unwrap();
    let distances: Vec<f64> = body.nearest_all(&mesh.positions).iter().map(|p| p.signed_distance).collect();
    let parts = segment(&topology, &distances, &table);
    let a = compare(&Comparison {
        mesh: &mesh,
        topology: &topology,
        cloth: &cloth,
        body: &body,
        parts: Some(&parts),
        start: &mesh.positions,
        result: &mesh.positions,
        reference: &moved,
    })
    .unwrap();
    for found in [a.vertices.rms_mm, a.vertices.mean_mm, a.vertices.p95_mm, a.vertices.max_mm, a.free.rms_mm] {
        assert!((found - 5.0).abs() < 1e-9, "{found}");
    }
    assert_eq!((a.vertices.vertices, a.free.vertices, a.contact.vertices), (440, 440, 0));
    // No further than the shift, and at the front no nearer than it.
    assert!(a.hausdorff_mm <= 5.0 + 1e-9 && a.hausdorff_mm > 4.5, "{}", a.hausdorff_mm);
    assert!(a.normal_angle_deg < 1e-9);
    assert!(a.energy_gap.abs() < 1e-9 && a.state.strain_max.abs() < 1e-9);
    assert_eq!((a.hem_height_m, a.reference_hem_height_m), (Some(0.0), Some(0.0)));
    // A shift is one translation.
    let r = a.representable.unwrap();
    assert!(r.translation_rms_mm < 1e-9 && r.affine_rms_mm < 1e-9, "{r:?}");
    assert!(r.blended_translation_rms_mm < 1e-3 && r.blended_affine_rms_mm < 1e-3, "{r:?}");
    // Forty chords of a circle.
    let chords = 1e3 * 40.0 * 2.0 * 0.2 * (std::f64::consts::PI / 40.0).sin();
    assert!(a.girths.iter().all(|g| (g.result_mm - chords).abs() < 1e-9 && (g.reference_mm - chords).abs() < 1e-9));

    let json = serde_json::to_value(&a).unwrap();
    for name in ["rms_mm", "p95_mm", "representable_rms_mm", "canonical_rms_mm", "residual_over_weight", "strain_p95"] {
        assert!(json.get(name).is_some(), "{name} is missing");
    }
    assert_eq!(serde_json::from_value::<crate::study::accuracy::Accuracy>(json).unwrap(), a);
}

#[test]
fn a_free_fall_has_the_weight_for_a_residual() {
    let mesh = tube(0.2, 0.5, 24, 6);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let mut soft = fabric();
    soft.bending_nm = [0.0; 3];
    let cloth = Cloth::new(&mesh, &topology, &rest, &soft, &[]).unwrap();
    let body = Body::new(&sphere(0.05, 6)).unwrap();
    let state = crate::study::accuracy::State::of(&cloth, &body, &mesh.positions);
    let norm = cloth.masses.iter().map(|m| m * m).sum::<f64>().sqrt() / cloth.masses.iter().sum::<f64>();
    assert!((state.residual_over_weight - norm).abs() < 1e-9);
    assert_eq!(state.penetrating_vertices, 0);
    // Squeezed into the body: every vertex inside, the strain that of a tube a tenth as wide.
    let inside: Vec<DVec3> = mesh.positions.iter().map(|x| DVec3::new(0.1 * x.x, 0.1 * x.y, 0.01 * x.z)).collect();
    let state = crate::study::accuracy::State::of(&cloth, &body, &inside);
    assert_eq!(state.penetrating_vertices, mesh.vertex_count());
    assert!(state.penetration_mm > 20.0 && state.strain_max < 0.0);
}

#[test]
fn drapes_of_different_meshes_are_refused() {
    let mesh = tube(0.2, 0.5, 12, 3);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let cloth = Cloth::new(&mesh, &topology, &rest, &fabric(), &[]).unwrap();
    let body = Body::new(&sphere(0.05, 4)).unwrap();
    let run = |result: &[DVec3]| {
        compare(&Comparison {
            mesh: &mesh,
            topology: &topology,
            cloth: &cloth,
            body: &body,
            parts: None,
            start: &mesh.positions,
            result,
            reference: &mesh.positions,
        })
    };
    assert!(matches!(run(&mesh.positions[1..]), Err(AccuracyError::Count { found: 47, expected: 48, .. })));
    let mut broken = mesh.positions.clone();
    broken[7].y = f64::NAN;
    assert!(matches!(run(&broken), Err(AccuracyError::NotFinite { vertex: 7, .. })));
}

#[test]
fn an_affine_motion_per_part_represents_a_rotation_and_a_translation_does_not() {
    let mesh = tube(0.2, 0.5, 40, 20);
    let topology = Topology::new(&mesh);
    let table = RangeTable::from_bounds("one", &[0.0, f64::INFINITY]).unwrap();
    let parts = segment(&topology, &vec![0.1; mesh.vertex_count()], &table).cut_to_extent(&mesh, &topology, 0.1);
    let bent: Vec<DVec3> = mesh.positions.iter().map(|x| *x + DVec3::new(0.1 * x.z, 0.0, -0.1 * x.x)).collect();
    let free = vec![false; mesh.vertex_count()];
    let r = representable(&topology, &parts, &free, &mesh.positions, &bent);
    // Some PARTs have three vertices, and a translation alone.
    assert!(r.affine_rms_mm < 0.5 * r.translation_rms_mm, "{r:?}");
    assert!(r.translation_rms_mm > 1.0 && r.blended_translation_rms_mm < r.translation_rms_mm, "{r:?}");
    // A PART that is nearly flat has no motion across itself to blend.
    assert!(r.blended_affine_rms_mm < 0.5 * r.blended_translation_rms_mm, "{r:?}");
    // Singletons hold everything.
    let fine = parts.cut_to_extent(&mesh, &topology, 0.0);
    assert!(representable(&topology, &fine, &free, &mesh.positions, &bent).translation_rms_mm < 1e-9);
}

#[test]
fn shapes_by_hand() {
    let mesh = tube(0.1, 0.4, 16, 4);
    let topology = Topology::new(&mesh);
    let longer: Vec<DVec3> = mesh.positions.iter().map(|x| DVec3::new(x.x, x.y, 1.5 * x.z - 0.2)).collect();
    // The ends stick out by 20 cm below; both directions see it.
    assert!((hausdorff(&mesh, &mesh.positions, &longer).unwrap() - 0.2).abs() < 1e-12);
    assert!((hausdorff(&mesh, &longer, &mesh.positions).unwrap() - 0.2).abs() < 1e-12);
    let (hem, reference) = hem_heights(&topology, &longer, &mesh.positions).unwrap();
    assert!((hem + 0.2).abs() < 1e-12 && reference.abs() < 1e-12);
    // Through a ring of vertices the section counts once.
    let chords = 16.0 * 2.0 * 0.1 * (std::f64::consts::PI / 16.0).sin();
    assert!((section_length(&mesh, 0.2) - chords).abs() < 1e-12);
    assert_eq!(section_length(&mesh, 1.0), 0.0);
    assert_eq!(rms_mm(&mesh.positions, &mesh.positions), 0.0);
}

#[test]
fn mean_curvature_of_a_sphere_a_tube_and_a_plane() {
    let ball = sphere(0.25, 24);
    let h = wrinkles::mean_curvature(&ball, &Topology::new(&ball));
    // 1/R = 4 per metre. The operator does not converge at single irregular vertices: here the cube's eight corners.
    let close = h.iter().filter(|h| (**h / 4.0 - 1.0).abs() < 0.05).count();
    assert!(close >= h.len() - 32, "{close} of {}", h.len());
    let mean = h.iter().sum::<f64>() / h.len() as f64;
    assert!((mean / 4.0 - 1.0).abs() < 0.02, "{mean}");
    let round = tube(0.1, 0.3, 60, 20);
    let h = wrinkles::mean_curvature(&round, &Topology::new(&round));
    // 1/2R, edges included: they copy their inner neighbours.
    assert!(h.iter().all(|h| (h / 5.0 - 1.0).abs() < 0.01));
    let flat = round.with_positions(round.positions.iter().map(|x| DVec3::new(x.x, 0.0, x.z)).collect());
    let sheet = TriMesh::new(flat.positions[..4].to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
    assert!(wrinkles::mean_curvature(&sheet, &Topology::new(&sheet)).iter().all(|&h| h.abs() < 1e-9));
}

#[test]
fn wrinkles_per_seam_and_their_rank_correlation() {
    let mesh = tube(0.1, 0.3, 40, 20);
    let topology = Topology::new(&mesh);
    let table = RangeTable::from_bounds("one", &[0.0, f64::INFINITY]).unwrap();
    let parts = segment(&topology, &vec![0.1; mesh.vertex_count()], &table).cut_to_extent(&mesh, &topology, 0.1);
    let displacement: Vec<DVec3> = (0..parts.len()).map(|p| DVec3::X * 1e-3 * (p * p) as f64).collect();
    let w = wrinkles::measure(&mesh, &topology, &parts, &displacement, &mesh.positions);
    assert_eq!(w.seams.len(), parts.seams.len());
    for seam in &w.seams {
        let [p, q] = seam.parts.map(f64::from);
        assert!((seam.displacement_difference_mm - (q * q - p * p)).abs() < 1e-9);
        assert!((seam.mean_curvature_per_m / 5.0 - 1.0).abs() < 0.02);
    }
    // Ties at mean ranks: ranks (1, 2.5, 2.5, 4) against (1, 2, 3, 4) give 4.5/√(4.5·5).
    let r = wrinkles::rank_correlation(&[1.0, 7.0, 7.0, 9.0], &[0.1, 0.2, 0.3, 0.4]).unwrap();
    assert!((r - 4.5 / 22.5f64.sqrt()).abs() < 1e-12);
    assert_eq!(wrinkles::rank_correlation(&[1.0, 2.0, 3.0], &[9.0, 5.0, 1.0]), Some(-1.0));
    assert_eq!(wrinkles::rank_correlation(&[1.0, 1.0, 1.0], &[9.0, 5.0, 1.0]), None);
}

#[test]
fn a_reference_is_computed_once_and_a_damaged_one_again() {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path().join("made").join("when needed");
    let cache = ReferenceCache::new(&folder);
    let mesh = tube(0.2, 0.5, 12, 3);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let body = sphere(0.05, 3);
    let cloth = fabric();
    let input = ReferenceInput {
        garment: &mesh,
        rest: &rest,
        fabrics: from_ref(&cloth),
        body: &body,
        held: &[1, 2],
        start: &mesh.positions,
        options: "tolerance 1e-3",
    };
    let key = ReferenceKey::new(&input);
    let stiffer = Fabric { stretch_warp_n_per_m: 101.0, ..cloth.clone() };
    assert_ne!(key, ReferenceKey::new(&ReferenceInput { fabrics: from_ref(&stiffer), ..input }));
    assert_ne!(key, ReferenceKey::new(&ReferenceInput { held: &[1], ..input }));
    assert_ne!(key, ReferenceKey::new(&ReferenceInput { options: "tolerance 1e-4", ..input }));
    assert_eq!(key, ReferenceKey::new(&ReferenceInput { fabrics: from_ref(&cloth.clone()), ..input }));

    let drape = Reference {
        positions: mesh.positions.clone(),
        energy_j: -1.25,
        residual_over_weight: 9e-4,
        steps: 27,
        seconds: 0.5,
    };
    let mut computed = 0;
    let mut get = |vertices: usize| {
        cache
            .get_or_compute(&key, vertices, || {
                computed += 1;
                Ok::<_, std::convert::Infallible>(drape.clone())
            })
            .unwrap()
    };
    let first = get(48);
    assert!(!first.cached && first.warnings.is_empty());
    let second = get(48);
    assert!(second.cached && second.reference == drape);
    assert!(std::fs::read_dir(&folder).unwrap().count() == 1, "a half-written file was left");

    let path = folder.join(key.file_name());
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let third = get(48);
    assert!(!third.cached && third.warnings.len() == 1 && third.reference == drape);
    assert!(get(48).cached);
    std::fs::write(&path, b"").unwrap();
    assert!(!get(48).cached);
    // A file for another number of vertices does not fit.
    assert!(!get(47).cached);
    assert_eq!(computed, 4);
}

#[test]
fn a_cache_that_cannot_be_written_is_a_warning() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let mesh = tube(0.2, 0.5, 12, 3);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let cloth = fabric();
    let input = ReferenceInput {
        garment: &mesh,
        rest: &rest,
        fabrics: from_ref(&cloth),
        body: &mesh,
        held: &[],
        start: &mesh.positions,
        options: "",
    };
    let drape = Reference { positions: vec![], energy_j: 0.0, residual_over_weight: 0.0, steps: 0, seconds: 0.0 };
    let found = ReferenceCache::new(&file)
        .get_or_compute(&ReferenceKey::new(&input), 0, || Ok::<_, std::convert::Infallible>(drape.clone()))
        .unwrap();
    assert!(!found.cached && !found.warnings.is_empty() && found.reference == drape);
}
