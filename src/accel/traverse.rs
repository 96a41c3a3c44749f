//! One traversal for every tree: nearest node first, or in the order of the tree where any hit will do.
//!
//! Slabs are conservative: each plane's distance is padded by more than its rounding error, so that a box is never
//! missed whose triangle, by its own arithmetic, is hit. Together with the watertight triangle test that makes closed meshes tight.

use std::mem::MaybeUninit;

use glam::Vec3A;

use super::{
    lanes::{ALL, Lanes, WIDTH},
    lines::{LEAF, Line, line, tag},
    top_down::MAX_DEPTH,
    wide::Node,
};

/// A node pushes at most seven children and goes on with the eighth, and then all eight of the last one are pushed. One entry more for the
/// bottom.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH + 1;

/// Words, or entries, yet to be visited.
///
/// Aligned as vectors are, so that the function it is in aligns its frame: otherwise all of the vectors that do not fit into registers
/// may lie across two cache lines (a tenth of the time).
#[repr(align(32))]
struct Stack<T, const N: usize>([MaybeUninit<T>; N]);

/// Components of the direction nearer to zero are taken as this, lest 0 · ∞ appear.
const MIN_DIRECTION: f32 = 1e-18;

/// Relative padding of o, which covers the roundings of o/d and those of plane/d − o/d (at most 4 × 2⁻²⁴).
const PAD: f32 = 8.0 * (f32::EPSILON / 2.0);

/// Padding of o, in metres, where the direction was raised to [`MIN_DIRECTION`].
const PAD_PARALLEL: f32 = 1e-6;

/// Padding of the far distance, in units in the last place: covers the roundings of 1/d on two axes (10 × 2⁻²⁴).
const PAD_FAR: i32 = 10;

/// What happens at the leaves.
pub trait Leaves {
    /// Whether any leaf may end the traversal: then children are visited in their order in the node, and `t_max` never changes. Otherwise
    /// about nearest first.
    const ANY: bool;
    /// Tests the leaf with this [tag](super::lines::tag) and first line; `true` ends the traversal.
    fn visit<L: Lanes>(&mut self, tag: u32, first: *const Line) -> bool;
    /// Boxes beyond this are of no interest.
    fn t_max(&self) -> f32;
}

/// A ray as boxes are tested with: 1/d, per axis, and −o/d widened to both sides.
pub struct Slabs<L> {
    inverse: [L; 3],
    near: [L; 3],
    far: [L; 3],
    t_min: L,
    /// Where in a node the plane is that the ray meets first on each axis, in bytes. The other is at this ^ 32.
    first: [usize; 3],
}

impl<L: Lanes> Slabs<L> {
    /// Of rays in instances all else waits for this, and so what can be done beside the division is.
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A, t_min: f32) -> Self {
        let length = direction.abs();
        // (in this order NaN stays)
        let inverse = Vec3A::ONE / Vec3A::splat(MIN_DIRECTION).max(length).copysign(direction);
        let parallel =
            Vec3A::select(length.cmplt(Vec3A::splat(MIN_DIRECTION)), Vec3A::splat(PAD_PARALLEL), Vec3A::ZERO);
        let pad = (origin.abs() * PAD + parallel).copysign(direction);
        let (near, far) = ((-origin - pad) * inverse, (pad - origin) * inverse);
        let negative = direction.is_negative_bitmask() as usize;
        let splat = |of: Vec3A| [L::splat(of.x), L::splat(of.y), L::splat(of.z)];
        let plane = |axis: usize| PLANE * (2 * axis + (negative >> axis & 1));
        Self {
            inverse: splat(inverse),
            near: splat(near),
            far: splat(far),
            // (+0 where it is -0: the order of bits must hold)
            t_min: L::splat(if t_min > 0.0 { t_min } else { 0.0 }),
            first: [plane(0), plane(1), plane(2)],
        }
    }

    /// The children that the ray meets before `t_max`, as bits, and where it enters each.
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: L) -> (u32, L) {
        let planes = (&raw const node.bounds).cast::<u8>();
        // SAFETY: `first` says where planes are, by construction, and so does first ^ PLANE.
        let plane = |at: usize| L::load(unsafe { &*planes.add(at).cast::<[f32; WIDTH]>() });
        let near = |axis: usize| plane(self.first[axis]).mul_add(self.inverse[axis], self.near[axis]);
        let far = |axis: usize| plane(self.first[axis] ^ PLANE).mul_add(self.inverse[axis], self.far[axis]);
        let enter = near(0).later(near(1)).later(near(2).later(self.t_min));
        let leave = far(0).earlier(far(1)).earlier(far(2).earlier(t_max));
        (enter.exceeds(leave, PAD_FAR) ^ ALL, enter)
    }
}

