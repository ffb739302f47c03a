//! Counts the nodes of skirts cut from a half, three quarters of and a full circle, held on a cylinder, in the fabrics whose drape was measured:
//! `cargo run --no-default-features --example circle_skirts -- [EDGE_CM [FOLDER]]`
//!
//! The pattern is a sector of an annulus. Sewn up, it is a cone around the cylinder without strain, where the drape starts, with waves of half
//! a millimetre: without them the cone of a full circle, a flat disc, is an equilibrium. The meshes are written to FOLDER.

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use glam::{DVec2, DVec3};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::refine::Stop;
use partwise::mesh::TriMesh;
use partwise::mesh::export::{write_mesh, write_textured};
use partwise::{SceneSpec, Settings};

const CYLINDER_RADIUS_M: f64 = 0.11;
const CYLINDER_HEIGHT_M: f64 = 1.0;
const WAIST_HEIGHT_M: f64 = 0.9;
/// Distance of the waist from the cylinder, m.
const EASE_M: f64 = 0.005;
const LENGTH_M: f64 = 0.45;
/// Most Newton steps of a drape. Those that rest take 30 to 100.
const MAX_STEPS: usize = 300;
const FABRIC_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/validation/fabrics");
const FABRICS: [&str; 4] = ["cotton-broad", "wool-tropical", "polyester-tropical", "polyester-faille"];
const CIRCLES: [(&str, f64); 3] = [("half", 0.5), ("three quarters", 0.75), ("full", 1.0)];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let edge = 0.01 * arguments.next().map_or(Ok(2.0), |cm| cm.parse::<f64>())?;
    if !(0.005..=0.1).contains(&edge) {
        return Err(format!("found an edge of {} cm, expected 0.5 to 10", 100.0 * edge).into());
    }
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "target/circle-skirts".to_owned()));
    std::fs::create_dir_all(&folder)?;
    let body = folder.join("cylinder.obj");
    write_mesh(&body, &cylinder())?;
    println!("fabric               circle          vertices  steps  residual  hem mm  nodes");
    for (circle, share) in CIRCLES {
        let skirt = Skirt::new(share, edge);
        let garment = folder.join(format!("{}.obj", circle.replace(' ', "-")));
        write_textured(&garment, &skirt.mesh, &skirt.pattern)?;
        let input = SceneSpec {
            unit: Some(partwise::mesh::Unit::M),
            rest: "texture".to_owned(),
            hold: Some("top".to_owned()),
            ..SceneSpec::new(body.display().to_string(), garment.display().to_string())
        }
        .load()?;
        for name in FABRICS {
            let fabric = Fabric::by_name(&format!("{FABRIC_FOLDER}/{name}.toml"))?;
            let mut settings = Settings { fabric, ..Settings::default() };
            settings.solver.newton.max_steps = MAX_STEPS;
            let draped = input.scene.drape(&settings)?;
            let state = draped.state.as_ref().ok_or("no step at full resolution")?;
            let hem: Vec<DVec3> = draped.positions[skirt.hem.clone()].to_vec();
            let height = hem.iter().map(|p| 1e3 * p.z).sum::<f64>() / hem.len() as f64;
            let rests = state.stop == Stop::Converged;
            println!(
                "{name:<20} {circle:<15} {:>8} {:>6} {:>9.1e} {height:>7.1} {:>6}{}",
                skirt.mesh.positions.len(),
                state.steps,
                state.residual_over_weight,
                nodes(&hem),
                if rests { "" } else { "  does not rest" }
            );
        }
    }
    Ok(())
}

/// A closed cylinder about the z axis, from the ground up.
fn cylinder() -> TriMesh {
    let (around, up) = (72, 40);
    let mut mesh = TriMesh::default();
    for k in 0..=up {
        let z = CYLINDER_HEIGHT_M * f64::from(k) / f64::from(up);
        mesh.positions.extend(
            (0..around)
                .map(|i| (CYLINDER_RADIUS_M * DVec2::from_angle(TAU * f64::from(i) / f64::from(around))).extend(z)),
        );
    }
    let at = |k: u32, i: u32| k * around + i % around;
    for i in 0..around {
        for k in 0..up {
            mesh.triangles.push([at(k, i), at(k, i + 1), at(k + 1, i + 1)]);
            mesh.triangles.push([at(k, i), at(k + 1, i + 1), at(k + 1, i)]);
        }
    }
    let [bottom, top] = [mesh.positions.len() as u32, mesh.positions.len() as u32 + 1];
    mesh.positions.extend([DVec3::ZERO, DVec3::Z * CYLINDER_HEIGHT_M]);
    for i in 0..around {
        mesh.triangles.push([bottom, at(0, i + 1), at(0, i)]);
        mesh.triangles.push([top, at(up, i), at(up, i + 1)]);
    }
    TriMesh::new(mesh.positions, mesh.triangles)
}

