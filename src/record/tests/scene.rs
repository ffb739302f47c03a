//! A dress form and a flared dress in closed form, with plausible PARTs, forces and drape, so that recordings are tested without the
//! solver.

use crate::body::distance::Body;
use crate::mesh::{Topology, TriMesh};
use crate::record::Panel;
use crate::study::metrics::LevelCount;
use glam::DVec3;

/// Height, half width and half depth of the form, m.
const FORM: [[f64; 3]; 19] = [
    [0.00, 0.085, 0.075],
    [0.02, 0.095, 0.085],
    [0.10, 0.090, 0.075],
    [0.30, 0.110, 0.090],
    [0.50, 0.125, 0.105],
    [0.70, 0.155, 0.130],
    [0.88, 0.180, 0.155],
    [0.95, 0.170, 0.145],
    [1.05, 0.130, 0.110],
    [1.15, 0.140, 0.112],
    [1.28, 0.165, 0.130],
    [1.38, 0.180, 0.110],
    [1.44, 0.150, 0.090],
    [1.48, 0.065, 0.060],
    [1.54, 0.060, 0.060],
    [1.58, 0.072, 0.085],
    [1.64, 0.080, 0.095],
    [1.69, 0.055, 0.065],
    [1.71, 0.020, 0.025],
];

