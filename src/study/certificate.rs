//! A certificate of rest: checks, from the positions of its vertices alone, that a garment is at a stable equilibrium.
//!
//! The certificate uses neither contact forces nor friction anchors of the solver, so a drape can be certified from its exported
//! files. Forces are computed from the positions. The body may exert any reaction inside Coulomb's cone at each touching vertex
//! ([`Forces`]); the residual is the force that no such reaction balances. The curvature of the energy decides whether the
//! equilibrium is stable ([`Curvature`]).
//!
//! | line | quantity | source of the limit |
//! |---|---|---|
//! | residual to lowest curvature | the six criteria of [`rest`](crate::mechanics::rest), by which the solver itself stops | there |
//! | inside the body | vertices, by the exact distance | none |
//! | skin through cloth | pairs of a garment and a body triangle that cross, exactly | none |
//! | cloth through cloth | pairs of garment triangles that cross, exactly | none |
//! | largest strain | principal strain of a triangle of known rest shape, % | `TORN_PERCENT`: more than fabrics bear |
//! | area kept | area over the area at rest, the least that passes | `CRUSHED_SHARE`: less is cloth that its bending crushed |
//! | held edges | largest distance of a held vertex from its placement, mm | digits of an exported file |
//!
//! A held vertex admits any reaction, so the forces cannot tell where it was held: the placement decides that.
//!
//! Limits: an admissible reaction need not be the one that the history left; the curvature keeps the contacts fixed.

use glam::DVec3;
use serde::Serialize;

pub use crate::mechanics::reactions::Forces;
pub use crate::mechanics::rest::Curvature;

use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mechanics::fit::{CRUSHED_SHARE, TORN_PERCENT, principal_strain};
use crate::mechanics::refine::SolveError;
use crate::mechanics::rest::{Criterion, RestState};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::scene::{Placement, Scene};

/// Largest distance of a held vertex from its placement, mm. Files written with two decimals of a centimetre pass.
const HELD_MM: f64 = 0.1;

/// Why a drape cannot be certified.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum CertifyError {
    /// The positions belong to another mesh.
    #[error(
        "found {found} positions, expected {expected}, one per vertex of the garment; give the positions of this garment"
    )]
    Count { found: usize, expected: usize },
    /// A position is not finite.
    #[error("the position of vertex number {} is not finite", .vertex + 1)]
    NotFinite { vertex: usize },
    /// The cloth cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The curvature cannot be computed.
    #[error("the curvature of the energy: {0}")]
    Solve(#[from] SolveError),
}

/// One line of a certificate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the line.
    pub name: &'static str,
    /// Measured value.
    pub value: f64,
    /// Unit of the value; empty for counts.
    pub unit: &'static str,
    /// Largest value that passes; of the curvature and the area the least.
    pub limit: f64,
    /// Whether the value is within the limit.
    pub passes: bool,
    /// Location or composition of the value.
    pub remark: String,
}

/// The lines of a certificate and their verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Whether every line passes.
    pub passes: bool,
    /// The lines.
    pub findings: Vec<Finding>,
}

impl Certificate {
    /// The line of this name.
    #[must_use]
    pub fn finding(&self, name: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.name == name)
    }
}

/// Certifies the garment of `scene` with its vertices at `x` (m). Rest shape, held vertices and their placement are those of the scene.
///
/// # Errors
/// [`CertifyError`] if the positions do not fit the scene or are not finite.
pub fn certify(scene: &Scene, fabric: &Fabric, x: &[DVec3]) -> Result<Certificate, CertifyError> {
    let expected = scene.garment.vertex_count();
    if x.len() != expected {
        return Err(CertifyError::Count { found: x.len(), expected });
    }
    if let Some(vertex) = x.iter().position(|p| !p.is_finite()) {
        return Err(CertifyError::NotFinite { vertex });
    }
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(fabric), &scene.held)?;
    let mut findings = of_rest(&RestState::new(&cloth, Some(&scene.body), x)?, &cloth).to_vec();
    findings.extend(of_surfaces(scene, x));
    findings.push(of_strain(&cloth, x));
    findings.push(of_area(scene, x));
    findings.push(of_held(scene, x));
    Ok(Certificate { passes: findings.iter().all(|f| f.passes), findings })
}

/// A line that passes if `value` is at most `limit`.
fn at_most(name: &'static str, value: f64, unit: &'static str, limit: f64, remark: String) -> Finding {
    Finding { name, value, unit, limit, passes: value <= limit, remark }
}

