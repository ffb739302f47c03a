//! Light on samples, and their mean over pixels.
//!
//! A sample's colour (linear RGB) is multiplied by
//!
//! L = A (a + h n·u + f max(0, n·m)) + s k max(0, n·l),
//!
//! ambient light that is stronger from above, a key light from the upper left in front, and a fill light from the right. A, the
//! ambient visibility, is the mean over nearby samples of 1 − max(0, n·v − bias)(1 − |v|²/R²), v the vector to the surface there
//! (after Bavoil, Sainz: "Image-space horizon-based ambient occlusion", SIGGRAPH 2008): folds and armpits darken. s is the share of the
//! key light that is not blocked, from a depth buffer seen along it. Borders to a farther surface get a dark line.
//!
//! | symbol | meaning |
//! |---|---|
//! | n, u, l, m | unit normal, up, directions to key and fill light, in the axes of the view |
//! | a, h, k, f | strengths of the lights |
//! | R | reach of the ambient shadow, m |
//!
//! Limits: one bounce of light, no reflections; what the eye does not see casts no ambient shadow. Elementary functions come from
//! `base::math`, so that pixels are the same everywhere.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::raster::{Camera, Sample, Surface, rasterise};
use crate::base::math;
use crate::picture::colour::map::Rgb;

/// Samples along each side of a pixel: 9 a pixel leave no visible steps on silhouettes.
pub(super) const SAMPLES: usize = 3;

/// Directions to key and fill light: right, up, towards the eye. Heuristics, as all strengths below.
const KEY: Vec3 = Vec3::new(-0.46, 0.62, 0.64);
const FILL: Vec3 = Vec3::new(0.76, 0.1, 0.64);
const AMBIENT: f32 = 0.36;
const FROM_ABOVE: f32 = 0.12;
const KEY_LIGHT: f32 = 0.62;
const FILL_LIGHT: f32 = 0.14;
/// Factor of the inner side of a cloth.
const INNER: f32 = 0.62;
/// R, m, and the samples taken in it.
const REACH_M: f32 = 0.07;
const AROUND: usize = 20;
/// Cosine above the tangent plane from which a neighbour darkens.
const HORIZON: f32 = 0.08;
/// Strength of the ambient shadow.
const DARKENING: f32 = 1.9;
/// Step in depth that draws a line, m, and the factor of the colour there.
const LINE_STEP_M: f32 = 0.012;
const LINE: f32 = 0.45;
/// Side of the key light's depth buffer, and the distance behind its surface from which a sample is in shadow, m.
const SHADOW_SIZE: usize = 1400;
const SHADOW_BIAS_M: f64 = 0.007;
/// Distance of the key light, m: its rays are almost parallel.
const KEY_DISTANCE_M: f64 = 60.0;

/// Linear values of the 256 codes of sRGB (IEC 61966-2-1).
fn linear_of_codes() -> [f32; 256] {
    std::array::from_fn(|code| {
        let v = code as f64 / 255.0;
        let linear = if v <= 0.040_45 { v / 12.92 } else { math::powf((v + 0.055) / 1.055, 2.4) };
        linear as f32
    })
}

/// Codes of linear values in steps of 1/4095.
fn codes_of_linear() -> Vec<u8> {
    let code = |i: u32| {
        let linear = f64::from(i) / 4095.0;
        let v = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * math::powf(linear, 1.0 / 2.4) - 0.055 };
        (255.0 * v).round() as u8
    };
    (0..4096).map(code).collect()
}

/// The key light's depth buffer.
struct Shadow {
    camera: Camera,
    samples: Vec<Sample>,
}

impl Shadow {
    fn new(surfaces: &[Surface<'_>], view: &Camera) -> Self {
        let Vec3 { x, y, z } = KEY;
        let toward = view.right * f64::from(x) + view.up * f64::from(y) + view.toward * f64::from(z);
        let points = || surfaces.iter().flat_map(|s| s.positions.iter().copied());
        let radius = points().map(|p| p.distance(view.centre)).fold(1e-3, f64::max);
        let scale = 0.5 * SHADOW_SIZE as f64 / radius;
        let camera = Camera::new(view.centre, toward, KEY_DISTANCE_M + radius, scale, [SHADOW_SIZE; 2]);
        Self { samples: rasterise(surfaces, &camera), camera }
    }

    /// Share of the key light at a point with normal n, over nine samples of the buffer.
    fn light_at(&self, p: DVec3, slope: f64) -> f32 {
        let seen = self.camera.project(p);
        let bias = SHADOW_BIAS_M * (1.0 + slope);
        let lit = |[dx, dy]: [i32; 2]| {
            let [x, y] = [seen.at.x as i32 + 2 * dx, seen.at.y as i32 + 2 * dy];
            let within = (0..SHADOW_SIZE as i32).contains(&x) && (0..SHADOW_SIZE as i32).contains(&y);
            !within || f64::from(self.samples[y as usize * SHADOW_SIZE + x as usize].w) > seen.w - bias
        };
        let all = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [dx, dy]));
        all.filter(|&d| lit(d)).count() as f32 / 9.0
    }
}

