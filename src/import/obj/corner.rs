//! The corners of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`, indices of statements that count from 1, or back from the
//! face where they are negative.

use super::text::shorten;

/// How many statements of each kind there are, so far or in all.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub v: usize,
    pub vt: usize,
    pub vn: usize,
}

/// A corner as `[v, vt, vn]` of the cleaned text: absolute, and known to exist. There, `vt` and `vn` come one later than
/// in the file, for 1 is the mark of "missing".
pub(super) fn read(word: &str, seen: Counts, all: Counts) -> Result<[usize; 3], String> {
    let mut parts = word.split('/');
    let v = parts.next().unwrap_or_default();
    let [vt, vn] = [(); 2].map(|()| parts.next().unwrap_or_default());
    if parts.next().is_some() {
        return Err(format!("`{}` is no corner: at most v/vt/vn", shorten(word)));
    }
    let optional = |index: &str, what, seen, all| match index {
        "" => Ok(1),
        index => Ok::<_, String>(resolve(index, what, seen, all)? + 1),
    };
    Ok([
        resolve(v, "vertex", seen.v, all.v)?,
        optional(vt, "texture coordinate", seen.vt, all.vt)?,
        optional(vn, "normal", seen.vn, all.vn)?,
    ])
}

fn resolve(index: &str, what: &str, seen: usize, all: usize) -> Result<usize, String> {
    let number: i64 = index.parse().map_err(|_| match index {
        "" => format!("a corner without a {what}"),
        _ => format!("`{}` is no index of a {what}", shorten(index)),
    })?;
    if number == 0 {
        return Err(format!("a {what} of index 0: OBJ counts from 1"));
    }
    let absolute = if number < 0 { seen as i64 + 1 + number } else { number };
    match usize::try_from(absolute) {
        Ok(i) if (1..=all).contains(&i) => Ok(i),
        _ if number < 0 => Err(format!("{what} {number} does not exist: {seen} precede this face")),
        _ => Err(format!("{what} {number} does not exist: the file has {all}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_absolute_and_in_range() {
        let (seen, all) = (Counts { v: 3, vt: 1, vn: 2 }, Counts { v: 5, vt: 4, vn: 2 });
        let read = |word| read(word, seen, all);
        assert_eq!(read("1"), Ok([1, 1, 1]));
        assert_eq!(read("5/4"), Ok([5, 5, 1]));
        assert_eq!(read("-1/-1/-2"), Ok([3, 2, 2]));
        assert_eq!(read("-3//2"), Ok([1, 1, 3]));
        for wrong in
            ["", "/1", "0", "6", "-4", "1/5", "1/-2", "1//3", "1/1/1/1", "1.0", "x", "9223372036854775808"]
        {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!(read("-9223372036854775808").is_err());
    }
}
