//! The same bits on one thread and on two.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::refine::{RefineOptions, refine};
use partwise::mesh::{RestShape, Topology};

use crate::bench::{fabric, rectangle, sphere};

#[test]
fn threads_do_not_change_a_bit() {
    let body = sphere(0.1);
    let mut mesh = rectangle(DVec3::X * 0.3, DVec3::Y * 0.3, 20, 20);
    for p in &mut mesh.positions {
        *p += DVec3::new(-0.15, -0.15, 0.101);
    }
    let fabric = fabric(0.2, 60.0, 0.3, 2e-5, 0.3);
    let cloth = Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &[]).unwrap();
    let options = RefineOptions { max_steps: Some(12), ..RefineOptions::default() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            refine(&cloth, &body, mesh.positions.clone(), &options, &mut |_| ControlFlow::Continue(())).unwrap()
        })
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.positions, two.positions);
    assert_eq!(one.history, two.history);
}
