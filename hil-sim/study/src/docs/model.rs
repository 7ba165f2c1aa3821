//! The generated blocks of `docs/MODEL.md`, and its picture.

mod figures;

use std::fmt::Write as _;

use anyhow::Result;
use rayon::prelude::*;

use super::blocks::fill;
use crate::reference::impact::dispersion::Wave;
use crate::reference::impact::rubber::THICKNESS_MM;
use crate::reference::impact::{self, Rubber};
use crate::reference::vibration::{Arm, CONSTRAINED_HZ, FREE_HZ};
use crate::reference::{ReferenceError, Resolution, collision};
use hil_sim::report::{Published, published_svg};

pub use figures::Figures;

/// What the study prints for a case, beside the case.
#[derive(Clone, Copy, Debug)]
pub struct Printed {
    /// Speed, mm/s, and preload, N.
    pub at: (f64, f64),
    /// Amplitude of vibration, that is contact gap, mm.
    pub gap_mm: f64,
    /// Collision force, N.
    pub force_n: f64,
    /// Impact stress; printed in Pa, which is in doubt, so that only ratios are used.
    pub stress: f64,
}

/// The three cases of the study's finite elements.
pub const PRINTED: [Printed; 3] = [
    Printed { at: (5.0, 100.0), gap_mm: 1.7079, force_n: 56.5261, stress: 66.7738 },
    Printed { at: (5.0, 120.0), gap_mm: 1.5567, force_n: 51.2358, stress: 63.6418 },
    Printed { at: (8.0, 100.0), gap_mm: 1.9014, force_n: 58.5963, stress: 69.3387 },
];

/// `page` with its generated blocks as they are now.
///
/// # Errors
/// If a block is missing or a reference refuses.
pub fn fill_model(page: &str) -> Result<String> {
    let figures = PRINTED
        .par_iter()
        .map(|printed| Figures::of(printed.at))
        .collect::<Result<Vec<_>, ReferenceError>>()?;
    let page = fill(page, "published", &published(&figures))?;
    let page = fill(&page, "orders", &orders(&figures)?)?;
    fill(&page, "modes", &modes(&figures[0])?)
}

/// The picture of the page: the ring's gaps and forces over preload, and the published
/// ones.
///
/// # Errors
/// If a crossing cannot be computed.
pub fn model_svg() -> Result<String> {
    let preloads: Vec<f64> = (0..=10).map(|i| 80.0 + 6.0 * f64::from(i)).collect();
    let line = |speed: f64| -> Result<Vec<(f64, f64, f64)>, ReferenceError> {
        let points = preloads.par_iter().map(|&preload| {
            let case = figures::case((speed, preload), Resolution::FIGURE);
            let crossing = collision::quasi_static(&case)?;
            let gap = crossing.lift.map_or(f64::NAN, |lift| lift.gap_mm);
            Ok((preload, gap, crossing.peak_n()))
        });
        points.collect()
    };
    let printed = |speed: f64| {
        let of = PRINTED.iter().filter(move |p| p.at.0 == speed);
        of.map(|p| (p.at.1, p.gap_mm, p.force_n)).collect()
    };
    Ok(published_svg(&Published {
        slow: line(5.0)?,
        fast: line(8.0)?,
        printed_slow: printed(5.0),
        printed_fast: printed(8.0),
    }))
}

fn published(figures: &[Figures]) -> String {
    let mut text = String::from(
        "| case | gap, mm: published | ours (fitted) | collision force, N: published | ours | \
         impact stress to the first: published | ours |\n|---|---|---|---|---|---|---|\n",
    );
    let first = &figures[0];
    for (printed, ours) in PRINTED.iter().zip(figures) {
        let _ = writeln!(
            text,
            "| {} mm/s, {} N | {:.4} | {:.3} | {:.1} | {:.1} | {:.2} | {:.2} |",
            printed.at.0,
            printed.at.1,
            printed.gap_mm,
            ours.gap_mm,
            printed.force_n,
            ours.force_n,
            printed.stress / PRINTED[0].stress,
            ours.stress_pa / first.stress_pa,
        );
    }
    let change = |of: fn(&Printed) -> f64| 100.0 * (of(&PRINTED[1]) / of(&PRINTED[0]) - 1.0);
    let ours = 100.0 * (figures[1].force_n / first.force_n - 1.0);
    let _ = write!(
        text,
        "\nFrom 100 to 120 N at 5 mm/s the published force falls by {:.1} %; ours rises by \
         {ours:.1} %. The impact stress is the largest mean pressure above that of rolling: \
         {:.2} MPa in the first case.",
        -change(|p| p.force_n),
        first.stress_pa * 1e-6,
    );
    text
}

