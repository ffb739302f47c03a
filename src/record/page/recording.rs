//! A recording for viewers: the reading half of Rerun's message proxy, over gRPC and gRPC-Web.
//!
//! Rerun's own server takes any `Host`, lets clients write, and blocks the recording for a viewer that does not read. Here the
//! page's router checks headers first, every write is refused, and a slow viewer misses the steps that the history forgets.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::Router;
use re_protos::common::v1alpha1::StoreKind;
use re_protos::log_msg::v1alpha1::{LogMsg as Message, log_msg::Msg};
use re_protos::sdk_comms::v1alpha1::message_proxy_service_server::{MessageProxyService, MessageProxyServiceServer};
use re_protos::sdk_comms::v1alpha1::{
    ReadMessagesRequest, ReadMessagesResponse, ReadTablesRequest, ReadTablesResponse, WriteMessagesRequest,
    WriteMessagesResponse, WriteTableRequest, WriteTableResponse,
};
use rerun::external::re_log_encoding::ToTransport as _;
use rerun::external::re_log_encoding::rrd::Compression;
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use tokio::sync::{mpsc, watch};
use tokio_stream::Empty;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};
use tonic_web::GrpcWebLayer;

/// Messages on their way to one viewer.
const IN_FLIGHT: usize = 16;

/// A recording that viewers read while it grows; clones are the same recording.
#[derive(Clone)]
pub(crate) struct Recording(Arc<Shared>);

struct Shared {
    history: Mutex<History>,
    /// The number of the next message.
    news: watch::Sender<u64>,
    most_bytes: u64,
}

#[derive(Default)]
struct History {
    messages: BTreeMap<u64, Message>,
    /// Numbers and sizes of the messages that may be forgotten, the oldest first: steps before static data.
    forgettable: [VecDeque<(u64, u64)>; 2],
    bytes: u64,
    next: u64,
}

impl History {
    /// Adds a message, and forgets the oldest while there are more than `most_bytes`. Layout and names of the recording stay.
    fn push(&mut self, message: Message, most_bytes: u64) {
        if let Some(Msg::ArrowMsg(data)) = &message.msg
            && data.store_id.as_ref().is_none_or(|id| id.kind() != StoreKind::Blueprint)
        {
            let size = data.payload.len() as u64;
            self.forgettable[usize::from(data.is_static == Some(true))].push_back((self.next, size));
            self.bytes += size;
        }
        self.messages.insert(self.next, message);
        self.next += 1;
        for kind in &mut self.forgettable {
            while self.bytes > most_bytes
                && let Some((number, size)) = kind.pop_front()
            {
                self.messages.remove(&number);
                self.bytes -= size;
            }
        }
    }
}

impl Recording {
    /// An empty recording that keeps about `most_bytes` for viewers that connect late.
    pub(crate) fn new(most_bytes: u64) -> Self {
        Self(Arc::new(Shared { history: Mutex::default(), news: watch::Sender::default(), most_bytes }))
    }

    /// Its routes: `rerun+http://HOST:PORT/proxy` in a viewer.
    pub(crate) fn router(&self) -> Router {
        Router::new()
            .route_service(
                "/rerun.sdk_comms.v1alpha1.MessageProxyService/{method}",
                MessageProxyServiceServer::new(self.clone()),
            )
            .layer(GrpcWebLayer::new())
    }

    fn history(&self) -> MutexGuard<'_, History> {
        self.0.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The first message from number `from` on.
    fn after(&self, from: u64) -> Option<(u64, Message)> {
        self.history().messages.range(from..).next().map(|(number, message)| (*number, message.clone()))
    }
}

impl LogSink for Recording {
    fn send(&self, message: LogMsg) {
        match message.to_transport(Compression::LZ4) {
            Ok(message) => {
                let mut history = self.history();
                history.push(message.into(), self.0.most_bytes);
                self.0.news.send_replace(history.next);
            }
            Err(error) => rerun::external::re_log::error!("a message for viewers cannot be encoded: {error}"),
        }
    }

    /// Messages are there as soon as they are sent.
    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}

#[tonic::async_trait]
impl MessageProxyService for Recording {
    type ReadMessagesStream = ReceiverStream<Result<ReadMessagesResponse, Status>>;
    type ReadTablesStream = Empty<Result<ReadTablesResponse, Status>>;

    async fn read_messages(
        &self,
        _: Request<ReadMessagesRequest>,
    ) -> Result<Response<Self::ReadMessagesStream>, Status> {
        let (sender, receiver) = mpsc::channel(IN_FLIGHT);
        let (recording, mut news) = (self.clone(), self.0.news.subscribe());
        tokio::spawn(async move {
            let mut next = 0;
            loop {
                news.mark_unchanged();
                while let Some((number, message)) = recording.after(next) {
                    next = number + 1;
                    if sender.send(Ok(ReadMessagesResponse { log_msg: Some(message) })).await.is_err() {
                        return;
                    }
                }
                tokio::select! {
                    changed = news.changed() => if changed.is_err() { return },
                    () = sender.closed() => return,
                }
            }
        });
        Ok(Response::new(ReceiverStream::new(receiver)))
    }

    async fn read_tables(&self, _: Request<ReadTablesRequest>) -> Result<Response<Self::ReadTablesStream>, Status> {
        Ok(Response::new(tokio_stream::empty()))
    }

    async fn write_messages(
        &self,
        _: Request<Streaming<WriteMessagesRequest>>,
    ) -> Result<Response<WriteMessagesResponse>, Status> {
        Err(read_only())
    }

    async fn write_table(&self, _: Request<WriteTableRequest>) -> Result<Response<WriteTableResponse>, Status> {
        Err(read_only())
    }
}

fn read_only() -> Status {
    Status::permission_denied("this recording can be read, and not written")
}
