//! Streamed responses: events of the state, and pieces for the viewer. A client gets at most 250 a second, each with the newest
//! data only.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{Instant, sleep_until, timeout};

use super::access::Access;
use super::pieces::Pieces;
use super::report;
use crate::scene::FileRole;
use crate::session::Session;

/// Shortest interval between two events of one client: a quarter of a frame at 60 Hz. The two stages of an edit wait for it after the edit's
/// PARTs, and take 6 ms for a skirt; at 33 ms it was most of their latency.
const EVENT_INTERVAL: Duration = Duration::from_millis(4);
/// Longest interval between two events; a keep-alive message is sent then, so that a lost client is noticed.
const KEEP_ALIVE: Duration = Duration::from_secs(10);
/// Time in which a client must accept one event.
const SEND_TIMEOUT: Duration = Duration::from_secs(30);
/// Largest number of clients that read events or pieces at the same time.
pub(super) const MAX_READERS: usize = 64;

/// A session and its clients.
pub(super) struct Site {
    pub(super) session: Session,
    pub(super) access: Access,
    /// Files that requests may name.
    pub(super) files: Vec<(FileRole, String)>,
    pub(super) pieces: Arc<Pieces>,
    pub(super) news: watch::Receiver<u64>,
    /// One permit for each reader of events or the stream.
    pub(super) readers: Arc<Semaphore>,
    /// A name by which a page recognises this server.
    pub(super) run: String,
}

/// The state now and after each change, as server-sent events.
pub(super) fn events(site: &Arc<Site>, permit: OwnedSemaphorePermit) -> Receiver<Bytes> {
    let mut known = None;
    flow(site, permit, site.news.clone(), b": still here\n\n", move |site| {
        let snapshot = site.session.snapshot();
        let generation = Some(snapshot.loaded_scene.as_ref().map(|loaded_scene| loaded_scene.generation));
        // Histogram and trail are large, and are sent when the garment is new to this client.
        let whole = std::mem::replace(&mut known, generation) != generation;
        let state = if whole { report::state(&snapshot) } else { report::event(&snapshot) };
        vec![format!("event: state\ndata: {state}\n\n").into()]
    })
}

/// The viewer's pieces, each after its length in four little-endian bytes; an empty one keeps the connection alive.
pub(super) fn stream(site: &Arc<Site>, permit: OwnedSemaphorePermit) -> Receiver<Bytes> {
    let (attached, mut known) = (site.pieces.attach(), [0; 4]);
    flow(site, permit, site.pieces.news(), &[0; 4], move |site| {
        // Dropped with the client.
        let _attached = &attached;
        let length = |piece: &Bytes| Bytes::copy_from_slice(&(piece.len() as u32).to_le_bytes());
        site.pieces.since(&mut known).into_iter().flat_map(|piece| [length(&piece), piece]).collect()
    })
}

/// Sends `newest` now and after each change of `news`, and `alive` in longer pauses.
fn flow(
    site: &Arc<Site>,
    permit: OwnedSemaphorePermit,
    mut news: watch::Receiver<u64>,
    alive: &'static [u8],
    mut newest: impl FnMut(&Site) -> Vec<Bytes> + Send + 'static,
) -> Receiver<Bytes> {
    let (sender, receiver) = channel(1);
    let site = Arc::clone(site);
    tokio::spawn(async move {
        let _permit = permit;
        while !site.session.is_closed() {
            let began = Instant::now();
            news.mark_unchanged();
            for bytes in newest(&site) {
                if !sent(&sender, bytes).await {
                    return;
                }
            }
            sleep_until(began + EVENT_INTERVAL).await;
            if !changed(&mut news, &sender, alive).await {
                return;
            }
        }
    });
    receiver
}

/// Waits for news and sends `alive` meanwhile; false once the session or the client is gone.
async fn changed(news: &mut watch::Receiver<u64>, sender: &Sender<Bytes>, alive: &'static [u8]) -> bool {
    loop {
        match timeout(KEEP_ALIVE, news.changed()).await {
            Ok(changed) => return changed.is_ok(),
            Err(_) if !sent(sender, Bytes::from_static(alive)).await => return false,
            Err(_) => {}
        }
    }
}

/// Whether the client took the bytes in time.
async fn sent(sender: &Sender<Bytes>, bytes: Bytes) -> bool {
    matches!(timeout(SEND_TIMEOUT, sender.send(bytes)).await, Ok(Ok(())))
}