fn form(z: f64) -> (f64, f64) {
    let i = FORM.iter().rposition(|row| row[0] <= z).unwrap_or(0).min(FORM.len() - 2);
    let (a, b) = (FORM[i], FORM[i + 1]);
    let t = ((z - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    let t = t * t * (3.0 - 2.0 * t);
    (a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t)
}

/// A tube of `around` × `along` vertices; `at(u, angle)` gives the points from bottom (u = 0) to top.
fn tube(around: u32, along: u32, closed: bool, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let mut positions = Vec::new();
    for j in 0..along {
        for i in 0..around {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(around);
            positions.push(at(f64::from(j) / f64::from(along - 1), angle));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..along - 1 {
        for i in 0..around {
            let (a, b) = (j * around + i, j * around + (i + 1) % around);
            let (c, d) = (a + around, b + around);
            if (i + j) % 2 == 0 {
                triangles.extend([[a, b, d], [a, d, c]]);
            } else {
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
    }
    if closed {
        let (bottom, top) = (positions.len() as u32, positions.len() as u32 + 1);
        positions.push(at(0.0, 0.0).with_x(0.0).with_y(0.0));
        positions.push(at(1.0, 0.0).with_x(0.0).with_y(0.0));
        let last = (along - 1) * around;
        for i in 0..around {
            let k = (i + 1) % around;
            triangles.extend([[k, i, bottom], [last + i, last + k, top]]);
        }
    }
    TriMesh::new(positions, triangles)
}

/// Everything a recording takes.
pub(crate) struct Scene {
    pub(crate) body: TriMesh,
    pub(crate) garment: TriMesh,
    pub(crate) distances_m: Vec<f64>,
    pub(crate) draped: Vec<DVec3>,
}

/// One range table's PARTs and their forces.
pub(crate) struct Solved {
    pub(crate) part_of_vertex: Vec<u32>,
    pub(crate) part_force_n: Vec<DVec3>,
    pub(crate) panel: Panel,
}

impl Scene {
    /// `fineness` 1 gives some 1,100 garment vertices, 2 some 4,300.
    pub(crate) fn new(fineness: u32) -> Self {
        let body = tube(72, 120, true, |u, angle| {
            let (a, b) = form(1.71 * u);
            DVec3::new(a * angle.cos(), b * angle.sin(), 1.71 * u)
        });
        let dress = |u: f64, angle: f64, swing: f64, sag: f64| {
            let z = 0.50 + 0.86 * u;
            let (a, b) = form(z);
            let flare = (1.0 - u / 0.66).max(0.0);
            let fold = 1.0 + swing * flare * ((9.0 * angle + 0.3).cos() + 0.5 * (4.0 * angle + 1.0).cos());
            let ease = 0.006 + 0.012 * (7.0 * u).sin().powi(2);
            let out = flare.powf(1.2) * 0.19;
            DVec3::new((a + ease + out) * fold * angle.cos(), (b + ease + out) * fold * angle.sin(), z - sag * flare)
        };
        let (around, along) = (46 * fineness, 24 * fineness);
        let garment = tube(around, along, false, |u, angle| dress(u, angle, 0.02, 0.0));
        let draped = tube(around, along, false, |u, angle| dress(u, angle, 0.10, 0.05)).positions;
        let surface = Body::new(&body).expect("the form is closed");
        let distances_m = garment.positions.iter().map(|&p| surface.nearest(p).signed_distance.abs()).collect();
        Self { body, garment, distances_m, draped }
    }

    /// PARTs of a table given by its upper values in cm (the last level is open), with forces that grow with area and
    /// distance.
    pub(crate) fn solve(&self, name: &str, bounds_cm: &[f64]) -> Solved {
        let level = |d: f64| bounds_cm.iter().filter(|&&b| 100.0 * d >= b).count();
        let levels: Vec<usize> = self.distances_m.iter().map(|&d| level(d)).collect();
        let topology = Topology::new(&self.garment);
        let mut part_of_vertex = vec![u32::MAX; levels.len()];
        let mut part_level = Vec::new();
        for seed in 0..levels.len() {
            if part_of_vertex[seed] != u32::MAX {
                continue;
            }
            let part = part_level.len() as u32;
            part_level.push(levels[seed]);
            part_of_vertex[seed] = part;
            let mut stack = vec![seed as u32];
            while let Some(v) = stack.pop() {
                for &w in topology.neighbours(v) {
                    if part_of_vertex[w as usize] == u32::MAX && levels[w as usize] == levels[seed] {
                        part_of_vertex[w as usize] = part;
                        stack.push(w);
                    }
                }
            }
        }
        // PARTs are numbered level by level.
        let mut order: Vec<usize> = (0..part_level.len()).collect();
        order.sort_by_key(|&p| part_level[p]);
        let mut number = vec![0; order.len()];
        (0..).zip(&order).for_each(|(new, &old)| number[old] = new);
        part_of_vertex.iter_mut().for_each(|p| *p = number[*p as usize]);
        part_level.sort_unstable();
        let areas = self.garment.vertex_areas();
        let normals = self.garment.vertex_normals();
        let mut part_force_n = vec![DVec3::ZERO; part_level.len()];
        for (v, &part) in part_of_vertex.iter().enumerate() {
            let weight = 0.2 * 9.8 * areas[v];
            part_force_n[part as usize] += weight * (DVec3::NEG_Z + 12.0 * self.distances_m[v] * normals[v]);
        }
        let rows = (0..=bounds_cm.len()).map(|k| LevelCount {
            level: k + 1,
            lower_cm: if k == 0 { 0.0 } else { bounds_cm[k - 1] },
            upper_cm: bounds_cm.get(k).copied().unwrap_or(f64::INFINITY),
            vertices: levels.iter().filter(|&&l| l == k).count(),
            parts: part_level.iter().filter(|&&l| l == k).count(),
            extent: None,
        });
        let text = |pairs: &[(&str, &str)]| pairs.iter().map(|&(a, b)| (a.to_owned(), b.to_owned())).collect();
        let panel = Panel {
            title: "flared dress on the form".into(),
            table: name.into(),
            levels: rows.collect(),
            facts: vec![
                ("model".into(), "closed form".into()),
                ("vertices".into(), self.distances_m.len().to_string()),
                ("PARTs".into(), part_level.len().to_string()),
            ],
            fabric: text(&[("mass", "200 g/m²"), ("stiffness", "60 N/m")]),
            timings_ms: vec![
                ("load".into(), 4.1),
                ("distance".into(), 12.3),
                ("segment".into(), 1.8),
                ("mechanics".into(), 2.6),
            ],
            warnings: vec!["The forces of this scene are made up.".into()],
            command_line: "cargo test --release --test recordings".into(),
        };
        Solved { part_of_vertex, part_force_n, panel }
    }
}

/// The upper values of a table with the paper's bounds, cm, its hole filled.
pub(crate) const PAPER_LIKE: [f64; 9] = [0.06, 0.1, 0.25, 0.5, 1.5, 3.5, 6.0, 9.0, 11.0];
