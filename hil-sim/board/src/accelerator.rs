//! What the flash costs at the full clock: its wait states, behind prefetch and caches.
//!
//! A read of a double word of 64 bits takes the wait states beyond its cycle. Sixteen-bit
//! instructions come four to a double word, so straight code would stand still half of the time:
//! the prefetch reads the next double word while the core executes this one, and two caches
//! of 256-bit lines keep what was read, of instructions 32 lines, of data 8. Each replaces the
//! line that was not used for longest.
//!
//! The waits are counted beside the textbook cycles and do not delay the emulated program.
//!
//! Assumptions, where the manual is silent: a prefetched double word is there when its read is
//! over, one that the core waits for a cycle earlier; a line is filled double word by double
//! word, as they are needed or prefetched; a data read waits for a read that has begun; a branch
//! waits for a prefetch that it does not need. What the core itself fetches ahead is not modelled.
//!
//! Source: RM0440, 3.3.3 (wait states) and 3.3.4 (prefetch, instruction and data cache).

/// Bytes that the flash reads at once.
pub(crate) const WORD: u32 = 8;
/// Wait states at 170 MHz in range 1 with boost. Source: RM0440, table of wait states.
pub(crate) const WAIT_STATES: u64 = 4;
/// Lines of the caches.
const CODE_LINES: usize = 32;
const DATA_LINES: usize = 8;
/// Bytes of a line.
const LINE: u32 = 32;

/// A line: its address, and which of its double words it holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Line {
    /// Address, divided by [`LINE`].
    number: u32,
    /// A bit a double word; 0 is an empty line.
    held: u8,
}

/// A cache, the line used last first.
#[derive(Clone, Debug)]
struct Cache<const LINES: usize>([Line; LINES]);

impl<const LINES: usize> Default for Cache<LINES> {
    fn default() -> Self {
        Self([Line::default(); LINES])
    }
}

impl<const LINES: usize> Cache<LINES> {
    /// Whether it holds this double word; if so, its line is the one used last.
    fn has(&mut self, word: u32) -> bool {
        let (number, bit) = place(word);
        let found = self.0.iter().position(|line| line.number == number && line.held != 0);
        if let Some(at) = found {
            self.0[..=at].rotate_right(1);
        }
        found.is_some() && self.0[0].held & bit != 0
    }

    /// Keeps a double word that was read.
    fn keep(&mut self, word: u32) {
        let (number, bit) = place(word);
        if !(self.0[0].number == number && self.0[0].held != 0) {
            let found = self.0.iter().position(|line| line.number == number && line.held != 0);
            self.0[..=found.unwrap_or(LINES - 1)].rotate_right(1);
            if found.is_none() {
                self.0[0] = Line { number, held: 0 };
            }
        }
        self.0[0].held |= bit;
    }
}

/// Number of a double word's line, and its bit in it.
const fn place(word: u32) -> (u32, u8) {
    (word / LINE, 1 << (word % LINE / WORD))
}

/// The flash's interface as the core sees it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Accelerator {
    code: Cache<CODE_LINES>,
    data: Cache<DATA_LINES>,
    /// Double word from which the core executes.
    current: u32,
    /// The one that is being prefetched or was, and the time at which it is there.
    ahead: Option<(u32, u64)>,
    /// Time at which the flash has ended its read.
    free: u64,
    /// Cycles waited so far.
    pub(crate) waits: u64,
}

impl Accelerator {
    /// The core executes from this double word, `now` textbook cycles after the start.
    pub(crate) fn execute(&mut self, word: u32, now: u64) {
        let word = word & !(WORD - 1);
        if word == self.current {
            return;
        }
        self.current = word;
        let mut now = now + self.waits;
        let ahead = self.ahead.take_if(|(there, _)| *there == word);
        if let Some((_, ready)) = ahead {
            self.wait(&mut now, ready);
            self.code.keep(word);
        } else if !self.code.has(word) {
            let ready = self.read(now);
            self.wait(&mut now, ready);
            self.code.keep(word);
        }
        let next = word + WORD;
        if self.ahead.is_none_or(|(there, _)| there != next) && !self.code.has(next) {
            // From now on, or from the end of another read.
            let begins = now.max(self.free);
            self.free = begins + 1 + WAIT_STATES;
            self.ahead = Some((next, self.free));
        }
    }

    /// The core reads data from this double word.
    pub(crate) fn load(&mut self, word: u32, now: u64) {
        let word = word & !(WORD - 1);
        if !self.data.has(word) {
            let mut now = now + self.waits;
            let ready = self.read(now);
            self.wait(&mut now, ready);
            self.data.keep(word);
        }
    }

    /// Time at which a read that is requested now is there.
    fn read(&mut self, now: u64) -> u64 {
        self.free = now.max(self.free) + 1 + WAIT_STATES;
        // Its first cycle is the textbook's.
        self.free - 1
    }

    fn wait(&mut self, now: &mut u64, ready: u64) {
        let waited = ready.saturating_sub(*now);
        self.waits += waited;
        *now += waited;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: u32 = 0x0800_1000;

    /// Waits of code that takes so many cycles in each of these double words.
    fn waits(flash: &mut Accelerator, words: impl IntoIterator<Item = u32>, cycles: u64) -> u64 {
        let before = flash.waits;
        for (index, word) in words.into_iter().enumerate() {
            flash.execute(CODE + WORD * word, 1_000_000 + cycles * index as u64);
        }
        flash.waits - before
    }

    #[test]
    fn straight_code_waits_for_what_the_prefetch_cannot_hide() {
        // Five cycles a read: four instructions hide all but one, five all. The first prefetch
        // begins a cycle later, when the flash has ended the read that the core waited for.
        for (cycles, first, each) in [(2, 4, 3), (4, 2, 1), (5, 1, 0), (9, 0, 0)] {
            let waited = waits(&mut Accelerator::default(), 0..11, cycles);
            assert_eq!(waited, WAIT_STATES + first + 9 * each, "{cycles} cycles each");
        }
    }

    #[test]
    fn a_loop_that_fits_the_cache_waits_once() {
        let mut flash = Accelerator::default();
        assert!(waits(&mut flash, 0..128, 4) > 0);
        assert_eq!(waits(&mut flash, (0..128).chain(0..128), 4), 0, "1 KiB");
        // One line more, and each round finds every line replaced.
        let mut flash = Accelerator::default();
        let first = waits(&mut flash, 0..132, 4);
        assert!(waits(&mut flash, 0..132, 4) >= first - WAIT_STATES);
    }

    #[test]
    fn a_jump_waits_for_its_target_and_for_the_read_that_has_begun() {
        let mut flash = Accelerator::default();
        flash.execute(CODE, 1000);
        assert_eq!(flash.waits, WAIT_STATES);
        // The prefetch of the next double word begins as the core goes on, and takes its five.
        flash.execute(CODE + 0x400, 1001);
        assert_eq!(flash.waits, WAIT_STATES + (1 + WAIT_STATES) + WAIT_STATES);
    }

    #[test]
    fn data_is_read_once_while_eight_lines_hold_it() {
        let mut flash = Accelerator::default();
        let mut now = 0;
        let mut load = |line: u32| {
            let before = flash.waits;
            now += 1000;
            flash.load(CODE + LINE * line, now);
            flash.waits - before
        };
        for line in 0..8 {
            assert_eq!(load(line), WAIT_STATES);
        }
        assert_eq!(load(0), 0);
        assert_eq!(load(8), WAIT_STATES, "line 1 goes, line 0 was used since");
        assert_eq!((load(0), load(1)), (0, WAIT_STATES));
    }
}
