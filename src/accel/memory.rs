//! Memory for what is large: in huge pages, where the system has them for the asking. Rays go through it at random, and with pages of
//! 4 KiB most steps would miss the cache of addresses as well.

use std::{
    mem::{self, MaybeUninit},
    sync::{Mutex, PoisonError},
};

/// As `Vec::with_capacity`.
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let vec = Vec::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    advise(vec.as_ptr() as usize, capacity * size_of::<T>());
    vec
}

/// Up to `capacity` items, written by whoever takes room for them, from any thread. What is not taken is not touched:
/// it costs addresses alone, where the system does not reckon with all that is asked for.
pub fn filled<T: Send>(capacity: usize, write: impl FnOnce(&Room<T>)) -> Vec<T> {
    let mut all = with_capacity(capacity);
    let room = Room(Mutex::new((0, &mut all.spare_capacity_mut()[..capacity])));
    write(&room);
    let taken = room.0.into_inner().unwrap_or_else(PoisonError::into_inner).0;
    // SAFETY: all that was taken is written, as `Room::take` asks.
    unsafe { all.set_len(taken) };
    all
}

/// How much room is taken, and the rest.
pub struct Room<'a, T>(Mutex<(usize, &'a mut [MaybeUninit<T>])>);

impl<'a, T> Room<'a, T> {
    /// Room for `count` items side by side, and the place of the first among all.
    ///
    /// # Safety
    /// All of it is written before [`filled`] ends.
    pub unsafe fn take(&self, count: usize) -> (usize, &'a mut [MaybeUninit<T>]) {
        let mut room = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (taken, rest) = &mut *room;
        let (place, free) = mem::take(rest).split_at_mut(count);
        *rest = free;
        *taken += count;
        (*taken - count, place)
    }

    /// Copies `items` there; the place of the first.
    pub fn add(&self, items: &[T]) -> usize
    where
        T: Copy,
    {
        // SAFETY: it is written at once.
        let (first, place) = unsafe { self.take(items.len()) };
        place.write_copy_of_slice(items);
        first
    }
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
