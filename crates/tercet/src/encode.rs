//! From a mesh to a file.

mod trial;

use crate::coding::supplement::{self, Original, Supplements};
use crate::coding::{Grouping, Levels, Point, Symmetry, payload};
use crate::container::{self, LevelEntry, LevelKind, MOST_STREAMS, Outline, Supplement, UpdateRule};
use crate::entropy::Encoder;
use crate::info::Info;
use crate::mesh::{Cut, Lattice, Mesh, Surface, box_lattice, cut, cut_along_curve, next, prev, stretched};
use crate::metrics::LevelErrors;
use crate::reverse::{BLOCK, Hierarchy, Reduction, StepKind, lift};
use crate::{Effort, Error, GROUPS, LevelScheme, Limits, Result, Update};

/// What to keep, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncodeOptions {
    /// Bits of the cubic lattice that positions are rounded to, 4..=24: its step is the longest
    /// side of the bounding box / (2^bits − 1). `None` keeps every bit of every float.
    pub bits: Option<u8>,
    /// Whether vertices and faces come back in the order of the original.
    pub keep_order: bool,
    /// How the details of √3 and butterfly levels move the vertices that a coarser level keeps.
    pub update: Update,
    /// How much work it may take to write and to read the file.
    pub effort: Effort,
    /// Which levels without connectivity bits are looked for.
    pub scheme: LevelScheme,
    /// What the levels are worth against the size of the file.
    pub progressive: Progressive,
    /// Whether √3 and butterfly levels of four packets or more are coded in groups, about a packet each, which can be
    /// shown in any order: over links that lose packets. Files grow by some 1 %, on fine lattices by up to 4 %.
    /// Without the feature `groups`, encoding fails.
    pub groups: bool,
}

/// Which of two goods comes first where they are at odds: levels with positions of their own, or few
/// bytes.
///
/// The positions of the finest levels may come *late*, all in one pass over the finest surface. Until
/// they arrive, new vertices lie where they are expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Progressive {
    /// Positions come late only where that makes files smaller by some 3 %, judged by coding a part of
    /// the mesh.
    #[default]
    Best,
    /// The smallest file, found by coding the whole mesh in every way: some five times the time.
    Smallest,
}

/// A file and what it consists of.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// The file.
    pub bytes: Vec<u8>,
    /// What the file says of itself.
    pub info: Info,
    /// Bits spent on connectivity, over all levels.
    pub connectivity_bits: u64,
    /// Bits spent on positions, over all levels.
    pub position_bits: u64,
}

/// How far encoding has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub stage: &'static str,
    /// Vertices done in this stage.
    pub done: u64,
    /// Vertices to be done in this stage.
    pub total: u64,
}

/// Encodes a mesh; time O(n), memory some 250 bytes a vertex, the mesh included.
///
/// # Errors
/// [`Error::Mesh`] for an index out of range or a coordinate that is not finite,
/// [`Error::Parameter`] for `bits` outside 4..=24, [`Error::Unsupported`] for `groups` without that feature, and
/// [`Error::Limit`] if a section or the header would be larger than the format allows.
pub fn encode(mesh: &Mesh, options: &EncodeOptions) -> Result<Encoded> {
    encode_with(mesh, options, &mut |_| {})
}

