//! A session over HTTP: a page with the viewer in it, an API for scripts, a stream for pages. `assets/live/http.md` describes it.
//!
//! One thread serves, another encodes for viewers; the session waits for neither. Only the newest of everything is kept: a client
//! that reads slowly skips states, and one that does not read holds one piece until its connection is closed.
//!
//! Limits: HTTP without TLS. On addresses that other machines reach, a token is needed, but it crosses the network unencrypted: put
//! a proxy with TLS in front, or use a tunnel.

mod access;
mod events;
mod garment;
mod pieces;
mod report;
mod routes;
mod server;

use std::net::{IpAddr, SocketAddr};

use glam::DVec3;

pub use access::random_token;
pub use server::LiveServer;

pub use crate::record::Limits;
use crate::scene::FileRole;

/// How a session is served.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// The address to listen on.
    pub address: SocketAddr,
    /// A host name that requests may use besides addresses and `localhost`.
    pub host: Option<String>,
    /// Token for control; may be none on a loopback address.
    pub control: Option<String>,
    /// Token for reading alone.
    pub read_only: Option<String>,
    /// Files that requests may name, each in its field: those of the command line. A request opens no other file.
    pub files: Vec<(FileRole, String)>,
    /// Limits of connections.
    pub limits: Limits,
    /// Name of the session in the viewer.
    pub name: String,
    /// The direction in which the wearer looks.
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
