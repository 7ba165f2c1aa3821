//! The firmware: clocks, resource split, spawn. Everything that it runs is in the library; the
//! drivers are in [`board`].

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

/// On a host: how to flash or simulate the image.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("interstage is firmware for the NUCLEO-G474RE and does not run here.");
    eprintln!("Flash it with `cargo rig flash`, or try it without a board: `cargo rig deploy`.");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod firmware {
    use embassy_executor::{InterruptExecutor, Spawner};
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use interstage::log::{Identity, LogEncoder};
    use interstage::model::Planner;
    use interstage::params::service::Service;
    use interstage::sense::raw::SensorId;
    use interstage::tasks::{self, TickIo, TickIoCell};
    use interstage::tick::{Controller, Entry, Event};
    use static_cell::{ConstStaticCell, StaticCell};

    use crate::board::config::{self, HoldReason};
    use crate::board::rtt::{self, Channels};
    use crate::board::{self, EXCHANGE, flash_page, guard, image, light, safety, start, supply};
    use crate::board::{Analog, Angle, Bridges, Button, Console, Guard, HostLine, Lamp, Parts};
    use crate::board::{ParameterFlash, TextLog, Wheel};

    static LATEST: StaticCell<TickIoCell> = StaticCell::new();
    static ENCODER: ConstStaticCell<LogEncoder> =
        ConstStaticCell::new(LogEncoder::new(Identity::NOBODY));

    /// Runs the control tick and the sensors, above all work without a deadline.
    ///
    /// The deadline is the next tick, 1 ms later. At each whole millisecond the time driver's
    /// interrupt wakes the clock's task, which wakes the others. This executor is delayed by
    /// the interrupts above it, which only wake tasks (two DMA channels, button) or count
    /// (system timer), and by critical sections, of which the longest wakes a task in the timer
    /// queue or copies a log entry, 3 us. Those of thread mode run in the middle between two
    /// ticks or directly after one, see [`tasks::mid_tick_deadline`]. On this executor the sensors'
    /// tasks delay the tick; the longest exchanges two frames of 3 us, three after an error. Model,
    /// log and operator run in thread mode and are preempted. The tick measures its own lateness,
    /// and a full period of it is a fault.
    static CONTROL: InterruptExecutor = InterruptExecutor::new();

    /// The board has no use for UART5; its vector carries [`CONTROL`].
    #[embassy_stm32::interrupt]
    unsafe fn UART5() {
        // SAFETY: this is the executor's handler, unmasked by `start` alone.
        unsafe { CONTROL.on_interrupt() }
    }

    #[cfg(not(feature = "hil"))]
    #[embassy_executor::main]
    async fn main(threads: Spawner) {
        begin(threads, rtt::init());
    }

    #[cfg(feature = "hil")]
    #[cortex_m_rt::entry]
    fn main() -> ! {
        board::hil::run(rtt::init(), begin)
    }

    /// Starts everything.
    fn begin(threads: Spawner, channels: Channels) {
        let p = board::init();
        let waited = supply::watch();
        // First: a damaged image may not reach what follows.
        let image = image::verify();
        defmt::info!("interstage {=str}", env!("CARGO_PKG_VERSION"));
        let restart = start::report(waited);
        EXCHANGE.log(Entry { at: 0, event: Event::Restart(restart) });
        guard::arm();
        let (mut parts, lamp, flash) = board::split(p, channels.console, channels.telemetry);
        parts.watchdog.place = restart.place();
        threads.spawn(light::show(lamp).unwrap());
        if !flash_page::two_banks() {
            return config::hold(threads, parts, HoldReason::OneBank);
        }
        match image {
            Some(checksum) => threads.spawn(safety::watch_image(checksum).unwrap()),
            None => return config::hold(threads, parts, HoldReason::Image),
        }
        let (constants, service) = config::build(flash);
        threads.spawn(link(HostLine::new(channels.line), service).unwrap());
        match constants {
            Ok((controller, planner, identity)) => {
                parts.journal.set_identity(identity);
                run(threads, parts, controller, planner);
            }
            Err(error) => config::hold(threads, parts, HoldReason::Parameters(error)),
        }
    }

    /// Hands every part to its task.
    fn run(
        threads: Spawner,
        mut parts: Parts,
        controller: &'static Controller,
        planner: &'static Planner,
    ) {
        interrupt::UART5.set_priority(Priority::P6);
        let control = CONTROL.start(interrupt::UART5);
        parts.watchdog.start();
        let latest = LATEST.init_with(|| TickIoCell::new(TickIo::default()));
        control.spawn(clock().unwrap());
        control.spawn(wheel_encoder(parts.wheel_encoder).unwrap());
        for (sensor, input) in SensorId::ANALOG.into_iter().zip(parts.analog) {
            control.spawn(analog(sensor, input).unwrap());
        }
        control.spawn(arm_angle(parts.arm_angle).unwrap());
        control.spawn(motors(parts.motors, parts.watchdog, controller, latest).unwrap());
        control.spawn(record(latest).unwrap());
        threads.spawn(model(planner).unwrap());
        threads.spawn(pressed(parts.button).unwrap());
        threads.spawn(typed(parts.console).unwrap());
        threads.spawn(journal(parts.journal, parts.light).unwrap());
    }

    /// Makes executor tasks, which cannot be generic, of the library's functions.
    macro_rules! tasks {
        ($($name:ident $([$most:expr])? ($($part:ident: $type:ty),*) => $call:expr;)*) => {$(
            #[embassy_executor::task$((pool_size = $most))?]
            async fn $name($($part: $type),*) -> ! {
                $call.await
            }
        )*};
    }

    tasks! {
        clock() => tasks::clock(&EXCHANGE);
        wheel_encoder(wheel: Wheel) => tasks::wheel_encoder(wheel, &EXCHANGE);
        analog[SensorId::ANALOG.len()](sensor: SensorId, input: Analog) =>
            tasks::analog(sensor, input, &EXCHANGE);
        arm_angle(bus: Angle) => tasks::arm_angle(bus, &EXCHANGE);
        motors(
            motors: Bridges, watchdog: Guard, controller: &'static Controller,
            latest: &'static TickIoCell
        ) => tasks::motors(motors, watchdog, controller, latest, &EXCHANGE);
        record(latest: &'static TickIoCell) => tasks::record(latest, &EXCHANGE);
        model(planner: &'static Planner) => tasks::model(planner, &EXCHANGE, board::paused);
        pressed(button: Button) => tasks::operator(button, &EXCHANGE);
        typed(console: Console) => tasks::operator(console, &EXCHANGE);
        link(line: HostLine, service: Service<ParameterFlash>) =>
            tasks::link(line, service, &EXCHANGE);
        journal(log: TextLog, lamp: Lamp) => tasks::journal(log, lamp, ENCODER.take(), &EXCHANGE);
    }
}
