//! The control tick's task, and the one that copies the tick for the log.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;

use super::clock::uptime;
use super::exchange::{Exchange, TickIo};
use crate::hal::{Motors, Watchdog};
use crate::log::SnapshotRecorder;
use crate::tick::{Controller, State};
use crate::units::MotorCommand;

/// The latest tick: [`motors()`] fills it, [`record()`] reads it before the next. Both run on one
/// executor and hold it across no await, so neither finds it locked.
pub type TickIoCell = Mutex<CriticalSectionRawMutex, TickIo>;

/// Runs the control tick at 1 kHz: latest codes, command and plan in; bridges, request and log
/// entries out. Feeds the watchdog while every task is alive, and keeps a snapshot of the drive
/// and of missing tasks for a restart.
///
/// It waits for time alone. A tick that starts more than a period late counts as an overrun, and
/// missed ticks are skipped; the tick's number is always that of the clock.
pub async fn motors(
    mut motors: impl Motors,
    mut watchdog: impl Watchdog,
    controller: &Controller,
    latest: &TickIoCell,
    exchange: &Exchange,
) -> ! {
    motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    let mut state = State::restored(watchdog.place());
    let mut recorder = SnapshotRecorder::default();
    let mut last = uptime();
    loop {
        exchange.tick_started.wait().await;
        exchange.liveness.in_tick(true);
        let began = watchdog.cycles();
        let now = uptime();
        let Ok(mut tick) = latest.try_lock() else {
            // No task holds this borrow across an await; the watchdog catches one that does.
            motors.apply(MotorCommand::OFF, MotorCommand::OFF);
            continue;
        };
        let TickIo { input, output } = &mut *tick;
        *input = exchange.input(now, now.wrapping_sub(last) > 1);
        input.emergency_stop = motors.stopped();
        input.sensors.bridges = motors.readback();
        controller.step_into(&mut state, input, output);
        motors.apply(output.drive, output.preload);
        if output.rearm {
            motors.rearm();
        }
        exchange.publish(output);
        let missed = exchange.liveness.missed(now);
        let (confidence, zeros) = (state.confidence(), state.zeros());
        watchdog.keep(&recorder.snapshot(&output.telemetry, confidence, missed, zeros));
        if missed.is_nobody() {
            watchdog.feed();
        }
        last = now;
        exchange.cycles.note(watchdog.cycles().wrapping_sub(began));
        exchange.tick_ended.signal(());
        exchange.liveness.in_tick(false);
    }
}

/// Copies every tick for the log. It runs directly after the tick, so that bridges and watchdog
/// do not wait for the copy.
pub async fn record(latest: &TickIoCell, exchange: &Exchange) -> ! {
    loop {
        exchange.tick_ended.wait().await;
        if let Ok(tick) = latest.try_lock() {
            exchange.record(&tick);
        }
    }
}
