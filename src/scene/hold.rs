//! Which vertices are held, by what a user calls them: the highest edge of the garment or of one of its connected parts, or the edges that
//! a group lies on.

use super::{Scene, SceneError};

impl Scene {
    /// The vertices of several edges, their names separated by commas; a group whose name has a comma in it counts as one.
    ///
    /// # Errors
    /// As [`edge`](Self::edge).
    pub fn edges(&self, what: &str) -> Result<Vec<u32>, SceneError> {
        let known = self.garment.groups.iter().any(|g| g == what);
        let names: Vec<&str> = if known { vec![what] } else { what.split(',').map(str::trim).collect() };
        let mut held = Vec::new();
        for name in names {
            held.extend(self.edge(name)?);
        }
        held.sort_unstable();
        held.dedup();
        Ok(held)
    }

    /// The vertices of the garment's highest edge (`top`), of the highest edge of one of its connected parts (`top:2`, counted from 1 in
    /// the order of their first vertices), or of the edges that a group lies on.
    ///
    /// # Errors
    /// [`SceneError`] where there is no such part or group, or no edge.
    pub fn edge(&self, what: &str) -> Result<Vec<u32>, SceneError> {
        let Self { garment: mesh, topology, .. } = self;
        if let Some(group) = mesh.groups.iter().position(|g| g == what) {
            let on_edge = topology.boundary_vertices();
            let mut held: Vec<u32> = (mesh.triangles.iter().zip(&mesh.triangle_group))
                .filter(|&(_, &g)| g as usize == group)
                .flat_map(|(triangle, _)| *triangle)
                .filter(|&v| on_edge[v as usize])
                .collect();
            held.sort_unstable();
            held.dedup();
            if held.is_empty() {
                return Err(SceneError::NoEdge { what: what.to_owned() });
            }
            return Ok(held);
        }
        let (part_of, parts) = topology.components();
        let part = match what.strip_prefix("top:").map(str::parse::<usize>) {
            _ if what == "top" => None,
            Some(Ok(part)) if (1..=parts).contains(&part) => Some(part as u32 - 1),
            Some(_) => return Err(SceneError::UnknownPart { found: what.to_owned(), parts }),
            None => return Err(SceneError::UnknownGroup { found: what.to_owned(), known: mesh.groups.clone() }),
        };
        let height = |edge: &[u32]| edge.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() / edge.len() as f64;
        let edges = topology.boundary_loops().into_iter();
        let of_part = edges.filter(|edge| part.is_none_or(|part| part_of[edge[0] as usize] == part));
        let highest = of_part.max_by(|a, b| height(a).total_cmp(&height(b)));
        highest.ok_or_else(|| SceneError::NoEdge { what: what.to_owned() })
    }
}
