//! A session over HTTP: a page with the viewer in it, an API for scripts, a stream for pages. `assets/live/http.md` describes it.
//!
//! One thread serves, another encodes what viewers are sent; the session never waits for either. Of everything only the newest is kept:
//! who reads slowly skips states, and who does not read at all holds one piece and is dropped after a while.
//!
//! Limits: HTTP/1.1 without TLS. On other addresses than this machine's own a token is asked for, but whoever listens on the line reads it: put a
//! proxy with TLS before it, or a tunnel.

mod access;
mod answer;
mod body;
mod events;
mod garment;
mod pieces;
mod report;
mod server;

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

use glam::DVec3;

pub use access::random_token;
pub use server::LiveServer;

/// How a session is served.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// Where to listen.
    pub address: SocketAddr,
    /// A host's name that browsers may know the server by, besides addresses and `localhost`.
    pub host: Option<String>,
    /// Who has it steers. None on this machine's own addresses alone.
    pub control: Option<String>,
    /// Who has it looks on.
    pub onlooker: Option<String>,
    /// Files that edits may name: those of the command line. No other file is opened for a request.
    pub files: Vec<PathBuf>,
    /// Name of the session in the viewer.
    pub name: String,
    /// Where the wearer looks to.
    pub front: DVec3,
}

/// Why a session is not served.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum LiveError {
    /// The address cannot be listened on.
    #[error("{address}: cannot listen there: {source}; choose another port with --port, 0 takes any free one")]
    Address { address: SocketAddr, source: std::io::Error },
    /// An address that others reach, without a token.
    #[error(
        "{0} can be reached from elsewhere: a token is needed for control there; leave --token out and one is made"
    )]
    Open(IpAddr),
    /// A token that others could guess.
    #[error("the token has {0} characters, expected at least 16; leave --token out and one is made")]
    ShortToken(usize),
    /// No server.
    #[error("the server cannot start: {0}")]
    Server(String),
}
