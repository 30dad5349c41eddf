//! A file's bytes on their way into a decoder.

use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, Result, bail};
use tercet::{Decoder, Info, Level, Limits};

use crate::files;

/// Bytes read at a time: no more of a file is read than is asked for.
const PORTION: usize = 1 << 16;

/// Reads a file as far as levels are asked for.
pub struct Feed {
    name: String,
    input: Box<dyn Read>,
    decoder: Decoder,
    /// What the decoder answered when it was asked for the header.
    pending: Option<tercet::Result<Option<Level>>>,
    /// Bytes read so far.
    pub bytes: u64,
}

impl Feed {
    /// Opens a file, of which at most `bytes` are to be read.
    pub fn open(path: &Path, bytes: Option<u64>, limits: &Limits) -> Result<Self> {
        let input = files::open(path)?.take(bytes.unwrap_or(u64::MAX));
        let decoder = Decoder::new(*limits);
        Ok(Feed { name: files::name(path), input: Box::new(input), decoder, pending: None, bytes: 0 })
    }

    /// Levels shall come with their predictions.
    pub fn keep_predictions(&mut self) {
        self.decoder.keep_predictions(true);
    }

    /// What the file says of itself; reads on until its header has arrived.
    ///
    /// # Errors
    /// What is wrong with the header, also if it is cut short.
    pub fn info(&mut self) -> Result<Info> {
        loop {
            let answer = self.decoder.next_level();
            if let Some(info) = self.decoder.info() {
                self.pending = Some(answer);
                return Ok(info);
            }
            answer.with_context(|| self.name.clone())?;
            if !self.advance()? {
                self.finish()?;
                bail!("{}: no header", self.name);
            }
        }
    }

    /// The next level; `None` where the file ends.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn next_level(&mut self) -> Result<Option<Level>> {
        loop {
            let answer = self.pending.take().unwrap_or_else(|| self.decoder.next_level());
            let level = answer.with_context(|| self.name.clone())?;
            if level.is_some() || !self.advance()? {
                return Ok(level);
            }
        }
    }

    /// The level that the file breaks off in, as far as its bytes tell.
    pub fn preview(&self) -> Option<Level> {
        self.decoder.preview()
    }

    /// Fails if the file ended before it was complete.
    pub fn finish(&self) -> Result<()> {
        self.decoder.finish().with_context(|| self.name.clone())
    }

    /// Reads on; false where the file ends.
    fn advance(&mut self) -> Result<bool> {
        let mut portion = [0; PORTION];
        loop {
            match self.input.read(&mut portion) {
                Ok(n) => {
                    self.decoder.push(&portion[..n]);
                    self.bytes += n as u64;
                    return Ok(n > 0);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error).with_context(|| self.name.clone()),
            }
        }
    }
}
