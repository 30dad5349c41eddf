//! Groups: parts of a pass over a regular level, each coded as if the others did not exist, so that any of them can be
//! decoded whichever others are missing.
//!
//! In a √3 or butterfly level that costs no topology: where a group is missing, vertices lie where they are
//! expected. Which vertices make a group is told by its [growth](super::growth). A group begins with the models from
//! before the pass. Other models learn from all groups, in their order, what those learn, and are what the next level
//! begins with.

use super::around::Known;
use super::detail::{DetailModels, Lesson};
use super::growth::Growth;
use super::pass::Pass;
use super::region::Field;
use super::site::Site;
use super::tabled::TableModels;
use super::vector::Point;
use crate::entropy::{Coder, Counter, Encoder};
use crate::mesh::Surface;
use crate::subdivide::round;
use std::ops::Range;

/// A level of fewer groups is coded in one piece: each of the first levels has much to learn, which groups do not tell
/// one another.
const FEWEST: usize = 4;

/// A pass in groups, and how far it has come.
pub(crate) struct Groups {
    growth: Growth,
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

/// A group at work: the place of its first vertex, and what its models have become.
struct Group {
    start: usize,
    details: DetailModels,
    escapes: Vec<Counter>,
}

impl Groups {
    /// Of a pass over the vertices at `sites`, numbered from `first` on, of which none is coded; the groups have so many
    /// `vertices`, none of them are known when encoding. Time O(n).
    pub fn new(first: u32, sites: Vec<Site>, vertices: &[u16], models: TableModels) -> Self {
        let mut growth = Growth::new(first, sites);
        let mut grow = |&count: &u16| {
            for _ in 0..count {
                growth.grow();
            }
            let end = growth.order.len();
            growth.close(end);
            end
        };
        Groups {
            ends: vertices.iter().map(&mut grow).collect(),
            shown: vec![false; vertices.len()],
            growth,
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

    /// The places of a group's vertices in the order of coding.
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
            place(pass, &self.growth.order[range], field);
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

    /// Codes the group whose vertices have these places, as far as there are bytes; what there was to learn.
    fn code<C: Coder>(
        &self,
        coder: &mut C,
        pass: &Pass,
        range: Range<usize>,
        targets: &[Point],
        field: &mut Field,
    ) -> Vec<Lesson> {
        let mut group = self.begin(range.start);
        let mut lessons = Vec::with_capacity(3 * range.len());
        for place in range {
            if coder.exhausted() {
                // The caller refuses the group; what follows would only take time.
                break;
            }
            lessons.extend(self.vertex(coder, pass, &mut group, place, targets, field));
        }
        lessons
    }

    /// The group that begins with the vertex of a place.
    fn begin(&self, start: usize) -> Group {
        Group { start, details: self.models.details.clone(), escapes: self.models.escapes.clone() }
    }

    /// Codes the vertex of a place, those of its group before it being coded.
    fn vertex<C: Coder>(
        &self,
        coder: &mut C,
        pass: &Pass,
        group: &mut Group,
        place: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> [Lesson; 3] {
        let Pass { surface: &Surface { virtuals, .. }, first, estimates, .. } = *pass;
        let Group { start, ref mut details, ref mut escapes } = *group;
        let i = self.growth.order[place];
        let (v, i) = (first + i, i as usize);
        let target = targets.get(i).copied().unwrap_or_default();
        let known = Known { virtuals, v, first, positions: &field.positions, estimates };
        let told = |vertex| self.growth.is_between(vertex, start, place);
        let (point, lessons) = details.code(coder, &self.growth.sites[i], &known, told, escapes, target);
        field.positions[v as usize] = point;
        lessons
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
        let bytes_of = |groups: &[(u16, Vec<u8>)]| groups.iter().map(|group| group.1.len()).sum::<usize>();
        let groups = self.encode(pass, most, targets, field);
        let fewest = groups.len();
        if fewest < FEWEST {
            return None;
        }
        // The last group is rarely full: all could be a little shorter.
        let mut bytes = most.min(bytes_of(&groups) / fewest + 1);
        loop {
            let groups = self.encode(pass, bytes, targets, field);
            let beyond = bytes_of(groups.get(fewest..).unwrap_or_default());
            if beyond == 0 || bytes == most {
                return Some(groups);
            }
            bytes = most.min(bytes + beyond.div_ceil(fewest));
        }
    }

    /// Forgets what was coded; the models and sites that the pass began with.
    pub fn give_up(&mut self, pass: &Pass, field: &mut Field) -> (TableModels, Vec<Site>) {
        place(pass, &self.growth.order, field);
        (self.models.clone(), std::mem::take(&mut self.growth.sites))
    }

    /// Encodes all `targets` in groups of at most `bytes` bytes each.
    fn encode(
        &mut self,
        pass: &Pass,
        bytes: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> Vec<(u16, Vec<u8>)> {
        self.growth.restart();
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
            self.growth.close(end);
            groups.push(((end - start) as u16, stream));
            start = end;
        }
        groups
    }

    /// Lets a group grow from `start` on until it takes some `bytes`, or more by a vertex or two; where it ends.
    fn reach(
        &mut self,
        pass: &Pass,
        start: usize,
        bytes: usize,
        targets: &[Point],
        field: &mut Field,
    ) -> usize {
        let most = start + usize::from(u16::MAX);
        let (mut coder, mut group) = (Encoder::new(), self.begin(start));
        let mut end = start;
        while end < most && coder.bits() <= 8 * bytes as u64 && self.growth.grow() {
            self.vertex(&mut coder, pass, &mut group, end, targets, field);
            end += 1;
        }
        end
    }
}

/// Puts some vertices, counted from the first of the pass, where they are expected.
fn place(pass: &Pass, vertices: &[u32], field: &mut Field) {
    for &v in vertices {
        field.positions[(pass.first + v) as usize] = round(pass.estimates[v as usize]);
    }
}
