//! Log entries as lines on the debug probe, and the binary log beside them.

use defmt::{error, info, warn};
use heapless::Vec;
use interstage::estimate::ContactStage;
use interstage::hal::Journal;
use interstage::log::{Identity, Record};
use interstage::model::LimitedBy;
use interstage::supervise::{Mode, ServiceDuties};
use interstage::tasks::TickCycles;
use interstage::tick::{CrossingRecord, Entry, Event};
use interstage::units::{Direction, Duty, Q16, Tick};
use micromath::statistics::{Mean, StdDev};
use static_cell::ConstStaticCell;

use super::rtt::{self, Frames};

/// Writes entries as text and reports lost ones; passes frames on.
pub(crate) struct TextLog {
    frames: Frames,
    identity: Identity,
    lost: u32,
    /// Raw codes of preload and compression sensor while their zeros are taken.
    zeroing: &'static mut [Vec<u16, ZERO_CODES>; 2],
}

/// Most codes behind the line on the zeros: as many as are averaged.
const ZERO_CODES: usize = 256;

impl TextLog {
    /// Text on the log's channel, frames on their own.
    pub(crate) fn new(frames: Frames) -> Self {
        static ZEROING: ConstStaticCell<[Vec<u16, ZERO_CODES>; 2]> =
            ConstStaticCell::new([const { Vec::new() }; 2]);
        Self { frames, identity: Identity::default(), lost: 0, zeroing: ZEROING.take() }
    }

    /// Sets the head of the binary log; before the journal starts.
    pub(crate) fn set_identity(&mut self, identity: Identity) {
        self.identity = identity;
    }
}

impl Journal for TextLog {
    fn send(&mut self, frame: &[u8]) -> bool {
        self.frames.send(frame)
    }

    fn write_cycles(&mut self, at: Tick, TickCycles { mean, most }: TickCycles) {
        info!("[{=u32} ms] tick: {=u32} cycles on average, {=u32} at most", at, mean, most);
    }

    fn see(&mut self, record: &Record) {
        let [preload, compression] = self.zeroing;
        if record.telemetry.mode == Mode::Zero {
            // Beyond the last one none is kept.
            let _ = preload.push(record.codes[1]);
            let _ = compression.push(record.codes[2]);
        } else if !preload.is_empty() {
            info!(
                "[{=u32} ms] zero: preload {=f32} +- {=f32}, compression {=f32} +- {=f32} codes",
                record.telemetry.at,
                preload.iter().copied().map(f32::from).mean(),
                preload.as_slice().stddev(),
                compression.iter().copied().map(f32::from).mean(),
                compression.as_slice().stddev()
            );
            preload.clear();
            compression.clear();
        }
    }

    fn identity(&self) -> Identity {
        self.identity.clone()
    }

    fn write(&mut self, entry: &Entry) {
        let lost = rtt::lost();
        if lost != self.lost {
            warn!("{=u32} lines lost: the probe reads too slowly", lost.wrapping_sub(self.lost));
            self.lost = lost;
        }
        let at = entry.at;
        match entry.event {
            Event::Mode(Mode::FaultHold(fault)) => {
                error!("[{=u32} ms] mode: fault hold, {=u16}", at, fault.code());
            }
            Event::Mode(mode) => info!("[{=u32} ms] mode: {=str}", at, mode.words()),
            Event::Stage(stage) => {
                info!("[{=u32} ms] stage {=u8}: {=str}", at, stage as u8, of_stage(stage));
            }
            Event::Command(command) => info!("[{=u32} ms] {=str}", at, command.word()),
            Event::Refused(command) => {
                warn!("[{=u32} ms] refused in this mode: {=str}", at, command.word());
            }
            Event::Fault(fault) => {
                error!("[{=u32} ms] fault {=u16}: {=str}", at, fault.code(), fault.sentence());
            }
            Event::Limit(limit) => {
                warn!("[{=u32} ms] limit {=u16}: {=str}", at, limit.code(), limit.sentence());
            }
            Event::Lost(entries) => warn!("[{=u32} ms] {=u32} log entries lost", at, entries),
            Event::Crossing(record) => crossing(at, &record),
            Event::Service(ServiceDuties { drive, pretightener }) => {
                let percent = |duty: Duty| i32::from(duty.to_bits()) * 100 / 32_768;
                info!(
                    "[{=u32} ms] service: drive {=i32} %, pre-tightener {=i32} %",
                    at,
                    percent(drive),
                    percent(pretightener)
                );
            }
            Event::Slip(slip) => {
                let value = Q16::to_num::<f32>;
                warn!(
                    "[{=u32} ms] slipped {=f32} mm (one sigma {=f32}) at {=f32} mm",
                    at,
                    value(slip.amount),
                    value(slip.sigma),
                    value(slip.position)
                );
            }
            // Logged by the start, before the journal ran.
            Event::Restart(_) => {}
        }
    }
}

/// The ledger line in physical units.
fn crossing(at: u32, record: &CrossingRecord) {
    let value = Q16::to_num::<f32>;
    let direction = if record.direction == Direction::Deploy { "deploying" } else { "retracting" };
    info!(
        "[{=u32} ms] step {=u8} {=str}: at {=f32} mm ({=f32} off), {=f32} mm/s, preload {=f32} N (peak {=f32}) {=f32} s ahead, tread {=f32} mm, gap {=f32} mm (predicted {=f32}), slip margin {=f32}, stiffness x{=f32}, limited by {=str}",
        at,
        record.index,
        direction,
        value(record.position),
        value(record.residual),
        value(record.speed),
        value(record.preload),
        value(record.peak_preload),
        value(record.lead_time),
        value(record.compression),
        value(record.gap_measured),
        value(record.gap_predicted),
        value(record.slip_margin),
        value(record.stiffness_scale),
        record.limited_by.map_or("no plan", LimitedBy::words),
    );
}

fn of_stage(stage: ContactStage) -> &'static str {
    match stage {
        ContactStage::Initial => "initial",
        ContactStage::Preloaded => "preloaded",
        ContactStage::StaticFriction => "static friction",
        ContactStage::Sliding => "sliding on the corner",
        ContactStage::Rolling => "rolling over the corner",
        ContactStage::Continuous => "continuous wall",
    }
}
