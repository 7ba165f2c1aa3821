//! What a log says, as messages for other programs: the same in a file and on the
//! network.

use interstage::restart::Reset;
use interstage::tick::{Entry, Event};
use serde::Serialize;

use crate::export::json;
use crate::live::Topic;
use crate::log::{Item, LedgerLine, Row};
use crate::sil;

/// Levels of a log line, as viewers know them.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;

/// Nanoseconds of a tick.
const TICK_NS: u64 = 1_000_000;

/// The messages of an item; none for what only a reader of frames needs.
pub(crate) fn messages(item: &Item) -> Option<(Topic, Vec<u8>)> {
    match item {
        Item::Tick(record, sensors) => body(Topic::Controller, &Row::of(record, sensors)),
        Item::Ledger(line) => body(Topic::Ledger, &LedgerLine::from(line)),
        Item::Event(entry) => {
            let ns = u64::from(entry.at) * TICK_NS;
            let text = sil::text(&entry.event);
            body(Topic::Log, &json::log_message(ns, level(entry), &text))
        }
        Item::Mark(mark) => body(Topic::Log, &json::log_message(0, WARNING, &mark.to_string())),
        Item::Identity(_) | Item::Plan(..) | Item::Request(..) | Item::CaptureChunk(_) => None,
    }
}

fn body(topic: Topic, message: &impl Serialize) -> Option<(Topic, Vec<u8>)> {
    // Numbers and texts always have a JSON form.
    json::bytes(message).ok().map(|bytes| (topic, bytes))
}

fn level(entry: &Entry) -> u8 {
    match entry.event {
        Event::Fault(_) => ERROR,
        Event::Restart(restart) if restart.reset != Reset::Power => ERROR,
        Event::Limit(_) | Event::Lost(_) | Event::Refused(_) => WARNING,
        _ => INFO,
    }
}
