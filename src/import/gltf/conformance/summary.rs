//! What the elements of an accessor have in common, found in one pass over its bytes.
//!
//! Nearly everything that can be wrong with data shows in the least and greatest value of each component. Only lengths of
//! vectors and the order of times are looked at element by element, and only where asked for.

use gltf::json::accessor::ComponentType;
use rayon::prelude::*;

use crate::import::gltf::accessor::Accessor;

/// Elements that one thread looks at before it takes others.
const BLOCK: usize = 1 << 15;

/// How often something happened, and at which element first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hits {
    pub count: usize,
    pub first: usize,
}

impl Hits {
    pub const NONE: Self = Self { count: 0, first: usize::MAX };

    pub fn add(&mut self, element: usize) {
        *self = self.and(Self { count: 1, first: element });
    }

    pub fn and(self, other: Self) -> Self {
        Self { count: self.count + other.count, first: self.first.min(other.first) }
    }
}

/// What is looked at beside the bounds.
#[derive(Clone, Copy, PartialEq)]
pub enum Measure {
    Bounds,
    /// The length of the first `of` components (each times `scale`) is 1 within `tolerance`, and if `signed` the next is 1 or
    /// −1; of the elements `from`, `from + step` and so on.
    Unit {
        of: usize,
        tolerance: f64,
        scale: f64,
        signed: bool,
        from: usize,
        step: usize,
    },
    /// Each element is greater than the one before.
    Rising,
}

#[derive(Clone, Debug)]
pub struct Summary {
    /// Least and greatest finite value of each component, as stored.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    pub not_finite: Hits,
    /// Elements that are not as the [`Measure`] asks.
    pub amiss: Hits,
}

/// Looks at all of `accessor`; `None` where its columns are padded, or it is of no type.
pub fn summary(accessor: &Accessor, measure: Measure) -> Option<Summary> {
    match accessor.component {
        ComponentType::I8 => {
            by_length(accessor, measure, &Kind::whole(i8::from_le_bytes, [i8::MIN, i8::MAX]))
        }
        ComponentType::U8 => {
            by_length(accessor, measure, &Kind::whole(u8::from_le_bytes, [u8::MIN, u8::MAX]))
        }
        ComponentType::I16 => {
            by_length(accessor, measure, &Kind::whole(i16::from_le_bytes, [i16::MIN, i16::MAX]))
        }
        ComponentType::U16 => {
            by_length(accessor, measure, &Kind::whole(u16::from_le_bytes, [u16::MIN, u16::MAX]))
        }
        ComponentType::U32 => {
            by_length(accessor, measure, &Kind::whole(u32::from_le_bytes, [u32::MIN, u32::MAX]))
        }
        ComponentType::F32 => {
            let ends = [f32::NEG_INFINITY, f32::INFINITY];
            by_length(accessor, measure, &Kind { read: f32::from_le_bytes, is_finite: f32::is_finite, ends })
        }
    }
}

/// How components are read. Functions as types, not pointers, so that loops over data are compiled for each.
struct Kind<T, R, F> {
    read: R,
    is_finite: F,
    /// The least and the greatest value.
    ends: [T; 2],
}

impl<T, R> Kind<T, R, fn(T) -> bool> {
    fn whole(read: R, ends: [T; 2]) -> Kind<T, R, impl Fn(T) -> bool + Sync> {
        Kind { read, is_finite: |_| true, ends }
    }
}

impl<T: Copy, R, F> Kind<T, R, F> {
    /// One element. (`map` of arrays is not inlined, and ten times slower.)
    #[inline]
    fn values<const N: usize, const B: usize>(&self, components: &[[u8; B]; N]) -> [T; N]
    where
        R: Fn([u8; B]) -> T,
    {
        let mut values = [self.ends[0]; N];
        for (value, component) in values.iter_mut().zip(components) {
            *value = (self.read)(*component);
        }
        values
    }
}

fn by_length<const B: usize, T, R, F>(
    accessor: &Accessor,
    measure: Measure,
    kind: &Kind<T, R, F>,
) -> Option<Summary>
where
    T: Into<f64> + PartialOrd + Copy + Send + Sync,
    R: Fn([u8; B]) -> T + Sync,
    F: Fn(T) -> bool + Sync,
{
    match accessor.components {
        1 => Some(scan::<1, B, T, R, F>(accessor, measure, kind)),
        2 => Some(scan::<2, B, T, R, F>(accessor, measure, kind)),
        3 => Some(scan::<3, B, T, R, F>(accessor, measure, kind)),
        4 => Some(scan::<4, B, T, R, F>(accessor, measure, kind)),
        9 if B == 4 => Some(scan::<9, B, T, R, F>(accessor, measure, kind)),
        16 => Some(scan::<16, B, T, R, F>(accessor, measure, kind)),
        _ => None,
    }
}

