//! The firmware: clocks, resource split, spawn. Everything it runs is in the
//! library; what is particular to the board is in [`board`].

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
use firmware::EXCHANGE;

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
    #[cfg(not(feature = "hil"))]
    use embassy_stm32::gpio::AnyPin;
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    #[cfg(not(feature = "hil"))]
    use embassy_stm32::{Peri, Peripherals, pac};
    use interstage::hal::{Board, Parts};
    use interstage::log::{Identity, LogEncoder};
    use interstage::model::Planner;
    use interstage::params::service::Service;
    use interstage::tasks::{self, Exchange, Latest};
    use interstage::tick::{Controller, Entry, Event};
    #[cfg(not(feature = "hil"))]
    use rtt_target::DownChannel;
    use static_cell::{ConstStaticCell, StaticCell};

    use crate::board::config::Held;
    #[cfg(feature = "hil")]
    use crate::board::hil::{self, split};
    use crate::board::rtt::Channels;
    #[cfg(not(feature = "hil"))]
    use crate::board::rtt::Frames;
    use crate::board::{self, config, guard, image, light, retained, rtt, supply};
    #[cfg(not(feature = "hil"))]
    use crate::board::{Analog, Bridge, Checksum, Readback, Ring};
    use crate::board::{Angle, Bridges, Button, Console, Guard, HostLine, Lamp, Lines};
    use crate::board::{Nucleo, Pages, Wheel};

    /// Any pin.
    #[cfg(not(feature = "hil"))]
    type Pin = Peri<'static, AnyPin>;

    pub(crate) static EXCHANGE: Exchange = Exchange::new();
    #[cfg(not(feature = "hil"))]
    static LOAD_CELL: Ring = Ring::new();
    #[cfg(not(feature = "hil"))]
    static TREAD: Ring = Ring::new();
    static LATEST: StaticCell<Latest> = StaticCell::new();
    static SCRIBE: ConstStaticCell<LogEncoder> =
        ConstStaticCell::new(LogEncoder::new(Identity::NOBODY));

    /// Runs the control tick and the sensors, above everything that may take long.
    ///
    /// The deadline is the next tick, 1 ms on. The system timer's interrupt beats it and
    /// wakes all tasks here. What can delay this executor: that and the other interrupts
    /// above it, which only wake tasks (time driver, two DMA channels, button), and
    /// critical sections, of which the longest wakes a task in the queue of timers or
    /// copies a log entry, 3 us. Those of thread mode come in the middle between two ticks
    /// or right behind one, see [`Exchange::aside`]. What can delay the tick on it: the
    /// four sensor tasks, of which the longest exchanges two frames of 3 us. Model, log
    /// and operator run in thread mode and are preempted, however long they take. The
    /// tick measures its own lateness, and a whole period of it is a fault.
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

    /// With the host in the loop, thread mode is the host's line: it moves time on when
    /// every task waits. What runs there otherwise has an executor of its own.
    #[cfg(feature = "hil")]
    #[cortex_m_rt::entry]
    fn main() -> ! {
        let (channels, host) = rtt::init();
        hil::serve(host, &EXCHANGE, || {
            interrupt::UART4.set_priority(Priority::P15);
            THREADS.start(interrupt::UART4).spawn(boot(channels).unwrap());
        })
    }

    /// In the place of the thread executor.
    #[cfg(feature = "hil")]
    static THREADS: InterruptExecutor = InterruptExecutor::new();

    #[cfg(feature = "hil")]
    #[embassy_stm32::interrupt]
    unsafe fn UART4() {
        // SAFETY: as for UART5.
        unsafe { THREADS.on_interrupt() }
    }

    #[cfg(feature = "hil")]
    #[embassy_executor::task]
    async fn boot(channels: Channels) {
        // SAFETY: a task's context is always the executor's.
        begin(unsafe { Spawner::for_current_executor().await }, channels);
    }

    /// Starts everything.
    fn begin(threads: Spawner, channels: Channels) {
        let p = embassy_stm32::init(board::clocks());
        let waited = supply::watch();
        // Before anything that it may have damaged.
        let image = image::verify();
        defmt::info!("interstage {=str}", env!("CARGO_PKG_VERSION"));
        let restart = retained::report(waited);
        EXCHANGE.log(Entry { at: 0, event: Event::Restart(restart) });
        guard::arm();
        let (console, line) = (channels.console, channels.line);
        let (mut parts, lamp, pages) = split(p, console, channels.telemetry);
        parts.watchdog.place = restart.place();
        threads.spawn(light::show(lamp).unwrap());
        match image {
            Some(sealed) => threads.spawn(image::watch(sealed).unwrap()),
            None => return config::hold(threads, parts, Held::Image),
        }
        let (constants, service) = config::build(pages);
        threads.spawn(link(HostLine::new(line), service).unwrap());
        match constants {
            Ok((controller, planner, identity)) => {
                parts.journal.introduce(identity);
                start(threads, parts, controller, planner);
            }
            Err(error) => config::hold(threads, parts, Held::Parameters(error)),
        }
    }

    /// Who gets which peripheral and pin; the bridges come up off.
    #[cfg(not(feature = "hil"))]
    fn split(p: Peripherals, console: DownChannel, frames: Frames) -> (Parts<Nucleo>, Pin, Pages) {
        let parts = Parts {
            wheel: Wheel::new(p.TIM5, p.PA0, p.PA1),
            load_cell: Analog::new(
                (p.ADC1, pac::ADC1),
                p.PC2,
                (p.DMA1_CH1, pac::DMA1.ch(0)),
                &LOAD_CELL,
            ),
            tread: Analog::new((p.ADC2, pac::ADC2), p.PC3, (p.DMA1_CH2, pac::DMA1.ch(1)), &TREAD),
            arm: Angle::new(p.SPI1, (p.PB3, p.PA7, p.PA6), p.PB10),
            motors: Bridges {
                drive: Bridge::new((p.TIM1, pac::TIM1), p.PA8, p.PA9.into(), p.PA10.into(), p.PB12),
                preload: Bridge::new((p.TIM8, pac::TIM8), p.PC6, p.PC8.into(), p.PC9.into(), p.PB7),
                readback: Readback::new((p.ADC3, pac::ADC3), p.PB0, p.PB1),
            },
            watchdog: Guard::new(p.IWDG),
            button: Button::new(p.PC13, p.EXTI13),
            console: Console::new(console),
            journal: Lines::new(frames, Checksum::new(p.CRC)),
            light: Lamp,
        };
        (parts, p.PA5.into(), Pages::new(p.FLASH))
    }

    /// Hands every part to its task.
    fn start(
        threads: Spawner,
        mut parts: Parts<Nucleo>,
        controller: &'static Controller,
        planner: &'static Planner,
    ) {
        interrupt::UART5.set_priority(Priority::P6);
        let control = CONTROL.start(interrupt::UART5);
        parts.watchdog.start();
        control.spawn(speed(parts.wheel).unwrap());
        control.spawn(pressure(parts.load_cell).unwrap());
        control.spawn(displacement(parts.tread).unwrap());
        control.spawn(angle(parts.arm).unwrap());
        let latest = LATEST.init(Latest::default());
        control.spawn(motors(parts.motors, parts.watchdog, controller, latest).unwrap());
        control.spawn(tape(latest).unwrap());
        threads.spawn(model(planner).unwrap());
        threads.spawn(pressed(parts.button).unwrap());
        threads.spawn(typed(parts.console).unwrap());
        threads.spawn(journal(parts.journal, parts.light).unwrap());
    }

    #[embassy_executor::task]
    async fn speed(wheel: Wheel) -> ! {
        tasks::speed(wheel, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn pressure(input: <Nucleo as Board>::LoadCell) -> ! {
        tasks::pressure(input, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn displacement(input: <Nucleo as Board>::Tread) -> ! {
        tasks::displacement(input, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn angle(bus: Angle) -> ! {
        tasks::angle(bus, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn motors(
        motors: Bridges,
        watchdog: Guard,
        controller: &'static Controller,
        latest: &'static Latest,
    ) -> ! {
        tasks::motors(motors, watchdog, controller, latest, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn tape(latest: &'static Latest) -> ! {
        tasks::tape(latest, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn model(planner: &'static Planner) -> ! {
        tasks::model(planner, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn pressed(button: Button) -> ! {
        tasks::operator(button, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn typed(console: Console) -> ! {
        tasks::operator(console, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn link(line: HostLine, service: Service<Pages>) -> ! {
        tasks::link(line, service, &EXCHANGE).await
    }

    #[embassy_executor::task]
    async fn journal(journal: Lines, light: Lamp) -> ! {
        tasks::journal(journal, light, SCRIBE.take(), &EXCHANGE).await
    }
}
