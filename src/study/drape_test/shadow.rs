//! The shadow of a drape seen from above: the area of the union of its triangles, on a grid.

use glam::DVec2;

use crate::mesh::TriMesh;

/// Side of a cell, m. The outline is shorter than 1 m, so the area is exact to 2.5 cm² even if all cells on the outline are misclassified
/// alike: 0.5 % of the coefficient. Halving it quadruples the time.
const CELL: f64 = 2.5e-4;

/// Area of the shadow of `drape` along z together with a full disc of radius `disc` (m) about the origin, m².
pub(crate) fn shadow_area(drape: &TriMesh, disc: f64) -> f64 {
    let reach = drape.positions.iter().map(|p| p.x.abs().max(p.y.abs())).fold(disc, f64::max);
    let half = (reach / CELL).ceil() as i64 + 1;
    let side = 2 * half as usize;
    let mut dark = vec![false; side * side];
    let centre = |i: i64| (i as f64 + 0.5) * CELL;
    let column = |x: f64| ((x / CELL).floor() as i64).clamp(-half, half - 1);
    for t in 0..drape.triangles.len() {
        let [a, b, c] = drape.corners(t).map(glam::DVec3::truncate);
        let area = (b - a).perp_dot(c - a);
        let [b, c] = if area < 0.0 { [c, b] } else { [b, c] };
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        for j in column(lo.y)..=column(hi.y) {
            for i in column(lo.x)..=column(hi.x) {
                let p = DVec2::new(centre(i), centre(j));
                let inside = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p) >= 0.0;
                if inside(a, b, p) && inside(b, c, p) && inside(c, a, p) {
                    dark[(j + half) as usize * side + (i + half) as usize] = true;
                }
            }
        }
    }
    let on_disc = |i: i64, j: i64| DVec2::new(centre(i), centre(j)).length() <= disc;
    let count = (-half..half)
        .flat_map(|j| (-half..half).map(move |i| (i, j)))
        .filter(|&(i, j)| dark[(j + half) as usize * side + (i + half) as usize] || on_disc(i, j))
        .count();
    count as f64 * CELL * CELL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::drape_test::specimen::specimen;
    use crate::study::drape_test::standards::DrapeTest;

    #[test]
    fn the_shadow_of_a_flat_specimen_has_its_area() {
        let test = DrapeTest::default();
        let area = shadow_area(&specimen(&test).mesh, test.disc_m);
        let circle = std::f64::consts::PI * test.specimen_m * test.specimen_m;
        assert!((area / circle - 1.0).abs() < 3e-3, "{area} for {circle}");
    }
}
