//! The format document's examples and vectors, and what spans several modules.

use super::code::{Code, Encoder};
use super::packet::Packet;
use super::simulation::{Channel, Loss, ordered, session, summarize};
use super::*;
use crate::{Decoder, EncodeOptions, Limits, Mesh, Scheme, decode, encode, shapes, subdivide};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

fn spec(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../spec").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_documents_example_is_what_is_written() {
    let text = spec("datagrams.md");
    let fence = text.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let example: Vec<u8> =
        fence.split_whitespace().map(|word| u8::from_str_radix(word, 16).unwrap()).collect();
    let tag = [0, 1, 2, 3, 4, 5, 6, 7];
    let symbol = Encoder::new(b"123456789").unwrap().symbol(0);
    let packet = Packet { tag, number: 7, block: 1, length: 9, symbol: 0, payload: &symbol };
    let progress = vec![Progress { block: 1, received: Some(1) }];
    let report = Report { tag, heard: 8, done: 0, progress };
    assert_eq!(example, [packet.write(), report.write()].concat());
}

/// Lines of block length, symbol, bytes and CRC-32 of the symbol.
fn vectors() -> String {
    let mut lines = String::new();
    for length in [1, 9, 1150, 1151, 3001, 147_200, 147_201, 400_000] {
        let block: Vec<u8> = (0..length).map(|i: usize| (i.wrapping_mul(i) + i / 256) as u8).collect();
        let (code, encoder) = (Code::of(length).unwrap(), Encoder::new(&block).unwrap());
        for symbol in [0, code.symbols - 1, code.symbols, code.symbols + 1, 255] {
            let bytes = encoder.symbol(symbol);
            let crc = crc32fast::hash(&bytes);
            lines += &format!("{length} {symbol} {} {crc:08x}\n", bytes.len());
        }
    }
    lines
}

#[test]
fn symbols_are_the_golden_ones() {
    assert_eq!(spec("golden/datagrams.txt"), vectors());
}

#[test]
#[ignore = "writes spec/golden/datagrams.txt"]
fn write_the_golden_symbols() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../spec/golden/datagrams.txt");
    std::fs::write(path, vectors()).unwrap();
}

fn source() -> Source {
    let options = EncodeOptions { bits: Some(12), ..EncodeOptions::default() };
    Source::new(encode(&shapes::scan(8000, 1), &options).unwrap().bytes).unwrap()
}

fn settings(strategy: Strategy, goal: Goal, channel: &Channel) -> Settings {
    let conditions = Conditions {
        loss: channel.estimate().unwrap(),
        rate: channel.steps[0].rate,
        round_trip: channel.round_trip,
    };
    Settings { strategy, objective: Objective::Psnr, goal, conditions }
}

#[test]
fn blocks_are_the_file_and_end_with_its_levels() {
    let source = source();
    let info = crate::Info::of(source.file()).unwrap();
    let (_, head) = blocks::Manifest::read(source.blocks.bytes(source.file(), 0)).unwrap();
    let mut bytes = head.to_vec();
    for block in 1..source.blocks.count() {
        bytes.extend(source.blocks.bytes(source.file(), block));
        let end = bytes.len() as u64;
        assert!(
            info.levels.iter().any(|level| level.bytes == end) || end >= info.levels.last().unwrap().bytes
        );
    }
    assert_eq!(bytes, source.file());
    assert_eq!(source.blocks.quality(source.blocks.count() - 1), Quality::EXACT);
    assert!(source.blocks.quality(0) < Quality::NOTHING, "the base is in the first packet");
}

#[test]
fn damaged_and_cut_files_are_no_sources() {
    let file = source().file().to_vec();
    assert!(matches!(Source::new(&file[..file.len() - 1]), Err(crate::Error::Truncated { .. })));
    for end in [0, 3, 20, 60] {
        assert!(Source::new(&file[..end]).is_err(), "{end}");
    }
    assert!(Source::new([file, vec![0]].concat()).is_err());
}

/// The simulation of a channel without losses takes the time that arithmetic gives.
#[test]
fn a_perfect_channel_takes_the_time_of_its_bytes() {
    let source = source();
    let channel = Channel::new(Loss::Independent(0.0), 125_000.0, Duration::from_millis(100)).unwrap();
    let end = Duration::from_secs(20);
    let run = session(&source, settings(Strategy::None, Goal::Anytime, &channel), &channel, 1, end);
    let exact = run.exact().unwrap();
    assert_eq!(run.bytes(end), run.bytes(exact), "no redundancy");
    let expected = run.bytes(end) as f64 / 125_000.0 + 0.05;
    assert!((exact.as_secs_f64() - expected).abs() < 0.005, "{exact:?} for {expected} s");
    assert!(ordered(&source, &channel, 1, end).exact().unwrap() >= exact.mul_f64(0.95));
}

#[test]
fn the_same_seed_gives_the_same_session() {
    let source = source();
    let loss = Loss::Bursts(GilbertElliott::bursts(0.1, 8.0).unwrap());
    let channel = Channel::new(loss, 125_000.0, Duration::from_millis(100)).unwrap();
    let settings = settings(Strategy::Optimal, Goal::Anytime, &channel);
    // A few of them: short sessions without any burst are the same, too.
    let runs = |first: u64| {
        let runs = (first..first + 10).map(|seed| session(&source, settings, &channel, seed, Duration::MAX));
        runs.collect::<Vec<_>>()
    };
    assert_eq!(runs(1), runs(1));
    assert_ne!(runs(1), runs(2));
}

