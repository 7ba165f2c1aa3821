//! Start, panic and the list of what can be called.

mod arith;
mod model;
mod slot;
mod tick;

use cortex_m::asm::bkpt;
use defmt as _;
use embassy_stm32 as _;

/// Runs once; the host takes over at the breakpoint.
#[cortex_m_rt::entry]
fn main() -> ! {
    // Keeps what only the host calls.
    core::hint::black_box([
        arith::arith_load as *const (),
        arith::arith_build_shipping as *const (),
        arith::arith_shipping_forward as *const (),
        arith::arith_shipping_inverse as *const (),
        arith::arith_fixed_forward as *const (),
        arith::arith_fixed_inverse as *const (),
        arith::arith_micromath_forward as *const (),
        arith::arith_micromath_inverse as *const (),
        arith::arith_libm_forward as *const (),
        arith::arith_libm_inverse as *const (),
        arith::arith_f64_forward as *const (),
        arith::arith_f64_inverse as *const (),
        model::model_build as *const (),
        model::model_scale as *const (),
        model::model_forward as *const (),
        model::model_inverse_preload as *const (),
        model::model_inverse_speed as *const (),
        tick::tick_build as *const (),
        tick::tick_skip_nothing as *const (),
        tick::tick_load as *const (),
        tick::tick_step as *const (),
        tick::tick_plan as *const (),
        tick::tick_save as *const (),
    ]);
    loop {
        bkpt();
    }
}

/// Tells the host: a breakpoint anywhere but in `main` ends the measurement.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        bkpt();
    }
}
