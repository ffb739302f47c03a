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
use crate::body::distance::{Body, SurfacePoint};
use crate::garment::fabric::{Fabric, at_vertices};
use crate::mesh::{RestShape, Topology, TriMesh};
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
    let rest = RestShape::new(Vec::new());
    let fabrics = std::slice::from_ref(fabric);
    solve_cut(garment, topology, body, surface, parts, &Cut { rest: &rest, fabrics }, options)
}

/// What a garment is cut from.
#[derive(Debug, Clone, Copy)]
pub struct Cut<'a> {
    /// Its rest shape, which says which triangle is of which fabric.
    pub rest: &'a RestShape,
    /// The fabrics.
    pub fabrics: &'a [Fabric],
}

/// [`solve`] for a garment of several fabrics: each vertex has the mean of those about it, and p_f of a PART is that of a strip with the
/// PART's mean stiffness and density throughout.
///
/// # Errors
/// As there.
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
    // Masses as those of the first vertex's fabric and what the others have more: of one fabric nothing.
    let mass_density = per_volume.first().copied().unwrap_or_default();
    let more = |v: usize| (per_volume[v] - mass_density) * volume[v];
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
            sums.more += more(v);
            sums.body += surface[v].normal * volume[v];
            sums.garment += share(normals[v], options.cosine) * (q * volume[v]);
            sums.largest += q.abs() * volume[v];
            sums.contact |= surface[v].signed_distance <= contact_m;
        }
        sums
    };
    let sums = parts.map(sum_part);

    let all_more = (0..volume.len()).map(more).sum::<f64>();
    let weight_n = GRAVITY * mass_density * volume.iter().sum::<f64>() + GRAVITY * all_more;
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
        let gravity = DVec3::new(0.0, 0.0, GRAVITY * mass_density * s.volume + GRAVITY * s.more);
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
    let projected = put_outside(body, &mut positions, &thickness);

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
