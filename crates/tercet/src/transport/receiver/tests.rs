use super::*;
use crate::shapes::Random;
use crate::transport::packet::OVERHEAD;
use crate::transport::sender::Source;
use crate::transport::{MAX_DATAGRAM, code, simulation};
use crate::{EncodeOptions, encode, shapes};

/// A file of several blocks, and its packets: `spare` repair symbols for each block.
fn packets(vertices: usize, spare: u32) -> (Source, Vec<Vec<u8>>) {
    let file = encode(&shapes::scan(vertices, 1), &EncodeOptions::default()).unwrap().bytes;
    let source = Source::new(file).unwrap();
    let mut packets = Vec::new();
    for block in 0..source.blocks.count() {
        let bytes = source.blocks.bytes(source.file(), block);
        let encoder = code::Encoder::new(bytes).unwrap();
        for symbol in 0..Code::of(bytes.len()).unwrap().symbols + spare {
            packets.push(datagram(source.id(), block, bytes.len(), symbol, &encoder.symbol(symbol)));
        }
    }
    (source, packets)
}

fn datagram(id: FileId, block: usize, length: usize, symbol: u32, payload: &[u8]) -> Vec<u8> {
    let (block, length) = (block as u16, length as u32);
    Packet { tag: id.tag(), number: 0, block, length, symbol, payload }.write()
}

fn taken(receiver: &mut Receiver) -> Vec<u8> {
    std::iter::from_fn(|| receiver.take()).flatten().collect()
}

#[test]
fn any_order_gives_the_file() {
    let (source, mut packets) = packets(3000, 2);
    for seed in 0..4 {
        Random::new(seed).shuffle(&mut packets);
        let mut receiver = Receiver::new(source.id(), Limits::default());
        let mut bytes = Vec::new();
        for packet in &packets {
            receiver.push(packet);
            bytes.extend(taken(&mut receiver));
            assert!(source.file().starts_with(&bytes));
        }
        assert!(receiver.is_complete());
        assert_eq!(bytes, source.file());
        assert_eq!(receiver.held, 0);
        assert_eq!(receiver.push(&packets[0]), Received::Late);
    }
}

#[test]
fn a_part_of_the_packets_gives_the_blocks_that_it_completes() {
    let (source, packets) = packets(3000, 0);
    let mut receiver = Receiver::new(source.id(), Limits::default());
    assert_eq!(receiver.push(&packets[0]), Received::Completed);
    receiver.push(packets.last().unwrap());
    let report = receiver.report();
    assert_eq!(report.done, 1);
    let last = (source.blocks.count() - 1) as u16;
    assert_eq!(report.progress, [Progress { block: last, received: Some(1) }]);
    assert_eq!(Report::read(&report.write()), Some(report));
}

#[test]
fn the_opening_may_come_another_way() {
    let (source, mut packets) = packets(3000, 0);
    packets.reverse();
    let mut receiver = Receiver::new(source.id(), Limits::default());
    let (_, before) = packets.split_last().unwrap();
    for packet in before {
        receiver.push(packet);
    }
    assert_eq!(receiver.take(), None);
    let mut forged = source.opening().to_vec();
    forged[10] ^= 1;
    for bad in [&forged[..], &source.opening()[1..], &[]] {
        assert_eq!(receiver.open(bad), Received::Refuted);
    }
    assert_eq!(receiver.open(source.opening()), Received::Completed);
    assert_eq!(receiver.open(source.opening()), Received::Late);
    assert!(receiver.is_complete());
    assert_eq!(taken(&mut receiver), source.file());
    assert_eq!(receiver.held, 0);
}

#[test]
fn identities_are_read_as_they_are_displayed() {
    let id = FileId(std::array::from_fn(|i| 8 * i as u8));
    assert_eq!(id.to_string().parse::<FileId>().unwrap(), id);
    let long = format!("{id}0");
    let signs = id.to_string().replacen('0', "+", 1);
    for bad in ["", &long, &long[2..], &signs] {
        assert!(bad.parse::<FileId>().is_err(), "{bad}");
    }
}

/// Forged packets with right checksums and the right tag: a wrong symbol, a wrong length, a block that
/// does not exist. Each costs some packets at most.
#[test]
fn forged_packets_cannot_spoil_a_file() {
    let (source, packets) = packets(3000, 0);
    let id = source.id();
    let mut receiver = Receiver::new(id, Limits::default());
    let forged = |block: usize, length: usize, symbol: u32| {
        datagram(id, block, length, symbol, &vec![0xAB; Code::of(length).unwrap().size])
    };
    for block in 0..source.blocks.count() {
        let length = source.blocks.bytes(source.file(), block).len();
        for other in [3, 2000, 4000, 90_000, 300_000] {
            receiver.push(&forged(block, other, 1));
        }
        receiver.push(&forged(block, length, 0));
    }
    assert_eq!(receiver.push(&forged(60_000, 7, 0)), Received::Kept, "no manifest says better yet");
    let mut refuted = 0;
    while !receiver.is_complete() {
        for packet in &packets {
            refuted += u32::from(receiver.push(packet) == Received::Refuted);
        }
        assert!(refuted < 100);
    }
    assert!(refuted > 0);
    assert_eq!(taken(&mut receiver), source.file());
    assert_eq!(receiver.push(&forged(60_000, 7, 0)), Received::Mangled);
    assert_eq!(receiver.held, 0);
}

