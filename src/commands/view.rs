//! `partwise view`: any recording in the bundled web viewer.

use std::path::PathBuf;

use clap::Args;
use partwise::record::web;

use super::{console, interrupt};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// The recording
    #[arg(value_name = "FILE.rrd")]
    file: PathBuf,
    /// Port of the page [default: any free one]
    #[arg(long, value_name = "PORT")]
    web_port: Option<u16>,
    /// Port the page reads the recording from [default: any free one]
    #[arg(long, value_name = "PORT")]
    grpc_port: Option<u16>,
}

impl ViewArgs {
    /// Serves until Ctrl-C.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        interrupt::listen();
        let served = web::serve_file(&self.file, self.web_port, self.grpc_port)?;
        console::result(served.url());
        console::note("open this address in a browser; Ctrl-C ends");
        interrupt::wait();
        Ok(())
    }
}
