//! The reduced model in every number format, one call each.

use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_images::model::{self, FloatModel, Given};
use interstage_images::tick::Preset;

use super::slot::Slot;

static FIXED: Slot<ReducedModel> = Slot::new();
static SINGLE: Slot<FloatModel<f32>> = Slot::new();
static DOUBLE: Slot<FloatModel<f64>> = Slot::new();

/// The models of a preset. Returns 1 if they can be built.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_build(preset: u32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Some(rig) = Rig::named(preset.name()) else { return 0 };
    SINGLE.put(|| FloatModel::of(&rig));
    DOUBLE.put(|| FloatModel::of(&rig));
    ReducedModel::try_build(&rig).map(|model| FIXED.put(|| model)).is_ok().into()
}

macro_rules! function {
    ($name:ident, $slot:ident, $call:expr) => {
        /// See `interstage_images::model::VARIANTS`.
        #[unsafe(no_mangle)]
        pub(super) extern "C" fn $name(given: &Given) -> i32 {
            $slot.get().map_or(0, |ready| $call(ready, given))
        }
    };
}

function!(fixed_forward, FIXED, model::fixed_forward);
function!(fixed_inverse, FIXED, model::fixed_inverse);
function!(f32_forward, SINGLE, FloatModel::forward);
function!(f32_inverse, SINGLE, FloatModel::inverse);
function!(f64_forward, DOUBLE, FloatModel::forward);
function!(f64_inverse, DOUBLE, FloatModel::inverse);
