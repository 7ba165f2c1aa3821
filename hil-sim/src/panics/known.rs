//! Why a panic that the machine code has is never taken. What is not in here is not known
//! to be harmless.

use super::{Frame, Site};

/// Why.
pub type Reason = &'static str;

/// What a site looks like, and why it is never taken.
struct Known {
    /// Beginning of the name of a function among the frames.
    function: &'static str,
    /// Beginning of the path of that function's file, empty for any.
    file: &'static str,
    reason: Reason,
}

const BORROWED: Reason = "the cell is borrowed in a critical section, which is the lock, and \
                          what is done with it there does not come back to it";

const KNOWN: [Known; 0] = [];

const INDIRECT: [Known; 0] = [];

fn find(known: &[Known], frames: &[Frame]) -> Option<Reason> {
    let of = |known: &Known| {
        frames.iter().any(|frame| {
            frame.function.starts_with(known.function) && frame.file.starts_with(known.file)
        })
    };
    known.iter().find(|known| of(known)).map(|known| known.reason)
}

/// Why this panic is never taken, if that is known.
#[must_use]
pub fn judge(site: &Site) -> Option<Reason> {
    let _ = BORROWED;
    find(&KNOWN, &site.frames)
}

/// The same of a call through a register: why what it calls does not panic.
#[must_use]
pub fn judge_indirect(site: &Site) -> Option<Reason> {
    find(&INDIRECT, &site.frames)
}
