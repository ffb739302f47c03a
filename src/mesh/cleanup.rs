//! Cuts polygons into triangles, welds vertices on request, and drops degenerate triangles, duplicates and unused vertices.

use glam::DVec3;

use super::duplicates::twins;
use super::obj_lines::{Corner, Face, used};
use super::polygon;
use super::report::Repair;
use super::{renumbered, retain};

/// A cleaned triangle list, with the origin of each triangle in the file.
#[derive(Debug, Default)]
pub(super) struct Cleaned {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Corner of the file behind each triangle corner.
    pub(super) corner: Vec<[u32; 3]>,
    /// Face of the file behind each triangle.
    pub(super) face: Vec<u32>,
    /// Mesh vertex of each file vertex, or [`NONE`](super::NONE).
    pub(super) mesh_vertex: Vec<u32>,
    /// Number of vertices in the mesh that coincide with an earlier one.
    pub(super) coincident: usize,
}

impl Cleaned {
    /// Cuts and cleans `faces` over `positions` (by file vertex, m); adds each change to `repairs`.
    pub(super) fn new(
        positions: &[DVec3],
        corners: &[Corner],
        faces: &[Face],
        weld: bool,
        repairs: &mut Vec<Repair>,
    ) -> Self {
        let used = used(positions.len(), faces, corners);
        let (place, coincident) = coincident(positions, &used);
        let mut stand_in: Vec<u32> = if weld { place.clone() } else { (0..positions.len() as u32).collect() };
        let stands_for = |v: u32| stand_in[v as usize];
        let mut cleaned = Self { coincident: if weld { 0 } else { coincident }, ..Self::default() };
        let (mut quads, mut larger, mut degenerate) = (0, 0, 0);
        for (number, face) in faces.iter().enumerate() {
            match face.count {
                0..=3 => {}
                4 => quads += 1,
                _ => larger += 1,
            }
            // Consecutive equal corners are one corner of the outline.
            let mut outline: Vec<u32> = (face.first..face.first + face.count).collect();
            let vertex = |c: &u32| stands_for(corners[*c as usize].vertex);
            outline.dedup_by_key(|c| vertex(c));
            while outline.len() > 1 && vertex(&outline[0]) == vertex(&outline[outline.len() - 1]) {
                outline.pop();
            }
            degenerate += (face.count as usize - outline.len()).min(face.count as usize - 2);
            let places: Vec<DVec3> = outline.iter().map(|c| positions[vertex(c) as usize]).collect();
            for triangle in polygon::triangulate(&places) {
                let corner = triangle.map(|i| outline[i]);
                let [a, b, c] = corner.map(|c| vertex(&c));
                if a == b || b == c || c == a {
                    degenerate += 1;
                    continue;
                }
                cleaned.triangles.push([a, b, c]);
                cleaned.corner.push(corner);
                cleaned.face.push(number as u32);
            }
        }
        let duplicates = cleaned.drop_duplicates();
        let (parts, twins) = cleaned.drop_twins(&place, &mut stand_in);
        let unused = used.iter().filter(|&&used| !used).count();
        cleaned.compact(positions, &stand_in);
        let mut note = |count: usize, repair: Repair| {
            if count > 0 {
                repairs.push(repair);
            }
        };
        note(quads + larger, Repair::PolygonsCut { quads, larger });
        note(if weld { coincident } else { 0 }, Repair::Welded { vertices: coincident });
        note(degenerate, Repair::DegenerateDropped { triangles: degenerate });
        note(duplicates, Repair::DuplicatesDropped { triangles: duplicates });
        note(twins, Repair::TwinsDropped { parts, triangles: twins });
        note(unused, Repair::UnusedDropped { vertices: unused });
        cleaned
    }

    /// Keeps the first triangle over each set of three vertices, whatever its winding; returns the number dropped.
    fn drop_duplicates(&mut self) -> usize {
        let mut keys: Vec<([u32; 3], u32)> = self.triangles.iter().copied().zip(0..).collect();
        keys.iter_mut().for_each(|(key, _)| key.sort_unstable());
        keys.sort_unstable();
        let mut keep = vec![true; self.triangles.len()];
        for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            keep[pair[1].1 as usize] = false;
        }
        self.keep(&keep)
    }

    /// Keeps the first of the connected parts with the same `place` numbers, and maps the vertices of the others to it.
    /// Returns the numbers of parts and of triangles dropped.
    fn drop_twins(&mut self, place: &[u32], stand_in: &mut [u32]) -> (usize, usize) {
        let found = if self.coincident > 0 { twins(&self.triangles, &self.face, place) } else { None };
        let Some(found) = found else { return (0, 0) };
        self.coincident -= found.stand_in.len();
        found.stand_in.iter().for_each(|(&v, &kept)| stand_in[v as usize] = kept);
        (found.parts, self.keep(&found.keep))
    }

    /// Keeps the marked triangles and returns the number dropped.
    fn keep(&mut self, keep: &[bool]) -> usize {
        let dropped = keep.iter().filter(|&&keep| !keep).count();
        if dropped > 0 {
            retain(&mut self.triangles, |t| keep[t]);
            retain(&mut self.corner, |t| keep[t]);
            retain(&mut self.face, |t| keep[t]);
        }
        dropped
    }

    /// Renumbers the used vertices in the order of the file.
    fn compact(&mut self, positions: &[DVec3], stand_in: &[u32]) {
        let mut used = vec![false; positions.len()];
        self.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let number = renumbered(positions.len(), |v| used[v]);
        self.positions.extend(positions.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| p));
        self.triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
        self.mesh_vertex = stand_in.iter().map(|&v| number[v as usize]).collect();
    }
}

/// The first used vertex at exactly the position of each vertex, and the number of used vertices that coincide with an
/// earlier one.
fn coincident(positions: &[DVec3], used: &[bool]) -> (Vec<u32>, usize) {
    // Adding zero turns -0 into 0.
    let key = |v: u32| (positions[v as usize] + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).filter(|&v| used[v as usize]).collect();
    order.sort_by_key(|&v| (key(v), v));
    let mut stand_in: Vec<u32> = (0..positions.len() as u32).collect();
    let mut count = 0;
    for i in 1..order.len() {
        let (before, v) = (order[i - 1], order[i]);
        if key(before) == key(v) {
            stand_in[v as usize] = stand_in[before as usize];
            count += 1;
        }
    }
    (stand_in, count)
}
