//! The control tick's task.

use super::beat::Beat;
use super::exchange::Exchange;
use super::tape::{Latest, Turn};
use crate::control::{Controller, State};
use crate::hal::{MotorCommand, Motors, Watchdog};
use crate::log::SnapshotRecorder;

/// Runs the control tick at 1 kHz: latest codes, command and plan in; bridges,
/// request and log entries out. Feeds the watchdog while every task is alive, and keeps
/// for a restart what the drive does and who is missing. What it was given and gave stays
/// in `latest` for [`tape()`](super::tape()).
///
/// It waits for nothing but time. A tick that starts more than a period late is
/// marked as an overrun and the ticks missed are left out; the tick number is
/// always that of the clock.
pub async fn motors(
    mut motors: impl Motors,
    mut watchdog: impl Watchdog,
    controller: &Controller,
    latest: &Latest,
    exchange: &Exchange,
) -> ! {
    motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    let mut state = State::standing(watchdog.place());
    let mut recorder = SnapshotRecorder::default();
    let mut beat = Beat::<1>::new();
    loop {
        let due = beat.lead(&exchange.pulse).await;
        let Ok(mut turn) = latest.0.try_borrow_mut() else {
            // Nobody holds it over a turn of theirs; if so the watchdog ends it.
            motors.apply(MotorCommand::OFF, MotorCommand::OFF);
            continue;
        };
        let Turn { input, output, fresh } = &mut *turn;
        exchange.input_into(due.tick, due.missed > 0, input);
        input.emergency_stop = motors.stopped();
        input.sensors.bridges = motors.readback();
        controller.step_into(&mut state, input, output);
        *fresh = true;
        motors.apply(output.drive, output.preload);
        if output.rearm {
            motors.rearm();
        }
        exchange.publish(output);
        let late = exchange.late(due.tick);
        watchdog.keep(&recorder.snapshot(&output.telemetry, state.trust(), late));
        if late.is_nobody() {
            watchdog.feed();
        }
    }
}
