//! The server: one thread that answers requests, and one that encodes for viewers.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use tokio::sync::{Semaphore, watch};

use super::access::Access;
use super::events::{MAX_READERS, Site};
use super::pieces::Pieces;
use super::routes::router;
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
    /// Serves `session`.
    ///
    /// # Errors
    /// [`LiveError`]: an address that cannot be bound, or that other machines reach without a token.
    pub fn start(session: &Session, options: &LiveOptions) -> Result<Self, LiveError> {
        let access = Access::new(options)?;
        let refused = |source| LiveError::Address { address: options.address, source };
        let listener = TcpListener::bind(options.address).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;

        let (serial, news) = watch::channel(0);
        session.listen(move |known| {
            // Clients then read the newest state.
            serial.send_replace(known);
        });
        let pieces = Arc::new(Pieces::new(&options.name, options.front));
        let site = Arc::new(Site {
            session: session.clone(),
            access,
            files: options.files.clone(),
            pieces: Arc::clone(&pieces),
            news,
            readers: Arc::new(Semaphore::new(MAX_READERS)),
            run: name_of_run(),
        });
        let failed = |error: std::io::Error| LiveError::Server(error.to_string());
        let server = Server::start("live", listener, router(site), options.limits).map_err(failed)?;
        let encode = {
            let (session, pieces) = (session.clone(), Arc::clone(&pieces));
            move || pieces.encode(&session)
        };
        let encoder = std::thread::Builder::new().name("pieces".to_owned()).spawn(encode);
        let encoder = encoder.map_err(failed)?;
        Ok(Self { address, encoder: Some(encoder), pieces, _server: server })
    }

    /// The address it listens on.
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
