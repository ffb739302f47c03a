//! Fit: how a garment pulls and presses where it is worn.
//!
//! Strain is the stretch along weft and warp, s_u = |F_u| − 1 and s_v = |F_v| − 1, and the principal stretch, the largest
//! singular value of F less one, with F = [F_u F_v] the deformation gradient of a triangle. Pressure is the contact
//! force of a vertex over its rest area, κ (h − q).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s_u, s_v | strain along weft and warp | percent |
//! | p | pressure on the body | kPa |
//!
//! Limits: pressure is taken where the vertices are; on a bony edge finer than the mesh it is a mean.

use glam::DVec3;

use super::energy::{Cloth, Contacts};

/// What a try-on shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Strain of each triangle along the weft, percent; negative where slack.
    pub strain_weft_percent: Vec<f64>,
    /// Strain of each triangle along the warp, percent.
    pub strain_warp_percent: Vec<f64>,
    /// Largest principal strain of each triangle, percent.
    pub strain_percent: Vec<f64>,
    /// 95th percentile of the largest principal strains, by rest area, percent.
    pub strain_p95_percent: f64,
    /// Their maximum, percent.
    pub strain_max_percent: f64,
    /// Pressure of each vertex on the body, kPa; zero where it does not touch.
    pub pressure_kpa: Vec<f64>,
    /// Greatest pressure, kPa.
    pub pressure_max_kpa: f64,
}

/// The fit of `cloth` at positions `x` (m); `contacts` must have been updated there.
#[must_use]
pub fn fit(cloth: &Cloth, x: &[DVec3], contacts: &Contacts) -> Fit {
    let deformations: Vec<[DVec3; 2]> = cloth.triangles.iter().map(|t| t.deformation(x)).collect();
    let percent = |stretch: f64| 100.0 * (stretch - 1.0);
    let strain_percent: Vec<f64> = deformations.iter().map(|&[u, v]| percent(largest_stretch(u, v))).collect();
    let mut by_strain: Vec<(f64, f64)> =
        strain_percent.iter().copied().zip(cloth.triangles.iter().map(|t| t.area)).collect();
    by_strain.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = by_strain.iter().map(|(_, area)| area).sum();
    let mut below = 0.0;
    let p95 = by_strain.iter().find(|(_, area)| {
        below += area;
        below >= 0.95 * whole
    });
    let mut pressure_kpa = vec![0.0; x.len()];
    for touch in contacts.touches() {
        let v = touch.vertex as usize;
        pressure_kpa[v] = 1e-3 * touch.force() / cloth.areas[v];
    }
    Fit {
        strain_weft_percent: deformations.iter().map(|[u, _]| percent(u.length())).collect(),
        strain_warp_percent: deformations.iter().map(|[_, v]| percent(v.length())).collect(),
        strain_p95_percent: p95.map_or(0.0, |(strain, _)| *strain),
        strain_max_percent: by_strain.last().map_or(0.0, |(strain, _)| *strain),
        pressure_max_kpa: pressure_kpa.iter().copied().fold(0.0, f64::max),
        strain_percent,
        pressure_kpa,
    }
}

/// Per vertex, the mean of a triangle quantity over the triangles at it, weighted by rest area; zero at a vertex of none.
#[must_use]
pub fn at_vertices(cloth: &Cloth, of_triangles: &[f64]) -> Vec<f64> {
    let mut sum = vec![(0.0, 0.0); cloth.vertex_count()];
    for (triangle, value) in cloth.triangles.iter().zip(of_triangles) {
        for v in triangle.vertices {
            let (total, area) = &mut sum[v as usize];
            *total += value * triangle.area;
            *area += triangle.area;
        }
    }
    sum.into_iter().map(|(total, area)| if area > 0.0 { total / area } else { 0.0 }).collect()
}

/// Largest principal strain of a triangle with deformation gradient [u v]: its largest singular value, less one.
#[must_use]
pub fn principal_strain([u, v]: [DVec3; 2]) -> f64 {
    largest_stretch(u, v) - 1.0
}

/// Largest singular value of [u v].
fn largest_stretch(u: DVec3, v: DVec3) -> f64 {
    let (a, b, c) = (u.length_squared(), v.length_squared(), u.dot(v));
    (0.5 * (a + b) + (0.5 * (a - b)).hypot(c)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_shear_stretches_the_bias() {
        // Weft and warp keep their length at 60 degrees to each other: the long diagonal stretches to √(1 + cos 60°).
        let (u, v) = (DVec3::X, DVec3::new(0.5, 0.75f64.sqrt(), 0.0));
        assert!((largest_stretch(u, v) - 1.5f64.sqrt()).abs() < 1e-12);
        assert!((largest_stretch(DVec3::X * 1.1, DVec3::Y * 0.9) - 1.1).abs() < 1e-12);
    }
}
