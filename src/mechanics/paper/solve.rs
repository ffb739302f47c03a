//! The sums of equation (2) over every PART, the coefficients, the balance of each, and the displaced garment.

use glam::DVec3;

use super::balance::{Sums, balance};
use super::calibrate::{HangingStrip, clearance, share};
use super::outside::put_outside;
use super::volume::volumes;
use super::{
    BodyForce, Clearance, LineForce, PaperError, PaperOptions, PaperResult, PaperWarning, PartForces, Untouched,
};
use crate::GRAVITY;
use crate::distance::{Body, SurfacePoint};
use crate::fabric::Fabric;
use crate::mesh::{Topology, TriMesh};
use crate::parts::{Part, Parts};

/// Displaces every PART by equations (2) to (9). `surface` is the nearest body point of each garment vertex; vertices in no PART
/// stay where they are, unless that is inside the body.
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
    check(garment, surface, parts, fabric, options)?;
    let thickness = fabric.thickness_m;
    let areas = garment.vertex_areas();
    let normals = garment.vertex_normals();
    let volume = volumes(garment, topology, &areas, thickness, options.volume);
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
            let q = clearance(surface[v].signed_distance, thickness, options.clearance);
            sums.area += areas[v];
            sums.volume += volume[v];
            sums.body += surface[v].normal * volume[v];
            sums.garment += share(normals[v], options.cosine) * (q * volume[v]);
            sums.largest += q.abs() * volume[v];
            sums.contact |= surface[v].signed_distance <= contact_m;
        }
        sums
    };
    let sums = parts.map(sum_part);

    let mass_density = fabric.density_kg_per_m2 / thickness;
    let weight_n = GRAVITY * mass_density * volume.iter().sum::<f64>();
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
        stiffness: fabric.stretch_warp_n_per_m,
        thickness_m: thickness,
        cosine: options.cosine,
        degenerate_below: options.degenerate_below,
    };
    let (lo, hi) = garment.bounds().unwrap_or_default();

    let forces = parts.map(|k, part| {
        let s = &sums[k];
        let gravity = DVec3::new(0.0, 0.0, GRAVITY * mass_density * s.volume);
        let anti_force = if s.contact { body_force * s.body } else { DVec3::ZERO };
        let line_force = match options.line_force {
            LineForce::Given(value) => value,
            LineForce::FromMembrane => strip.line_force(&part.vertices, hi.z, hi.z - lo.z),
        };
        let b = balance(s, gravity, anti_force, line_force, options.contactless, options.degenerate_below);
        PartForces {
            level: part.level,
            vertices: part.vertices.len(),
            area_m2: s.area,
            gravity,
            anti_force,
            adjacent: b.adjacent,
            stiffness: b.stiffness,
            resultant: gravity + anti_force + b.adjacent,
            displacement: b.displacement,
            line_force,
            contact: s.contact,
            degenerate: b.degenerate,
        }
    });
    let displacement = |p: u32| forces.get(p as usize).map_or(DVec3::ZERO, |f| f.displacement);
    let moved = garment.positions.iter().zip(&parts.part_of_vertex).map(|(&x, &p)| x + displacement(p));
    let mut positions: Vec<DVec3> = moved.collect();
    let projected = put_outside(body, &mut positions, thickness);

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
    fabric: &Fabric,
    options: &PaperOptions,
) -> Result<(), PaperError> {
    let expected = garment.vertex_count();
    for (what, found) in [("the list of nearest body points", surface.len()), ("PARTs", parts.part_of_vertex.len())] {
        if found != expected {
            return Err(PaperError::Length { what, found, expected });
        }
    }
    for (what, found) in [
        ("thickness in m", fabric.thickness_m),
        ("areal density in kg/m²", fabric.density_kg_per_m2),
        ("warp stiffness in N/m", fabric.stretch_warp_n_per_m),
        ("contact distance in m", options.contact_distance_m),
        ("smallest share of stiffness", options.degenerate_below),
    ] {
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
