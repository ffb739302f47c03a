//! What goes on while somebody reads: events of the state, and the viewer's pieces. At most 30 a second, the newest alone.

use std::sync::Arc;
use std::time::Duration;

use hyper::body::Bytes;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio::time::{Instant, sleep_until, timeout};

use super::answer::Site;
use super::report;

/// Between two that are sent.
const PACE: Duration = Duration::from_millis(33);
/// Something is sent at least this often, or nobody would notice that the reader is gone.
const PULSE: Duration = Duration::from_secs(10);
/// How long a reader may leave a piece lying.
const PATIENCE: Duration = Duration::from_secs(30);
/// Readers at a time.
pub(super) const MOST_FLOWS: usize = 64;

/// The state now, and whenever it changes: server-sent events.
pub(super) fn events(site: &Arc<Site>, place: OwnedSemaphorePermit) -> Receiver<Bytes> {
    let (sender, receiver) = channel(1);
    let site = Arc::clone(site);
    tokio::spawn(async move {
        let _place = place;
        let mut news = site.news.clone();
        let mut generation = None;
        let mut first = true;
        while !site.session.is_closed() {
            let began = Instant::now();
            news.mark_unchanged();
            let snapshot = site.session.snapshot();
            let found = snapshot.ground.as_ref().map(|ground| ground.generation);
            // The histogram and the whole trail only when they are new to this reader.
            let whole = std::mem::take(&mut first) || found != generation;
            generation = found;
            let state = if whole { report::state(&snapshot) } else { report::event(&snapshot) };
            if !sent(&sender, format!("event: state\ndata: {state}\n\n").into()).await {
                return;
            }
            sleep_until(began + PACE).await;
            if !changed(&mut news, &sender, b": still here\n\n").await {
                return;
            }
        }
    });
    receiver
}

/// The viewer's pieces, each after its length (four bytes, the least first).
pub(super) fn stream(site: &Arc<Site>, place: OwnedSemaphorePermit) -> Receiver<Bytes> {
    let (sender, receiver) = channel(1);
    let site = Arc::clone(site);
    tokio::spawn(async move {
        let _place = place;
        let _attached = site.pieces.attach();
        let mut news = site.pieces.news();
        let mut known = [0; 4];
        while !site.session.is_closed() {
            let began = Instant::now();
            news.mark_unchanged();
            for piece in site.pieces.since(&mut known) {
                let length = Bytes::copy_from_slice(&(piece.len() as u32).to_le_bytes());
                if !sent(&sender, length).await || !sent(&sender, piece).await {
                    return;
                }
            }
            sleep_until(began + PACE).await;
            // An empty piece.
            if !changed(&mut news, &sender, &[0; 4]).await {
                return;
            }
        }
    });
    receiver
}

/// Waits for news, with a sign of life now and then; false where there will be none, or nobody to read them.
async fn changed<T>(news: &mut watch::Receiver<T>, sender: &Sender<Bytes>, alive: &'static [u8]) -> bool {
    loop {
        match timeout(PULSE, news.changed()).await {
            Ok(changed) => return changed.is_ok(),
            Err(_) if !sent(sender, Bytes::from_static(alive)).await => return false,
            Err(_) => {}
        }
    }
}

/// Whether the reader took it in time.
async fn sent(sender: &Sender<Bytes>, bytes: Bytes) -> bool {
    matches!(timeout(PATIENCE, sender.send(bytes)).await, Ok(Ok(())))
}
