//! The tasks below the control rate: model, operator, host line and journal.

use core::iter;
use core::pin::pin;

use super::ROUND;
use super::clock::{mid_tick_deadline, uptime};
use super::exchange::{ENTRIES, Exchange, replace};
use super::liveness::TaskId;
use crate::hal::{CommandSource, Indicator, Journal, Light, Line};
use crate::log::LogEncoder;
use crate::model::Planner;
use crate::model::tread::TreadState;
use crate::params::link::{FrameReader, ToBoard, ToHost, frame};
use crate::params::service::{Request, Response, Service};
use crate::params::slots::SetMemory;
use crate::tick::{Entry, Event};
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_time::{Duration, Timer, with_deadline};

/// Polling interval of the line: the host writes without an interrupt.
const POLL: Duration = Duration::from_millis(10);

/// Answers the tick's requests for a plan, below the control rate; of several requests meanwhile,
/// the latest counts. `paused` is called in each pause of a plan.
pub async fn model(planner: &Planner, exchange: &Exchange, paused: fn()) -> ! {
    let mut tread = TreadState::default();
    let pause = async || {
        exchange.liveness.check_in(TaskId::Model, uptime());
        paused();
        yield_now().await;
        exchange.liveness.running(TaskId::Model);
    };
    loop {
        exchange.liveness.check_in(TaskId::Model, uptime());
        let request = with_deadline(mid_tick_deadline(ROUND), exchange.request.receive()).await;
        if let Ok(request) = request {
            exchange.liveness.running(TaskId::Model);
            let plan = planner.plan_pausing(&mut tread, &request, pause).await;
            replace(&exchange.answer, plan);
        }
    }
}

/// Passes the commands of one source to the tick, in their order; if four wait already, the
/// source waits.
pub async fn operator(mut source: impl CommandSource, exchange: &Exchange) -> ! {
    let task = exchange.liveness.enrol_operator();
    loop {
        let command = {
            // Kept across check-ins, so that a gesture in progress is not lost.
            let mut next = pin!(source.next());
            loop {
                exchange.liveness.check_in(task, uptime());
                let wait = with_deadline(mid_tick_deadline(ROUND), next.as_mut());
                if let Ok(command) = wait.await {
                    break command;
                }
            }
        };
        exchange.commands.send(command).await;
    }
}

/// Answers the host's requests about parameters and service mode, one after the other. It checks in like an
/// operator's task: a flash that never becomes ready is a hang.
pub async fn link<M: SetMemory>(
    mut line: impl Line,
    mut service: Service<M>,
    exchange: &Exchange,
) -> ! {
    let task = exchange.liveness.enrol_operator();
    let mut reader = FrameReader::new();
    loop {
        exchange.liveness.check_in(task, uptime());
        let mut byte = [0];
        if line.read(&mut byte) == 0 {
            Timer::at(mid_tick_deadline(POLL)).await;
            continue;
        }
        let Some(ToBoard::Parameters(number, request)) = reader.take(byte[0]) else { continue };
        let restarts = request == Request::Restart;
        let response = match request {
            Request::Service(duties) => exchange.serve(duties),
            Request::Reset => exchange.reset(),
            request => service.answer(request, exchange.at_rest()).await,
        };
        let done = response == Response::Done;
        if let Some(frame) = frame(&ToHost::Parameters(number, response)) {
            // A host that does not read asks again.
            let _ = line.write(&frame);
        }
        if restarts && done {
            // Time to fetch the answer.
            Timer::after(POLL * 2).await;
            line.restart();
        }
    }
}

/// Writes log entries in their order and every tick as a record of the binary log; sets the light
/// when it changes. It encodes below the control rate, with an encoder from outside, whose three
/// kilobytes are never on the stack.
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
        exchange.liveness.check_in(TaskId::Journal, uptime());
        if let Some(cycles) = exchange.cycles.due(exchange.at_rest()) {
            journal.write_cycles(uptime(), cycles);
        }
        if exchange.light() != shown {
            shown = exchange.light();
            light.show(shown);
        }
        let news = select(exchange.entries.receive(), exchange.records.receive());
        let news = with_deadline(mid_tick_deadline(ROUND), news).await;
        exchange.liveness.running(TaskId::Journal);
        match news {
            Ok(Either::First(entry)) => {
                let more = iter::from_fn(|| exchange.entries.try_receive().ok());
                // At most a queue full before the next check-in.
                for entry in iter::once(entry).chain(more).take(ENTRIES) {
                    write(&mut journal, encoder, &entry);
                }
                let lost = exchange.lost_entries();
                if lost != reported {
                    // The newest entries are dropped, so their count comes last.
                    let event = Event::Lost(lost.wrapping_sub(reported));
                    write(&mut journal, encoder, &Entry { at: uptime(), event });
                    reported = lost;
                }
            }
            Ok(Either::Second(record)) => {
                journal.see(&record);
                let mut send = |frame: &[u8]| journal.send(frame);
                if let Ok((at, request)) = exchange.logged_request.try_receive() {
                    encoder.request(at, &request, &mut send);
                }
                if let Ok((at, plan)) = exchange.logged_plan.try_receive() {
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
