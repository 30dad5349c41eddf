//! The receiver of datagrams.

use std::sync::OnceLock;
use std::time::Duration;

use tercet::transport::{Conditions, GilbertElliott, Goal, Objective, Receiver, Report, Sender};
use tercet::transport::{Settings, Source, Strategy};
use tercet::{EncodeOptions, Limits, shapes};

/// So little that blocks have to give way to each other.
const LIMITS: Limits = Limits { max_memory: 16 << 10 };

/// Whatever datagrams arrive, the bytes given out are those of the file.
///
/// The input is instructions of four bytes: which packet of a true session arrives, and what
/// happened to it on its way.
pub fn receive(bytes: &[u8]) {
    static SESSION: OnceLock<(Source, Vec<Vec<u8>>)> = OnceLock::new();
    let (source, packets) = SESSION.get_or_init(session);
    let mut receiver = Receiver::new(source.id(), LIMITS);
    let mut received = Vec::new();
    for &[what, which, place, value] in bytes.as_chunks::<4>().0 {
        let mut packet = packets[usize::from(which) % packets.len()].clone();
        match what % 4 {
            0 => {}
            1 => {
                // A forger computes the checksum anew.
                let (end, place) = (packet.len() - 4, usize::from(place));
                packet[place.min(end - 1)] = value;
                let crc = crc32fast::hash(&packet[..end]);
                packet[end..].copy_from_slice(&crc.to_le_bytes());
            }
            2 => packet.truncate(5 * usize::from(place)),
            _ => packet.extend([place, value]),
        }
        receiver.push(&packet);
        received.extend(std::iter::from_fn(|| receiver.take()).flatten());
        assert!(source.file().starts_with(&received), "a wrong byte was given out");
        let report = receiver.report();
        assert_eq!(Report::read(&report.write()), Some(report));
    }
    Report::read(bytes);
    receiver.push(bytes);
}

/// A file of some blocks, and the packets of a session in which none arrived.
fn session() -> (Source, Vec<Vec<u8>>) {
    let file = tercet::encode(&shapes::scan(1200, 1), &EncodeOptions::default()).expect("a scan is encoded");
    let source = Source::new(file.bytes.clone()).expect("a whole file is a source");
    let loss = GilbertElliott::independent(0.5).expect("a loss below 1");
    let conditions = Conditions { loss, rate: 1e6, round_trip: Duration::from_millis(10) };
    let (strategy, objective) = (Strategy::None, Objective::Psnr);
    let settings = Settings { strategy, objective, goal: Goal::Anytime, conditions };
    let mut sender = Sender::new(Source::new(file.bytes).expect("as before").into(), settings);
    let packets = (0..255).filter_map(|tick| sender.next_packet(Duration::from_millis(5 * tick))).collect();
    (source, packets)
}
