//! How far the picture is: a live bar on a terminal, a few plain lines elsewhere, nothing with `--quiet`.

use std::{
    sync::{
        Arc,
        mpsc::{self, Receiver, RecvTimeoutError, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{
    interrupt::Interrupt,
    terminal::{is_watched, say},
};
use crate::render::{Monitor, Settings};

const BAR_STEPS: u64 = 1000;
/// Leaves room for the words in a terminal of 80 columns.
const BAR_COLUMNS: usize = 8;
const REFRESH: Duration = Duration::from_millis(100);

/// Plain lines: at every tenth of the work, but not more often than this …
const LINES_APART: Duration = Duration::from_secs(2);
/// … and at least so often.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);

/// Shows progress from its own thread until it is dropped.
pub struct Progress {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Progress {
    /// Shows the progress of what `interrupt` monitors; nothing where `quiet`.
    pub fn start(interrupt: &Arc<Interrupt>, settings: &Settings, quiet: bool) -> Self {
        if quiet {
            return Self { stop: None, thread: None };
        }
        let interrupt = interrupt.clone();
        let [_, _, width, height] = settings.window();
        let work = Work {
            start: Instant::now(),
            pixels: u64::from(width) * u64::from(height),
            samples: settings.samples,
            time: settings.time,
        };
        let (stop, stopped) = mpsc::channel();
        let show = if is_watched() { show_bar } else { show_lines };
        let thread = thread::spawn(move || show(&work, interrupt.monitor(), &stopped));
        Self { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Work {
    start: Instant,
    pixels: u64,
    samples: u32,
    time: Option<Duration>,
}

impl Work {
    /// From 0 to 1: of the samples or of the time, whichever ends sooner.
    fn fraction(&self, monitor: &Monitor) -> f64 {
        let of_time = self.time.map_or(0.0, |time| self.start.elapsed().as_secs_f64() / time.as_secs_f64());
        monitor.fraction().max(of_time).min(1.0)
    }

    /// Time left, samples, noise and speed.
    fn describe(&self, monitor: &Monitor) -> String {
        let elapsed = self.start.elapsed().as_secs_f64();
        let fraction = self.fraction(monitor);
        sentence(
            (fraction > 0.001).then(|| elapsed / fraction - elapsed),
            [monitor.samples() as f64 / self.pixels.max(1) as f64, self.samples.into()],
            monitor.noise(),
            monitor.rays() as f64 / elapsed.max(1e-3) / 1e6,
        )
    }
}

/// Begins with what is wanted most, as a narrow terminal cuts off its end.
fn sentence(left: Option<f64>, [done, of]: [f64; 2], noise: Option<f32>, mrays_per_second: f64) -> String {
    let left = left.map_or("time left unknown".into(), |seconds| format!("{} left", duration(seconds)));
    let noise = noise.map_or("–".into(), |noise| format!("{:.1} %", 100.0 * noise));
    format!("{left}, {done:.0}/{of} samples, noise {noise}, {mrays_per_second:.2} Mrays/s")
}

fn goes_on(stopped: &Receiver<()>) -> bool {
    stopped.recv_timeout(REFRESH) == Err(RecvTimeoutError::Timeout)
}

fn show_bar(work: &Work, monitor: &Monitor, stopped: &Receiver<()>) {
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr());
    if let Ok(style) =
        ProgressStyle::with_template(&format!("{{bar:{BAR_COLUMNS}}} {{percent:>3}} % {{wide_msg}}"))
    {
        bar.set_style(style);
    }
    while goes_on(stopped) {
        bar.set_message(work.describe(monitor));
        bar.set_position((work.fraction(monitor) * BAR_STEPS as f64) as u64);
    }
    bar.finish_and_clear();
}

fn show_lines(work: &Work, monitor: &Monitor, stopped: &Receiver<()>) {
    let (mut last, mut next_tenth) = (Instant::now(), 1);
    while goes_on(stopped) {
        let fraction = work.fraction(monitor);
        let tenths = (fraction * 10.0) as u32;
        let due = tenths >= next_tenth && last.elapsed() >= LINES_APART;
        if due || last.elapsed() >= LONGEST_SILENCE {
            say(format!("{:3.0} % {}", 100.0 * fraction, work.describe(monitor)));
            (last, next_tenth) = (Instant::now(), tenths + 1);
        }
    }
}

/// A line that shows that something else is at work, for how long.
pub struct Waiting(Option<ProgressBar>);

impl Waiting {
    pub fn start(what: &str, who: &str, quiet: bool) -> Self {
        let bar = (!quiet && is_watched()).then(|| {
            let bar = ProgressBar::new_spinner().with_message(format!("{what}: {who}"));
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(REFRESH);
            bar
        });
        Self(bar)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

/// Seconds as people read them: 4.2 s, 1 m 05 s, 2 h 03 m.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round().clamp(0.0, 1e15) as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} m {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} m", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_readable() {
        let known =
            [(0.04, "0.0 s"), (4.24, "4.2 s"), (9.7, "10 s"), (65.0, "1 m 05 s"), (7380.0, "2 h 03 m")];
        for (seconds, text) in known {
            assert_eq!(duration(seconds), text);
        }
        assert!(duration(f64::INFINITY).ends_with('m'));
    }

    #[test]
    fn the_line_fits_a_terminal_of_80_columns() {
        let line = sentence(Some(59.0 * 60.0 + 59.0), [4096.0, 4096.0], Some(0.123), 12.34);
        assert_eq!(line, "59 m 59 s left, 4096/4096 samples, noise 12.3 %, 12.34 Mrays/s");
        assert!(BAR_COLUMNS + " 100 % ".len() + line.chars().count() <= 80);
    }

    #[test]
    fn the_line_says_what_is_known() {
        let work =
            Work { start: Instant::now(), pixels: 4, samples: 9, time: Some(Duration::from_secs(3600)) };
        let line = work.describe(&Monitor::default());
        assert!(line.ends_with("0/9 samples, noise –, 0.00 Mrays/s"), "{line}");
        assert!(work.fraction(&Monitor::default()) < 0.01);
    }
}
