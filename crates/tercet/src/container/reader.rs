//! Taking a file apart as its bytes arrive.

use std::collections::VecDeque;

use super::checksum::checksum;
use super::fields::Fields;
use super::piece::Arrival;
use super::section::{Part, Section, Supplement};
use super::{CRC_BYTES, Header, MAGIC, MAX_HEADER, VERSION, varint};
use crate::{Error, Limits, Result};

/// The section to be read, as far as it is verified; of one in groups, which have checks of their own, as far as it
/// is there, but for its last byte until its checksum has matched.
pub(crate) struct Incoming<'a> {
    pub(crate) part: Part,
    /// These bytes of its payload.
    pub(crate) bytes: &'a [u8],
    /// Bytes of the whole payload.
    pub(crate) length: u32,
}

impl Incoming<'_> {
    /// Whether all of it is there.
    pub(crate) fn is_whole(&self) -> bool {
        self.bytes.len() == self.length as usize
    }
}

/// Reads a file from bytes in portions of any size.
///
/// The sections come in the order of the file, and of each only what a checksum has verified; of a level in groups,
/// which have checks of their own, all that is there. What comes out depends on the bytes alone, not on their portions: the verified pieces before a fault,
/// and then the fault, again and again.
///
/// Holds the header (64 KiB at most), the section in flight, and the sections that have
/// arrived but not been taken; the memory for a section grows with the bytes that arrive,
/// never beyond its declared length, which [`Limits`] bound.
pub(crate) struct Reader {
    limits: Limits,
    /// The file from its magic to the header's checksum; empty once it is parsed.
    preamble: Vec<u8>,
    header: Option<Header>,
    /// Index of the section in flight.
    index: usize,
    flight: Arrival,
    ready: VecDeque<(Part, Vec<u8>)>,
    failure: Option<Error>,
}

impl Reader {
    /// A reader that waits for the first byte of a file.
    pub(crate) fn new(limits: Limits) -> Self {
        Reader {
            limits,
            preamble: Vec::new(),
            header: None,
            index: 0,
            flight: Arrival::default(),
            ready: VecDeque::new(),
            failure: None,
        }
    }

    /// Takes the next bytes of the file. A fault in them is kept for
    /// [`check`](Reader::check), behind the sections before it;
    /// bytes after a fault are ignored. Takes time linear in `bytes`.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        if self.failure.is_none() {
            self.failure = self.accept(bytes).err();
        }
    }

    /// The header, once it has arrived and been verified.
    pub(crate) fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// How much decoding may ask for.
    pub(crate) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Ends the file at a section whose bytes arrived unharmed but do not mean anything: from now
    /// on `failure` is what it has to tell. Returns the same error.
    pub(crate) fn refuse(&mut self, failure: Error) -> Error {
        self.ready.clear();
        self.flight = Arrival::default();
        let same = repeated(&failure);
        self.failure = Some(failure);
        same
    }

    /// Takes back a checksum's failure: the next byte to push is the first of the piece that did not
    /// match, whose place in the file is returned. `None` if that is not what failed.
    pub(crate) fn discard_damaged(&mut self) -> Option<u64> {
        self.failure.take_if(|failure| matches!(failure, Error::Checksum { .. }))?;
        self.flight.retreat();
        // Nothing is held of a damaged header: parsing it has taken its bytes.
        let section = self.header.as_ref().and_then(|header| header.sections.get(self.index));
        Some(section.map_or(0, |section| section.offset + u64::from(self.flight.received())))
    }

    /// The section to be read, as far as it is verified or has checks of its own, or `None` if nothing is there of it,
    /// it is [refused](Reader::refuse), or there are no more sections. A fault takes nothing of what came before it away. Optional sections are verified and passed over.
    pub(crate) fn incoming(&self) -> Option<Incoming<'_>> {
        if let Some((part, payload)) = self.ready.front() {
            return Some(Incoming { part: *part, bytes: payload, length: payload.len() as u32 });
        }
        let section = self.header.as_ref()?.sections.get(self.index)?;
        let bytes = match section.pieces {
            true => self.flight.verified(),
            // All of it would count as verified, which is taken from those that are ready.
            false => {
                let payload = self.flight.payload();
                &payload[..payload.len().min((section.payload as usize).saturating_sub(1))]
            }
        };
        (!bytes.is_empty()).then_some(Incoming { part: section.part, bytes, length: section.payload })
    }

    /// Where in the file the section begins that is there in part or not at all, if none is there as a whole.
    pub(crate) fn place(&self) -> Option<u64> {
        let section = self.header.as_ref()?.sections.get(self.index)?;
        self.ready.is_empty().then_some(section.offset)
    }

    /// Takes the first section that is there as a whole.
    pub(crate) fn take(&mut self) -> Option<(Part, Vec<u8>)> {
        self.ready.pop_front()
    }

    /// Fails if no section is there as a whole and none can come.
    ///
    /// # Errors
    /// The first fault in the file, once the sections before it are taken.
    pub(crate) fn check(&self) -> Result<()> {
        match &self.failure {
            Some(failure) if self.ready.is_empty() => Err(repeated(failure)),
            _ => Ok(()),
        }
    }

    /// Whether the bytes so far are a whole file.
    ///
    /// # Errors
    /// The first fault in the file, or [`Error::Truncated`] naming the section that is
    /// cut short, with its bytes present and needed.
    pub(crate) fn finish(&self) -> Result<()> {
        if let Some(failure) = &self.failure {
            return Err(repeated(failure));
        }
        let Some(header) = &self.header else {
            return Err(Error::Truncated {
                place: "header".into(),
                have: self.preamble.len() as u64,
                need: preamble_length(&self.preamble)? as u64,
            });
        };
        match header.sections.get(self.index) {
            None => Ok(()),
            Some(section) => Err(Error::Truncated {
                place: section.part.to_string(),
                have: self.flight.received().into(),
                need: section.length.into(),
            }),
        }
    }

    /// Bytes reserved for the section in flight.
    #[cfg(test)]
    pub(super) fn memory(&self) -> usize {
        self.flight.memory()
    }

    fn accept(&mut self, bytes: &[u8]) -> Result<()> {
        let mut rest = bytes;
        if self.header.is_none() {
            rest = self.accept_preamble(rest)?;
        }
        let Some(header) = &self.header else { return Ok(()) };
        // Not "while bytes are left": an empty section is complete without any.
        while let Some(section) = header.sections.get(self.index) {
            let keeps = !is_optional(section);
            rest = self.flight.take(section.length, section.crc, [keeps, section.pieces], rest).map_err(
                |[stored, computed]| Error::Checksum { place: section.part.to_string(), stored, computed },
            )?;
            if self.flight.received() < section.length {
                return Ok(());
            }
            let payload = std::mem::take(&mut self.flight).into_payload();
            self.ready.extend(keeps.then_some((section.part, payload)));
            self.index += 1;
        }
        match rest {
            [] => Ok(()),
            _ => Err(Error::format("end of file", "bytes follow the last section")),
        }
    }

    /// Takes bytes until the header is complete, and parses it. Returns the bytes after it.
    fn accept_preamble<'a>(&mut self, mut bytes: &'a [u8]) -> Result<&'a [u8]> {
        loop {
            let need = preamble_length(&self.preamble)?;
            if self.preamble.len() == need {
                let preamble = std::mem::take(&mut self.preamble);
                self.header = Some(parse_preamble(&preamble, &self.limits)?);
                return Ok(bytes);
            }
            if bytes.is_empty() {
                return Ok(bytes);
            }
            let (taken, rest) = bytes.split_at(bytes.len().min(need - self.preamble.len()));
            self.preamble.extend_from_slice(taken);
            bytes = rest;
        }
    }
}

