//! Which vertices are held, by what a user calls them: the highest edge of the garment or of one of its connected parts, or the edges that
//! a group lies on. And what of a garment nothing held: its connected parts that have fallen off.

use std::collections::BTreeSet;

use glam::DVec3;

use super::{Scene, SceneError};
use crate::base::files::first_of;

/// Connected parts that are named in one message; of more their number is told.
const NAMED: usize = 5;

/// Edges whose heights differ by less are as high as each other, m.
const AS_HIGH_M: f64 = 0.005;

/// What of a garment has fallen off the body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fallen {
    what: String,
    hold: String,
}

impl std::fmt::Display for Fallen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} fallen off the body; {}, or place it better", self.what, self.hold)
    }
}

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
        let edges = topology.boundary_loops().into_iter();
        let of_part = edges.filter(|edge| part.is_none_or(|part| part_of[edge[0] as usize] == part));
        self.highest(of_part.collect()).ok_or_else(|| SceneError::NoEdge { what: what.to_owned() })
    }

    /// The highest of some edges, by their mean height as placed; of those that are as high, the shortest: the neckline of a poncho
    /// that is laid flat, and not its hem.
    fn highest(&self, edges: Vec<Vec<u32>>) -> Option<Vec<u32>> {
        let at = |v: &u32| self.garment.positions[*v as usize];
        let height = |edge: &[u32]| edge.iter().map(|v| at(v).z).sum::<f64>() / edge.len() as f64;
        let length = |edge: &[u32]| {
            edge.iter().zip(edge.iter().cycle().skip(1)).map(|(a, b)| at(a).distance(at(b))).sum::<f64>()
        };
        let top = edges.iter().map(|edge| height(edge)).max_by(f64::total_cmp)?;
        let highest = edges.into_iter().filter(|edge| height(edge) >= top - AS_HIGH_M);
        highest.min_by(|a, b| length(a).total_cmp(&length(b)))
    }

    /// The highest edge of each connected part; `None` of one that has no edge.
    pub(crate) fn tops(&self) -> Vec<Option<Vec<u32>>> {
        let (part_of, parts) = self.topology.components();
        let mut edges = vec![Vec::new(); parts];
        for edge in self.topology.boundary_loops() {
            edges[part_of[edge[0] as usize] as usize].push(edge);
        }
        edges.into_iter().map(|edges| self.highest(edges)).collect()
    }

    /// Numbers, from 1, of the connected parts of which nothing is held.
    pub(crate) fn loose_parts(&self) -> Vec<usize> {
        let (part_of, parts) = self.topology.components();
        let held: BTreeSet<u32> = self.held.iter().filter_map(|&v| part_of.get(v as usize)).copied().collect();
        (0..parts as u32).filter(|part| !held.contains(part)).map(|part| part as usize + 1).collect()
    }

    /// What has fallen off the body at `x` (m): connected parts of which nothing is held and all is below the body. They
    /// meet nothing any more, and would fall for ever.
    #[must_use]
    pub(crate) fn fallen(&self, x: &[DVec3]) -> Option<Fallen> {
        let fallen = self.fallen_parts(x);
        let what = format!("{} {}", self.named(&fallen), if fallen.len() > 1 { "have" } else { "has" });
        (!fallen.is_empty()).then(|| Fallen { what, hold: self.how_to_hold(&fallen) })
    }

    /// Numbers, from 1, of the connected parts that have [`fallen`](Self::fallen).
    pub(crate) fn fallen_parts(&self, x: &[DVec3]) -> Vec<usize> {
        let low = self.body.mesh().bounds().map_or(f64::NEG_INFINITY, |(low, _)| low.z);
        // Mostly none is, and this is asked at every step.
        if x.iter().all(|x| x.z >= low) {
            return Vec::new();
        }
        let (part_of, _) = self.topology.components();
        let above: BTreeSet<u32> = part_of.iter().zip(x).filter(|(_, x)| x.z >= low).map(|(part, _)| *part).collect();
        self.loose_parts().into_iter().filter(|&part| !above.contains(&(part as u32 - 1))).collect()
    }

    /// Connected parts, numbered from 1, as a sentence begins with them.
    pub(crate) fn named(&self, parts: &[usize]) -> String {
        let (part_of, all) = self.topology.components();
        let numbered = |part: &usize| {
            let first = part_of.iter().position(|&of| of as usize + 1 == *part);
            let layer = self.layers.iter().find(|layer| first.is_some_and(|v| layer.vertices.contains(&v)));
            match layer.filter(|_| self.layers.len() > 1) {
                Some(layer) => format!("{part} ({})", layer.name),
                None => part.to_string(),
            }
        };
        let numbers: Vec<String> = parts.iter().map(numbered).collect();
        let whole = if self.layers.len() > 1 { "outfit" } else { "garment" };
        let s = if parts.len() == 1 { "" } else { "s" };
        if all == 1 {
            return "the garment".to_owned();
        }
        format!("connected part{s} {} of the {whole}'s {all}", first_of(&numbers, NAMED))
    }

    /// What to do about connected parts that nothing holds, as the user would write it.
    pub(crate) fn how_to_hold(&self, parts: &[usize]) -> String {
        let tops = self.tops();
        let open: Vec<usize> = parts.iter().copied().filter(|part| tops[part - 1].is_some()).take(NAMED).collect();
        if open.is_empty() {
            return "it has no edge that could be held: join it to what stays on".to_owned();
        }
        let names: Vec<String> = open.iter().map(|part| format!("top:{part}")).collect();
        let names = if tops.len() == 1 { "top".to_owned() } else { names.join(",") };
        let (part_of, _) = self.topology.components();
        let groups: BTreeSet<u32> = (self.garment.triangles.iter().zip(&self.garment.triangle_group))
            .filter(|(corners, _)| parts.contains(&(part_of[corners[0] as usize] as usize + 1)))
            .map(|(_, group)| *group)
            .collect();
        let groups: Vec<String> = groups.iter().filter_map(|&g| self.garment.groups.get(g as usize)).cloned().collect();
        let or_group = match &groups[..] {
            [] => String::new(),
            some => format!(", or one of its groups: {}", first_of(some, NAMED)),
        };
        format!("hold its edge (--hold {names}{or_group})")
    }
}
