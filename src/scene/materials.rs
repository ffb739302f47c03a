//! What each garment and panel is cut from: a fabric a garment, or a file that names those of its panels.
//!
//! ```toml
//! default = "interlock"        # every panel that is not named; left out, these are of the fabric of the settings
//! [panels]
//! left_cuff = "denim"          # a built-in fabric
//! "right_*" = "rib.toml"       # or a file, beside this one; * stands for any letters
//! ```
//!
//! A panel that is named itself goes before one that fits a `*`. The panels of a mesh from a file are its groups.

mod names;

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Scene, SceneError, SceneSpec};
use crate::base::files::{listed, names_a_file, stem};
use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, TriMesh};
use names::{BESIDE, files_named_in, fits};
pub use names::{CutError, PanelFabrics};

/// A share of a garment that is cut from one fabric.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Swatch {
    /// The garment.
    pub garment: String,
    /// The fabric; none is that of the settings.
    pub fabric: Option<String>,
    /// Its panels; none where it is all of the garment.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub panels: Vec<String>,
    /// The file that says so; none where the command line does.
    #[serde(skip)]
    pub by: Option<String>,
}

impl Swatch {
    /// The same by the name of its fabric, `of_settings` being that of what names none itself.
    #[must_use]
    pub(crate) fn cut_from(&self, of_settings: &Fabric) -> Self {
        Self { fabric: self.fabric.clone().or(Some(of_settings.name.clone())), ..self.clone() }
    }
}

/// The fabrics of a garment: those that its rest shape numbers, none being that of the settings.
#[derive(Default)]
pub(super) struct Cut {
    pub(super) fabrics: Vec<Option<Fabric>>,
    pub(super) swatches: Vec<Swatch>,
}

impl SceneSpec {
    /// Whether as many fabrics are given as can be.
    pub(super) fn check_fabrics(&self) -> Result<(), CutError> {
        let (fabrics, garments) = (self.fabrics.len(), 1 + self.over.len());
        match &self.fabrics_file {
            Some(file) if garments > 1 => Err(CutError::Whose { file: file.clone(), garments }),
            _ if fabrics != 0 && fabrics != garments => Err(CutError::Count { fabrics, garments }),
            _ => Ok(()),
        }
    }

    /// The file that names the fabrics of the garment's panels: the one that is given, or one beside the garment's.
    #[must_use]
    pub(crate) fn names_of_fabrics(&self) -> Option<PathBuf> {
        if let Some(file) = &self.fabrics_file {
            return Some(file.into());
        }
        let own = Path::new(&self.garment);
        let called = [stem(&self.garment), self.layer_name()]
            .into_iter()
            .map(|stem| own.with_file_name(format!("{stem}.{BESIDE}")));
        if names_a_file(&self.garment) { called.into_iter().find(|path| path.is_file()) } else { None }
    }

    /// All files that say what the garments are cut from.
    #[must_use]
    pub(crate) fn files_of_fabrics(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            self.fabrics.iter().filter(|name| names_a_file(name)).map(PathBuf::from).collect();
        for path in self.layers().filter_map(|layer| layer.names_of_fabrics()) {
            files.extend(files_named_in(&path));
            files.push(path);
        }
        files
    }

