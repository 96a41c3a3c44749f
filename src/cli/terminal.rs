//! Standard error, and whether someone watches it.

use std::io::{self, IsTerminal, Write};

/// A line on standard error. Unlike `eprintln!` it does not panic where that is closed.
pub fn say(line: impl AsRef<str>) {
    let _ = writeln!(io::stderr(), "{}", line.as_ref());
}

pub fn is_watched() -> bool {
    io::stderr().is_terminal()
}

/// Whether messages may be coloured (<https://no-color.org>).
pub fn has_color() -> bool {
    is_watched() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
