//! The flattened ring of triangles about an inner vertex, in the frame of weft and warp.
//!
//! Each triangle brings its own flat shape. About an inner vertex they are laid side by side; where their angles do not
//! sum to 2π (a dart, a rest shape that is not flat) all are scaled until they do. The frame is turned so that the weft
//! is the mean of the triangles' wefts, as lines: a piece sewn on upside down counts the same.

use glam::DVec2;
use rayon::prelude::*;

use crate::mesh::{RestShape, TriMesh};

/// The ring of an inner vertex.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fan {
    /// The neighbours, counter-clockwise.
    pub ring: Vec<u32>,
    /// Where each lies from the vertex, m: x along the weft, y along the warp.
    pub spokes: Vec<DVec2>,
}

/// One triangle seen from one of its corners.
#[derive(Debug, Clone, Copy)]
struct Slice {
    from: u32,
    to: u32,
    /// The spokes to `from` and `to` in the triangle's flat frame, m.
    spokes: [DVec2; 2],
}

impl Fan {
    /// The fan of each vertex; `None` at the boundary, at a vertex of no triangle, and where the mesh is not a surface.
    #[must_use]
    pub(crate) fn all(mesh: &TriMesh, rest: &RestShape) -> Vec<Option<Self>> {
        let mut slices: Vec<Vec<Slice>> = vec![Vec::new(); mesh.vertex_count()];
        for (triangle, flat) in mesh.triangles.iter().zip(&rest.corners) {
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let spokes = [flat[j] - flat[i], flat[k] - flat[i]];
                slices[triangle[i] as usize].push(Slice { from: triangle[j], to: triangle[k], spokes });
            }
        }
        slices.par_iter().with_min_len(256).map(|around| Self::close(around)).collect()
    }

    /// Walks once around; `None` if that does not meet every triangle and come back.
    fn close(around: &[Slice]) -> Option<Self> {
        let first = around.first()?;
        let mut at = first;
        let mut turned = Vec::with_capacity(around.len());
        let mut angle = 0.0;
        for step in 0..around.len() {
            turned.push((at, angle));
            angle += at.spokes[0].perp_dot(at.spokes[1]).abs().atan2(at.spokes[0].dot(at.spokes[1]));
            let mut next = around.iter().filter(|s| s.from == at.to);
            let (found, another) = (next.next()?, next.next());
            if another.is_some() || (found.from == first.from) != (step + 1 == around.len()) {
                return None;
            }
            at = found;
        }
        let scale = std::f64::consts::TAU / angle;
        // Doubled angles average lines, not arrows.
        let turn: DVec2 =
            turned.iter().map(|(s, beta)| DVec2::from_angle(2.0 * (s.spokes[0].to_angle() - beta * scale))).sum();
        let weft = 0.5 * turn.to_angle();
        let spokes = turned.iter().map(|(s, beta)| DVec2::from_angle(beta * scale + weft) * s.spokes[0].length());
        Some(Self { ring: turned.iter().map(|(s, _)| s.from).collect(), spokes: spokes.collect() })
    }
}
