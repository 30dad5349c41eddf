//! What a client asks for.

use std::fmt;
use std::str::FromStr;

/// A command of a client.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// One more level.
    Next,
    /// Everything through this level.
    Level(u32),
    /// Everything through the coarsest level of at most this error.
    Until(f32),
    /// Send nothing.
    Pause,
    /// Send again.
    Resume,
    /// What is asked for and not sent is no longer wanted.
    Cancel,
    /// Go to this byte of the file, which is the one of the digest, if that is given.
    From(u64, Option<String>),
}

/// The text is no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoCommand;

impl fmt::Display for NoCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the commands are NEXT, LEVEL, UNTIL, PAUSE, RESUME, CANCEL and FROM")
    }
}

impl FromStr for Command {
    type Err = NoCommand;

    fn from_str(text: &str) -> Result<Self, NoCommand> {
        let words: Vec<&str> = text.splitn(4, ' ').collect();
        let command = match words[..] {
            ["NEXT"] => Command::Next,
            ["LEVEL", level] => Command::Level(number(level)?),
            ["UNTIL", error] => Command::Until(parse_error(error)?),
            ["PAUSE"] => Command::Pause,
            ["RESUME"] => Command::Resume,
            ["CANCEL"] => Command::Cancel,
            ["FROM", byte] => Command::From(number(byte)?, None),
            ["FROM", byte, digest] => Command::From(number(byte)?, Some(digest.into())),
            _ => return Err(NoCommand),
        };
        Ok(command)
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Command::Next => f.write_str("NEXT"),
            Command::Level(level) => write!(f, "LEVEL {level}"),
            Command::Until(error) => write!(f, "UNTIL {error}"),
            Command::Pause => f.write_str("PAUSE"),
            Command::Resume => f.write_str("RESUME"),
            Command::Cancel => f.write_str("CANCEL"),
            Command::From(byte, None) => write!(f, "FROM {byte}"),
            Command::From(byte, Some(digest)) => write!(f, "FROM {byte} {digest}"),
        }
    }
}

/// Decimal digits and nothing else: no sign.
pub fn number<T: FromStr>(digits: &str) -> Result<T, NoCommand> {
    let valid = digits.bytes().all(|byte| byte.is_ascii_digit());
    digits.parse().ok().filter(|_| valid).ok_or(NoCommand)
}

fn parse_error(text: &str) -> Result<f32, NoCommand> {
    text.parse().ok().filter(|error: &f32| error.is_finite() && *error >= 0.0).ok_or(NoCommand)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_as_they_are_written() {
        for (text, command) in [
            ("NEXT", Command::Next),
            ("LEVEL 3", Command::Level(3)),
            ("UNTIL 0.001", Command::Until(0.001)),
            ("UNTIL 0", Command::Until(0.0)),
            ("PAUSE", Command::Pause),
            ("RESUME", Command::Resume),
            ("CANCEL", Command::Cancel),
            ("FROM 12", Command::From(12, None)),
            ("FROM 18446744073709551615 ab", Command::From(u64::MAX, Some("ab".into()))),
        ] {
            assert_eq!(text.parse(), Ok(command.clone()));
            assert_eq!(command.to_string(), text);
        }
    }

    #[test]
    fn nothing_else_is_a_command() {
        for text in [
            "",
            " ",
            "next",
            "NEXT ",
            " NEXT",
            "NEXT 1",
            "LEVEL",
            "LEVEL -1",
            "LEVEL +1",
            "LEVEL 4294967296",
            "LEVEL 1 2",
            "UNTIL",
            "UNTIL -1",
            "UNTIL NaN",
            "UNTIL inf",
            "FROM",
            "FROM 1 a b",
            "FROM  1",
            "PAUSE\n",
            "FROM 18446744073709551616",
            "FROM 0x1",
            "QUIT",
            "NEXT\0",
        ] {
            assert_eq!(text.parse::<Command>(), Err(NoCommand), "{text:?}");
        }
    }
}
