//! The garments of a sweep and their sizes.

use super::error::PlanError;
use super::file::{At, Axis};
use super::inputs::{Input, Inputs};
use super::point::{Edit, one};
use crate::base::files::names_a_file;
use crate::garment::builtin::TABLE_4_SIZES;
use crate::garment::{BUILT_IN, GarmentRequest, GarmentSpec};
use crate::scene::SceneSpec;

/// Garments, each at every size.
pub(super) fn garments(axis: Axis<'_>, inputs: &mut Inputs) -> Result<Vec<Edit>, PlanError> {
    let source = axis.source;
    let sizes = axis.values(["size", "sizes"])?;
    let garments = match axis.values(["garment", "garments"])? {
        None if sizes.is_none() => return Ok(one(|_| ())),
        None => vec![Input::built_in(SceneSpec::default().garment)],
        Some(values) => {
            let garment = |v| {
                let label = source.text(v, "garment", "a name, name@vertices or a file")?;
                if !names_a_file(&label) {
                    let known = label.parse().and_then(|request: GarmentRequest| GarmentSpec::by_name(&request.name));
                    known.map_err(PlanError::input(&source.place(v), "garment"))?;
                }
                inputs.garment(&label, &source.place(v))
            };
            values.iter().map(garment).collect::<Result<Vec<_>, _>>()?
        }
    };
    let sized = garments.iter().find(|g| g.is_a_file() || g.label.contains('@'));
    let size = |v: &At| match (sized, v.get_ref().as_str()) {
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
    };
    let sizes: Option<Vec<Size>> = sizes.as_ref().map(|values| values.iter().map(size).collect()).transpose()?;
    let at = |garment: &Input, size: &Size| match size.of(&garment.label) {
        Some(vertices) => Input::built_in(format!("{}@{vertices}", garment.label)),
        None => garment.clone(),
    };
    let all: Vec<Input> = match &sizes {
        None => garments,
        Some(sizes) => garments.iter().flat_map(|g| sizes.iter().map(move |size| at(g, size))).collect(),
    };
    Ok(all.into_iter().map(|garment| -> Edit { Box::new(move |point| point.set_garment(&garment)) }).collect())
}

/// Number of vertices of a garment.
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