fn of_rest(rest: &RestState, cloth: &Cloth) -> [Finding; 6] {
    let RestState { forces, curvature, criteria } = rest;
    let of_weight = |force: DVec3| 100.0 * force.z / cloth.weight;
    let longest = curvature.step.iter().map(|d| d.length()).fold(0.0, f64::max);
    let mut remarks = [
        worst(forces),
        format!(
            "the body carries {:.1} % of {:.2} N, held edges {:.1} %",
            of_weight(forces.carried),
            cloth.weight,
            of_weight(forces.held)
        ),
        format!("{} of {} touching vertices slip or are pulled", forces.insufficient, forces.reactions.len()),
        format!("by up to {:.2} mm", 1e3 * longest),
        "RMS of the next Newton step".to_owned(),
        // The energy is not smooth: a mode may be negative in the space that was searched and not along itself.
        match curvature.unstable_modes {
            0 => "a minimum".to_owned(),
            _ if criteria[5].passes => {
                format!("the energy rises along the softest mode, about vertex {}", curvature.at + 1)
            }
            n => format!("{n} unstable modes, the softest about vertex {}", curvature.at + 1),
        },
    ];
    std::array::from_fn(|i| {
        let Criterion { name, value, unit, limit, passes } = criteria[i];
        Finding { name, value, unit, limit, passes, remark: std::mem::take(&mut remarks[i]) }
    })
}

/// Location of the largest unbalanced force.
fn worst(forces: &Forces) -> String {
    let (vertex, force) = forces
        .residual_forces
        .iter()
        .map(|r| r.length())
        .enumerate()
        .fold((0, 0.0), |worst, (v, f)| if f > worst.1 { (v, f) } else { worst });
    format!("most at vertex {}, {:.2} mN", vertex + 1, 1e3 * force)
}

fn of_surfaces(scene: &Scene, x: &[DVec3]) -> [Finding; 3] {
    let garment = scene.garment.with_positions(x.to_vec());
    let placed = Placement::new(&garment, &scene.body);
    let crossing = self_intersecting_pairs(&garment);
    let pairs = |first: Option<[u32; 2]>| match first {
        Some([t, u]) => format!("pairs of triangles, the first {} and {}", t + 1, u + 1),
        None => "pairs of triangles".to_owned(),
    };
    let deep = format!("vertices, up to {:.2} mm deep", 1e3 * placed.deepest_m);
    [
        at_most("inside the body", placed.penetrating_vertices as f64, "", 0.0, deep),
        at_most("skin through cloth", placed.crossing_pairs as f64, "", 0.0, pairs(None)),
        at_most("cloth through cloth", crossing.len() as f64, "", 0.0, pairs(crossing.first().copied())),
    ]
}

fn of_strain(cloth: &Cloth, x: &[DVec3]) -> Finding {
    let known = cloth.triangles.iter().enumerate().filter(|(_, triangle)| triangle.has_strain());
    let strains = known.clone().map(|(t, triangle)| (t, 100.0 * principal_strain(triangle.deformation(x))));
    let (t, most) = strains.fold((0, 0.0), |most: (usize, f64), (t, s)| if s > most.1 { (t, s) } else { most });
    let left_out = match cloth.triangles.len() - known.count() {
        0 => String::new(),
        count => format!("; {count} left out, slivers or bridges of open seams"),
    };
    at_most("largest strain", most, "%", TORN_PERCENT, format!("in triangle {}{left_out}", t + 1))
}

fn of_area(scene: &Scene, x: &[DVec3]) -> Finding {
    let (value, limit) = (scene.area_share(x), CRUSHED_SHARE);
    let remark = "area over the area at rest".to_owned();
    Finding { name: "area kept", value, unit: "", limit, passes: value >= limit, remark }
}

fn of_held(scene: &Scene, x: &[DVec3]) -> Finding {
    let moved = |&v: &u32| (v, 1e3 * x[v as usize].distance(scene.garment.positions[v as usize]));
    let moves = scene.held.iter().map(moved);
    let (v, most) = moves.fold((0, 0.0), |most: (u32, f64), (v, mm)| if mm > most.1 { (v, mm) } else { most });
    let remark = match scene.held.len() {
        0 => "nothing is held".to_owned(),
        held if most > HELD_MM => format!("vertex {} of {held} held is this far from its placement", v + 1),
        held => format!("{held} vertices from their placement"),
    };
    at_most("held edges", most, "mm", HELD_MM, remark)
}
