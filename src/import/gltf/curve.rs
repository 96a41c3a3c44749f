//! One animated value over time.
//!
//! glTF 2.0, appendix C: step, linear (spherical for rotations, the shorter way) and cubic Hermite splines, whose keys are
//! triples of in-tangent, value and out-tangent, tangents per second.

use glam::{DQuat, DVec4};
use gltf::json::accessor::ComponentType;

use super::accessor::{Accessor, Source};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    Linear,
    Cubic,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Plain,
    /// Four components of a unit quaternion.
    Rotation,
}

pub struct Curve<'a> {
    times: Accessor<'a>,
    values: Accessor<'a>,
    interpolation: Interpolation,
    /// Elements of `values` that belong to one value: 1, or the number of morph targets.
    elements: usize,
}

impl<'a> Curve<'a> {
    /// The error has the key of the sampler that is wrong.
    pub fn new(
        source: &Source<'a>,
        input: usize,
        output: usize,
        interpolation: Interpolation,
    ) -> Result<Self, (&'static str, String)> {
        let times = source.accessor(input).map_err(|problem| ("/input", problem.message))?;
        let values = source.accessor(output).map_err(|problem| ("/output", problem.message))?;
        if times.components != 1 || times.component != ComponentType::F32 {
            return Err(("/input", format!("accessor {input} does not hold scalars of floats")));
        }
        if times.count == 0 {
            return Err(("/input", format!("accessor {input} has no keys")));
        }
        let time = |i| times.floats::<1>(i)[0];
        // A comparison that is false for NaN too.
        let increases = |i: usize| time(i) > time(i - 1);
        if let Some(i) = (1..times.count).find(|&i| !increases(i)) {
            return Err(("/input", format!("key {i} at {} s is not later than the one before", time(i))));
        }
        let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let keys = times.count.saturating_mul(per_key);
        if values.count == 0 || !values.count.is_multiple_of(keys) {
            let message = format!("has {} elements for {} keys", values.count, times.count);
            return Err(("/output", message));
        }
        Ok(Self { times, values, interpolation, elements: values.count / keys })
    }

    /// Numbers that make one value.
    pub fn width(&self) -> usize {
        self.elements * self.values.components
    }

    /// The first and last time, in seconds.
    pub fn range(&self) -> [f32; 2] {
        [self.time(0), self.time(self.times.count - 1)]
    }

    pub fn at(&self, seconds: f32, kind: Kind) -> Vec<f32> {
        let (mut low, mut high) = (0, self.times.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.time(middle) <= seconds { low = middle + 1 } else { high = middle }
        }
        // `low` keys are at or before this time.
        let Some(before) = low.checked_sub(1) else { return self.key(0) };
        if low == self.times.count {
            return self.key(before);
        }
        let span = f64::from(self.time(low)) - f64::from(self.time(before));
        let t = (f64::from(seconds) - f64::from(self.time(before))) / span;
        match (self.interpolation, kind) {
            (Interpolation::Step, _) => self.key(before),
            (Interpolation::Linear, Kind::Plain) => {
                let pairs = self.key(before).into_iter().zip(self.key(low));
                pairs.map(|(a, b)| (f64::from(a) + t * (f64::from(b) - f64::from(a))) as f32).collect()
            }
            (Interpolation::Linear, Kind::Rotation) => {
                rotation(quaternion(&self.key(before)).slerp(quaternion(&self.key(low)), t))
            }
            (Interpolation::Cubic, kind) => {
                let spline = self.spline(before, t, span);
                match kind {
                    Kind::Plain => spline,
                    Kind::Rotation => rotation(quaternion(&spline)),
                }
            }
        }
    }

    /// Between the keys `k` and `k + 1`, which are `span` seconds apart.
    fn spline(&self, k: usize, t: f64, span: f64) -> Vec<f32> {
        let (t2, t3) = (t * t, t * t * t);
        let (from, to) = (self.part(3 * k + 1), self.part(3 * (k + 1) + 1));
        let (leaving, arriving) = (self.part(3 * k + 2), self.part(3 * (k + 1)));
        let blend = |i: usize| {
            let [from, to, leaving, arriving] =
                [&from, &to, &leaving, &arriving].map(|p| p.get(i).copied().map_or(0.0, f64::from));
            (2.0 * t3 - 3.0 * t2 + 1.0) * from
                + span * (t3 - 2.0 * t2 + t) * leaving
                + (3.0 * t2 - 2.0 * t3) * to
                + span * (t3 - t2) * arriving
        };
        (0..from.len()).map(|i| blend(i) as f32).collect()
    }

    fn key(&self, k: usize) -> Vec<f32> {
        self.part(if self.interpolation == Interpolation::Cubic { 3 * k + 1 } else { k })
    }

    /// Value `i` of those that are stored, tangents included.
    fn part(&self, i: usize) -> Vec<f32> {
        let elements = (0..self.elements).map(|e| self.values.floats::<16>(i * self.elements + e));
        elements.flat_map(|element| element.into_iter().take(self.values.components)).collect()
    }

    fn time(&self, i: usize) -> f32 {
        self.times.floats::<1>(i)[0]
    }
}

fn quaternion(values: &[f32]) -> DQuat {
    let part = |i: usize| values.get(i).copied().map_or(0.0, f64::from);
    let v = DVec4::new(part(0), part(1), part(2), part(3));
    DQuat::from_vec4(v.try_normalize().unwrap_or(DVec4::W))
}

fn rotation(q: DQuat) -> Vec<f32> {
    q.normalize().to_array().map(|c| c as f32).to_vec()
}
