//! A `.tct` file as its fields, so that a test can change one and keep every checksum right.

/// The fields of a file; see the format document.
#[derive(Clone)]
pub struct File {
    /// Magic and version.
    pub magic: Vec<u8>,
    /// Flags, streams and precision.
    pub start: Vec<u8>,
    pub vertices: u32,
    pub faces: u32,
    /// The mark of a lossy file; empty without.
    pub mark: Vec<u8>,
    pub sections: Vec<Section>,
}

#[derive(Clone)]
pub struct Section {
    pub kind: u8,
    pub level: Option<LevelFields>,
    pub payload: Vec<u8>,
}

#[derive(Clone)]
pub struct LevelFields {
    pub kind: u8,
    pub vertices: u32,
    pub faces: u32,
    pub error: [u8; 2],
}

/// The flag of a lossy file.
pub const LOSSY: u8 = 2;
/// The flag of a file with levels in groups.
pub const GROUPED: u8 = 16;

impl File {
    pub fn parse(bytes: &[u8]) -> File {
        let mut at = Cursor { bytes, at: 5 };
        let header = at.varint() as usize;
        let first = at.at;
        let mut body = first + header + 4;
        at.skip(1);
        at.varint();
        match at.byte() {
            0 => at.skip(1 + 12 + 8),
            1 => {
                at.skip(2);
                at.skip_varints(3);
            }
            _ => at.skip_varints(4),
        }
        let start = bytes[first..at.at].to_vec();
        let (vertices, faces) = (at.varint() as u32, at.varint() as u32);
        let mark = at.at;
        if start[0] & LOSSY != 0 {
            at.skip_varints(2);
            at.skip(8 + 2 + 2);
        }
        let mark = bytes[mark..at.at].to_vec();
        let sections = (0..at.varint())
            .map(|_| {
                let kind = at.byte();
                let length = at.varint() as usize;
                at.skip(4);
                let payload = bytes[body..body + length].to_vec();
                body += length;
                let level = (kind == 1).then(|| LevelFields {
                    kind: at.byte(),
                    vertices: at.varint() as u32,
                    faces: at.varint() as u32,
                    error: [at.byte(), at.byte()],
                });
                Section { kind, level, payload }
            })
            .collect();
        assert_eq!(at.at, first + header);
        assert_eq!(body, bytes.len());
        File { magic: bytes[..5].to_vec(), start, vertices, faces, mark, sections }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut header = self.start.clone();
        varint(&mut header, self.vertices);
        varint(&mut header, self.faces);
        header.extend(&self.mark);
        varint(&mut header, self.sections.len() as u32);
        for section in &self.sections {
            header.push(section.kind);
            varint(&mut header, section.payload.len() as u32);
            header.extend(crc32fast::hash(&section.payload).to_le_bytes());
            if let Some(level) = &section.level {
                header.push(level.kind);
                varint(&mut header, level.vertices);
                varint(&mut header, level.faces);
                header.extend(level.error);
            }
        }
        let mut out = self.magic.clone();
        varint(&mut out, header.len() as u32);
        out.extend(header);
        out.extend(crc32fast::hash(&out).to_le_bytes());
        self.sections.iter().for_each(|s| out.extend(&s.payload));
        out
    }

    /// The fields of level `k`.
    pub fn level(&mut self, k: usize) -> &mut LevelFields {
        self.sections[k].level.as_mut().unwrap()
    }

    /// The number of levels.
    pub fn levels(&self) -> usize {
        self.sections.iter().filter(|s| s.level.is_some()).count()
    }
}

fn varint(out: &mut Vec<u8>, mut value: u32) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Cursor<'_> {
    fn byte(&mut self) -> u8 {
        self.at += 1;
        self.bytes[self.at - 1]
    }

    fn skip(&mut self, count: usize) {
        self.at += count;
    }

    fn skip_varints(&mut self, count: usize) {
        for _ in 0..count {
            self.varint();
        }
    }

    fn varint(&mut self) -> u64 {
        let (mut value, mut shift) = (0, 0);
        loop {
            let byte = self.byte();
            value |= u64::from(byte & 0x7F) << shift;
            shift += 7;
            if byte < 0x80 {
                return value;
            }
        }
    }
}
