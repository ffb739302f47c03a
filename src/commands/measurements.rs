//! The dress form's measurements: a TOML file, and flags over it.

use std::path::{Path, PathBuf};

use crate::base::files::read_text;
use crate::body::BodySpec;
use anyhow::Context as _;
use clap::Args;

/// Measurements of the built-in dress form, in centimetres. What is left out is European size 38.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Dress form (centimetres; European size 38 unless given)")]
pub(crate) struct MeasurementArgs {
    /// TOML file of measurements; the flags below go over it
    #[arg(long, value_name = "FILE.toml")]
    measurements: Option<PathBuf>,
    /// Height of the crown
    #[arg(long, value_name = "CM")]
    stature: Option<f64>,
    /// Girth of the bust
    #[arg(long, value_name = "CM")]
    bust: Option<f64>,
    /// Girth right below the bust
    #[arg(long, value_name = "CM")]
    underbust: Option<f64>,
    /// Girth of the waist
    #[arg(long, value_name = "CM")]
    waist: Option<f64>,
    /// Girth of the hip
    #[arg(long, value_name = "CM")]
    hip: Option<f64>,
    /// Any other measurement by its name in the file, e.g. `--measure neck=33`
    #[arg(long = "measure", value_name = "NAME=CM", value_parser = named)]
    others: Vec<(String, f64)>,
}

fn named(text: &str) -> Result<(String, f64), String> {
    let (name, cm) = text.split_once('=').ok_or("expected NAME=CM, e.g. neck=33")?;
    let cm = cm.trim().parse().map_err(|_| format!("`{cm}` is no number of centimetres"))?;
    Ok((name.trim().to_owned(), cm))
}

impl MeasurementArgs {
    /// The file, for `--watch`.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.measurements.as_deref()
    }

    /// Where measurements that make no body were given, for the messages.
    pub(crate) fn place(&self) -> String {
        let flags = "--bust, --waist, --measure and the like";
        self.file().map_or_else(|| flags.to_owned(), |file| format!("{}, or {flags}", file.display()))
    }

    /// File and flags together.
    pub(crate) fn spec(&self) -> anyhow::Result<BodySpec> {
        let mut spec = match &self.measurements {
            None => BodySpec::default(),
            Some(file) => BodySpec::from_toml(&read_text(file)?).with_context(|| format!("{}", file.display()))?,
        };
        let flags = [
            ("stature", self.stature),
            ("bust", self.bust),
            ("underbust", self.underbust),
            ("waist", self.waist),
            ("hip", self.hip),
        ];
        let given = flags.into_iter().filter_map(|(name, cm)| Some((name, cm?)));
        for (name, cm) in given.chain(self.others.iter().map(|(name, cm)| (name.as_str(), *cm))) {
            spec = spec.with(name, cm)?;
        }
        Ok(spec)
    }
}