/// Bytes of a plane of all children of a node.
const PLANE: usize = size_of::<[f32; WIDTH]>();

/// Puts the farther entry first.
#[inline(always)]
fn order(far: &mut u64, near: &mut u64) {
    (*far, *near) = ((*far).max(*near), (*far).min(*near));
}

/// Visits every leaf of the tree in `lines` whose box the ray meets within (`t_min`, `leaves.t_max()`).
/// `true` where `leaves` ended it.
///
/// # Safety
/// `lines` comes from [`collapse`](super::wide::collapse): words point into it, and it is no deeper than [`MAX_DEPTH`].
#[inline(always)]
pub unsafe fn traverse<L: Lanes, K: Leaves>(lines: &[Line], slabs: &Slabs<L>, leaves: &mut K) -> bool {
    if lines.is_empty() {
        return false;
    }
    // SAFETY: as the caller says.
    match K::ANY {
        true => unsafe { in_order::<L, K>(lines, slabs, leaves) },
        false => unsafe { nearest_first::<L, K>(lines, slabs, leaves) },
    }
}

/// Children in their order in the node, which is made for that. How many of them are met decides no branch, which would be mispredicted
/// as a rule: they are all pushed at once.
///
/// # Safety
/// As [`traverse`].
#[inline(always)]
unsafe fn in_order<L: Lanes, K: Leaves>(lines: &[Line], slabs: &Slabs<L>, leaves: &mut K) -> bool {
    let Stack(stack) = &mut Stack([const { MaybeUninit::<u32>::uninit() }; STACK + WIDTH]);
    // Below the lowest entry is one that is only prefetched.
    stack[0].write(0);
    let mut height = 1;
    // SAFETY: words point into `lines`.
    let at = |word: u32| unsafe { lines.as_ptr().add(line(word)) };
    let t_max = L::splat(leaves.t_max());
    let mut current = 0;
    'visit: loop {
        'pop: {
            if current & LEAF != 0 {
                if leaves.visit::<L>(tag(current), at(current)) {
                    return true;
                }
                break 'pop;
            }
            // SAFETY: words without LEAF are those of nodes.
            let node = unsafe { &*at(current).cast::<Node>() };
            let (mut lanes, _) = slabs.enter(node, t_max);
            if lanes == 0 {
                break 'pop;
            }
            let lane = |lanes: u32| lanes.trailing_zeros() as usize & (WIDTH - 1);
            current = node.child[lane(lanes)];
            prefetch::<L>(at(current));
            lanes &= lanes - 1;
            // The one after that, or, where there is none, any.
            prefetch::<L>(at(node.child[lane(lanes)]));
            let words = L::pack(&node.child, lanes);
            debug_assert!(height + WIDTH <= stack.len());
            // SAFETY: by the bound on the depth `height` stays below STACK, and behind it there is room for as many words as a node has.
            unsafe { stack.as_mut_ptr().add(height).cast::<[u32; WIDTH]>().write_unaligned(words) };
            height += lanes.count_ones() as usize;
            continue 'visit;
        }
        height -= 1;
        if height == 0 {
            return false;
        }
        // SAFETY: pushed above.
        unsafe {
            current = stack.get_unchecked(height).assume_init();
            prefetch::<L>(at(stack.get_unchecked(height - 1).assume_init()));
        }
    }
}

