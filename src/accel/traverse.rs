//! One traversal for every tree: nearest node first, from a stack of (distance, child).
//!
//! Slabs are conservative: each plane's distance is padded by more than its rounding error, so that a box is never
//! missed whose triangle, by its own arithmetic, is hit. Together with the watertight triangle test that makes closed meshes tight.

use std::mem::MaybeUninit;

use super::{
    lanes::{Lanes, WIDTH},
    top_down::MAX_DEPTH,
    wide::{LEAF, Node},
};
use crate::geometry::Ray;

/// A node pushes at most seven children and goes on with the eighth, and then all eight of the last one are pushed.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Components of the direction nearer to zero are taken as this, lest 0 · ∞ appear.
const MIN_DIRECTION: f32 = 1e-18;

/// Relative padding of o/d, which covers its roundings and those of plane/d − o/d (at most 4 × 2⁻²⁴).
const PAD: f32 = 8.0 * (f32::EPSILON / 2.0);

/// Padding in t where the direction was raised to [`MIN_DIRECTION`]: moves the plane by 10⁻⁶ metres.
const PAD_PARALLEL: f32 = 1e12;

/// Relative padding of the far distance, which covers the roundings of 1/d on two axes.
const PAD_FAR: f32 = 1.0 + 10.0 * (f32::EPSILON / 2.0);

/// What happens at the leaves.
pub trait Leaves {
    /// Whether any leaf may end the traversal: then children are visited in their order in the node, which is made for that, and
    /// `t_max` never changes. Otherwise about nearest first.
    const ANY: bool;
    /// Tests a leaf (`rest` is its child word without [`LEAF`]); `true` ends the traversal.
    fn visit<L: Lanes>(&mut self, rest: u32) -> bool;
    /// Boxes beyond this are of no interest.
    fn t_max(&self) -> f32;
    /// Where the leaf's data begins.
    fn address(&self, rest: u32) -> *const u8;
}

/// 1/d, per axis, and o/d widened to both sides.
struct Slabs<L> {
    inverse: [L; 3],
    near: [L; 3],
    far: [L; 3],
    /// Which of a node's six planes the ray meets first on each axis; the other is this ^ 1.
    first: [usize; 3],
}

impl<L: Lanes> Slabs<L> {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let mut slabs = Self {
            inverse: [L::splat(0.0); 3],
            near: [L::splat(0.0); 3],
            far: [L::splat(0.0); 3],
            first: [0; 3],
        };
        for axis in 0..3 {
            let d = direction[axis];
            let parallel = d.abs() < MIN_DIRECTION;
            let inverse = 1.0 / if parallel { MIN_DIRECTION.copysign(d) } else { d };
            let distance = origin[axis] * inverse;
            let pad = distance.abs() * PAD + if parallel { PAD_PARALLEL } else { 0.0 };
            slabs.inverse[axis] = L::splat(inverse);
            slabs.near[axis] = L::splat(distance + pad);
            slabs.far[axis] = L::splat(distance - pad);
            slabs.first[axis] = 2 * axis + (inverse < 0.0) as usize;
        }
        slabs
    }

    /// The children that the ray meets before `t_max`, as bits, and where it enters each.
    #[inline(always)]
    fn enter(&self, node: &Node, t_min: f32, t_max: f32) -> (u32, L) {
        // SAFETY: `first` is below 6 by construction, and so is first ^ 1.
        let plane = |i: usize| L::load(unsafe { node.bounds.get_unchecked(i) });
        let near = |axis: usize| plane(self.first[axis]).mul_sub(self.inverse[axis], self.near[axis]);
        let far = |axis: usize| plane(self.first[axis] ^ 1).mul_sub(self.inverse[axis], self.far[axis]);
        let enter = near(0).max(near(1)).max(near(2).max(L::splat(t_min)));
        let leave = far(0).min(far(1)).min(far(2).min(L::splat(t_max)));
        (L::bits(enter.le(leave.mul(L::splat(PAD_FAR)))), enter)
    }
}

