//! PARTs of a garment in two fabrics: each has the weight and stiffness of its fabric.

use partwise::mechanics::paper::{Cut, solve_cut};
use partwise::mesh::RestShape;

use super::*;

/// Two pieces side by side away from the body, one PART each: the fabric of one does not affect the other.
#[test]
fn two_pieces_of_two_fabrics_move_as_each_would_alone() {
    let far = block(DVec3::splat(0.5), DQuat::IDENTITY, DVec3::new(0.0, 3.0, 0.0));
    let (body, denser) = (
        Body::new(&far).unwrap(),
        Fabric { density_kg_per_m2: 0.5, thickness_m: 2e-3, stretch_warp_n_per_m: 400.0, ..cloth() },
    );
    let piece = |x: f64| patch(DVec3::new(x, 0.0, 0.0), DVec3::X * SIDE, DVec3::Z * SIDE, 4, 4);
    let mut both = piece(0.0);
    let other = piece(2.0 * SIDE);
    let n = both.positions.len() as u32;
    both.positions.extend(other.positions);
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + n)));
    let count = both.triangles.len();
    let rest = RestShape {
        cut_from: (0..count).map(|t| u16::from(t >= count / 2)).collect(),
        ..RestShape::from_edges(&both).unwrap()
    };
    let topology = Topology::new(&both);
    let surface = body.nearest_all(&both.positions);
    let distance: Vec<f64> = surface.iter().map(|s| s.signed_distance).collect();
    let parts = segment(&topology, &distance, &RangeTable::from_bounds("one", &[0.0, 1e3]).unwrap());
    assert_eq!(parts.len(), 2);
    let options = PaperOptions { untouched: Untouched::Contactless, ..PaperOptions::default() };
    let of = |fabrics: &[Fabric], rest: &RestShape| {
        solve_cut(&both, &topology, &body, &surface, &parts, &Cut { rest, fabrics }, &options).unwrap()
    };
    let mixed = of(&[cloth(), denser.clone()], &rest);
    let plain = RestShape::from_edges(&both).unwrap();
    let [light, heavy] = [of(&[cloth()], &plain), of(&[denser], &plain)];
    close(mixed.parts[0].gravity.z, GRAVITY * DENSITY * SIDE * SIDE);
    close(mixed.parts[1].gravity.z, GRAVITY * 0.5 * SIDE * SIDE);
    close(mixed.weight_n, GRAVITY * (DENSITY + 0.5) * SIDE * SIDE);
    for (k, alone) in [(0, &light), (1, &heavy)] {
        close3(mixed.parts[k].displacement, alone.parts[k].displacement.to_array());
        close(mixed.parts[k].line_force, alone.parts[k].line_force);
    }
}
