//! The last line of defence: a panic is a bug of ours, said in one message, with exit code 1.
//!
//! The hook keeps the report instead of printing it, since some panics are caught and dealt with further down (a decoder
//! that fails on a broken file).

use std::{
    backtrace::{Backtrace, BacktraceStatus},
    panic,
    process::ExitCode,
    sync::{Mutex, PoisonError},
};

use super::terminal::say;

static REPORT: Mutex<String> = Mutex::new(String::new());

/// From here on panics are kept for [`caught`] instead of printed.
pub fn keep_reports() {
    panic::set_hook(Box::new(|panic| {
        let backtrace = Backtrace::capture();
        let mut report = panic.to_string();
        if backtrace.status() == BacktraceStatus::Captured {
            report += &format!("\n{backtrace}");
        }
        *REPORT.lock().unwrap_or_else(PoisonError::into_inner) = report;
    }));
}

/// Runs `work`; a panic in it, on any thread that it waits for, becomes a message.
pub fn caught(work: impl FnOnce() -> ExitCode) -> ExitCode {
    // What `work` leaves half done is not looked at again.
    panic::catch_unwind(panic::AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let report = REPORT.lock().unwrap_or_else(PoisonError::into_inner);
        say(format!("error: {report}"));
        say(format!("This is a bug in rayo {}, not in your files.", env!("CARGO_PKG_VERSION")));
        say("Please report it, with the lines above and, if you can, the input.");
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        integrator::RayCounts,
        render::{Monitor, Settings, render_samples},
    };

    #[test]
    fn a_panic_in_a_worker_is_a_failure_and_no_abort() {
        let sample = |_, _, _, _: &mut RayCounts| panic!("on purpose");
        let settings = Settings { size: [64, 64], ..Settings::default() };
        let code = caught(|| {
            let _ = render_samples(&sample, &settings, &Monitor::default());
            ExitCode::SUCCESS
        });
        assert_eq!(code, ExitCode::FAILURE);
    }
}
