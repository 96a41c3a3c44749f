//! Durations: a number of seconds, or "90s", "5m", "1h30m".

use std::time::Duration;

use schemars::json_schema;
use toml::de::DeValue;

use super::{
    context::Context,
    range::read_f64,
    read::{Read, Value},
    table::inline_schema,
};

/// A year: nobody waits longer.
const LONGEST: f64 = 365.0 * 86_400.0;

const FORMS: &str = "a number of seconds, or such as \"90s\", \"5m\", \"1h30m\"";

#[derive(Clone, Copy, Debug)]
pub(super) struct Time(pub Duration);

impl Read for Time {
    fn read(value: &Value, cx: &mut Context) -> Option<Self> {
        let seconds = match value.get_ref() {
            DeValue::String(text) => {
                let seconds = parse_seconds(text);
                if seconds.is_none() {
                    cx.must(value.span(), FORMS, &crate::diagnostic::quote(text));
                }
                seconds?
            }
            _ => read_f64(value, cx)?,
        };
        if !(seconds > 0.0 && seconds <= LONGEST) {
            cx.must(value.span(), "longer than 0 and at most a year", &format!("{seconds} s"));
            return None;
        }
        Some(Self(Duration::from_secs_f64(seconds)))
    }
}

/// Reads "1h30m" and its like; a bare number is seconds.
pub fn parse_duration(text: &str) -> Option<Duration> {
    parse_seconds(text).filter(|s| (0.0..=LONGEST).contains(s)).map(Duration::from_secs_f64)
}

fn parse_seconds(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(seconds) = text.parse::<f64>() {
        return seconds.is_finite().then_some(seconds);
    }
    let (mut total, mut rest, mut last_unit) = (0.0, text, f64::INFINITY);
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let (number, tail) = rest.split_at(digits);
        let units = tail.find(|c: char| c.is_ascii_digit() || c == '.').unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(units);
        let unit = match unit.trim() {
            "h" => 3600.0,
            "m" | "min" => 60.0,
            "s" => 1.0,
            _ => return None,
        };
        // From the larger unit to the smaller, each once: anything else is a slip.
        if unit >= last_unit {
            return None;
        }
        total += number.parse::<f64>().ok()? * unit;
        (rest, last_unit) = (tail, unit);
    }
    (total.is_finite() && last_unit.is_finite()).then_some(total)
}

inline_schema! {
    Time, _generator: json_schema!({
        "anyOf": [
            { "type": "number", "exclusiveMinimum": 0, "maximum": LONGEST as u64 },
            { "type": "string", "pattern": "^ *([0-9.]+ *h)? *([0-9.]+ *(m|min))? *([0-9.]+ *s?)? *$" },
        ],
    }),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms() {
        for (text, seconds) in [
            ("90", 90.0),
            ("90s", 90.0),
            ("1.5m", 90.0),
            ("1h30m", 5400.0),
            ("1h 1s", 3601.0),
            (" 2min ", 120.0),
        ] {
            assert_eq!(parse_seconds(text), Some(seconds), "{text}");
        }
        for text in ["", "5x", "m", "1m1h", "1s1s", "..s", "1e400", "nan", "-", "5 m s", "1h30"] {
            assert_eq!(parse_seconds(text), None, "{text}");
        }
        assert_eq!(parse_duration("-5"), None);
    }
}