/// A small version of what `tercet simulate` shows for real meshes.
#[test]
fn protection_pays() {
    // Of a smaller file a good part of the time is the way there, whatever protects it.
    let source =
        Source::new(encode(&shapes::scan(8000, 1), &EncodeOptions::default()).unwrap().bytes).unwrap();
    let round_trip = Duration::from_millis(100);
    let channel = Channel::new(Loss::Independent(0.1), 125_000.0, round_trip).unwrap();
    let (times, end) = ([Duration::from_millis(200)], Duration::from_secs(60));
    let of = |strategy| {
        let runs: Vec<_> = (0..200)
            .map(|seed| session(&source, settings(strategy, Goal::Anytime, &channel), &channel, seed, end))
            .collect();
        summarize(&runs, &times, round_trip, end)
    };
    let (optimal, none) = (of(Strategy::Optimal), of(Strategy::None));
    assert!(optimal.base_in_time >= 0.995 && none.base_in_time < 0.95);
    assert!(optimal.points[0].psnr > none.points[0].psnr);
    let baseline: Vec<_> = (0..200).map(|seed| ordered(&source, &channel, seed, end)).collect();
    let baseline = summarize(&baseline, &times, round_trip, end);
    assert!(optimal.exact < 0.7 * baseline.exact, "{} {}", optimal.exact, baseline.exact);
}

/// A √3 file whose finest levels are in groups, and the mesh.
fn grouped() -> (Source, Mesh) {
    let base = shapes::scan(200, 1);
    let mesh = subdivide(&base, Scheme::Sqrt3, 4, &Limits::default()).unwrap();
    let options = EncodeOptions { bits: Some(12), groups: true, ..EncodeOptions::default() };
    let file = encode(&shapes::noisy(&mesh, 0.002, 1), &options).unwrap().bytes;
    (Source::new(file.clone()).unwrap(), decode(&file, &Limits::default()).unwrap())
}

#[test]
fn groups_are_the_symbols_of_their_blocks() {
    let (source, _) = grouped();
    let of_use: Vec<usize> =
        (0..source.blocks.count()).filter(|&i| source.blocks.in_part(i, 0).is_some()).collect();
    assert!(of_use.len() >= 2);
    for i in of_use {
        let symbols = code::Code::of(source.blocks.bytes(source.file(), i).len()).unwrap().symbols as usize;
        let shown: Vec<_> = (0..=symbols).map(|n| source.blocks.in_part(i, n).unwrap().error()).collect();
        assert!(shown.is_sorted_by(|a, b| a > b));
        assert_eq!(shown[0], source.blocks.quality(i - 1).error());
    }
}

/// Whatever the strategy, all blocks are sent, those that show nothing by themselves among them.
#[test]
fn files_in_groups_arrive_before_a_deadline() {
    let (source, _) = grouped();
    let channel = Channel::new(Loss::Independent(0.0), 125_000.0, Duration::from_millis(100)).unwrap();
    for strategy in [Strategy::None, Strategy::Equal, Strategy::Greedy, Strategy::Optimal] {
        let end = Duration::from_secs(5);
        let run = session(&source, settings(strategy, Goal::Deadline(end), &channel), &channel, 1, end);
        assert!(run.exact().is_some(), "{strategy:?}");
    }
}

/// The mean square of the distances of vertices, those of a surface that is not there yet from its last one.
fn error(shown: &[[f32; 3]], exact: &[[f32; 3]]) -> f64 {
    let squares = shown.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>() / exact.len() as f64
}

/// Of 25 % of packets lost, each level is shown with fewer and fewer holes, and the whole is exact.
#[test]
fn levels_fill_up_while_packets_are_lost() {
    let (source, mesh) = grouped();
    let exact = levels(source.file());
    for seed in 0..3 {
        let mut random = shapes::Random::new(seed);
        let channel = Channel::new(Loss::Independent(0.25), 125_000.0, Duration::from_millis(100)).unwrap();
        let source = Arc::new(Source::new(source.file()).unwrap());
        let mut sender = Sender::new(source.clone(), settings(Strategy::Optimal, Goal::Anytime, &channel));
        let mut receiver = Receiver::new(source.id(), Limits::default());
        let mut decoder = Decoder::new(Limits::default());
        let (mut level, mut before, mut holes, mut last) = (0, f64::INFINITY, 0, None);
        for tick in 0..100_000 {
            let now = Duration::from_millis(10 * tick);
            if let Some(datagram) = sender.next_packet(now)
                && random.unit() >= 0.25
            {
                receiver.push(&datagram);
            }
            while let Some(bytes) = receiver.take() {
                decoder.push(&bytes);
            }
            while let Some(next) = decoder.next_level().unwrap() {
                (level, before) = (next.level as usize + 1, f64::INFINITY);
                last = Some(next.mesh);
            }
            let mut glimpsed = 0;
            while let Some((place, bytes)) = receiver.glimpse() {
                glimpsed += decoder.glimpse(place, &bytes);
            }
            if let Some(shown) = decoder.preview().filter(|_| glimpsed > 0) {
                let now = error(&shown.mesh.positions, &exact[level].positions);
                assert!(shown.mesh.faces == exact[level].faces && now < before, "{now} after {before}");
                (before, holes) = (now, holes + 1);
            }
            if tick % 5 == 0 {
                sender.report(&receiver.report().write(), now);
            }
            if sender.is_done() {
                break;
            }
        }
        assert!(receiver.is_complete() && holes > 10, "{holes}");
        decoder.finish().unwrap();
        assert!(last.unwrap() == mesh);
    }
}

fn levels(file: &[u8]) -> Vec<Mesh> {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(file);
    std::iter::from_fn(|| decoder.next_level().unwrap()).map(|level| level.mesh).collect()
}
