//! One client, one file.

use std::sync::Arc;
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use futures_util::TryStreamExt;
use percent_encoding::percent_decode_str;
use tercet::transport::{Goal, MAX_DATAGRAM, Objective, Sender, Settings, Source, Strategy};
use tokio::io::BufReader;
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{Instant, sleep, sleep_until, timeout};
use wtransport::{Connection, RecvStream, SendStream, VarInt};

use super::Host;
use super::channel::{Sieve, conditions};
use super::refusal::{End, Refusal};
use crate::protocol::{Greeting, Open};
use crate::quic;
use crate::server::failure::Failure;
use crate::server::rendition::Rendition;

/// Memory is shared out in pieces of as many bytes.
pub const ROOM: u64 = 64 << 10;
/// What a session takes for each byte of its file: the file, and the coded blocks of all of it.
const MEMORY_FACTOR: u64 = 3;
/// A session that has sent as many times its file's bytes gives up,
const FUTILE: u64 = 16;
/// but not before it has sent as many packets.
const FAIR: u64 = 1000;
/// Reports that follow each other faster are not read: each costs a plan.
const REPORT_GAP: Duration = Duration::from_millis(5);
/// Without a report for so long, and as many round trips, nothing more is sent before the next.
const SILENCE: (Duration, u32) = (Duration::from_millis(250), 8);
/// When to ask again where nothing is worth sending at present.
const PAUSE: Duration = Duration::from_millis(5);
/// How long to wait for a client to hear why the session ends.
const FAREWELL: Duration = Duration::from_secs(1);
/// The status of a connection that ends as it should.
const GOOD: VarInt = VarInt::from_u32(0);

/// How many pieces of [`ROOM`] as many bytes are.
pub fn rooms(bytes: u64) -> u32 {
    // Semaphores do not count further than to 2^29 on any platform.
    bytes.div_ceil(ROOM).min(1 << 28) as u32
}

/// Holds a session from the control stream to the end.
pub async fn hold(host: &Host, connection: &Connection) {
    let stop = &host.shared.stop;
    let opened = tokio::select! {
        opened = timeout(host.patience.header, connection.accept_bi()) => opened,
        () = stop.cancelled() => return,
    };
    let Ok(Ok((mut out, input))) = opened else { return };
    let _open = host.shared.metrics.session();
    // The stream is kept: a client need not be told that nobody reads on.
    let mut input = BufReader::new(input);
    let session = Session { host, connection };
    let ended = tokio::select! {
        ended = session.run(&mut input, &mut out) => ended,
        () = stop.cancelled() => Err(Refusal::Stopping.into()),
    };
    if let Err(End::Refused(refusal)) = ended {
        tracing::info!(code = refusal.code(), "session refused");
        let farewell = async {
            if out.write_all(refusal.line().as_bytes()).await.is_ok() && out.finish().await.is_ok() {
                connection.closed().await;
            }
        };
        // Closing at once would take the reason away from the client.
        let _ = timeout(FAREWELL, farewell).await;
    }
    connection.close(GOOD, b"");
}

struct Session<'a> {
    host: &'a Host,
    connection: &'a Connection,
}

