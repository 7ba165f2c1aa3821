//! What the hardware page says of the analogue sources, against the sampling times of the image.

use rig_board::core::{Access, Bus};

use super::{address, field};
use crate::common::Board;

/// Most kilohms at a slow channel for 2.5 to 640.5 clocks of 60 MHz, 12 bits. Source: DS12288,
/// maximum ADC R_AIN.
const MOST_KILOHMS: [(f64, f64); 7] =
    [(6.5, 0.1), (12.5, 0.47), (24.5, 1.2), (47.5, 1.8), (92.5, 3.9), (247.5, 10.0), (640.5, 33.0)];

/// What the sources at the analogue inputs may be, by the sampling time that the image sets.
///
/// Amplifiers drive PC2 and PC3 directly. The readback comes through the resistor of its
/// low-pass, far above what the table allows: its capacitor gives the charge instead. The
/// sampling capacitor of 5 pF takes from it less than half a code of 12 bits.
#[test]
fn sampling_times_suit_the_sources_that_the_hardware_page_names() {
    let mut board = Board::off(&[]);
    board.run(200);
    let mut read = |register: &str| {
        let at = Access { address: address(register), size: 4, pc: 0, now: board.machine().now() };
        board.machine().chip_mut().read(at)
    };
    let page = include_str!("../../../../docs/HARDWARE.md");
    let clocks = [2.5, 6.5, 12.5, 24.5, 47.5, 92.5, 247.5, 640.5];
    for (register, common, channel) in [
        ("ADC1.SMPR1", "ADC12_COMMON.CCR", 8),
        ("ADC2.SMPR1", "ADC12_COMMON.CCR", 9),
        ("ADC3.SMPR1", "ADC345_COMMON.CCR", 1),
        ("ADC3.SMPR2", "ADC345_COMMON.CCR", 12),
    ] {
        let name = format!("SMP{channel}");
        let all = field(register, &name, 7);
        let setting = (read(register) & all) >> all.trailing_zeros();
        let presc = read(common) & field(common, "PRESC", 15);
        assert_eq!(presc, field(common, "PRESC", 2), "{common}: a quarter of 170 MHz");
        let microseconds = clocks[setting as usize] / 42.5;
        let allowed = MOST_KILOHMS.iter().rev().find(|(clocks, _)| clocks / 60.0 <= microseconds);
        let (_, kilohms) = allowed.expect("long enough for some source");
        println!("{register} {name}: {microseconds:.3} us, sources up to {kilohms} kilohm");
        let ohms = format!("at most {:.0} Ω", 1000.0 * kilohms);
        assert!(page.contains(&ohms), "{register}: the page does not say {ohms}");
    }
    assert!(page.contains("samples for 0.3 µs"), "the page gives the sampling time");
    assert!(page.contains("(10 kΩ, 100 nF of 5 %)"), "the page gives the readback's low-pass");
    let (sampling_pf, reservoir_nf) = (5.0, 100.0 * 0.95);
    let codes = 4096.0 * sampling_pf / (1000.0 * reservoir_nf);
    assert!(codes < 0.5, "{codes} codes");
}
