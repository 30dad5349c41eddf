//! The base mesh in the first round trip, before any report can help: how many repairs, how far apart.
//!
//! A burst passes with time, not with packets: repairs that follow at once are lost together with what they
//! are to replace. Those that are spread evenly over all packets that arrive within a round trip and a half
//! come as near as possible to the bound that holds for any sender, the probability that one of all these
//! packets arrives; a second repair already misses it by little. Each further one holds up the whole
//! rest of the file, so that none is sent that helps too few sessions.

use super::loss::GilbertElliott;

/// A probability that is enough.
const ENOUGH: f64 = 0.999_5;
/// A repair must help one session in so many.
const WORTH: f64 = 1.0 / 1250.0;

/// Repairs of a block, in addition to its first packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cover {
    pub(super) repairs: u32,
    /// From the last first packet to the first repair, and from one repair to the next, in the time of
    /// the largest packet.
    pub(super) distance: f64,
}

/// The repairs of a block of `symbols` symbols, if its packets come in time for `room` of the time of
/// the largest packet, from the first one's beginning to the last one's end.
///
/// Takes time O(`symbols`²) for each of a handful of repairs.
pub(super) fn cover(symbols: u32, room: f64, channel: &GilbertElliott) -> Cover {
    let spare = room - f64::from(symbols);
    let mut best = Cover { repairs: 0, distance: 1.0 };
    let mut chance = channel.spread(symbols, 0, 1.0);
    // The cast saturates.
    for repairs in 1..=spare as u32 {
        let next = Cover { repairs, distance: spare / f64::from(repairs) };
        let then = channel.spread(symbols, repairs, next.distance);
        if chance >= ENOUGH || then - chance < WORTH {
            break;
        }
        (best, chance) = (next, then);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_outlasted_by_distance_and_single_losses_by_number() {
        let bursts = GilbertElliott::bursts(0.1, 8.0).unwrap();
        assert_eq!(cover(1, 10.0, &bursts), Cover { repairs: 2, distance: 4.5 });
        let independent = GilbertElliott::independent(0.1).unwrap();
        assert_eq!(cover(1, 10.0, &independent), Cover { repairs: 3, distance: 3.0 });
        assert_eq!(cover(1, 10.0, &GilbertElliott::independent(0.0).unwrap()).repairs, 0);
    }

    #[test]
    fn there_is_no_room_after_the_last_packet_in_time() {
        let channel = GilbertElliott::bursts(0.2, 8.0).unwrap();
        for (symbols, room) in [(1, 0.0), (1, 1.5), (5, 3.0), (3, 4.2), (2, 40.0)] {
            let Cover { repairs, distance } = cover(symbols, room, &channel);
            assert!(
                repairs == 0 || f64::from(symbols) + f64::from(repairs) * distance <= room + 1e-9,
                "{symbols} {room}"
            );
        }
    }
}
