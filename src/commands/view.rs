//! `partwise view`: any recording in the bundled web viewer.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::record::web;
use clap::Args;

use super::{UserError, browser, console, interrupt};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// The recording
    #[arg(value_name = "FILE.rrd")]
    file: PathBuf,
    /// Port of the page; 0 takes any free one [default: 7278, or any where that is taken]
    #[arg(long, visible_alias = "port", value_name = "PORT")]
    web_port: Option<u16>,
    /// A further port on which viewers read the recording, as they do on the page's own
    #[arg(long, value_name = "PORT")]
    grpc_port: Option<u16>,
    /// Open the page in your browser
    #[arg(long)]
    open: bool,
    /// Read the recording and end: what `view` itself runs first
    #[arg(long, hide = true)]
    check: bool,
}

impl ViewArgs {
    /// Serves until Ctrl-C.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if self.check {
            console::warnings(web::check_file(&self.file)?.as_slice());
            return Ok(());
        }
        interrupt::keep();
        self.try_to_read()?;
        // The decoder's panics are returned as errors; their output is of no use.
        let loud = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let served = web::serve_file(&self.file, self.web_port, self.grpc_port);
        std::panic::set_hook(loud);
        let served = served?;
        if let Some(warning) = served.warning() {
            console::warning(warning);
        }
        console::result(served.url());
        console::note("open this address in a browser; Ctrl-C ends");
        if self.open {
            browser::open(served.url());
        }
        interrupt::wait();
        Ok(())
    }

    /// Reads the file in a process of its own. Rerun's decoder trusts the sizes in a file, and a damaged recording can end
    /// the process by an allocation that no error handling sees.
    fn try_to_read(&self) -> anyhow::Result<()> {
        let mut reader = Command::new(std::env::current_exe()?);
        reader.arg("view").arg("--check").arg(&self.file);
        let ended = reader.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status()?;
        // This process reports the errors that the reader returned.
        if matches!(ended.code(), Some(0 | 2)) || interrupt::requested() {
            return Ok(());
        }
        Err(UserError::new(format!(
            "{}: found a damaged recording (its decoder broke off: {ended}), expected an .rrd file as `partwise run --save \
             FILE.rrd` writes; make it again, or copy it again",
            self.file.display()
        )))
    }
}
