//! What a server says when it ends a session.

use anyhow::anyhow;

use super::fault::Fault;

/// What an `ERROR` message means; `None` of another message.
pub fn refusal(text: &str) -> Option<Fault> {
    let words = text.strip_prefix("ERROR ")?;
    let (code, words) = words.split_once(' ').unwrap_or((words, ""));
    let words: String = words.chars().filter(|c| !c.is_control()).take(200).collect();
    let cause = anyhow!("the server refuses: {words}");
    Some(match code {
        "replaced" => Fault::Replaced,
        "busy" | "idle" | "stopping" | "store" => Fault::transient(cause),
        _ => Fault::Fatal(cause),
    })
}
