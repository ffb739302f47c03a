//! `partwise live`: a page with the range table beside the viewer, and an HTTP interface for scripts.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::thread::JoinHandle;

use crate::Job;
use crate::live::{Limits, LiveError, LiveOptions, LiveServer, random_token};
use crate::record::RecordSummary;
use crate::scene::FileRole;
use crate::session::{Session, Worker};
use clap::Args;

use super::runtime::use_threads;
use super::session_recorder::GLANCE;
use super::sinks::SeenFrom;
use super::{InputArgs, SinkArgs, StageArgs, browser, console, interrupt, session_recorder};

/// Port of the page unless another is given, if it is free: an open page then finds the program when it is run again.
const PORT: u16 = 7279;

pub(crate) const LONG_ABOUT: &str = "\
Serves a page: the Rerun viewer in the middle, the range table beside it. Drag a bound, change the fabric, a measurement or \
the garment, and PARTs, forces and drape follow; let go, and the drape comes to rest.

The same by HTTP, for scripts and editors.";

pub(crate) const HTTP: &str = include_str!("../../assets/live/http.md");

/// Arguments of `live`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LiveArgs {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    stages: StageArgs,
    /// Port of the page; 0 takes any free one [default: 7279, or any where that is taken]
    #[arg(long, visible_alias = "web-port", value_name = "PORT", help_heading = "Page")]
    port: Option<u16>,
    /// Address to listen on; others than loopback ones need a token, which is made and printed
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), help_heading = "Page")]
    bind: IpAddr,
    /// A name of this machine that browsers may use besides its addresses
    #[arg(long, value_name = "NAME", help_heading = "Page")]
    host: Option<String>,
    /// Token for control, 16 characters at least [default: a random one where --bind needs it]
    #[arg(long, value_name = "TOKEN", env = "PARTWISE_TOKEN", hide_env_values = true, help_heading = "Page")]
    token: Option<String>,
    /// Open the page in your browser
    #[arg(long, help_heading = "Page")]
    open: bool,
    /// Begin every drape at the undraped garment, as `run` does: slower, and the same bits
    #[arg(long, help_heading = "Stages")]
    cold: bool,
    /// Keep the session as a timeline of its edits, for `partwise view`
    #[arg(long, value_name = "FILE.rrd", help_heading = "Recording")]
    record: Option<PathBuf>,
    /// Send the same to a viewer elsewhere, which may come and go, e.g. rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL", help_heading = "Recording")]
    connect: Option<String>,
    /// Where the views look from
    #[arg(long, value_enum, default_value_t = SeenFrom::Front, help_heading = "Page")]
    seen_from: SeenFrom,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Page")]
    threads: Option<usize>,
}

