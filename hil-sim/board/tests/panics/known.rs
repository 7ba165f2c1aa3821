//! Why a panic that the machine code has is never taken. What is not in here is not known
//! to be harmless.
//!
//! The control tick's own code has none left: what is here is made by the compiler for
//! every `async` function, or is in the libraries under the tasks.

use super::names::Frame;

use super::Site;

type Reason = &'static str;

/// What a site looks like, and why it is never taken.
struct Known {
    /// Part of the name of the function that contains it, or of one that this was inlined
    /// into; the more inner ones are looked at first.
    function: &'static str,
    /// Beginning of the path of its file, empty for any.
    file: &'static str,
    /// Part of the name of what is called, empty for anything.
    calls: &'static str,
    reason: Reason,
}

const fn known(
    function: &'static str,
    file: &'static str,
    calls: &'static str,
    reason: Reason,
) -> Known {
    Known { function, file, calls, reason }
}

const BORROWED: Reason = "the cell is in a mutex that masks interrupts, on one core, and \
                          what is done with it there does not come back to it";
const RESUMED: Reason = "made by the compiler for an `async` function that is polled after its \
                         end: the functions that wait for it poll it up to its end, and the \
                         tasks have none";
const RING: Reason = "the ring's length is a constant other than 0, the channel's number that \
                      of its own interrupt, and one code is requested, with room for it";
const WAKER: Reason = "every waker that the tasks meet is one of their executors': nothing else \
                       polls them";
const DRIVER: Reason = "the time driver's queue is borrowed in a critical section alone";
const WAKES: Reason = "through a waker's table: the executors' `wake`, `clone` and `drop`, which \
                       put a task in line, copy a pointer, or do nothing";

/// What a branch into the machinery of panics may be. Those without a message are one
/// function in the image, so that the place identifies it.
const PANICS: [Known; 10] = [
    known("embassy_sync::", "embassy-sync-", "", BORROWED),
    known("interstage::tasks::exchange::Exchange::sensors", "", "borrowed", BORROWED),
    // Several of the channels' places put together by the compiler, which then has no line
    // for them. Nothing of this project panics through the logger.
    known("interstage::tasks::motors::motors::{{closure}}", "", "defmt_default_panic", BORROWED),
    known("RtcDriver", "embassy-stm32-", "panic_already_borrowed", DRIVER),
    known("task_from_waker", "embassy-executor-", "defmt_default_panic", WAKER),
    known("embassy_stm32::dma::", "embassy-stm32-", "", RING),
    known("RingBufferedAdc<T>::read_latest", "embassy-stm32-", "panic_bounds_check", RING),
    known("::{{closure}}", "src/tasks/", "panic_already_borrowed", RESUMED),
    known("::{{closure}}", "src/board/", "panic_already_borrowed", RESUMED),
    known("TimeoutFuture", "embassy-time-", "panic_already_borrowed", RESUMED),
];

const INDIRECT: [Known; 2] = [
    known("core::task::wake::Waker", "core/", "", WAKES),
    // The same, inlined: it keeps the waker of who waits and drops the one before.
    known("embassy_sync::signal::Signal", "embassy-sync-", "", WAKES),
];

/// Why this panic is never taken, or what is called through a register does not panic, if that is
/// known.
pub(super) fn judge(site: &Site) -> Option<Reason> {
    let known: &[Known] = if site.calls.is_empty() { &INDIRECT } else { &PANICS };
    let is = |known: &Known, frame: &Frame| {
        frame.function.contains(known.function)
            && frame.file.starts_with(known.file)
            && site.calls.contains(known.calls)
    };
    let of = |frame: &Frame| known.iter().find(|known| is(known, frame)).map(|k| k.reason);
    // What a cell says of its borrowing, and how the logger panics, is judged by who does it.
    let own = |frame: &&Frame| {
        !["core::cell::", "defmt::"].iter().any(|within| frame.function.starts_with(within))
    };
    match site.calls.is_empty() {
        true => site.frames.first().and_then(of),
        false => site.frames.iter().find(own).and_then(of),
    }
}

fn site(calls: &str, frames: &[(&str, &str)]) -> Site {
    let frame = |(function, file): &(&str, &str)| Frame {
        function: (*function).to_owned(),
        file: (*file).to_owned(),
        line: 1,
    };
    Site {
        calls: calls.to_owned(),
        frames: frames.iter().map(frame).collect(),
        path: vec!["f".to_owned()],
    }
}

#[test]
fn what_nobody_has_looked_at_is_not_harmless() {
    let bounds = "core::panicking::panic_bounds_check";
    let own = [("interstage::tick::Controller::step_into", "src/tick.rs")];
    assert_eq!(judge(&site(bounds, &own)), None);
    // An index in a task's own code is no end of its future.
    let task = [("interstage::tasks::motors::motors::{{closure}}", "src/tasks/motors.rs")];
    assert_eq!(judge(&site(bounds, &task)), None);
    assert_eq!(judge(&site("core::cell::panic_already_borrowed", &task)), Some(RESUMED));
    // A cell of our own, borrowed in a task.
    let cell = [
        ("core::cell::RefCell<T>::borrow_mut", "core/src/cell.rs"),
        ("interstage::tasks::exchange::Exchange::record", "src/tasks/exchange.rs"),
        task[0],
    ];
    assert_eq!(judge(&site("core::cell::panic_already_borrowed", &cell)), None);
    assert_eq!(judge(&site(bounds, &[])), None);
    assert_eq!(judge(&site("", &task)), None);
}
