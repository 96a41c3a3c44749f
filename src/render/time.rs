//! Time budgets as people write them: `90s`, `5m`, `1.5h`, `1h30m`.

use std::time::Duration;

/// A year: more is a slip of the hand.
const LONGEST: f64 = 365.0 * 86_400.0;

/// Reads numbers with units, one after the other: `h`, `m`, `s`, `ms`. The error says what is expected.
pub fn parse_time(text: &str) -> Result<Duration, String> {
    let expected = || {
        format!("“{text}” is not a time: write a number and a unit (h, m, s, ms), such as 90s, 5m or 1h30m")
    };
    let mut rest = text.trim();
    let mut seconds = 0.0;
    if rest.is_empty() {
        return Err(expected());
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').ok_or_else(expected)?;
        let (number, tail) = rest.split_at(digits);
        let letters = tail.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(letters);
        let unit = match unit {
            "h" => 3600.0,
            "m" | "min" => 60.0,
            "s" => 1.0,
            "ms" => 1e-3,
            _ => return Err(expected()),
        };
        seconds += number.parse::<f64>().map_err(|_| expected())? * unit;
        rest = tail.trim_start();
    }
    match seconds {
        s if s > LONGEST => Err(format!("“{text}” is more than a year")),
        s if s > 0.0 => Ok(Duration::from_secs_f64(s)),
        _ => Err(format!("“{text}” leaves no time: it must be more than 0")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_people_write() {
        let seconds = [
            ("90s", 90.0),
            ("5m", 300.0),
            ("1.5h", 5400.0),
            ("1h30m", 5400.0),
            ("250ms", 0.25),
            (" 1m 30s ", 90.0),
        ];
        for (text, expected) in seconds {
            assert_eq!(parse_time(text).map(|d| d.as_secs_f64()), Ok(expected), "{text}");
        }
    }

    #[test]
    fn times_that_are_none() {
        for text in ["", "5", "m", "5x", "1..5s", "-5s", "0s", "1e9s", "99999999h", "5m!", "∞s", "."] {
            assert!(parse_time(text).is_err(), "{text}");
        }
    }
}
