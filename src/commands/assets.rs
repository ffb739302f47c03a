//! `partwise assets`: everything built in, as files to open, edit and pass back.

use std::path::{Path, PathBuf};

use crate::base::atomic_file::WholeFile;
use crate::body::dress_form::DressForm;
use crate::garment::builtin::{BUILT_IN, GarmentSpec, garment_on};
use crate::garment::fabric;
use crate::mesh::export::write_mesh;
use crate::parts::range_table::RangeTable;
use anyhow::Context as _;
use clap::Args;
use rayon::prelude::*;

use super::runtime::make_folder;
use super::{MeasurementArgs, console};

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
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        for folder in ["tables", "fabrics", "bodies", "garments", "patterns"] {
            make_folder(&self.out.join(folder))?;
        }
        let spec = self.measurements.spec()?;
        let form = DressForm::new(&spec)?;
        write_mesh(&self.path("bodies/form.obj"), &form.mesh(FORM_TRIANGLES)?)?;
        self.text("bodies/form.toml", &toml::to_string(&spec)?)?;
        BUILT_IN.par_iter().try_for_each(|name| -> anyhow::Result<()> {
            let spec = GarmentSpec::by_name(name)?;
            let made = garment_on(&spec, &form, self.vertices)?;
            write_mesh(&self.path(&format!("garments/{name}.obj")), &made.mesh)?;
            self.text(&format!("garments/{name}.toml"), &toml::to_string(&spec)?)
        })?;
        self.text("tables/table-3.toml", &RangeTable::table_3().to_toml())?;
        for name in fabric::BUILT_IN {
            self.text(&format!("fabrics/{name}.toml"), &toml::to_string(&fabric::Fabric::by_name(name)?)?)?;
        }
        for (name, text) in PATTERNS {
            self.text(&format!("patterns/{name}.json"), text)?;
        }
        console::result(&self.out.display().to_string());
        Ok(())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.out.join(Path::new(name))
    }

    fn text(&self, name: &str, text: &str) -> anyhow::Result<()> {
        let path = self.path(name);
        WholeFile::write(&path, text).with_context(|| format!("{}: cannot be written", path.display()))
    }
}