/// As [`encode`], telling `progress` how far it has come.
///
/// # Errors
/// As [`encode`].
pub fn encode_with(
    mesh: &Mesh,
    options: &EncodeOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Encoded> {
    encode_stretched(mesh, options, 1.0, progress)
}

/// As [`encode_with`], on a lattice over a cube whose side is that of the bounding box times `stretch`, at
/// least 1: so there are steps between those of whole bits.
pub(crate) fn encode_stretched(
    mesh: &Mesh,
    options: &EncodeOptions,
    stretch: f64,
    progress: &mut dyn FnMut(Progress),
) -> Result<Encoded> {
    mesh.check()?;
    if let Some(bits) = options.bits
        && !(4..=24).contains(&bits)
    {
        return Err(Error::Parameter(format!("{bits} bits: 4 to 24 are possible")));
    }
    if options.groups && !GROUPS {
        return Err(Error::Unsupported("levels in groups: this build lacks the feature `groups`".into()));
    }
    // One block of vertices fits in the cache as it is.
    let cut = if mesh.positions.len() > BLOCK { cut_along_curve } else { cut };
    let Cut { surface, vertex_source, loose, degenerate, .. } = cut(mesh);
    let precision = match options.bits {
        Some(bits) => stretched(box_lattice(mesh, bits), stretch),
        None => supplement::exact_lattice(mesh, vertex_source.len()),
    };
    let lattice = Lattice::new(&precision);
    let mut points: Vec<Point> = vec![[0; 3]; surface.virtuals as usize];
    points.extend(vertex_source.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])));
    let symmetry = Symmetry::find(&points[surface.virtuals as usize..], lattice.quantise([0.0; 3]));
    let mut errors = LevelErrors::new(mesh, &surface, &vertex_source, &lattice);
    let total = vertex_source.len() as u64;
    let hierarchy = Hierarchy::build(surface, points, options.scheme, options.update, |reached| {
        progress(Progress { stage: "reducing", done: total - reached.left() as u64, total });
        errors.measure(reached);
    });
    let late = trial::late_levels(&hierarchy, symmetry, options)?;
    let streams = streams(vertex_source.len());
    let mut writer = Writer::new(hierarchy, options, symmetry, Some(errors), late, streams);
    writer.write(|done| progress(Progress { stage: "coding", done, total }))?;
    let source = writer.sources(&vertex_source);
    let original =
        Original { mesh, source, loose: &loose, degenerate: &degenerate, keep_order: options.keep_order };
    let Writer { levels, entries, mut payloads, late_payload, connectivity_bits, position_bits, .. } = writer;
    let (supplements, completing) = listed(late_payload, supplement::write(&levels, &precision, original)?);
    payloads.extend(completing);
    let outline = Outline {
        order_kept: options.keep_order,
        effort: options.effort,
        streams,
        precision,
        vertices: mesh.positions.len() as u32,
        faces: mesh.faces.len() as u32,
        approximation: None,
        levels: entries,
        supplements,
    };
    let bytes = container::write(&outline, &payloads)?;
    let info = Info::of(&bytes)?;
    Ok(Encoded { bytes, info, connectivity_bits, position_bits })
}

/// Streams for a mesh of so many vertices: two from 100 000 on, twice as many for each four times the
/// vertices. Threads gain time by them, and each costs bits.
fn streams(vertices: usize) -> u32 {
    let fours = (vertices / FEWEST_FOR_STREAMS).checked_ilog2().map(|twos| twos / 2);
    fours.map_or(1, |fours| (2 << fours).min(MOST_STREAMS))
}

/// Meshes of fewer vertices have one stream.
const FEWEST_FOR_STREAMS: usize = 100_000;

/// The sections that there are, in the order of the file.
fn listed(positions: Option<Vec<u8>>, sections: Supplements) -> (Vec<Supplement>, Vec<Vec<u8>>) {
    let all = [
        (Supplement::Positions, positions),
        (Supplement::Exactness, sections.exactness),
        (Supplement::Merges, sections.merges),
        (Supplement::Leftovers, sections.leftovers),
        (Supplement::Order, sections.order),
    ];
    all.into_iter().filter_map(|(kind, bytes)| Some((kind, bytes?))).unzip()
}

/// Codes a hierarchy from the base up.
struct Writer {
    /// What is not coded yet: a step and its level's positions go as their turn comes, or the
    /// hierarchy would stay in memory beside the surfaces that are built from it.
    hierarchy: Hierarchy,
    rule: Update,
    groups: bool,
    symmetry: Option<Symmetry>,
    /// Geometric errors of the levels; none are stated without.
    errors: Option<LevelErrors>,
    /// So many of the finest levels get their positions after all levels.
    late: usize,
    levels: Levels,
    /// For each face of the decoder's surface, the corner of the hierarchy's that is its corner 0.
    map: Vec<u32>,
    /// For each vertex of the decoder's finest surface, its vertex on the hierarchy's, once that is all that has
    /// still to be known of it.
    image: Vec<u32>,
    entries: Vec<LevelEntry>,
    payloads: Vec<Vec<u8>>,
    /// The positions of late levels.
    late_payload: Option<Vec<u8>>,
    connectivity_bits: u64,
    position_bits: u64,
}

impl Writer {
    /// The finest `late` levels must be adaptive.
    fn new(
        mut hierarchy: Hierarchy,
        options: &EncodeOptions,
        symmetry: Option<Symmetry>,
        errors: Option<LevelErrors>,
        late: usize,
        streams: u32,
    ) -> Self {
        // The finest level's tell where all late vertices lie.
        hierarchy.positions.drain(late.min(1)..late);
        Writer {
            hierarchy,
            rule: options.update,
            groups: options.groups,
            symmetry,
            errors,
            late,
            levels: Levels::new(options.effort, streams),
            map: Vec::new(),
            image: Vec::new(),
            entries: Vec::new(),
            payloads: Vec::new(),
            late_payload: None,
            connectivity_bits: 0,
            position_bits: 0,
        }
    }