/// A skirt around the cylinder.
struct Skirt {
    mesh: TriMesh,
    /// Corners of each triangle in the flat pattern, m.
    pattern: Vec<[DVec2; 3]>,
    /// The vertices of the hem, in their order around.
    hem: std::ops::Range<usize>,
}

impl Skirt {
    /// The skirt of this share of a circle, with edges of `edge` (m), in rings of nearly equilateral triangles.
    fn new(share: f64, edge: f64) -> Self {
        let waist = (CYLINDER_RADIUS_M + EASE_M) / share;
        let rows = (LENGTH_M / (edge * 0.75f64.sqrt())).round().max(4.0) as usize;
        let (mut positions, mut triangles, mut pattern) = (Vec::new(), Vec::new(), Vec::new());
        // The vertices of the ring above: their first number, their number, and the angle of the first as a share of its cell.
        let mut above: Option<(usize, usize, f64)> = None;
        let mut hem = 0..0;
        for k in 0..=rows {
            let along = LENGTH_M * k as f64 / rows as f64;
            let count = (TAU * share * (waist + along) / edge).round() as usize;
            let (start, shift) = (positions.len(), 0.5 * (k % 2) as f64);
            positions.extend((0..count).map(|i| {
                let turn = TAU * (i as f64 + shift) / count as f64;
                let wave: f64 = (2..14).map(|n| (f64::from(n) * (turn + 2.4 * f64::from(n))).cos()).sum();
                let drop = along * (1.0 - share * share).sqrt();
                let lift = 5e-4 * (along / LENGTH_M).powi(2) * wave;
                ((waist + along) * share * DVec2::from_angle(turn)).extend(WAIST_HEIGHT_M - drop + lift)
            }));
            let flat = |ring: (usize, usize, f64), i: usize, along: f64| {
                (waist + along) * DVec2::from_angle(TAU * share * (i as f64 + ring.2) / ring.1 as f64)
            };
            let below = (start, count, shift);
            if let Some(above) = above {
                let higher = LENGTH_M * (k - 1) as f64 / rows as f64;
                let (mut i, mut j) = (0, 0);
                while i < above.1 || j < count {
                    let turn = |ring: (usize, usize, f64), i: usize| (i as f64 + ring.2) / ring.1 as f64;
                    let at = |ring: (usize, usize, f64), i: usize| (ring.0 + i % ring.1) as u32;
                    let (a, b) = ((at(above, i), flat(above, i, higher)), (at(below, j), flat(below, j, along)));
                    let c = if i == above.1 || (j < count && turn(below, j + 1) <= turn(above, i + 1)) {
                        j += 1;
                        (at(below, j), flat(below, j, along))
                    } else {
                        i += 1;
                        (at(above, i), flat(above, i, higher))
                    };
                    triangles.push([a.0, b.0, c.0]);
                    pattern.push([a.1, b.1, c.1]);
                }
            }
            above = Some(below);
            hem = start..start + count;
        }
        Self { mesh: TriMesh::new(positions, triangles), pattern, hem }
    }
}

/// Maxima of the hem's outline from above that rise by more than 1 mm over both minima beside them.
fn nodes(hem: &[DVec3]) -> usize {
    const RISE_M: f64 = 1e-3;
    let flat: Vec<DVec2> = hem.iter().map(|p| p.truncate()).collect();
    let outline: Vec<f64> = (0..720)
        .map(|k| {
            let direction = DVec2::from_angle(PI * f64::from(k) / 360.0);
            let sides = flat.iter().zip(flat.iter().cycle().skip(1));
            let crossings = sides.filter_map(|(p, q)| {
                let [left, right] = [direction.perp_dot(*p), direction.perp_dot(*q)];
                (left * right <= 0.0 && left != right).then(|| direction.dot(p.lerp(*q, left / (left - right))))
            });
            crossings.fold(0.0, f64::max)
        })
        .collect();
    let (mut low, mut high, mut rising, mut count) = (f64::INFINITY, 0.0, false, 0);
    // The first round finds a start, the second counts.
    for (i, &r) in outline.iter().chain(&outline).enumerate() {
        (low, high) = (f64::min(low, r), f64::max(high, r));
        if rising && r < high - RISE_M {
            count += usize::from(i >= outline.len());
            (rising, low) = (false, r);
        } else if !rising && r > low + RISE_M {
            (rising, high) = (true, r);
        }
    }
    count
}
