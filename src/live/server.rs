//! The server: one thread that listens and answers, for as long as it lives.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::Request;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot, watch};

use super::access::Access;
use super::answer::{Site, respond};
use super::pieces::Pieces;
use super::{LiveError, LiveOptions};
use crate::session::Session;

/// How long a client has to ask once it has connected.
const PATIENCE: Duration = Duration::from_secs(30);

/// Connections at a time; further ones wait.
const CONNECTIONS: usize = 256;

/// A session, served for as long as this lives.
pub struct LiveServer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    threads: Vec<JoinHandle<()>>,
    pieces: Arc<Pieces>,
}

impl LiveServer {
    /// Listens, and serves `session`.
    ///
    /// # Errors
    /// [`LiveError`]: an address that cannot be listened on, or that is open to others without a token.
    pub fn start(session: &Session, options: &LiveOptions) -> Result<Self, LiveError> {
        let access = Access::new(options)?;
        let broken = |e: &dyn std::fmt::Display| LiveError::Server(e.to_string());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| broken(&e))?;
        let asked = options.address;
        let refused = |source| LiveError::Address { address: asked, source };
        let listener = runtime.block_on(TcpListener::bind(asked)).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;

        let (serial, news) = watch::channel(0);
        session.listen(move |known| {
            // The number alone: whoever is told asks for the newest.
            serial.send_replace(known);
        });
        let pieces = Arc::new(Pieces::new());
        let site = Arc::new(Site {
            session: session.clone(),
            access,
            files: options.files.clone(),
            pieces: Arc::clone(&pieces),
            news,
            flows: Arc::new(AtomicUsize::new(0)),
            run: crate::record::name_of_run(),
        });
        let (stop, stopped) = oneshot::channel();
        let serve = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept(listener, site) => {}
                    _ = stopped => {}
                }
            });
            // Work for a request that nobody waits for any more is not waited for.
            runtime.shutdown_background();
        };
        let encode = {
            let (session, pieces, options) = (session.clone(), Arc::clone(&pieces), options.clone());
            move || pieces.encode(&session, &options.name, options.front)
        };
        let spawn = |name: &str, work: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.to_owned()).spawn(work).map_err(|e| broken(&e))
        };
        let threads = vec![spawn("live", Box::new(serve))?, spawn("pieces", Box::new(encode))?];
        Ok(Self { address, stop: Some(stop), threads, pieces })
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
        // The threads end at once; if they have ended before, there is nobody to tell.
        let _ = self.stop.take().map(|stop| stop.send(()));
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

async fn accept(listener: TcpListener, site: Arc<Site>) {
    let free = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let Ok(place) = Arc::clone(&free).acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // Out of file handles: those open are closed in a while.
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        // Steps of a drag are small and must not wait for each other.
        let _ = stream.set_nodelay(true);
        let site = Arc::clone(&site);
        let answer = service_fn(move |request: Request<Incoming>| {
            let site = Arc::clone(&site);
            async move { Ok::<_, Infallible>(respond(&site, request).await) }
        });
        let mut http = hyper::server::conn::http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
        tokio::spawn(async move {
            // A client that breaks off is no concern of ours.
            http.serve_connection(TokioIo::new(stream), answer).await.ok();
            drop(place);
        });
    }
}
