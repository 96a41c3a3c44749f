//! What a document does that the specification forbids.
//!
//! A fault is often made once and repeated a thousand times, so findings are gathered by rule: the first [`LISTED`] of
//! each are told one by one, the rest as a number. What the import reports of the same place is not told twice.

use crate::import::gltf::report::Problem;

/// Findings of one rule that are told one by one.
const LISTED: usize = 8;

/// Findings by rule, in the order in which the rules were first broken.
#[derive(Clone, Default)]
pub struct Findings(Vec<Broken>);

#[derive(Clone)]
struct Broken {
    rule: &'static str,
    first: Vec<Problem>,
    more: usize,
}

impl Findings {
    /// `rule` is broken at `pointer`; `message` says by what.
    pub fn add(&mut self, rule: &'static str, pointer: impl Into<String>, message: impl Into<String>) {
        self.add_all(rule, [Problem::new(pointer, message)]);
    }

    pub fn add_all(&mut self, rule: &'static str, problems: impl IntoIterator<Item = Problem>) {
        for problem in problems {
            let position = self.0.iter().position(|broken| broken.rule == rule).unwrap_or_else(|| {
                self.0.push(Broken { rule, first: Vec::new(), more: 0 });
                self.0.len() - 1
            });
            let Some(broken) = self.0.get_mut(position) else { continue };
            match broken.first.len() < LISTED {
                true => broken.first.push(problem),
                false => broken.more += 1,
            }
        }
    }

    /// All that is not `told` already at its pointer.
    pub fn problems(self, told: impl Fn(&str) -> bool) -> impl Iterator<Item = Problem> {
        self.0.into_iter().flat_map(move |mut broken| {
            broken.first.retain(|problem| !told(&problem.pointer));
            if broken.more > 0
                && let Some(last) = broken.first.last_mut()
            {
                last.message += &format!(" ({} more: {})", broken.more, broken.rule);
            }
            broken.first
        })
    }
}