fn is_optional(section: &Section) -> bool {
    matches!(section.part, Part::Supplement(Supplement::Optional(_)))
}

/// Bytes from the file's start through the header's checksum, as far as `bytes`, the start
/// of a file, tell: exactly `bytes.len()` if they are complete, otherwise more.
fn preamble_length(bytes: &[u8]) -> Result<usize> {
    let known = bytes.len().min(MAGIC.len());
    if bytes[..known] != MAGIC[..known] {
        return Err(Error::format("magic", "this is not a .tct file"));
    }
    let Some((&version, rest)) = bytes[known..].split_first() else {
        return Ok(MAGIC.len() + 1);
    };
    if version != VERSION {
        return Err(Error::Unsupported(format!(
            "format version {version}: this version of tercet reads version {VERSION} only"
        )));
    }
    let found = varint::read(rest, 32).map_err(|cause| Error::format("header length", cause))?;
    let Some((header, field)) = found else { return Ok(bytes.len() + 1) };
    if header > MAX_HEADER {
        return Err(Error::format(
            "header length",
            format!("{header} bytes, at most {MAX_HEADER} are allowed"),
        ));
    }
    Ok(MAGIC.len() + 1 + field + header as usize + CRC_BYTES)
}

/// Verifies and parses a file from its magic through the header's checksum, which
/// [`preamble_length`] has found to be complete.
fn parse_preamble(bytes: &[u8], limits: &Limits) -> Result<Header> {
    let (covered, stored) = bytes.split_at(bytes.len() - CRC_BYTES);
    let stored = u32::from_le_bytes(Fields::new(stored).array("checksum")?);
    let computed = checksum(covered);
    if stored != computed {
        return Err(Error::Checksum { place: "header".into(), stored, computed });
    }
    let mut fields = Fields::new(covered);
    fields.array::<{ MAGIC.len() + 1 }>("magic and version")?;
    fields.u32("header length")?;
    Header::read(fields, bytes.len() as u64, limits)
}

/// The same error once more: errors hold an `std::io::Error` in one variant and cannot be cloned.
fn repeated(error: &Error) -> Error {
    match error {
        // Nothing is read here but memory: only for the sake of completeness.
        Error::Io(cause) => Error::Io(cause.kind().into()),
        Error::Syntax { place, cause } => Error::syntax(place, cause),
        Error::Mesh { place, cause } => Error::mesh(place, cause),
        Error::Format { place, cause } => Error::format(place, cause),
        Error::Checksum { place, stored, computed } => {
            Error::Checksum { place: place.clone(), stored: *stored, computed: *computed }
        }
        Error::Truncated { place, have, need } => {
            Error::Truncated { place: place.clone(), have: *have, need: *need }
        }
        Error::Unsupported(cause) => Error::Unsupported(cause.clone()),
        Error::Limit { what, needed, allowed } => Error::Limit { what, needed: *needed, allowed: *allowed },
        Error::Parameter(cause) => Error::Parameter(cause.clone()),
    }
}
