//! The fabric of each garment and panel: one fabric per garment, or a file that names those of its panels.
//!
//! ```toml
//! default = "interlock"        # every panel that is not named; without it these take the fabric of the settings
//! [panels]
//! left_cuff = "denim"          # a built-in fabric
//! "right_*" = "rib.toml"       # or a file, beside this one; * matches any letters
//! ```
//!
//! A panel's own line takes precedence over lines with a `*`. The panels of a mesh from a file are its groups.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::base::files::{Unreadable, line_of, listed, names_a_file, read_text};
use crate::garment::fabric::{Fabric, FabricError};
use crate::mesh::{RestShape, TriMesh};

/// Ending of the file beside a garment's that names the fabrics of its panels.
pub(super) const FABRICS_ENDING: &str = "fabrics.toml";

/// Why fabrics cannot be assigned to a garment.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum CutError {
    /// A file cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A file does not have the expected contents.
    #[error("{file}: {reason}\nexpected default = \"FABRIC\", and under [panels] lines such as left_cuff = \"FABRIC\"")]
    Syntax { file: String, reason: String },
    /// The fabric of a line does not exist or cannot be read.
    #[error("{file}, line {line}, {key}: {source}")]
    Fabric { file: String, line: usize, key: String, source: FabricError },
    /// A fabric of the command line does not exist or cannot be read.
    #[error(transparent)]
    Given(#[from] FabricError),
    /// Lines do not match the garment, or several assignments conflict: place, found, expected and remedy.
    #[error("{0}")]
    Unfit(String),
}

/// The panels of a garment that are cut from one fabric.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Swatch {
    /// The garment.
    pub garment: String,
    /// The fabric; `None` is that of the settings.
    pub fabric: Option<String>,
    /// Its panels; empty for the whole garment.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub panels: Vec<String>,
    /// The file that assigns it; `None` for the command line.
    #[serde(skip)]
    pub by: Option<String>,
}

impl Swatch {
    /// The same with the name of its fabric; `default_fabric` if none is assigned.
    pub(crate) fn cut_from(&self, default_fabric: &Fabric) -> Self {
        Self { fabric: self.fabric.clone().or(Some(default_fabric.name.clone())), ..self.clone() }
    }
}

impl std::fmt::Display for Swatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let fabric = self.fabric.as_deref().unwrap_or("the fabric of the settings");
        write!(f, "{}: {fabric}", self.garment)?;
        if !self.panels.is_empty() {
            write!(f, " for {}", listed(&self.panels))?;
        }
        self.by.as_ref().map_or(Ok(()), |file| write!(f, ", by {file}"))
    }
}

/// The fabrics of a garment, in the order of the numbers in its rest shape; `None` is that of the settings.
#[derive(Default)]
pub(super) struct Cut {
    pub(super) fabrics: Vec<Option<Fabric>>,
    pub(super) swatches: Vec<Swatch>,
}

impl Cut {
    /// Assigns a fabric to each triangle of `garment`: the `given` one, or those of the file `names`.
    pub(super) fn new(
        garment: &str,
        given: Option<Fabric>,
        names: Option<PathBuf>,
        mesh: &TriMesh,
        rest: &mut RestShape,
    ) -> Result<Self, CutError> {
        let swatch = |fabric: &Option<Fabric>, panels: Vec<String>, by: Option<String>| {
            let fabric = fabric.as_ref().map(|fabric| fabric.name.clone());
            Swatch { garment: garment.to_owned(), fabric, panels, by }
        };
        let Some(path) = names else {
            let swatches = if given.is_some() { vec![swatch(&given, Vec::new(), None)] } else { Vec::new() };
            return Ok(Self { fabrics: vec![given], swatches });
        };
        let names = PanelFabrics::read(&path)?;
        if let (Some(default), Some(given)) = (&names.default, &given) {
            return Err(CutError::Unfit(format!(
                "{garment}: {} says default = \"{}\", and --fabric says {} for the same; take one of them away",
                names.file, default.name, given.name
            )));
        }
        let unknown = |(name, ..): &&(String, usize, Fabric)| !mesh.groups.iter().any(|group| matches(name, group));
        if let Some((found, line, _)) = names.panels.iter().find(unknown) {
            let expected = match &mesh.groups[..] {
                [] => "none: it has neither panels nor groups".to_owned(),
                known => format!("one of {}", listed(known)),
            };
            let file = &names.file;
            return Err(CutError::Unfit(format!(
                "{file}, line {line}: found no panel `{found}` in {garment}, expected {expected}"
            )));
        }
        let own = |panel: &String| Ok(names.of(panel)?.or(given.as_ref()).cloned());
        let of_group = mesh.groups.iter().map(own).collect::<Result<Vec<_>, CutError>>()?;
        let unnamed = names.default.as_ref().or(given.as_ref()).cloned();
        let mut cut = Self::default();
        let of_triangle = (0..mesh.triangles.len()).map(|t| {
            let group = mesh.triangle_group.get(t).map(|&group| group as usize);
            cut.number(group.map_or(&unnamed, |group| &of_group[group]))
        });
        let numbers: Vec<u16> = of_triangle.collect();
        let several = cut.fabrics.len() > 1;
        let panels = |fabric: &Option<Fabric>| {
            let named = mesh.groups.iter().zip(&of_group).filter(|(_, of)| several && *of == fabric);
            named.map(|(panel, _)| panel.clone()).collect()
        };
        cut.swatches =
            cut.fabrics.iter().map(|fabric| swatch(fabric, panels(fabric), Some(names.file.clone()))).collect();
        rest.cut_from = if several { numbers } else { Vec::new() };
        Ok(cut)
    }

