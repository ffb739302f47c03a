//! Arguments for the destinations of a recording, shared by the commands that record.

use std::path::{Path, PathBuf};

use crate::base::atomic_file::same_place;
use crate::base::files::has_ending;
use crate::mesh::export::ENDINGS;
use crate::record::Sink;
use clap::{Args, ValueEnum};
use glam::DVec3;

use super::console;
use super::runtime::{check, refuse};

/// Direction from which the views of a recording show the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum SeenFrom {
    /// From the front
    #[default]
    Front,
    /// From the wearer's left
    Side,
    /// From behind
    Back,
}

impl SeenFrom {
    /// The direction from the body towards the eye. The built-in form faces −y, as most body meshes do.
    pub(crate) fn direction(self) -> DVec3 {
        match self {
            Self::Front => DVec3::NEG_Y,
            Self::Side => DVec3::X,
            Self::Back => DVec3::Y,
        }
    }
}

/// Parses the name of an exported garment.
pub(crate) fn mesh_file(path: PathBuf) -> Result<PathBuf, String> {
    match path.extension() {
        Some(ending) if !ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)) => Err(format!(
            "found the ending `.{}`, expected `.obj`, `.ply`, `.glb` or `.usda`: garments are written as OBJ, PLY, glTF or USD",
            ending.display()
        )),
        _ => Ok(path),
    }
}

/// Refuses a recording without the ending `.rrd`: `--save notes.txt` would replace a file of another program.
fn recording_file(path: &Path) -> anyhow::Result<()> {
    let device = std::fs::metadata(path).is_ok_and(|found| !found.is_file());
    if device || has_ending(path, "rrd") {
        return Ok(());
    }
    refuse!("{}: found a recording without the ending `.rrd`, expected one; add it", path.display())
}

/// The sinks of a recording; several can be combined.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Recording")]
pub(crate) struct SinkArgs {
    /// Write the recording to this file [default: GARMENT.rrd in recordings/, recordings/compare/ or the folder of the rows]
    #[arg(long, value_name = "FILE", conflicts_with = "no_save")]
    pub(crate) save: Option<PathBuf>,
    /// Write no recording file
    #[arg(long)]
    pub(crate) no_save: bool,
    /// Open the native Rerun viewer (`rerun` must be on the PATH)
    #[arg(long)]
    pub(crate) spawn: bool,
    /// Stream to a viewer that is already running, e.g. rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL")]
    pub(crate) connect: Option<String>,
    /// Serve the bundled web viewer on 127.0.0.1 and print its address
    #[arg(long)]
    pub(crate) serve: bool,
    /// Direction of the views when the recording opens
    #[arg(long, value_enum, default_value_t = SeenFrom::Front)]
    pub(crate) seen_from: SeenFrom,
    /// Port of the served page; 0 picks a free one [default: 7278, or a free one if it is in use]
    #[arg(long, visible_alias = "port", value_name = "PORT")]
    pub(crate) web_port: Option<u16>,
    /// Additional port on which viewers can read the recording
    #[arg(long, value_name = "PORT")]
    pub(crate) grpc_port: Option<u16>,
    /// Megabytes of steps kept in memory for pages that open later; the oldest steps are dropped first
    #[arg(long, value_name = "MB", default_value_t = 256)]
    pub(crate) history: u64,
}

impl SinkArgs {
    /// Refuses outputs that cannot be written, that share a file, or that would replace an input, before anything is read or computed.
    /// `outputs` are the command's outputs other than `--save`, by flag.
    pub(crate) fn check_outputs(&self, outputs: &[(&str, Option<&Path>)]) -> anyhow::Result<()> {
        let all = std::iter::once(("--save", self.save.as_deref())).chain(outputs.iter().copied());
        let given: Vec<(&str, &Path)> = all.filter_map(|(flag, path)| Some((flag, path?))).collect();
        for (i, (flag, path)) in given.iter().enumerate() {
            if let Some((other, _)) = given[..i].iter().find(|(_, before)| same_place(before, path)) {
                let path = path.display();
                refuse!(
                    "{path}: found both {other} and {flag} writing here, expected two files; give one another name"
                );
            }
        }
        if let Some(path) = &self.save {
            recording_file(path)?;
            Sink::File(path.clone()).check()?;
        }
        outputs.iter().filter_map(|(flag, path)| Some((flag, (*path)?))).try_for_each(|(flag, path)| check(path, flag))
    }

    /// Refuses a recording that cannot be written, before anything is computed, and notes one of an earlier run that will be replaced.
    pub(crate) fn refuse_unwritable(&self, name: &str) -> anyhow::Result<()> {
        for sink in self.sinks(name) {
            sink.check()?;
            if let (Sink::File(path), None) = (&sink, &self.save)
                && path.is_file()
            {
                console::note(&format!(
                    "{}: replaces the recording of an earlier run; --save FILE.rrd writes another file, --no-save none",
                    path.display()
                ));
            }
        }
        Ok(())
    }

    /// The sinks; `name` is the default name of the file, in `recordings/`.
    pub(crate) fn sinks(&self, name: &str) -> Vec<Sink> {
        self.sinks_in(Path::new("recordings"), name)
    }

    /// The sinks, with the default file in `folder`.
    pub(crate) fn sinks_in(&self, folder: &Path, name: &str) -> Vec<Sink> {
        let mut sinks = Vec::new();
        if !self.no_save {
            let default = || folder.join(format!("{name}.rrd"));
            sinks.push(Sink::File(self.save.clone().unwrap_or_else(default)));
        }
        if self.spawn {
            sinks.push(Sink::Spawn);
        }
        if let Some(url) = &self.connect {
            sinks.push(Sink::Connect(url.clone()));
        }
        if self.serve {
            let history_bytes = self.history.saturating_mul(1 << 20);
            sinks.push(Sink::Serve { web_port: self.web_port, grpc_port: self.grpc_port, history_bytes });
        }
        sinks
    }
}
