//! The file that names the fabrics of a garment's panels, and what can be wrong with it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use crate::base::files::{Unreadable, line_of, listed, names_a_file, read_text};
use crate::garment::fabric::{Fabric, FabricError};

/// What a file that names the fabrics of panels is called, beside the garment's.
pub(super) const BESIDE: &str = "fabrics.toml";

/// Why it is not known what a garment is cut from.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum CutError {
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A file of something else.
    #[error("{file}: {reason}\nexpected default = \"FABRIC\", and under [panels] lines such as left_cuff = \"FABRIC\"")]
    Syntax { file: String, reason: String },
    /// A fabric that is none.
    #[error("{file}, line {line}, {key}: {source}")]
    Fabric { file: String, line: usize, key: String, source: FabricError },
    /// The same on the command line.
    #[error(transparent)]
    Given(#[from] FabricError),
    /// A panel that is not there.
    #[error(
        "{file}, line {line}: found no panel `{found}` in {garment}, expected {}",
        if known.is_empty() { "none: it has neither panels nor groups".to_owned() } else { format!("one of {}", listed(known)) }
    )]
    Panel { file: String, line: usize, garment: String, found: String, known: Vec<String> },
    /// A panel that fits two lines.
    #[error("{file}: panel `{panel}` fits both {first} and {second}, of different fabrics; give it a line of its own")]
    Both { file: String, panel: String, first: String, second: String },
    /// A garment with two fabrics for what is not named.
    #[error(
        "{garment}: {file} says default = \"{default}\", and --fabric says {fabric} for the same; take one of them away"
    )]
    Twice { garment: String, file: String, default: String, fabric: String },
    /// Fabrics that do not go round.
    #[error("found {fabrics} fabrics for {garments} garments, expected one for all, or one for each in the same order")]
    Count { fabrics: usize, garments: usize },
    /// One file for several garments.
    #[error(
        "--fabrics {file}: found {garments} garments, expected one; put a file beside each garment's own, GARMENT.{BESIDE}"
    )]
    Whose { file: String, garments: usize },
    /// A fabric that nothing is cut from.
    #[error(
        "--fabric {fabric}: found nothing to cut from it, every panel has its own ({by}); take --fabric away, or `default` there"
    )]
    Unused { fabric: String, by: String },
}

/// The file, as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    default: Option<Spanned<String>>,
    #[serde(default)]
    panels: BTreeMap<Spanned<String>, Spanned<String>>,
}

/// Such a file, read.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelFabrics {
    /// What it is called.
    pub file: String,
    /// The fabric of every panel that is not named.
    pub default: Option<Fabric>,
    /// A panel's name, or one with `*` in it, and its line.
    pub panels: Vec<(String, usize, Fabric)>,
}

impl PanelFabrics {
    pub(super) fn read(path: &Path) -> Result<Self, CutError> {
        Self::parse(&read_text(path)?, path)
    }

    /// Reads it from TOML; `path` is named in errors, and fabrics' files count from its folder.
    ///
    /// # Errors
    /// [`CutError`] names the file, its line, and what was expected.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CutError> {
        let file = path.display().to_string();
        let written: Written = toml::from_str(text)
            .map_err(|e| CutError::Syntax { file: file.clone(), reason: e.to_string().trim_end().to_owned() })?;
        let fabric = |key: &str, name: &Spanned<String>| {
            let place = |source| {
                let line = line_of(text, name.span().start);
                CutError::Fabric { file: file.clone(), line, key: key.to_owned(), source }
            };
            Fabric::by_name(&beside(path, name.get_ref())).map_err(place)
        };
        let default = written.default.as_ref().map(|name| fabric("default", name)).transpose()?;
        let panel = |(panel, name): (&Spanned<String>, &Spanned<String>)| {
            let (line, panel) = (line_of(text, panel.span().start), panel.get_ref());
            Ok((panel.clone(), line, fabric(&format!("panels.{panel}"), name)?))
        };
        let panels = written.panels.iter().map(panel).collect::<Result<Vec<_>, CutError>>()?;
        Ok(Self { file, default, panels })
    }

    /// The fabric of a panel; none where none is said.
    ///
    /// # Errors
    /// [`CutError::Both`] where it fits two lines.
    pub fn of(&self, panel: &str) -> Result<Option<&Fabric>, CutError> {
        if let Some((.., fabric)) = self.panels.iter().find(|(name, ..)| name == panel) {
            return Ok(Some(fabric));
        }
        let mut fitting = self.panels.iter().filter(|(name, ..)| fits(name, panel));
        let Some((first, _, fabric)) = fitting.next() else { return Ok(self.default.as_ref()) };
        match fitting.find(|(.., other)| other != fabric) {
            None => Ok(Some(fabric)),
            Some((second, ..)) => Err(CutError::Both {
                file: self.file.clone(),
                panel: panel.to_owned(),
                first: first.clone(),
                second: second.clone(),
            }),
        }
    }
}

/// Whether a name fits one with `*` in it, each for any letters or none.
pub(super) fn fits(pattern: &str, name: &str) -> bool {
    let mut parts: Vec<&str> = pattern.split('*').collect();
    let Some(mut left) = name.strip_prefix(parts.remove(0)) else { return false };
    let Some(last) = parts.pop() else { return left.is_empty() };
    for part in parts {
        let Some(at) = left.find(part) else { return false };
        left = &left[at + part.len()..];
    }
    left.ends_with(last)
}

/// The fabrics' files that the file at `path` names, as far as it can be read.
pub(super) fn files_named_in(path: &Path) -> Vec<PathBuf> {
    let written = read_text(path).ok().and_then(|text| toml::from_str::<Written>(&text).ok());
    let names = written.iter().flat_map(|w| w.panels.values().chain(&w.default));
    names.filter(|name| names_a_file(name.get_ref())).map(|name| beside(path, name.get_ref()).into()).collect()
}

/// A fabric's name as it is, or its file's path from where the program runs.
pub(super) fn beside(file: &Path, name: &str) -> String {
    if names_a_file(name) { file.with_file_name(name).display().to_string() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_letters() {
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
            assert_eq!(fits(pattern, name), fit, "{pattern} {name}");
        }
    }
}
