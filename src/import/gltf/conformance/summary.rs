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
        ComponentType::I8 => by_length(accessor, measure, i8::from_le_bytes),
        ComponentType::U8 => by_length(accessor, measure, u8::from_le_bytes),
        ComponentType::I16 => by_length(accessor, measure, i16::from_le_bytes),
        ComponentType::U16 => by_length(accessor, measure, u16::from_le_bytes),
        ComponentType::U32 => by_length(accessor, measure, u32::from_le_bytes),
        ComponentType::F32 => by_length(accessor, measure, f32::from_le_bytes),
    }
}

fn by_length<const B: usize, T: Into<f64>>(
    accessor: &Accessor,
    measure: Measure,
    read: impl Fn([u8; B]) -> T + Copy + Sync,
) -> Option<Summary> {
    match accessor.components {
        1 => Some(scan::<1, B, T>(accessor, measure, read)),
        2 => Some(scan::<2, B, T>(accessor, measure, read)),
        3 => Some(scan::<3, B, T>(accessor, measure, read)),
        4 => Some(scan::<4, B, T>(accessor, measure, read)),
        9 if B == 4 => Some(scan::<9, B, T>(accessor, measure, read)),
        16 => Some(scan::<16, B, T>(accessor, measure, read)),
        _ => None,
    }
}

fn scan<const N: usize, const B: usize, T: Into<f64>>(
    accessor: &Accessor,
    measure: Measure,
    read: impl Fn([u8; B]) -> T + Copy + Sync,
) -> Summary {
    let plain = accessor.plain();
    let element = |i: usize| {
        let bytes = match plain {
            Some((bytes, stride)) => bytes.get(i * stride..)?.get(..N * B)?,
            None => accessor.element(i)?.get(..N * B)?,
        };
        let mut values = [0.0; N];
        for (value, component) in values.iter_mut().zip(bytes.as_chunks::<B>().0) {
            *value = read(*component).into();
        }
        Some(values)
    };
    let block = |block: usize| {
        let mut found = Found::<N>::NONE;
        let start = block * BLOCK;
        let mut before = start.checked_sub(1).and_then(element);
        for i in start..(start + BLOCK).min(accessor.count) {
            let Some(values) = element(i) else { continue };
            let mut is_finite = true;
            for (c, &value) in values.iter().enumerate() {
                is_finite &= value.is_finite();
                found.low[c] = if value < found.low[c] { value } else { found.low[c] };
                found.high[c] = if value > found.high[c] { value } else { found.high[c] };
            }
            if !is_finite {
                found.not_finite.add(i);
                continue;
            }
            match measure {
                Measure::Bounds => {}
                Measure::Unit { of, tolerance, scale, signed, from, step } => {
                    let length = values.iter().take(of).map(|v| v * scale * v * scale).sum::<f64>().sqrt();
                    let sign = values.get(of).map_or(1.0, |w| (w * scale).max(-1.0).abs());
                    let is_amiss = (length - 1.0).abs() > tolerance || (signed && (sign - 1.0).abs() > 1e-9);
                    if is_amiss && i % step == from {
                        found.amiss.add(i);
                    }
                }
                Measure::Rising => {
                    if before.is_some_and(|before| values[0] <= before[0]) {
                        found.amiss.add(i);
                    }
                    before = Some(values);
                }
            }
        }
        found
    };
    let blocks = accessor.count.div_ceil(BLOCK);
    let found = (0..blocks).into_par_iter().map(block).reduce(|| Found::NONE, Found::and);
    Summary {
        low: found.low.to_vec(),
        high: found.high.to_vec(),
        not_finite: found.not_finite,
        amiss: found.amiss,
    }
}

#[derive(Clone, Copy)]
struct Found<const N: usize> {
    low: [f64; N],
    high: [f64; N],
    not_finite: Hits,
    amiss: Hits,
}

impl<const N: usize> Found<N> {
    const NONE: Self = Self {
        low: [f64::INFINITY; N],
        high: [f64::NEG_INFINITY; N],
        not_finite: Hits::NONE,
        amiss: Hits::NONE,
    };

    fn and(self, other: Self) -> Self {
        Self {
            low: std::array::from_fn(|c| self.low[c].min(other.low[c])),
            high: std::array::from_fn(|c| self.high[c].max(other.high[c])),
            not_finite: self.not_finite.and(other.not_finite),
            amiss: self.amiss.and(other.amiss),
        }
    }
}