    /// Codes everything; `reached` is told the vertices of each level before it is coded.
    fn write(&mut self, mut reached: impl FnMut(u64)) -> Result<()> {
        self.base()?;
        while let Some(step) = self.hierarchy.steps.pop() {
            reached(self.real_vertices());
            self.level(step)?;
        }
        if self.image.is_empty() {
            let image = images(&self.levels.surface, &self.map, self.hierarchy.surface(0));
            self.forget_connectivity(image);
        }
        self.late_positions();
        Ok(())
    }

    fn real_vertices(&self) -> u64 {
        (self.levels.surface.vertices - self.levels.surface.virtuals) as u64
    }

    fn base(&mut self) -> Result<()> {
        let positions = self.hierarchy.positions.pop().unwrap_or_default();
        let known = self.hierarchy.surface(self.hierarchy.steps.len());
        let mut coder = Encoder::new();
        self.map = self.levels.base(&mut coder, Some(known), &Limits { max_memory: u64::MAX })?;
        self.connectivity_bits += coder.bits();
        let positions = at(&positions, &images(&self.levels.surface, &self.map, known));
        self.levels.begin_base(&mut coder, &positions, self.symmetry);
        let reach = coder.reach();
        let streams = self.positions(coder, &positions[self.levels.surface.virtuals as usize..]);
        self.finish(Payload::Streams(streams, reach), LevelKind::Base, &[]);
        Ok(())
    }

    /// Codes the last step of the hierarchy, which has been taken off it.
    fn level(&mut self, mut step: Reduction) -> Result<()> {
        let level = self.hierarchy.steps.len();
        let is_late = level < self.late;
        let positions = match is_late {
            true => Vec::new(),
            false => self.hierarchy.positions.pop().unwrap_or_default(),
        };
        let fine = self.hierarchy.surface(level);
        let mut coder = Encoder::new();
        let (split, flip) = self.decisions(&step);
        let is_plain = step.kind == StepKind::Adaptive && !is_late && level > 0;
        let inserted = is_plain.then(|| self.inserted(&step, fine));
        if step.kind != StepKind::Sqrt3Odd {
            // Only that kind asks for the coarse surface again; here is where memory is highest.
            step.coarse = Surface::default();
        }
        let vertices = (fine.vertices - fine.virtuals) as u64;
        let coded = self.levels.connectivity(&mut coder, step.kind, split, flip, vertices)?;
        let reach = coder.reach();
        self.connectivity_bits += coder.bits();
        self.map = lift(&coded.refined, &step, fine, &self.map);
        let kind = step.kind;
        drop(step);
        let mut nearest = Vec::new();
        let payload = if is_late {
            if let Some(errors) = &self.errors {
                nearest = errors.nearest_on_decoders(level, &self.map);
            }
            if level == 0 {
                let image = images(&coded.refined.surface, &self.map, fine);
                self.forget_connectivity(image);
            }
            self.levels.late_step(coded);
            Payload::Streams(vec![coder.finish()], reach)
        } else {
            let new = match inserted {
                Some(inserted) => at(&positions, &inserted),
                None => {
                    let image = images(&coded.refined.surface, &self.map, fine);
                    let new = at(&positions, &image[self.levels.surface.vertices as usize..]);
                    if level == 0 {
                        self.forget_connectivity(image);
                    }
                    new
                }
            };
            drop(positions);
            let grouping = match self.groups && kind != StepKind::Adaptive {
                true => Grouping::Open,
                false => Grouping::Whole,
            };
            self.levels.begin_step(coded, self.rule, grouping)?;
            match self.levels.encode_groups(&new, container::MOST_IN_GROUP) {
                Some(groups) => Payload::Groups(groups),
                None => Payload::Streams(self.positions(coder, &new), reach),
            }
        };
        let kind = match kind {
            StepKind::Adaptive if is_late => LevelKind::Late,
            StepKind::Adaptive => LevelKind::Adaptive,
            StepKind::Sqrt3Even => LevelKind::Sqrt3Even,
            StepKind::Sqrt3Odd => LevelKind::Sqrt3Odd,
            StepKind::Butterfly => LevelKind::Butterfly,
        };
        self.finish(payload, kind, &nearest);
        Ok(())
    }

    /// Codes the positions of late levels, if there are any.
    fn late_positions(&mut self) {
        let Some(first) = self.levels.first_late() else { return };
        let positions = self.hierarchy.positions.pop().unwrap_or_default();
        let known = at(&positions, &self.image[first as usize..]);
        drop(positions);
        self.levels.begin_late();
        self.late_payload = Some(payload::assemble(self.positions(Encoder::new(), &known), 0));
    }