impl Session<'_> {
    async fn run(&self, input: &mut BufReader<RecvStream>, out: &mut SendStream) -> Result<(), End> {
        let most = self.host.shared.sessions.max_message as u64;
        let line = timeout(self.host.patience.header, quic::read_line(input, most)).await;
        let line = line.map_err(|_| Refusal::Usage)?.map_err(|_| End::Broken)?;
        let open = line.and_then(|line| Open::read(&line)).ok_or(Refusal::Usage)?;
        let name = percent_decode_str(&open.path).decode_utf8().map_err(|_| Failure::NotFound)?;
        let rendition = self.host.shared.catalogue.find(&name).await?;
        if open.digest.is_some_and(|digest| digest != rendition.digest.as_str()) {
            return Err(Failure::Replaced.into());
        }
        if !quic::carries_packets(self.connection) {
            return Err(Refusal::Datagrams.into());
        }
        tracing::info!(name = %name, "session");
        let (source, _room) = self.load(&rendition).await?;
        let greeting = Greeting {
            bytes: rendition.bytes(),
            // An opening is a block, at most some megabyte.
            opening: source.opening().len() as u32,
            digest: rendition.digest.as_str().into(),
            id: source.id(),
        };
        let greet = async {
            out.write_all(format!("{greeting}\n").as_bytes()).await?;
            out.write_all(source.opening()).await
        };
        timeout(self.host.patience.stall, greet).await.map_err(|_| Refusal::Idle)??;
        self.send(source).await
    }

    /// Reads the file, and divides it. It stays in memory as long as its share of the room is held.
    async fn load(&self, rendition: &Rendition) -> Result<(Arc<Source>, OwnedSemaphorePermit), End> {
        let rooms_wanted = rooms(rendition.bytes().saturating_mul(MEMORY_FACTOR));
        if rooms_wanted > rooms(self.host.shared.max_memory) {
            return Err(Refusal::Large.into());
        }
        let room = self.host.room.clone().try_acquire_many_owned(rooms_wanted).map_err(|_| Failure::Busy)?;
        let chunks = rendition.object.read(0..rendition.bytes()).await?;
        let file = chunks.try_fold(BytesMut::new(), async |mut file, chunk| {
            file.extend_from_slice(&chunk);
            Ok(file)
        });
        let file = file.await?;
        let source = tokio::task::spawn_blocking(move || Source::new(&file[..])).await;
        let source = source.map_err(|error| Failure::Store(error.to_string()))?;
        let source = source.map_err(|error| Failure::Mesh(error.to_string()))?;
        Ok((Arc::new(source), room))
    }

    /// Sends packets, as congestion control lets it, until the client has everything.
    async fn send(&self, source: Arc<Source>) -> Result<(), End> {
        let enough = (source.file().len() as u64).saturating_mul(FUTILE).max(FAIR * MAX_DATAGRAM as u64);
        let mut sieve = Sieve::new(self.host.loss);
        let conditions_now = conditions(self.connection, &sieve);
        let mut sender = Sender::new(
            source,
            Settings {
                strategy: Strategy::Optimal,
                objective: Objective::Psnr,
                goal: Goal::Anytime,
                conditions: conditions_now,
            },
        );
        let start = Instant::now();
        let (mut heard, mut sent) = (start, 0);
        let mut next: Option<Bytes> = None;
        while !sender.is_done() {
            if sent > enough {
                return Err(Refusal::Futile.into());
            }
            let silence = SILENCE.0 + SILENCE.1 * self.connection.rtt();
            if next.is_none() && heard.elapsed() < silence {
                next = self.next_packet(&mut sender, &mut sieve, start.elapsed());
            }
            tokio::select! {
                report = self.connection.receive_datagram() => {
                    let report = report?.payload();
                    if heard == start || heard.elapsed() >= REPORT_GAP {
                        sender.set_conditions(conditions(self.connection, &sieve));
                        if sender.report(&report, start.elapsed()) {
                            heard = Instant::now();
                        }
                    }
                }
                gone = quic::send(self.connection, next.clone().unwrap_or_default()), if next.is_some() => {
                    gone.map_err(|_| End::Broken)?;
                    let bytes = next.take().map_or(0, |packet| packet.len());
                    self.host.shared.metrics.sent(bytes);
                    sent += bytes as u64;
                }
                () = sleep(PAUSE), if next.is_none() => {}
                () = sleep_until(heard + self.host.patience.stall) => return Err(Refusal::Idle.into()),
            }
        }
        Ok(())
    }

    /// The next packet that is not lost on purpose, if any is worth sending.
    fn next_packet(&self, sender: &mut Sender, sieve: &mut Sieve, now: Duration) -> Option<Bytes> {
        loop {
            let packet = sender.next_packet(now)?;
            if sieve.passes() {
                return Some(quic::frame(self.connection, &packet));
            }
        }
    }
}