#[test]
fn packets_of_other_files_are_foreign() {
    let (source, packets) = packets(300, 0);
    let mut receiver = Receiver::new(FileId([1; 32]), Limits::default());
    assert!(packets.iter().all(|packet| receiver.push(packet) == Received::Foreign));
    // The tag alone does not make a file the right one.
    let mut other = source.id();
    other.0[31] ^= 1;
    let mut receiver = Receiver::new(other, Limits::default());
    assert_eq!(receiver.push(&packets[0]), Received::Refuted);
    assert_eq!(receiver.take(), None);
}

#[test]
fn memory_is_bounded() {
    let (source, mut packets) = packets(3000, 0);
    packets.reverse();
    let limits = Limits { max_memory: 6000 };
    let mut receiver = Receiver::new(source.id(), limits);
    let results: Vec<Received> = packets.iter().map(|packet| receiver.push(packet)).collect();
    assert!(results.contains(&Received::Refused));
    assert!(receiver.held <= limits.max_memory);
}

/// A million packets, or as many as `TERCET_MANGLED` says: bits flipped, bytes cut and added, fields
/// changed under a right checksum, blocks mixed up. No byte that is given out is wrong, memory keeps
/// its bound, and in the end the true packets still complete the file.
#[test]
fn mangled_packets_do_no_harm() {
    let count = std::env::var("TERCET_MANGLED").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000);
    let (source, packets) = packets(1500, 4);
    let limits = Limits { max_memory: 200_000 };
    let mut receiver = Receiver::new(source.id(), limits);
    let mut random = Random::new(5);
    let mut bytes = Vec::new();
    for i in 0..count {
        let mut packet = packets[random.below(packets.len())].clone();
        mangle(&mut packet, &mut random);
        receiver.push(&packet);
        assert!(receiver.held <= limits.max_memory);
        bytes.extend(taken(&mut receiver));
        assert!(source.file().starts_with(&bytes), "after {i} packets");
        if receiver.is_complete() {
            receiver = Receiver::new(source.id(), limits);
            bytes.clear();
        }
    }
    let mut rounds = 0;
    while !receiver.is_complete() {
        packets.iter().for_each(|packet| _ = receiver.push(packet));
        rounds += 1;
        assert!(rounds < 20, "true packets complete the file in the end");
    }
    bytes.extend(taken(&mut receiver));
    assert_eq!(bytes, source.file());
}

fn mangle(packet: &mut Vec<u8>, random: &mut Random) {
    let kind = random.below(8);
    match kind {
        0 => packet.truncate(random.below(packet.len())),
        1 => packet.extend((0..random.below(40)).map(|i| i as u8)),
        2 => *packet = (0..random.below(2 * MAX_DATAGRAM)).map(|_| random.below(256) as u8).collect(),
        3 => {
            for _ in 0..=random.below(8) {
                let bit = random.below(8 * packet.len());
                packet[bit / 8] ^= 1 << (bit % 8);
            }
        }
        4 => {}
        // A forger knows how to compute a checksum: after number, block, length, symbol, or payload.
        _ => {
            let end = packet.len() - 4;
            let place = if kind == 5 { 11 + random.below(13) } else { random.below(end) };
            packet[place] = random.below(256) as u8;
            let crc = crc32fast::hash(&packet[..end]);
            packet[end..].copy_from_slice(&crc.to_le_bytes());
        }
    }
}

/// The packets of a sender over a bad channel, byte by byte: what the simulation only counts.
#[test]
fn a_session_over_a_bad_channel_restores_the_file() {
    use crate::transport::{Conditions, GilbertElliott, Goal, Objective, Sender, Settings, Strategy};
    use std::sync::Arc;
    use std::time::Duration;
    let (source, _) = packets(3000, 0);
    let source = Arc::new(source);
    let loss = GilbertElliott::bursts(0.2, 8.0).unwrap();
    let round_trip = Duration::from_millis(100);
    let conditions = Conditions { loss, rate: 125_000.0, round_trip };
    let settings =
        Settings { strategy: Strategy::Optimal, objective: Objective::Psnr, goal: Goal::Anytime, conditions };
    let mut sender = Sender::new(Arc::clone(&source), settings);
    let mut receiver = Receiver::new(source.id(), Limits::default());
    let mut random = Random::new(9);
    let (mut bad, mut bytes, mut late) = (false, Vec::new(), Vec::new());
    for tick in 0..2000 {
        let now = Duration::from_millis(10 * tick);
        bad = loss.step(bad, random.unit());
        if let Some(mut packet) = sender.next_packet(now) {
            assert!(packet.len() <= MAX_DATAGRAM && packet.len() > OVERHEAD);
            match (bad, random.below(10)) {
                (true, _) => {}
                (_, 0) => late.push(packet),
                (_, 1) => {
                    packet[20] ^= 1;
                    assert_eq!(receiver.push(&packet), Received::Mangled);
                }
                (_, choice) => {
                    receiver.push(&packet);
                    if choice == 2 {
                        assert_eq!(receiver.push(&packet), Received::Late);
                    }
                }
            }
        }
        if tick % 5 == 0 {
            late.drain(..).for_each(|packet| _ = receiver.push(&packet));
            assert!(sender.report(&receiver.report().write(), now));
        }
        bytes.extend(taken(&mut receiver));
    }
    assert!(sender.is_done() && receiver.is_complete());
    assert_eq!(bytes, source.file());
    assert!(!sender.report(b"nonsense", round_trip));
    // As many bytes later the counting simulation would have been done, too.
    let channel = simulation::Channel::new(simulation::Loss::Bursts(loss), 125_000.0, round_trip).unwrap();
    let run = simulation::session(&source, settings, &channel, 9, Duration::from_secs(20));
    assert!(run.exact().is_some());
}
