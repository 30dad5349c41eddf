//! A level in groups: parts of its payload that are verified, and decoded, one by one and in any order.
//!
//! The payload is a head, which says how large the groups are and how many vertices each has, and the
//! groups, all of one size, each with a check of its own. So a group fills a packet, and which one it is
//! follows from its place.

use super::CRC_BYTES;
use super::checksum::checksum;
use crate::{Error, Result};
use std::ops::{Range, RangeInclusive};

/// Bytes that a group may have, its check included: too few would make a reader begin anew for little.
const GROUP_BYTES: RangeInclusive<usize> = 512..=1150;

/// Bytes that a group may have besides its check.
pub(crate) const MOST_IN_GROUP: usize = *GROUP_BYTES.end() - CRC_BYTES;

/// Bytes of a number in the head.
const FIELD: usize = size_of::<u16>();

/// What the head of a level in groups says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Groups {
    /// Bytes of a group, its check included.
    size: usize,
    /// Vertices of each.
    pub(crate) vertices: Vec<u16>,
}

impl Groups {
    /// Of a payload of `length` bytes, whose first are `bytes`; nothing as long as no head is there that its
    /// check matches.
    ///
    /// # Errors
    /// If all of the payload is there and its head is not a valid one.
    pub(crate) fn read(bytes: &[u8], length: u32) -> Result<Option<Self>> {
        match Self::of_head(bytes, length as usize) {
            None if bytes.len() == length as usize => Err(Error::format("level", "not made of groups")),
            groups => Ok(groups),
        }
    }

    fn of_head(bytes: &[u8], length: usize) -> Option<Self> {
        let size = usize::from(number(bytes.first_chunk()?));
        let groups = length.checked_sub(FIELD + CRC_BYTES)?;
        if !GROUP_BYTES.contains(&size) || !groups.is_multiple_of(FIELD + size) {
            return None;
        }
        let head = verified(bytes.get(..FIELD * (1 + groups / (FIELD + size)) + CRC_BYTES)?)?;
        Some(Groups { size, vertices: head[FIELD..].as_chunks().0.iter().map(number).collect() })
    }

    /// Bytes of the head.
    pub(crate) fn head(&self) -> usize {
        FIELD * (1 + self.vertices.len()) + CRC_BYTES
    }

    /// Bytes of a group, its check included.
    #[cfg(feature = "transport")]
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// The groups that lie in these bytes of the payload as a whole.
    pub(crate) fn within(&self, bytes: Range<usize>) -> Range<usize> {
        let start = bytes.start.saturating_sub(self.head()).div_ceil(self.size);
        start..(bytes.end.saturating_sub(self.head()) / self.size).min(self.vertices.len())
    }

    /// The bytes of a group in `payload`, which begins `skipped` bytes after the payload does; nothing if they
    /// are not there, or are not what the group's check says.
    pub(crate) fn stream<'a>(&self, group: usize, payload: &'a [u8], skipped: usize) -> Option<&'a [u8]> {
        let start = (self.head() + group * self.size).checked_sub(skipped)?;
        verified(payload.get(start..start + self.size)?)
    }
}

/// The payload of groups with so many vertices and these bytes each, at most [`MOST_IN_GROUP`].
pub(crate) fn join(groups: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let (least, most) = (*GROUP_BYTES.start(), *GROUP_BYTES.end());
    // Smaller ones would be shared out to fewer packets than there are groups; none may be larger than the largest.
    let least = least.max(most - (most / groups.len().max(1)).max(1) + 1);
    let longest = groups.iter().map(|group| group.1.len()).max().unwrap_or(0);
    let size = (longest + CRC_BYTES).max(least).next_multiple_of(2);
    debug_assert!(GROUP_BYTES.contains(&size));
    let numbers = std::iter::once(size as u16).chain(groups.iter().map(|group| group.0));
    let mut payload: Vec<u8> = numbers.flat_map(u16::to_le_bytes).collect();
    payload.extend(checksum(&payload).to_le_bytes());
    for (_, bytes) in groups {
        let start = payload.len();
        payload.extend(bytes);
        // What an arithmetic decoder reads behind the end of its bytes.
        payload.resize(start + size - CRC_BYTES, 0);
        payload.extend(checksum(&payload[start..]).to_le_bytes());
    }
    payload
}

