//! Rules of the chip that a program can break without an error of the chip.
//!
//! A model that finds one broken does not do what the program asked for, and the access is
//! reported by the rule's name. On silicon the result would be undefined, or nothing.

use std::fmt;

use serde::Serialize;

/// A rule, with its section or register in RM0440 unless another source is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// 21.4.6, and DS12288, ADC characteristics: the regulator takes 20 us to start.
    AdcRegulator,
    /// 21.4.8: a converter is calibrated before it is enabled, and not while it is enabled.
    AdcCalibration,
    /// 21.4.9: it is enabled at the earliest 4 converter clocks after the calibration.
    AdcEnable,
    /// 21.4.9: it converts only once `ADRDY` was set.
    AdcReady,
    /// 21.4.9: it is disabled only while it does not convert.
    AdcDisable,
    /// 21.4.10: its configuration is written only while it does not convert.
    AdcConfiguration,
    /// 21.4.10: `DIFSEL` and the common configuration are written only while it is disabled.
    AdcDisabledOnly,
    /// DS12288, ADC characteristics: its clock is at most 60 MHz.
    AdcClock,
    /// `TIMx_BDTR`: fields that `LOCK` protects keep their value.
    TimerLock,
    /// `TIMx_BDTR`: `LOCK` is written with the register's first write, and never again.
    TimerLockOnce,
    /// `DMA_CCRx` and the following: a channel is set up only while it is disabled.
    DmaEnabled,
    /// 9.3.8: the configuration of a locked pin stays until the next reset.
    PinLock,
    /// `SYSCFG_CFGR2`: with `PVDL` the voltage detector's settings stay.
    DetectorLock,
    /// `RCC_PLLCFGR`: the PLL is set up only while it is off.
    PllOn,
    /// `RCC_CR`: the source of the system clock stays on.
    ClockInUse,
    /// 3.3.3: enough wait states for the clock, before the clock.
    WaitStates,
    /// 6.1.5: more than 150 MHz need the boost of range 1, before the clock.
    Boost,
    /// 6.1.5: a clock above 80 MHz is reached by half of it, for a microsecond.
    ClockStep,
    /// The emulation's own: what the program sets up is the 170 MHz at which time runs here.
    EmulatedClock,
}

/// Rules that the firmware's libraries break, and why that is accepted.
const ACCEPTED: [(Rule, &str); 1] = [(
    Rule::ClockStep,
    "embassy-stm32 0.6 ends the division by two in the write that selects the PLL",
)];

impl Rule {
    /// The reason why the firmware may break it.
    pub fn accepted(self) -> Option<&'static str> {
        ACCEPTED.iter().find(|(rule, _)| *rule == self).map(|(_, reason)| *reason)
    }

    /// The rule with its source.
    pub const fn text(self) -> &'static str {
        match self {
            Self::AdcRegulator => "RM0440 21.4.6: converter used within 20 us of its regulator",
            Self::AdcCalibration => "RM0440 21.4.8: converter not calibrated before its enabling",
            Self::AdcEnable => "RM0440 21.4.9: converter enabled too soon after its calibration",
            Self::AdcReady => "RM0440 21.4.9: conversion started before ADRDY",
            Self::AdcDisable => "RM0440 21.4.9: converter disabled while it converts",
            Self::AdcConfiguration => "RM0440 21.4.10: converter set up while it converts",
            Self::AdcDisabledOnly => "RM0440 21.4.10: set up while a converter is enabled",
            Self::AdcClock => "DS12288: converter clock above 60 MHz",
            Self::TimerLock => "RM0440, TIMx_BDTR: field of a timer changed that LOCK protects",
            Self::TimerLockOnce => "RM0440, TIMx_BDTR: LOCK changed after the first write of BDTR",
            Self::DmaEnabled => "RM0440, DMA_CCRx: DMA channel set up while it is enabled",
            Self::PinLock => "RM0440 9.3.8: locked pin set up",
            Self::DetectorLock => "RM0440, SYSCFG_CFGR2: locked voltage detector set up",
            Self::PllOn => "RM0440, RCC_PLLCFGR: PLL set up while it is on",
            Self::ClockInUse => "RM0440, RCC_CR: source of the system clock switched off",
            Self::WaitStates => "RM0440 3.3.3: too few wait states for the clock",
            Self::Boost => "RM0440 6.1.5: above 150 MHz without the regulator's boost",
            Self::ClockStep => "RM0440 6.1.5: above 80 MHz in one step",
            Self::EmulatedClock => {
                "the emulation runs at 170 MHz, the program set up another clock"
            }
        }
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}
