//! A sewing pattern put on a body: panels about it as the file places them, moved to this body, and their seams drawn shut.
//!
//! [`put_on`] makes the pattern in a few edge lengths, long ones first: on some hundred vertices the seams are shut in a tenth of a
//! second, and each finer garment begins where the one before ends, laid over it in the flat panels.

mod arap;
mod arrange;
mod landmarks;
mod preclose;

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use glam::DVec3;

pub use arap::laid_flat;
pub use arrange::Arranged;
pub use landmarks::Landmarks;
pub(crate) use preclose::draw_shut;

use crate::body::distance::Body;
use crate::garment::pattern::{PatternError, SewingPattern, SewnGarment, sew};
use crate::mesh::{Topology, each_once};
use arap::{Closing, close};

/// Edge lengths of the garments before the one that is asked for, m, the gap they keep from the body, m, and the most steps they
/// are drawn shut in. Three times as many as six patterns took.
const COARSER: [(f64, f64, usize); 2] = [(0.06, 0.01, 150), (0.03, 0.006, 50)];

/// A coarser garment has edges at least so many times as long.
const COARSER_BY: f64 = 1.4;

/// The gap and the most steps of the one that is asked for.
const LAST: (f64, usize) = (0.004, 25);

/// Steps end where no vertex goes farther, m.
const STILL: f64 = 1e-3;

/// Where a waistband is: garments whose top is this far under the armpits have no shoulders to hang from, m.
const BELOW_ARMPITS: f64 = 0.03;

/// Labels of the edges that hold a garment without shoulders, the upper first.
const HOLDING: [&str; 2] = ["strapless", "lower_interface"];

/// A garment on a body, undraped.
#[derive(Debug, Clone)]
pub struct PutOn {
    /// The sewn garment, its mesh on the body.
    pub garment: SewnGarment,
    /// How its panels were moved to this body.
    pub arranged: Arranged,
    /// Vertices that should be held until the drape rests: the waist of what has no shoulders.
    pub held: Vec<u32>,
    /// The label of the edges they lie on, `top edge` where the file has none.
    pub held_by: Option<String>,
    /// Steps of closing, of all edge lengths together.
    pub steps: usize,
    /// How long it took.
    pub time: Duration,
}

/// Puts a pattern on a body, in edges of about `edge_m` (m).
///
/// # Errors
/// As [`sew`].
pub(crate) fn put_on(pattern: &SewingPattern, body: &Body, edge_m: f64) -> Result<PutOn, PatternError> {
    let began = Instant::now();
    let landmarks = Landmarks::of(body.mesh());
    let mut pattern = pattern.clone();
    let (arranged, has_shoulders) = arrange::arrange(&mut pattern, &landmarks);
    // What is worn below the arms is drawn shut and hangs inside of them.
    let armless = if has_shoulders { None } else { landmarks.without_arms(body.mesh()) };
    let armless = armless.and_then(|mesh| Body::new_open(&mesh).ok());
    let mut coarse: Option<(SewnGarment, Vec<DVec3>)> = None;
    let mut steps = 0;
    for (edge, gap, most) in COARSER {
        // A small panel may have no mesh in edges as long as it is wide; then the next ones begin.
        let Ok(garment) = sew(&pattern, edge) else { continue };
        if edge < COARSER_BY * edge_m {
            continue;
        }
        let start = begin(&garment, coarse.as_ref());
        let how = Closing { held: &[], gap, steps: most, still: STILL };
        let first = armless.as_ref().filter(|_| coarse.is_none());
        let (mut x, mut taken) = close(&garment.mesh, &garment.rest, first.unwrap_or(body), &start, how);
        if let Some(body) = first {
            let (held, _) = held(&garment, &x, &landmarks);
            let hung;
            (x, hung) = close(&garment.mesh, &garment.rest, body, &x, Closing { held: &held, ..how });
            taken += hung;
        }
        steps += taken;
        coarse = Some((garment, x));
    }
    let mut garment = sew(&pattern, edge_m)?;
    let start = begin(&garment, coarse.as_ref());
    let most = if coarse.is_some() { LAST.1 } else { COARSER[0].2 };
    let how = Closing { held: &[], gap: LAST.0, steps: most, still: STILL };
    let (x, taken) = close(&garment.mesh, &garment.rest, body, &start, how);
    garment.mesh.positions = x;
    let (held, held_by) = held(&garment, &garment.mesh.positions, &landmarks);
    Ok(PutOn { garment, arranged, held, held_by, steps: steps + taken, time: began.elapsed() })
}

fn begin(garment: &SewnGarment, coarse: Option<&(SewnGarment, Vec<DVec3>)>) -> Vec<DVec3> {
    coarse.map_or_else(|| garment.mesh.positions.clone(), |(coarse, x)| garment.over(coarse, x))
}

/// What holds a garment that has no shoulders: edges by label, or its highest edge.
fn held(garment: &SewnGarment, x: &[DVec3], body: &Landmarks) -> (Vec<u32>, Option<String>) {
    let top = x.iter().fold(f64::NEG_INFINITY, |top, x| top.max(x.z));
    let Some(armpit) = body.armpit_z.or(body.shoulder_z) else { return (Vec::new(), None) };
    if top > armpit - BELOW_ARMPITS {
        return (Vec::new(), None);
    }
    for holding in HOLDING {
        let found: Vec<&String> = garment.labelled.keys().filter(|label| label.starts_with(holding)).collect();
        let vertices = each_once(found.iter().flat_map(|label| &garment.labelled[*label]).copied());
        if let (Some(label), false) = (found.first(), vertices.is_empty()) {
            return (vertices, Some((*label).clone()));
        }
    }
    let topology = Topology::new(&garment.mesh);
    let height = |edge: &[u32]| edge.iter().map(|&v| x[v as usize].z).sum::<f64>() / edge.len().max(1) as f64;
    let highest = topology.boundary_loops().into_iter().max_by(|a, b| height(a).total_cmp(&height(b)));
    highest.map_or((Vec::new(), None), |edge| (edge, Some("top edge".to_owned())))
}

impl PutOn {
    /// What was done, for people.
    #[must_use]
    pub(crate) fn notes(&self) -> Vec<String> {
        let mesh = &self.garment.mesh;
        let mut moved = String::new();
        let Arranged { raised, sleeves, turned } = self.arranged;
        if raised != 0.0 {
            let way = if raised > 0.0 { "up" } else { "down" };
            let _ = write!(moved, ", moved {way} {:.1} cm to this body", 100.0 * raised.abs());
        }
        if sleeves != 0.0 {
            let _ = write!(moved, ", sleeves turned {:.0} degrees to its arms", sleeves.to_degrees());
        }
        if turned != 0.0 {
            let _ = write!(moved, ", turned {:.0} degrees to where its toes point", turned.to_degrees());
        }
        let mut notes = vec![format!(
            "{} panels sewn along {} seams, {} vertices; seams drawn shut in {} steps{moved}",
            self.garment.panels.len(),
            self.garment.seams.len(),
            mesh.vertex_count(),
            self.steps
        )];
        if let Some(label) = &self.held_by {
            notes.push(format!("no shoulders to hang from: held by its {label} until it rests, then let go"));
        }
        notes.extend(self.garment.notes.iter().cloned());
        notes
    }
}