fn number(bytes: &[u8; FIELD]) -> u16 {
    u16::from_le_bytes(*bytes)
}

/// What stands before the CRC-32 at the end, if that matches.
fn verified(bytes: &[u8]) -> Option<&[u8]> {
    let (bytes, check) = bytes.split_last_chunk()?;
    (checksum(bytes) == u32::from_le_bytes(*check)).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<u8> {
        join(&[(300, vec![1; 796]), (280, vec![2; 500]), (7, vec![])])
    }

    #[test]
    fn what_is_joined_comes_apart() {
        let payload = sample();
        let length = payload.len() as u32;
        assert_eq!(payload.len(), 2 + 3 * 2 + 4 + 3 * 800);
        for end in 0..12 {
            assert_eq!(Groups::read(&payload[..end], length).unwrap(), None);
        }
        let groups = Groups::read(&payload[..12], length).unwrap().unwrap();
        assert_eq!(groups, Groups { size: 800, vertices: vec![300, 280, 7] });
        assert_eq!(groups.stream(0, &payload, 0), Some(&[1; 796][..]));
        assert_eq!(groups.stream(1, &payload[812..], 812).unwrap()[499..502], [2, 0, 0]);
        assert_eq!(groups.stream(1, &payload[813..], 813), None);
        assert_eq!(groups.stream(2, &payload[..2011], 0), None);
        assert_eq!(groups.stream(3, &payload, 0), None);
    }

    #[test]
    fn any_number_of_groups_comes_apart() {
        for count in [1, 2, 3, 574, 575, 576, 1149, 1150, 1151, 1152, 3000] {
            let payload = join(&vec![(1, vec![7]); count]);
            let groups = Groups::read(&payload, payload.len() as u32).unwrap().unwrap();
            assert_eq!(groups.vertices, vec![1; count]);
            assert_eq!(groups.stream(count - 1, &payload, 0).unwrap()[..2], [7, 0]);
        }
    }

    #[test]
    fn groups_within_bytes_are_whole() {
        let groups = Groups::read(&sample(), sample().len() as u32).unwrap().unwrap();
        assert_eq!(groups.within(0..10_000), 0..3);
        assert_eq!(groups.within(12..1612), 0..2);
        assert_eq!(groups.within(13..2412), 1..3);
        assert!(groups.within(900..1700).is_empty());
    }

    #[test]
    fn harm_is_noticed_in_its_group_only() {
        let payload = sample();
        let length = payload.len() as u32;
        let groups = Groups::read(&payload, length).unwrap().unwrap();
        for at in 0..payload.len() {
            let mut harmed = payload.clone();
            harmed[at] ^= 0x40;
            match at.checked_sub(12) {
                None => {
                    Groups::read(&harmed, length).unwrap_err();
                    assert_eq!(Groups::read(&harmed[..20], length).unwrap(), None);
                }
                Some(at) => {
                    let fine = (0..3).filter(|&i| groups.stream(i, &harmed, 0).is_some());
                    assert!(fine.eq((0..3).filter(|&i| i != at / 800)), "{at}");
                }
            }
        }
    }

    #[test]
    fn lengths_that_no_groups_have_are_refused() {
        for length in [0, 1, 5, 6, 7, 900] {
            let payload = vec![0; length];
            Groups::read(&payload, length as u32).unwrap_err();
        }
        let mut tiny = join(&[(1, vec![])]);
        tiny[..2].copy_from_slice(&510u16.to_le_bytes());
        let check = checksum(&tiny[..4]).to_le_bytes();
        tiny[4..8].copy_from_slice(&check);
        Groups::read(&tiny[..518], 518).unwrap_err();
    }
}
