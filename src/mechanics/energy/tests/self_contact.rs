//! Self-contact: gradient and Hessian of gaps against differences, balance of forces, and the load between two layers.

use glam::{DMat3, DVec3};

use crate::GRAVITY;
use crate::body::distance::Body;
use crate::mechanics::energy::{Cloth, Contacts, HessianKind};
use crate::mechanics::refine::{RefineOptions, Stop, refine};
use crate::mesh::TriMesh;
use crate::mesh::samples::{cuboid, sheet};

/// Vertices of the lower sheet of [`near_sheets`].
const LOWER: usize = 49;

fn both(mut a: TriMesh, b: TriMesh) -> TriMesh {
    let n = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.triangles.extend(b.triangles.into_iter().map(|t| t.map(|v| v + n)));
    a
}

/// Two sheets that were placed apart and now are half an offset apart, all vertices jittered.
fn near_sheets(held: &[u32]) -> (Cloth, Vec<DVec3>) {
    let lower = sheet(6, 6, |i, j| DVec3::new(i, j, 0.0) * 0.01);
    let upper = sheet(5, 5, |i, j| DVec3::new(0.004 + 0.01 * i - 0.001 * j, 0.003 + 0.001 * i + 0.01 * j, 6e-3));
    let mesh = both(lower, upper);
    let cloth = Cloth::sample(&mesh, "jersey", held);
    let off = |i: usize| DVec3::new((1.3 * i as f64).sin(), (2.1 * i as f64).sin(), (0.7 * i as f64).sin()) * 1e-4;
    let down = |i: usize| if i < LOWER { DVec3::ZERO } else { DVec3::NEG_Z * 5.5e-3 };
    let x = mesh.positions.iter().enumerate().map(|(i, p)| *p + off(i) + down(i)).collect();
    (cloth, x)
}

/// A triangle, and another half an offset above it.
fn near_triangles() -> (Cloth, Vec<DVec3>) {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let lower = [at(0.0, 0.0, 0.0), at(0.02, 0.0, 0.0), at(0.0, 0.02, 0.0)];
    let upper = [at(0.004, 0.003, 0.01), at(0.021, 0.006, 0.01), at(0.005, 0.023, 0.01)];
    let mesh = TriMesh::new([lower, upper].concat(), vec![[0, 1, 2], [3, 4, 5]]);
    let cloth = Cloth::sample(&mesh, "jersey", &[0]);
    let x = [lower, upper.map(|x| x - DVec3::Z * 9.2e-3)].concat();
    (cloth, x)
}

/// Self-contact refreshed at `x`.
fn refreshed(cloth: &Cloth, x: &[DVec3]) -> Contacts<'static> {
    let mut contacts = Contacts::none();
    contacts.proximity = Some(cloth.proximity());
    contacts.refresh(x);
    contacts
}

/// The gradient of self-contact alone.
fn contact_gradient(cloth: &Cloth, contacts: &Contacts<'_>, x: &[DVec3]) -> Vec<DVec3> {
    let (mut with, mut without) = (Vec::new(), Vec::new());
    cloth.gradient(x, contacts, &mut with);
    cloth.gradient(x, &Contacts::none(), &mut without);
    with.iter().zip(&without).map(|(a, b)| *a - *b).collect()
}

fn moved(x: &[DVec3], v: u32, by: DVec3) -> Vec<DVec3> {
    let mut x = x.to_vec();
    x[v as usize] += by;
    x
}

/// The upper sheet after a slip, for which friction acts.
fn slipped(x: &[DVec3]) -> Vec<DVec3> {
    let slip = DVec3::new(2e-4, 1e-4, -1e-4);
    x.iter().enumerate().map(|(i, p)| if i < LOWER { *p } else { *p + slip }).collect()
}

#[test]
fn gradient_of_self_contact_matches_differences() {
    let (cloth, x) = near_sheets(&[0]);
    let contacts = refreshed(&cloth, &x);
    let x = slipped(&x);
    let pressing = contacts.proximity.as_ref().unwrap().pressing(&x);
    assert!(pressing > 50, "{pressing}");
    let energy = |x: &[DVec3]| cloth.energy(x, &contacts) - cloth.energy(x, &Contacts::none());
    let gradient = contact_gradient(&cloth, &contacts, &x);
    assert_eq!(gradient[0], DVec3::ZERO, "the vertex is held");
    let largest = gradient.iter().map(|g| g.length()).fold(0.0, f64::max);
    let step = 1e-8;
    for v in [1, 17, 24, 30, 52, 60, 70, 83] {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let slope = (energy(&moved(&x, v, axis * step)) - energy(&moved(&x, v, axis * -step))) / (2.0 * step);
            let computed = gradient[v as usize].dot(axis);
            assert!((slope - computed).abs() < 1e-5 * largest, "vertex {v}: {slope} and {computed}");
        }
    }
}

#[test]
fn self_contact_exerts_equal_and_opposite_forces_on_the_two_layers() {
    let (cloth, x) = near_sheets(&[]);
    let contacts = refreshed(&cloth, &x);
    let gradient = contact_gradient(&cloth, &contacts, &slipped(&x));
    let [lower, upper] = [&gradient[..LOWER], &gradient[LOWER..]].map(|part| part.iter().sum::<DVec3>());
    // With slip the forces have a normal and a tangential part. The difference of two gradients has the rounding of the larger.
    assert!(lower.z.abs() > 1e-3 && lower.truncate().length() > 1e-4, "{lower}");
    let scale: f64 = gradient.iter().map(|g| g.length()).sum();
    assert!((lower + upper).length() < 1e-10 * scale, "{lower} and {upper} N");
}

