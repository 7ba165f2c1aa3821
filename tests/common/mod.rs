//! Virtual time, mocked board and task runner for the tests of the async tasks.

pub(crate) mod mutate;

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::future::{Future, pending, poll_fn};
use std::pin::Pin;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use interstage::hal::{
    AnalogInput, AngleBus, CommandSource, Indicator, Journal, Light, Motors, Watchdog, WheelEncoder,
};
use interstage::params::Refusal;
use interstage::params::slots::{SLOT_BYTES, SetMemory, Slot};
use interstage::restart::DriveSnapshot;
use interstage::rig::Rig;
use interstage::sense::raw::{
    AdcCode, AngleFrame, BridgeCode, BridgeCodes, BusFault, EncoderCount,
};
use interstage::supervise::{Command, Lag};
use interstage::tick::Entry;
use interstage::units::MotorCommand;

/// The process has one clock: one bench at a time.
static CLOCK: Mutex<()> = Mutex::new(());

/// Whether the running task has woken itself.
struct Again(AtomicBool);

impl Wake for Again {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs tasks under virtual time, always in the same order, from time 0.
pub(crate) struct Bench {
    tasks: Vec<Pin<Box<dyn Future<Output = ()>>>>,
    _clock: MutexGuard<'static, ()>,
}

impl Bench {
    /// Resolution of the virtual time.
    pub(crate) const STEP: Duration = Duration::from_micros(250);

    pub(crate) fn new() -> Self {
        let clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
        MockDriver::get().reset();
        Self { tasks: Vec::new(), _clock: clock }
    }

    /// Adds a task; those added first run first in each step.
    pub(crate) fn spawn(&mut self, task: impl Future<Output = ()> + 'static) {
        self.tasks.push(Box::pin(task));
    }

    /// Lets every task run once, and those again that have woken themselves meanwhile.
    pub(crate) fn poll(&mut self) {
        let again = Arc::new(Again(AtomicBool::new(false)));
        let waker = Waker::from(again.clone());
        let mut context = Context::from_waker(&waker);
        for task in &mut self.tasks {
            again.0.store(true, Ordering::Relaxed);
            while again.0.swap(false, Ordering::Relaxed) {
                assert_eq!(task.as_mut().poll(&mut context), Poll::Pending, "a task returned");
            }
        }
    }

    /// Lets the tasks run for so many milliseconds.
    pub(crate) fn run_ms(&mut self, milliseconds: u64) {
        self.poll();
        let end = Instant::now() + Duration::from_millis(milliseconds);
        while Instant::now() < end {
            MockDriver::get().advance(Self::STEP);
            self.poll();
        }
    }

    /// Lets time pass in which no task gets the processor.
    pub(crate) fn freeze_ms(&mut self, milliseconds: u64) {
        MockDriver::get().advance(Duration::from_millis(milliseconds));
    }
}

/// The present time, whole ms.
pub(crate) fn now_ms() -> u32 {
    Instant::now().as_millis() as u32
}

/// Something that lives as long as the test process, as a `static` would.
pub(crate) fn forever<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

/// What a mocked sensor does when it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Answer {
    /// Gives this code after the delay.
    Code(u16),
    /// Fails after the delay.
    Fault(BusFault),
    /// Never comes back.
    Hang,
}

/// A mocked sensor; clones share their script.
#[derive(Clone)]
pub(crate) struct Sensor(Rc<SensorScript>);

/// Script and record of a [`Sensor`].
pub(crate) struct SensorScript {
    pub(crate) answer: Cell<Answer>,
    pub(crate) delay: Cell<Duration>,
    alive: Cell<bool>,
    /// Times at which it was read, ms.
    pub(crate) reads: RefCell<Vec<u32>>,
}

impl Sensor {
    pub(crate) fn new(code: u16) -> Self {
        Self(Rc::new(SensorScript {
            answer: Cell::new(Answer::Code(code)),
            delay: Cell::new(Duration::from_ticks(0)),
            alive: Cell::new(false),
            reads: RefCell::default(),
        }))
    }

