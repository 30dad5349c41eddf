//! The dependency policy of `deny.toml`: by cargo-deny where it is installed, otherwise its two
//! rules that need no network, licences and sources, from `cargo metadata`.

use super::{Outcome, Setting};
use crate::process::{available, capture, command, root, run};
use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Each workspace of the repository.
const MANIFESTS: [&str; 2] = ["Cargo.toml", "fuzz/Cargo.toml"];
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

pub fn check(_: &Setting) -> Result<Outcome> {
    if available("cargo-deny") {
        for manifest in MANIFESTS {
            let words = ["deny", "--manifest-path", manifest, "check", "--config", "deny.toml"];
            // Not the advisories: their database would have to be fetched, and grows without our doing.
            run(command("cargo", &[&words[..], &["bans", "licenses", "sources"]].concat()))?;
        }
        return Ok(Outcome::Passed("cargo-deny".into()));
    }
    let policy = std::fs::read_to_string(root().join("deny.toml")).context("reading deny.toml")?;
    let allowed = allowed_licences(&policy);
    let mut packages = 0;
    for manifest in MANIFESTS {
        let words = ["metadata", "--format-version", "1", "--manifest-path", manifest];
        let metadata: Value = serde_json::from_str(&capture(command("cargo", &words))?)?;
        for package in metadata["packages"].as_array().context("cargo metadata names no packages")? {
            check_package(package, &allowed)?;
            packages += 1;
        }
    }
    Ok(Outcome::Passed(format!("licences and sources of {packages} packages; cargo-deny is not installed")))
}

fn check_package(package: &Value, allowed: &[&str]) -> Result<()> {
    let name = package["name"].as_str().unwrap_or("?");
    if let Some(source) = package["source"].as_str()
        && source != REGISTRY
    {
        bail!("{name} comes from {source}, not from crates.io");
    }
    let licence = package["license"].as_str().with_context(|| format!("{name} states no licence"))?;
    if !permits(licence, allowed) {
        bail!("the licence of {name}, {licence}, is not among those of deny.toml");
    }
    Ok(())
}

/// The strings of `allow = [...]` in the section `[licenses]`.
fn allowed_licences(policy: &str) -> Vec<&str> {
    let section = policy.split_once("[licenses]").map_or("", |(_, rest)| rest);
    let list = section.split_once("allow = [").and_then(|(_, rest)| rest.split_once(']'));
    list.map_or("", |(list, _)| list).split('"').skip(1).step_by(2).collect()
}

/// Whether an SPDX expression can be met with the allowed licences alone.
/// `/` is an old way to write OR; AND binds more tightly than OR.
fn permits(expression: &str, allowed: &[&str]) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let mut words = spaced.split_whitespace().peekable();
    let met = any_of(&mut words, allowed);
    met && words.peek().is_none()
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any_of(words: &mut Words, allowed: &[&str]) -> bool {
    let mut met = all_of(words, allowed);
    while words.next_if_eq(&"OR").is_some() {
        met |= all_of(words, allowed);
    }
    met
}

fn all_of(words: &mut Words, allowed: &[&str]) -> bool {
    let mut met = one(words, allowed);
    while words.next_if_eq(&"AND").is_some() {
        met &= one(words, allowed);
    }
    met
}

fn one(words: &mut Words, allowed: &[&str]) -> bool {
    if words.next_if_eq(&"(").is_some() {
        let met = any_of(words, allowed);
        return words.next_if_eq(&")").is_some() && met;
    }
    let Some(licence) = words.next() else { return false };
    // An exception only adds permissions to the licence it qualifies.
    if words.next_if_eq(&"WITH").is_some() {
        words.next();
    }
    allowed.contains(&licence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expression_is_permitted_if_some_choice_is_allowed_throughout() {
        let allowed = ["MIT", "Zlib"];
        for good in
            ["MIT", "MIT/Apache-2.0", "GPL-3.0 OR MIT", "(MIT OR GPL-3.0) AND Zlib", "GPL-2.0 AND X OR MIT"]
        {
            assert!(permits(good, &allowed), "{good}");
        }
        for bad in ["", "GPL-3.0", "MIT AND GPL-3.0", "MIT AND (GPL-3.0 OR X)", "(MIT", "MIT Zlib"] {
            assert!(!permits(bad, &allowed), "{bad}");
        }
    }

    #[test]
    fn the_allow_list_is_read_from_its_own_section() {
        let policy = "[bans]\nallow = [\"x\"]\n[licenses]\nallow = [\n    \"MIT\",\n    \"Zlib\", # why\n]\n";
        assert_eq!(allowed_licences(policy), ["MIT", "Zlib"]);
    }
}
