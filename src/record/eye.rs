//! The eye of the 3D views: in front of the garment, slightly above and to one side, with the whole garment in the view.
//!
//! Symbols: θ = 55°, the viewer's vertical field of view; w, h = width and height of the garment in the view, m; a = width over
//! height of the view on screen. Distance = max(h/2, w/2a) / tan(θ/2) + a quarter of the depth.
//!
//! Limits: a is that of the layout in a window of 16:10; the user may resize views.

use glam::DVec3;

use crate::mesh::TriMesh;

/// The viewer's own field of view (`Eye::DEFAULT_FOV_Y`, Rerun 0.36), degrees.
const FIELD_OF_VIEW_DEG: f64 = 55.0;
/// Elevation of the eye above the horizontal, degrees.
const ELEVATION_DEG: f64 = 7.0;
/// Angle of the eye to the garment's left, degrees, so that depth is visible.
const AZIMUTH_DEG: f64 = 18.0;
/// Size of the view over that of the garment.
const MARGIN: f64 = 1.14;
/// Share of half the garment's depth by which the eye moves back, since a garment is widest near its middle depth.
const BULGE: f64 = 0.5;

/// An eye and the extent of the garment in its view.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Eye {
    /// Position, m.
    pub position: DVec3,
    /// Point that it looks at, m.
    pub target: DVec3,
    /// Half the garment's width in the view, m.
    pub half_width: f64,
    /// Half the garment's height in the view, m.
    pub half_height: f64,
    /// Unit vector from the garment to the eye.
    pub toward: DVec3,
    /// Half the garment's depth along `toward`, m.
    pub half_depth: f64,
}

impl Eye {
    /// The eye for a garment whose wearer looks along `front` (horizontal), in views of the given width over height.
    /// `None` for a garment without vertices.
    pub(crate) fn on(garment: &TriMesh, front: DVec3, aspect: f64) -> Option<Self> {
        let forward = DVec3::new(front.x, front.y, 0.0).try_normalize().unwrap_or(DVec3::NEG_Y);
        let side = DVec3::Z.cross(forward);
        let (sin, cos) = AZIMUTH_DEG.to_radians().sin_cos();
        let flat = forward * cos + side * sin;
        let (sin, cos) = ELEVATION_DEG.to_radians().sin_cos();
        Self::seen_from(garment, flat * cos + DVec3::Z * sin, aspect)
    }

    /// The eye for a garment in the direction `toward` (unit, not vertical). `None` for a garment without vertices.
    pub(crate) fn seen_from(garment: &TriMesh, toward: DVec3, aspect: f64) -> Option<Self> {
        let right = DVec3::Z.cross(toward).try_normalize()?;
        let up = toward.cross(right);
        let extent = |axis: DVec3| {
            let along = garment.positions.iter().map(|p| p.dot(axis));
            along.map(|v| (v, v)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        let (left_end, right_end) = extent(right)?;
        let (low, high) = extent(up)?;
        let (back, near) = extent(toward)?;
        let middle = |(a, b): (f64, f64)| 0.5 * (a + b);
        let centre = right * middle((left_end, right_end)) + up * middle((low, high)) + toward * middle((back, near));
        let (half_width, half_height) = (0.5 * (right_end - left_end), 0.5 * (high - low));
        let (position, target, half_depth) = (centre, centre, 0.5 * (near - back));
        Some(Self { position, target, half_width, half_height, toward, half_depth }.through(aspect))
    }

    /// Half the height that is visible at the target, m.
    pub(crate) fn half_seen(&self) -> f64 {
        self.position.distance(self.target) * (0.5 * FIELD_OF_VIEW_DEG).to_radians().tan()
    }

    /// The same eye, farther from its target by a factor.
    pub(crate) fn farther(&self, factor: f64) -> Self {
        Self { position: self.target + factor * (self.position - self.target), ..*self }
    }

    /// The same eye, as near as a view of this width over height allows.
    pub(crate) fn through(&self, aspect: f64) -> Self {
        let tan = (0.5 * FIELD_OF_VIEW_DEG).to_radians().tan();
        let fit = (self.half_height / tan).max(self.half_width / (tan * aspect));
        Self { position: self.target + self.toward * (MARGIN * fit + BULGE * self.half_depth), ..*self }
    }
}
