//! Our files against those of several other coders, and against chains of simplified meshes, on one lattice.

use super::spread::Spread;
use super::{Scratch, Subject, TIMED_VERTICES, draco, meshopt, openctm, ours};
use anyhow::{Context, Result};
use std::fs;
use std::path::PathBuf;

/// The lattice of all, as bits of its longest side.
pub const BITS: u8 = 12;
/// Each mesh of a chain has so many times fewer faces than the one before.
pub const LOD_RATIO: u64 = 3;
/// No mesh of a chain has fewer vertices than about this.
pub const LOD_VERTICES: u64 = 200;

/// What our files are compared with, in the order of the table's columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    Draco7,
    Draco10,
    /// meshoptimizer's glTF packer, then `zstd -19`.
    Gltfpack,
    OpenCtm,
    /// Draco 10 on the mesh and on simplifications of it: like ours, a file with levels.
    Chain,
}

pub const PEERS: [Peer; 5] = [Peer::Draco7, Peer::Draco10, Peer::Gltfpack, Peer::OpenCtm, Peer::Chain];

/// A mesh as one coder has it.
struct Coded {
    bytes: u64,
    /// Seconds to encode and to decode, where the coder tells them without reading other formats.
    seconds: Option<[f64; 2]>,
}

/// One mesh, against every peer.
pub struct PeersRow {
    pub mesh: String,
    pub vertices: u64,
    pub bytes: u64,
    /// In the order of [`PEERS`].
    pub against: Vec<Against>,
}

/// Our file against a peer's.
pub struct Against {
    pub bytes: u64,
    /// Our rates over its, encoding and decoding, of each pair of runs; none of small meshes.
    pub rates: Vec<[f64; 2]>,
}

/// Runs the peers' programs.
struct Runner<'a> {
    meshopt: meshopt::Program,
    ours: &'a ours::Program,
    scratch: &'a Scratch,
}

/// All peers on every subject.
pub fn rows(
    subjects: &[Subject],
    runs: usize,
    ours: &ours::Program,
    scratch: &Scratch,
) -> Result<Vec<PeersRow>> {
    openctm::set_up()?;
    let runner = Runner { meshopt: meshopt::Program::set_up()?, ours, scratch };
    let rows = subjects.iter().map(|subject| {
        let row = runner.row(subject, runs).with_context(|| format!("peers on {}", subject.name))?;
        let sizes: Vec<f64> = row.against.iter().map(|it| row.bytes as f64 / it.bytes as f64).collect();
        println!("{}: {sizes:.3?} of the peers' sizes", row.mesh);
        Ok(row)
    });
    rows.collect()
}

impl Runner<'_> {
    fn row(&self, subject: &Subject, runs: usize) -> Result<PeersRow> {
        let timed = subject.vertices > TIMED_VERTICES;
        let mut against: Vec<Against> =
            PEERS.iter().map(|_| Against { bytes: 0, rates: Vec::new() }).collect();
        let chain = self.chain(subject)?;
        let mut bytes = 0;
        for _ in 0..if timed { runs } else { 1 } {
            for (peer, against) in PEERS.into_iter().zip(&mut against) {
                // Each run of a peer has one of ours beside it.
                let ours = self.ours(subject)?;
                let coded = self.coded(peer, subject, &chain)?;
                bytes = ours.bytes;
                against.bytes = coded.bytes;
                if let (true, Some(our), Some(its)) = (timed, ours.seconds, coded.seconds) {
                    against.rates.push([its[0] / our[0], its[1] / our[1]]);
                }
            }
        }
        Ok(PeersRow { mesh: subject.name.clone(), vertices: subject.vertices, bytes, against })
    }

    fn ours(&self, subject: &Subject) -> Result<Coded> {
        let tct = self.scratch.file("a.tct");
        let encoded = self.ours.encode(&subject.ply, &tct, Some(BITS))?;
        let decoded = self.ours.decode(&tct)?;
        Ok(Coded { bytes: encoded.bytes, seconds: Some([encoded.seconds, decoded.seconds]) })
    }

    fn coded(&self, peer: Peer, subject: &Subject, chain: &[PathBuf]) -> Result<Coded> {
        match peer {
            Peer::Draco7 => self.draco(&subject.ply, 7),
            Peer::Draco10 => self.draco(&subject.ply, 10),
            Peer::Gltfpack => {
                let obj = self.scratch.file("a.obj");
                self.ours.convert(&subject.ply, &obj)?;
                Ok(Coded { bytes: self.meshopt.pack(&obj, BITS, &self.scratch.0)?, seconds: None })
            }
            Peer::OpenCtm => {
                let (ctm, ply) = (self.scratch.file("a.ctm"), self.scratch.file("decoded.ply"));
                let step = subject.side / f64::from((1 << BITS) - 1);
                let encoded = openctm::encode(&subject.ply, &ctm, step)?;
                let decoded = openctm::decode(&ctm, &ply)?;
                Ok(Coded { bytes: fs::metadata(&ctm)?.len(), seconds: Some([encoded, decoded]) })
            }
            Peer::Chain => {
                let mut all = self.draco(&subject.ply, 10)?;
                for mesh in chain {
                    let one = self.draco(mesh, 10)?;
                    all.bytes += one.bytes;
                    if let (Some(sum), Some(one)) = (&mut all.seconds, one.seconds) {
                        sum.iter_mut().zip(one).for_each(|(sum, one)| *sum += one);
                    }
                }
                Ok(all)
            }
        }
    }

    fn draco(&self, mesh: &std::path::Path, level: u8) -> Result<Coded> {
        let (drc, ply) = (self.scratch.file("a.drc"), self.scratch.file("decoded.ply"));
        let encoded = draco::encode(mesh, &drc, Some(BITS), level)?;
        let decoded = draco::decode(&drc, &ply)?;
        Ok(Coded { bytes: encoded.bytes, seconds: Some([encoded.seconds, decoded.seconds]) })
    }

    /// The simplified meshes of a chain, finest first, without the mesh itself.
    fn chain(&self, subject: &Subject) -> Result<Vec<PathBuf>> {
        let coarser = |&divisor: &u64| Some(divisor * LOD_RATIO);
        let divisors = std::iter::successors(Some(LOD_RATIO), coarser);
        let divisors = divisors.take_while(|divisor| subject.vertices / divisor >= LOD_VERTICES);
        let sizes: Vec<u64> = divisors.map(|divisor| subject.faces / divisor).collect();
        let simplified = self.meshopt.simplify(&subject.ply, &sizes, &self.scratch.0)?;
        Ok(simplified.into_iter().map(|(_, [kept, _])| kept).collect())
    }
}

/// How our rate is spread over all pairs of runs with a peer, encoding or decoding.
pub fn rate_spread(rows: &[PeersRow], peer: usize, direction: usize) -> Option<Spread> {
    let rates = rows.iter().flat_map(|row| &row.against[peer].rates);
    Spread::of(rates.map(|rates| rates[direction]).collect())
}

/// How the ratios of our sizes to a peer's are spread over the meshes.
pub fn size_spread(rows: &[PeersRow], peer: usize) -> Option<Spread> {
    let ratio = |row: &PeersRow| row.bytes as f64 / row.against[peer].bytes as f64;
    Spread::of(rows.iter().map(ratio).collect())
}
