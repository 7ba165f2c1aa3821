//! One task a sensor: read, stamp, publish, check in.

use super::exchange::Exchange;
use super::liveness::{PERIODS, TaskId};
use crate::hal::{AnalogInput, AngleBus, WheelEncoder};
use crate::sense::raw::{AdcCode, BusFault, Sample};
use embassy_time::{Duration, with_timeout};

/// Time-out of a reading, ten times what the board takes. The task goes on and checks in; the
/// reading ages.
pub const SENSOR_TIMEOUT: Duration = Duration::from_millis(2);

/// Publishes the wheel counter at 1 kHz.
pub async fn wheel_encoder(mut wheel: impl WheelEncoder, exchange: &Exchange) -> ! {
    run(
        TaskId::WheelEncoder,
        exchange,
        async || Ok(wheel.count()),
        |s| exchange.wheel_encoder.sender().send(s),
    )
    .await
}

/// Publishes the preload sensor's code at 1 kHz.
pub async fn preload_sensor(input: impl AnalogInput, exchange: &Exchange) -> ! {
    analog(TaskId::PreloadSensor, exchange, input, |s| exchange.preload_sensor.sender().send(s))
        .await
}

/// Publishes the compression sensor's code at 1 kHz.
pub async fn compression_sensor(input: impl AnalogInput, exchange: &Exchange) -> ! {
    analog(TaskId::CompressionSensor, exchange, input, |s| {
        exchange.compression_sensor.sender().send(s)
    })
    .await
}

/// Publishes the arm angle sensor's frame at 500 Hz, good or bad: the tick judges.
pub async fn arm_angle(mut bus: impl AngleBus, exchange: &Exchange) -> ! {
    run(
        TaskId::ArmAngle,
        exchange,
        async || bus.frame().await,
        |s| exchange.arm_angle.sender().send(s),
    )
    .await
}

async fn analog(
    task: TaskId,
    exchange: &Exchange,
    mut input: impl AnalogInput,
    publish: impl Fn(Sample<AdcCode>),
) -> ! {
    run(task, exchange, async || input.sample().await, publish).await
}

/// Reads whenever a tick asks for it, and publishes what comes within [`SENSOR_TIMEOUT`],
/// stamped with that tick. A reading that fails only ages; one that is ready arms no timer.
async fn run<T>(
    task: TaskId,
    exchange: &Exchange,
    mut read: impl AsyncFnMut() -> Result<T, BusFault>,
    publish: impl Fn(Sample<T>),
) -> ! {
    let ticks = &exchange.sensor_ticks[task.index() % PERIODS.len()];
    loop {
        let at = ticks.wait().await;
        if let Ok(Ok(code)) = with_timeout(SENSOR_TIMEOUT, read()).await {
            publish(Sample { code, at });
        }
        exchange.liveness.check_in(task, at);
    }
}
