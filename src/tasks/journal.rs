//! The logging task.

use super::exchange::{ENTRIES, Exchange, Station};
use super::{ROUND, uptime};
use crate::hal::{Indicator, Journal, Light};
use crate::log::{Entry, Event};
use embassy_time::with_timeout;

/// Writes log entries in their order and shows the light when it changes.
pub async fn journal(
    mut journal: impl Journal,
    mut light: impl Indicator,
    exchange: &Exchange,
) -> ! {
    let mut shown = Light::default();
    let mut reported = 0;
    light.show(shown);
    loop {
        exchange.check_in(Station::Journal, uptime());
        if exchange.light() != shown {
            shown = exchange.light();
            light.show(shown);
        }
        if let Ok(entry) = with_timeout(ROUND, exchange.entries.receive()).await {
            journal.write(&entry);
            // At most a queue full before the next check-in.
            for _ in 1..ENTRIES {
                let Ok(entry) = exchange.entries.try_receive() else { break };
                journal.write(&entry);
            }
            let lost = exchange.lost_entries();
            if lost != reported {
                // The newest are the ones dropped, so their count stands behind the rest.
                let event = Event::Lost(lost.wrapping_sub(reported));
                journal.write(&Entry { at: uptime(), event });
                reported = lost;
            }
        }
    }
}
