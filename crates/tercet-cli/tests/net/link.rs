//! A slow link: a proxy that delays what passes through it.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep, sleep_until};

/// What a link does to bytes.
#[derive(Clone, Copy)]
pub struct Link {
    /// From one end to the other.
    pub latency: Duration,
    pub bits_per_second: f64,
    /// Bytes after which each connection is cut; counted from the server's side.
    pub cut: Option<usize>,
}

/// Bytes that are put on the link at a time: an Ethernet packet's.
const PACKET: usize = 1460;
/// Packets that a queue before the link holds: 64 KB.
const QUEUE: usize = 45;

/// A link that has waited for longer than this had nothing to send; for less, the clock was late.
const IDLE: Duration = Duration::from_millis(10);

impl Link {
    /// 1 Mbit/s with this latency.
    pub fn slow(latency: Duration) -> Link {
        Link { latency, bits_per_second: 1e6, cut: None }
    }

    /// The near end of a link to `server`, until the test ends. Opening a connection takes a round
    /// trip, as the handshake of TCP does.
    pub async fn to(self, server: SocketAddr) -> SocketAddr {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        tokio::spawn(async move {
            while let Ok((near, _)) = listener.accept().await {
                tokio::spawn(async move {
                    sleep(2 * self.latency).await;
                    let Ok(far) = TcpStream::connect(server).await else { return };
                    let _ = (near.set_nodelay(true), far.set_nodelay(true));
                    let ((near_in, near_out), (far_in, far_out)) = (near.into_split(), far.into_split());
                    tokio::spawn(self.carry(near_in, far_out, None));
                    self.carry(far_in, near_out, self.cut).await;
                });
            }
        });
        address
    }

    async fn carry(self, mut from: OwnedReadHalf, mut to: OwnedWriteHalf, cut: Option<usize>) {
        let (queue, mut packets) = mpsc::channel::<(Instant, Bytes)>(QUEUE);
        let latency = self.latency;
        let delivery = tokio::spawn(async move {
            while let Some((sent, packet)) = packets.recv().await {
                sleep_until(sent + latency).await;
                if to.write_all(&packet).await.is_err() {
                    return;
                }
            }
        });
        let mut left = cut.unwrap_or(usize::MAX);
        let mut free = Instant::now();
        let mut packet = [0; PACKET];
        while left > 0 {
            let Ok(count @ 1..) = from.read(&mut packet).await else { break };
            let count = count.min(left);
            left -= count;
            // The packet leaves when the one before it has left and its own bits have.
            let time = Duration::from_secs_f64(8.0 * count as f64 / self.bits_per_second);
            let now = Instant::now();
            if now > free + IDLE {
                free = now;
            }
            free += time;
            sleep_until(free).await;
            if queue.send((free, Bytes::copy_from_slice(&packet[..count]))).await.is_err() {
                break;
            }
        }
        drop(queue);
        let _ = delivery.await;
    }
}
