//! Friction by a pull: the wheel is pressed, the drive pulls the carriage against its stop at the
//! stow end, and the tread slips over the wall. What the wheel then lacks of its free speed at the
//! same duty is the force of friction, as a part of the drive's stall force.

use std::ops::ControlFlow;

use interstage::sense::raw::SensorId;

use super::figures::level;
use super::line::{drive, press};
use super::motion::{fault, speed};
use super::pretightener::{Level, REST_MS, release};
use super::{BringupError, Check, Session, row};
use crate::plant::sensors::decode;

/// Duties inwards: of a free wheel both, of the pull the second.
const SLOW: f64 = 0.15;
const FAST: f64 = 0.30;
/// Time of a motion, ms: 16 of the 20 mm that the service mode allows. Its second half is judged.
const PULL_MS: u32 = 1000;
/// Duty of the pre-tightener, its longest motion, ms, and the preload, N, at which it ends.
const PRESS: f64 = 0.40;
const PRESS_MS: u32 = 2400;
const PRESSED_N: f64 = 12.0;
/// How well the stall force at this supply is known, and the preload.
const KNOWN: f64 = 0.05 + 0.01;

/// The pull, and the preload off again.
pub(super) fn run(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    let rig = session.proposed.rig.clone();
    let (rig, stall) = (&rig, rig.drive.stall_force_n);
    session.operator.confirm(
        "Carriage on its stop at the stow end, preload off: the DRIVE turns the wheel inwards, 15 % \
         and 30 % for 1 s.",
    )?;
    // The emergency stop was pressed for what hands did before.
    session.line.reset()?;
    let base = Level::of(&session.line.listen(REST_MS)?, rig)?;
    // Speed of the tread inwards, mm/s; rows after it; and the fault that ended it.
    let pull = |session: &mut Session<'_, '_>, duty: f64| -> Result<_, BringupError> {
        let motion = session.line.moved(drive(-duty), PULL_MS, REST_MS)?;
        let after = Level::of(&motion.rows, rig)?.since(base).preload;
        Ok((-speed(&motion, rig), after, fault(&motion)))
    };
    let (slow, free) = (pull(session, SLOW)?.0, pull(session, FAST)?.0);
    let no_load = (free - slow) / (FAST - SLOW);
    session.operator.confirm(&format!(
        "Wheel on the wall: the PRE-TIGHTENER presses it to about {PRESSED_N} N, the DRIVE pulls \
         inwards against the stop, 30 % for 1 s three times, until the tread slips."
    ))?;
    let motion = session.line.move_and(press(PRESS), PRESS_MS, REST_MS, |line| {
        let last = line.heard().iter().rev().take(20);
        let is_pressed = level(SensorId::PreloadSensor, rig, last).is_ok_and(|n| n >= PRESSED_N);
        Ok(if is_pressed { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })?;
    let preload = Level::of(&motion.rows, rig)?.since(base).preload;
    // The first pull takes up what room the stop has.
    pull(session, FAST)?;
    let arm = (rig.centre_radius_mm(0) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
    let thrust = rig.plant.arm_coupling * arm / (1.0 - arm * arm).sqrt();
    let (first, ..) = pull(session, FAST)?;
    let (second, after, fault) = pull(session, FAST)?;
    let (left, _) = release(session, base, 2 * PRESS_MS)?;
    let part = 0.5 * (first + second) / free;
    let pressed = preload >= 0.8 * PRESSED_N;
    let mut checks = vec![row::PULL_SLIPS.by(
        (pressed && fault.is_empty()).then_some(part),
        format!("{:.0} % of its free speed at {preload:.1} N{fault}", 100.0 * part),
        "near its free speed the wheel rolls: the carriage is not on its stop at the stow end, or \
         the wheel not on the wall. Near rest 30 % is too little, or something holds the drive",
    )];
    if !checks[0].ok {
        return Ok(checks);
    }
    let lacks = (1.0 - part) * free / no_load;
    let preload_n = 0.5 * (preload + after);
    // The stop takes the drive's force, and so the arm takes preload off the wheel.
    let mu = lacks * stall / (preload_n - thrust * lacks * stall);
    // A count at either end of what is judged, and what does not repeat.
    let speed = (first - second).abs()
        + decode(SensorId::WheelEncoder, rig, 1.0) / (0.5e-3 * f64::from(PULL_MS));
    let unsure = KNOWN + speed / (no_load * lacks) + (preload - after).abs() / preload_n;
    let within = mu * (1.0 + thrust * mu).abs() * unsure;
    let found = row::PRELOAD_RELEASED.has(left.preload).then_some(mu);
    if found.is_some_and(|mu| row::FRICTION.has(mu)) {
        session.proposed.rig.plant.mu = (mu * 100.0).round() / 100.0;
        session.measured("plant.mu", mu, within, "a pull");
    }
    checks.push(row::FRICTION.by(
        found,
        format!("{mu:.2}, {within:.2} either way: {:.2} N at {preload_n:.2} N", lacks * stall),
        "the tread is wet or worn, drive.stall_force_n or the arm is another than stated, or the \
         preload did not come off",
    ));
    Ok(checks)
}
