//! One drape: from the waved specimen to rest, with coefficient and outline.

use std::ops::ControlFlow;

use glam::DVec2;

use super::outline::{Nodes, Outline};
use super::shadow::shadow_area;
use super::specimen::{specimen, waved};
use super::standards::{DrapeTest, DrapeTestError};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::refine::{RefineOptions, refine_with};
use crate::mesh::{RestShape, Topology, TriMesh};

/// One simulated drape.
#[derive(Debug, Clone)]
pub(crate) struct Drape {
    /// Drape coefficient DC, 0 to 1.
    pub coefficient: f64,
    /// The outline from above.
    pub outline: Outline,
    /// Its nodes.
    pub nodes: Nodes,
    /// ‖∇E‖₂ over the weight of the rim.
    pub residual_over_weight: f64,
    /// Newton steps.
    pub steps: usize,
    /// The draped rim.
    pub mesh: TriMesh,
}

impl DrapeTest {
    /// Drapes `fabric`.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or cloth and solver cannot be set up.
    pub(crate) fn run(&self, fabric: &Fabric) -> Result<Drape, DrapeTestError> {
        self.check()?;
        let flat = specimen(self);
        let mut rest = RestShape::from_edges(&flat.mesh)?;
        if self.turned != 0.0 {
            let to_weft = crate::base::math::unit(-self.turned);
            rest.corners.iter_mut().flatten().for_each(|corner: &mut DVec2| *corner = to_weft.rotate(*corner));
        }
        let cloth = Cloth::new(&flat.mesh, &Topology::new(&flat.mesh), &rest, fabric, &flat.held)?;
        // The folds of a specimen do not touch.
        let options = RefineOptions { self_contact: false, ..RefineOptions::default() };
        let start = waved(&flat, self);
        let end = refine_with(&cloth, Contacts::none(), start, &options, &mut |_| ControlFlow::Continue(()))?;
        let mesh = flat.mesh.with_positions(end.positions);
        let circle = |r: f64| std::f64::consts::PI * r * r;
        let (disc, whole) = (circle(self.disc_m), circle(self.specimen_m));
        let outline = Outline::of(&mesh, self.disc_m);
        Ok(Drape {
            coefficient: (shadow_area(&mesh, self.disc_m) - disc) / (whole - disc),
            nodes: outline.nodes(),
            outline,
            residual_over_weight: end.residual_over_weight,
            steps: end.steps,
            mesh,
        })
    }
}