fn orders(figures: &[Figures]) -> Result<String> {
    let (slow, fast) = (&figures[0], &figures[2]);
    let mut text = format!(
        "| | {} mm/s, {} N | {} mm/s, {} N |\n|---|---|---|\n",
        slow.at.0, slow.at.1, fast.at.0, fast.at.1
    );
    let mut row = |name: &str, of: fn(&Figures) -> f64, decimals: usize| {
        let _ = writeln!(text, "| {name} | {:.decimals$} | {:.decimals$} |", of(slow), of(fast));
    };
    row("closing speed v sin(phi), mm/s", |f| f.closing_mm_s, 2);
    row("largest force of inertia while climbing, N", |f| f.inertia_n, 2);
    row("its bound, v sin(phi) sqrt(k m), N", |f| f.inertia_bound_n, 1);
    row("jump of stress at the touch at most, Pa", |f| f.jump_pa, 0);
    row("largest bending of the arm at the wheel, mm", |f| f.bending_mm, 3);
    row("vibration of it while climbing, um", |f| 1e3 * f.vibration_mm, 2);
    let way_m = THICKNESS_MM * 1e-3;
    text += "\n| rubber | transit of 8 mm, ms: front | slow wave | attenuation at most, dB |\n\
             |---|---|---|---|\n";
    let case = figures::case(PRINTED[0].at, Resolution::HISTORY);
    let rubbers = [
        ("the fitted tread", Rubber::of(&case)?),
        ("sheets, tan delta 0.1 at 10 Hz", Rubber::of_sheets(0.1, 10.0)?),
        ("sheets, tan delta 0.25 at 100 Hz", Rubber::of_sheets(0.25, 100.0)?),
    ];
    for (name, rubber) in rubbers {
        let limit_np = impact::dispersion::front_attenuation_np_m(&rubber);
        let wave = Wave { number_rad_m: 0.0, attenuation_np_m: limit_np };
        let _ = writeln!(
            text,
            "| {name} | {:.3} | {:.3} | {:.4} |",
            1e3 * way_m / rubber.front_speed_m_s(),
            1e3 * way_m / rubber.slow_speed_m_s(),
            wave.loss_db(way_m),
        );
    }
    Ok(text)
}

fn modes(first: &Figures) -> Result<String> {
    let case = figures::case(first.at, Resolution::HISTORY);
    let arm = Arm::of(&case)?;
    let bare = Arm { tip: Default::default(), ..arm };
    let held = arm.on_tread(&case, first.patch_mm2)?;
    let mut text = String::from("| Hz | 1 | 2 | 3 | 4 |\n|---|---|---|---|---|\n");
    let rows = [
        ("bare arm, clamped".to_owned(), bare),
        (format!("with {:.1} g at the tip (fitted)", 1e3 * arm.tip.mass_kg), arm),
        (format!("and the tread, {:.0} N/mm", 1e-3 * held.tip.spring_n_per_m), held),
    ];
    for (name, arm) in rows {
        let modes = arm.modes(4)?;
        let cells: Vec<String> =
            modes.iter().map(|mode| format!("{:.1}", mode.frequency_hz)).collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
    let _ = writeln!(text, "| published: constrained | {CONSTRAINED_HZ} | | | |");
    let _ = write!(text, "| published: free, the seventh | {FREE_HZ} | | | |");
    Ok(text)
}

#[cfg(test)]
mod tests;
