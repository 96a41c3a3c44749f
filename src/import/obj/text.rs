//! The bytes of an OBJ or MTL file as text, and its text as statements.
//!
//! Both formats date from 1990 and name no encoding: files are met in UTF-8 with and without a byte order mark,
//! UTF-16, and Latin-1, with the line ends of three systems, and with long statements continued after a `\`.

use std::borrow::Cow;

/// How far into a file a zero byte is looked for: no text holds one.
pub(super) const PROBE: usize = 4096;
pub(super) const BINARY: &str = "it is a binary file, not text";
/// The byte order mark.
pub(super) const UTF8_MARK: [u8; 3] = [0xEF, 0xBB, 0xBF];

/// The text of a file, or why it is none.
pub(super) fn decode(bytes: Vec<u8>) -> Result<String, &'static str> {
    match bytes.as_slice() {
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xEF, 0xBB, 0xBF, rest @ ..] => single_bytes(rest.to_vec()),
        _ => single_bytes(bytes),
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, &'static str> {
    let units = bytes.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
    char::decode_utf16(units).collect::<Result<_, _>>().map_err(|_| "it is damaged UTF-16")
}

fn single_bytes(bytes: Vec<u8>) -> Result<String, &'static str> {
    if is_binary(&bytes) {
        return Err(BINARY);
    }
    Ok(String::from_utf8(bytes).unwrap_or_else(|e| latin1(e.as_bytes())))
}

pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.iter().take(PROBE).any(|&b| b == 0)
}

/// A name in UTF-8 or Latin-1.
pub(super) fn name(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| latin1(bytes), str::to_owned)
}

/// Latin-1 is the first 256 characters of Unicode.
fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}

pub(super) fn shorten_bytes(word: &[u8]) -> String {
    // A character takes four bytes at most.
    shorten(&name(word.get(..200).unwrap_or(word)))
}

/// One statement: where it begins (lines count from 1), its keyword, and the rest without outer spaces.
pub(super) struct Statement<'a> {
    pub line: usize,
    pub keyword: &'a str,
    pub rest: &'a str,
}

/// Calls `each` with every statement of `text`: continued lines joined, empty lines and whole-line comments left
/// out. A `#` further on is left in: names hold it ("Material #1"), so that only the statement knows.
pub(super) fn statements(text: &str, mut each: impl FnMut(Statement)) {
    let line_end = if text.contains('\n') { '\n' } else { '\r' };
    let mut lines = text.split(line_end).enumerate();
    while let Some((number, line)) = lines.next() {
        let mut whole = Cow::Borrowed(line.trim());
        if whole.starts_with('#') {
            continue;
        }
        while let Some(open) = whole.strip_suffix('\\') {
            let Some((_, next)) = lines.next() else { break };
            // Not through `open.to_owned()` each time: thousands of continued lines would cost their square.
            let length = open.len();
            let joined = whole.to_mut();
            joined.truncate(length);
            joined.push(' ');
            joined.push_str(next.trim());
        }
        let whole = whole.trim_end_matches('\\');
        let (keyword, rest) = whole.split_once(char::is_whitespace).unwrap_or((whole, ""));
        if !keyword.is_empty() {
            each(Statement { line: number + 1, keyword, rest: rest.trim() });
        }
    }
}

/// `rest` up to a comment, for statements that hold numbers only.
pub(super) fn without_comment(rest: &str) -> &str {
    rest.split_once('#').map_or(rest, |(before, _)| before)
}

/// `name` up to a comment that a space sets off: the second guess, where the whole is no name that is known.
pub(super) fn name_without_comment(name: &str) -> &str {
    name.split_once(" #").map_or(name, |(before, _)| before.trim_end())
}

/// A word of the user's file, short enough for a message.
pub(super) fn shorten(word: &str) -> String {
    const LONGEST: usize = 40;
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(text: &str) -> Vec<(usize, String, String)> {
        let mut all = Vec::new();
        statements(text, |s| all.push((s.line, s.keyword.into(), s.rest.into())));
        all
    }

    #[test]
    fn encodings_give_the_same_text() {
        let utf16: Vec<u8> = "\u{FEFF}o Glühwürmchen".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let utf16_big: Vec<u8> = "\u{FEFF}o Glühwürmchen".encode_utf16().flat_map(u16::to_be_bytes).collect();
        let latin1 = b"o Gl\xFChw\xFCrmchen".to_vec();
        for bytes in ["o Glühwürmchen".into(), "\u{FEFF}o Glühwürmchen".into(), utf16, utf16_big, latin1]
        {
            assert_eq!(decode(bytes).as_deref(), Ok("o Glühwürmchen"));
        }
        assert!(decode(b"\x7fELF\0\0".to_vec()).is_err());
    }

    #[test]
    fn line_ends_of_three_systems_count_alike() {
        for text in ["v 1\n\nf 2", "v 1\r\n\r\nf 2", "v 1\r\rf 2"] {
            assert_eq!(parts(text), [(1, "v".into(), "1".into()), (3, "f".into(), "2".into())]);
        }
    }

    #[test]
    fn continued_lines_are_one_statement_with_the_number_of_the_first() {
        assert_eq!(
            parts("f 1 \\\n 2\\\r\n  3\nv 4"),
            [(1, "f".into(), "1  2 3".into()), (4, "v".into(), "4".into())]
        );
        assert_eq!(parts("f 1\\"), [(1, "f".into(), "1".into())]);
        assert_eq!(parts("# C:\\\nv 1"), [(2, "v".into(), "1".into())]);
    }
}
