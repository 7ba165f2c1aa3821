//! The control tick's task.

use super::beat::Beat;
use super::exchange::Exchange;
use crate::blackbox::Recorder;
use crate::control::{Controller, Output, State};
use crate::hal::{MotorCommand, Motors, Watchdog};

/// Runs the control tick at 1 kHz: latest codes, command and plan in; bridges,
/// request, log entries and telemetry out. Feeds the watchdog while every task is
/// alive, and keeps for a restart what the drive does and who is missing.
///
/// It waits for nothing but time. A tick that starts more than a period late is
/// marked as an overrun and the ticks missed are left out; the tick number is
/// always that of the clock.
pub async fn motors(
    mut motors: impl Motors,
    mut watchdog: impl Watchdog,
    controller: &Controller,
    exchange: &Exchange,
) -> ! {
    motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    let mut state = State::standing(watchdog.place());
    let mut output = Output::default();
    let mut recorder = Recorder::default();
    let mut beat = Beat::<1>::new();
    loop {
        let due = beat.lead(&exchange.pulse).await;
        let mut input = exchange.input(due.tick, due.missed > 0);
        input.emergency_stop = motors.stopped();
        input.sensors.bridges = motors.readback();
        controller.step_into(&mut state, &input, &mut output);
        motors.apply(output.drive, output.preload);
        if output.rearm {
            motors.rearm();
        }
        exchange.publish(&input, &output);
        let late = exchange.late(due.tick);
        watchdog.keep(&recorder.flight(&output.telemetry, state.is_placed(), late));
        if late.is_nobody() {
            watchdog.feed();
        }
    }
}
