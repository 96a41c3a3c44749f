//! Ctrl-C: once to finish early and keep the picture, twice to stop at once.
//!
//! Before rendering there is nothing to keep, and the first press stops. A file is never cut off: the press waits for
//! the moment that it takes to put the finished bytes in place.

use std::{
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
};

use super::terminal::say;
use crate::render::Monitor;

#[derive(Debug, Default)]
pub struct Interrupt {
    monitor: Monitor,
    rendering: AtomicBool,
    writing: Mutex<()>,
}

impl Interrupt {
    /// Handles Ctrl-C of this process from now on.
    pub fn install() -> Arc<Self> {
        let interrupt = Arc::new(Self::default());
        let handled = interrupt.clone();
        // Where there can be no handler (one is there already), Ctrl-C does what it always did.
        let _ = ctrlc::set_handler(move || handled.pressed());
        interrupt
    }

    pub fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// From here on there is a picture to keep.
    pub fn rendering_starts(&self) {
        self.rendering.store(true, SeqCst);
    }

    /// Runs `write`, which no press interrupts.
    pub fn uninterrupted<T>(&self, write: impl FnOnce() -> T) -> T {
        let _guard = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        write()
    }

    fn pressed(&self) {
        if self.rendering.load(SeqCst) && !self.monitor.is_cancelled() {
            self.monitor.cancel();
            say("\ninterrupted: writing what there is (Ctrl-C again stops at once)");
        } else {
            self.uninterrupted(|| {
                say("\nstopped");
                process::exit(1)
            })
        }
    }
}