/// Offsets of a spiral in the unit disc by the golden angle: even, and the same for every sample.
fn spiral() -> [[f32; 2]; AROUND] {
    std::array::from_fn(|i| {
        let radius = ((i as f64 + 0.5) / AROUND as f64).sqrt();
        let (sin, cos) = math::sin_cos(2.399_963_229_728_653 * i as f64);
        [(radius * cos) as f32, (radius * sin) as f32]
    })
}

/// Draws surfaces as seen by a camera whose size is in samples; returns pixels row by row, white where there is no surface.
pub(super) fn draw(surfaces: &[Surface<'_>], camera: &Camera, lit: bool) -> Vec<Rgb> {
    let samples = rasterise(surfaces, camera);
    let shadow = lit.then(|| Shadow::new(surfaces, camera));
    let (linear, codes, spiral) = (linear_of_codes(), codes_of_linear(), spiral());
    let grid = Grid { samples: &samples, camera, shadow: shadow.as_ref(), spiral };
    let [columns, rows] = camera.size.map(|n| n / SAMPLES);
    let pixel = |at: usize| {
        let [column, row] = [at % columns, at / columns];
        let mut sum = Vec3::ZERO;
        // Within a pixel the light that is not blocked varies little, except at a border.
        let mut reached: Option<(f32, Reached)> = None;
        for (dy, dx) in (0..SAMPLES).flat_map(|dy| (0..SAMPLES).map(move |dx| (dy, dx))) {
            let at = [column * SAMPLES + dx, row * SAMPLES + dy];
            let sample = grid.at(at);
            sum += if sample.is_nothing() {
                Vec3::ONE
            } else {
                let known = reached.filter(|(w, _)| (w - sample.w).abs() < LINE_STEP_M).map(|(_, known)| known);
                let known = known.unwrap_or_else(|| grid.reached(at, sample));
                reached = Some((sample.w, known));
                let colour = Vec3::from(sample.colour.map(|code| linear[usize::from(code)]));
                (colour * grid.light(at, sample, known)).min(Vec3::ONE)
            };
        }
        let mean = sum / (SAMPLES * SAMPLES) as f32;
        mean.to_array().map(|v| codes[(v.clamp(0.0, 1.0) * 4095.0).round() as usize])
    };
    (0..columns * rows).into_par_iter().map(pixel).collect()
}

/// The light that is not blocked: A and s.
#[derive(Debug, Clone, Copy)]
struct Reached {
    open: f32,
    key: f32,
}

/// The samples of a view with what lights them.
struct Grid<'a> {
    samples: &'a [Sample],
    camera: &'a Camera,
    shadow: Option<&'a Shadow>,
    spiral: [[f32; 2]; AROUND],
}

