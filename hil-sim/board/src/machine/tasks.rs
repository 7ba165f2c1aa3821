//! The running task: the executor polls each through the same kind of function, with a
//! pointer into the task's own memory.

use interstage::sense::raw::SensorId;

use crate::elf::Loaded;
use crate::thumb;

/// Part of the names of the functions through which tasks are polled.
const POLL: &str = "TaskStorage<F>::poll";
/// Name of the memory of a task inside the function that spawns it.
const POOL: &str = "POOL";
/// Name of the task that runs once for each sensor of [`SensorId::ANALOG`], in their order.
const ANALOG: &str = "analog";

/// The tasks of an image.
#[derive(Clone, Debug, Default)]
pub struct Tasks {
    /// Address of a task's memory, and its name, in the order of the addresses.
    pools: Vec<(u32, String)>,
    /// Where a poll begins.
    polls: Vec<u32>,
    /// Where it has returned to the executor.
    ends: Vec<u32>,
}

impl Tasks {
    /// Finds the tasks by the symbols of an image.
    pub(super) fn of(image: &Loaded) -> Self {
        let mut pools: Vec<(u32, String)> = image
            .symbols()
            .filter_map(|(symbol, at, size)| {
                let name = format!("{:#}", rustc_demangle::demangle(symbol));
                let task = name.strip_suffix(POOL)?.trim_end_matches(':').rsplit("::").next()?;
                let names = match task.trim_start_matches('_') {
                    ANALOG => SensorId::ANALOG.map(analog).into(),
                    one => vec![one.to_owned()],
                };
                let each = size / names.len() as u32;
                Some((at..).step_by(each.max(1) as usize).zip(names))
            })
            .flatten()
            .collect();
        pools.sort();
        let polls = image.functions.iter().filter(|f| f.name.contains(POLL));
        let polls = polls.map(|f| f.range.start).collect();
        Self { pools, polls, ends: ends(image) }
    }

    /// Every address to be marked.
    pub(super) fn marks(&self) -> impl Iterator<Item = u32> {
        self.polls.iter().chain(&self.ends).copied()
    }

    /// The task that begins at `address` with this pointer; none where one ends.
    pub(super) fn begins(&self, address: u32, pointer: u32) -> Option<usize> {
        if !self.polls.contains(&address) {
            return None;
        }
        self.pools.partition_point(|(at, _)| *at <= pointer).checked_sub(1)
    }

    pub fn polls(&self) -> &[u32] {
        &self.polls
    }

    /// Names, by the numbers in the profile.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.pools.iter().map(|(_, name)| name.as_str())
    }
}

/// Name of the task of a sensor of [`SensorId::ANALOG`].
fn analog(sensor: SensorId) -> String {
    SensorId::NAMES[sensor as usize].replace(' ', "_")
}

/// Addresses after calls through a register in the executor's functions.
fn ends(image: &Loaded) -> Vec<u32> {
    let executor = |name: &str| {
        name.contains("Executor::poll")
            || name.contains("Executor::on_interrupt")
            || name.contains("Executor::run")
            || name.contains("UART5")
            || name.contains("main")
    };
    let mut found = Vec::new();
    for function in image.functions.iter().filter(|f| executor(&f.name)) {
        let base = crate::elf::FLASH.base;
        let bytes = (function.range.start - base) as usize..(function.range.end - base) as usize;
        let code = image.flash.get(bytes).unwrap_or_default();
        for (address, instruction, _) in thumb::sweep(code, function.range.start) {
            let at = (address - function.range.start) as usize;
            let half = u16::from_le_bytes([code[at], code[at + 1]]);
            // BLX Rm.
            if instruction.size == 2 && half & 0xFF87 == 0x4780 {
                found.push(address + 2);
            }
        }
    }
    found
}