impl LiveArgs {
    /// Serves until Ctrl-C.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        interrupt::keep();
        self.stages.dials.cloth.only("live")?;
        let job = Job { scene: self.input.spec()?, settings: self.stages.settings()?, ..Job::default() };
        job.scene.check_names()?;
        if job.scene.names_of_fabrics().is_some() {
            self.stages.dials.cloth.check_used(&self.input.load(&job.scene)?)?;
        }
        let session = Session::new(job.clone(), !self.cold);
        let options = self.options(&job)?;
        let server = self.serve(&session, &options)?;
        self.print(server.address(), &options);
        let worker = {
            let (session, mut worker) = (session.clone(), Worker::new(self.input.meshes()));
            std::thread::spawn(move || worker.run(&session))
        };
        let (recorder, shower) = (self.keep(&session), self.show(&session));
        let mut shown = None;
        while !interrupt::requested() && !worker.is_finished() {
            std::thread::sleep(GLANCE);
            // HTTP clients do not get the reason, which may quote the file.
            let refused =
                session.snapshot().refused.filter(|refused| refused.file.is_some() && shown != Some(refused.state));
            if let Some(refused) = refused {
                console::error(&anyhow::Error::msg(refused.sentence.clone()));
                shown = Some(refused.state);
            }
        }
        session.close();
        drop(server);
        let worked = worker.join();
        let (recorded, shown) = (recorder.map(JoinHandle::join), shower.map(JoinHandle::join));
        if worked.is_err() || matches!(recorded, Some(Err(_))) || matches!(shown, Some(Err(_))) {
            anyhow::bail!("the session broke off; this is a mistake of the program");
        }
        if let Some(Ok(summary)) = recorded {
            console::notes(summary?.file_line().as_slice());
        }
        Ok(())
    }

    fn serve(&self, session: &Session, options: &LiveOptions) -> Result<LiveServer, LiveError> {
        match LiveServer::start(session, options) {
            Err(LiveError::Address { .. }) if self.port.is_none() => {
                let address = SocketAddr::new(self.bind, 0);
                LiveServer::start(session, &LiveOptions { address, ..options.clone() })
            }
            other => other,
        }
    }

    fn options(&self, job: &Job) -> anyhow::Result<LiveOptions> {
        let far = !self.bind.is_loopback();
        let control = match &self.token {
            Some(token) => Some(token.clone()),
            None if far => Some(random_token()?),
            None => None,
        };
        let onlooker = control.as_ref().map(|_| random_token()).transpose()?;
        let mut files: Vec<_> =
            job.scene.file_names().into_iter().map(|(role, name)| (role, name.to_owned())).collect();
        files.push((FileRole::Table, self.stages.table.clone()));
        files.extend(self.stages.dials.cloth.fabric.iter().map(|name| (FileRole::Fabric, name.clone())));
        Ok(LiveOptions {
            address: SocketAddr::new(self.bind, self.port.unwrap_or(PORT)),
            host: self.host.clone(),
            control,
            onlooker,
            files,
            limits: Limits::default(),
            name: format!("live {}", job.scene.garment_name()),
            front: self.seen_from.direction(),
        })
    }

    fn print(&self, address: SocketAddr, options: &LiveOptions) {
        let name = match &self.host {
            Some(name) => format!("{name}:{}", address.port()),
            None => address.to_string(),
        };
        let page = match &options.control {
            None => format!("http://{name}/"),
            Some(control) => with_token(&name, control),
        };
        console::result(&page);
        if let (Some(_), Some(onlooker)) = (&options.control, &options.onlooker) {
            console::note(&format!("to look on only: {}", with_token(&name, onlooker)));
        }
        console::note("open this address in a browser, or see `partwise live --help` for curl; Ctrl-C ends");
        if address.ip().is_unspecified() {
            console::note("0.0.0.0 is every address of this machine: others need one of these instead");
        }
        if self.open {
            browser::open(&page);
        }
    }

    /// Records each finished state in a file, on a thread of its own; a slow disk makes it skip states.
    fn keep(&self, session: &Session) -> Option<JoinHandle<anyhow::Result<RecordSummary>>> {
        let file = self.record.clone()?;
        let sinks = SinkArgs { save: Some(file), seen_from: self.seen_from, ..SinkArgs::default() };
        let session = session.clone();
        Some(std::thread::spawn(move || session_recorder::keep(&session, &sinks)))
    }

    /// Sends each finished state to a remote viewer, on a thread of its own, so that a slow or lost viewer delays nothing.
    fn show(&self, session: &Session) -> Option<JoinHandle<()>> {
        let connect = Some(self.connect.clone()?);
        let sinks = SinkArgs { no_save: true, connect, seen_from: self.seen_from, ..SinkArgs::default() };
        let session = session.clone();
        Some(std::thread::spawn(move || session_recorder::show(&session, &sinks)))
    }
}

/// The address of the page with a token, which may hold characters that mean something else in an address.
fn with_token(host: &str, token: &str) -> String {
    let token: String = form_urlencoded::byte_serialize(token.as_bytes()).collect();
    format!("http://{host}/?token={token}")
}
