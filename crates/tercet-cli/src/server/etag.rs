//! Conditional requests by entity tags (RFC 9110, sections 8.8.3 and 13).

use axum::http::{HeaderMap, header};

/// What the conditions of a request make of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Send what is asked for; the part that `Range` names only if that is still valid.
    Send { part_is_valid: bool },
    /// The client has it: 304.
    NotModified,
    /// The client wants another version: 412.
    Failed,
}

/// Judges the conditions of a request for a file with this strong tag, quotes included.
pub fn judge(headers: &HeaderMap, tag: &str) -> Verdict {
    let lists = |name| headers.get_all(name).iter().filter_map(|value| value.to_str().ok());
    if headers.contains_key(header::IF_MATCH) && !lists(header::IF_MATCH).any(|list| names(list, tag, false))
    {
        return Verdict::Failed;
    }
    if lists(header::IF_NONE_MATCH).any(|list| names(list, tag, true)) {
        return Verdict::NotModified;
    }
    // A date is no tag: no modification date was sent that it could be equal to.
    let part_is_valid = headers.get(header::IF_RANGE).is_none_or(|value| value.as_bytes() == tag.as_bytes());
    Verdict::Send { part_is_valid }
}

/// Whether a list of tags, or `*`, names this strong one. The weak comparison also counts `W/"…"`.
fn names(list: &str, tag: &str, weakly: bool) -> bool {
    list.split(',').map(str::trim).any(|entry| {
        let entry = if weakly { entry.strip_prefix("W/").unwrap_or(entry) } else { entry };
        entry == "*" || entry == tag
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::{HeaderName, HeaderValue};

    fn verdict(fields: &[(HeaderName, &'static str)]) -> Verdict {
        let fields = fields.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value)));
        judge(&fields.collect(), "\"a1\"")
    }

    #[test]
    fn what_the_client_has_is_not_sent_again() {
        for list in ["\"a1\"", "W/\"a1\"", "\"x\", \"a1\"", "*", "W/\"x\" ,W/\"a1\""] {
            assert_eq!(verdict(&[(header::IF_NONE_MATCH, list)]), Verdict::NotModified, "{list}");
        }
        for list in ["\"x\"", "a1", "", "\"a1", "\"A1\""] {
            let sent = Verdict::Send { part_is_valid: true };
            assert_eq!(verdict(&[(header::IF_NONE_MATCH, list)]), sent, "{list}");
        }
    }

    #[test]
    fn if_match_compares_strongly_and_comes_first() {
        for (list, holds) in
            [("\"a1\"", true), ("*", true), ("W/\"a1\"", false), ("\"x\"", false), ("", false)]
        {
            let expected = if holds { Verdict::Send { part_is_valid: true } } else { Verdict::Failed };
            assert_eq!(verdict(&[(header::IF_MATCH, list)]), expected, "{list}");
        }
        let both = [(header::IF_MATCH, "\"x\""), (header::IF_NONE_MATCH, "\"a1\"")];
        assert_eq!(verdict(&both), Verdict::Failed);
    }

    #[test]
    fn a_part_is_valid_only_of_the_same_version() {
        for (value, part_is_valid) in [
            ("\"a1\"", true),
            ("W/\"a1\"", false),
            ("\"x\"", false),
            ("Sun, 22 Nov 2026 10:00:00 GMT", false),
        ] {
            assert_eq!(verdict(&[(header::IF_RANGE, value)]), Verdict::Send { part_is_valid }, "{value}");
        }
    }
}
