//! Rules of the chip that a program can break without an error of the chip.
//!
//! A model that finds one broken does not do what the program asked for, and the access is
//! reported by the rule's name. On silicon the result would be undefined, or nothing.

use std::fmt;

use serde::Serialize;

macro_rules! rules {
    ($($rule:ident: $text:literal;)*) => {
        /// A rule, by what breaks it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Rule {
            $(#[doc = $text] $rule,)*
        }

        impl Rule {
            /// What breaks it, with the source of the rule.
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$rule => $text,)*
                }
            }
        }
    };
}

rules! {
    AdcRegulator: "RM0440 21.4.6: converter used within 20 us of its regulator";
    AdcCalibration: "RM0440 21.4.8: converter not calibrated before its enabling";
    AdcEnable: "RM0440 21.4.9: converter enabled too soon after its calibration";
    AdcReady: "RM0440 21.4.9: conversion started before ADRDY";
    AdcDisable: "RM0440 21.4.9: converter disabled while it converts";
    AdcConfiguration: "RM0440 21.4.10: converter set up while it converts";
    AdcDisabledOnly: "RM0440 21.4.10: set up while a converter is enabled";
    AdcClock: "DS12288: converter clock above 60 MHz";
    DmaEnabled: "RM0440, DMA_CCRx: DMA channel set up while it is enabled";
    PllOn: "RM0440, RCC_PLLCFGR: PLL set up while it is on";
    ClockInUse: "RM0440, RCC_CR: source of the system clock switched off";
    WaitStates: "RM0440 3.3.3: too few wait states for the clock";
    Boost: "RM0440 6.1.5: above 150 MHz without the regulator's boost";
    ClockStep: "RM0440 6.1.5: above 80 MHz in one step";
    EmulatedClock: "the emulation runs at 170 MHz, the program set up another clock";
}

impl Rule {
    /// Whether the firmware may break it: embassy-stm32 0.6 ends the division by two in the write
    /// that selects the PLL.
    pub fn is_accepted(self) -> bool {
        self == Self::ClockStep
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}
