//! Memory for what is large: in huge pages, where the system has them for the asking. Rays go through it at random, and with pages of
//! 4 KiB most steps would miss the cache of addresses as well.

use rayon::prelude::*;

/// As `Vec::with_capacity`.
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let vec = Vec::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    advise(vec.as_ptr() as usize, capacity * size_of::<T>());
    vec
}

/// All of `chunks`, one after the other, copied in parallel: most of the time is that of touching new memory. Each is given back as soon
/// as it is copied.
pub fn concat<T: Copy + Send + Sync>(chunks: Vec<Vec<T>>) -> Vec<T> {
    let len = chunks.iter().map(Vec::len).sum();
    let mut all = with_capacity(len);
    let mut free = &mut all.spare_capacity_mut()[..len];
    let mut places = Vec::with_capacity(chunks.len());
    for chunk in chunks {
        let (place, rest) = free.split_at_mut(chunk.len());
        places.push((place, chunk));
        free = rest;
    }
    places.into_par_iter().for_each(|(place, chunk)| _ = place.write_copy_of_slice(&chunk));
    // SAFETY: the places are as long as `all` together, and each has been written.
    unsafe { all.set_len(len) };
    all
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
