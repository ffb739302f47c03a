//! Subdivision elements: patch test, hanging strip, cantilever.

use glam::{DMat3, Vec3A};
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::methods::implicit_euler::Elastic;
use partwise::mechanics::methods::linear::Operator;
use partwise::mechanics::methods::thomaszewski2006::{Thomaszewski2006, elements_of_garment};
use partwise::mechanics::methods::{Ended, MethodError, MethodInput};
use partwise::mesh::TriMesh;
use partwise::{DVec3, GRAVITY};

use crate::fixtures::{Diagonals, grid, isotropic};
use crate::scenes::{STILL, drape, hanging, rectangle};

/// A sheet in the xz plane whose inner vertices are shifted, with diagonals both ways: valences of four and eight.
fn uneven() -> TriMesh {
    let mut sheet = rectangle(DVec3::X * 0.2, DVec3::Z * 0.2, 8, 8);
    for (i, p) in sheet.positions.iter_mut().enumerate() {
        let inner = p.x > 0.01 && p.x < 0.19 && p.z > 0.01 && p.z < 0.19;
        let shift = DVec3::new((i * 7 % 5) as f64 - 2.0, 0.0, (i * 11 % 5) as f64 - 2.0) * 0.0015;
        *p += if inner { shift } else { DVec3::ZERO };
    }
    sheet
}

#[test]
fn a_stretched_and_turned_sheet_has_the_same_strain_everywhere() {
    let scene = hanging(uneven(), vec![0]);
    let fabric = isotropic(0.2, 60.0, 0.3, 1e-5);
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &scene.held).unwrap();
    let mut elements = elements_of_garment(&MethodInput { scene: &scene, fabric: &fabric, cloth: &cloth }).unwrap();
    // Seen from −y: x along the weft, z along the warp.
    let stretch = DMat3::from_diagonal(DVec3::new(1.1, 1.0, 0.95));
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-1.1);
    let x: Vec<DVec3> =
        scene.garment.positions.iter().map(|p| turn * (stretch * *p) + DVec3::new(3.0, -2.0, 1.0)).collect();
    let mut force = vec![DVec3::ZERO; x.len()];
    elements.linearise(&x, &mut force);
    for strain in elements.strains() {
        let off = (strain[0] - 0.1).abs().max((strain[1] + 0.05).abs()).max(strain[2].abs());
        assert!(off < 2e-5, "{strain:?}");
    }
    let sum: DVec3 = force.iter().copied().sum();
    assert!(sum.length() < 1e-5 * force.iter().map(|f| f.length()).sum::<f64>(), "{sum}");
    // The area of the elements is that of the sheet, one point each or not.
    let rigid: Vec<DVec3> = scene.garment.positions.iter().map(|p| turn * *p).collect();
    force.fill(DVec3::ZERO);
    elements.linearise(&rigid, &mut force);
    let worst = force.iter().map(|f| f.length()).fold(0.0, f64::max);
    assert!(worst < 1e-5, "a turned sheet pulls by {worst} N");
}

#[test]
fn in_a_regular_sheet_under_even_strain_nothing_pulls_inside() {
    // All diagonals one way: inner valences of six.
    let n = 8;
    let sheet =
        grid(n, n, Diagonals::Parallel, |i, j| DVec3::new(f64::from(i), 0.0, f64::from(j)) * 0.2 / f64::from(n));
    let scene = hanging(sheet, vec![0]);
    let fabric = isotropic(0.2, 60.0, 0.3, 1e-5);
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &scene.held).unwrap();
    let mut elements = elements_of_garment(&MethodInput { scene: &scene, fabric: &fabric, cloth: &cloth }).unwrap();
    let x: Vec<DVec3> = scene.garment.positions.iter().map(|p| DVec3::new(1.1 * p.x, 0.0, 0.95 * p.z)).collect();
    let mut force = vec![DVec3::ZERO; x.len()];
    elements.linearise(&x, &mut force);
    for j in 2..=n - 2 {
        for i in 2..=n - 2 {
            let f = force[(j * (n + 1) + i) as usize].length();
            // A side pulls with 6 N/m on 25 mm a vertex: 0.15 N.
            assert!(f < 1e-4, "{i} {j}: {f}");
        }
    }
}

#[test]
fn stiffness_is_the_derivative_of_the_force_in_the_plane() {
    let scene = hanging(uneven(), vec![0]);
    let fabric = isotropic(0.2, 60.0, 0.3, 1e-3);
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &scene.held).unwrap();
    let mut elements = elements_of_garment(&MethodInput { scene: &scene, fabric: &fabric, cloth: &cloth }).unwrap();
    // At rest, where turning costs nothing yet: a smooth move in the plane and across it.
    let x = &scene.garment.positions;
    let move_by: Vec<DVec3> =
        x.iter().map(|p| DVec3::new((9.0 * p.z).sin(), (20.0 * p.x).cos(), (11.0 * p.x).sin()) * 1e-4).collect();
    let forces = |elements: &mut partwise::mechanics::methods::thomaszewski2006::elements::Elements, sign: f64| {
        let mut f = vec![DVec3::ZERO; x.len()];
        let y: Vec<DVec3> = x.iter().zip(&move_by).map(|(x, d)| *x + *d * sign).collect();
        elements.linearise(&y, &mut f);
        f
    };
    let (plus, minus) = (forces(&mut elements, 1.0), forces(&mut elements, -1.0));
    elements.linearise(x, &mut vec![DVec3::ZERO; x.len()]);
    let d: Vec<Vec3A> = move_by.iter().map(DVec3::as_vec3a).collect();
    let mut k_d = vec![Vec3A::ZERO; d.len()];
    elements.times(&d, &mut k_d);
    let scale = k_d.iter().map(|f| f.length()).fold(0.0, f32::max);
    for (i, k_d) in k_d.iter().enumerate() {
        let change = ((plus[i] - minus[i]) * -0.5).as_vec3a();
        assert!((change - *k_d).length() < 0.02 * scale, "{i}: {change} expected {k_d}");
    }
    // Each vertex's own block is what the operator does to it alone.
    let mut own = vec![glam::Mat3A::ZERO; d.len()];
    elements.add_diagonal(&mut own);
    for v in [0, 13, 40, 77] {
        let mut one = vec![Vec3A::ZERO; d.len()];
        one[v] = Vec3A::new(0.3, -0.5, 0.8);
        elements.times(&one, &mut k_d);
        assert!((own[v] * one[v] - k_d[v]).length() < 1e-4 * k_d[v].length(), "{v}");
    }
}