#[test]
fn hessian_blocks_of_gaps_match_differences() {
    let (cloth, at) = near_triangles();
    let contacts = refreshed(&cloth, &at);
    let slip = |(v, x): (usize, &DVec3)| if v < 3 { *x } else { *x + DVec3::new(1.1e-4, 0.7e-4, -2e-5) };
    let x: Vec<DVec3> = at.iter().enumerate().map(slip).collect();
    let proximity = contacts.proximity.as_ref().unwrap();
    assert!(proximity.pressing(&x) > 2);
    let layout = cloth.layout_with(&x, proximity.pairs());
    assert!(layout.pattern.rows.len() > cloth.pattern().rows.len(), "gaps add no block");
    let (mut blocks, mut without) = (Vec::new(), Vec::new());
    cloth.hessian_in(&layout, HessianKind::Projected, &x, &contacts, &mut blocks);
    cloth.hessian_in(&layout, HessianKind::Projected, &x, &Contacts::none(), &mut without);
    blocks.iter_mut().zip(without).for_each(|(a, b)| *a -= b);
    let step = 1e-9;
    for (i, &v) in layout.order.iter().enumerate() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let [ahead, behind] = [step, -step].map(|s| contact_gradient(&cloth, &contacts, &moved(&x, v, axis * s)));
            let mut d = vec![DVec3::ZERO; layout.order.len()];
            d[i] = axis;
            let mut computed = Vec::new();
            layout.pattern.multiply(&blocks, &d, &mut computed);
            let scale = computed.iter().map(|f| f.length()).fold(1.0, f64::max);
            for (&w, computed) in layout.order.iter().zip(&computed) {
                let measured = (ahead[w as usize] - behind[w as usize]) / (2.0 * step);
                assert!(measured.distance(*computed) < 1e-4 * scale, "{v} {w}: {measured} and {computed}");
            }
        }
    }
}

#[test]
fn diagonal_blocks_of_gaps_match_differences() {
    let (cloth, x) = near_sheets(&[0]);
    let contacts = refreshed(&cloth, &x);
    let (mut with, mut without) = (Vec::new(), Vec::new());
    cloth.hessian(&x, &contacts, &mut with);
    cloth.hessian(&x, &Contacts::none(), &mut without);
    let step = 1e-9;
    for (i, &v) in cloth.order().iter().enumerate().step_by(7) {
        let block = cloth.pattern().starts[i] as usize;
        let computed = with[block] - without[block];
        let force = |by: DVec3| contact_gradient(&cloth, &contacts, &moved(&x, v, by))[v as usize];
        let column = |axis: DVec3| (force(axis * step) - force(axis * -step)) / (2.0 * step);
        let measured = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
        let largest = |m: DMat3| m.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        let scale = largest(computed).max(1.0);
        assert!(largest(computed - measured) < 1e-4 * scale, "vertex {v}: {computed} and {measured}");
    }
}

#[test]
fn the_lower_of_two_sheets_on_a_plate_carries_the_upper() {
    let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -0.2), DVec3::new(0.5, 0.5, 0.0))).unwrap();
    let lower = sheet(10, 10, |i, j| DVec3::new(-0.05 + 0.01 * i, -0.05 + 0.01 * j, 0.003));
    let upper = sheet(8, 8, |i, j| DVec3::new(-0.04 + 0.01 * i, -0.043 + 0.01 * j, 0.006));
    let mesh = both(lower, upper);
    let cloth = Cloth::sample(&mesh, "jersey", &[]);
    let mut go_on = |_: &crate::mechanics::refine::Step<'_>| std::ops::ControlFlow::Continue(());
    let landed = refine(&cloth, &body, mesh.positions, &RefineOptions::default(), &mut go_on).unwrap();
    // Gaps that became narrow on the way down are stiffer than new ones, which the check below uses: settle once more.
    let end = refine(&cloth, &body, landed.positions, &RefineOptions::default(), &mut go_on).unwrap();
    assert_eq!((landed.stop, end.stop), (Stop::Converged, Stop::Converged));
    let mut contacts = cloth.contacts(&body, &end.positions);
    contacts.stiffen(end.contact_stiffness / contacts.stiffness());
    contacts.proximity = Some(cloth.proximity());
    contacts.update(&end.positions);
    contacts.refresh(&end.positions);
    let carried: f64 = contacts.touches().iter().map(|t| t.force() * t.normal.z).sum();
    assert!((carried - cloth.weight).abs() < 0.01 * cloth.weight, "{carried} of {} N", cloth.weight);
    let upper_weight = GRAVITY * cloth.masses[121..].iter().sum::<f64>();
    let between: f64 = contacts.proximity.as_ref().unwrap().forces(&end.positions).map(|f| f.z.abs()).sum();
    assert!((between - upper_weight).abs() < 0.03 * upper_weight, "{between} of {upper_weight} N");
}
