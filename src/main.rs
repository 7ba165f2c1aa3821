//! The firmware: clocks, resource split, spawn. Everything it runs is in the
//! library; what is particular to the board is in [`board`].

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

/// The image is for the board alone; on a host this says where to go.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("interstage is firmware for the NUCLEO-G474RE and does not run here.");
    eprintln!("Flash it with `cargo flash`, or try it without a board: `cargo rig deploy`.");
    std::process::ExitCode::from(2)
}

#[cfg(target_os = "none")]
mod firmware {
    use embassy_executor::{InterruptExecutor, Spawner};
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use interstage::hal::Parts;
    use interstage::log::{Identity, LogEncoder};
    use interstage::model::Planner;
    use interstage::params::service::Service;
    use interstage::tasks::{self, TickIo, TickIoCell};
    use interstage::tick::{Controller, Entry, Event};
    use static_cell::{ConstStaticCell, StaticCell};

    use crate::board::config::{self, Held};
    use crate::board::rtt::{self, Channels};
    use crate::board::{self, EXCHANGE, guard, image, light, safety, start, supply};
    use crate::board::{Angle, Bridges, Button, Console, Guard, HostLine, Lamp, Lines};
    use crate::board::{CompressionSensor, Nucleo, Pages, PreloadSensor, Wheel};

    static LATEST: StaticCell<TickIoCell> = StaticCell::new();
    static ENCODER: ConstStaticCell<LogEncoder> =
        ConstStaticCell::new(LogEncoder::new(Identity::NOBODY));

    /// Runs the control tick and the sensors, above everything that may take long.
    ///
    /// The deadline is the next tick, 1 ms on. The time driver's interrupt wakes the clock's
    /// task at each whole millisecond, and that all others here. What can delay this
    /// executor: that and the other interrupts above it, which only wake tasks (two DMA
    /// channels, button) or count (system timer), and critical sections, of which the
    /// longest wakes a task in the queue of timers or copies a log entry, 3 us. Those of
    /// thread mode come in the middle between two ticks or right behind one, see
    /// [`tasks::mid_tick_deadline`]. What can delay the tick on it: the four sensor tasks,
    /// of which the longest exchanges two frames of 3 us. Model, log and operator run in
    /// thread mode and are preempted, however long they take. The tick measures its own
    /// lateness, and a whole period of it is a fault.
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
        let p = embassy_stm32::init(board::clocks());
        let waited = supply::watch();
        // Before anything that it may have damaged.
        let image = image::verify();
        defmt::info!("interstage {=str}", env!("CARGO_PKG_VERSION"));
        let restart = start::report(waited);
        EXCHANGE.log(Entry { at: 0, event: Event::Restart(restart) });
        guard::arm();
        let (mut parts, lamp, pages) = board::split(p, channels.console, channels.telemetry);
        parts.watchdog.place = restart.place();
        threads.spawn(light::show(lamp).unwrap());
        match image {
            Some(sealed) => threads.spawn(safety::watch_image(sealed).unwrap()),
            None => return config::hold(threads, parts, Held::Image),
        }
        let (constants, service) = config::build(pages);
        threads.spawn(link(HostLine::new(channels.line), service).unwrap());
        match constants {
            Ok((controller, planner, identity)) => {
                parts.journal.introduce(identity);
                run(threads, parts, controller, planner);
            }
            Err(error) => config::hold(threads, parts, Held::Parameters(error)),
        }
    }

    /// Hands every part to its task.
    fn run(
        threads: Spawner,
        mut parts: Parts<Nucleo>,
        controller: &'static Controller,
        planner: &'static Planner,
    ) {
        interrupt::UART5.set_priority(Priority::P6);
        let control = CONTROL.start(interrupt::UART5);
        parts.watchdog.start();
        let latest = LATEST.init_with(|| TickIoCell::new(TickIo::default()));
        control.spawn(clock().unwrap());
        control.spawn(wheel_encoder(parts.wheel_encoder).unwrap());
        control.spawn(preload_sensor(parts.preload_sensor).unwrap());
        control.spawn(compression_sensor(parts.compression_sensor).unwrap());
        control.spawn(arm_angle(parts.arm_angle).unwrap());
        control.spawn(motors(parts.motors, parts.watchdog, controller, latest).unwrap());
        control.spawn(record(latest).unwrap());
        threads.spawn(model(planner).unwrap());
        threads.spawn(pressed(parts.button).unwrap());
        threads.spawn(typed(parts.console).unwrap());
        threads.spawn(journal(parts.journal, parts.light).unwrap());
    }

    /// Makes tasks of the library's functions.
    macro_rules! tasks {
        ($($name:ident($($part:ident: $type:ty),*) => $call:expr;)*) => {$(
            #[embassy_executor::task]
            async fn $name($($part: $type),*) -> ! {
                $call.await
            }
        )*};
    }

    tasks! {
        clock() => tasks::clock(&EXCHANGE);
        wheel_encoder(wheel: Wheel) => tasks::wheel_encoder(wheel, &EXCHANGE);
        preload_sensor(input: PreloadSensor) => tasks::preload_sensor(input, &EXCHANGE);
        compression_sensor(input: CompressionSensor) => tasks::compression_sensor(input, &EXCHANGE);
        arm_angle(bus: Angle) => tasks::arm_angle(bus, &EXCHANGE);
        motors(
            motors: Bridges, watchdog: Guard, controller: &'static Controller,
            latest: &'static TickIoCell
        ) => tasks::motors(motors, watchdog, controller, latest, &EXCHANGE);
        record(latest: &'static TickIoCell) => tasks::record(latest, &EXCHANGE);
        model(planner: &'static Planner) => tasks::model(planner, &EXCHANGE);
        pressed(button: Button) => tasks::operator(button, &EXCHANGE);
        typed(console: Console) => tasks::operator(console, &EXCHANGE);
        link(line: HostLine, service: Service<Pages>) => tasks::link(line, service, &EXCHANGE);
        journal(lines: Lines, lamp: Lamp) => {
            tasks::journal(lines, lamp, ENCODER.take(), &EXCHANGE)
        };
    }
}
