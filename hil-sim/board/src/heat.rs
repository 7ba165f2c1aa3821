//! Where cycles go: those of blocks of code by the function of the source, also of what
//! was inlined.

pub(crate) mod names;

use std::collections::BTreeMap;

use super::core::Heat;
use super::elf::{FLASH, Loaded, named};
use super::image::ImageError;
use super::{thumb, timing};

use names::Names;

/// Cycles by function, the most expensive first; `elf` is the image with its debug
/// information, `loaded` the same as it lies in flash.
///
/// # Errors
/// [`ImageError::Form`] if the image's debug information cannot be read.
pub fn by_function(
    elf: &[u8],
    loaded: &Loaded,
    heat: &Heat,
) -> Result<Vec<(String, u64)>, ImageError> {
    let names = Names::read(elf)?;
    let mut sums = BTreeMap::<String, f64>::new();
    for (&(address, size), &cycles) in heat {
        let costs = costs(loaded, address, size);
        let whole: u64 = costs.iter().map(|(_, cost)| cost).sum();
        for (at, cost) in costs {
            let name = names.at(at).unwrap_or_else(|| named(&loaded.functions, at).to_owned());
            *sums.entry(name).or_default() += cycles as f64 * cost as f64 / whole as f64;
        }
    }
    let mut sums: Vec<_> =
        sums.into_iter().map(|(name, cycles)| (name, cycles.round() as u64)).collect();
    sums.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    Ok(sums)
}

/// Instructions of a block with what each costs by itself.
fn costs(loaded: &Loaded, address: u32, size: u32) -> Vec<(u32, u64)> {
    let from = address.wrapping_sub(FLASH.base) as usize;
    let code = loaded.flash.get(from..from + size as usize).unwrap_or_default();
    let costs = thumb::sweep(code, address);
    costs.map(|(at, found, _)| (at, 1 + timing::extra(found.kind))).collect()
}
