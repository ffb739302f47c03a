//! One point of a sweep: everything that determines one run, and its name by content.
//!
//! A point's id is the blake3 hash of the canonical JSON of all that determines its result: version of the program, body,
//! garment, fabric, model, range table, extents, smallest PART, refinement, seed and options. A file counts by its contents, not by its
//! name or place, so that a moved folder or a shard on another machine has the same ids; a range table counts by its
//! bounds, extents and gap rule, a fabric by its constants. What changes nothing but timings (repeats, jobs, threads) is no part of it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::choice::{BodyChoice, FabricChoice, Input, InputKey, ModelChoice, Refine, TableChoice, TableKey};
use crate::fabric::Fabric;
use crate::shapes::BodySpec;

/// The version that computes; rows of different versions are never mixed.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// One point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Content hash of all that determines the result, hexadecimal.
    pub id: String,
    /// Place in the plan, from 0; the same in every shard.
    pub index: usize,
    /// The body.
    pub body: BodyChoice,
    /// The garment.
    pub garment: Input,
    /// The fabric.
    pub fabric: FabricChoice,
    /// Stage two's model.
    pub model: ModelChoice,
    /// Stage one's range table.
    pub table: TableChoice,
    /// Largest extents of a PART along the cloth, cm: none for PARTs as equation (1) gives them, one, or several for a
    /// cascade from coarse to fine.
    pub extents_cm: Vec<f64>,
    /// PARTs of fewer vertices join a neighbour; 1 keeps the paper's definition.
    pub min_part: usize,
    /// Full-resolution steps.
    pub refine: Refine,
    /// Seed of the perturbed start; 0 is the undisturbed one.
    pub seed: u64,
    /// Whatever else the solver understands, by name.
    pub options: BTreeMap<String, String>,
}

impl Point {
    /// The extents as the rows have them: `none`, `5`, or `12>6>3` for a cascade.
    #[must_use]
    pub fn extent_text(&self) -> String {
        if self.extents_cm.is_empty() {
            return "none".to_owned();
        }
        self.extents_cm.iter().map(f64::to_string).collect::<Vec<_>>().join(">")
    }

    /// The options as the rows have them: `a=1 b=2`, empty for none.
    #[must_use]
    pub fn options_text(&self) -> String {
        self.options.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
    }

    /// All that tells this point from others, in one line.
    #[must_use]
    pub fn label(&self) -> String {
        let Self { body, garment, fabric, model, table, min_part, refine, seed, .. } = self;
        let extent = self.extent_text();
        let options = self.options.iter().map(|(key, value)| format!(", {key} {value}")).collect::<String>();
        format!(
            "body {}, garment {}, fabric {}, {model}, table {}, extent {extent}, min-part {min_part}, refine {refine}, \
             seed {seed}{options}",
            body.label, garment.label, fabric.label, table.label
        )
    }

    /// Content hash of what is made or read before any stage: body, garment and options. Points that share it can share a
    /// scene, its distances, and with one fabric and model its references.
    #[must_use]
    pub fn scene_id(&self) -> String {
        content_id(&(self.body.input.key(), &self.body.measurements, self.garment.key(), &self.options))
    }

    /// The point with its id set from everything else.
    pub(super) fn named(mut self) -> Self {
        let key = Key {
            partwise: VERSION,
            body: self.body.input.key(),
            measurements: &self.body.measurements,
            garment: self.garment.key(),
            fabric: self.fabric.key(),
            model: self.model,
            table: self.table.key(),
            extents_cm: &self.extents_cm,
            min_part: self.min_part,
            refine: self.refine,
            seed: self.seed,
            options: &self.options,
        };
        self.id = content_id(&key);
        self
    }
}

/// Hash of a value's JSON, 128 bits in hexadecimal: enough that no two points of any sweep meet, and short in a CSV.
pub(super) fn content_id(value: &impl Serialize) -> String {
    // Structs keep their order of fields whatever features serde_json is built with; a map might not. Writing plain data
    // to memory does not fail; if it did, the ids would collide and the plan would drop points, which it reports.
    let json = serde_json::to_vec(value).unwrap_or_default();
    blake3::hash(&json).to_hex()[..32].to_owned()
}

#[derive(Serialize)]
struct Key<'a> {
    partwise: &'a str,
    body: InputKey<'a>,
    measurements: &'a BodySpec,
    garment: InputKey<'a>,
    fabric: Fabric,
    model: ModelChoice,
    table: TableKey,
    extents_cm: &'a [f64],
    min_part: usize,
    refine: Refine,
    seed: u64,
    options: &'a BTreeMap<String, String>,
}
