//! Equations (2) to (9) one by one, and what the solution must never do.

use super::*;

#[test]
fn equation_2_on_a_patch_tilted_by_thirty_degrees() {
    // Normal (−1/2, 0, √3/2). The diagonal runs from the low corner 0 to the high corner 3, so these two own a third of the
    // square each, corners 1 (high) and 2 (low) a sixth. Heights: 4 mm and 4 + 100 sin 30° = 54 mm.
    let found = tilted(30.0).solve(&given(700.0, 3e9));
    let [part] = found.parts[..] else { panic!("one PART") };
    let area = SIDE * SIDE;
    close(part.area_m2, area);
    close3(part.gravity, [0.0, 0.0, GRAVITY * DENSITY * area]);
    // cos γ_q = 1 over a level floor.
    close3(part.anti_force, [0.0, 0.0, 700.0 * area * THICKNESS]);
    let q = [0.004 + THICKNESS, 0.054 + THICKNESS];
    let sum_q_volume = area * THICKNESS * (q[0] / 3.0 + q[1] / 6.0 + q[0] / 6.0 + q[1] / 3.0);
    close3(part.stiffness, [3e9 * 0.5 * sum_q_volume, 0.0, 3e9 * 3f64.sqrt() / 2.0 * sum_q_volume]);
    assert!(part.contact);
    // F² = D Fᵃ where there is a stiffness.
    close(part.adjacent.z, part.displacement.z * part.stiffness.z);
}

#[test]
fn equations_3_4_and_8_take_the_cosines_of_both_surfaces() {
    // Body and garment turned 40° about y, then 25° about z: all six cosines differ from 0 and 1.
    let turn = DQuat::from_rotation_z(25f64.to_radians()) * DQuat::from_rotation_y(40f64.to_radians());
    let body = block(DVec3::splat(0.5), turn, DVec3::ZERO);
    let lean = turn * DQuat::from_rotation_x(20f64.to_radians());
    let garment = patch(turn * DVec3::new(0.0, 0.0, 0.504), lean * DVec3::X * SIDE, lean * DVec3::Y * SIDE, 1, 1);
    let case = Case::new(garment, &body, &ONE_LEVEL);
    let found = case.solve(&given(700.0, 3e9));
    let volume = SIDE * SIDE * THICKNESS;
    let (s40, c40) = 40f64.to_radians().sin_cos();
    let (s25, c25) = 25f64.to_radians().sin_cos();
    let e_q = [s40 * c25, s40 * s25, c40];
    close3(found.parts[0].anti_force, e_q.map(|c| 700.0 * c * volume));
    // Garment normal: (0, −sin 20, cos 20) turned 40° about y to (c20 s40, −s20, c20 c40), then 25° about z.
    let (s20, c20) = 20f64.to_radians().sin_cos();
    let (x, y) = (c20 * s40, -s20);
    let e_p = [x * c25 - y * s25, x * s25 + y * c25, c20 * c40];
    // Corners 0, 1 lie 4 mm off the face, 2 and 3 by 100 sin 20° more; a half of the area each, as the diagonal is 0–3.
    let q_mean = 0.004 + THICKNESS + 0.5 * SIDE * s20;
    close3(found.parts[0].stiffness, e_p.map(|c| 3e9 * c.abs() * q_mean * volume));
}

/// F¹ − F⁰ − F², N: zero by (5) along axes with a stiffness.
fn imbalance(part: &PartForces) -> DVec3 {
    part.anti_force - part.gravity - part.adjacent
}

#[test]
fn equations_5_and_6_balance_along_z() {
    let found = tilted(30.0).solve(&given(700.0, 3e9));
    let part = found.parts[0];
    let weight = GRAVITY * DENSITY * SIDE * SIDE;
    let push = 700.0 * SIDE * SIDE * THICKNESS;
    let stiffness = 3e9 * 3f64.sqrt() / 2.0 * SIDE * SIDE * THICKNESS * (0.029 + THICKNESS);
    close(part.displacement.z, (push - weight) / stiffness);
    close(imbalance(&part).z, 0.0);
    // The resultant as printed: F⁰ + F¹ + F² = 2 F¹.
    close(part.resultant.z, 2.0 * push);
    close(part.resultant.length(), 2.0 * push);
}

#[test]
fn equation_7_balances_along_x_and_y() {
    let turn = DQuat::from_rotation_z(30f64.to_radians()) * DQuat::from_rotation_y(45f64.to_radians());
    let body = block(DVec3::splat(0.5), turn, DVec3::ZERO);
    let garment = patch(turn * DVec3::new(0.0, 0.0, 0.504), turn * DVec3::X * SIDE, turn * DVec3::Y * SIDE, 2, 2);
    let found = Case::new(garment, &body, &ONE_LEVEL).solve(&given(-700.0, 3e9));
    // Parallel to the face, cos cancels between F¹ and Fᵃ: D_x = D_y = q_f/(p_f q), with the sign of the normal, positive here.
    let expected = -700.0 / (3e9 * (0.004 + THICKNESS));
    close(found.parts[0].displacement.x, expected);
    close(found.parts[0].displacement.y, expected);
    let weight = GRAVITY * DENSITY * SIDE * SIDE;
    let volume = SIDE * SIDE * THICKNESS;
    let cos = 45f64.to_radians().cos();
    close(found.parts[0].displacement.z, expected - weight / (3e9 * cos * (0.004 + THICKNESS) * volume));
}

