//! The corners of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`, indices of statements that count from 1, or back from the
//! face where they are negative.
//!
//! A piece of a file is read without knowing how many statements come before it. So what counts back is kept relative to
//! the piece's beginning until that is known.

use super::{number::next_word, text::shorten_bytes};

/// At most this many statements of a kind: then what counts back has room beside what does not.
pub(super) const MAX_STATEMENTS: usize = 1 << 30;

/// `[v, vt, vn]`.
pub(super) type Corner = [Index; 3];

/// An index as the file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Index(u32);

/// Above: relative to the first statement of the piece.
const RELATIVE: u32 = 1 << 31;
const MIDDLE: u32 = RELATIVE + MAX_STATEMENTS as u32;

/// What a corner has none of, among resolved indices.
pub(super) const NONE: u32 = u32::MAX;

impl Index {
    const NONE: Self = Self(NONE);

    /// From 0; `before` statements are in earlier pieces. `None`: before the first of all.
    #[inline]
    pub fn resolve(self, before: u32) -> Option<u32> {
        match self.0 {
            NONE => Some(NONE),
            relative @ RELATIVE.. => {
                u32::try_from(i64::from(before) + i64::from(relative) - i64::from(MIDDLE)).ok()
            }
            index => Some(index),
        }
    }
}

/// How many statements of each kind there are: v, vt, vn.
pub(super) type Counts = [usize; 3];

pub(super) const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Takes the next corner off `rest`; `Ok(None)` at the end. `seen` are the statements of this piece so far.
#[inline]
pub(super) fn next(rest: &mut &[u8], seen: &Counts) -> Result<Option<Corner>, String> {
    let word = next_word(rest);
    if word.is_empty() {
        return Ok(None);
    }
    let mut corner = [Index::NONE; 3];
    let mut at = word;
    for (part, index) in corner.iter_mut().enumerate() {
        let (number, after) = integer(at);
        match (number, after) {
            (Some(n), [] | [b'/', ..]) if (1..=MAX_STATEMENTS as i64).contains(&n) => {
                *index = Index((n - 1) as u32)
            }
            (Some(n), [] | [b'/', ..]) if (-(MAX_STATEMENTS as i64)..0).contains(&n) => {
                // At most MAX_STATEMENTS are seen, so this stays within its half of the numbers.
                let seen = seen.get(part).map_or(0, |&n| n.min(MAX_STATEMENTS - 1) as i64);
                *index = Index((i64::from(MIDDLE) + seen + n) as u32);
            }
            (None, [] | [b'/', ..]) if part > 0 => {}
            _ => return Err(wrong(word, part, at)),
        }
        match after {
            [b'/', after @ ..] => at = after,
            _ => return Ok(Some(corner)),
        }
    }
    Err(format!("`{}` is no corner: at most v/vt/vn", shorten_bytes(word)))
}

#[cold]
fn wrong(word: &[u8], part: usize, at: &[u8]) -> String {
    let kind = KINDS.get(part).copied().unwrap_or_default();
    let index = at.split(|&byte| byte == b'/').next().unwrap_or_default();
    match integer(index) {
        (Some(0), []) => format!("a {kind} of index 0: OBJ counts from 1"),
        (Some(_), []) => format!("{kind} {} does not exist", shorten_bytes(index)),
        (None, []) => format!("`{}`: a corner without a {kind}", shorten_bytes(word)),
        _ => format!("`{}` is no index of a {kind}", shorten_bytes(index)),
    }
}

/// A whole number at the beginning of `text`, and what comes after.
#[inline]
fn integer(text: &[u8]) -> (Option<i64>, &[u8]) {
    let (negative, digits) = match text {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        _ => (false, text),
    };
    let (mut number, mut rest) = (0_i64, digits);
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        number = number.saturating_mul(10).saturating_add(i64::from(digit - b'0'));
        rest = after;
    }
    if rest.len() == digits.len() {
        return (None, text);
    }
    (Some(if negative { -number } else { number }), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three vertices, one texture coordinate and two normals are in the piece, ten of each before it.
    fn read(word: &str) -> Result<[Option<u32>; 3], String> {
        let corner = next(&mut word.as_bytes(), &[3, 1, 2])?.ok_or("nothing")?;
        Ok(corner.map(|index| index.resolve(10)))
    }

    #[test]
    fn indices_count_from_one_or_back() {
        let none = Some(NONE);
        assert_eq!(read("1"), Ok([Some(0), none, none]));
        assert_eq!(read("5/4#"), Ok([Some(4), Some(3), none]));
        assert_eq!(read("-1/-1/-2"), Ok([Some(12), Some(10), Some(10)]));
        assert_eq!(read("-13//2"), Ok([Some(0), none, Some(1)]));
        assert_eq!(read("-14/1/"), Ok([None, Some(0), none]));
        assert_eq!(read("1073741824/-1073741824"), Ok([Some((1 << 30) - 1), None, none]));
        for wrong in
            ["", "/1", "0", "1/0", "1/1/1/1", "1.0", "1-", "x", "1//x", "9223372036854775808", "-1073741825"]
        {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!(read("-9223372036854775808").is_err());
    }
}
