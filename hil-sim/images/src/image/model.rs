//! The reduced model, one call each.

use interstage::model::reduced::{ReducedModel, Scale};
use interstage::rig::Rig;
use interstage_images::model::{self, Given};
use interstage_images::tick::Preset;

use super::slot::Slot;

static MODEL: Slot<ReducedModel> = Slot::new();
/// Of the call that follows.
static SCALE: Slot<Scale> = Slot::new();

/// The model of a preset. Returns 1 if it can be built.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_build(preset: u32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Some(rig) = Rig::named(preset.name()) else { return 0 };
    ReducedModel::try_build(&rig).map(|model| MODEL.put(|| model)).is_ok().into()
}

/// Makes the scale of the next call.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_scale(given: &Given) -> i32 {
    SCALE.put(|| given.scale());
    given.scale
}

/// Model and scale of a call.
#[inline(always)]
fn ready() -> Option<(&'static ReducedModel, Scale)> {
    Some((MODEL.get()?, *SCALE.get()?))
}

/// Gap under a force, mm.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_forward(given: &Given) -> i32 {
    ready().map_or(0, |(m, scale)| model::forward(m, scale, given))
}

/// Force for a gap, N.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_inverse_preload(given: &Given) -> i32 {
    ready().map_or(0, |(m, scale)| model::inverse_preload(m, scale, given))
}

/// Speed at which a force holds a gap, mm/s.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_inverse_speed(given: &Given) -> i32 {
    ready().map_or(0, |(m, scale)| model::inverse_speed(m, scale, given))
}
