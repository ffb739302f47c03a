//! Gradient and Hessian of each term by central differences.

use crate::GRAVITY;
use crate::body::distance::Body;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::membrane::{HessianKind, Stiffness};
use crate::mechanics::energy::{Cloth, Contacts, Friction};
use crate::mesh::TriMesh;
use crate::mesh::samples::cuboid;
use glam::DVec3;

use super::patch::{cloth, cloth_of, deformed, fabric, jitters, sheet};

/// Step of a difference, m: the rounding of an energy of 1e-2 J over it is 1e-12 N, the truncation less.
const H: f64 = 1e-6;

/// Checks `gradient` against differences of `energy` along three directions over all vertices.
pub(crate) fn check_gradient(x: &[DVec3], energy: impl Fn(&[DVec3]) -> f64, gradient: &[DVec3], what: &str) {
    for k in 0..3 {
        let d: Vec<DVec3> = (0..x.len()).map(|i| jitters(1000 * (k + 1) + i)).collect();
        let at = |s: f64| energy(&x.iter().zip(&d).map(|(p, d)| *p + *d * (s * H)).collect::<Vec<_>>());
        let measured = (at(1.0) - at(-1.0)) / (2.0 * H);
        let computed: f64 = gradient.iter().zip(&d).map(|(g, d)| g.dot(*d)).sum();
        let scale = gradient.iter().map(|g| g.length()).sum::<f64>();
        assert!((measured - computed).abs() < 1e-6 * scale, "{what}: {measured} measured, {computed} computed");
        assert!(scale > 0.0, "{what}: the gradient is zero");
    }
}

#[test]
fn membrane_gradient_matches_differences() {
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let stiffness = Stiffness::new(&fabric());
    // Stretched, and compressed and sheared: the energy is smooth in both.
    let stretched = deformed(&mesh);
    let crushed: Vec<DVec3> = stretched.iter().map(|p| DVec3::new(0.6 * p.x, p.y, 0.7 * p.z)).collect();
    for x in [&stretched, &crushed] {
        let mut gradient = vec![DVec3::ZERO; x.len()];
        for t in &*cloth.triangles {
            t.add_gradient(&stiffness, t.compression_ratio(), x, &mut gradient);
        }
        let energy = |x: &[DVec3]| cloth.triangles.iter().map(|t| t.energy(&stiffness, t.compression_ratio(), x)).sum();
        check_gradient(x, energy, &gradient, "membrane");
    }
}

#[test]
fn bending_gradient_matches_differences() {
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let x = deformed(&mesh);
    // The gradient of bending is the whole gradient minus those of membrane and gravity.
    let stiffness = Stiffness::new(&fabric());
    let mut gradient = Vec::new();
    let whole = cloth.gradient(&x, &Contacts::none(), &mut gradient);
    let mut others = vec![DVec3::ZERO; x.len()];
    others.iter_mut().zip(&cloth.masses).for_each(|(g, m)| g.z += m * GRAVITY);
    let membrane: f64 =
        cloth.triangles.iter().map(|t| t.add_gradient(&stiffness, t.compression_ratio(), &x, &mut others)).sum();
    gradient.iter_mut().zip(&others).for_each(|(g, other)| *g -= *other);
    check_gradient(&x, |x| cloth.bending.energy(x), &gradient, "bending");
    let rest = whole - membrane - GRAVITY * cloth.masses.iter().zip(&x).map(|(m, p)| m * p.z).sum::<f64>();
    assert!((rest - cloth.bending.energy(&x)).abs() < 1e-12 * whole.abs(), "{rest} J");
}

/// A fabric whose friction between yarns exceeds its elastic moments at the curvatures of [`deformed`].
fn rubbing() -> Fabric {
    Fabric { bending_friction_n: [3e-4, 1e-3], ..fabric() }
}

#[test]
fn bending_friction_gradient_matches_differences() {
    // Ten times as large, so that a difference bends by much less than the width. Bent far beyond the width, and nearly flat.
    let large = |p: DVec3| 10.0 * p;
    let mesh = TriMesh::new(sheet().positions.into_iter().map(large).collect(), sheet().triangles);
    let cloth = cloth_of(&mesh, &rubbing(), &[]);
    let energy = |x: &[DVec3]| {
        let mut unused = vec![DVec3::ZERO; x.len()];
        cloth.bending.friction.add_gradient(x, &cloth.held, &mut unused)
    };
    for height in [100.0, 1.0] {
        let x: Vec<DVec3> = deformed(&sheet()).iter().map(|p| large(*p * DVec3::new(1.0, height, 1.0))).collect();
        let mut gradient = vec![DVec3::ZERO; x.len()];
        cloth.bending.friction.add_gradient(&x, &cloth.held, &mut gradient);
        check_gradient(&x, energy, &gradient, "bending friction");
    }
}

