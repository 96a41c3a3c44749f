//! What work costs: time of the clock and of the processor, and bytes.

use std::time::Instant;

/// Seconds of this thread on a processor: what else runs on the machine is not in it. (Of the clock, where the system does not tell.)
pub fn of_thread(f: impl FnOnce()) -> f64 {
    let (start, before) = (Instant::now(), processor_seconds(true));
    f();
    match (before, processor_seconds(true)) {
        (Some(before), Some(after)) => after - before,
        _ => start.elapsed().as_secs_f64(),
    }
}

#[cfg(unix)]
fn processor_seconds(of_thread: bool) -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let clock = if of_thread { ClockId::ThreadCPUTime } else { ClockId::ProcessCPUTime };
    let time = clock_gettime(clock);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn processor_seconds(_of_thread: bool) -> Option<f64> {
    None
}

#[derive(Clone, Copy)]
pub struct Spent {
    pub seconds: f64,
    /// Seconds of all threads together; NaN where the system does not tell.
    pub processor: f64,
    /// Bytes of the process: at most, and afterwards, above what there was before. 0 where /proc does not tell.
    pub peak: u64,
    pub kept: u64,
}

impl Spent {
    /// Medians; of the bytes, the most, since memory that the process got earlier is used again.
    pub fn typical(runs: Vec<Self>) -> Self {
        let median = |f: fn(&Self) -> f64| quartiles(runs.iter().map(f).collect())[1];
        let most = |f: fn(&Self) -> u64| runs.iter().map(f).max().unwrap_or(0);
        Self {
            seconds: median(|s| s.seconds),
            processor: median(|s| s.processor),
            peak: most(|s| s.peak),
            kept: most(|s| s.kept),
        }
    }
}

pub fn spent<T>(f: impl FnOnce() -> T) -> (T, Spent) {
    let bytes = |key: &str| {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default();
        1024 * line.trim_matches([':', ' ', '\t', 'k', 'B']).parse().unwrap_or(0u64)
    };
    // Sets the peak back to what is used now (proc(5)).
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let (bytes_before, before) = (bytes("VmRSS"), processor_seconds(false));
    let start = Instant::now();
    let result = f();
    let seconds = start.elapsed().as_secs_f64();
    let processor = processor_seconds(false).zip(before).map_or(f64::NAN, |(after, before)| after - before);
    let above = |now: u64| now.saturating_sub(bytes_before);
    (result, Spent { seconds, processor, peak: above(bytes("VmHWM")), kept: above(bytes("VmRSS")) })
}

/// With the median in the middle.
pub fn quartiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| values[quarter * (values.len() - 1) / 4])
}
