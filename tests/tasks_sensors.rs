//! Sensor tasks: rates, publication, faults and hangs.

use crate::common::{Answer, Bench, Sensor, forever};
use embassy_time::Duration;
use interstage::sense::raw::{BusFault, SensorFrame, SensorId};
use interstage::tasks::{self, Exchange, SENSOR_TIMEOUT};

/// An exchange whose ticks come.
fn clocked(bench: &mut Bench) -> &'static Exchange {
    let exchange = forever(Exchange::new());
    bench.spawn(async { tasks::clock(exchange).await });
    exchange
}

/// Spawns one sensor's task on its part of the exchange.
pub(crate) fn spawn(bench: &mut Bench, part: &Sensor, sensor: SensorId, to: &'static Exchange) {
    let part = part.clone();
    match sensor {
        SensorId::WheelEncoder => bench.spawn(async { tasks::wheel_encoder(part, to).await }),
        SensorId::ArmAngle => bench.spawn(async { tasks::arm_angle(part, to).await }),
        _ => bench.spawn(async move { tasks::analog(sensor, part, to).await }),
    }
}

/// Time of the latest sample of a sensor.
fn latest(exchange: &Exchange, sensor: SensorId) -> Option<u32> {
    exchange.sensors()[sensor].map(|sample| sample.at)
}

const SENSORS: [(SensorId, u32); 4] = [
    (SensorId::WheelEncoder, 1),
    (SensorId::PreloadSensor, 1),
    (SensorId::CompressionSensor, 1),
    (SensorId::ArmAngle, 2),
];

/// Those that can fail: a counter cannot.
const BUSES: [(SensorId, u32); 3] = [SENSORS[1], SENSORS[2], SENSORS[3]];

#[test]
fn each_sensor_is_read_at_its_own_rate() {
    for (task, period) in SENSORS {
        let (mut bench, sensor) = (Bench::new(), Sensor::new(7));
        let exchange = clocked(&mut bench);
        spawn(&mut bench, &sensor, task, exchange);
        bench.run_ms(100);
        let expected: Vec<u32> = (1..=100 / period).map(|n| n * period).collect();
        assert_eq!(sensor.reads(), expected, "{task:?}");
    }
}

#[test]
fn codes_are_published_with_the_tick_at_which_they_were_taken() {
    let mut bench = Bench::new();
    let exchange = clocked(&mut bench);
    let sensors = [11, 22, 33, 44].map(Sensor::new);
    for (sensor, (task, _)) in sensors.iter().zip(SENSORS) {
        spawn(&mut bench, sensor, task, exchange);
        assert_eq!(latest(exchange, task), None);
    }
    // A conversion that takes a while is stamped with its beginning.
    sensors[1].takes(Duration::from_micros(500));
    bench.run_ms(10);
    let mut expected = SensorFrame::taken(10, [11, 22, 33, 44]);
    let at = |frame: &mut SensorFrame, sensor: SensorId, at| {
        frame[sensor].iter_mut().for_each(|sample| sample.at = at);
    };
    at(&mut expected, SensorId::PreloadSensor, 9);
    assert_eq!(exchange.sensors(), expected);
    sensors[2].answers(Answer::Code(55));
    bench.run_ms(1);
    expected = SensorFrame::taken(11, [11, 22, 55, 44]);
    at(&mut expected, SensorId::PreloadSensor, 10);
    at(&mut expected, SensorId::ArmAngle, 10);
    assert_eq!(exchange.sensors(), expected);
}

#[test]
fn a_bus_fault_keeps_the_last_code_and_the_next_reading_is_taken() {
    for (task, _) in BUSES {
        for fault in [BusFault::Timeout, BusFault::Transfer] {
            let mut bench = Bench::new();
            let (exchange, sensor) = (clocked(&mut bench), Sensor::new(7));
            spawn(&mut bench, &sensor, task, exchange);
            bench.run_ms(10);
            sensor.answers(Answer::Fault(fault));
            bench.run_ms(10);
            assert_eq!(latest(exchange, task), Some(10), "{task:?}");
            sensor.answers(Answer::Code(8));
            bench.run_ms(2);
            assert_eq!(latest(exchange, task), Some(22), "{task:?}");
        }
    }
}

#[test]
fn a_hanging_sensor_only_ages_and_is_tried_again() {
    for (task, _) in BUSES {
        let mut bench = Bench::new();
        let (exchange, sensor) = (clocked(&mut bench), Sensor::new(7));
        spawn(&mut bench, &sensor, task, exchange);
        bench.run_ms(10);
        sensor.answers(Answer::Hang);
        let before = sensor.reads().len();
        bench.run_ms(60);
        assert_eq!(latest(exchange, task), Some(10), "{task:?}");
        let tries = sensor.reads().len() - before;
        assert!((15..=30).contains(&tries), "{task:?}: {tries} in 60 ms");
        sensor.answers(Answer::Code(8));
        bench.run_ms(2 + SENSOR_TIMEOUT.as_millis());
        assert!(latest(exchange, task) >= Some(70), "{task:?}");
    }
}

#[test]
fn a_hang_of_one_sensor_leaves_the_others_alone() {
    let mut bench = Bench::new();
    let exchange = clocked(&mut bench);
    let sensors = [11, 22, 33, 44].map(Sensor::new);
    for (sensor, (task, _)) in sensors.iter().zip(SENSORS) {
        spawn(&mut bench, sensor, task, exchange);
    }
    bench.run_ms(10);
    sensors[3].answers(Answer::Hang);
    bench.run_ms(50);
    assert_eq!(latest(exchange, SensorId::ArmAngle), Some(10));
    for task in [SensorId::WheelEncoder, SensorId::PreloadSensor, SensorId::CompressionSensor] {
        assert_eq!(latest(exchange, task), Some(60), "{task:?}");
    }
}

#[test]
fn ticks_that_were_missed_are_not_made_up() {
    for (task, period) in SENSORS {
        let mut bench = Bench::new();
        let (exchange, sensor) = (clocked(&mut bench), Sensor::new(7));
        spawn(&mut bench, &sensor, task, exchange);
        bench.run_ms(10);
        bench.freeze_ms(9);
        bench.run_ms(5);
        let reads: Vec<u32> = sensor.reads().into_iter().filter(|&at| at > 10).collect();
        // One at once, if that tick is one of its own, then in time again.
        let expected: Vec<u32> = (19..=24).filter(|at| at % period == 0).collect();
        assert_eq!(reads, expected, "{task:?}");
        assert_eq!(latest(exchange, task), reads.last().copied(), "{task:?}");
    }
}

#[test]
fn time_stamps_do_not_depend_on_when_a_task_was_started() {
    let mut bench = Bench::new();
    bench.run_ms(3);
    embassy_time::MockDriver::get().advance(Duration::from_micros(750));
    let exchange = clocked(&mut bench);
    let sensor = Sensor::new(7);
    spawn(&mut bench, &sensor, SensorId::ArmAngle, exchange);
    bench.run_ms(10);
    assert_eq!(sensor.reads(), [4, 6, 8, 10, 12]);
}
