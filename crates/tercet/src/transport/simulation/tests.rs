//! What the acceptance of the transport asks for, of generated meshes.

use super::channel::Link;
use super::*;
use crate::transport::{
    Conditions, GilbertElliott, Goal, MAX_DATAGRAM, Objective, Settings, Source, Strategy,
};
use crate::{EncodeOptions, encode, shapes};

const ROUND_TRIP: Duration = Duration::from_millis(100);
const END: Duration = Duration::from_secs(300);

fn source() -> Source {
    Source::new(encode(&shapes::scan(12_000, 1), &EncodeOptions::default()).unwrap().bytes).unwrap()
}

/// 1 Mbit/s that lose a tenth of all packets, in bursts of eight.
fn bursts() -> Channel {
    let loss = Loss::Bursts(GilbertElliott::bursts(0.1, 8.0).unwrap());
    Channel::new(loss, 125_000.0, ROUND_TRIP).unwrap()
}

fn settings(channel: &Channel) -> Settings {
    let loss = channel.estimate().unwrap();
    let conditions = Conditions { loss, rate: channel.steps[0].rate, round_trip: channel.round_trip };
    Settings { strategy: Strategy::Optimal, objective: Objective::Psnr, goal: Goal::Anytime, conditions }
}

fn summary(runs: impl Iterator<Item = Run>) -> Summary {
    summarize(&runs.collect::<Vec<_>>(), &[], ROUND_TRIP, END)
}

/// The part of sessions in which any packet at all arrives within a round trip and a half.
fn bound(channel: &Channel, seeds: std::ops::Range<u64>) -> f64 {
    let arrives = |seed: &u64| {
        let mut link = Link::new(channel, *seed);
        let mut sent = std::iter::from_fn(|| Some(link.send(0, MAX_DATAGRAM as u32)));
        let in_time = channel::micros(ROUND_TRIP);
        sent.find(|packet| packet.sent > in_time || packet.arrivals[0].is_some()).unwrap().sent <= in_time
    };
    seeds.clone().filter(arrives).count() as f64 / seeds.count() as f64
}

#[test]
fn the_base_arrives_as_often_as_any_packet_does() {
    let (source, channel, seeds) = (source(), bursts(), 0..4000);
    let sessions = |channel: &Channel| {
        let runs =
            seeds.clone().map(|seed| session(&source, settings(channel), channel, seed, 2 * ROUND_TRIP));
        summary(runs).base_in_time
    };
    let (base, bound) = (sessions(&channel), bound(&channel, seeds.clone()));
    // 1 - 0.1 · (7/8)^9: ten packets are sent in a round trip, and the burst outlasts them all.
    assert!((bound - 0.97).abs() < 0.01, "{bound}");
    assert!(base >= bound - 0.01 && base <= bound + 0.002, "{base} of {bound}");

    let independent = Channel::new(Loss::Independent(0.1), 125_000.0, ROUND_TRIP).unwrap();
    assert!(sessions(&independent) >= 0.999);
}

#[test]
fn the_whole_file_takes_little_more_than_the_channel_and_much_less_than_an_ordered_stream() {
    let (source, channel) = (source(), bursts());
    let sessions = (0..600).map(|seed| session(&source, settings(&channel), &channel, seed, END));
    let ours = summary(sessions).exact;
    let streams = (0..600).map(|seed| ordered(&source, &channel, seed, END));
    let stream = summary(streams).exact;
    assert!(ours <= 0.7 * stream, "{ours} of {stream}");
    let packets = source.file().len().div_ceil(1150) as f64;
    let least = packets * MAX_DATAGRAM as f64 / 125_000.0 / 0.9 + 0.05;
    assert!(ours <= 1.06 * least, "{ours}, at least {least}");
}
