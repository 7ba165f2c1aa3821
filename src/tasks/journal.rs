//! The logging task.

use super::clock::{mid_tick_deadline, uptime};
use super::exchange::{ENTRIES, Exchange};
use super::{ROUND, TaskId};
use crate::hal::{Indicator, Journal, Light};
use crate::log::LogEncoder;
use crate::tick::{Entry, Event};
use embassy_futures::select::{Either, select};
use embassy_time::with_deadline;

/// Writes log entries in their order and every tick as a record of the binary log; shows
/// the light when it changes.
///
/// All encoding is done here, below the control rate. The encoder comes from outside, so
/// that its three kilobytes are never on the stack.
pub async fn journal(
    mut journal: impl Journal,
    mut light: impl Indicator,
    encoder: &mut LogEncoder,
    exchange: &Exchange,
) -> ! {
    let mut shown = Light::default();
    let mut reported = 0;
    encoder.set_identity(journal.identity());
    light.show(shown);
    loop {
        exchange.check_in(TaskId::Journal, uptime());
        if exchange.light() != shown {
            shown = exchange.light();
            light.show(shown);
        }
        let news = select(exchange.entries.receive(), exchange.records.receive());
        let news = with_deadline(mid_tick_deadline(ROUND), news).await;
        exchange.liveness.running(TaskId::Journal);
        match news {
            Ok(Either::First(entry)) => {
                write(&mut journal, encoder, &entry);
                // At most a queue full before the next check-in.
                for _ in 1..ENTRIES {
                    let Ok(entry) = exchange.entries.try_receive() else { break };
                    write(&mut journal, encoder, &entry);
                }
                let lost = exchange.lost_entries();
                if lost != reported {
                    // The newest are the ones dropped, so their count comes behind the rest.
                    let event = Event::Lost(lost.wrapping_sub(reported));
                    write(&mut journal, encoder, &Entry { at: uptime(), event });
                    reported = lost;
                }
            }
            Ok(Either::Second(record)) => {
                let mut send = |frame: &[u8]| journal.send(frame);
                if let Some((at, request)) = exchange.logged_request.try_take() {
                    encoder.request(at, &request, &mut send);
                }
                if let Some((at, plan)) = exchange.logged_plan.try_take() {
                    encoder.plan(at, &plan, &mut send);
                }
                encoder.tick(&record, &mut send);
            }
            Err(_) => {}
        }
    }
}

/// An entry as a line and as a frame; once in the image, however often it is called.
#[inline(never)]
fn write(journal: &mut impl Journal, encoder: &mut LogEncoder, entry: &Entry) {
    journal.write(entry);
    encoder.entry(entry, &mut |frame| journal.send(frame));
}
