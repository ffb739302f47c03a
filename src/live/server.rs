//! The server: one thread that listens and answers, and one that encodes for viewers, for as long as it lives.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use tokio::sync::{Semaphore, watch};

use super::access::Access;
use super::answer::{Site, respond};
use super::events::MOST_FLOWS;
use super::pieces::Pieces;
use super::{LiveError, LiveOptions};
use crate::record::{Server, name_of_run};
use crate::session::Session;

/// A session, served for as long as this lives.
pub struct LiveServer {
    address: SocketAddr,
    encoder: Option<JoinHandle<()>>,
    pieces: Arc<Pieces>,
    _server: Server,
}

impl LiveServer {
    /// Listens, and serves `session`.
    ///
    /// # Errors
    /// [`LiveError`]: an address that cannot be listened on, or that is open to others without a token.
    pub fn start(session: &Session, options: &LiveOptions) -> Result<Self, LiveError> {
        let access = Access::new(options)?;
        let asked = options.address;
        let refused = |source| LiveError::Address { address: asked, source };
        let listener = TcpListener::bind(asked).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;

        let (serial, news) = watch::channel(0);
        session.listen(move |known| {
            // The number alone: whoever is told asks for the newest.
            serial.send_replace(known);
        });
        let pieces = Arc::new(Pieces::default());
        let site = Arc::new(Site {
            session: session.clone(),
            access,
            files: options.files.clone(),
            pieces: Arc::clone(&pieces),
            news,
            flows: Arc::new(Semaphore::new(MOST_FLOWS)),
            run: name_of_run(),
        });
        let answer = move |request| {
            let site = Arc::clone(&site);
            async move { respond(&site, request).await }
        };
        let server = Server::start("live", listener, answer).map_err(LiveError::Server)?;
        let encode = {
            let (session, pieces, options) = (session.clone(), Arc::clone(&pieces), options.clone());
            move || pieces.encode(&session, &options.name, options.front)
        };
        let encoder = std::thread::Builder::new().name("pieces".to_owned()).spawn(encode);
        let encoder = encoder.map_err(|e| LiveError::Server(e.to_string()))?;
        Ok(Self { address, encoder: Some(encoder), pieces, _server: server })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for LiveServer {
    fn drop(&mut self) {
        self.pieces.stop();
        let _ = self.encoder.take().map(JoinHandle::join);
    }
}
