//! Reading `--name value` and `--flag` words.

use anyhow::{Context, Result};
use std::fmt;
use std::str::FromStr;

/// The command line is not one that the usage text allows.
#[derive(Debug)]
pub struct Usage;

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("wrong arguments")
    }
}

impl std::error::Error for Usage {}

/// The words after the task's name, taken out one option at a time.
pub struct Arguments {
    words: Vec<String>,
}

impl Arguments {
    pub fn new(words: &[String]) -> Self {
        Arguments { words: words.to_vec() }
    }

    /// Takes out `--name`; true if it was there.
    pub fn flag(&mut self, name: &str) -> bool {
        let before = self.words.len();
        self.words.retain(|word| word != name);
        self.words.len() < before
    }

    /// Takes out `--name VALUE`.
    pub fn value<T: FromStr>(&mut self, name: &str) -> Result<Option<T>> {
        let Some(at) = self.words.iter().position(|word| word == name) else { return Ok(None) };
        let value = self.words.get(at + 1).and_then(|word| word.parse().ok());
        let value = value.context(Usage).with_context(|| format!("{name} needs a value"))?;
        self.words.drain(at..at + 2);
        Ok(Some(value))
    }

    /// Takes out `--name VALUE,VALUE`.
    pub fn list<T: FromStr>(&mut self, name: &str) -> Result<Option<Vec<T>>> {
        let Some(joined) = self.value::<String>(name)? else { return Ok(None) };
        let items = joined.split(',').map(|item| item.parse().ok()).collect::<Option<Vec<T>>>();
        items.context(Usage).with_context(|| format!("{name} cannot be {joined}")).map(Some)
    }

    /// Fails if a word is left that no option took.
    pub fn finish(self) -> Result<()> {
        match self.words.first() {
            Some(word) => Err(Usage).with_context(|| format!("unknown argument {word}")),
            None => Ok(()),
        }
    }
}
