//! Pressure where it is known.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::GRAVITY;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::fit::fit;
use partwise::mechanics::refine::{RefineOptions, Stop, refine};
use partwise::mesh::{RestShape, Topology};

use crate::bench::{block, fabric, rectangle};

#[test]
fn a_cloth_at_rest_presses_with_its_weight() {
    let body = block(DVec3::ONE, 0.0);
    let mut mesh = rectangle(DVec3::X * 0.2, DVec3::Y * 0.2, 8, 8);
    for p in &mut mesh.positions {
        p.z = 1e-3;
    }
    let fabric = fabric(0.5, 60.0, 0.3, 2e-5, 0.3);
    let mut cloth =
        Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &[]).unwrap();
    cloth.solver.newton.tolerance = 1e-6;
    let end =
        refine(&cloth, &body, mesh.positions.clone(), &RefineOptions::default(), &mut |_| ControlFlow::Continue(()))
            .unwrap();
    assert_eq!(end.stop, Stop::Converged);
    let fit_at_rest = fit(&cloth, cloth.contacts(&body, &end.positions), &end.positions, end.contact_stiffness);
    let expected_kpa = 1e-3 * 0.5 * GRAVITY;
    for p in &fit_at_rest.pressure_kpa {
        assert!((p / expected_kpa - 1.0).abs() < 1e-3, "{p} kPa for {expected_kpa}");
    }
    assert!(fit_at_rest.strain_max_percent < 1e-3);
}
