//! The chip's rules: a program that breaks one is reported by its name, and gets nothing.
//!
//! Registers and fields are those of ST's description, so that a position that a model has wrong
//! shows here too.

mod adc;
mod sources;

use rig_board::chip::Chip;
use rig_board::core::{Access, Bus};
use rig_board::description;
use rig_board::peripherals::pwr::Then;
use rig_board::peripherals::{HZ, Why};
use rig_board::rules::Rule;

/// Cycles in a microsecond.
const US: u64 = HZ / 1_000_000;

/// A chip with the clocks of its peripherals on, as a program sees it.
struct Program {
    chip: Chip,
    now: u64,
}

/// What a program does.
#[derive(Clone, Copy)]
enum Step {
    Wait(u64),
    /// Reads a register, changes fields, writes it back.
    Set(&'static str, &'static [(&'static str, u32)]),
}

fn address(register: &str) -> u32 {
    let (peripheral, name) = register.split_once('.').expect("PERIPHERAL.REGISTER");
    description::find(peripheral, name).unwrap_or_else(|| panic!("{register}")).0
}

/// A field's value in its place.
fn field(register: &str, name: &str, value: u32) -> u32 {
    let (peripheral, register) = register.split_once('.').expect("PERIPHERAL.REGISTER");
    let (_, register) = description::find(peripheral, register).expect("described");
    let field = register.fields.iter().find(|field| field.name == name);
    field.unwrap_or_else(|| panic!("{name}")).at(value)
}

impl Program {
    fn new() -> Self {
        let mut program = Self { chip: Chip::new(0x0800_0000), now: 0 };
        for (register, names) in [
            ("RCC.AHB1ENR", &["DMA1EN", "DMAMUX1EN"][..]),
            ("RCC.AHB2ENR", &["GPIOAEN", "GPIOBEN", "ADC12EN"]),
            ("RCC.APB1ENR1", &["PWREN"]),
            ("RCC.APB2ENR", &["TIM1EN", "SYSCFGEN"]),
        ] {
            for name in names {
                program.set(register, &[(name, 1)]);
            }
        }
        program
    }

    fn access(&self, register: &str) -> Access {
        Access { address: address(register), size: 4, pc: 0, now: self.now }
    }

    fn read(&mut self, register: &str) -> u32 {
        let access = self.access(register);
        self.chip.read(access)
    }

    fn is_set(&mut self, register: &str, name: &str) -> bool {
        self.read(register) & field(register, name, 1) != 0
    }

    fn write(&mut self, register: &str, value: u32) {
        let access = self.access(register);
        self.chip.write(access, value);
    }

    /// Reads a register, changes fields, writes it back.
    fn set(&mut self, register: &str, fields: &[(&str, u32)]) {
        let old = self.read(register);
        let next = fields.iter().fold(old, |word, (name, value)| {
            word & !field(register, name, u32::MAX) | field(register, name, *value)
        });
        self.write(register, next);
    }

    fn take(&mut self, step: Step) {
        match step {
            Step::Wait(cycles) => self.wait(cycles),
            Step::Set(register, fields) => self.set(register, fields),
        }
    }

    fn wait(&mut self, cycles: u64) {
        self.now += cycles;
        self.chip.advance(self.now);
    }

    /// The rules broken so far; anything else that was noted fails the test.
    fn broken(&self) -> Vec<Rule> {
        let strays = &self.chip.strays;
        let broken = strays.iter().chain(strays.accepted()).map(|stray| match stray.why {
            Why::Broken(rule) => rule,
            other => panic!("{other:?}: {stray}"),
        });
        broken.collect()
    }

    fn assert_broken(&self, rule: Rule) {
        assert_eq!(self.broken(), [rule]);
    }

    /// ADC1 with its regulator on and calibrated.
    fn calibrated() -> Self {
        let mut program = Self::new();
        program.set("ADC12_COMMON.CCR", &[("PRESC", 2)]);
        program.set("ADC1.CR", &[("DEEPPWD", 0), ("ADVREGEN", 1)]);
        program.wait(20 * US);
        program.set("ADC1.CR", &[("ADCAL", 1)]);
        program.wait(116 * 4 - 1);
        assert!(program.is_set("ADC1.CR", "ADCAL"), "it takes its time");
        program.wait(1);
        assert!(!program.is_set("ADC1.CR", "ADCAL"));
        program
    }

    /// And enabled and ready.
    fn converter() -> Self {
        let mut program = Self::calibrated();
        program.wait(4 * 4);
        program.set("ADC1.CR", &[("ADEN", 1)]);
        assert!(!program.is_set("ADC1.ISR", "ADRDY"), "it takes its time");
        program.wait(15 * 4);
        assert!(program.is_set("ADC1.ISR", "ADRDY"));
        assert_eq!(program.broken(), []);
        program
    }
}

#[test]
fn clocks_are_ready_after_their_time_and_used_when_they_are_ready() {
    let mut program = Program::new();
    program.set("RCC.PLLCFGR", &PLL);
    program.set("RCC.CR", &[("PLLON", 1)]);
    program.set("PWR.CR5", &[("R1MODE", 0)]);
    program.set("FLASH.ACR", &[("LATENCY", 4)]);
    program.set("RCC.CFGR", &[("HPRE", 8)]);
    program.set("RCC.CFGR", &[("SW", 3)]);
    let used = |program: &mut Program| {
        (program.is_set("RCC.CR", "PLLRDY"), program.read("RCC.CFGR") >> 2 & 3)
    };
    program.wait(40 * US - 1);
    assert_eq!(used(&mut program), (false, 1), "HSI until then");
    program.wait(1);
    assert_eq!(used(&mut program), (true, 3));
    program.set("RCC.CSR", &[("LSION", 1)]);
    assert!(!program.is_set("RCC.CSR", "LSIRDY"));
    program.wait(130 * US);
    assert!(program.is_set("RCC.CSR", "LSIRDY"));
    program.set("RCC.CR", &[("PLLON", 0)]);
    program.assert_broken(Rule::ClockInUse);
}

/// A PLL of 170 MHz.
const PLL: [(&str, u32); 5] =
    [("PLLSRC", 2), ("PLLM", 3), ("PLLN", 85), ("PLLR", 0), ("PLLREN", 1)];

/// The core on that PLL, but for what the steps lack.
fn fast(steps: &[&str]) -> Program {
    let mut program = Program::new();
    program.set("RCC.PLLCFGR", &PLL);
    program.set("RCC.CR", &[("PLLON", 1)]);
    program.wait(40 * US);
    if steps.contains(&"boost") {
        program.set("PWR.CR5", &[("R1MODE", 0)]);
    }
    if steps.contains(&"wait states") {
        program.set("FLASH.ACR", &[("LATENCY", 4)]);
    }
    if steps.contains(&"half") {
        program.set("RCC.CFGR", &[("HPRE", 8)]);
        program.set("RCC.CFGR", &[("SW", 3)]);
        program.wait(US);
        program.set("RCC.CFGR", &[("HPRE", 0)]);
    } else {
        program.set("RCC.CFGR", &[("SW", 3)]);
    }
    program
}

#[test]
fn clock_of_170_mhz_wants_boost_wait_states_and_a_step_between() {
    let mut program = fast(&["boost", "wait states", "half"]);
    assert_eq!(program.broken(), []);
    assert_eq!(program.read("RCC.CFGR") & field("RCC.CFGR", "SWS", 3), field("RCC.CFGR", "SWS", 3));
    program.set("RCC.PLLCFGR", &[("PLLN", 80)]);
    program.assert_broken(Rule::PllOn);
    for (steps, rule) in [
        (&["wait states", "half"][..], Rule::Boost),
        (&["boost", "half"], Rule::WaitStates),
        (&["boost", "wait states"], Rule::ClockStep),
    ] {
        let broken = fast(steps).broken();
        assert!(broken.contains(&rule), "{steps:?}: {broken:?}");
    }
}

#[test]
fn another_clock_than_the_emulated_one_is_reported() {
    let mut program = Program::new();
    program.set("RCC.PLLCFGR", &[("PLLSRC", 2), ("PLLM", 3), ("PLLN", 30), ("PLLREN", 1)]);
    program.set("RCC.CR", &[("PLLON", 1)]);
    program.set("FLASH.ACR", &[("LATENCY", 4)]);
    program.set("RCC.CFGR", &[("SW", 3)]);
    program.assert_broken(Rule::EmulatedClock);
}

#[test]
fn dma_channel_is_set_up_only_while_it_is_disabled() {
    for (register, name) in [
        ("DMA1.CH1_NDTR", "NDT"),
        ("DMA1.CH1_MAR", "MA"),
        ("DMA1.CH1_PAR", "PA"),
        ("DMA1.CH1_CR", "MINC"),
        // "It must not be written when the channel is enabled", says each interrupt's bit too.
        ("DMA1.CH1_CR", "TCIE"),
    ] {
        let mut program = Program::new();
        program.set("DMA1.CH1_NDTR", &[("NDT", 4)]);
        program.set("DMA1.CH1_CR", &[("EN", 1)]);
        let old = program.read(register);
        program.set(register, &[(name, 1)]);
        assert_eq!(program.read(register), old, "{register}");
        program.assert_broken(Rule::DmaEnabled);
    }
}

#[test]
fn a_one_in_a_reserved_bit_is_reported_by_name() {
    let mut program = Program::new();
    program.write("GPIOB.BRR", 1 << 20);
    let report: Vec<_> = program.chip.strays.iter().map(ToString::to_string).collect();
    assert_eq!(report.len(), 1);
    assert!(report[0].contains("write to GPIOB BRR 0x028: reserved bits 0x100000"), "{report:?}");
}

/// Each request arrives at the interrupt that the description has for it, and at no other.
#[test]
fn requests_arrive_at_the_interrupts_of_the_description() {
    type Cause = fn(&mut Program);
    fn software(program: &mut Program, line: u32) {
        program.write("EXTI.IMR1", 1 << line);
        program.write("EXTI.SWIER1", 1 << line);
    }
    fn failed_transfer(program: &mut Program, channel: usize) {
        program.set(&format!("DMA1.CH{channel}_CR"), &[("TEIE", 1)]);
        program.chip.moved(channel - 1, false);
    }
    let causes: [(&str, Cause); 9] = [
        ("EXTI0", |program| software(program, 0)),
        ("EXTI4", |program| software(program, 4)),
        ("EXTI9_5", |program| software(program, 9)),
        ("EXTI15_10", |program| software(program, 13)),
        ("PVD_PVM", |program| {
            program.set("EXTI.RTSR1", &[("RT16", 1)]);
            program.set("EXTI.IMR1", &[("IM16", 1)]);
            program.set("PWR.CR2", &[("PVDE", 1)]);
            program.chip.supply_falls(u64::MAX, Then::Back, program.now);
        }),
        ("TIM2", |program| {
            program.set("RCC.APB1ENR1", &[("TIM2EN", 1)]);
            program.set("TIM2.DIER", &[("UIE", 1)]);
            program.set("TIM2.EGR", &[("UG", 1)]);
        }),
        ("FLASH", |program| {
            for key in [0x4567_0123, 0xCDEF_89AB] {
                program.write("FLASH.KEYR", key);
            }
            program.set("FLASH.CR", &[("ERRIE", 1)]);
            let at = Access { address: 0x0804_0000, size: 4, pc: 0, now: program.now };
            program.chip.write_code(at, 0);
        }),
        ("DMA1_CH1", |program| failed_transfer(program, 1)),
        ("DMA1_CH8", |program| failed_transfer(program, 8)),
    ];
    for (name, cause) in causes {
        let mut program = Program::new();
        cause(&mut program);
        let pending: Vec<u32> = (0..128)
            .filter(|number| {
                let address = 0xE000_E200 + number / 32 * 4;
                let at = Access { address, size: 4, pc: 0, now: program.now };
                program.chip.read(at) >> (number % 32) & 1 != 0
            })
            .collect();
        let number = description::interrupt(name).expect("described");
        assert_eq!(pending, [u32::from(number)], "{name}");
        assert_eq!(program.broken(), [], "{name}");
    }
}

/// What reads as zero shows by its effect: set and reset of the ports, of which setting goes first,
/// and clearing of DMA's flags.
#[test]
fn commands_act_where_the_description_has_them() {
    let mut program = Program::new();
    for name in ["GPIOCEN", "GPIODEN", "GPIOEEN", "GPIOFEN", "GPIOGEN"] {
        program.set("RCC.AHB2ENR", &[(name, 1)]);
    }
    for port in 'A'..='G' {
        let [output, set, reset] = ["ODR", "BSRR", "BRR"].map(|name| format!("GPIO{port}.{name}"));
        for pin in 0..16 {
            let high = field(&output, &format!("ODR{pin}"), 1);
            let [on, off] = ["BS", "BR"].map(|name| field(&set, &format!("{name}{pin}"), 1));
            let off_alone = field(&reset, &format!("BR{pin}"), 1);
            for (register, word, expected) in
                [(&set, on, high), (&set, off, 0), (&set, on | off, high), (&reset, off_alone, 0)]
            {
                program.write(register, word);
                assert_eq!(program.read(&output), expected, "{register} {pin}");
            }
        }
    }
    for channel in 1..=8 {
        program.chip.moved(channel - 1, false);
        let [error, any] =
            ["TE", "G"].map(|name| field("DMA1.ISR", &format!("{name}IF{channel}"), 1));
        assert_eq!(program.read("DMA1.ISR"), error | any);
        program.write("DMA1.IFCR", field("DMA1.IFCR", &format!("CTEIF{channel}"), 1));
        assert_eq!(program.read("DMA1.ISR"), 0);
    }
    assert_eq!(program.broken(), []);
}
