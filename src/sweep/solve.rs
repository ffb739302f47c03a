//! What runs a point, and how one point becomes one row: warm-up, repeats, figures, and whatever goes wrong.

use std::any::Any;
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};

use glam::DVec3;

use super::point::Point;
use super::row::{Measures, Row};
use super::timing::{Times, Timing};

/// Why a point has no result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PointError {
    /// It failed: a row says so, and the sweep goes on.
    #[error("{0}")]
    Failed(String),
    /// The user stopped it half-way: no row; it is computed again on resume.
    #[error("interrupted")]
    Interrupted,
}

impl PointError {
    /// A failure in the words of an error and of all that caused it.
    #[must_use]
    pub fn failed(error: &(dyn Error + 'static)) -> Self {
        let mut text = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            let said = error.to_string();
            // Some errors repeat their cause in their own message.
            if !text.contains(&said) {
                text = format!("{text}: {said}");
            }
            cause = error.source();
        }
        Self::Failed(text)
    }
}

/// The outcome of one pass over a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved<T> {
    /// Whatever [`Solve::measure`] needs, the drape itself for one.
    pub value: T,
    /// How long the stages took.
    pub times: Times,
    /// [`result_hash`] of the displaced positions.
    pub result_hash: String,
}

/// Runs points. Called from several threads at once when there are several jobs; not from rayon's, so that an
/// implementation may hold a lock around work that rayon spreads.
pub trait Solve: Sync {
    /// What a pass leaves to be measured.
    type Value;

    /// One pass: all that is timed. Called once for every warm-up and repeat.
    ///
    /// # Errors
    /// [`PointError`].
    fn solve(&self, point: &Point) -> Result<Solved<Self::Value>, PointError>;

    /// The figures of the last pass, untimed: accuracy against a reference, recording. Called once a point.
    ///
    /// # Errors
    /// [`PointError`].
    fn measure(&self, point: &Point, solved: Solved<Self::Value>) -> Result<Measures, PointError>;
}

/// A function that does all in one pass.
impl<F: Fn(&Point) -> Result<Solved<Measures>, PointError> + Sync> Solve for F {
    type Value = Measures;

    fn solve(&self, point: &Point) -> Result<Solved<Measures>, PointError> {
        self(point)
    }

    fn measure(&self, _: &Point, solved: Solved<Measures>) -> Result<Measures, PointError> {
        Ok(solved.value)
    }
}

/// blake3 over the bits of the positions (x, y, z, little-endian), hexadecimal: equal hashes are equal results, bit for bit.
#[must_use]
pub fn result_hash(positions: &[DVec3]) -> String {
    let mut hasher = blake3::Hasher::new();
    for position in positions {
        for coordinate in position.to_array() {
            hasher.update(&coordinate.to_bits().to_le_bytes());
        }
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// The row of a point, of so many passes before and so many timed; `None` if it was interrupted.
pub fn row_of<S: Solve>(point: &Point, solver: &S, warm_up: usize, repeats: usize) -> Option<Row> {
    // A solver shared by the threads may be left odd by a panic of its own; its next point says so again, as a row.
    let caught = catch_unwind(AssertUnwindSafe(|| passes(point, solver, warm_up, repeats)));
    match caught {
        Ok(Ok(row)) => Some(row),
        Ok(Err(PointError::Failed(text))) => Some(Row::failed(point, text)),
        Ok(Err(PointError::Interrupted)) => None,
        Err(payload) => Some(Row::failed(point, format!("panicked: {}", panic_text(payload.as_ref())))),
    }
}

fn passes<S: Solve>(point: &Point, solver: &S, warm_up: usize, repeats: usize) -> Result<Row, PointError> {
    for _ in 0..warm_up {
        solver.solve(point)?;
    }
    let mut solved = solver.solve(point)?;
    let mut times = vec![solved.times];
    for repeat in 2..=repeats {
        let again = solver.solve(point)?;
        if again.result_hash != solved.result_hash {
            let (first, other) = (&solved.result_hash, &again.result_hash);
            return Err(PointError::Failed(format!(
                "not deterministic: repeat {repeat} gave {other}, the first {first}"
            )));
        }
        times.push(again.times);
        solved = again;
    }
    let hash = solved.result_hash.clone();
    let measures = solver.measure(point, solved)?;
    Ok(Row::solved(point, &measures, &hash, &Timing::of(&times)))
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}
