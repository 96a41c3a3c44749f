//! Memory for what is large: in huge pages, where the system has them for the asking. Rays go through it at random, and with pages of
//! 4 KiB most steps would miss the cache of addresses as well.

/// As `Vec::with_capacity`.
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let vec = Vec::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    advise(vec.as_ptr() as usize, capacity * size_of::<T>());
    vec
}

#[cfg(target_os = "linux")]
fn advise(start: usize, bytes: usize) {
    use rustix::mm::{Advice, madvise};
    /// Bytes from which on it is asked for.
    const LARGE: usize = 4 << 20;
    /// The advice is about whole pages: those that lie in the allocation.
    const PAGE: usize = 1 << 16;
    if bytes < LARGE {
        return;
    }
    let (first, end) = (start.next_multiple_of(PAGE), (start + bytes) / PAGE * PAGE);
    // SAFETY: the pages belong to an allocation of ours, and the advice changes nothing about what is in them. (Where it is not
    // taken, they stay small.)
    _ = unsafe { madvise(first as *mut _, end - first, Advice::LinuxHugepage) };
}
