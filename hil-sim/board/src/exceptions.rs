//! Exceptions of the core: pending, enabled, active, and the next one.
//!
//! Source: ARMv7-M Architecture Reference Manual, B1.5 and B3.4.

/// Exceptions of this chip: 16 of the core and 102 interrupts.
const COUNT: usize = 16 + 102;

/// Exceptions with a number of their own in the architecture.
pub mod number {
    /// Non-maskable interrupt.
    pub(crate) const NMI: u8 = 2;
    pub(crate) const HARD_FAULT: u8 = 3;
    pub(crate) const MEM_MANAGE: u8 = 4;
    pub(crate) const BUS_FAULT: u8 = 5;
    pub(crate) const USAGE_FAULT: u8 = 6;
    pub(crate) const SV_CALL: u8 = 11;
    /// Pendable service.
    pub(crate) const PEND_SV: u8 = 14;
    pub(crate) const SYS_TICK: u8 = 15;
    /// First interrupt of the chip.
    pub const INTERRUPT: u8 = 16;
}

/// Priority of thread mode: less urgent than any that can be set.
const THREAD: i16 = 256;
/// Bits of a priority that this chip implements.
const PRIORITY_BITS: u8 = 0xF0;

/// State of every exception.
#[derive(Clone, Debug)]
pub struct Exceptions {
    pending: u128,
    enabled: u128,
    lines: u128,
    /// Active ones, the running one at the end.
    active: Vec<u8>,
    priorities: [u8; COUNT],
    /// `PRIGROUP`: bits of a priority, from 0 to this, that do not preempt.
    group: u8,
    urgent: Option<(u8, i16)>,
    /// The event register.
    pub event: bool,
}

impl Default for Exceptions {
    fn default() -> Self {
        Self {
            pending: 0,
            // What the architecture numbers is always enabled; whether a fault is, its
            // handler control decides before it becomes pending.
            enabled: 0xFFFF,
            lines: 0,
            active: Vec::new(),
            priorities: [0; COUNT],
            group: 0,
            urgent: None,
            event: false,
        }
    }
}

fn bits(mut set: u128) -> impl Iterator<Item = u8> {
    std::iter::from_fn(move || {
        let next = set.trailing_zeros();
        set &= set.wrapping_sub(1);
        (next < 128).then_some(next as u8)
    })
}

/// Word `word` of the interrupts in a set of exceptions.
const fn interrupts(set: u128, word: u32) -> u32 {
    (set >> (16 + 32 * word)) as u32
}

impl Exceptions {
    pub fn pend(&mut self, number: u8) {
        if usize::from(number) < COUNT {
            self.pending |= 1 << number;
            self.refresh();
        }
    }

    pub fn clear(&mut self, number: u8) {
        self.pending &= !(1 << number);
        self.refresh();
    }

    /// Sets the level of an interrupt line. While it is high the interrupt becomes
    /// pending again as soon as it is not active.
    pub(crate) fn set_line(&mut self, interrupt: u8, high: bool) {
        let number = number::INTERRUPT + interrupt;
        if !high {
            self.lines &= !(1 << number);
        } else if self.lines >> number & 1 == 0 {
            self.lines |= 1 << number;
            if !self.active.contains(&number) {
                self.pend(number);
            }
        }
    }

    /// Enables or disables interrupts by a word of the enable registers.
    pub fn enable(&mut self, word: u32, set: u32, on: bool) {
        let mask = u128::from(set) << (16 + 32 * word);
        if on {
            self.enabled |= mask;
        } else {
            self.enabled &= !mask;
        }
        self.refresh();
    }

    /// Word `word` of the enable registers.
    pub fn enabled(&self, word: u32) -> u32 {
        interrupts(self.enabled, word)
    }

    /// Word `word` of the pending registers.
    pub fn pending(&self, word: u32) -> u32 {
        interrupts(self.pending, word)
    }

    /// Word `word` of the active registers.
    pub fn active(&self, word: u32) -> u32 {
        interrupts(self.active.iter().fold(0, |set, number| set | 1 << number), word)
    }

    /// Whether an exception is pending.
    pub(crate) fn is_pending(&self, number: u8) -> bool {
        self.pending >> number & 1 != 0
    }

    /// The exception that runs; 0 in thread mode.
    pub fn running(&self) -> u8 {
        self.active.last().copied().unwrap_or(0)
    }

    /// How many are active.
    pub(crate) fn depth(&self) -> usize {
        self.active.len()
    }

    /// Sets the priority of an exception, of which the chip keeps the upper four bits.
    pub(crate) fn set_priority(&mut self, number: u8, priority: u8) {
        if let Some(kept) = self.priorities.get_mut(usize::from(number)) {
            *kept = priority & PRIORITY_BITS;
            self.refresh();
        }
    }

