//! The reduced model, one call each.

use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_images::model::{self, Given};
use interstage_images::tick::Preset;

use super::slot::Slot;

static MODEL: Slot<ReducedModel> = Slot::new();

/// The model of a preset. Returns 1 if it can be built.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_build(preset: u32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Some(rig) = Rig::named(preset.name()) else { return 0 };
    ReducedModel::try_build(&rig).map(|model| MODEL.put(|| model)).is_ok().into()
}

/// Gap under a force, mm.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_forward(given: &Given) -> i32 {
    MODEL.get().map_or(0, |m| model::forward(m, given))
}

/// Force for a gap, N.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_inverse_preload(given: &Given) -> i32 {
    MODEL.get().map_or(0, |m| model::inverse_preload(m, given))
}

/// Speed at which a force holds a gap, mm/s.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_inverse_speed(given: &Given) -> i32 {
    MODEL.get().map_or(0, |m| model::inverse_speed(m, given))
}
