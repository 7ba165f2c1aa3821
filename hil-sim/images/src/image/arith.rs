//! The reduced model in other arithmetics, and the shipping one beside them on the same
//! arguments: one call each.

use interstage::model::reduced::{ReducedModel, Scale};
use interstage::rig::Rig;
use interstage_arith::{Answer, COEFFICIENTS, Double, Fixed, Given, Libm, Micro, Model};
use interstage_images::arith;
use interstage_images::tick::Preset;

use super::slot::Slot;

static FIXED: Slot<Model<Fixed>> = Slot::new();
static MICRO: Slot<Model<Micro>> = Slot::new();
static LIBM: Slot<Model<Libm>> = Slot::new();
static DOUBLE: Slot<Model<Double>> = Slot::new();
static SHIPPING: Slot<ReducedModel> = Slot::new();
/// With the scale of the tread's stiffness, which changes once a crossing.
static SCALE: Slot<Scale> = Slot::new();
/// Everything that a call forwards gives, so that none of it is left out.
static ANSWER: Slot<Answer> = Slot::new();

/// Takes the coefficients of a rig. Returns 1 if every arithmetic holds them.
#[unsafe(no_mangle)]
pub(super) extern "C" fn arith_load(flat: &[f64; COEFFICIENTS]) -> u32 {
    let fixed = Model::of(flat).map(|model| FIXED.put(|| model)).is_some();
    let micro = Model::of(flat).map(|model| MICRO.put(|| model)).is_some();
    let libm = Model::of(flat).map(|model| LIBM.put(|| model)).is_some();
    let double = Model::of(flat).map(|model| DOUBLE.put(|| model)).is_some();
    (fixed && micro && libm && double).into()
}

/// The shipping model of a preset with this height of its steps, bits of Q15.16. Returns
/// 1 if it can be built.
#[unsafe(no_mangle)]
pub(super) extern "C" fn arith_build_shipping(preset: u32, step_height: i32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Some(rig) = Rig::named(preset.name()) else { return 0 };
    let rig = arith::with_step(rig, step_height);
    SCALE.put(|| core::hint::black_box(Scale::NOMINAL));
    ReducedModel::try_build(&rig).map(|model| SHIPPING.put(|| model)).is_ok().into()
}

/// Leaves the answer where the host finds it, and returns its gap.
#[inline(always)]
fn leave(answer: Answer) -> i32 {
    ANSWER.put(|| core::hint::black_box(answer));
    answer.gap
}

macro_rules! calls {
    ($slot:ident, $forward:ident, $inverse:ident) => {
        /// Everything of a crossing; its gap.
        #[unsafe(no_mangle)]
        pub(super) extern "C" fn $forward(given: &Given) -> i32 {
            $slot.get().map_or(0, |model| leave(model.crossing(given)))
        }

        /// Force for a gap.
        #[unsafe(no_mangle)]
        pub(super) extern "C" fn $inverse(given: &Given) -> i32 {
            $slot.get().map_or(0, |model| model.force(given))
        }
    };
}

calls!(FIXED, arith_fixed_forward, arith_fixed_inverse);
calls!(MICRO, arith_micromath_forward, arith_micromath_inverse);
calls!(LIBM, arith_libm_forward, arith_libm_inverse);
calls!(DOUBLE, arith_f64_forward, arith_f64_inverse);

/// Everything of a crossing by the shipping model; its gap.
#[unsafe(no_mangle)]
pub(super) extern "C" fn arith_shipping_forward(given: &Given) -> i32 {
    let (Some(model), Some(scale)) = (SHIPPING.get(), SCALE.get()) else { return 0 };
    leave(arith::crossing(model, *scale, given))
}

/// Force for a gap by the shipping model.
#[unsafe(no_mangle)]
pub(super) extern "C" fn arith_shipping_inverse(given: &Given) -> i32 {
    let (Some(model), Some(scale)) = (SHIPPING.get(), SCALE.get()) else { return 0 };
    arith::force(model, *scale, given)
}
