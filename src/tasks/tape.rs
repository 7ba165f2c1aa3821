//! What writes the ticks to the tape, behind each of them.

use atomic_refcell::AtomicRefCell;
use core::future::poll_fn;
use core::task::{Poll, Waker};

use super::exchange::Exchange;
use crate::tick::{Input, Output};

/// What the latest tick was given and gave: the tick fills it, and [`tape()`] takes it down
/// before the next one. Both run on one executor, so that neither finds it in use.
#[derive(Default)]
pub struct Latest(pub(super) AtomicRefCell<Turn>);

/// A tick's input and output.
#[derive(Default)]
pub(super) struct Turn {
    pub(super) input: Input,
    pub(super) output: Output,
    /// Not yet on the tape.
    pub(super) fresh: bool,
}

/// Takes every tick down for the log. It is woken with the tick and runs right behind it,
/// so that the tick itself takes as long with a log as without, and its bridges, its
/// watchdog and its successor do not wait for the copying.
pub async fn tape(latest: &Latest, exchange: &Exchange) -> ! {
    let mut known: Option<Waker> = None;
    poll_fn(|context| {
        if !known.as_ref().is_some_and(|waker| waker.will_wake(context.waker())) {
            exchange.pulse.follow_tick(context.waker());
            known = Some(context.waker().clone());
        }
        if let Ok(mut turn) = latest.0.try_borrow_mut()
            && turn.fresh
        {
            turn.fresh = false;
            exchange.tape.keep(&turn.input, &turn.output);
        }
        Poll::Pending
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::pin::pin;
    use core::task::Context;

    #[test]
    fn every_tick_is_taken_down_once() {
        let (latest, exchange) = (Latest::default(), Exchange::new());
        let mut task = pin!(tape(&latest, &exchange));
        let mut context = Context::from_waker(Waker::noop());
        let mut kept = || {
            assert!(task.as_mut().poll(&mut context).is_pending());
            exchange.tape.unread()
        };
        assert_eq!(kept(), 0, "before the first tick");
        for tick in 1..4 {
            {
                let mut turn = latest.0.borrow_mut();
                turn.input.now = tick;
                turn.output.telemetry.at = tick;
                turn.fresh = true;
            }
            assert_eq!((kept(), kept()), (tick, tick));
        }
        let held = latest.0.borrow_mut();
        assert_eq!(kept(), 3, "in use: left alone");
        drop(held);
        let rows: Vec<_> = core::iter::from_fn(|| exchange.tape.take()).collect();
        assert_eq!(rows.iter().map(|row| row.at()).collect::<Vec<_>>(), [1, 2, 3]);
    }
}
