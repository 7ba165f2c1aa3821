use super::*;
use crate::description::{adc1::*, bits};
use crate::peripherals::tests::write;

/// The regulator, as each command keeps it.
const REGULATOR: u32 = cr::ADVREGEN.mask;

fn take(adc: &mut Adc, offset: u32, value: u32, now: u64) -> Result<(), Why> {
    adc.write(offset, Write { value, mask: u32::MAX }, now)
}

/// When conversions begin.
const BEGIN: u64 = 5_000;

/// A pair at a quarter of the core's clock, of which one is calibrated, enabled and ready.
fn started(converter: usize) -> Adc {
    let mut adc = Adc::default();
    write(&mut adc, CCR, 2 << 18, 0);
    let one = &mut adc.converters[converter];
    one.registers.put(cr::ADVREGEN, 1);
    one.registers.put(cr::ADEN, 1);
    (one.calibrated, one.regulated, one.ready) = (true, 0, 0);
    adc
}

/// ADC2 on channel 9, 256 conversions of 12.5 + 12.5 clocks at a quarter of the
/// core's, DMA on.
fn ready() -> Adc {
    let mut adc = started(1);
    for (offset, value) in
        [(0x100 + CFGR, 1), (0x100 + CFGR2, 0x9D), (0x100 + SMPR1, 2 << 27), (0x100 + SQR1, 9 << 6)]
    {
        write(&mut adc, offset, value, BEGIN);
    }
    adc
}

/// Without oversampling it has twelve bits.
#[test]
fn a_code_is_the_mean_of_its_conversions_and_takes_their_time() {
    let mut adc = ready();
    adc.set_input(1, 9, 51_234);
    write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN);
    let due = BEGIN + 256 * 25 * 4;
    assert_eq!(adc.deadline(), due);
    adc.advance(due - 1);
    assert!(!adc.wants_dma(1));
    adc.advance(due);
    assert!(adc.wants_dma(1) && !adc.wants_dma(0));
    assert_eq!(adc.read(0x100 + DR, due), Some(51_234));
    assert!(!adc.wants_dma(1));
    write(&mut adc, 0x100 + CFGR2, 0, due);
    write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, due);
    adc.advance(adc.deadline());
    assert_eq!(adc.read(0x100 + DR, due), Some(51_234 / 16));
}

#[test]
fn without_noise_each_conversion_has_twelve_bits_of_the_voltage_as_its_sampling_ends() {
    // 2 of 16 are lost, and 14 more make a step: in none, one or two of 256.
    for (until, steps) in [(49, 0), (50, 1), (150, 2)] {
        let mut adc = ready();
        adc.set_input(1, 9, 51_234);
        write(&mut adc, 0x100 + CFGR2, 0x1D, BEGIN);
        write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN);
        adc.advance_with(adc.deadline(), Some(&|at| if at <= BEGIN + until { 14 } else { 0 }));
        assert_eq!(adc.read(0x100 + DR, 0), Some((51_232 * 16 + steps) & 0xFFFF), "{until}");
    }
}

#[test]
fn a_code_that_is_not_read_is_kept_and_the_next_is_lost() {
    let mut adc = ready();
    for code in [1600, 3200] {
        adc.set_input(1, 9, code);
        write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN);
        adc.advance(adc.deadline());
    }
    assert_eq!(adc.read(0x100 + ISR, 0).map(|flags| isr::OVR.of(flags)), Some(1));
    assert_eq!(adc.read(0x100 + DR, 0), Some(1600));
}

#[test]
fn without_end_one_code_follows_the_other() {
    let mut adc = ready();
    write(&mut adc, 0x100 + CFGR, bits(&[cfgr::DMAEN, cfgr::CONT]), 0);
    write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN);
    for round in 1..4 {
        let due = BEGIN + round * 256 * 25 * 4;
        assert_eq!(adc.deadline(), due);
        adc.set_input(1, 9, 100 * round as u16);
        // A delayed update does not delay the next code.
        adc.advance(due + 17);
        assert_eq!(adc.read(0x100 + DR, due), Some(100 * round as u32));
    }
    write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTP.mask, 90_000);
    assert_eq!(adc.deadline(), u64::MAX);
}

#[test]
fn after_an_overrun_it_requests_dma_only_when_the_flag_is_cleared() {
    let mut adc = ready();
    write(&mut adc, 0x100 + CFGR, bits(&[cfgr::DMAEN, cfgr::CONT]), 0);
    write(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN);
    adc.advance(adc.deadline());
    assert!(adc.wants_dma(1));
    adc.advance(adc.deadline());
    assert!(!adc.wants_dma(1));
    write(&mut adc, 0x100 + ISR, isr::OVR.mask, 0);
    assert!(adc.wants_dma(1));
}

#[test]
fn injected_conversions_follow_one_another_into_registers_of_their_own() {
    let mut adc = started(0);
    for (offset, value) in [
        (CFGR2, 8 << 5 | 7 << 2 | cfgr2::JOVSE.mask),
        (SMPR1, 2 << 3),
        (SMPR2, 2 << 6),
        (JSQR, 12 << 9 | 1 << 15 | 1),
    ] {
        write(&mut adc, offset, value, 0);
    }
    adc.set_input(0, 12, 4095 << 4);
    adc.set_input(0, 1, 1234 << 4);
    write(&mut adc, CR, REGULATOR | cr::JADSTART.mask, BEGIN);
    let each = 256 * 25 * 4;
    assert_eq!(adc.deadline(), BEGIN + each);
    adc.advance(BEGIN + each);
    let (one, all) = (isr::JEOC.mask, isr::JEOS.mask);
    let flags = |adc: &mut Adc| adc.read(ISR, 0).map(|flags| flags & (one | all));
    assert_eq!(flags(&mut adc), Some(one));
    adc.advance(adc.deadline());
    assert_eq!(flags(&mut adc), Some(one | all));
    assert_eq!((adc.read(JDR1, 0), adc.read(JDR2, 0)), (Some(4095), Some(1234)));
    assert_eq!(adc.read(CR, 0).map(|word| cr::JADSTART.of(word)), Some(0));
    assert_eq!(adc.deadline(), u64::MAX);
    write(&mut adc, ISR, all, 0);
    assert_eq!(flags(&mut adc), Some(one));
    // Beside regular ones they are not modelled.
    write(&mut adc, CFGR, cfgr::CONT.mask, 0);
    write(&mut adc, CR, REGULATOR | cr::ADSTART.mask, BEGIN);
    assert_eq!(take(&mut adc, CR, REGULATOR | cr::JADSTART.mask, BEGIN), Err(Why::NoModel));
}

#[test]
fn a_sequence_is_not_modelled() {
    let mut adc = ready();
    write(&mut adc, 0x100 + SQR1, 9 << 6 | 1, 0);
    assert_eq!(take(&mut adc, 0x100 + CR, REGULATOR | cr::ADSTART.mask, BEGIN), Err(Why::NoModel));
}