    pub(crate) fn answers(&self, answer: Answer) {
        self.0.answer.set(answer);
    }

    pub(crate) fn takes(&self, delay: Duration) {
        self.0.delay.set(delay);
    }

    pub(crate) fn reads(&self) -> Vec<u32> {
        self.0.reads.borrow().clone()
    }

    fn read(&self) -> Answer {
        self.0.reads.borrow_mut().push(now_ms());
        self.0.answer.get()
    }

    /// A sensor whose last bit toggles, as that of a real converter.
    pub(crate) fn alive(code: u16) -> Self {
        let sensor = Self::new(code);
        sensor.0.alive.set(true);
        sensor
    }

    fn bits(&self, code: u16) -> u16 {
        code ^ (self.0.reads.borrow().len() as u16 & u16::from(self.0.alive.get()))
    }

    async fn answer(&self) -> Result<u16, BusFault> {
        let answer = self.read();
        if self.0.delay.get() > Duration::from_ticks(0) {
            Timer::after(self.0.delay.get()).await;
        }
        match answer {
            Answer::Code(code) => Ok(code),
            Answer::Fault(fault) => Err(fault),
            Answer::Hang => pending().await,
        }
    }
}

impl AnalogInput for Sensor {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        self.answer().await.map(|code| AdcCode::new(self.bits(code)))
    }
}

impl AngleBus for Sensor {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        self.answer().await.map(AngleFrame::new)
    }
}

impl WheelEncoder for Sensor {
    fn count(&mut self) -> EncoderCount {
        match self.read() {
            Answer::Code(code) => EncoderCount::new(code),
            other => panic!("a counter cannot answer {other:?}"),
        }
    }
}

/// Records what was written to it, with the time; clones share the record.
pub(crate) struct Record<T>(Rc<RefCell<Vec<(u32, T)>>>);

impl<T> Clone for Record<T> {
    fn clone(&self) -> Self {
        Self(Rc::clone(&self.0))
    }
}

impl<T> Default for Record<T> {
    fn default() -> Self {
        Self(Rc::default())
    }
}

impl<T: Clone> Record<T> {
    pub(crate) fn push(&self, item: T) {
        self.0.borrow_mut().push((now_ms(), item));
    }

    pub(crate) fn all(&self) -> Vec<(u32, T)> {
        self.0.borrow().clone()
    }

    pub(crate) fn items(&self) -> Vec<T> {
        self.0.borrow().iter().map(|(_, item)| item.clone()).collect()
    }

    pub(crate) fn times(&self) -> Vec<u32> {
        self.0.borrow().iter().map(|(at, _)| *at).collect()
    }

    pub(crate) fn clear(&self) {
        self.0.borrow_mut().clear();
    }
}

/// Mocked bridges with an emergency stop; clones share the record and the contact.
#[derive(Clone, Default)]
pub(crate) struct Bridges {
    pub(crate) applied: Record<(MotorCommand, MotorCommand)>,
    /// The contact is open now.
    pub(crate) open: Rc<Cell<bool>>,
    /// It has cut the bridges.
    pub(crate) cut: Rc<Cell<bool>>,
    /// Duties that both take, and their outputs behind the low-pass.
    outputs: Rc<Cell<[(i16, Lag); 2]>>,
    /// Nothing is converted any more.
    pub(crate) mute: Rc<Cell<bool>>,
    /// The pre-tightener takes this duty whatever it is given, while it is on.
    pub(crate) runaway_preload: Rc<Cell<Option<i16>>>,
}