#[test]
fn bending_friction_hessian_matches_differences() {
    // Flat and stretched, the projection drops nothing; the curvature is of the order of the width.
    let mesh = sheet();
    let x: Vec<DVec3> =
        mesh.positions.iter().map(|p| DVec3::new(1.05 * p.x, 0.7 * p.x * p.z + 0.3 * p.z * p.z, 1.08 * p.z)).collect();
    let stiff = Fabric { bending_friction_n: [0.3, 1.0], ..fabric() };
    let cloth = cloth_of(&mesh, &stiff, &[0, 7, 20]);
    // The step of the difference bends by a hundredth of the width.
    check_hessian(&cloth, &x, &Contacts::none(), 3e-3);
    let (mut blocks, mut diagonal) = (Vec::new(), Vec::new());
    cloth.hessian(&x, &Contacts::none(), &mut blocks);
    cloth.diagonal_blocks(&x, &Contacts::none(), 0.0, &mut diagonal);
    for (i, &v) in cloth.order().iter().enumerate() {
        let own = blocks[cloth.pattern().starts[i] as usize];
        let error = (own - diagonal[v as usize]).abs_diff_eq(glam::DMat3::ZERO, 1e-9 * own.determinant().abs().cbrt());
        assert!(error, "vertex {v}");
    }
}

/// A block below y = 0.
pub(crate) fn block() -> Body {
    Body::new(&cuboid(DVec3::new(-0.5, -1.0, -0.5), DVec3::new(0.5, 0.0, 0.5))).unwrap()
}

/// The sheet with part of it within the offset of the block's face y = 0.
pub(crate) fn grazing(mesh: &TriMesh) -> Vec<DVec3> {
    deformed(mesh).iter().map(|p| DVec3::new(p.x, 0.3 * p.y + 6e-4, p.z)).collect()
}

#[test]
fn contact_gradient_matches_differences() {
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[]);
    let x = grazing(&mesh);
    let contacts = cloth.contacts(&body, &x);
    let touching = contacts.touches().len();
    assert!(touching > 5 && touching < x.len(), "{touching} touch");
    let mut gradient = vec![DVec3::ZERO; x.len()];
    contacts.add_gradient(&mut gradient);
    let energy = |x: &[DVec3]| {
        let mut moved = contacts.clone();
        moved.update(x);
        moved.energy()
    };
    check_gradient(&x, energy, &gradient, "contact");
}

#[test]
fn friction_gradient_matches_differences() {
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[]);
    let anchored = cloth.contacts(&body, &grazing(&mesh));
    // Some stick, some slip.
    let x: Vec<DVec3> = grazing(&mesh).iter().enumerate().map(|(i, p)| *p + jitters(i + 7) * 6e-4).collect();
    let mut gradient = vec![DVec3::ZERO; x.len()];
    anchored.friction.add_gradient(&x, &mut gradient);
    check_gradient(&x, |x| anchored.friction.energy(x), &gradient, "friction");
}

/// Checks the projected Hessian against differences of ∇E, over the free vertices.
pub(crate) fn check_hessian(cloth: &Cloth, x: &[DVec3], contacts: &Contacts, tolerance: f64) {
    let mut blocks = Vec::new();
    cloth.hessian(x, contacts, &mut blocks);
    check_blocks(cloth, x, contacts, &blocks, tolerance);
}

/// Checks this Hessian of the free cloth.
fn check_hessian_of(kind: HessianKind, cloth: &Cloth, x: &[DVec3], tolerance: f64) {
    let mut blocks = Vec::new();
    cloth.hessian_in(cloth.layout(), kind, x, &Contacts::none(), &mut blocks);
    check_blocks(cloth, x, &Contacts::none(), &blocks, tolerance);
}