    /// The priority of an exception.
    pub(crate) fn priority_set(&self, number: u8) -> u8 {
        self.priorities.get(usize::from(number)).copied().unwrap_or(0)
    }

    /// Sets `PRIGROUP`.
    pub(crate) fn set_group(&mut self, group: u8) {
        self.group = group & 7;
        self.refresh();
    }

    /// `PRIGROUP`.
    pub(crate) fn group(&self) -> u8 {
        self.group
    }

    /// Priority with all its bits.
    fn priority(&self, number: u8) -> i16 {
        match number {
            number::NMI => -2,
            number::HARD_FAULT => -1,
            _ => i16::from(self.priorities[usize::from(number)]),
        }
    }

    /// The part of a priority that preempts.
    fn preempts(&self, number: u8) -> i16 {
        let priority = self.priority(number);
        if priority < 0 { priority } else { priority & !((1 << (self.group + 1)) - 1) }
    }

    /// Priority at which the core executes, masks apart.
    pub fn level(&self) -> i16 {
        self.active.iter().map(|number| self.preempts(*number)).min().unwrap_or(THREAD)
    }

    fn refresh(&mut self) {
        let next = bits(self.pending & self.enabled).min_by_key(|n| (self.priority(*n), *n));
        let next = next.map(|number| (number, self.preempts(number)));
        self.urgent = next.filter(|(_, priority)| *priority < self.level());
    }

    /// The exception to be taken next with the priority that the masks have to let
    /// through, if it preempts what runs.
    pub fn urgent(&self) -> Option<(u8, i16)> {
        self.urgent
    }

    /// Takes an exception: it runs from now on.
    pub(crate) fn enter(&mut self, number: u8) {
        self.pending &= !(1 << number);
        self.active.push(number);
        self.event = true;
        self.refresh();
    }

    /// The exception that runs has returned.
    pub fn leave(&mut self) -> u8 {
        let left = self.active.pop().unwrap_or(0);
        self.event = true;
        if self.lines >> left & 1 != 0 {
            self.pend(left);
        }
        self.refresh();
        left
    }
}

#[cfg(test)]
mod tests {
    use super::number::INTERRUPT;
    use super::*;

    fn with(priorities: &[(u8, u8)]) -> Exceptions {
        let mut exceptions = Exceptions::default();
        for &(interrupt, priority) in priorities {
            exceptions.enable(0, 1 << interrupt, true);
            exceptions.set_priority(INTERRUPT + interrupt, priority);
        }
        exceptions
    }

    fn next(exceptions: &Exceptions) -> Option<u8> {
        exceptions.urgent().map(|(number, _)| number - INTERRUPT)
    }

    #[test]
    fn the_most_urgent_goes_first_and_among_equals_the_lowest_number() {
        let mut e = with(&[(3, 0x40), (5, 0x20), (7, 0x20)]);
        for interrupt in [7, 3, 5] {
            e.pend(INTERRUPT + interrupt);
        }
        for wanted in [5, 7, 3] {
            assert_eq!(next(&e), Some(wanted));
            e.enter(INTERRUPT + wanted);
            assert_eq!(next(&e), None, "none preempts its equal");
            e.leave();
        }
        assert_eq!(next(&e), None);
    }

    #[test]
    fn only_the_upper_four_bits_count_and_the_group_decides_about_preemption() {
        let mut e = with(&[(3, 0x5F), (5, 0x4F)]);
        assert_eq!(e.priority_set(INTERRUPT + 3), 0x50);
        e.pend(INTERRUPT + 3);
        e.enter(INTERRUPT + 3);
        e.pend(INTERRUPT + 5);
        assert_eq!(next(&e), Some(5));
        // With bits 4 to 0 as subpriority, 0x40 and 0x50 are one group.
        e.set_group(4);
        assert_eq!(next(&e), None);
    }

    #[test]
    fn a_line_that_stays_high_brings_its_interrupt_back() {
        let mut e = with(&[(3, 0x40)]);
        e.set_line(3, true);
        e.enter(INTERRUPT + 3);
        assert_eq!(next(&e), None);
        e.leave();
        assert_eq!(next(&e), Some(3), "its cause was not cleared");
        e.enter(INTERRUPT + 3);
        e.set_line(3, false);
        e.leave();
        assert_eq!(next(&e), None);
    }

    #[test]
    fn what_is_disabled_waits() {
        let mut e = with(&[]);
        e.pend(INTERRUPT + 40);
        assert_eq!(next(&e), None);
        assert_eq!(e.pending(1), 1 << 8);
        e.enable(1, 1 << 8, true);
        assert_eq!(next(&e), Some(40));
        e.clear(INTERRUPT + 40);
        assert_eq!(next(&e), None);
    }
}