impl Motors for Bridges {
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand) {
        self.applied.push((drive, preload));
        let taken = |command: MotorCommand| {
            if command.enable { command.duty.to_bits() } else { 0 }
        };
        let [(_, one), (_, other)] = self.outputs.get();
        let runaway = self.runaway_preload.get().filter(|_| preload.enable);
        self.outputs.set([(taken(drive), one), (runaway.unwrap_or(taken(preload)), other)]);
    }

    fn readback(&mut self) -> Option<BridgeCodes> {
        let [(drive, mut one), (preload, mut other)] = self.outputs.get();
        let codes = BridgeCodes {
            drive: BridgeCode::of(one.step(drive.into())),
            pretightener: BridgeCode::of(other.step(preload.into())),
        };
        self.outputs.set([(drive, one), (preload, other)]);
        (!self.mute.get()).then_some(codes)
    }

    fn stopped(&mut self) -> bool {
        self.cut.set(self.cut.get() || self.open.get());
        self.cut.get()
    }

    fn rearm(&mut self) {
        self.cut.set(self.open.get());
    }
}

/// A mocked watchdog with the place that a restart finds; clones share both.
#[derive(Clone, Default)]
pub(crate) struct Dog {
    pub(crate) fed: Record<()>,
    pub(crate) kept: Record<DriveSnapshot>,
}

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.fed.push(());
    }

    fn keep(&mut self, snapshot: &DriveSnapshot) {
        self.kept.push(*snapshot);
    }
}

impl Journal for Record<Entry> {
    fn write(&mut self, entry: &Entry) {
        self.push(*entry);
    }
}

impl Indicator for Record<Light> {
    fn show(&mut self, light: Light) {
        self.push(light);
    }
}

/// A mocked operator; clones share the queue.
#[derive(Clone, Default)]
pub(crate) struct Operator {
    queue: Rc<RefCell<VecDeque<Command>>>,
    /// How long a gesture takes until its command is known.
    gesture: Duration,
}

impl Operator {
    pub(crate) fn slow(gesture: Duration) -> Self {
        Self { gesture, ..Self::default() }
    }

    pub(crate) fn gives(&self, commands: &[Command]) {
        self.queue.borrow_mut().extend(commands);
    }

    /// Commands not yet fetched.
    pub(crate) fn left(&self) -> usize {
        self.queue.borrow().len()
    }
}

impl CommandSource for Operator {
    async fn next(&mut self) -> Command {
        let queue = Rc::clone(&self.queue);
        let command = poll_fn(move |_| match queue.borrow_mut().pop_front() {
            Some(command) => Poll::Ready(command),
            None => Poll::Pending,
        })
        .await;
        if self.gesture > Duration::from_ticks(0) {
            Timer::after(self.gesture).await;
        }
        command
    }
}

/// Flash that holds whatever it is given and cannot be changed.
pub(crate) struct FixedFlash(pub(crate) [Vec<u8>; 2]);

impl FixedFlash {
    pub(crate) fn blank() -> Self {
        Self([vec![0xFF; SLOT_BYTES], vec![0xFF; SLOT_BYTES]])
    }
}

impl SetMemory for FixedFlash {
    fn bytes(&self, slot: Slot) -> &[u8] {
        &self.0[slot as usize]
    }

    async fn erase(&mut self, _: Slot, _: usize) -> Result<(), Refusal> {
        Err(Refusal::Flash)
    }

    async fn program(&mut self, _: Slot, _: usize, _: [u8; 8]) -> Result<(), Refusal> {
        Err(Refusal::Flash)
    }
}

/// Code of an unloaded analogue sensor: 5 % of the converter.
pub(crate) const UNLOADED: u16 = 3277;

/// Code of the prototype's preload sensor under a force, N.
pub(crate) fn preload_sensor_code(force_n: f64) -> u16 {
    let part = 0.05 + 0.85 * force_n / Rig::prototype().sense.preload_full_scale_n;
    (65_535.0 * part).round() as u16
}

/// Frame of the prototype's angle sensor with the wheel on the wall of `level`.
pub(crate) fn arm_frame(level: usize) -> u16 {
    let rig = Rig::prototype();
    let sine = (rig.centre_radius_mm(level) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
    let codes = sine.asin() / (2.0 * std::f64::consts::PI) * 16_384.0;
    let code = (codes + rig.sense.angle_zero_code).round() as u16;
    code | ((code.count_ones() % 2) as u16) << 15
}
