//! What a person sees: lines, warnings, errors and progress.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Work that ends sooner shows no progress.
const PATIENCE: Duration = Duration::from_millis(500);

/// Where the program's words go.
#[derive(Clone, Copy)]
pub struct Console {
    quiet: bool,
}

impl Console {
    pub fn new(quiet: bool) -> Self {
        Console { quiet }
    }

    /// Whether nothing but errors and what was asked for is to be printed.
    #[cfg(feature = "serve")]
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints lines that were asked for to standard output.
    pub fn answer(&self, lines: &str) -> io::Result<()> {
        let mut out = io::stdout().lock();
        writeln!(out, "{lines}")?;
        out.flush()
    }

    /// Prints lines that report on the work, unless quiet: to standard output, or to standard
    /// error if `data` goes to standard output.
    pub fn report(&self, lines: &str, data: &Path) -> io::Result<()> {
        if self.quiet {
            return Ok(());
        }
        self.answer_beside(lines, data)
    }

    /// Prints lines that were asked for: to standard output, or to standard error if `data` goes to
    /// standard output.
    pub fn answer_beside(&self, lines: &str, data: &Path) -> io::Result<()> {
        if crate::files::is_standard(data) {
            writeln!(io::stderr().lock(), "{lines}")
        } else {
            self.answer(lines)
        }
    }

    /// Prints a warning about a file, unless quiet.
    pub fn warn(&self, file: &str, what: &str) {
        if !self.quiet {
            // Nowhere is left to report that a report fails.
            let _ = writeln!(io::stderr().lock(), "warning: {file}: {what}");
        }
    }

    /// Prints an error with its causes on one line.
    pub fn error(&self, error: &anyhow::Error) {
        let line = format!("error: {error:#}").replace('\n', " ");
        let _ = writeln!(io::stderr().lock(), "{line}");
    }

    /// A bar of bytes; invisible where nobody watches.
    #[cfg(feature = "fetch")]
    pub fn bar(&self) -> ProgressBar {
        if self.quiet || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{bar:40} {bytes} of {total_bytes}, {bytes_per_sec}");
        ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
    }

    /// A progress bar; it stays invisible for short work and where nobody watches.
    pub fn meter(&self) -> Meter {
        let watched = !self.quiet && io::stderr().is_terminal();
        Meter { start: watched.then(Instant::now), bar: None }
    }
}

/// A progress bar that appears when work turns out to be long.
pub struct Meter {
    /// When work began; `None` if nobody watches.
    start: Option<Instant>,
    bar: Option<ProgressBar>,
}

impl Meter {
    /// Shows that `done` of `total` parts of a stage are done.
    pub fn show(&mut self, stage: &'static str, done: u64, total: u64) {
        if self.start.is_none_or(|start| start.elapsed() < PATIENCE) {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{msg:10} {bar:40} {percent:>3} %");
            ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        bar.set_message(stage);
        bar.set_length(total);
        bar.set_position(done);
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
