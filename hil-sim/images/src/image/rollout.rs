//! A rollout of the tread.

use interstage::model::tread::{Tread, TreadState};
use interstage::rig::Rig;
use interstage_images::rollout::Given;
use interstage_images::tick::Preset;

use super::slot::Slot;

static TREAD: Slot<Tread> = Slot::new();
static STATE: Slot<TreadState> = Slot::new();

/// The tread of a preset. Returns 1 if it can be built.
#[unsafe(no_mangle)]
pub(super) extern "C" fn model_build(preset: u32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Some(rig) = Rig::named(preset.name()) else { return 0 };
    STATE.put(TreadState::default);
    Tread::try_build(&rig).map(|tread| TREAD.put(|| tread)).is_ok().into()
}

/// A crossing: its gap.
#[unsafe(no_mangle)]
pub(super) extern "C" fn rollout(given: &Given) -> i32 {
    let (Some(tread), Some(state)) = (TREAD.get(), STATE.get()) else { return 0 };
    given.gap(tread, state)
}
