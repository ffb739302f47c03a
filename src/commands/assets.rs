//! `partwise assets`: everything built in, as files to open, edit and pass back.

use std::io::ErrorKind;
use std::path::PathBuf;

use crate::base::atomic_file::folder_of;
use crate::base::files::{listed, read_own};
use crate::body::dress_form::DressForm;
use crate::garment::builtin::{BUILT_IN, GarmentSpec, garment_on};
use crate::garment::fabric;
use crate::mesh::export::mesh_text;
use crate::parts::range_table::RangeTable;
use clap::Args;
use rayon::prelude::*;

use super::runtime::{make_folder, write};
use super::{MeasurementArgs, UserError, console};

/// Triangles of the form as `run` makes it.
const FORM_TRIANGLES: usize = crate::body::dress_form::DEFAULT_TRIANGLES;

/// Sewing patterns of our own, by name.
const PATTERNS: [(&str, &str); 2] = [
    ("skirt", include_str!("../../assets/patterns/skirt.json")),
    ("tshirt", include_str!("../../assets/patterns/tshirt.json")),
];

/// Arguments of `assets`.
#[derive(Debug, Args)]
pub(crate) struct AssetsArgs {
    /// Folder to write to; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "partwise-assets")]
    out: PathBuf,
    /// Vertices of each garment [default: the larger size of the paper's Table 4]
    #[arg(long, value_name = "N")]
    vertices: Option<usize>,
    #[command(flatten)]
    measurements: MeasurementArgs,
}

impl AssetsArgs {
    /// Writes body and garments as OBJ; range table, fabrics, measurements and garment specs as TOML; sewing patterns as JSON.
    /// Without `force`, nothing is written where a file would lose what it holds now.
    pub(crate) fn execute(&self, force: bool) -> anyhow::Result<()> {
        let made = self.made()?;
        // A file that cannot be read is not known to be ours.
        let differs = |(name, text): &&(String, String)| match read_own(&self.out.join(name)) {
            Ok(found) => found != text.as_bytes(),
            Err(error) => error.kind() != ErrorKind::NotFound,
        };
        let differing: Vec<String> = made.iter().filter(differs).map(|(name, _)| name.clone()).collect();
        if !force && !differing.is_empty() {
            return Err(UserError::new(format!(
                "{}: found files with other contents, {}; nothing is written: choose another folder with --out, or replace \
                 them with --force",
                self.out.display(),
                listed(&differing)
            )));
        }
        for (name, text) in &made {
            let path = self.out.join(name);
            make_folder(folder_of(&path))?;
            write(&path, text, "--out")?;
        }
        console::result(&self.out.display().to_string());
        Ok(())
    }

    /// All files: where each lies in the folder, and what it holds.
    fn made(&self) -> anyhow::Result<Vec<(String, String)>> {
        let spec = self.measurements.spec()?;
        let form = DressForm::new(&spec)?;
        let garment = |name: &&str| -> anyhow::Result<[(String, String); 2]> {
            let spec = GarmentSpec::by_name(name)?;
            let made = garment_on(&spec, &form, self.vertices)?;
            let text = toml::to_string(&spec)?;
            Ok([(format!("garments/{name}.obj"), mesh_text(&made.mesh)), (format!("garments/{name}.toml"), text)])
        };
        let garments: Vec<_> = BUILT_IN.par_iter().map(garment).collect::<anyhow::Result<_>>()?;
        let mut made = vec![
            ("bodies/form.obj".to_owned(), mesh_text(&form.mesh(FORM_TRIANGLES)?)),
            ("bodies/form.toml".to_owned(), toml::to_string(&spec)?),
            ("tables/table-3.toml".to_owned(), RangeTable::table_3().to_toml()),
        ];
        made.extend(garments.into_iter().flatten());
        for name in fabric::BUILT_IN {
            made.push((format!("fabrics/{name}.toml"), toml::to_string(&fabric::Fabric::by_name(name)?)?));
        }
        made.extend(PATTERNS.map(|(name, text)| (format!("patterns/{name}.json"), text.to_owned())));
        Ok(made)
    }
}
