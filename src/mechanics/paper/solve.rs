//! The sums of equation (2) over every PART, the balance of each, and the displaced garment.

use glam::DVec3;
use rayon::prelude::*;

use super::calibrate::{HangingStrip, clearance, share};
use super::options::{BodyForce, Clearance, Contactless, LineForce, PaperOptions, Untouched, Volume};
use super::result::{PaperError, PaperResult, PaperWarning, PartForces};
use crate::GRAVITY;
use crate::body::distance::{Body, SurfacePoint};
use crate::garment::fabric::{Fabric, at_vertices};
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::{Part, Parts};

/// Most projections of a vertex. In a fold narrower than the thickness, a vertex projected from one side may lie inside the other. Heuristic.
const MAX_PROJECTIONS: usize = 4;

/// Displaces every PART by equations (2) to (9). `surface` is the nearest body point of each garment vertex. Vertices without a PART
/// move only out of the body.
///
/// # Errors
/// [`PaperError`] where a list does not fit the garment or a constant is not positive.
pub fn solve(
    garment: &TriMesh,
    topology: &Topology,
    body: &Body,
    surface: &[SurfacePoint],
    parts: &Parts,
    fabric: &Fabric,
    options: &PaperOptions,
) -> Result<PaperResult, PaperError> {
    let rest = RestShape::new(Vec::new());
    let fabrics = std::slice::from_ref(fabric);
    solve_cut(garment, topology, body, surface, parts, &Cut { rest: &rest, fabrics }, options)
}

/// The fabrics of a garment.
#[derive(Debug, Clone, Copy)]
pub struct Cut<'a> {
    /// The rest shape, which numbers the fabric of each triangle.
    pub rest: &'a RestShape,
    /// The fabrics.
    pub fabrics: &'a [Fabric],
}

