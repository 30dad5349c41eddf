//! Groups: runs of a pass by tables, each coded as if the others did not exist, so that any of them can be
//! decoded whichever others are missing.
//!
//! In a √3 or butterfly level that costs no topology: where a group is missing, vertices lie where they are
//! expected. A group begins with the models from before the pass. Other models learn from all groups, in their order,
//! what those learn, and are what the next level begins with.

use super::detail::Lesson;
use super::pass::Pass;
use super::region::Field;
use super::site::Site;
use super::tabled::{TableModels, Walk};
use super::vector::Point;
use crate::entropy::{Coder, Encoder};
use crate::subdivide::round;
use std::ops::Range;

/// Whether this build knows them.
pub(crate) const KNOWN: bool = cfg!(feature = "groups");

/// A level of fewer groups is coded in one piece: each of the first levels has much to learn, which groups do not tell
/// one another.
const FEWEST: usize = 4;

/// A pass in groups, and how far it has come.
pub(crate) struct Groups {
    sites: Vec<Site>,
    /// Vertices of the groups before the end of each.
    ends: Vec<usize>,
    /// For each group whether its vertices lie where it says.
    shown: Vec<bool>,
    /// Groups that are coded for good: the first ones.
    done: usize,
    /// What is known before the pass.
    models: TableModels,
    /// What will be after it.
    next_models: TableModels,
}

/// A group at work: its first vertex, and what its models have become.
struct Group {
    start: usize,
    models: TableModels,
}

impl Groups {
    /// Of a pass over the vertices at `sites`, of which none is coded; the groups have so many `vertices`, none of
    /// them are known when encoding.
    pub fn new(sites: Vec<Site>, vertices: &[u16], models: TableModels) -> Self {
        let mut end = 0;
        let ends = vertices.iter().map(|&count| {
            end += usize::from(count);
            end
        });
        Groups {
            ends: ends.collect(),
            shown: vec![false; vertices.len()],
            sites,
            done: 0,
            next_models: models.clone(),
            models,
        }
    }

    /// The group whose turn it is in the order of the file, if one is left.
    pub fn next(&self) -> Option<usize> {
        (self.done < self.ends.len()).then_some(self.done)
    }

    /// How many vertices lie where they are expected.
    pub fn pending(&self) -> usize {
        let hidden = (0..self.ends.len()).filter(|&group| !self.shown[group]);
        hidden.map(|group| self.range(group).len()).sum()
    }

    fn range(&self, group: usize) -> Range<usize> {
        let before = group.checked_sub(1);
        before.map_or(0, |before| self.ends[before])..self.ends[group]
    }

    /// Decodes a group: the next one for good if it `stays`, or any to be looked at until then. False if its bytes end
    /// early: then its vertices lie where they are expected.
    pub fn decode<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        group: usize,
        stays: bool,
        field: &mut Field,
    ) -> bool {
        let range = self.range(group);
        let lessons = self.code(coder, pass, range.clone(), &[], field);
        self.shown[group] = !coder.exhausted();
        if coder.exhausted() {
            place(pass, range, field);
        } else if stays {
            self.next_models.learn(&lessons);
            self.done += 1;
        }
        self.shown[group]
    }

    /// What is known after the pass, all of whose groups are coded.
    pub fn finish(self) -> TableModels {
        self.next_models
    }

    /// Codes a run of vertices as a group; what there was to learn.
    fn code<C: Coder>(
        &self,
        coder: &mut C,
        pass: &Pass,
        range: Range<usize>,
        targets: &[Point],
        field: &mut Field,
    ) -> Vec<Lesson> {
        self.go_on(coder, pass, &mut self.begin(range.start), range, targets, field)
    }

    /// The group that begins with a vertex.
    fn begin(&self, start: usize) -> Group {
        Group { start, models: self.models.clone() }
    }

    /// Codes a run of vertices of a group, those before them being coded.
    fn go_on<C: Coder>(
        &self,
        coder: &mut C,
        pass: &Pass,
        group: &mut Group,
        range: Range<usize>,
        targets: &[Point],
        field: &mut Field,
    ) -> Vec<Lesson> {
        // Vertices of groups before are strangers: they are not at the sites of this one.
        let others = pass.first..pass.first + group.start as u32;
        let mut sites = self.sites[range.clone()].to_vec();
        for (v, site) in (pass.first + range.start as u32..).zip(&mut sites) {
            site.wings.iter_mut().filter(|wing| others.contains(wing)).for_each(|wing| *wing = v);
        }
        let mut walk = Walk::new(sites, range.start);
        walk.lessons = Some(Vec::with_capacity(3 * range.len()));
        group.models.code(coder, pass, &mut walk, targets, &mut field.positions, &mut field.rough);
        walk.lessons.unwrap_or_default()
    }

    /// Encodes all `targets`, in as few groups as `most` bytes for each allow, of sizes as equal as may be; the
    /// vertices and bytes of each. Nothing if those are fewer than [`FEWEST`]. Time O(n).
    pub fn encode_evenly(
        &mut self,
        pass: &Pass,
        most: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> Option<Vec<(u16, Vec<u8>)>> {
        let groups = self.encode(pass, most, targets, field);
        let (fewest, all) = (groups.len(), groups.iter().map(|group| group.1.len()).sum::<usize>());
        if fewest < FEWEST {
            return None;
        }
        // The last group is rarely full: all could be a little shorter.
        let mut bytes = most.min(all / fewest + 2);
        loop {
            let groups = self.encode(pass, bytes, targets, field);
            if groups.len() == fewest || bytes == most {
                return Some(groups);
            }
            bytes += (most - bytes).div_ceil(4);
        }
    }

    /// Forgets what was coded; the models and sites that the pass began with.
    pub fn give_up(&mut self, pass: &Pass, field: &mut Field) -> (TableModels, Vec<Site>) {
        place(pass, 0..self.sites.len(), field);
        (self.models.clone(), std::mem::take(&mut self.sites))
    }

    /// Encodes all `targets` in groups of at most `bytes` bytes each.
    fn encode(
        &mut self,
        pass: &Pass,
        bytes: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> Vec<(u16, Vec<u8>)> {
        self.next_models = self.models.clone();
        let mut groups = Vec::new();
        let mut start = 0;
        while start < targets.len() {
            let mut end = self.reach(pass, start, bytes, targets, field);
            let stream = loop {
                let mut coder = Encoder::new();
                let lessons = self.code(&mut coder, pass, start..end, targets, field);
                let stream = coder.finish();
                if stream.len() <= bytes || end == start + 1 {
                    self.next_models.learn(&lessons);
                    break stream;
                }
                end -= 1;
            };
            groups.push(((end - start) as u16, stream));
            start = end;
        }
        groups
    }

    /// Where a group from `start` on ends that takes some `bytes`, and no more by a vertex at most.
    fn reach(
        &mut self,
        pass: &Pass,
        start: usize,
        bytes: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> usize {
        let most = targets.len().min(start + usize::from(u16::MAX));
        let mut coder = Encoder::new();
        let mut group = self.begin(start);
        let mut end = start;
        while end < most && coder.bits() <= 8 * bytes as u64 {
            self.go_on(&mut coder, pass, &mut group, end..end + 1, targets, field);
            end += 1;
        }
        end
    }
}

/// Puts a run of vertices where they are expected.
fn place(pass: &Pass, range: Range<usize>, field: &mut Field) {
    let first = pass.first as usize;
    let positions = &mut field.positions[first + range.start..first + range.end];
    for (point, &estimate) in positions.iter_mut().zip(&pass.estimates[range]) {
        *point = round(estimate);
    }
}
