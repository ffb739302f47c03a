//! `partwise assets`: the built-in body, garments, tables, fabrics and patterns as files, to inspect, edit and use as inputs.

use std::io::ErrorKind;
use std::path::PathBuf;

use crate::base::atomic_file::folder_of;
use crate::base::files::{listed, read_own};
use crate::body::dress_form::{DEFAULT_TRIANGLES, DressForm};
use crate::garment::builtin::{BUILT_IN, GarmentSpec, garment_on};
use crate::garment::fabric;
use crate::mesh::export::mesh_text;
use crate::parts::range_table::RangeTable;
use clap::Args;
use rayon::prelude::*;

use super::console;
use super::inputs::MeasurementArgs;
use super::runtime::{create_folder, refuse, write};

/// The built-in sewing patterns, by name.
const PATTERNS: [(&str, &str); 2] = [
    ("skirt", include_str!("../../assets/patterns/skirt.json")),
    ("tshirt", include_str!("../../assets/patterns/tshirt.json")),
];

/// Arguments of `assets`.
#[derive(Debug, Args)]
pub(crate) struct AssetsArgs {
    /// Folder to write to; created if it does not exist
    #[arg(long, value_name = "DIR", default_value = "partwise-assets")]
    out: PathBuf,
    /// Vertices of each garment [default: the larger size in the paper's Table 4]
    #[arg(long, value_name = "N")]
    vertices: Option<usize>,
    #[command(flatten)]
    measurements: MeasurementArgs,
}

impl AssetsArgs {
    /// Writes body and garments as OBJ; range table, fabrics, measurements and garment specifications as TOML; sewing patterns as
    /// JSON. Without `force`, nothing is written if any file exists with other contents.
    pub(crate) fn execute(&self, force: bool) -> anyhow::Result<()> {
        let files = self.files()?;
        // A file that cannot be read may have other contents.
        let differs = |(name, text): &&(String, String)| match read_own(&self.out.join(name)) {
            Ok(found) => found != text.as_bytes(),
            Err(error) => error.kind() != ErrorKind::NotFound,
        };
        let differing: Vec<String> = files.iter().filter(differs).map(|(name, _)| name.clone()).collect();
        if !force && !differing.is_empty() {
            refuse!(
                "{}: found files with other contents, {}; nothing is written: choose another folder with --out, or replace \
                 them with --force",
                self.out.display(),
                listed(&differing)
            );
        }
        for (name, text) in &files {
            let path = self.out.join(name);
            create_folder(folder_of(&path))?;
            write(&path, text, "--out")?;
        }
        console::result(&self.out.display().to_string());
        Ok(())
    }

    /// The files: path within the folder, and contents.
    fn files(&self) -> anyhow::Result<Vec<(String, String)>> {
        let spec = self.measurements.spec()?;
        let form = DressForm::new(&spec)?;
        let garment = |name: &&str| -> anyhow::Result<[(String, String); 2]> {
            let spec = GarmentSpec::by_name(name)?;
            let garment = garment_on(&spec, &form, self.vertices)?;
            let text = toml::to_string(&spec)?;
            Ok([(format!("garments/{name}.obj"), mesh_text(&garment.mesh)), (format!("garments/{name}.toml"), text)])
        };
        let garments: Vec<_> = BUILT_IN.par_iter().map(garment).collect::<anyhow::Result<_>>()?;
        let mut files = vec![
            ("bodies/form.obj".to_owned(), mesh_text(&form.mesh(DEFAULT_TRIANGLES)?)),
            ("bodies/form.toml".to_owned(), toml::to_string(&spec)?),
            ("tables/table-3.toml".to_owned(), RangeTable::table_3().to_toml()),
        ];
        files.extend(garments.into_iter().flatten());
        for name in fabric::BUILT_IN {
            files.push((format!("fabrics/{name}.toml"), toml::to_string(&fabric::Fabric::by_name(name)?)?));
        }
        files.extend(PATTERNS.map(|(name, text)| (format!("patterns/{name}.json"), text.to_owned())));
        Ok(files)
    }
}
