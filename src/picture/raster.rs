//! Triangles to samples: the nearest surface seen through each point of a grid, by a depth buffer.
//!
//! A point p is seen from the eye e = c + D t, c the centre of the view and t the unit vector towards the eye, at
//!
//! x = D (p − c)·r / w,  y = D (p − c)·u / w,  w = D − (p − c)·t
//!
//! in metres of the plane through c. Attributes are interpolated linearly in space, which is in proportion to 1/w on the grid.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | D | distance of the eye from the centre | m |
//! | r, u, t | unit vectors to the right, up and to the eye | – |
//! | w | distance from the eye along the view | m |
//!
//! Limits: triangles that reach nearer than a tenth of D to the eye are left out, not clipped. Each band of rows is filled by one thread
//! in the order of the triangles, so that the samples do not depend on the number of threads.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::mesh::TriMesh;
use crate::picture::colour::map::Rgb;

/// Rows of samples that one thread fills at a time.
const BAND: usize = 64;

/// Colours of a surface.
#[derive(Debug, Clone)]
pub(super) enum Paint {
    /// One colour.
    Plain(Rgb),
    /// A colour per vertex, blended over the triangles.
    Blended(Vec<Rgb>),
    /// A colour per vertex, which reaches up to halfway to the next vertex with a sharp border.
    Cells(Vec<Rgb>),
}

/// A surface to draw.
#[derive(Debug, Clone)]
pub(super) struct Surface<'a> {
    pub(super) triangles: &'a [[u32; 3]],
    /// Positions, m.
    pub(super) positions: &'a [DVec3],
    pub(super) normals: Vec<DVec3>,
    pub(super) paint: Paint,
}

impl<'a> Surface<'a> {
    pub(super) fn new(mesh: &'a TriMesh, paint: Paint) -> Self {
        Self { triangles: &mesh.triangles, positions: &mesh.positions, normals: mesh.vertex_normals(), paint }
    }
}

/// A grid of samples in front of an eye.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    /// Centre of the view, m.
    pub(super) centre: DVec3,
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    pub(super) toward: DVec3,
    /// D, m.
    pub(super) distance: f64,
    /// Samples per metre in the plane through the centre.
    pub(super) scale: f64,
    /// Columns and rows of samples.
    pub(super) size: [usize; 2],
}

/// A vertex on the grid: column, row, and w in m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projected {
    pub(super) at: DVec2,
    pub(super) w: f64,
}

impl Camera {
    /// A camera that looks along −`toward`, z up in the view.
    pub(super) fn new(centre: DVec3, toward: DVec3, distance: f64, scale: f64, size: [usize; 2]) -> Self {
        let toward = toward.try_normalize().unwrap_or(DVec3::NEG_Y);
        // From straight above or below, the view's upper side is +y.
        let right = DVec3::Z.cross(toward).try_normalize().unwrap_or(DVec3::X);
        Self { centre, right, up: toward.cross(right), toward, distance, scale, size }
    }

    pub(super) fn project(&self, p: DVec3) -> Projected {
        let from = p - self.centre;
        let w = self.distance - from.dot(self.toward);
        let factor = self.scale * self.distance / w;
        let [columns, rows] = self.size.map(|n| 0.5 * n as f64);
        Projected { at: DVec2::new(columns + factor * from.dot(self.right), rows - factor * from.dot(self.up)), w }
    }
}

/// The surface at one point of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// Distance from the eye along the view, m; infinite where there is no surface.
    pub(super) w: f32,
    /// Unit normal in the axes of the view (right, up, towards the eye).
    pub(super) normal: [f32; 3],
    pub(super) colour: Rgb,
    /// Whether the inner side is seen.
    pub(super) inner: bool,
}

impl Sample {
    const NOTHING: Self = Self { w: f32::INFINITY, normal: [0.0, 0.0, 1.0], colour: [255; 3], inner: false };

    pub(super) fn is_nothing(&self) -> bool {
        self.w == f32::INFINITY
    }
}

/// A triangle on the grid.
struct Flat<'a> {
    surface: &'a Surface<'a>,
    corners: [u32; 3],
    on_grid: [Projected; 3],
    /// Twice the signed area, in samples.
    area: f64,
}