/// Distance above, child below: sorts by distance, since non-negative floats sort as their bits do.
#[inline(always)]
fn entry(distance: f32, child: u32) -> u64 {
    (distance.to_bits() as u64) << 32 | child as u64
}

/// Puts the farther entry first.
#[inline(always)]
fn order(far: &mut u64, near: &mut u64) {
    (*far, *near) = ((*far).max(*near), (*far).min(*near));
}

/// Visits every leaf of `nodes` whose box the ray meets within (`ray.t_min`, `leaves.t_max()`), about nearest first.
/// `true` where `leaves` ended it.
///
/// # Safety
/// `nodes` comes from [`collapse`](super::wide::collapse): child words point into it, and it is no deeper than [`MAX_DEPTH`].
#[inline(always)]
pub unsafe fn traverse<L: Lanes, K: Leaves>(nodes: &[Node], ray: &Ray, leaves: &mut K) -> bool {
    if nodes.is_empty() {
        return false;
    }
    let slabs = Slabs::<L>::new(ray);
    let mut stack = [const { MaybeUninit::<u64>::uninit() }; STACK];
    let mut height = 0;
    // SAFETY: by the bound on the depth `height` stays below STACK, and what is popped was pushed.
    macro_rules! push {
        ($entry:expr) => {{
            debug_assert!(height < STACK);
            unsafe { stack.get_unchecked_mut(height) }.write($entry);
            height += 1;
        }};
    }
    let mut current = 0;
    loop {
        while current & LEAF == 0 {
            debug_assert!((current as usize) < nodes.len());
            // SAFETY: child words without LEAF are indices of nodes.
            let node = unsafe { nodes.get_unchecked(current as usize) };
            let (mut lanes, enter) = slabs.enter(node, ray.t_min, leaves.t_max());
            if lanes == 0 {
                break;
            }
            if K::ANY {
                // From the last to the first, which is next.
                loop {
                    let lane = lanes.ilog2() as usize & (WIDTH - 1);
                    lanes &= !(1 << lane);
                    current = node.child[lane];
                    prefetch::<L>(nodes, current, leaves);
                    if lanes == 0 {
                        break;
                    }
                    push!(current as u64);
                }
                continue;
            }
            let enter = enter.to_array();
            macro_rules! next {
                () => {{
                    let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
                    lanes &= lanes - 1;
                    let child = node.child[lane];
                    prefetch::<L>(nodes, child, leaves);
                    (entry(enter[lane], child), lanes != 0)
                }};
            }
            let (mut a, more) = next!();
            if !more {
                current = a as u32;
                continue;
            }
            let (mut b, more) = next!();
            order(&mut a, &mut b);
            if !more {
                push!(a);
                current = b as u32;
                continue;
            }
            let (mut c, more) = next!();
            if !more {
                order(&mut b, &mut c);
                order(&mut a, &mut b);
                push!(a);
                push!(b);
                current = c as u32;
                continue;
            }
            let (mut d, mut more) = next!();
            order(&mut c, &mut d);
            order(&mut a, &mut c);
            order(&mut b, &mut d);
            order(&mut b, &mut c);
            let base = height;
            push!(a);
            push!(b);
            push!(c);
            push!(d);
            while more {
                let e;
                (e, more) = next!();
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
        }
        if current & LEAF != 0 && leaves.visit::<L>(current & !LEAF) {
            return true;
        }
        loop {
            if height == 0 {
                return false;
            }
            height -= 1;
            // SAFETY: pushed above.
            let top = unsafe { stack.get_unchecked(height).assume_init() };
            if K::ANY || f32::from_bits((top >> 32) as u32) <= leaves.t_max() {
                current = top as u32;
                break;
            }
        }
    }
}

/// All four lines of a node, or of a leaf's beginning: the largest single gain on scenes that exceed the cache.
#[inline(always)]
fn prefetch<L: Lanes>(nodes: &[Node], child: u32, leaves: &impl Leaves) {
    let address = match child & LEAF {
        0 => nodes.as_ptr().wrapping_add(child as usize).cast(),
        _ => leaves.address(child & !LEAF),
    };
    for line in 0..4 {
        L::prefetch(address.wrapping_add(64 * line));
    }
}