/// [`solve`] for a garment of several fabrics: each vertex has the mean constants of its triangles, and p_f of a PART is that of a strip with
/// the mean stiffness and density of the PART.
///
/// # Errors
/// As for [`solve`].
pub fn solve_cut(
    garment: &TriMesh,
    topology: &Topology,
    body: &Body,
    surface: &[SurfacePoint],
    parts: &Parts,
    cut: &Cut<'_>,
    options: &PaperOptions,
) -> Result<PaperResult, PaperError> {
    check(garment, surface, parts, cut.fabrics, options)?;
    let of = |constant: fn(&Fabric) -> f64| at_vertices(garment, cut.rest, cut.fabrics, constant);
    let (thickness, stiffness) = (of(|f| f.thickness_m), of(|f| f.stretch_warp_n_per_m));
    let density = of(|f| f.density_kg_per_m2);
    let areas = garment.vertex_areas();
    let normals = garment.vertex_normals();
    let volume = volumes(garment, topology, &areas, &thickness, options.volume);
    let per_volume: Vec<f64> = density.iter().zip(&thickness).map(|(density, thickness)| density / thickness).collect();
    // Masses are those of the fabric of the first vertex plus the excess of other fabrics, which is zero for one fabric.
    let mass_density = per_volume.first().copied().unwrap_or_default();
    let excess_mass = |v: usize| (per_volume[v] - mass_density) * volume[v];
    let mut warnings = Vec::new();
    let nearest_m = surface.iter().map(|s| s.signed_distance).fold(f64::INFINITY, f64::min);
    let mut contact_m = options.contact_distance_m;
    if nearest_m > contact_m && nearest_m.is_finite() && options.untouched == Untouched::FromNearest {
        contact_m += nearest_m;
        warnings.push(PaperWarning::NotTouching { nearest_m, contact_m });
    }
    let sum_part = |_: usize, part: &Part| {
        let mut sums = Sums::default();
        for v in part.vertices.iter().map(|&v| v as usize) {
            let q = clearance(surface[v].signed_distance, thickness[v], options.clearance);
            sums.area += areas[v];
            sums.volume += volume[v];
            sums.excess_mass += excess_mass(v);
            sums.body += surface[v].normal * volume[v];
            sums.garment += share(normals[v], options.cosine) * (q * volume[v]);
            sums.largest += q.abs() * volume[v];
            sums.contact |= surface[v].signed_distance <= contact_m;
        }
        sums
    };
    let sums = parts.map(sum_part);

    let total_excess = (0..volume.len()).map(excess_mass).sum::<f64>();
    let weight_n = GRAVITY * mass_density * volume.iter().sum::<f64>() + GRAVITY * total_excess;
    let contact_parts = sums.iter().filter(|s| s.contact).count();
    let body_force = match options.body_force {
        BodyForce::Given(value) => value,
        BodyForce::FromBalance => {
            let (up, all) =
                sums.iter().filter(|s| s.contact).fold((0.0, 0.0), |(u, a), s| (u + s.body.z, a + s.volume));
            if up > options.degenerate_below * all {
                weight_n / up
            } else {
                let support = if all > 0.0 { up / all } else { 0.0 };
                warnings.push(PaperWarning::NothingCarries { contact_parts, support });
                0.0
            }
        }
    };
    let strip = HangingStrip {
        garment,
        normals: &normals,
        areas: &areas,
        surface,
        stiffness: &stiffness,
        thickness_m: &thickness,
        cosine: options.cosine,
        degenerate_below: options.degenerate_below,
    };
    let (lo, hi) = garment.bounds().unwrap_or_default();

    let forces = parts.map(|k, part| {
        let s = &sums[k];
        let gravity = DVec3::new(0.0, 0.0, GRAVITY * mass_density * s.volume + GRAVITY * s.excess_mass);
        let anti_force = if s.contact { body_force * s.body } else { DVec3::ZERO };
        let line_force = match options.line_force {
            LineForce::Given(value) => value,
            LineForce::FromMembrane => strip.line_force(&part.vertices, hi.z, hi.z - lo.z),
        };
        let mut forces = PartForces {
            level: part.level,
            vertices: part.vertices.len(),
            area_m2: s.area,
            gravity,
            anti_force,
            line_force,
            contact: s.contact,
            ..PartForces::default()
        };
        balance(&mut forces, s, options);
        forces
    });
    let displacement = |p: u32| forces.get(p as usize).map_or(DVec3::ZERO, |f| f.displacement);
    let moved = garment.positions.iter().zip(&parts.part_of_vertex).map(|(&x, &p)| x + displacement(p));
    let mut positions: Vec<DVec3> = moved.collect();
    let projected = project_outside(body, &mut positions, &thickness);

    let degenerate_parts = forces.iter().filter(|f| f.degenerate.contains(&true)).count();
    if degenerate_parts > 0 {
        warnings.push(PaperWarning::Degenerate { parts: degenerate_parts });
    }
    if !forces.is_empty() && forces.iter().all(|f| f.degenerate[2]) {
        warnings.push(PaperWarning::NoVerticalStiffness);
    }
    let lengths = || forces.iter().map(|f| f.displacement.length());
    let exploded = lengths().filter(|&d| d > lo.distance(hi)).count();
    if exploded > 0 {
        warnings.push(PaperWarning::Explodes { parts: exploded, largest_m: lengths().fold(0.0, f64::max) });
    }
    if projected.left_inside > 0 {
        warnings.push(PaperWarning::Penetrating { vertices: projected.left_inside });
    }
    let inside = surface.iter().filter(|s| s.signed_distance < 0.0).count();
    Ok(PaperResult {
        seam_jumps_m: parts.seams.iter().map(|s| displacement(s.parts[0]).distance(displacement(s.parts[1]))).collect(),
        positions,
        weight_n,
        body_force,
        contact_parts,
        degenerate_parts,
        floored_vertices: if options.clearance == Clearance::PlusThickness { inside } else { 0 },
        projected_vertices: projected.moved,
        penetrating_vertices: projected.left_inside,
        warnings,
        parts: forces,
    })
}

fn check(
    garment: &TriMesh,
    surface: &[SurfacePoint],
    parts: &Parts,
    fabrics: &[Fabric],
    options: &PaperOptions,
) -> Result<(), PaperError> {
    let expected = garment.vertex_count();
    for (what, found) in [("the list of nearest body points", surface.len()), ("PARTs", parts.part_of_vertex.len())] {
        if found != expected {
            return Err(PaperError::Length { what, found, expected });
        }
    }
    let of_fabrics = fabrics.iter().flat_map(|fabric| {
        [
            ("thickness in m", fabric.thickness_m),
            ("areal density in kg/m²", fabric.density_kg_per_m2),
            ("warp stiffness in N/m", fabric.stretch_warp_n_per_m),
        ]
    });
    for (what, found) in of_fabrics.chain([
        ("contact distance in m", options.contact_distance_m),
        ("smallest share of stiffness", options.degenerate_below),
    ]) {
        if !(found.is_finite() && found > 0.0) {
            return Err(PaperError::Constant { what, found });
        }
    }
    if let BodyForce::Given(found) = options.body_force
        && !found.is_finite()
    {
        return Err(PaperError::Constant { what: "force density q_f in N/m³", found });
    }
    if let LineForce::Given(found) = options.line_force
        && !(found.is_finite() && found > 0.0)
    {
        return Err(PaperError::Constant { what: "line force coefficient p_f in N/m⁵", found });
    }
    Ok(())
}