/// The nearest surface at every point of the grid, row by row.
pub(super) fn rasterise(surfaces: &[Surface<'_>], camera: &Camera) -> Vec<Sample> {
    let [columns, rows] = camera.size;
    let mut samples = vec![Sample::NOTHING; columns * rows];
    let projected: Vec<Vec<Projected>> =
        surfaces.iter().map(|s| s.positions.par_iter().map(|&p| camera.project(p)).collect()).collect();
    let flat = surfaces.iter().zip(&projected).flat_map(|(surface, projected)| {
        surface.triangles.iter().filter_map(move |&corners| {
            let on_grid = corners.map(|v| projected[v as usize]);
            let [a, b, c] = on_grid.map(|p| p.at);
            let area = (b - a).perp_dot(c - a);
            let near = on_grid.iter().any(|p| p.w < 0.1 * camera.distance);
            (area != 0.0 && area.is_finite() && !near).then_some(Flat { surface, corners, on_grid, area })
        })
    });
    let flat: Vec<Flat<'_>> = flat.collect();
    samples.par_chunks_mut(BAND * columns.max(1)).enumerate().for_each(|(band, samples)| {
        let first = BAND * band;
        let rows = samples.len() / columns.max(1);
        flat.iter().for_each(|triangle| triangle.fill(camera, samples, columns, first..first + rows));
    });
    samples
}

impl Flat<'_> {
    /// Fills its samples in these rows, where it is nearest.
    fn fill(&self, camera: &Camera, samples: &mut [Sample], columns: usize, rows: std::ops::Range<usize>) {
        let at = self.on_grid.map(|p| p.at);
        let low = at[0].min(at[1]).min(at[2]);
        let high = at[0].max(at[1]).max(at[2]);
        // Samples lie in the middle of their squares.
        let first = |x: f64, least: usize| ((x - 0.5).ceil().max(0.0) as usize).max(least);
        let last = |x: f64, most: usize| ((x + 0.5).floor().max(0.0) as usize).min(most);
        for row in first(low.y, rows.start)..last(high.y, rows.end) {
            for column in first(low.x, 0)..last(high.x, columns) {
                let p = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let opposite = |i: usize, j: usize| (at[j] - at[i]).perp_dot(p - at[i]) / self.area;
                let share = [opposite(1, 2), opposite(2, 0), opposite(0, 1)];
                if share.iter().any(|&s| s < 0.0) {
                    continue;
                }
                // In space: shares over w, normalised.
                let by_w = [0, 1, 2].map(|k| share[k] / self.on_grid[k].w);
                let w = 1.0 / (by_w[0] + by_w[1] + by_w[2]);
                let sample = &mut samples[(row - rows.start) * columns + column];
                if w as f32 >= sample.w {
                    continue;
                }
                *sample = self.sample(camera, by_w.map(|b| b * w), w);
            }
        }
    }

    /// The surface at barycentric coordinates `share`.
    fn sample(&self, camera: &Camera, share: [f64; 3], w: f64) -> Sample {
        let normals = self.corners.map(|v| self.surface.normals[v as usize]);
        let normal = normals[0] * share[0] + normals[1] * share[1] + normals[2] * share[2];
        // Rows count downwards, so that a triangle seen from outside has a negative area.
        let inner = self.area > 0.0;
        let facing = normal.normalize_or(camera.toward) * if inner { -1.0 } else { 1.0 };
        let normal = [camera.right, camera.up, camera.toward].map(|axis| facing.dot(axis) as f32);
        let colour = match &self.surface.paint {
            Paint::Plain(colour) => *colour,
            Paint::Blended(colours) => {
                let of = self.corners.map(|v| colours[v as usize]);
                [0, 1, 2].map(|k| (0..3).map(|i| share[i] * f64::from(of[i][k])).sum::<f64>().round() as u8)
            }
            Paint::Cells(colours) => {
                let largest = if share[0] >= share[1] && share[0] >= share[2] {
                    0
                } else if share[1] >= share[2] {
                    1
                } else {
                    2
                };
                colours[self.corners[largest] as usize]
            }
        };
        Sample { w: w as f32, normal, colour, inner }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;

    fn camera(distance: f64) -> Camera {
        Camera::new(DVec3::ZERO, DVec3::NEG_Y, distance, 100.0, [100, 80])
    }

    #[test]
    fn a_cube_covers_the_square_of_its_near_face_and_hides_the_rest() {
        let cube = cuboid(DVec3::splat(-0.1), DVec3::splat(0.1));
        let samples = rasterise(&[Surface::new(&cube, Paint::Plain([1, 2, 3]))], &camera(2.0));
        let covered = samples.iter().filter(|s| !s.is_nothing()).count();
        // The near face, 1.9 m away, is 100 * 0.2 * 2 / 1.9 = 21.05 samples wide.
        let expected = (100.0 * 0.2 * 2.0 / 1.9_f64).powi(2);
        assert!((covered as f64 - expected).abs() < 42.0, "{covered} for {expected}");
        let middle = samples[40 * 100 + 50];
        assert!((middle.w - 1.9).abs() < 1e-6 && !middle.inner && middle.colour == [1, 2, 3], "{middle:?}");
    }

    #[test]
    fn the_nearer_of_two_surfaces_is_seen_in_either_order() {
        let [near, far] = [-0.3, 0.3].map(|y| cuboid(DVec3::new(-0.1, y, -0.1), DVec3::new(0.1, y + 0.1, 0.1)));
        let paint = |mesh, colour| Surface::new(mesh, Paint::Plain(colour));
        let seen = |surfaces: [Surface<'_>; 2]| rasterise(&surfaces, &camera(2.0))[40 * 100 + 50].colour;
        assert_eq!(seen([paint(&near, [9; 3]), paint(&far, [5; 3])]), [9; 3]);
        assert_eq!(seen([paint(&far, [5; 3]), paint(&near, [9; 3])]), [9; 3]);
    }

    #[test]
    fn cells_have_a_sharp_border_halfway_and_blended_colours_none() {
        let mesh = TriMesh::new(
            vec![DVec3::new(-0.3, 0.0, -0.3), DVec3::new(0.3, 0.0, -0.3), DVec3::new(0.0, 0.0, 0.3)],
            vec![[0, 1, 2]],
        );
        let colours = vec![[0; 3], [200; 3], [100; 3]];
        let row = |paint| {
            let samples = rasterise(&[Surface::new(&mesh, paint)], &camera(50.0));
            (25..75).map(|column| samples[68 * 100 + column].colour[0]).collect::<Vec<u8>>()
        };
        let cells = row(Paint::Cells(colours.clone()));
        assert!(cells[..24].iter().all(|&c| c == 0) && cells[26..].iter().all(|&c| c == 200), "{cells:?}");
        let blended = row(Paint::Blended(colours));
        assert!(blended.windows(2).all(|pair| pair[0] <= pair[1] && pair[1] - pair[0] < 8), "{blended:?}");
    }
}
