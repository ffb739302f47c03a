//! One view of a garment on a body.

use glam::{DVec2, DVec3};

use super::raster::{Camera, Surface};
use super::shading::{SAMPLES, draw};
use super::text::Pixels;
use crate::picture::colour::legend::ColourBar;

/// Distance of the eye over half the height of the view: a field of view of 14°, as a portrait lens has.
const DISTANCE: f64 = 8.0;
/// Margin around the garment, as a share of its size and in m: neck and legs show which way it is worn.
const MARGIN: f64 = 1.06;
const MARGIN_M: f64 = 0.07;

/// One view of a garment, on a body unless it lies flat.
#[derive(Debug, Clone)]
pub(crate) struct Figure<'a> {
    pub(super) garment: Surface<'a>,
    pub(super) body: Option<Surface<'a>>,
    /// Direction to the eye.
    pub(super) toward: DVec3,
    pub(crate) caption: String,
    pub(super) bar: Option<ColourBar>,
}

/// The extent of a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    /// Middle of the garment, m.
    pub(super) centre: DVec3,
    /// Half of width and height, m.
    pub(super) half: DVec2,
}

impl Figure<'_> {
    /// The frame around the garment.
    pub(super) fn frame(&self) -> Frame {
        let camera = Camera::new(DVec3::ZERO, self.toward, 1.0, 1.0, [1, 1]);
        let axes = [camera.right, camera.up, camera.toward];
        let extents = axes.map(|axis| {
            let along = self.garment.positions.iter().map(|p| p.dot(axis));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        });
        let middle = extents.map(|(low, high)| 0.5 * (low + high));
        let half = |k: usize| MARGIN * 0.5 * (extents[k].1 - extents[k].0) + MARGIN_M;
        Frame { centre: axes.iter().zip(middle).map(|(axis, at)| *axis * at).sum(), half: DVec2::new(half(0), half(1)) }
    }

    /// The view in pixels, `scale` of them a metre.
    pub(super) fn draw(&self, size: [usize; 2], scale: f64) -> Pixels {
        let samples = SAMPLES as f64;
        let half_height = 0.5 * size[1] as f64 / scale;
        let distance = DISTANCE * half_height;
        let camera =
            Camera::new(self.frame().centre, self.toward, distance, samples * scale, size.map(|n| n * SAMPLES));
        let surfaces: Vec<Surface<'_>> = self.body.iter().chain([&self.garment]).cloned().collect();
        Pixels::of(size, draw(&surfaces, &camera, self.body.is_some()))
    }
}
