//! Rules of the chip that a program can break without an error of the chip.
//!
//! A model that finds one broken does not do what the program asked for, and the access is
//! reported by the rule's name. On silicon the result would be undefined, or nothing.

use serde::Serialize;

/// A rule, by what breaks it, with its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    #[error("RM0440 21.4.6: converter used within 20 us of its regulator")]
    AdcRegulator,
    #[error("RM0440 21.4.8: converter not calibrated before its enabling")]
    AdcCalibration,
    #[error("RM0440 21.4.9: converter enabled too soon after its calibration")]
    AdcEnable,
    #[error("RM0440 21.4.9: conversion started before ADRDY")]
    AdcReady,
    #[error("RM0440 21.4.9: converter disabled while it converts")]
    AdcDisable,
    #[error("RM0440 21.4.10: converter set up while it converts")]
    AdcConfiguration,
    #[error("RM0440 21.4.10: set up while a converter is enabled")]
    AdcDisabledOnly,
    #[error("DS12288: converter clock above 60 MHz")]
    AdcClock,
    #[error("RM0440, DMA_CCRx: DMA channel set up while it is enabled")]
    DmaEnabled,
    #[error("RM0440, RCC_PLLCFGR: PLL set up while it is on")]
    PllOn,
    #[error("RM0440, RCC_CR: source of the system clock switched off")]
    ClockInUse,
    #[error("RM0440 3.3.3: too few wait states for the clock")]
    WaitStates,
    #[error("RM0440 6.1.5: above 150 MHz without the regulator's boost")]
    Boost,
    #[error("RM0440 6.1.5: above 80 MHz in one step")]
    ClockStep,
    #[error("the emulation runs at 170 MHz, the program set up another clock")]
    EmulatedClock,
}

impl Rule {
    /// Whether the firmware may break it: embassy-stm32 0.6 ends the division by two in the write
    /// that selects the PLL.
    pub(crate) fn is_accepted(self) -> bool {
        self == Self::ClockStep
    }
}