/// The child whose box the ray enters first, from a stack of (distance, child).
///
/// # Safety
/// As [`traverse`].
#[inline(always)]
unsafe fn nearest_first<L: Lanes, K: Leaves>(lines: &[Line], slabs: &Slabs<L>, leaves: &mut K) -> bool {
    let Stack(stack) = &mut Stack([const { MaybeUninit::<u64>::uninit() }; STACK]);
    let mut height = 0;
    // SAFETY: by the bound on the depth `height` stays below STACK, and what is popped was pushed.
    macro_rules! push {
        ($entry:expr) => {{
            debug_assert!(height < STACK);
            unsafe { stack.get_unchecked_mut(height) }.write($entry);
            height += 1;
        }};
    }
    // SAFETY: words point into `lines`.
    let at = |word: u32| unsafe { lines.as_ptr().add(line(word)) };
    let mut t_max = L::splat(leaves.t_max());
    let mut current = 0;
    'visit: loop {
        'pop: {
            if current & LEAF != 0 {
                if leaves.visit::<L>(tag(current), at(current)) {
                    return true;
                }
                t_max = L::splat(leaves.t_max());
                break 'pop;
            }
            // SAFETY: words without LEAF are those of nodes.
            let node = unsafe { &*at(current).cast::<Node>() };
            let (mut lanes, enter) = slabs.enter(node, t_max);
            if lanes == 0 {
                break 'pop;
            }
            macro_rules! next {
                () => {{
                    let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
                    lanes &= lanes - 1;
                    lane
                }};
            }
            let first = next!();
            current = node.child[first];
            prefetch::<L>(at(current));
            if lanes == 0 {
                continue 'visit;
            }
            // Distance above, child below: sorts by distance, since non-negative floats sort as their bits do.
            let entries = enter.above(&node.child);
            macro_rules! entry {
                () => {{
                    let lane = next!();
                    prefetch::<L>(at(node.child[lane]));
                    entries[lane]
                }};
            }
            let (mut a, mut b) = (entries[first], entry!());
            order(&mut a, &mut b);
            if lanes == 0 {
                push!(a);
                current = b as u32;
                continue 'visit;
            }
            let mut c = entry!();
            if lanes == 0 {
                order(&mut b, &mut c);
                order(&mut a, &mut b);
                push!(a);
                push!(b);
                current = c as u32;
                continue 'visit;
            }
            let mut d = entry!();
            order(&mut c, &mut d);
            order(&mut a, &mut c);
            order(&mut b, &mut d);
            order(&mut b, &mut c);
            let base = height;
            push!(a);
            push!(b);
            push!(c);
            push!(d);
            while lanes != 0 {
                let e = entry!();
                let mut at = height;
                push!(e);
                // SAFETY: entries from `base` to `height` have just been pushed.
                while at > base && unsafe { stack.get_unchecked(at - 1).assume_init() } < e {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at].write(e);
            }
            height -= 1;
            current = unsafe { stack.get_unchecked(height).assume_init() } as u32;
            continue 'visit;
        }
        loop {
            if height == 0 {
                return false;
            }
            height -= 1;
            // SAFETY: pushed above.
            let top = unsafe { stack.get_unchecked(height).assume_init() };
            if f32::from_bits((top >> 32) as u32) <= leaves.t_max() {
                current = top as u32;
                break;
            }
        }
    }
}

/// All lines of a node, or of a leaf with one block: the largest single gain on scenes that exceed the cache.
#[inline(always)]
fn prefetch<L: Lanes>(address: *const Line) {
    for line in 0..5 {
        L::prefetch(address.wrapping_add(line).cast());
    }
}
