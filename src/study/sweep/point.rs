//! One point of a sweep: a job, the labels of its body and garment, and a content hash as its id.
//!
//! The id is the blake3 hash of the JSON of everything that determines the result: the version of the program and the
//! [`Job`]. Files enter by their contents, not by name or place, so that a moved folder or a shard on another
//! machine has the same ids; a range table enters by its bounds, extents and gap rule, a fabric by its constants. Settings that
//! only affect timings (repeats, jobs, threads) are excluded.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::inputs::Input;
use crate::drape::Settings;
use crate::scene::SceneSpec;
use crate::study::job::Job;

/// The version of the program; rows of different versions are never mixed.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// One point of a sweep, as plain data that another process can compute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Content hash of all that determines the result, hexadecimal.
    pub id: String,
    /// Place in the plan, from 0; the same in every shard.
    pub index: usize,
    /// Name of the body in reports.
    pub body: String,
    /// Name of the garment in reports: `name@vertices` or a path, as written.
    pub garment: String,
    /// Options of the job without a column of their own, by name.
    pub options: BTreeMap<String, String>,
    /// The job of the point.
    pub job: Job,
    /// Body and garment by content.
    keys: [String; 2],
}

impl Point {
    /// A point of this job, with the names of body and garment as their keys. Its id is not set yet.
    pub(super) fn of(job: Job) -> Self {
        let (body, garment) = (job.scene.body.clone(), job.scene.garment.clone());
        let keys = [body.clone(), garment.clone()];
        Self { id: String::new(), index: 0, body, garment, options: BTreeMap::new(), job, keys }
    }

    pub(super) fn set_body(&mut self, body: &Input) {
        self.job.scene.body.clone_from(&body.name);
        self.body.clone_from(&body.label);
        self.keys[0].clone_from(&body.key);
    }

    pub(super) fn set_garment(&mut self, garment: &Input) {
        self.job.scene.garment.clone_from(&garment.name);
        self.garment.clone_from(&garment.label);
        self.keys[1].clone_from(&garment.key);
    }

    /// The extents as in a row: `none`, `5`, or `12>6>3` for a cascade.
    pub(crate) fn extent_text(&self) -> String {
        let extents = self.job.settings.model.extents_cm();
        if extents.is_empty() {
            return "none".to_owned();
        }
        extents.iter().map(f64::to_string).collect::<Vec<_>>().join(">")
    }

    /// The options as in a row: `a=1 b=2`; `accuracy` is always among them.
    pub(crate) fn options_text(&self) -> String {
        self.options.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
    }

    /// All settings of the point in one line.
    pub(crate) fn label(&self) -> String {
        let Self { body, garment, job: Job { settings, seed, .. }, .. } = self;
        let Settings { model, table, min_part, refine, fabric, .. } = settings;
        let (fabric, table, extent) = (&fabric.name, table.name(), self.extent_text());
        let (model, motion) = (model.name(), model.motion().name());
        let options = self.options.iter().map(|(key, value)| format!(", {key} {value}")).collect::<String>();
        format!(
            "body {body}, garment {garment}, fabric {fabric}, {model}, table {table}, extent {extent}, motion {motion}, \
             min-part {min_part}, refine {refine}, seed {seed}{options}"
        )
    }

    /// Content hash of the inputs of the scene. Points with the same hash share a scene, and with the same fabric also their
    /// references.
    pub(crate) fn scene_id(&self) -> String {
        content_id(&self.scene_key())
    }

    fn scene_key(&self) -> SceneSpec {
        let [body, garment] = self.keys.clone();
        SceneSpec { body, garment, ..self.job.scene.clone() }
    }

    /// The point with its id set.
    pub(super) fn named(mut self) -> Self {
        self.options.insert("accuracy".to_owned(), self.job.accuracy.to_string());
        let mut key = Job { scene: self.scene_key(), ..self.job.clone() };
        // Names and sources of table and fabric do not affect the result.
        key.settings.table = key.settings.table.anonymous();
        (key.settings.fabric.name, key.settings.fabric.source) = Default::default();
        self.id = content_id(&(VERSION, key));
        self
    }
}

/// The change of a point by one value of an axis.
pub(super) type Edit = Box<dyn Fn(&mut Point)>;

/// A list of a single edit.
pub(super) fn one(edit: impl Fn(&mut Point) + 'static) -> Vec<Edit> {
    vec![Box::new(edit)]
}

/// Hash of a value's JSON, 128 bits in hexadecimal, which makes collisions negligible and is short in a CSV.
pub(super) fn content_id(value: &impl Serialize) -> String {
    // Fields of structs keep their order with any features of serde_json. Serialising plain data to memory cannot fail; if it
    // did, ids would collide and the plan would report dropped points.
    let json = serde_json::to_vec(value).unwrap_or_default();
    blake3::hash(&json).to_hex()[..32].to_owned()
}