fn check_blocks(cloth: &Cloth, x: &[DVec3], contacts: &Contacts, blocks: &[glam::DMat3], tolerance: f64) {
    let d: Vec<DVec3> = (0..cloth.order().len()).map(|i| jitters(i + 5000)).collect();
    let mut product = Vec::new();
    cloth.pattern().multiply(blocks, &d, &mut product);
    let at = |s: f64| {
        let mut y = x.to_vec();
        for (&v, d) in cloth.order().iter().zip(&d) {
            y[v as usize] += *d * (s * H);
        }
        let mut moved = contacts.clone();
        moved.update(&y);
        let mut gradient = Vec::new();
        cloth.gradient(&y, &moved, &mut gradient);
        gradient
    };
    let (forth, back) = (at(1.0), at(-1.0));
    let (mut error, mut scale) = (0.0, 0.0);
    for (&v, p) in cloth.order().iter().zip(&product) {
        let measured = (forth[v as usize] - back[v as usize]) / (2.0 * H);
        error += (measured - *p).length_squared();
        scale += p.length_squared();
    }
    assert!(error.sqrt() < tolerance * scale.sqrt(), "relative error {:.1e}", (error / scale).sqrt());
}

#[test]
fn hessian_of_a_flat_stretched_sheet_is_exact() {
    // Without shear the projection drops nothing: stretched along both axes, on a face, a few vertices held.
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[0, 7, 20]);
    let x: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::new(1.05 * p.x, 5e-4, 1.08 * p.z)).collect();
    let mut contacts = cloth.contacts(&body, &x);
    check_hessian(&cloth, &x, &contacts, 1e-6);
    contacts.friction = Friction::default();
    check_hessian(&cloth, &x, &contacts, 1e-6);
}

#[test]
fn hessian_of_a_sheared_bent_sheet_is_near() {
    // The projection drops the shear strain (3 %) times the shear stiffness within the plane.
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    check_hessian(&cloth, &deformed(&mesh), &Contacts::none(), 0.02);
}

#[test]
fn hessian_is_exact_below_the_buckling_stress_and_the_true_one_beyond_it() {
    let mesh = sheet();
    let stiff = Fabric { bending_nm: [1e-2; 3], ..fabric() };
    let cloth = cloth_of(&mesh, &stiff, &[]);
    // Sheared, bent, and compressed by half a percent: all below the buckling stress of this bending stiffness.
    check_hessian_of(HessianKind::UpToBuckling, &cloth, &deformed(&mesh), 1e-5);
    let squeezed: Vec<DVec3> = deformed(&mesh).iter().map(|p| *p * DVec3::new(0.9, 1.0, 0.9)).collect();
    check_hessian_of(HessianKind::UpToBuckling, &cloth, &squeezed, 1e-5);
    // Cloth that bends a thousand times as easily buckles under both.
    let soft = cloth_of(&mesh, &Fabric { bending_nm: [1e-5; 3], ..fabric() }, &[]);
    for x in [deformed(&mesh), squeezed] {
        check_hessian_of(HessianKind::True, &soft, &x, 1e-5);
    }
}

/// The whole matrix, column by column.
fn dense(cloth: &Cloth, blocks: &[glam::DMat3]) -> faer::Mat<f64> {
    let unknowns = cloth.order().len();
    let mut matrix = faer::Mat::zeros(3 * unknowns, 3 * unknowns);
    let (mut unit, mut column) = (vec![DVec3::ZERO; unknowns], Vec::new());
    for j in 0..3 * unknowns {
        unit[j / 3][j % 3] = 1.0;
        cloth.pattern().multiply(blocks, &unit, &mut column);
        unit[j / 3][j % 3] = 0.0;
        for (i, entry) in column.iter().flat_map(DVec3::to_array).enumerate() {
            matrix[(i, j)] = entry;
        }
    }
    matrix
}

#[test]
fn projected_hessian_is_positive_definite() {
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[]);
    for squeeze in [1.1, 0.9, 0.5, 0.1] {
        let x: Vec<DVec3> =
            grazing(&mesh).iter().map(|p| DVec3::new(squeeze * p.x, p.y, (2.0 - squeeze) * p.z)).collect();
        let contacts = cloth.contacts(&body, &x);
        let mut blocks = Vec::new();
        cloth.hessian(&x, &contacts, &mut blocks);
        let mut hessian = dense(&cloth, &blocks);
        let asymmetry = (&hessian - hessian.transpose()).norm_max();
        assert!(asymmetry <= 1e-12 * hessian.norm_max(), "squeezed to {squeeze}: {asymmetry}");
        // Cholesky's factor exists if and only if the matrix is positive definite.
        assert!(hessian.llt(faer::Side::Lower).is_ok(), "squeezed to {squeeze}");
        // One negative direction makes it fail.
        let last = hessian.nrows() - 1;
        hessian[(last, last)] *= -1e-6;
        assert!(hessian.llt(faer::Side::Lower).is_err(), "a negative diagonal passed");
    }
}
