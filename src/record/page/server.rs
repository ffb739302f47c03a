//! HTTP/1.1 and HTTP/2 on a separate thread, until the [`Server`] is dropped.
//!
//! No client keeps others out. A response that makes no progress for [`Limits::stall`] closes its connection, and so does a client
//! that sends nothing in that time. When all places are taken, overall or those of one peer address, the connection that wrote
//! nothing for longest is closed for the new one; those that carried an authorised request go last.

use std::io::{self, IoSlice};
use std::net::{self, IpAddr};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::task::{Context, Poll, ready};
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::http::{Request, Uri};
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::task::AbortHandle;
use tokio::time::{Instant, Sleep, sleep};
use tonic::codegen::Service as _;

/// Limits of a server's connections.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Connections at a time.
    pub connections: usize,
    /// Connections at a time from one address. A page has six at most.
    pub per_peer: usize,
    /// How long a response may make no progress, and a client may take for the head of a request. A smaller value cuts off
    /// slow networks, a larger one keeps stalled responses in memory for longer.
    pub stall: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self { connections: 256, per_peer: 128, stall: Duration::from_secs(10) }
    }
}

/// A server, for as long as this lives.
pub(crate) struct Server {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Serves `router` to the clients of `listener`, on a thread of this name.
    pub(crate) fn start(
        name: &str,
        listener: net::TcpListener,
        router: Router,
        limits: Limits,
    ) -> Result<Self, io::Error> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        listener.set_nonblocking(true)?;
        let listener = runtime.block_on(async { TcpListener::from_std(listener) })?;
        let (stop, stopped) = oneshot::channel();
        let serve = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept(listener, router, limits) => {}
                    _ = stopped => {}
                }
            });
            // Requests that are still computed lose their client; the program does not wait for them.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(serve)?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // The receiver is gone if the thread has ended.
        let _ = self.stop.take().map(|stop| stop.send(()));
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The state of a connection by which the one to close is chosen; handlers find it in the request's extensions.
#[derive(Debug)]
pub(crate) struct Connection {
    opened: Instant,
    /// Milliseconds from `opened` to the last write.
    written_ms: AtomicU64,
    authorised: AtomicBool,
}

impl Connection {
    /// Marks the connection as that of a client that may read or control.
    pub(crate) fn authorise(&self) {
        self.authorised.store(true, Ordering::Relaxed);
    }

    fn wrote(&self) {
        self.written_ms.store(self.opened.elapsed().as_millis() as u64, Ordering::Relaxed);
    }

    /// Connections of lower rank are closed first.
    fn rank(&self) -> (bool, Instant) {
        let written = Duration::from_millis(self.written_ms.load(Ordering::Relaxed));
        (self.authorised.load(Ordering::Relaxed), self.opened + written)
    }
}

struct Place {
    peer: IpAddr,
    connection: Arc<Connection>,
    task: AbortHandle,
}

/// Closes connections of those that `counts` selects until one more fits into `limit`.
fn make_room(places: &mut Vec<Place>, limit: usize, counts: impl Fn(&Place) -> bool) {
    while places.iter().filter(|place| counts(place)).count() >= limit {
        let counted = (0..places.len()).filter(|&i| counts(&places[i]));
        let Some(stalest) = counted.min_by_key(|&i| places[i].connection.rank()) else { return };
        places.swap_remove(stalest).task.abort();
    }
}

async fn accept(listener: TcpListener, router: Router, limits: Limits) {
    let mut places: Vec<Place> = Vec::new();
    loop {
        let Ok((stream, peer)) = listener.accept().await else {
            // Out of file handles: some are free once a connection ends.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        let peer = peer.ip();
        places.retain(|place| !place.task.is_finished());
        make_room(&mut places, limits.per_peer, |place| place.peer == peer);
        make_room(&mut places, limits.connections, |_| true);
        let connection = Arc::new(Connection {
            opened: Instant::now(),
            written_ms: AtomicU64::new(0),
            authorised: AtomicBool::new(false),
        });
        let served = serve(stream, router.clone(), Arc::clone(&connection), limits.stall);
        places.push(Place { peer, connection, task: tokio::spawn(served).abort_handle() });
    }
}

async fn serve(stream: TcpStream, router: Router, connection: Arc<Connection>, stall: Duration) {
    // Steps of a drag are small and must not wait for each other.
    let _ = stream.set_nodelay(true);
    let io = Guarded { stream, connection: Arc::clone(&connection), stall, heard: false, timer: None };
    let service = service_fn(move |mut request: Request<Incoming>| {
        // The printed address ends in a slash, and users append a path that begins with one.
        if let Some(rest) = request.uri().path().strip_prefix("//") {
            let query = request.uri().query().map_or(String::new(), |query| format!("?{query}"));
            let path: Result<Uri, _> = format!("/{}{query}", rest.trim_start_matches('/')).parse();
            *request.uri_mut() = path.unwrap_or_default();
        }
        request.extensions_mut().insert(Arc::clone(&connection));
        router.clone().call(request)
    });
    let mut http = Builder::new(TokioExecutor::new());
    http.http1().timer(TokioTimer::new()).header_read_timeout(stall);
    http.http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(stall)
        .keep_alive_timeout(stall)
        .max_concurrent_streams(16);
    // An error here is a client that broke off.
    let _ = http.serve_connection(TokioIo::new(io), service).await;
}

/// A stream that fails once a write waits for longer than `stall`, or the first byte does.
struct Guarded {
    stream: TcpStream,
    connection: Arc<Connection>,
    stall: Duration,
    heard: bool,
    timer: Option<Pin<Box<Sleep>>>,
}

impl Guarded {
    fn wait<T>(&mut self, context: &mut Context<'_>) -> Poll<io::Result<T>> {
        let stall = self.stall;
        let timer = self.timer.get_or_insert_with(|| Box::pin(sleep(stall)));
        ready!(timer.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }

    fn written(&mut self, done: Poll<io::Result<usize>>, context: &mut Context<'_>) -> Poll<io::Result<usize>> {
        if done.is_pending() {
            return self.wait(context);
        }
        self.timer = None;
        self.connection.wrote();
        done
    }
}

impl AsyncRead for Guarded {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let done = Pin::new(&mut self.stream).poll_read(context, buffer);
        match (&done, self.heard) {
            (Poll::Pending, false) => return self.wait(context),
            (Poll::Ready(_), false) => (self.heard, self.timer) = (true, None),
            _ => {}
        }
        done
    }
}

impl AsyncWrite for Guarded {
    fn poll_write(mut self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let done = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.written(done, context)
    }

    // Without it hyper copies each response into one buffer, 42 MB for the viewer.
    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let done = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.written(done, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
