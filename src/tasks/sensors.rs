//! One task a sensor: read, stamp, publish, check in.

use super::exchange::Exchange;
use super::liveness::TaskId;
use crate::hal::{AnalogInput, AngleBus, WheelEncoder};
use crate::sense::raw::{AdcCode, AngleFrame, BusFault, Sample, SensorId};
use embassy_time::{Duration, with_timeout};

/// Time-out of a reading, ten times what the board takes. The task goes on and checks in; the
/// reading ages.
pub const SENSOR_TIMEOUT: Duration = Duration::from_millis(2);

/// Publishes the wheel counter at 1 kHz.
pub async fn wheel_encoder(mut wheel: impl WheelEncoder, exchange: &Exchange) -> ! {
    run(SensorId::WheelEncoder, exchange, async || Ok(wheel.count().get())).await
}

/// Publishes the code of a sensor that a converter reads, at its rate.
pub async fn analog(sensor: SensorId, mut input: impl AnalogInput, exchange: &Exchange) -> ! {
    run(sensor, exchange, async || input.sample().await.map(AdcCode::get)).await
}

/// Publishes the arm angle sensor's frame at 500 Hz, good or bad: the tick judges.
pub async fn arm_angle(mut bus: impl AngleBus, exchange: &Exchange) -> ! {
    run(SensorId::ArmAngle, exchange, async || bus.frame().await.map(AngleFrame::get)).await
}

/// Reads whenever a tick asks for it, and publishes what comes within [`SENSOR_TIMEOUT`],
/// stamped with that tick. A reading that fails only ages; one that is ready arms no timer.
async fn run(
    sensor: SensorId,
    exchange: &Exchange,
    mut read: impl AsyncFnMut() -> Result<u16, BusFault>,
) -> ! {
    let ticks = &exchange.sensor_ticks[sensor as usize];
    let latest = &exchange.sensor_codes[sensor as usize];
    loop {
        let at = ticks.wait().await;
        if let Ok(Ok(code)) = with_timeout(SENSOR_TIMEOUT, read()).await {
            latest.sender().send(Sample { code, at });
        }
        exchange.liveness.check_in(TaskId::Sensor(sensor), at);
    }
}