#[test]
fn equation_9_lets_contactless_cloth_sink_and_as_printed_rise() {
    let garment = patch(DVec3::new(0.0, 0.0, 0.3), DVec3::new(0.8, 0.0, 0.6) * SIDE, DVec3::Y * SIDE, 1, 1);
    let case = Case::new(garment, &floor(), &ONE_LEVEL);
    let options = given(700.0, 3e9);
    let part = case.solve(&options).parts[0];
    assert!(!part.contact);
    let weight = GRAVITY * DENSITY * SIDE * SIDE;
    let stiffness = 3e9 * 0.8 * SIDE * SIDE * THICKNESS * (0.33 + THICKNESS);
    close3(part.displacement, [0.0, 0.0, -weight / stiffness]);
    close3(part.anti_force, [0.0; 3]);
    close3(part.resultant, [0.0; 3]);
    let literal = case.solve(&PaperOptions { contactless: Contactless::AsPrinted, ..options }).parts[0];
    close3(literal.displacement, [0.0, 0.0, weight / stiffness]);
    // and (5) is violated by twice the weight.
    close(imbalance(&literal).z, -2.0 * weight);
}

#[test]
fn the_body_force_carries_the_garment() {
    // Half of the cloth lies on a slope of 60°, so cos γ_q = 1/2 there; the rest hangs free 30 cm off and is carried too.
    let body = block(DVec3::splat(0.5), DQuat::from_rotation_y(60f64.to_radians()), DVec3::ZERO);
    let turn = DQuat::from_rotation_y(60f64.to_radians());
    let near = patch(turn * DVec3::new(0.0, 0.0, 0.502), turn * DVec3::X * SIDE, turn * DVec3::Y * SIDE, 1, 1);
    let far = patch(turn * DVec3::new(0.0, 0.0, 0.8), turn * DVec3::X * SIDE, turn * DVec3::Y * SIDE, 1, 1);
    let mut garment = near.clone();
    garment.positions.extend(far.positions);
    garment.triangles.extend(far.triangles.iter().map(|t| t.map(|v| v + 4)));
    let found = Case::new(garment, &body, &[0.0, 10.0, f64::INFINITY]).solve(&PaperOptions::default());
    let weight = GRAVITY * DENSITY * 2.0 * SIDE * SIDE;
    close(found.weight_n, weight);
    assert_eq!(found.contact_parts, 1);
    close(found.parts[0].anti_force.z, weight);
    close(found.body_force, weight / (0.5 * SIDE * SIDE * THICKNESS));
    close(found.parts[0].anti_force.x, weight * 60f64.to_radians().tan());
}

#[test]
fn nothing_is_pushed_into_the_body() {
    let case = tilted(30.0);
    // A coefficient so small that the patch would sink 37 cm into the floor.
    let found = case.solve(&given(0.0, 2e5));
    assert!((found.parts[0].displacement.z + 0.37).abs() < 0.02);
    assert_eq!(found.projected_vertices, 4);
    assert_eq!(found.penetrating_vertices, 0);
    for s in case.body.nearest_all(&found.positions) {
        close(s.signed_distance, THICKNESS);
    }
    assert!(found.warnings.iter().any(|w| matches!(w, PaperWarning::Explodes { parts: 1, .. })));
}

#[test]
fn mismatched_inputs_are_refused() {
    let case = tilted(30.0);
    let run = |surface: &[SurfacePoint], fabric: &Fabric, options: &PaperOptions| {
        solve(&case.garment, &case.topology, &case.body, surface, &case.parts, fabric, options).unwrap_err()
    };
    let options = PaperOptions::default();
    assert!(matches!(run(&case.surface[1..], &cloth(), &options), PaperError::Length { found: 3, expected: 4, .. }));
    let thin = Fabric { thickness_m: 0.0, ..cloth() };
    assert!(run(&case.surface, &thin, &options).to_string().starts_with("thickness in m is 0"));
    assert!(matches!(run(&case.surface, &cloth(), &given(f64::NAN, 1.0)), PaperError::Constant { .. }));
    assert!(matches!(run(&case.surface, &cloth(), &given(1.0, -1.0)), PaperError::Constant { .. }));
}

#[test]
fn a_garment_that_touches_nowhere_is_carried_where_it_is_nearest() {
    // Rising from 20 mm to 70 mm over the floor, in levels of 1 cm: only the first is within 5 mm of the nearest vertex.
    let garment = patch(DVec3::new(0.0, 0.0, 0.02), DVec3::new(0.0866, 0.0, 0.05), DVec3::Y * SIDE, 10, 2);
    let case = Case::new(garment, &floor(), &[0.0, 3.0, 4.0, 5.0, f64::INFINITY]);
    let found = case.solve(&PaperOptions::default());
    assert_eq!(found.parts.iter().map(|p| p.contact).collect::<Vec<_>>(), [true, false, false, false]);
    close(found.parts[0].anti_force.z, found.weight_n);
    let PaperWarning::NotTouching { nearest_m, contact_m } = found.warnings[0] else { panic!("{:?}", found.warnings) };
    close(nearest_m, 0.02);
    close(contact_m, 0.025);
    let strict = case.solve(&PaperOptions { untouched: Untouched::Contactless, ..PaperOptions::default() });
    assert_eq!(strict.contact_parts, 0);
    assert_eq!(strict.warnings, [PaperWarning::NothingCarries { contact_parts: 0, support: 0.0 }]);
}