/// The sums of (2) over one PART, before p_f and q_f.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sums {
    /// Barycentric area, m².
    area: f64,
    /// Σ ΔV, m³.
    volume: f64,
    /// Mass minus that of this volume in the fabric of the first vertex, kg.
    excess_mass: f64,
    /// Σ (cos α_q, cos β_q, cos γ_q) ΔV, m³.
    body: DVec3,
    /// Σ (cos α_p, cos β_p, cos γ_p) q ΔV, m⁴.
    garment: DVec3,
    /// Σ |q| ΔV, m⁴: the value of `garment` for a normal along the axis.
    largest: f64,
    /// Whether a vertex is within the contact distance.
    contact: bool,
}

/// Solves (6) and (7), or (9) without contact, from the F⁰, F¹ and p_f of a PART.
fn balance(part: &mut PartForces, sums: &Sums, options: &PaperOptions) {
    let rises = !sums.contact && options.contactless == Contactless::AsPrinted;
    let load = if rises { part.gravity } else { part.anti_force - part.gravity };
    for axis in 0..3 {
        if sums.garment[axis].abs() <= options.degenerate_below * sums.largest {
            // Without contact (9) needs no stiffness along x and y.
            part.degenerate[axis] = sums.contact || axis == 2;
            continue;
        }
        part.stiffness[axis] = part.line_force * sums.garment[axis];
        part.displacement[axis] = load[axis] / part.stiffness[axis];
        // F² = D Fᵃ equals the load; in this form it also holds for a PART that is held (Fᵃ infinite).
        part.adjacent[axis] = load[axis];
    }
    part.resultant = part.gravity + part.anti_force + part.adjacent;
}

/// ΔV of equations (2) and (7) for every vertex, m³; `areas` are the barycentric vertex areas in m².
fn volumes(garment: &TriMesh, topology: &Topology, areas: &[f64], thickness_m: &[f64], reading: Volume) -> Vec<f64> {
    match reading {
        Volume::AreaTimesThickness => areas.iter().zip(thickness_m).map(|(a, t)| a * t).collect(),
        Volume::Cuboid => (0..garment.vertex_count() as u32).map(|v| cuboid(garment, topology, v)).collect(),
    }
}

/// Mean |Δx| times mean |Δy| times mean |Δz| to the neighbours; zero for a vertex without any.
fn cuboid(garment: &TriMesh, topology: &Topology, v: u32) -> f64 {
    let neighbours = topology.neighbours(v);
    let x = garment.positions[v as usize];
    let sum: DVec3 = neighbours.iter().map(|&w| (garment.positions[w as usize] - x).abs()).sum();
    let mean = sum / neighbours.len().max(1) as f64;
    mean.x * mean.y * mean.z
}

/// Number of vertices moved, and of those that remain inside.
struct Projected {
    moved: usize,
    left_inside: usize,
}

/// Moves every position inside the body to its nearest surface point plus its thickness (m) along the outward normal.
fn project_outside(body: &Body, positions: &mut [DVec3], thickness_m: &[f64]) -> Projected {
    let project = |(x, thickness_m): (&mut DVec3, &f64)| {
        let mut near = body.nearest(*x);
        let moved = near.signed_distance < 0.0;
        for _ in 0..MAX_PROJECTIONS {
            if near.signed_distance >= 0.0 {
                break;
            }
            *x = near.point + *thickness_m * near.normal;
            near = body.nearest(*x);
        }
        (moved, near.signed_distance < 0.0)
    };
    let found: Vec<(bool, bool)> = positions.par_iter_mut().with_min_len(256).zip(thickness_m).map(project).collect();
    Projected { moved: found.iter().filter(|f| f.0).count(), left_inside: found.iter().filter(|f| f.1).count() }
}
