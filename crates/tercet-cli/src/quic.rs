//! QUIC for WebTransport, as both ends need it.

use std::io;
use std::time::Duration;

use bytes::Bytes;
use tercet::transport::MAX_DATAGRAM;
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncReadExt, BufReader};
use wtransport::Connection;
use wtransport::config::QuicTransportConfig;
use wtransport::proto::datagram::Datagram;
use wtransport::proto::ids::QStreamId;
use wtransport::quinn::SendDatagramError;

/// Bytes of UDP that every path has to carry: what an IPv6 packet of the least size has room for. A
/// datagram of ours with QUIC's own bytes is smaller, one in a QUIC packet of the least size, 1 200
/// bytes, would not fit.
const LEAST_PACKET: u16 = 1232;
/// Bytes of datagrams that wait for congestion control: what waits here was decided too early.
const SEND_QUEUE: usize = 8 << 10;
/// Bytes of datagrams that wait for the program: a large block takes some time to decode.
const RECEIVE_QUEUE: usize = 1 << 20;
/// Bytes that the other end may send on a stream before they are read.
const STREAM_WINDOW: u32 = 64 << 10;
/// Streams that the other end may open: a session has one, HTTP/3 some of its own.
const MOST_STREAMS: u32 = 8;

/// How often a receiver reports at most. A sender hears of a packet this much later than a round
/// trip after it was sent, in the worst case.
pub const REPORT_INTERVAL: Duration = Duration::from_millis(20);

/// The settings of a connection that ends when nothing comes for as long as `silence`.
pub fn settings(silence: Duration) -> QuicTransportConfig {
    let mut settings = QuicTransportConfig::default();
    settings
        .initial_mtu(LEAST_PACKET)
        .min_mtu(LEAST_PACKET)
        .max_concurrent_bidi_streams(MOST_STREAMS.into())
        .max_concurrent_uni_streams(MOST_STREAMS.into())
        .stream_receive_window(STREAM_WINDOW.into())
        .receive_window((2 * STREAM_WINDOW).into())
        .datagram_send_buffer_size(SEND_QUEUE)
        .datagram_receive_buffer_size(Some(RECEIVE_QUEUE))
        // A time that cannot be written is longer than any that matters.
        .max_idle_timeout(silence.try_into().ok());
    settings
}

/// Whether packets fit into the connection's datagrams.
pub fn carries_packets(connection: &Connection) -> bool {
    connection.max_datagram_size().is_some_and(|most| most >= MAX_DATAGRAM)
}

/// A datagram as it goes over QUIC: behind the number of the session.
pub fn frame(connection: &Connection, payload: &[u8]) -> Bytes {
    let datagram = Datagram::new(QStreamId::from_session_id(connection.session_id()), payload);
    let mut bytes = vec![0; datagram.write_size()];
    // The buffer is as large as it says.
    let written = datagram.write(&mut bytes).unwrap_or_default();
    bytes.truncate(written);
    bytes.into()
}

/// Sends what [`frame`] made, when congestion control lets it. May be dropped and called again.
pub async fn send(connection: &Connection, framed: Bytes) -> Result<(), SendDatagramError> {
    connection.quic_connection().send_datagram_wait(framed).await
}

/// A line of at most `most` bytes, without its end; `None` if that is not what comes.
pub async fn read_line(
    stream: &mut BufReader<impl AsyncRead + Unpin>,
    most: u64,
) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    stream.take(most).read_until(b'\n', &mut line).await?;
    let whole = line.pop() == Some(b'\n');
    Ok(String::from_utf8(line).ok().filter(|line| whole && !line.contains(|c: char| c.is_control())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn lines_are_bounded() {
        for (bytes, line) in [
            (&b"OPEN a\nrest"[..], Some("OPEN a")),
            (b"OPEN a", None),
            (b"0123456789\n", None),
            (b"", None),
            (b"\xFF\n", None),
            (b"a\rb\n", None),
        ] {
            let mut stream = BufReader::new(bytes);
            assert_eq!(read_line(&mut stream, 10).await.unwrap().as_deref(), line, "{bytes:?}");
        }
    }
}
