//! Telling a person, or a program, what has arrived.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use serde_json::{Value, json};
use tercet::{Info, Level};

use crate::console::Console;
use crate::report;

/// Announces levels, each once, and shows how far the bytes have come. Clones announce together.
#[derive(Clone)]
pub struct Announcer {
    console: Console,
    /// The address, which warnings begin with.
    name: Arc<str>,
    /// Where the mesh is written to: lines must not go there.
    output: PathBuf,
    json: bool,
    start: Instant,
    bar: ProgressBar,
    /// The finest level that was announced, and whether it was restored.
    announced: Arc<Mutex<Option<(u32, bool)>>>,
    /// When a preview was announced, if one was.
    previewed: Arc<Mutex<Option<Instant>>>,
}

/// Time between two previews: each takes time linear in its level.
const BETWEEN_PREVIEWS: Duration = Duration::from_millis(100);

impl Announcer {
    pub fn new(console: &Console, name: &str, output: PathBuf, json: bool) -> Self {
        Announcer {
            console: *console,
            name: name.into(),
            output,
            json,
            start: Instant::now(),
            bar: console.bar(),
            announced: Arc::default(),
            previewed: Arc::default(),
        }
    }

    /// Announces a level that is complete, unless it was announced before.
    pub fn level(&self, level: &Level, info: &Info) {
        let reached = Some((level.level, level.restored));
        let mut announced = self.announced.lock().unwrap_or_else(PoisonError::into_inner);
        if *announced >= reached {
            return;
        }
        *announced = reached;
        let bytes = match info.levels.get(level.level as usize) {
            Some(known) if !level.restored => known.bytes,
            _ => info.bytes,
        };
        let error = info.levels.get(level.level as usize).map_or(0.0, |known| known.error);
        let (vertices, faces) = (level.mesh.positions.len(), level.mesh.faces.len());
        let ms = self.start.elapsed().as_millis() as u64;
        if self.json {
            return self.event(json!({
                "event": "level",
                "level": level.level,
                "restored": level.restored,
                "vertices": vertices,
                "faces": faces,
                "bytes": bytes,
                "error": error,
                "ms": ms,
            }));
        }
        let what = if level.restored { "whole".into() } else { format!("level {}", level.level) };
        let error = if level.restored { "0".into() } else { report::error(error) };
        self.line(&format!(
            "{what:<8} {vertices:>9} vertices {faces:>9} faces {bytes:>10} bytes  error {error:<11} {ms:>6} ms"
        ));
    }

    /// Tells a program how much of a level that is arriving can be shown, unless it was told a moment ago.
    pub fn preview(&self, level: impl FnOnce() -> Option<Level>) {
        let mut previewed = self.previewed.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.json || previewed.is_some_and(|last| last.elapsed() < BETWEEN_PREVIEWS) {
            return;
        }
        let Some(level) = level() else { return };
        *previewed = Some(Instant::now());
        self.event(json!({
            "event": "preview",
            "level": level.level,
            "vertices": level.mesh.positions.len(),
            "pending": level.pending,
            "ms": self.start.elapsed().as_millis() as u64,
        }));
    }

    /// What was announced no longer counts: another file begins.
    pub fn forget(&self) {
        *self.announced.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Shows that `done` of `total` bytes are there; 0 of those if that is not known yet.
    pub fn progress(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    pub fn warn(&self, what: &str) {
        self.bar.suspend(|| self.console.warn(&self.name, what));
    }

    /// Says how it ended.
    pub fn done(&self, reached: &str, bytes: u64, complete: bool) {
        self.bar.finish_and_clear();
        let ms = self.start.elapsed().as_millis() as u64;
        let output = self.output.display();
        if self.json {
            let output = output.to_string();
            self.event(
                json!({ "event": "done", "output": output, "bytes": bytes, "complete": complete, "ms": ms }),
            );
        } else {
            self.line(&format!("{output}: {reached}, {bytes} bytes, {ms} ms"));
        }
    }

    /// An object on a line of standard output: it was asked for.
    fn event(&self, event: Value) {
        // Whoever read our lines may have seen enough; the mesh is still wanted.
        self.bar.suspend(|| self.console.answer_beside(&event.to_string(), &self.output)).unwrap_or_default();
    }

    fn line(&self, line: &str) {
        self.bar.suspend(|| self.console.report(line, &self.output)).unwrap_or_default();
    }
}
