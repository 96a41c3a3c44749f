//! The bytes of an OBJ file, read in pieces of whole statements, so that several can be read at once and none need be
//! kept. The encodings are those of [`text`].

use std::{
    io::{Cursor, Read, Seek, SeekFrom},
    path::Path,
};

use super::{number::is_blank, text};
use crate::input;

/// A piece is about this long. What is read from a file does not depend on it.
pub(super) const PIECE: usize = 1 << 20;
/// Larger files are refused.
const MAX_BYTES: u64 = 1 << 36;
/// Larger files in UTF-16 are refused, as they are read whole.
const MAX_UTF16_BYTES: u64 = 1 << 30;
/// Longer statements are refused.
const MAX_STATEMENT: usize = 1 << 26;

trait Source: Read + Seek + Send {}
impl<T: Read + Seek + Send> Source for T {}

pub(super) struct Pieces {
    source: Box<dyn Source>,
    size: usize,
    /// What ends a line.
    pub line_end: u8,
    /// The beginning of a statement that ends in the next piece.
    rest: Vec<u8>,
}

/// The pieces of the file at `path`, or why they cannot be read.
pub(super) fn open(path: &Path, size: usize) -> Result<Pieces, String> {
    let mut file = input::open(path)?;
    let length = file.metadata().map_err(|error| error.to_string())?.len();
    if length > MAX_BYTES {
        return Err(format!("it is larger than {} GiB", MAX_BYTES >> 30));
    }
    let mut start = Vec::new();
    (&mut file).take(text::PROBE as u64).read_to_end(&mut start).map_err(|error| error.to_string())?;
    if start.is_empty() {
        return Err("it is empty".into());
    }
    let source: Box<dyn Source> = match start.as_slice() {
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => {
            Box::new(Cursor::new(text::decode(input::read(path, MAX_UTF16_BYTES)?)?.into_bytes()))
        }
        bytes if text::is_binary(bytes) => return Err(text::BINARY.into()),
        _ => Box::new(file),
    };
    Pieces::new(source, size).map_err(|error| error.to_string())
}

impl Pieces {
    fn new(mut source: Box<dyn Source>, size: usize) -> std::io::Result<Self> {
        // Old systems end lines with a carriage return alone: that is so where no line feed is found at all.
        let mut buffer = vec![0; PIECE.min(1 << 16)];
        let mut line_end = b'\r';
        source.seek(SeekFrom::Start(0))?;
        loop {
            let n = source.read(&mut buffer)?;
            let read = buffer.get(..n).unwrap_or_default();
            if memchr::memchr(b'\n', read).is_some() {
                line_end = b'\n';
                break;
            }
            if n == 0 {
                break;
            }
        }
        let mut bom = [0; 3];
        source.seek(SeekFrom::Start(0))?;
        let marked = source.read_exact(&mut bom).is_ok() && bom == text::UTF8_MARK;
        source.seek(SeekFrom::Start(if marked { text::UTF8_MARK.len() as u64 } else { 0 }))?;
        Ok(Self { source, size, line_end, rest: Vec::new() })
    }

    /// The next piece; `None` at the end.
    pub fn next(&mut self) -> Result<Option<Vec<u8>>, String> {
        let mut piece = std::mem::take(&mut self.rest);
        loop {
            let known = piece.len();
            if known > MAX_STATEMENT {
                return Err(format!("a statement is longer than {} MiB", MAX_STATEMENT >> 20));
            }
            piece.reserve(self.size);
            let read = (&mut self.source).take(self.size as u64).read_to_end(&mut piece);
            if read.map_err(|error| error.to_string())? == 0 {
                return Ok(Some(piece).filter(|piece| !piece.is_empty()));
            }
            if let Some(end) = last_statement_end(&piece, known, self.line_end) {
                self.rest = piece.split_off(end);
                return Ok(Some(piece));
            }
        }
    }
}

/// Behind the last line end, not before `from`, of a line that does not continue.
fn last_statement_end(text: &[u8], from: usize, line_end: u8) -> Option<usize> {
    let mut end = text.len();
    loop {
        let at = from + memchr::memrchr(line_end, text.get(from..end)?)?;
        let last = text.get(..at)?.iter().rev().find(|&&byte| !is_blank(byte));
        if last != Some(&b'\\') {
            return Some(at + 1);
        }
        end = at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(text: &str, size: usize) -> Vec<String> {
        let source = Box::new(Cursor::new(text.as_bytes().to_vec()));
        let mut pieces = Pieces::new(source, size).expect("it can be read");
        let next = || pieces.next().expect("it can be read").map(|p| String::from_utf8(p).expect("text"));
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn pieces_are_whole_statements_and_together_the_file() {
        let text = "v 1\r\n\nf 1 \\ \r\n2 \\\n3\n# \\\nv 2\n\n\nv 3";
        for size in 1..40 {
            let all = pieces(text, size);
            assert_eq!(all.concat(), text);
            for piece in all.iter().rev().skip(1) {
                assert!(piece.ends_with('\n') && !piece.trim_end().ends_with('\\'), "{piece:?}");
            }
        }
        assert_eq!(pieces("v 1\rv 2\r", 4), ["v 1\r", "v 2\r"]);
        assert_eq!(pieces("\u{FEFF}v 1", 100), ["v 1"]);
        assert!(pieces("", 9).is_empty());
    }

    #[test]
    fn a_statement_without_end_is_refused() {
        let source = Box::new(std::io::Cursor::new(b"f 1 2 3 \\\n".repeat((MAX_STATEMENT + 3 * PIECE) / 10)));
        let mut pieces = Pieces::new(source, PIECE).expect("it can be read");
        assert!(pieces.next().expect_err("too long").contains("64 MiB"));
    }
}
