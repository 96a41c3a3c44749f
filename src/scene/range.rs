//! Numbers: how they are read, and the ranges they must keep to.

use schemars::Schema;
use toml::de::DeValue;

use super::{
    context::Context,
    read::{Read, Value, kind},
};

/// Lengths and everything else stay below this, so that squares and products of two stay finite in `f32`.
const LARGEST: f64 = 1e18;

/// What is not 0 is not nearer to it than this, for the same reason.
const SMALLEST: f64 = 1e-18;

/// A range that all numbers of a value must be in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    least: f64,
    /// `least` itself is allowed.
    least_in: bool,
    most: f64,
    most_in: bool,
}

/// x > `least`.
pub(super) const fn above(least: f64) -> Limits {
    Limits { least, least_in: false, most: f64::INFINITY, most_in: true }
}

/// x ≥ `least`.
pub(super) const fn from(least: f64) -> Limits {
    Limits { least_in: true, ..above(least) }
}

impl Limits {
    /// … and x < `most`.
    pub const fn below(self, most: f64) -> Self {
        Self { most, most_in: false, ..self }
    }

    /// … and x ≤ `most`.
    pub const fn to(self, most: f64) -> Self {
        Self { most, most_in: true, ..self }
    }

    /// What must hold and does not.
    pub fn broken_by(&self, numbers: &[f64]) -> Option<String> {
        let low = |x: f64| x < self.least || x == self.least && !self.least_in;
        let high = |x: f64| x > self.most || x == self.most && !self.most_in;
        let x = *numbers.iter().find(|x| low(**x) || high(**x))?;
        Some(if low(x) {
            format!(
                "must be {} {}, not {x}",
                if self.least_in { "at least" } else { "greater than" },
                self.least
            )
        } else {
            format!("must be {} {}, not {x}", if self.most_in { "at most" } else { "less than" }, self.most)
        })
    }

    /// Writes the range into the schema of a number.
    pub fn describe(&self, schema: &mut Schema) {
        let number =
            |x: f64| if x.fract() == 0.0 { serde_json::json!(x as i64) } else { serde_json::json!(x) };
        schema.insert(if self.least_in { "minimum" } else { "exclusiveMinimum" }.into(), number(self.least));
        if self.most.is_finite() {
            schema
                .insert(if self.most_in { "maximum" } else { "exclusiveMaximum" }.into(), number(self.most));
        }
    }
}

/// A finite number as it was written, whole or not.
pub(super) fn read_f64(value: &Value, cx: &mut Context) -> Option<f64> {
    let number = match value.get_ref() {
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64)
        }
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => {
            cx.must(value.span(), "a number", kind(value));
            return None;
        }
    };
    match number {
        Some(x) if x.is_nan() => cx.must(value.span(), "a number", "nan"),
        Some(x) if x.is_infinite() => cx.must(value.span(), "finite", "infinite"),
        Some(x) if x.abs() > LARGEST => {
            cx.must(value.span(), &format!("between ±{LARGEST:e}"), &format!("{x:e}"))
        }
        Some(x) if x != 0.0 && x.abs() < SMALLEST => {
            cx.must(value.span(), &format!("0 or beyond ±{SMALLEST:e}"), &format!("{x:e}"))
        }
        Some(x) => return Some(x),
        None => cx.must(value.span(), "a number", "one with too many digits"),
    };
    None
}

fn read_integer(value: &Value, most: u64, cx: &mut Context) -> Option<u64> {
    let integer = match value.get_ref() {
        DeValue::Integer(integer) => integer,
        DeValue::Float(float) => {
            let written: String = float.as_str().chars().take(40).collect();
            cx.must(value.span(), "a whole number", &written);
            return None;
        }
        _ => {
            cx.must(value.span(), "a whole number", kind(value));
            return None;
        }
    };
    match i128::from_str_radix(integer.as_str(), integer.radix()) {
        Ok(i) if i < 0 => cx.must(value.span(), "0 or more", &i.to_string()),
        Ok(i) if i > most.into() => cx.must(value.span(), &format!("at most {most}"), &i.to_string()),
        Ok(i) => return Some(i as u64),
        Err(_) => cx.must(value.span(), &format!("at most {most}"), "a number of so many digits"),
    };
    None
}

impl Read for f32 {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        read_f64(value, cx).map(|x| x as f32)
    }

    fn numbers(&self) -> Vec<f64> {
        vec![f64::from(*self)]
    }
}

impl Read for u32 {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        read_integer(value, u32::MAX.into(), cx).map(|i| i as u32)
    }

    fn numbers(&self) -> Vec<f64> {
        vec![f64::from(*self)]
    }
}

/// As far as TOML's integers go.
impl Read for u64 {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        read_integer(value, i64::MAX as u64, cx)
    }
}

/// The elements of an array of exactly N.
pub(super) fn read_array<T, const N: usize>(
    value: &Value,
    expected: &str,
    cx: &mut Context,
    mut read: impl FnMut(&Value, &mut Context) -> Option<T>,
) -> Option<[T; N]> {
    let items = match value.get_ref() {
        DeValue::Array(items) if items.len() == N => items,
        DeValue::Array(items) => {
            cx.must(value.span(), expected, &format!("{} of them", items.len()));
            return None;
        }
        _ => {
            cx.must(value.span(), expected, kind(value));
            return None;
        }
    };
    // All are read before any failure ends it: each wrong one is reported.
    let read: Vec<Option<T>> = items.iter().map(|item| read(item, cx)).collect();
    read.into_iter().collect::<Option<Vec<T>>>()?.try_into().ok()
}
