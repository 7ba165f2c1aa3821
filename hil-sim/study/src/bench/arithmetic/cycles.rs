//! What a call costs on the emulated core, with its answer checked.

use anyhow::{Context, Result, ensure};
use interstage::model::reduced::Scale;
use interstage_arith::{Double, Fixed, Given, Libm, Micro, Model, Number};
use interstage_images::arith::{FUNCTIONS, crossing, force};

use super::{Scene, Variant};
use hil_sim::firmware::{Profile, build_binary};
use rig_board::account::{IMAGE, Spread};
use rig_board::image::{ARGUMENTS, Image};

/// Largest difference of core and host where an arithmetic is not the same to the bit,
/// LSB of Q15.16: floating point may be contracted on the one and not on the other.
const FLOAT_LSB: i32 = 64;

/// Fills in the cycles of the variants, which are those of `FUNCTIONS`.
pub(super) fn measure(scenes: &[Scene], variants: &mut [Variant]) -> Result<()> {
    let elf = build_binary(IMAGE.0, IMAGE.1, Profile::Release, &[])?;
    let mut image = Image::open(&elf)?;
    let mut spreads = vec![[Spread::default(); 2]; variants.len()];
    for scene in scenes {
        load(&mut image, scene)?;
        let forward: Vec<_> = scene.points.iter().map(|point| point.forward).collect();
        let inverse: Vec<_> = scene.points.iter().map(|point| point.inverse).collect();
        for (index, (name, forwards, back)) in FUNCTIONS.into_iter().enumerate() {
            let host = on_host(index, scene)?;
            let courses = [(forwards, &forward, &host.0), (back, &inverse, &host.1)];
            for (course, (function, givens, host)) in courses.into_iter().enumerate() {
                let words: Vec<_> = givens.iter().map(Given::words).collect();
                let (values, spread) = image.measure(function, &words)?;
                for (given, value) in givens.iter().zip(values) {
                    let (core, host) = (value as i32, host(given));
                    let most = if index < 2 { 0 } else { FLOAT_LSB };
                    ensure!(
                        core.abs_diff(host) <= most as u32,
                        "{name}: {core} on the core, {host} on the host at {given:?}"
                    );
                }
                add(&mut spreads[index][course], &spread);
            }
        }
    }
    for (variant, [forward, inverse]) in variants.iter_mut().zip(spreads) {
        for (course, spread) in [(&mut variant.forward, forward), (&mut variant.inverse, inverse)] {
            course.cycles = Some(spread.most);
            course.mean_cycles = Some(spread.mean());
        }
    }
    Ok(())
}

/// Gives the image the models of a scene.
fn load(image: &mut Image, scene: &Scene) -> Result<()> {
    let words: Vec<u32> = scene
        .flat
        .iter()
        .flat_map(|value| {
            let bits = value.to_bits();
            [bits as u32, (bits >> 32) as u32]
        })
        .collect();
    image.put(ARGUMENTS, &words)?;
    let loaded = image.function("arith_load")?;
    ensure!(image.call(loaded, &[ARGUMENTS])?.value == 1, "a coefficient is out of range");
    let built = image.function("arith_build_shipping")?;
    let arguments = [scene.preset as u32, scene.step_height as u32];
    ensure!(image.call(built, &arguments)?.value == 1, "the shipping model cannot be built");
    Ok(())
}

type Host<'a> = Box<dyn Fn(&Given) -> i32 + 'a>;

/// The same functions on the host.
fn on_host(index: usize, scene: &Scene) -> Result<(Host<'_>, Host<'_>)> {
    fn other<'a, N: Number + 'a>(scene: &Scene) -> Result<(Host<'a>, Host<'a>)> {
        let model = Model::<N>::of(&scene.flat).context("a coefficient is out of range")?;
        Ok((Box::new(move |g| model.crossing(g).gap), Box::new(move |g| model.force(g))))
    }
    match index {
        0 => {
            let model = &scene.shipping;
            Ok((
                Box::new(|g| crossing(model, Scale::NOMINAL, g).gap),
                Box::new(|g| force(model, Scale::NOMINAL, g)),
            ))
        }
        1 => other::<Fixed>(scene),
        2 => other::<Micro>(scene),
        3 => other::<Libm>(scene),
        _ => other::<Double>(scene),
    }
}

/// Adds the calls of another scene.
fn add(sum: &mut Spread, more: &Spread) {
    if sum.calls == 0 || more.least < sum.least {
        sum.least = more.least;
    }
    if more.most > sum.most {
        (sum.most, sum.dearest) = (more.most, more.dearest);
    }
    sum.calls += more.calls;
    sum.cycles += more.cycles;
    sum.instructions += more.instructions;
}
