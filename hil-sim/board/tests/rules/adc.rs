//! Rules of the converters.

use rig_board::rules::Rule;

use super::{Program, US};

#[test]
fn adc_regulator_takes_20_us_before_anything_else() {
    let mut program = Program::new();
    program.set("ADC1.CR", &[("DEEPPWD", 0), ("ADVREGEN", 1)]);
    program.wait(20 * US - 1);
    program.set("ADC1.CR", &[("ADCAL", 1)]);
    assert!(!program.is_set("ADC1.CR", "ADCAL"));
    program.assert_broken(Rule::AdcRegulator);
}

#[test]
fn adc_calibration_comes_before_the_enabling() {
    let mut program = Program::new();
    program.set("ADC1.CR", &[("DEEPPWD", 0), ("ADVREGEN", 1)]);
    program.wait(20 * US);
    program.set("ADC1.CR", &[("ADEN", 1)]);
    assert!(!program.is_set("ADC1.CR", "ADEN"));
    program.assert_broken(Rule::AdcCalibration);
    let mut program = Program::converter();
    program.set("ADC1.CR", &[("ADCAL", 1)]);
    program.assert_broken(Rule::AdcCalibration);
}

#[test]
fn adc_enabling_waits_four_clocks_after_the_calibration() {
    let mut program = Program::calibrated();
    program.wait(4 * 4 - 1);
    program.set("ADC1.CR", &[("ADEN", 1)]);
    assert!(!program.is_set("ADC1.CR", "ADEN"));
    program.assert_broken(Rule::AdcEnable);
}

#[test]
fn adc_converts_only_after_adrdy() {
    let mut program = Program::calibrated();
    program.wait(4 * 4);
    program.set("ADC1.CR", &[("ADEN", 1)]);
    program.set("ADC1.CR", &[("ADSTART", 1)]);
    assert!(!program.is_set("ADC1.CR", "ADSTART"));
    program.assert_broken(Rule::AdcReady);
}

#[test]
fn adc_is_not_disabled_or_set_up_while_it_converts() {
    let mut program = Program::converter();
    program.set("ADC1.CFGR", &[("CONT", 1)]);
    program.set("ADC1.CR", &[("ADSTART", 1)]);
    assert_eq!(program.broken(), []);
    program.set("ADC1.SMPR1", &[("SMP1", 3)]);
    assert_eq!(program.read("ADC1.SMPR1"), 0);
    program.assert_broken(Rule::AdcConfiguration);
    let mut program = Program::converter();
    program.set("ADC1.CFGR", &[("CONT", 1)]);
    program.set("ADC1.CR", &[("ADSTART", 1)]);
    program.set("ADC1.CR", &[("ADDIS", 1)]);
    assert!(program.is_set("ADC1.CR", "ADEN"));
    program.assert_broken(Rule::AdcDisable);
}

#[test]
fn adc_common_and_differential_settings_want_disabled_converters() {
    let mut program = Program::converter();
    program.set("ADC12_COMMON.CCR", &[("PRESC", 3)]);
    program.assert_broken(Rule::AdcDisabledOnly);
    let mut program = Program::converter();
    program.set("ADC1.DIFSEL", &[("DIFSEL1", 1)]);
    program.assert_broken(Rule::AdcDisabledOnly);
}

#[test]
fn adc_clock_is_at_most_60_mhz() {
    let mut program = Program::new();
    program.set("ADC12_COMMON.CCR", &[("PRESC", 1)]);
    program.set("ADC1.CR", &[("DEEPPWD", 0), ("ADVREGEN", 1)]);
    program.wait(20 * US);
    program.set("ADC1.CR", &[("ADCAL", 1)]);
    program.wait(10 * US);
    program.set("ADC1.CR", &[("ADEN", 1)]);
    program.wait(10 * US);
    program.set("ADC1.CR", &[("ADSTART", 1)]);
    program.assert_broken(Rule::AdcClock);
}
