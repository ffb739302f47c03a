//! The garments of a sweep, at their sizes.

use super::axes::Axis;
use super::choice::Input;
use super::error::PlanError;
use super::file::{Grid, Single};
use super::inputs::Inputs;
use crate::shapes::garment::TABLE_4_SIZES;
use crate::shapes::{BUILT_IN, GarmentRequest, GarmentSpec};

/// The garment where a sweep names none.
pub const DEFAULT_GARMENT: &str = "low-cut-dress";

/// Garments, each at every size.
pub(super) fn garments(
    axis: Axis<'_>,
    base: &Single,
    grid: &Grid,
    inputs: &mut Inputs,
) -> Result<Vec<Input>, PlanError> {
    let source = axis.source;
    let garments = axis.of(&base.garment, &grid.garments, "garments", |v| {
        let label = source.text(v, "garment", "a name, name@vertices or a file")?;
        if !Inputs::names_a_file(&label) {
            let known = label.parse().and_then(|request: GarmentRequest| GarmentSpec::by_name(&request.name));
            known.map_err(|e| PlanError::Shape { place: source.place(v), key: "garment", source: e })?;
        }
        inputs.input(&label, &source.place(v))
    })?;
    let garments = garments.unwrap_or_else(|| vec![Input::built_in(DEFAULT_GARMENT)]);
    let sized = garments.iter().find(|g| g.file.is_some() || g.label.contains('@'));
    let sizes = axis.of(&base.size, &grid.sizes, "sizes", |v| match (sized, v.get_ref().as_str()) {
        (Some(garment), _) => {
            let expected = "no sizes where a garment has its own, as {}; write name@vertices for each instead";
            Err(source.wrong(v, "size", expected.replace("{}", &garment.label)))
        }
        (None, Some("larger")) => Ok(Size::OfTable4(0)),
        (None, Some("smaller")) => Ok(Size::OfTable4(1)),
        (None, _) => {
            let expected = "a number of vertices, at least 4, or \"larger\" or \"smaller\" of the paper's two";
            source.count(v, "size", 4, expected).map(Size::Vertices)
        }
    })?;
    let Some(sizes) = sizes else { return Ok(garments) };
    let at_sizes = |g: &Input| sizes.iter().map(|size| g.at(size.of(&g.label))).collect::<Vec<_>>();
    Ok(garments.iter().flat_map(at_sizes).collect())
}

/// How many vertices a garment shall have.
#[derive(Clone, Copy)]
enum Size {
    Vertices(usize),
    /// The first or second size of the paper's Table 4.
    OfTable4(usize),
}

impl Size {
    fn of(self, garment: &str) -> Option<usize> {
        match self {
            Self::Vertices(count) => Some(count),
            Self::OfTable4(which) => {
                let place = BUILT_IN.iter().position(|name| *name == garment)?;
                Some(TABLE_4_SIZES[place][which])
            }
        }
    }
}
