//! The logging task.

use super::ROUND;
use super::exchange::{ENTRIES, Exchange, TaskId};
use crate::hal::{Indicator, Journal, Light};
use crate::log::{Entry, Event, LogEncoder};
use embassy_futures::select::{Either, select};
use embassy_time::with_deadline;

/// Writes log entries in their order and every tick as a record of the binary log; shows
/// the light when it changes.
///
/// All encoding is done here, below the control rate. It waits for the tick, which wakes
/// it once a frame's worth of records is there. The scribe comes from outside, so that its
/// three kilobytes are never on the stack.
pub async fn journal(
    mut journal: impl Journal,
    mut light: impl Indicator,
    scribe: &mut LogEncoder,
    exchange: &Exchange,
) -> ! {
    let mut shown = Light::default();
    let mut reported = 0;
    scribe.set_identity(journal.identity());
    scribe.check_by(journal.checker());
    light.show(shown);
    loop {
        exchange.check_in(TaskId::Journal, exchange.uptime());
        if exchange.light() != shown {
            shown = exchange.light();
            light.show(shown);
        }
        let news = select(exchange.entries.receive(), exchange.tape.ready());
        let news = with_deadline(exchange.aside(ROUND), news).await;
        exchange.wake(TaskId::Journal);
        if let Ok(Either::First(entry)) = news {
            write(&mut journal, scribe, &entry);
            // At most a queue full before the next check-in.
            for _ in 1..ENTRIES {
                let Ok(entry) = exchange.entries.try_receive() else { break };
                write(&mut journal, scribe, &entry);
            }
            let lost = exchange.lost_entries();
            if lost != reported {
                // The newest are the ones dropped, so their count stands behind the rest.
                let event = Event::Lost(lost.wrapping_sub(reported));
                write(&mut journal, scribe, &Entry { at: exchange.uptime(), event });
                reported = lost;
            }
        }
        scribe.read(&exchange.tape, &mut |frame| journal.send(frame));
    }
}

/// An entry as a line and as a frame; once in the image, however often it is called.
#[inline(never)]
fn write(journal: &mut impl Journal, scribe: &mut LogEncoder, entry: &Entry) {
    journal.write(entry);
    scribe.entry(entry, &mut |frame| journal.send(frame));
}