#[test]
fn a_hanging_strip_stretches_as_its_closed_form() {
    let (length, density) = (0.6, 0.2);
    let scene = hanging(rectangle(DVec3::X * 0.1, DVec3::NEG_Z * length, 6, 36), (0..7).collect());
    for stretch in [60.0, 1000.0] {
        let made =
            drape(&Thomaszewski2006::default(), &scene, &isotropic(density, stretch, 0.0, 1e-5), &STILL).unwrap();
        assert_eq!(made.ended, Ended::AtRest);
        let hem = &made.positions[made.positions.len() - 7..];
        let lowest = hem.iter().map(|p| p.z).sum::<f64>() / 7.0;
        let ratio = (-lowest - length) / (density * GRAVITY * length * length / (2.0 * stretch));
        assert!((ratio - 1.0).abs() < 0.05, "k {stretch}: {ratio}");
    }
}

#[test]
fn a_cantilever_bends_as_its_closed_form() {
    // Two columns of vertices are held, so the strip is clamped where the cloth's slope is theirs: at the second.
    let (length, density, cells) = (0.1, 0.2, 20_u32);
    let cell = length / f64::from(cells);
    let strip = rectangle(DVec3::X * (length + cell), DVec3::Y * 0.04, cells + 1, 8);
    let held = (0..9u32).flat_map(|j| [j * 22, j * 22 + 1]).collect();
    let scene = hanging(strip, held);
    let bending = 5e-4;
    let made = drape(&Thomaszewski2006::default(), &scene, &isotropic(density, 2000.0, 0.0, bending), &STILL).unwrap();
    let tip = made.positions[4 * 22 + 21].z;
    let exact = -density * GRAVITY * length.powi(4) / (8.0 * bending);
    assert!((tip / exact - 1.0).abs() < 0.1, "{tip} expected {exact}");
}

#[test]
fn a_mesh_without_a_limit_surface_is_refused_in_one_line() {
    let mut sheet = rectangle(DVec3::X * 0.1, DVec3::Z * 0.1, 3, 3);
    // A second sheet that meets the first at a corner alone.
    let away = rectangle(DVec3::X * 0.1, DVec3::Z * 0.1, 1, 1);
    let base = sheet.positions.len() as u32;
    sheet.positions.extend(away.positions.iter().map(|p| *p + DVec3::new(0.1, 0.0, 0.1)));
    sheet.triangles.extend(away.triangles.iter().map(|t| t.map(|v| if v == 0 { base - 1 } else { base + v })));
    let scene = hanging(sheet, vec![0]);
    let error = drape(&Thomaszewski2006::default(), &scene, &isotropic(0.2, 60.0, 0.3, 1e-5), &STILL).unwrap_err();
    assert!(matches!(error, MethodError::Unfit { .. }));
    assert!(error.to_string().contains("vertex 16") && !error.to_string().contains('\n'), "{error}");
}

#[test]
fn however_strained_nothing_pulls_or_turns_by_itself() {
    let scene = hanging(uneven(), vec![0]);
    let fabric = partwise::garment::fabric::Fabric::default();
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &scene.held).unwrap();
    let mut elements = elements_of_garment(&MethodInput { scene: &scene, fabric: &fabric, cloth: &cloth }).unwrap();
    // Sheared, stretched unevenly and bent sharply, in a fabric of three stiffnesses.
    let bend = |p: DVec3| {
        let (angle, r) = (20.0 * p.x, 0.05 + 0.3 * p.z);
        DVec3::new(r * angle.sin() + 0.4 * p.z, r * angle.cos(), 1.2 * p.z + 2.0 * p.x * p.z)
    };
    let x: Vec<DVec3> = scene.garment.positions.iter().map(|p| bend(*p)).collect();
    let mut force = vec![DVec3::ZERO; x.len()];
    elements.linearise(&x, &mut force);
    let size: f64 = force.iter().map(|f| f.length()).sum();
    let (push, turn) =
        force.iter().zip(&x).fold((DVec3::ZERO, DVec3::ZERO), |(f, t), (g, x)| (f + *g, t + x.cross(*g)));
    assert!(push.length() < 1e-5 * size, "{push} of {size}");
    assert!(turn.length() < 1e-5 * size, "{turn} of {size}");
}
