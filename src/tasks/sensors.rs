//! One task a sensor: read, stamp, publish, check in.

use core::future::poll_fn;

use super::beat::{ANGLE_PERIOD, Beat};
use super::exchange::{Exchange, TaskId};
use crate::hal::{AnalogInput, AngleBus, WheelEncoder};
use crate::sense::raw::{AdcCode, BusFault, Sample};
use crate::units::Tick;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Timer};

/// After this long a reading is given up and begun anew: ten times what the board
/// takes. The task lives on and checks in; the reading ages.
pub const SENSOR_TIMEOUT: Duration = Duration::from_millis(2);

/// Waits for a sensor's next turn; its tick.
macro_rules! turn {
    ($beat:expr, $exchange:expr, $station:expr) => {{
        let mut waits = false;
        poll_fn(|context| $beat.follow(context, &mut waits, &$exchange.pulse, $station)).await.tick
    }};
}

/// Publishes the wheel counter at 1 kHz.
pub async fn speed(mut wheel: impl WheelEncoder, exchange: &Exchange) -> ! {
    let mut beat = Beat::<1>::new();
    loop {
        let at = turn!(beat, exchange, TaskId::Speed);
        exchange.wheel.put(Sample { code: wheel.count(), at });
        exchange.check_in(TaskId::Speed, at);
    }
}

/// Publishes the load cell's code at 1 kHz.
pub async fn pressure(input: impl AnalogInput, exchange: &Exchange) -> ! {
    let publish = |sample| exchange.load_cell.put(sample);
    analog(input, TaskId::Pressure, publish, exchange).await
}

/// Publishes the tread displacement sensor's code at 1 kHz.
pub async fn displacement(input: impl AnalogInput, exchange: &Exchange) -> ! {
    let publish = |sample| exchange.tread.put(sample);
    analog(input, TaskId::Displacement, publish, exchange).await
}

/// Publishes the arm angle sensor's frame at 500 Hz, good or bad: the tick judges.
pub async fn angle(mut bus: impl AngleBus, exchange: &Exchange) -> ! {
    let mut beat = Beat::<ANGLE_PERIOD>::new();
    loop {
        let at = turn!(beat, exchange, TaskId::Angle);
        let publish = |sample| exchange.arm.put(sample);
        settle(bounded(bus.frame()).await, at, TaskId::Angle, publish, exchange);
    }
}

async fn analog(
    mut input: impl AnalogInput,
    station: TaskId,
    publish: impl Fn(Sample<AdcCode>),
    exchange: &Exchange,
) -> ! {
    let mut beat = Beat::<1>::new();
    loop {
        let at = turn!(beat, exchange, station);
        settle(bounded(input.sample()).await, at, station, &publish, exchange);
    }
}

/// A reading that ends one way or the other. One that is there at once costs no timer.
async fn bounded<T>(reading: impl Future<Output = Result<T, BusFault>>) -> Result<T, BusFault> {
    let limit = async { Timer::after(SENSOR_TIMEOUT).await };
    match select(reading, limit).await {
        Either::First(done) => done,
        Either::Second(()) => Err(BusFault::Timeout),
    }
}

/// Publishes a reading or counts its failure.
fn settle<T>(
    reading: Result<T, BusFault>,
    at: Tick,
    station: TaskId,
    publish: impl Fn(Sample<T>),
    exchange: &Exchange,
) {
    match reading {
        Ok(code) => publish(Sample { code, at }),
        Err(BusFault::Timeout | BusFault::Transfer) => exchange.count_bus_fault(station),
    }
    exchange.check_in(station, at);
}
