//! An imported mesh made to face one way: neighbours agree, a body faces outward, a garment away from its body.

use super::health::Findings;
use super::import::Imported;
use super::report::{Remark, Repair};
use super::rest::RestShape;
use super::topology::{NONE, Topology};
use super::{longest_side, renumbered, retain, winding};

/// A triangle that at rest is so many times as long as worn, or as many times shorter, was not cut for where it is: what is stretched or
/// gathered is off by tens of percent.
const OTHER_SIZE: f64 = 4.0;

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
        let (turn, turned) = winding::agree(&self.mesh);
        (0..turn.len()).filter(|&t| turn[t]).for_each(|t| self.turn(t));
        let report = &mut self.report;
        if turned.to_agree > 0 {
            report.repairs.push(Repair::WindingTurned { triangles: turned.to_agree });
        }
        if coincident > 0 {
            report.remarks.push(Remark::Coincident { vertices: coincident });
        }
        if turned.one_sided > 0 {
            report.remarks.push(Remark::OneSided { patches: turned.one_sided });
        }
        self.look();
    }

    /// Drops triangles, as far as not all are, the vertices that only they had, and the faces of which nothing is left.
    pub(crate) fn drop_triangles(&mut self, drop: &[bool]) {
        let Some(first) = drop.iter().position(|&drop| drop) else { return };
        let (mesh, source) = (&mut self.mesh, &mut self.source);
        let first = source.faces[self.face[first] as usize].number as usize + 1;
        retain(&mut mesh.triangles, |t| !drop[t]);
        retain(&mut mesh.triangle_group, |t| !drop[t]);
        retain(&mut self.texture, |t| !drop[t]);
        let mut left = vec![true; source.faces.len()];
        (0..drop.len()).filter(|&t| drop[t]).for_each(|t| left[self.face[t] as usize] = false);
        (0..drop.len()).filter(|&t| !drop[t]).for_each(|t| left[self.face[t] as usize] = true);
        retain(&mut self.face, |t| !drop[t]);
        let number = renumbered(left.len(), |f| left[f]);
        self.face.iter_mut().for_each(|f| *f = number[*f as usize]);
        retain(&mut source.faces, |f| left[f]);
        let mut used = vec![false; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let number = renumbered(used.len(), |v| used[v]);
        retain(&mut mesh.positions, |v| used[v]);
        mesh.triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
        source.mesh_vertex.iter_mut().filter(|v| **v != NONE).for_each(|v| *v = number[*v as usize]);
        let triangles = drop.iter().filter(|&&drop| drop).count();
        self.report.repairs.push(Repair::NoAreaDropped { triangles, first });
        self.look();
    }

    /// Notes what solvers will find odd in its rest shape.
    pub(crate) fn remark_on(&mut self, rest: &RestShape) {
        let slivers = rest.slivers();
        if slivers > 0 {
            self.report.remarks.push(Remark::Slivers { triangles: slivers });
        }
        let at_rest = rest.corners.iter().map(|c| longest_side(c.map(|p| p.extend(0.0))));
        let worn = (0..self.mesh.triangles.len()).map(|t| longest_side(self.mesh.corners(t)));
        let pairs = at_rest.zip(worn).enumerate();
        let off: Vec<(f64, usize, f64, f64)> = pairs
            .map(|(t, (rest, worn))| ((rest / worn).max(worn / rest), t, rest, worn))
            .filter(|(ratio, ..)| *ratio > OTHER_SIZE)
            .collect();
        if let Some(&(_, t, rest_m, worn_m)) = off.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            let first = self.source.faces[self.face[t] as usize].number as usize + 1;
            self.report.remarks.push(Remark::OtherThanWorn { triangles: off.len(), first, rest_m, worn_m });
        }
    }

    /// Notes what the topology shows.
    fn look(&mut self) {
        let topology = Topology::new(&self.mesh);
        let findings = Findings::new(&self.mesh, &topology);
        let report = &mut self.report;
        report.vertices = self.mesh.vertex_count();
        report.triangles = self.mesh.triangles.len();
        report.components = topology.components().1;
        report.boundary_edges = topology.boundary_edges().count();
        report.boundary_loops = topology.boundary_loops().len();
        let seen_here =
            |r: &Remark| matches!(r, Remark::NonManifold { .. } | Remark::Pinched { .. } | Remark::NoArea { .. });
        report.remarks.retain(|remark| !seen_here(remark));
        let mut note = |count: usize, remark: Remark| {
            if count > 0 {
                report.remarks.push(remark);
            }
        };
        note(findings.non_manifold_edges, Remark::NonManifold { edges: findings.non_manifold_edges });
        note(findings.pinched_vertices, Remark::Pinched { vertices: findings.pinched_vertices });
        note(findings.no_area, Remark::NoArea { triangles: findings.no_area });
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
