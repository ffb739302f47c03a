//! p_f: strips that hang, against the closed form; and a wall that carries nothing.

use std::ops::ControlFlow;

use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, Stop, refine_with};
use partwise::mesh::RestShape;

use super::*;

#[test]
fn a_vertical_wall_carries_nothing_and_is_reported() {
    let wall = block(DVec3::new(0.5, 1.0, 1.0), DQuat::IDENTITY, DVec3::new(-0.5, 0.0, 0.0));
    let strip = patch(DVec3::new(0.002, 0.0, -0.5), DVec3::Y * 0.05, DVec3::Z * 0.5, 1, 10);
    let found = Case::new(strip, &wall, &ONE_LEVEL).solve(&PaperOptions::default());
    assert!(
        matches!(found.warnings[0], PaperWarning::NothingCarries { contact_parts: 1, support } if support.abs() < 1e-12)
    );
    // Its normal is horizontal: no cos γ_p, no stiffness, so it keeps still along z, and that is counted.
    assert!(found.warnings.contains(&PaperWarning::NoVerticalStiffness));
    assert!(found.warnings.contains(&PaperWarning::Degenerate { parts: 1 }));
    assert_eq!(found.parts[0].degenerate, [false, true, true]);
    close3(found.parts[0].displacement, [0.0; 3]);
}

/// A strip parallel to a face, 3 cm off, leaning by `degrees` from the horizontal, `length` long, cut into PARTs of `extent`.
fn hanging_strip(degrees: f64, length: f64, extent: f64) -> Case {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    let body = block(DVec3::splat(2.0), turn, DVec3::ZERO);
    let garment = patch(turn * DVec3::new(-0.5, 0.0, 2.03), turn * DVec3::X * length, turn * DVec3::Y * 0.02, 80, 1);
    let mut case = Case::new(garment, &body, &ONE_LEVEL);
    case.parts = case.parts.cut_to_extent(&case.garment, &case.topology, extent);
    case
}

/// Closed form: mean over z from `s1` to `s2` below the top of u(s) = (ρ g/k)(L s − s²/2).
fn mean_sink(length: f64, s1: f64, s2: f64) -> f64 {
    let integral = |s: f64| 0.5 * length * s * s - s * s * s / 6.0;
    DENSITY * GRAVITY / WARP * (integral(s2) - integral(s1)) / (s2 - s1)
}

#[test]
fn a_hanging_strip_sinks_by_its_closed_form() {
    let options = [Cosine::Absolute, Cosine::InSurface].map(|cosine| PaperOptions {
        cosine,
        untouched: Untouched::Contactless,
        ..Default::default()
    });
    // 88° stands in for hanging under the absolute cosine; in-surface hangs exactly.
    for (options, degrees) in [(options[0], 88.0), (options[0], 60.0), (options[1], 90.0), (options[1], 60.0)] {
        let length = 0.8;
        let drop = length * f64::to_radians(degrees).sin();
        let whole = hanging_strip(degrees, length, f64::INFINITY).solve(&options);
        assert_eq!(whole.parts.len(), 1);
        let sink = -whole.parts[0].displacement.z;
        let exact = mean_sink(drop, 0.0, drop);
        assert!((sink / exact - 1.0).abs() < 1e-3, "{degrees}°: {sink} m, exactly {exact} m");

        let case = hanging_strip(degrees, length, 0.1);
        let cut = case.solve(&options);
        assert!(cut.parts.len() > 8);
        let top = case.garment.bounds().unwrap().1.z;
        for (part, forces) in case.parts.parts.iter().zip(&cut.parts) {
            let depths = part.vertices.iter().map(|&v| top - case.garment.positions[v as usize].z);
            // The PART's cloth reaches half a square beyond its vertices, but not beyond the strip.
            let half = 0.5 * drop / 80.0;
            let (s1, s2) =
                depths.fold((drop, 0.0f64), |(a, b), s| (a.min((s - half).max(0.0)), b.max((s + half).min(drop))));
            let exact = mean_sink(drop, s1, s2);
            let sink = -forces.displacement.z;
            assert!(
                (sink - exact).abs() < 0.02 * mean_sink(drop, 0.0, drop),
                "{degrees}°, {s1}..{s2}: {sink}, exactly {exact}"
            );
        }
    }
}

#[test]
fn the_closed_form_of_a_strip_ends_at_rho_g_l_squared_over_two_k() {
    let options = PaperOptions { cosine: Cosine::InSurface, untouched: Untouched::Contactless, ..Default::default() };
    let case = hanging_strip(90.0, 0.8, 0.02);
    let found = case.solve(&options);
    let lowest = found.parts.iter().map(|p| -p.displacement.z).fold(0.0, f64::max);
    let exact = DENSITY * GRAVITY * 0.8 * 0.8 / (2.0 * WARP);
    assert!((lowest / exact - 1.0).abs() < 5e-3, "{lowest} m, exactly {exact} m");
}

#[test]
fn parts_of_a_hanging_strip_sink_as_the_cloth_itself_does() {
    let options = PaperOptions { cosine: Cosine::InSurface, untouched: Untouched::Contactless, ..Default::default() };
    let case = hanging_strip(90.0, 0.8, 0.1);
    let found = case.solve(&options);
    // The same strip as an energy of triangles, which knows nothing of PARTs or line forces, held at its upper edge.
    let mesh = &case.garment;
    let top = mesh.bounds().unwrap().1.z;
    let held: Vec<u32> =
        (0..mesh.vertex_count() as u32).filter(|&v| mesh.positions[v as usize].z > top - 1e-6).collect();
    let fabric = Fabric { poisson: 0.0, ..cloth() };
    let rest = RestShape::from_edges(mesh).unwrap();
    let mut energy = Cloth::new(mesh, &case.topology, &rest, &fabric, &held).unwrap();
    energy.solver.newton.tolerance = 1e-6;
    let start = mesh.positions.clone();
    let end =
        refine_with(&energy, Contacts::none(), start, &RefineOptions::default(), &mut |_| ControlFlow::Continue(()))
            .unwrap();
    assert_eq!(end.stop, Stop::Converged);
    let sink = |v: &u32| mesh.positions[*v as usize].z - end.positions[*v as usize].z;
    let deepest = (0..mesh.vertex_count() as u32).map(|v| sink(&v)).fold(0.0, f64::max);
    assert!(deepest > 0.01, "{deepest} m");
    for (part, forces) in case.parts.parts.iter().zip(&found.parts) {
        let settled = part.vertices.iter().map(sink).sum::<f64>() / part.vertices.len() as f64;
        let gave = -forces.displacement.z;
        assert!((gave - settled).abs() < 0.03 * deepest, "{gave} m, the cloth {settled} m of {deepest} m");
    }
}
