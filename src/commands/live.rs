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

use super::console;
use super::inputs::InputArgs;
use super::runtime::{interrupted, keep_results, use_threads};
use super::sinks::{SeenFrom, SinkArgs};
use super::solved::{POLL, record_session, show_session};
use super::stages::StageArgs;
use super::view::open_browser;

/// Default port of the page, if it is free, so that an open page reconnects when the program is started again.
const PORT: u16 = 7279;

pub(crate) const HTTP: &str = include_str!("../../assets/live/http.md");

/// Arguments of `live`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LiveArgs {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    stages: StageArgs,
    /// Port of the page; 0 picks a free one [default: 7279, or a free one if it is in use]
    #[arg(long, visible_alias = "web-port", value_name = "PORT", help_heading = "Page")]
    port: Option<u16>,
    /// Address to listen on; an address other than a loopback address requires a token, which is generated and printed
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), help_heading = "Page")]
    bind: IpAddr,
    /// Name of this machine that browsers may use besides its addresses
    #[arg(long, value_name = "NAME", help_heading = "Page")]
    host: Option<String>,
    /// Token for editing, at least 16 characters [default: a random one if --bind requires it]
    #[arg(long, value_name = "TOKEN", env = "PARTWISE_TOKEN", hide_env_values = true, help_heading = "Page")]
    token: Option<String>,
    /// Open the page in your browser
    #[arg(long, help_heading = "Page")]
    open: bool,
    /// Start every drape from the undraped garment: slower, but bit-identical to `run`
    #[arg(long, help_heading = "Stages")]
    cold: bool,
    /// Record the session as a timeline of its edits, for `partwise view`
    #[arg(long, value_name = "FILE.rrd", help_heading = "Recording")]
    record: Option<PathBuf>,
    /// Also stream the session to a remote viewer, which may disconnect and reconnect, e.g. rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL", help_heading = "Recording")]
    connect: Option<String>,
    /// Direction of the views
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
        keep_results();
        let fabric = &self.stages.model.fabric;
        fabric.check_single("live")?;
        let job = Job { scene: self.input.spec()?, settings: self.stages.settings()?, ..Job::default() };
        job.scene.check_names()?;
        if job.scene.names_of_fabrics().is_some() {
            fabric.check_used(&self.input.load(&job.scene)?)?;
        }
        let session = Session::new(job.clone(), !self.cold);
        let options = self.options(&job)?;
        let server = self.serve(&session, &options)?;
        self.print(server.address(), &options);
        let worker = {
            let (session, mut worker) = (session.clone(), Worker::new(self.input.meshes()));
            std::thread::spawn(move || worker.run(&session))
        };
        let (recorder, remote) = (self.record(&session), self.stream(&session));
        let mut reported = None;
        while !interrupted() && !worker.is_finished() {
            std::thread::sleep(POLL);
            // The reason may quote the file, so it is printed here and withheld from HTTP clients.
            let refused = session.snapshot().refused.filter(|r| r.file.is_some() && reported != Some(r.state));
            if let Some(refused) = refused {
                console::error(&anyhow::Error::msg(refused.sentence.clone()));
                reported = Some(refused.state);
            }
        }
        session.close();
        drop(server);
        let worked = worker.join();
        let (recorded, streamed) = (recorder.map(JoinHandle::join), remote.map(JoinHandle::join));
        if worked.is_err() || matches!(recorded, Some(Err(_))) || matches!(streamed, Some(Err(_))) {
            anyhow::bail!("the session ended unexpectedly; this is a defect of the program");
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
        let control = match &self.token {
            Some(token) => Some(token.clone()),
            None if !self.bind.is_loopback() => Some(random_token()?),
            None => None,
        };
        let read_only = control.as_ref().map(|_| random_token()).transpose()?;
        let mut files: Vec<_> =
            job.scene.file_names().into_iter().map(|(role, name)| (role, name.to_owned())).collect();
        files.push((FileRole::Table, self.stages.table.clone()));
        files.extend(self.stages.model.fabric.fabric.iter().map(|name| (FileRole::Fabric, name.clone())));
        Ok(LiveOptions {
            address: SocketAddr::new(self.bind, self.port.unwrap_or(PORT)),
            host: self.host.clone(),
            control,
            read_only,
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
        if let (Some(_), Some(read_only)) = (&options.control, &options.read_only) {
            console::note(&format!("read-only access: {}", with_token(&name, read_only)));
        }
        console::note("open this address in a browser, or see `partwise live --help` for curl; Ctrl-C ends");
        if address.ip().is_unspecified() {
            console::note("0.0.0.0 stands for every address of this machine: from another machine, open one of those");
        }
        if self.open {
            open_browser(&page);
        }
    }

    /// Records each finished state in a file, on a separate thread; with a slow disk, states are skipped.
    fn record(&self, session: &Session) -> Option<JoinHandle<anyhow::Result<RecordSummary>>> {
        let file = self.record.clone()?;
        let sinks = SinkArgs { save: Some(file), seen_from: self.seen_from, ..SinkArgs::default() };
        let session = session.clone();
        Some(std::thread::spawn(move || record_session(&session, &sinks)))
    }

    /// Streams each finished state to a remote viewer, on a separate thread, so that a slow or lost viewer delays nothing.
    fn stream(&self, session: &Session) -> Option<JoinHandle<()>> {
        let connect = Some(self.connect.clone()?);
        let sinks = SinkArgs { no_save: true, connect, seen_from: self.seen_from, ..SinkArgs::default() };
        let session = session.clone();
        Some(std::thread::spawn(move || show_session(&session, &sinks)))
    }
}

/// The address of the page with a token, percent-encoded.
fn with_token(host: &str, token: &str) -> String {
    let token: String = form_urlencoded::byte_serialize(token.as_bytes()).collect();
    format!("http://{host}/?token={token}")
}
