//! `partwise assets`: the built-in body, garments, tables, fabrics and patterns as files, to inspect, edit and use as inputs.

use std::io::ErrorKind;
use std::path::PathBuf;

use crate::base::atomic_file::folder_of;
use crate::base::files::{listed, read_own};
use crate::body::dress_form::{DEFAULT_TRIANGLES, DressForm};
use crate::garment::builtin::{BUILT_IN, GarmentSpec, garment_on};
use crate::garment::fabric;
use crate::mesh::export::{mesh_text, textured_text};
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

/// Files of `assets/` that are written as they are, by path.
macro_rules! kept {
    ($($path:literal)*) => { &[$(($path, include_str!(concat!("../../assets/", $path)))),*] };
}

/// Tables cut to extents, tuned tables, and sweep files, which name the tables by their places.
const KEPT: &[(&str, &str)] = kept![
    "sweeps/dial.toml"
    "sweeps/extents-and-refinement.toml"
    "sweeps/figure-8.toml"
    "sweeps/held-out.toml"
    "sweeps/sizes.toml"
    "sweeps/table-3-variations.toml"
    "sweeps/tables-by-kind.toml"
    "tables/table-3-12cm.toml"
    "tables/table-3-24cm.toml"
    "tables/table-3-6cm.toml"
    "tuned/all-but-flared-skirt/pullover-1+pullover-2+low-cut-dress+long-sleeved-dress-levels-and-extents.toml"
    "tuned/all-but-flared-skirt/pullover-1+pullover-2+low-cut-dress+long-sleeved-dress-levels.toml"
    "tuned/all-but-long-sleeved-dress/pullover-1+pullover-2+flared-skirt+low-cut-dress-levels-and-extents.toml"
    "tuned/all-but-long-sleeved-dress/pullover-1+pullover-2+flared-skirt+low-cut-dress-levels.toml"
    "tuned/all-but-low-cut-dress/pullover-1+pullover-2+flared-skirt+long-sleeved-dress-levels-and-extents.toml"
    "tuned/all-but-low-cut-dress/pullover-1+pullover-2+flared-skirt+long-sleeved-dress-levels.toml"
    "tuned/all-but-pullover-1/pullover-2+flared-skirt+low-cut-dress+long-sleeved-dress-levels-and-extents.toml"
    "tuned/all-but-pullover-1/pullover-2+flared-skirt+low-cut-dress+long-sleeved-dress-levels.toml"
    "tuned/all-but-pullover-2/pullover-1+flared-skirt+low-cut-dress+long-sleeved-dress-levels-and-extents.toml"
    "tuned/all-but-pullover-2/pullover-1+flared-skirt+low-cut-dress+long-sleeved-dress-levels.toml"
    "tuned/flared-skirt-levels-and-extents.toml"
    "tuned/flared-skirt-levels.toml"
    "tuned/long-sleeved-dress-levels-and-extents.toml"
    "tuned/long-sleeved-dress-levels.toml"
    "tuned/low-cut-dress-levels-and-extents.toml"
    "tuned/low-cut-dress-levels.toml"
    "tuned/pullover-1-levels-and-extents.toml"
    "tuned/pullover-1-levels.toml"
    "tuned/pullover-2-levels-and-extents.toml"
    "tuned/pullover-2-levels.toml"
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
    /// Writes body and garments as OBJ; range tables, sweeps, fabrics, measurements and garment specifications as TOML; sewing patterns as
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
        console::note(
            "the garments were cut wider at the hem than they are placed: drape them with --rest texture, the shape as cut",
        );
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
            let mesh = textured_text(&garment.mesh, &garment.rest.corners);
            Ok([(format!("garments/{name}.obj"), mesh), (format!("garments/{name}.toml"), text)])
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
        files.extend(KEPT.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())));
        files.extend(PATTERNS.map(|(name, text)| (format!("patterns/{name}.json"), text.to_owned())));
        Ok(files)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// The TOML files below a folder, by their path from `root`.
    fn toml_files(root: &Path, folder: &Path, found: &mut Vec<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                toml_files(root, &path, found);
            } else if path.extension().is_some_and(|ending| ending == "toml") {
                found.push(path.strip_prefix(root).unwrap().to_str().unwrap().to_owned());
            }
        }
    }

    #[test]
    fn every_table_and_sweep_of_the_repository_is_written() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
        let mut found = Vec::new();
        for folder in ["tables", "tuned", "sweeps"] {
            toml_files(&root, &root.join(folder), &mut found);
        }
        found.retain(|path| path != "tables/table-3.toml");
        found.sort();
        assert_eq!(KEPT.iter().map(|(path, _)| *path).collect::<Vec<_>>(), found);
    }
}
