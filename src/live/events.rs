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
    let mut known = None;
    flow(site, place, site.news.clone(), b": still here\n\n", move |site| {
        let snapshot = site.session.snapshot();
        let generation = Some(snapshot.ground.as_ref().map(|ground| ground.generation));
        // The histogram and the whole trail only when they are new to this reader.
        let whole = std::mem::replace(&mut known, generation) != generation;
        let state = if whole { report::state(&snapshot) } else { report::event(&snapshot) };
        vec![format!("event: state\ndata: {state}\n\n").into()]
    })
}

/// The viewer's pieces, each after its length (four bytes, the least first); an empty one is a sign of life.
pub(super) fn stream(site: &Arc<Site>, place: OwnedSemaphorePermit) -> Receiver<Bytes> {
    let (attached, mut known) = (site.pieces.attach(), [0; 4]);
    flow(site, place, site.pieces.news(), &[0; 4], move |site| {
        // Held for as long as somebody reads.
        let _attached = &attached;
        let length = |piece: &Bytes| Bytes::copy_from_slice(&(piece.len() as u32).to_le_bytes());
        site.pieces.since(&mut known).into_iter().flat_map(|piece| [length(&piece), piece]).collect()
    })
}

/// What is newest, now and whenever there are news; `alive` where there are none for a while.
fn flow(
    site: &Arc<Site>,
    place: OwnedSemaphorePermit,
    mut news: watch::Receiver<u64>,
    alive: &'static [u8],
    mut newest: impl FnMut(&Site) -> Vec<Bytes> + Send + 'static,
) -> Receiver<Bytes> {
    let (sender, receiver) = channel(1);
    let site = Arc::clone(site);
    tokio::spawn(async move {
        let _place = place;
        while !site.session.is_closed() {
            let began = Instant::now();
            news.mark_unchanged();
            for bytes in newest(&site) {
                if !sent(&sender, bytes).await {
                    return;
                }
            }
            sleep_until(began + PACE).await;
            if !changed(&mut news, &sender, alive).await {
                return;
            }
        }
    });
    receiver
}

/// Waits for news, with a sign of life now and then; false where there will be none, or nobody to read them.
async fn changed(news: &mut watch::Receiver<u64>, sender: &Sender<Bytes>, alive: &'static [u8]) -> bool {
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