    /// The number of a fabric, which is appended if it is new.
    fn number(&mut self, fabric: &Option<Fabric>) -> u16 {
        let known = self.fabrics.iter().position(|known| known == fabric);
        let number = known.unwrap_or(self.fabrics.len());
        if known.is_none() {
            self.fabrics.push(fabric.clone());
        }
        number as u16
    }

    /// Adds the fabrics of another garment, of `more` triangles, before its rest shape is joined to this one's of `own`.
    pub(super) fn join(&mut self, outer: Self, of_outer: &RestShape, rest: &mut RestShape, [own, more]: [usize; 2]) {
        let numbers: Vec<u16> = outer.fabrics.iter().map(|fabric| self.number(fabric)).collect();
        if self.fabrics.len() > 1 {
            rest.cut_from.resize(own, 0);
            rest.cut_from.extend((0..more).map(|t| numbers[of_outer.fabric_of(t)]));
        }
        self.swatches.extend(outer.swatches);
    }
}

/// The contents of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    default: Option<Spanned<String>>,
    #[serde(default)]
    panels: BTreeMap<Spanned<String>, Spanned<String>>,
}

/// A parsed file of panels' fabrics.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelFabrics {
    /// Its path.
    pub file: String,
    /// The fabric of every panel that is not named.
    pub default: Option<Fabric>,
    /// Panels' names, or patterns with `*`, with their lines and fabrics.
    pub panels: Vec<(String, usize, Fabric)>,
}

impl PanelFabrics {
    fn read(path: &Path) -> Result<Self, CutError> {
        Self::parse(&read_text(path)?, path)
    }

    /// Parses the TOML text of the file at `path`, which errors name; paths of fabric files are relative to its folder.
    ///
    /// # Errors
    /// [`CutError`] names the file, its line, and the expected content.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CutError> {
        let file = path.display().to_string();
        let written: Written = toml::from_str(text)
            .map_err(|e| CutError::Syntax { file: file.clone(), reason: e.to_string().trim_end().to_owned() })?;
        let fabric = |key: &str, name: &Spanned<String>| {
            let located = |source| {
                let line = line_of(text, name.span().start);
                CutError::Fabric { file: file.clone(), line, key: key.to_owned(), source }
            };
            Fabric::by_name(&beside(path, name.get_ref())).map_err(located)
        };
        let default = written.default.as_ref().map(|name| fabric("default", name)).transpose()?;
        let panel = |(panel, name): (&Spanned<String>, &Spanned<String>)| {
            let (line, panel) = (line_of(text, panel.span().start), panel.get_ref());
            Ok((panel.clone(), line, fabric(&format!("panels.{panel}"), name)?))
        };
        let panels = written.panels.iter().map(panel).collect::<Result<Vec<_>, CutError>>()?;
        Ok(Self { file, default, panels })
    }

    /// The fabric of a panel; `None` if neither a line nor a default assigns one.
    ///
    /// # Errors
    /// [`CutError::Unfit`] if the panel matches two lines of different fabrics.
    pub fn of(&self, panel: &str) -> Result<Option<&Fabric>, CutError> {
        if let Some((.., fabric)) = self.panels.iter().find(|(name, ..)| name == panel) {
            return Ok(Some(fabric));
        }
        let mut matching = self.panels.iter().filter(|(name, ..)| matches(name, panel));
        let Some((first, _, fabric)) = matching.next() else { return Ok(self.default.as_ref()) };
        let Some((second, ..)) = matching.find(|(.., other)| other != fabric) else { return Ok(Some(fabric)) };
        Err(CutError::Unfit(format!(
            "{}: panel `{panel}` fits both {first} and {second}, of different fabrics; add a line for this panel",
            self.file
        )))
    }
}

/// Whether a name matches a pattern in which each `*` stands for any number of letters.
fn matches(pattern: &str, name: &str) -> bool {
    let mut parts: Vec<&str> = pattern.split('*').collect();
    let Some(mut left) = name.strip_prefix(parts.remove(0)) else { return false };
    let Some(last) = parts.pop() else { return left.is_empty() };
    for part in parts {
        let Some(at) = left.find(part) else { return false };
        left = &left[at + part.len()..];
    }
    left.ends_with(last)
}

/// The fabric files named in the file at `path`; empty if it cannot be parsed.
pub(super) fn files_named_in(path: &Path) -> Vec<PathBuf> {
    let written = read_text(path).ok().and_then(|text| toml::from_str::<Written>(&text).ok());
    let names = written.iter().flat_map(|w| w.panels.values().chain(&w.default));
    names.filter(|name| names_a_file(name.get_ref())).map(|name| beside(path, name.get_ref()).into()).collect()
}

/// A fabric's name unchanged, or its file's path relative to the working directory.
fn beside(file: &Path, name: &str) -> String {
    if names_a_file(name) { file.with_file_name(name).display().to_string() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_matches_any_letters() {
        for (pattern, name, fit) in [
            ("cuff", "cuff", true),
            ("cuff", "cuffs", false),
            ("*cuff", "left_cuff", true),
            ("*cuff", "left_cuffs", false),
            ("sleeve*", "sleeve", true),
            ("l*_s*_f", "left_sleeve_f", true),
            ("l*_s*_f", "left_sleeve_b", false),
            ("*", "", true),
            ("a*a", "a", false),
            ("", "a", false),
        ] {
            assert_eq!(matches(pattern, name), fit, "{pattern} {name}");
        }
    }
}