    /// Codes the positions of the pass that has begun, of its first region by `coder`, which may have coded
    /// connectivity before. Returns the streams of its regions.
    fn positions(&mut self, coder: Encoder, targets: &[Point]) -> Vec<Vec<u8>> {
        let before = coder.bits();
        let mut coders = vec![coder];
        coders.resize_with(self.levels.regions(), Encoder::new);
        self.levels.positions(&mut coders, targets);
        self.position_bits += coders.iter().map(Encoder::bits).sum::<u64>() - before;
        coders.into_iter().map(Encoder::finish).collect()
    }

    /// The split and flip bits of a step in the decoder's order.
    fn decisions(&self, step: &Reduction) -> (Vec<bool>, Vec<bool>) {
        if step.kind != StepKind::Adaptive {
            return (Vec::new(), Vec::new());
        }
        let split = self.map.iter().map(|&c| step.split[(c / 3) as usize]).collect();
        let corners = self.map.iter().flat_map(|&c| [c, next(c), prev(c)]);
        (split, corners.map(|c| step.flip[c as usize]).collect())
    }

    /// The vertices of `fine` that an adaptive step removed, in the decoder's order.
    fn inserted(&self, step: &Reduction, fine: &Surface) -> Vec<u32> {
        let faces = self.map.iter().map(|&c| (c / 3) as usize);
        faces.filter(|&f| step.split[f]).map(|f| fine.at(step.anchor[f])).collect()
    }

    /// Lets the finest surface go when all that it has still to tell is the `image` of its vertices: beside the
    /// decoder's it would be a fifth of all memory.
    fn forget_connectivity(&mut self, image: Vec<u32>) {
        self.image = image;
        self.map = Vec::new();
        self.hierarchy.take_finest();
    }

    /// For each real vertex of the finest level, the mesh vertex that `vertex_source` names.
    fn sources(&self, vertex_source: &[u32]) -> Vec<u32> {
        let virtuals = self.levels.surface.virtuals as usize;
        self.image[virtuals..].iter().map(|&v| vertex_source[v as usize - virtuals]).collect()
    }

    /// Lists a level that is coded. Of a late one, `nearest` are the faces that the samples of its error are nearest to.
    fn finish(&mut self, payload: Payload, kind: LevelKind, nearest: &[u32]) {
        let surface = &self.levels.surface;
        let error = self.errors.as_ref().map_or(0.0, |errors| match kind {
            LevelKind::Late => errors.estimated(nearest, surface, &self.levels.field.positions),
            _ => errors.of(self.hierarchy.steps.len()),
        });
        let lifted = kind.is_regular();
        self.entries.push(LevelEntry {
            kind,
            grouped: matches!(payload, Payload::Groups(_)),
            update: match self.rule {
                Update::Third if lifted => UpdateRule::Third,
                Update::Paper if lifted => UpdateRule::Paper,
                _ => UpdateRule::None,
            },
            vertices: surface.vertices - surface.virtuals,
            faces: surface.real_faces(),
            error: container::round_error_up(error),
        });
        self.payloads.push(match payload {
            Payload::Streams(streams, reach) => payload::assemble(streams, reach),
            Payload::Groups(groups) => {
                self.position_bits += groups.iter().map(|group| 8 * group.1.len() as u64).sum::<u64>();
                container::join_groups(&groups)
            }
        });
    }
}

/// What a level's payload is made of.
enum Payload {
    /// Streams, and the bytes of the first one that its connectivity takes.
    Streams(Vec<Vec<u8>>, usize),
    /// Groups: the vertices and bytes of each.
    Groups(Vec<(u16, Vec<u8>)>),
}

/// For each vertex of the decoder's `surface` the vertex of `known` that it is, by the correspondence of faces.
fn images(surface: &Surface, map: &[u32], known: &Surface) -> Vec<u32> {
    let mut images = vec![0; surface.vertices as usize];
    for (corners, &corner) in surface.vertex.chunks_exact(3).zip(map) {
        for (&v, c) in corners.iter().zip([corner, next(corner), prev(corner)]) {
            images[v as usize] = known.at(c);
        }
    }
    images
}

/// The positions of some vertices.
fn at(positions: &[Point], vertices: &[u32]) -> Vec<Point> {
    vertices.iter().map(|&v| positions[v as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_grow_with_the_square_root_of_the_mesh() {
        let expected = [(0, 1), (99_999, 1), (100_000, 2), (399_999, 2), (400_000, 4), (10_000_000, 16)];
        for (vertices, count) in expected {
            assert_eq!(streams(vertices), count, "{vertices} vertices");
        }
        assert_eq!(streams(usize::MAX), MOST_STREAMS);
    }
}
