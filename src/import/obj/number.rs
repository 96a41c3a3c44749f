//! Numbers in text, fast: an OBJ file of ten million triangles holds two hundred million of them.
//!
//! The common ones (up to 15 digits, a small exponent) are read as an integer times a power of ten, both exact in `f64`,
//! so that the product is the `f64` nearest to the decimal (Clinger 1990, *How to read floating point numbers
//! accurately*). Rounding that once more gives the `f32` nearest to the decimal, unless the product lies exactly between
//! two of them. Such numbers, and all unusual ones, are left to the standard library.

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];
/// Up to here every integer is an `f64`.
const EXACT: u64 = 1 << 53;

/// What ends a word.
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | b'\x0B' | b'\x0C')
}

/// The next number of `rest`, up to a comment, which is taken off it.
pub(super) fn next_float<'a>(rest: &mut &'a [u8]) -> Word<'a> {
    skip_blanks(rest);
    if let Some((number, length)) = common(rest) {
        *rest = rest.get(length..).unwrap_or_default();
        return Word::Number(number);
    }
    let word = next_word(rest);
    if word.is_empty() {
        return Word::None;
    }
    let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f32>().ok());
    match number {
        Some(number) if number.is_finite() => Word::Number(number),
        Some(_) => Word::NotFinite,
        None if is_microsofts(word) => Word::NotFinite,
        None => Word::Other(word),
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Word<'a> {
    Number(f32),
    /// Infinite, too large, or `nan`.
    NotFinite,
    Other(&'a [u8]),
    /// The statement ends here.
    None,
}

impl Word<'_> {
    pub fn number(self) -> Option<f32> {
        match self {
            Self::Number(number) => Some(number),
            _ => None,
        }
    }
}

/// The next word of `rest`, up to a comment; empty at the end.
pub(super) fn next_word<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    skip_blanks(rest);
    let ends = |(i, &byte): (usize, &u8)| is_blank(byte) || is_comment(rest, i);
    let end = rest.iter().enumerate().position(ends).unwrap_or(rest.len());
    let (word, after) = rest.split_at(end);
    *rest = after;
    word
}

/// Whether a comment begins at `i`: not where `1.#QNAN` goes on.
fn is_comment(text: &[u8], i: usize) -> bool {
    text.get(i) == Some(&b'#')
        && !(text.get(i.wrapping_sub(1)) == Some(&b'.')
            && matches!(text.get(i + 1), Some(b'I' | b'Q' | b'S')))
}

fn skip_blanks(rest: &mut &[u8]) {
    while let [first, after @ ..] = rest
        && is_blank(*first)
    {
        *rest = after;
    }
}

/// What old runtimes of Visual C++ print for values that are not finite: `1.#INF`, `-1.#IND`, `1.#QNAN`.
fn is_microsofts(word: &[u8]) -> bool {
    let unsigned = word.strip_prefix(b"-").unwrap_or(word);
    [b"1.#IND".as_slice(), b"1.#INF", b"1.#QNA", b"1.#SNA"].iter().any(|start| unsigned.starts_with(start))
}

/// A number at the beginning of `text`, with its length, if it is a common one.
#[inline]
fn common(text: &[u8]) -> Option<(f32, usize)> {
    let at = |i: usize| text.get(i).copied().unwrap_or(b' ');
    let negative = at(0) == b'-';
    let mut i = usize::from(negative);
    let (mut mantissa, mut exponent) = (0_u64, 0_i32);
    let first = i;
    let digit = |i: usize| Some(at(i).wrapping_sub(b'0')).filter(|&digit| digit < 10);
    while let Some(digit) = digit(i) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        i += 1;
    }
    let mut digits = i - first;
    if at(i) == b'.' {
        i += 1;
        let first = i;
        while let Some(digit) = digit(i) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            i += 1;
        }
        digits += i - first;
        exponent = -((i - first).min(99) as i32);
    }
    if digits == 0 || digits > 19 {
        return None;
    }
    if matches!(at(i), b'e' | b'E') {
        i += 1;
        let minus = at(i) == b'-';
        i += usize::from(minus || at(i) == b'+');
        let first = i;
        let mut power = 0;
        while let Some(digit) = digit(i).filter(|_| i - first < 3) {
            power = power * 10 + i32::from(digit);
            i += 1;
        }
        if i == first {
            return None;
        }
        exponent += if minus { -power } else { power };
    }
    if !is_blank(at(i)) && !is_comment(text, i) {
        return None;
    }
    let power = *POWERS.get(exponent.unsigned_abs() as usize)?;
    if mantissa > EXACT {
        return None;
    }
    let exact = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    const DROPPED: u64 = (1 << 29) - 1;
    const HALF: u64 = 1 << 28;
    let normal = exact >= f64::from(f32::MIN_POSITIVE) && exact < f64::from(f32::MAX);
    if !(normal && exact.to_bits() & DROPPED != HALF || mantissa == 0) {
        return None;
    }
    let number = exact as f32;
    Some((if negative { -number } else { number }, i))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn float(text: &str) -> Word<'_> {
        next_float(&mut text.as_bytes())
    }

    /// Random decimals, and those next to and right between two `f32`, which a double rounding would get wrong.
    #[test]
    fn numbers_are_the_nearest() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        for i in 0..200_000 {
            let near = f32::from_bits(random() as u32 & 0x7FFF_FFFF);
            let between = (f64::from(near) + f64::from(f32::from_bits(near.to_bits() + 1))) / 2.0;
            let text = match i % 6 {
                0 => format!("-{}.{:06}", random() % 1000, random() % 1_000_000),
                1 => format!("{}e{}", random(), (random() % 90) as i64 - 50),
                2 => format!("{near:e}"),
                3 => format!("{between:e}"),
                4 => format!("{}", (random() % (1 << 24)) as f64 + 16_777_217.0),
                _ => format!(".{:09}E-0{}", random() % 1_000_000_000, random() % 10),
            };
            let expected: f32 = text.parse().expect("it is a number");
            let number = if expected.is_finite() { Word::Number(expected) } else { Word::NotFinite };
            assert_eq!(float(&text), number, "{text}");
        }
    }

    #[test]
    fn words_end_at_blanks_and_comments() {
        let mut rest = b" 1 -2.5\t+.5e1 1.#I 3.# 7".as_slice();
        let numbers = [(); 6].map(|()| next_float(&mut rest));
        assert_eq!(
            numbers,
            [
                Word::Number(1.0),
                Word::Number(-2.5),
                Word::Number(5.0),
                Word::Other(b"1.#I"),
                Word::Number(3.0),
                Word::None
            ]
        );
        assert_eq!(float("4#5"), Word::Number(4.0));
        for text in ["", "  ", "# 1"] {
            assert_eq!(float(text), Word::None);
        }
        for text in ["nan", "-inf", "1e39", "1.#QNAN", "-1.#IND00"] {
            assert_eq!(float(text), Word::NotFinite, "{text}");
        }
        for text in ["x", "1.0.0", "1e", "--1", "1,5", "0x10", "\u{FF11}"] {
            assert_eq!(float(text), Word::Other(text.as_bytes()));
        }
        assert!(float("-0").number().is_some_and(|zero| zero.is_sign_negative()));
    }
}
