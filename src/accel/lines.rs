//! A tree's memory: cache lines, in which nodes and leaves lie side by side, and the words that say where.
//!
//! So a child is found in the same way whether it is a node or a leaf, without a branch, which would be mispredicted half of
//! the time.

use std::mem::MaybeUninit;

/// Of a word: it is a leaf's.
pub const LEAF: u32 = 1 << 31;

/// A leaf's tag stands above the number of its first line.
const TAG_SHIFT: u32 = 29;

/// Of a tree, at most: 32 GiB.
pub const MAX_LINES: usize = 1 << TAG_SHIFT;

/// 64 bytes, some of which may be padding.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Line([MaybeUninit<u8>; 64]);

/// Number of lines that a `T` takes.
pub const fn lines_of<T>() -> usize {
    assert!(align_of::<T>() == align_of::<Line>() && size_of::<T>().is_multiple_of(size_of::<Line>()));
    size_of::<T>() / size_of::<Line>()
}

/// `items`, as lines.
pub fn of<T: Copy>(items: &[T]) -> &[Line] {
    // SAFETY: they are as many lines, aligned as these are, and a line need not be initialised.
    unsafe { std::slice::from_raw_parts(items.as_ptr().cast(), const { lines_of::<T>() } * items.len()) }
}

/// The word for a leaf: its tag, 1 to 3, and its first line.
pub fn leaf(tag: u32, line: usize) -> u32 {
    debug_assert!((1..4).contains(&tag) && line < MAX_LINES);
    LEAF | tag << TAG_SHIFT | line as u32
}

/// The tag of a leaf's word.
#[inline(always)]
pub fn tag(word: u32) -> u32 {
    word >> TAG_SHIFT & 3
}

/// The first line of what `word` stands for.
#[inline(always)]
pub fn line(word: u32) -> usize {
    word as usize & (MAX_LINES - 1)
}
