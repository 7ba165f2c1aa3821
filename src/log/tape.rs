//! What hands ticks to the journal: a ring that the tick writes and the journal reads.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::Vec;

use super::record::Record;
use crate::model::{Plan, PlanRequest};
use crate::tick::Telemetry;
use crate::tick::{Input, Output};
use crate::units::Tick;

/// Ticks that the tape holds: 16 ms, in which the journal must get the processor. What
/// keeps it longest is the model's task, less than 2 ms.
pub const TAPE: usize = 16;

/// Ticks after which the journal is woken: one frame's worth.
pub const BATCH: u32 = 8;

/// The ring between the tick and the journal. The tick only copies; when the journal is
/// late the oldest are lost, and counted.
pub struct Tape {
    inner: Mutex<CriticalSectionRawMutex, RefCell<Inner>>,
    ready: Signal<CriticalSectionRawMutex, ()>,
}

struct Inner {
    /// A ring once it has filled; filled as it goes, so that an empty tape is all zeros
    /// and takes no room in flash.
    rows: Vec<Record, TAPE>,
    /// Ticks kept and ticks taken since boot; they wrap.
    written: u32,
    read: u32,
    lost: u32,
    now: Tick,
    /// The latest that the tick was given; at most one between two batches.
    plan: Vec<(Tick, Plan), 1>,
    /// The latest that the tick gave.
    request: Vec<(Tick, PlanRequest), 1>,
}

const _: () = assert!(TAPE.is_power_of_two(), "wrapping counters are places in it");

impl Tape {
    /// An empty tape.
    #[must_use]
    pub const fn new() -> Self {
        let inner = Inner {
            rows: Vec::new(),
            written: 0,
            read: 0,
            lost: 0,
            now: 0,
            plan: Vec::new(),
            request: Vec::new(),
        };
        Self { inner: Mutex::new(RefCell::new(inner)), ready: Signal::new() }
    }

    /// Keeps a tick. Cost: the copying of [`Record`], and of plan and request in the few
    /// ticks that have them.
    #[inline(never)]
    pub fn keep(&self, input: &Input, output: &Output) {
        let unread = self.inner.lock(|inner| {
            // Nobody else has it: this is the lock. A panic in the tick would be worse
            // than the tick missing in the log.
            let Ok(mut inner) = inner.try_borrow_mut() else { return 0 };
            let inner = &mut *inner;
            let place = inner.written as usize % TAPE;
            if inner.rows.len() <= place {
                let _ = inner.rows.push(Record::EMPTY);
            }
            if let Some(row) = inner.rows.get_mut(place) {
                row.set(input, output);
            }
            inner.written = inner.written.wrapping_add(1);
            inner.now = input.now;
            if let Some(plan) = input.plan {
                inner.plan.clear();
                let _ = inner.plan.push((input.now, plan));
            }
            if let Some(request) = output.request {
                inner.request.clear();
                let _ = inner.request.push((input.now, request));
            }
            let unread = inner.written.wrapping_sub(inner.read);
            if unread > TAPE as u32 {
                inner.read = inner.read.wrapping_add(1);
                inner.lost = inner.lost.wrapping_add(1);
            }
            unread
        });
        if unread == BATCH {
            self.ready.signal(());
        }
    }

    /// Waits until there is a frame's worth.
    pub async fn ready(&self) {
        self.ready.wait().await;
    }

    /// The oldest tick not yet taken.
    pub fn take(&self) -> Option<Record> {
        let mut record = Record::EMPTY;
        self.take_into(&mut record).then_some(record)
    }

    /// The same into a place; false if there is none.
    pub(super) fn take_into(&self, place: &mut Record) -> bool {
        self.inner.lock(|inner| {
            let inner = &mut *inner.borrow_mut();
            if inner.read == inner.written {
                return false;
            }
            let row = inner.rows.get(inner.read as usize % TAPE);
            inner.read = inner.read.wrapping_add(1);
            row.map(|row| *place = *row).is_some()
        })
    }

    /// The plan that a tick was given, if there is one not yet taken.
    pub fn take_plan(&self) -> Option<(Tick, Plan)> {
        self.inner.lock(|inner| inner.borrow_mut().plan.pop())
    }

    /// The plan that a tick asked for, if there is one not yet taken.
    pub fn take_request(&self) -> Option<(Tick, PlanRequest)> {
        self.inner.lock(|inner| inner.borrow_mut().request.pop())
    }

    /// The latest tick; 0 before the first.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.inner.lock(|inner| inner.borrow().now)
    }

    /// Ticks not yet taken.
    #[must_use]
    pub fn unread(&self) -> u32 {
        self.inner.lock(|inner| {
            let inner = inner.borrow();
            inner.written.wrapping_sub(inner.read)
        })
    }

    /// Ticks lost since boot because the journal came too late; wraps.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.inner.lock(|inner| inner.borrow().lost)
    }

    /// State after the latest tick; none before the first.
    #[must_use]
    pub fn latest(&self) -> Option<Telemetry> {
        self.inner.lock(|inner| {
            let inner = inner.borrow();
            let place = inner.written.wrapping_sub(1) as usize % TAPE;
            inner.rows.get(place).map(|record| record.telemetry)
        })
    }
}

impl Default for Tape {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn keep(tape: &Tape, at: Tick) {
        let mut output = Output::default();
        output.telemetry.at = at;
        tape.keep(&Input { now: at, ..Input::default() }, &output);
    }

    proptest! {
        #[test]
        fn what_is_not_lost_comes_out_in_its_order(
            steps in prop::collection::vec((0..30_u32, 0..30_usize), 1..20),
        ) {
            let tape = Tape::default();
            let (mut written, mut expected, mut lost) = (0, 0, 0);
            for (keeps, takes) in steps {
                for _ in 0..keeps {
                    keep(&tape, written);
                    written += 1;
                }
                let over = (written - expected).saturating_sub(TAPE as u32);
                lost += over;
                expected += over;
                prop_assert_eq!(tape.lost(), lost);
                prop_assert_eq!(tape.unread(), written - expected);
                for _ in 0..takes {
                    let taken = tape.take();
                    let there = expected < written;
                    prop_assert_eq!(taken.map(|row| row.at()), there.then_some(expected));
                    expected += u32::from(there);
                }
                prop_assert_eq!(tape.latest().map(|row| row.at), written.checked_sub(1));
            }
        }
    }
}
