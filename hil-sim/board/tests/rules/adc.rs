//! Rules of the converters.

use rig_board::rules::Rule;

use super::Step::{Set, Wait};
use super::{Program, Step, US};

const REGULATOR: Step = Set("ADC1.CR", &[("DEEPPWD", 0), ("ADVREGEN", 1)]);
const CALIBRATE: Step = Set("ADC1.CR", &[("ADCAL", 1)]);
const ENABLE: Step = Set("ADC1.CR", &[("ADEN", 1)]);
const START: Step = Set("ADC1.CR", &[("ADSTART", 1)]);
const DISABLE: Step = Set("ADC1.CR", &[("ADDIS", 1)]);
const CONTINUOUS: Step = Set("ADC1.CFGR", &[("CONT", 1)]);

/// From where, what is done, and the rule that the last step breaks: it changes nothing.
type Case = (fn() -> Program, &'static [Step], Rule);

const CASES: [Case; 10] = [
    (Program::new, &[REGULATOR, Wait(20 * US - 1), CALIBRATE], Rule::AdcRegulator),
    (Program::new, &[REGULATOR, Wait(20 * US), ENABLE], Rule::AdcCalibration),
    (Program::converter, &[CALIBRATE], Rule::AdcCalibration),
    (Program::calibrated, &[Wait(4 * 4 - 1), ENABLE], Rule::AdcEnable),
    (Program::calibrated, &[Wait(4 * 4), ENABLE, START], Rule::AdcReady),
    (
        Program::converter,
        &[CONTINUOUS, START, Set("ADC1.SMPR1", &[("SMP1", 3)])],
        Rule::AdcConfiguration,
    ),
    (Program::converter, &[CONTINUOUS, START, DISABLE], Rule::AdcDisable),
    (Program::converter, &[Set("ADC12_COMMON.CCR", &[("PRESC", 3)])], Rule::AdcDisabledOnly),
    (Program::converter, &[Set("ADC1.DIFSEL", &[("DIFSEL1", 1)])], Rule::AdcDisabledOnly),
    (
        Program::new,
        &[
            Set("ADC12_COMMON.CCR", &[("PRESC", 1)]),
            REGULATOR,
            Wait(20 * US),
            CALIBRATE,
            Wait(10 * US),
            ENABLE,
            Wait(10 * US),
            START,
        ],
        Rule::AdcClock,
    ),
];

#[test]
fn converters_are_used_in_their_order_and_time() {
    for (number, (from, steps, rule)) in CASES.into_iter().enumerate() {
        let mut program = from();
        let (last, before) = steps.split_last().expect("a step");
        before.iter().for_each(|step| program.take(*step));
        assert_eq!(program.broken(), [], "case {number}");
        let Set(register, _) = *last else { panic!("case {number} ends with a wait") };
        let old = program.read(register);
        program.take(*last);
        assert_eq!((program.read(register), program.broken()), (old, vec![rule]), "case {number}");
    }
}