    /// What the garment is cut from, its triangles numbered by it.
    pub(super) fn cut(&self, mesh: &TriMesh, rest: &mut RestShape) -> Result<Cut, CutError> {
        let given = self.fabrics.first().map(|name| Fabric::by_name(name)).transpose()?;
        let garment = self.layer_name();
        let Some(path) = self.names_of_fabrics() else {
            let swatch = |fabric: &Fabric| Swatch {
                garment: garment.clone(),
                fabric: Some(fabric.name.clone()),
                panels: Vec::new(),
                by: None,
            };
            let swatches = given.iter().map(swatch).collect();
            return Ok(Cut { fabrics: vec![given], swatches });
        };
        let names = PanelFabrics::read(&path)?;
        if let (Some(default), Some(given)) = (&names.default, &given) {
            let (default, fabric) = (default.name.clone(), given.name.clone());
            return Err(CutError::Twice { garment, file: names.file, default, fabric });
        }
        if let Some((found, line, _)) =
            names.panels.iter().find(|(p, ..)| !mesh.groups.iter().any(|group| fits(p, group)))
        {
            let (file, found, known) = (names.file.clone(), found.clone(), mesh.groups.clone());
            return Err(CutError::Panel { file, line: *line, garment, found, known });
        }
        let own = |panel: &String| Ok(names.of(panel)?.or(given.as_ref()).cloned());
        let of_group = mesh.groups.iter().map(own).collect::<Result<Vec<_>, CutError>>()?;
        let unnamed = names.default.as_ref().or(given.as_ref()).cloned();
        let mut cut = Cut { fabrics: Vec::new(), swatches: Vec::new() };
        let mut numbers = Vec::with_capacity(mesh.triangles.len());
        for t in 0..mesh.triangles.len() {
            let group = mesh.triangle_group.get(t).map(|&group| group as usize);
            numbers.push(cut.number(group.map_or(&unnamed, |group| &of_group[group])));
        }
        let panels = |fabric: &Option<Fabric>| {
            let named = mesh.groups.iter().zip(&of_group).filter(|(_, of)| *of == fabric);
            named.map(|(panel, _)| panel.clone()).collect()
        };
        let several = cut.fabrics.len() > 1;
        let swatch = |fabric: &Option<Fabric>| Swatch {
            garment: garment.clone(),
            fabric: fabric.as_ref().map(|fabric| fabric.name.clone()),
            panels: if several { panels(fabric) } else { Vec::new() },
            by: Some(names.file.clone()),
        };
        cut.swatches = cut.fabrics.iter().map(swatch).collect();
        rest.cut_from = if several { numbers } else { Vec::new() };
        Ok(cut)
    }
}

impl Cut {
    /// The number of a fabric, which is new or known.
    fn number(&mut self, fabric: &Option<Fabric>) -> u16 {
        let known = self.fabrics.iter().position(|known| known == fabric);
        let number = known.unwrap_or(self.fabrics.len());
        if known.is_none() {
            self.fabrics.push(fabric.clone());
        }
        number as u16
    }

    /// Takes in what another garment of `more` triangles is cut from, before its rest shape is joined to this one's of `own`.
    pub(super) fn join(&mut self, outer: Self, of_outer: &RestShape, rest: &mut RestShape, [own, more]: [usize; 2]) {
        let numbers: Vec<u16> = outer.fabrics.iter().map(|fabric| self.number(fabric)).collect();
        if self.fabrics.len() > 1 {
            rest.cut_from.resize(own, 0);
            rest.cut_from.extend((0..more).map(|t| numbers[of_outer.fabric_of(t)]));
        }
        self.swatches.extend(outer.swatches);
    }
}

impl Scene {
    /// The fabrics that its rest shape numbers, `of_settings` being that of what names none itself.
    #[must_use]
    pub fn fabrics(&self, of_settings: &Fabric) -> Vec<Fabric> {
        self.own_fabrics.iter().map(|own| own.as_ref().unwrap_or(of_settings).clone()).collect()
    }

    /// The number of the fabric of each vertex, of several the last.
    #[must_use]
    pub(crate) fn fabric_of_vertices(&self) -> Vec<u16> {
        let mut fabric = vec![0; self.garment.vertex_count()];
        for (t, triangle) in self.garment.triangles.iter().enumerate() {
            let of = self.rest.fabric_of(t) as u16;
            triangle.iter().for_each(|&v| fabric[v as usize] = of.max(fabric[v as usize]));
        }
        fabric
    }

    /// What they are called, in one line.
    #[must_use]
    pub fn fabric_names(&self, of_settings: &Fabric) -> String {
        let names = self.own_fabrics.iter().map(|own| own.as_ref().unwrap_or(of_settings).name.as_str());
        names.collect::<Vec<_>>().join(" + ")
    }

    /// Whether any of it is cut from the fabric of the settings.
    #[must_use]
    pub fn takes_the_settings_fabric(&self) -> bool {
        self.own_fabrics.contains(&None)
    }
}

impl std::fmt::Display for Swatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: ", self.garment)?;
        match &self.fabric {
            Some(fabric) => write!(f, "{fabric}")?,
            None => f.write_str("the fabric of the settings")?,
        }
        if !self.panels.is_empty() {
            write!(f, " for {}", listed(&self.panels))?;
        }
        self.by.as_ref().map_or(Ok(()), |file| write!(f, ", by {file}"))
    }
}

impl From<CutError> for SceneError {
    fn from(error: CutError) -> Self {
        Self::Cut(Box::new(error))
    }
}
