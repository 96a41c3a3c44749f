//! Identifiers that any scene language takes.

use std::collections::HashSet;

/// Names given so far.
#[derive(Debug, Default)]
pub struct Names(HashSet<String>);

const LONGEST: usize = 40;

impl Names {
    /// A name like `wanted` that was not given before: ASCII letters, digits and `_`, beginning with a letter.
    pub fn unique(&mut self, prefix: &str, wanted: &str) -> String {
        let tame = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let stem: String =
            prefix.chars().chain("_".chars()).chain(wanted.chars().map(tame).take(LONGEST)).collect();
        let mut name = stem.clone();
        let mut n = 2;
        // Not only case tells two files apart.
        while !self.0.insert(name.to_ascii_lowercase()) {
            name = format!("{stem}_{n}");
            n += 1;
        }
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_tame_and_different() {
        let mut names = Names::default();
        assert_eq!(names.unique("m", "Gold leaf"), "m_Gold_leaf");
        assert_eq!(names.unique("m", "gold/leaf"), "m_gold_leaf_2");
        assert_eq!(names.unique("m", "玻璃\"\n"), "m_____");
        assert!(names.unique("m", &"x".repeat(500)).len() < 50);
    }
}
