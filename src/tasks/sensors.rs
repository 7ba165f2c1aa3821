//! One task a sensor: read, stamp, publish, check in.

use super::exchange::{Exchange, Latest};
use super::liveness::{PERIODS, TaskId};
use crate::hal::{AnalogInput, AngleBus, WheelEncoder};
use crate::sense::raw::{BusFault, Sample};
use embassy_time::{Duration, with_timeout};

/// Time-out of a reading, ten times what the board takes. The task goes on and checks in; the
/// reading ages.
pub const SENSOR_TIMEOUT: Duration = Duration::from_millis(2);

/// Publishes the wheel counter at 1 kHz.
pub async fn wheel_encoder(mut wheel: impl WheelEncoder, exchange: &Exchange) -> ! {
    let read = async || Ok(wheel.count());
    run(TaskId::WheelEncoder, exchange, &exchange.wheel_encoder, read).await
}

/// Publishes the preload sensor's code at 1 kHz.
pub async fn preload_sensor(mut input: impl AnalogInput, exchange: &Exchange) -> ! {
    let read = async || input.sample().await;
    run(TaskId::PreloadSensor, exchange, &exchange.preload_sensor, read).await
}

/// Publishes the compression sensor's code at 1 kHz.
pub async fn compression_sensor(mut input: impl AnalogInput, exchange: &Exchange) -> ! {
    let read = async || input.sample().await;
    run(TaskId::CompressionSensor, exchange, &exchange.compression_sensor, read).await
}

/// Publishes the arm angle sensor's frame at 500 Hz, good or bad: the tick judges.
pub async fn arm_angle(mut bus: impl AngleBus, exchange: &Exchange) -> ! {
    let read = async || bus.frame().await;
    run(TaskId::ArmAngle, exchange, &exchange.arm_angle, read).await
}

/// Reads whenever a tick asks for it, and publishes what comes within [`SENSOR_TIMEOUT`],
/// stamped with that tick. A reading that fails only ages; one that is ready arms no timer.
async fn run<T: Clone>(
    task: TaskId,
    exchange: &Exchange,
    latest: &Latest<Sample<T>>,
    mut read: impl AsyncFnMut() -> Result<T, BusFault>,
) -> ! {
    let ticks = &exchange.sensor_ticks[task.index() % PERIODS.len()];
    loop {
        let at = ticks.wait().await;
        if let Ok(Ok(code)) = with_timeout(SENSOR_TIMEOUT, read()).await {
            latest.sender().send(Sample { code, at });
        }
        exchange.liveness.check_in(task, at);
    }
}
