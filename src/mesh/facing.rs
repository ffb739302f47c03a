//! An imported mesh made to face one way: neighbours agree, a body faces outward, a garment away from its body.

use super::health::Findings;
use super::import::Imported;
use super::report::{Remark, Repair};
use super::topology::Topology;
use super::winding;

impl Imported {
    /// Turns the triangles that face inward, whole connected parts of them, and says so.
    pub fn turn_outward(&mut self, inward: &[bool]) {
        let (component, count) = Topology::new(&self.mesh).components();
        let mut turned = vec![false; count];
        for t in (0..inward.len()).filter(|&t| inward[t]) {
            turned[component[self.mesh.triangles[t][0] as usize] as usize] = true;
            self.turn(t);
        }
        let components = turned.iter().filter(|&&turned| turned).count();
        if components > 0 {
            self.report.repairs.push(Repair::TurnedOutward { components });
        }
    }

    /// Turns triangles so that neighbours agree, and notes what the topology shows.
    pub(super) fn make_agree(&mut self, coincident: usize) {
        let (turn, _, turned) = winding::agree(&self.mesh);
        (0..turn.len()).filter(|&t| turn[t]).for_each(|t| self.turn(t));
        let topology = Topology::new(&self.mesh);
        let loops = topology.boundary_loops();
        let report = &mut self.report;
        report.components = topology.components().1;
        report.boundary_edges = topology.boundary_edges().count();
        report.boundary_loops = loops.len();
        if turned.to_agree > 0 {
            report.repairs.push(Repair::WindingTurned { triangles: turned.to_agree });
        }
        let findings = Findings::new(&self.mesh, &topology);
        let mut note = |count: usize, remark: Remark| {
            if count > 0 {
                report.remarks.push(remark);
            }
        };
        note(coincident, Remark::Coincident { vertices: coincident });
        note(findings.non_manifold_edges, Remark::NonManifold { edges: findings.non_manifold_edges });
        note(findings.pinched_vertices, Remark::Pinched { vertices: findings.pinched_vertices });
        note(findings.no_area, Remark::NoArea { triangles: findings.no_area });
        note(turned.one_sided, Remark::OneSided { patches: turned.one_sided });
    }

    /// Turns one triangle round, its texture coordinates with it.
    fn turn(&mut self, t: usize) {
        self.mesh.triangles[t].swap(1, 2);
        if let Some(corners) = &mut self.texture[t] {
            corners.swap(1, 2);
        }
    }
}

/// Turns the connected parts that enclose a negative volume.
pub(super) fn face_outward(imported: &mut Imported) {
    let mesh = &imported.mesh;
    let (component, count) = Topology::new(mesh).components();
    let volumes = winding::signed_volumes(mesh, &component, count);
    let part = |triangle: &[u32; 3]| component[triangle[0] as usize] as usize;
    let inward: Vec<bool> = mesh.triangles.iter().map(|triangle| volumes[part(triangle)] < 0.0).collect();
    imported.turn_outward(&inward);
}