fn scan<const N: usize, const B: usize, T, R, F>(
    accessor: &Accessor,
    measure: Measure,
    kind: &Kind<T, R, F>,
) -> Summary
where
    T: Into<f64> + PartialOrd + Copy + Send + Sync,
    R: Fn([u8; B]) -> T + Sync,
    F: Fn(T) -> bool + Sync,
{
    let nothing =
        Found { low: [kind.ends[1]; N], high: [kind.ends[0]; N], not_finite: Hits::NONE, amiss: Hits::NONE };
    let plain = accessor.plain();
    let values = |bytes: &[u8]| {
        let components: &[[u8; B]; N] = bytes.as_chunks().0.first_chunk()?;
        Some(kind.values(components))
    };
    let block = |block: usize| {
        let mut found = nothing;
        let range = block * BLOCK..accessor.count.min((block + 1) * BLOCK);
        let mut before = range.start.checked_sub(1).and_then(|i| values(accessor.element(i)?));
        let mut look = |i: usize, values: [T; N]| {
            if !values.iter().all(|&value| (kind.is_finite)(value)) {
                return found.not_finite.add(i);
            }
            for ((low, high), &value) in found.low.iter_mut().zip(&mut found.high).zip(&values) {
                *low = if value < *low { value } else { *low };
                *high = if value > *high { value } else { *high };
            }
            if measure != Measure::Bounds {
                if measure.is_amiss(i, values, before) {
                    found.amiss.add(i);
                }
                before = Some(values);
            }
        };
        match plain {
            // Without gaps, as most data is.
            Some((bytes, stride)) if stride == N * B => {
                let end = (range.end * stride).min(bytes.len());
                let bytes = bytes.get(range.start * stride..end).unwrap_or(&[]);
                if measure == Measure::Bounds
                    && let Some([low, high]) = bounds(bytes.as_chunks().0, kind)
                {
                    return Found { low, high, ..nothing };
                }
                let elements = bytes.as_chunks::<B>().0.as_chunks::<N>().0;
                for (i, components) in range.zip(elements) {
                    look(i, kind.values(components));
                }
            }
            _ => {
                for i in range {
                    if let Some(values) = accessor.element(i).and_then(values) {
                        look(i, values);
                    }
                }
            }
        }
        found
    };
    let blocks = accessor.count.div_ceil(BLOCK);
    let found = (0..blocks).into_par_iter().map(block).reduce(|| nothing, Found::and);
    let is_empty = |c: usize| found.low[c] > found.high[c];
    let side = |values: [T; N], none: f64| -> Vec<f64> {
        (0..N).map(|c| if is_empty(c) { none } else { values[c].into() }).collect()
    };
    Summary {
        low: side(found.low, f64::INFINITY),
        high: side(found.high, f64::NEG_INFINITY),
        not_finite: found.not_finite,
        amiss: found.amiss,
    }
}

/// Components that are looked at side by side: the least common multiple of 1, 2, 3, 4 and 8, for vector instructions.
const LANES: usize = 24;

/// The least and greatest of each component of elements without gaps, as fast as memory; `None` if any is not finite.
fn bounds<const N: usize, const B: usize, T, R, F>(
    components: &[[u8; B]],
    kind: &Kind<T, R, F>,
) -> Option<[[T; N]; 2]>
where
    T: PartialOrd + Copy,
    R: Fn([u8; B]) -> T,
    F: Fn(T) -> bool,
{
    if !LANES.is_multiple_of(N) {
        return None;
    }
    let (mut lows, mut highs) = ([kind.ends[1]; LANES], [kind.ends[0]; LANES]);
    let mut amiss = [0u32; LANES];
    let mut look = |group: &[[u8; B]]| {
        for (lane, component) in group.iter().enumerate().take(LANES) {
            let value = (kind.read)(*component);
            lows[lane] = if value < lows[lane] { value } else { lows[lane] };
            highs[lane] = if value > highs[lane] { value } else { highs[lane] };
            amiss[lane] |= u32::from(!(kind.is_finite)(value));
        }
    };
    let (groups, rest) = components.as_chunks::<LANES>();
    groups.iter().for_each(|group| look(group));
    look(rest);
    let (mut low, mut high) = ([kind.ends[1]; N], [kind.ends[0]; N]);
    for lane in 0..LANES {
        let c = lane % N;
        low[c] = if lows[lane] < low[c] { lows[lane] } else { low[c] };
        high[c] = if highs[lane] > high[c] { highs[lane] } else { high[c] };
    }
    amiss.iter().all(|&amiss| amiss == 0).then_some([low, high])
}

impl Measure {
    fn is_amiss<const N: usize, T: Into<f64> + PartialOrd + Copy>(
        self,
        i: usize,
        values: [T; N],
        before: Option<[T; N]>,
    ) -> bool {
        match self {
            Self::Bounds => false,
            Self::Unit { of, tolerance, scale, signed, from, step } => {
                let scaled = |value: &T| (*value).into() * scale;
                let squared: f64 = values.iter().take(of).map(|v| scaled(v) * scaled(v)).sum();
                let [least, most] = [1.0 - tolerance, 1.0 + tolerance];
                let is_unit = (least * least..=most * most).contains(&squared);
                let has_sign = |w: &T| (scaled(w).max(-1.0).abs() - 1.0).abs() < 1e-9;
                let is_signed = !signed || values.get(of).is_some_and(has_sign);
                !(is_unit && is_signed) && (step == 1 || i % step == from)
            }
            Self::Rising => before.is_some_and(|before| values.first() <= before.first()),
        }
    }
}

#[derive(Clone, Copy)]
struct Found<T, const N: usize> {
    low: [T; N],
    high: [T; N],
    not_finite: Hits,
    amiss: Hits,
}

impl<T: PartialOrd + Copy, const N: usize> Found<T, N> {
    fn and(self, other: Self) -> Self {
        let less = |(a, b): (T, T)| if b < a { b } else { a };
        let more = |(a, b): (T, T)| if b > a { b } else { a };
        Self {
            low: std::array::from_fn(|c| less((self.low[c], other.low[c]))),
            high: std::array::from_fn(|c| more((self.high[c], other.high[c]))),
            not_finite: self.not_finite.and(other.not_finite),
            amiss: self.amiss.and(other.amiss),
        }
    }
}