impl Grid<'_> {
    fn at(&self, [column, row]: [usize; 2]) -> &Sample {
        &self.samples[row * self.camera.size[0] + column]
    }

    /// The sample at an offset, if it is on the grid.
    fn beside(&self, at: [usize; 2], by: [i32; 2]) -> Option<&Sample> {
        let [column, row] = [0, 1].map(|k| at[k] as i64 + i64::from(by[k]));
        let [columns, rows] = self.camera.size.map(|n| n as i64);
        let within = (0..columns).contains(&column) && (0..rows).contains(&row);
        within.then(|| &self.samples[(row * columns + column) as usize])
    }

    /// The light that is not blocked at a sample.
    fn reached(&self, at: [usize; 2], sample: &Sample) -> Reached {
        let Some(shadow) = self.shadow else { return Reached { open: 1.0, key: 1.0 } };
        let normal = Vec3::from(sample.normal);
        let toward_key = normal.dot(KEY.normalize());
        let slope = 2.0 * f64::from(1.0 - toward_key);
        let key = if toward_key > 0.0 { shadow.light_at(self.point(at, sample), slope) } else { 0.0 };
        Reached { open: self.ambient(at, sample, normal), key }
    }

    /// L at a sample that has a surface; 1 without lights, up to the lines.
    fn light(&self, at: [usize; 2], sample: &Sample, Reached { open, key }: Reached) -> f32 {
        let line = if self.is_border(at, sample) { LINE } else { 1.0 };
        if self.shadow.is_none() {
            return line;
        }
        let normal = Vec3::from(sample.normal);
        let toward = |light: Vec3| normal.dot(light.normalize()).max(0.0);
        let ambient = open * (AMBIENT + FROM_ABOVE * normal.y + FILL_LIGHT * toward(FILL));
        line * (ambient + KEY_LIGHT * key * toward(KEY)) * if sample.inner { INNER } else { 1.0 }
    }

    /// The point of the surface at a sample, m.
    fn point(&self, [column, row]: [usize; 2], sample: &Sample) -> DVec3 {
        let camera = self.camera;
        let w = f64::from(sample.w);
        let metres = w / (camera.distance * camera.scale);
        let [x, y] =
            [column as f64 + 0.5 - 0.5 * camera.size[0] as f64, 0.5 * camera.size[1] as f64 - row as f64 - 0.5];
        camera.centre + camera.right * (x * metres) + camera.up * (y * metres) + camera.toward * (camera.distance - w)
    }

    /// A, over the samples of the spiral.
    fn ambient(&self, at: [usize; 2], sample: &Sample, normal: Vec3) -> f32 {
        let pixels = REACH_M * self.camera.scale as f32;
        let blocked = |[x, y]: &[f32; 2]| {
            let by = [x * pixels, y * pixels].map(|d| d.round() as i32);
            let Some(other) = self.beside(at, by).filter(|other| !other.is_nothing()) else { return 0.0 };
            let metres = 1.0 / self.camera.scale as f32;
            let v = Vec3::new(by[0] as f32 * metres, -by[1] as f32 * metres, sample.w - other.w);
            let squared = v.length_squared() / (REACH_M * REACH_M);
            if squared >= 1.0 || squared == 0.0 {
                return 0.0;
            }
            (normal.dot(v.normalize()) - HORIZON).max(0.0) * (1.0 - squared)
        };
        let mean = self.spiral.iter().map(blocked).sum::<f32>() / AROUND as f32;
        (1.0 - DARKENING * mean).max(0.0)
    }

    /// Whether a sample lies on a border: a neighbour half a pixel away is nothing, or farther than the surface's slope explains.
    fn is_border(&self, at: [usize; 2], sample: &Sample) -> bool {
        let step = (SAMPLES / 2 + 1) as i32;
        [[step, 0], [-step, 0], [0, step], [0, -step]]
            .into_iter()
            .any(|by| self.beside(at, by).is_none_or(|other| other.is_nothing() || other.w - sample.w > LINE_STEP_M))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;
    use crate::picture::raster::Paint;

    fn picture(lit: bool) -> Vec<Rgb> {
        // A wall behind, and a box in front of its middle.
        let wall = cuboid(DVec3::new(-0.5, 0.2, -0.5), DVec3::new(0.5, 0.3, 0.5));
        let front = cuboid(DVec3::new(-0.1, -0.1, -0.1), DVec3::new(0.1, 0.2, 0.1));
        let grey = |mesh| Surface::new(mesh, Paint::Plain([180; 3]));
        let camera = Camera::new(DVec3::ZERO, DVec3::NEG_Y, 4.0, 300.0, [300, 240]);
        draw(&[grey(&wall), grey(&front)], &camera, lit)
    }

    #[test]
    fn the_wall_is_darker_in_the_shadow_of_the_box_and_unlit_pixels_keep_their_colour() {
        let lit = picture(true);
        let at = |column: usize, row: usize| i32::from(lit[row * 100 + column][0]);
        // The key light comes from the upper left, so the shadow falls to the lower right of the box's corner at (60, 50).
        let (open, shaded) = (at(25, 20), at(66, 56));
        assert!(open > shaded + 25, "{open} {shaded}");
        assert_eq!(picture(false)[40 * 100 + 50], [180; 3]);
    }

    #[test]
    fn pixels_do_not_depend_on_the_number_of_threads() {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(alone.install(|| picture(true)), picture(true));
    }

    #[test]
    fn the_curve_of_srgb_is_inverted() {
        let (linear, codes) = (linear_of_codes(), codes_of_linear());
        for code in 16..=255_usize {
            let back = codes[(linear[code] * 4095.0).round() as usize];
            assert!(usize::from(back).abs_diff(code) <= 1, "{code} {back}");
        }
    }
}
