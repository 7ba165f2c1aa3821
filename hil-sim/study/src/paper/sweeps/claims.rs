//! The study's claims about its figures 20 to 23.

use super::{Curves, GRID, Sweep};
use crate::figure::Claim;
use crate::paper::means::bend;
use crate::paper::published::{AREA_SPREAD_MM2, DEPTH_SPREAD_MM, GAP_SPREAD_MM};

const SECTION: &str = "Analysis and discussion of test results";

/// Whether a spread is the published one within a factor of two.
fn alike(published: f64, ours: f64) -> bool {
    (0.5..=2.0).contains(&(ours / published))
}

fn ends(curves: &Curves, decimals: usize, unit: &str) -> String {
    let ends = |values: &[f64]| {
        format!("{:.decimals$} to {:.decimals$} {unit}", values[0], values[values.len() - 1])
    };
    format!(
        "Theory {}, simulation {}, virtual rig {}.",
        ends(&curves.theory),
        ends(&curves.simulation),
        ends(&curves.experiment.middle())
    )
}

/// Whether theory and simulation, and all four means, change with one sign throughout.
fn all_go(curves: &Curves, sense: f64) -> bool {
    let goes = |values: &[f64]| values.windows(2).all(|w| sense * (w[1] - w[0]) > 0.0);
    goes(&curves.theory) && goes(&curves.simulation) && curves.experiment.all_go(sense)
}

/// The bend over the rise of theory, simulation and the mean of means.
fn bends(curves: &Curves) -> [f64; 3] {
    [&curves.theory, &curves.simulation, &curves.experiment.middle()].map(|values| bend(values))
}

/// Whether theory, simulation and all four means bend to the same side of a straight line.
fn nonlinear(curves: &Curves) -> bool {
    let [theory, simulation, _] = bends(curves);
    let means = curves.experiment.bends();
    [theory, simulation].iter().chain(&means).all(|bend| bend * theory > 0.0)
}

fn bent(curves: &Curves) -> String {
    let [theory, simulation, experiment] = bends(curves).map(|bend| 100.0 * bend);
    format!(
        "Off the straight line between the ends by {theory:+.1} %, {simulation:+.1} % and \
         {experiment:+.1} % of the change (theory, simulation, virtual rig)."
    )
}

/// A claim about the largest difference between the four means.
fn spread(
    of: Claim,
    claim: &'static str,
    published: f64,
    ours: f64,
    (unit, decimals): (&str, usize),
) -> Claim {
    // The tolerances that would be needed for the published one.
    let narrower = format!(
        "Ours is {:.0} % of the published one: between means of ten, {published} {unit} takes \
         single runs {:.1} times as far apart as the tolerances of the virtual rig make them. \
         These are chosen, not published; wear within a series of runs, which the study \
         names as a source, is not modelled as a drift.",
        100.0 * ours / published,
        published / ours
    );
    of.judged(claim, alike(published, ours), format!("{ours:.decimals$} {unit}."), &narrower)
}

/// Claims about the sweep over the preload: figures 20 and 22.
pub fn preload_claims(sweep: &Sweep) -> Vec<Claim> {
    let of = |figure, id| Claim::of(figure, SECTION, id);
    let (gap, depth, area) = (&sweep.gap, &sweep.depth, &sweep.area);
    let gap_spread = gap.experiment.spread();
    let fall = -gap.experiment.rise();
    vec![
        of("fig20", "gap-falls-with-preload").judged(
            "At constant speed, more preload in the transition leaves a smaller contact gap; all \
             four mean curves show the same trend.",
            all_go(gap, -1.0),
            ends(gap, 3, "mm"),
            "",
        ),
        spread(
            of("fig20", "gap-spread-preload"),
            "The largest difference between the four mean curves of the gap is 0.24 mm.",
            GAP_SPREAD_MM.0,
            gap.experiment.spread(),
            ("mm", 3),
        ),
        of("fig20", "errors-do-not-hide-the-trend").judged(
            "Wear, delayed preload and part tolerances do not hide how the gap depends on the \
             conditions.",
            fall > gap_spread,
            format!(
                "The gap changes by {fall:.3} mm over the sweep, the means differ by {gap_spread:.3} mm \
                 at most; measured and true gap differ by {:.3} mm at most.",
                measured_off(sweep)
            ),
            "",
        ),
        of("fig22", "depth-grows-with-preload").judged(
            "At constant speed the embedding depth grows with the preload, nonlinearly.",
            all_go(depth, 1.0) && nonlinear(depth),
            format!("{} {}", ends(depth, 3, "mm"), bent(depth)),
            "It grows, but not all six curves bend to the same side.",
        ),
        of("fig22", "area-grows-with-depth-preload").judged(
            "As the embedding depth grows with the preload, so does the contact area.",
            all_go(area, 1.0),
            ends(area, 1, "mm²"),
            "",
        ),
        spread(
            of("fig22", "depth-spread-preload"),
            "The largest difference between the four means of the depth is 0.18 mm.",
            DEPTH_SPREAD_MM.0,
            depth.experiment.spread(),
            ("mm", 3),
        ),
        spread(
            of("fig22", "area-spread-preload"),
            "The largest difference between the four means of the area is 2.04 mm².",
            AREA_SPREAD_MM2.0,
            area.experiment.spread(),
            ("mm²", 2),
        ),
        spreads_agree(sweep, "fig22", "depth-and-area-spreads-agree-preload", (DEPTH_SPREAD_MM.0, AREA_SPREAD_MM2.0)),
    ]
}

/// Claims about the sweep over the speed: figures 21 and 23.
pub fn speed_claims(sweep: &Sweep, preload: &Sweep) -> Vec<Claim> {
    let of = |figure, id| Claim::of(figure, SECTION, id);
    let (gap, depth, area) = (&sweep.gap, &sweep.depth, &sweep.area);
    let gap_spread = gap.experiment.spread();
    let other = preload.gap.experiment.spread();
    vec![
        of("fig21", "gap-grows-with-speed").judged(
            "At constant preload the contact gap grows with the speed, nonlinearly.",
            all_go(gap, 1.0) && nonlinear(gap),
            format!("{} {}", ends(gap, 3, "mm"), bent(gap)),
            "",
        ),
        spread(
            of("fig21", "gap-spread-speed"),
            "The largest difference between the four mean curves of the gap is 0.32 mm.",
            GAP_SPREAD_MM.1,
            gap.experiment.spread(),
            ("mm", 3),
        ),
        of("fig21", "speed-spreads-more").judged(
            "The means differ more over the speed (0.32 mm) than over the preload (0.24 mm), \
             because of wear and momentary slip.",
            gap_spread > 1.1 * other,
            format!(
                "{gap_spread:.3} mm over the speed, {other:.3} mm over the preload; gross slip of a run \
                 at most {:.3} mm.",
                sweep.slip_mm
            ),
            "The same forty rigs make both sweeps, and their tolerances move the entire curve.",
        ),
        of("fig23", "depth-grows-with-speed").judged(
            "At constant preload the embedding depth grows with the speed.",
            all_go(depth, 1.0),
            ends(depth, 3, "mm"),
            "It falls. Rubber stiffens with speed, so that the wheel sinks in less: that is why its \
             gap grows. A wheel that sank in deeper would be lower over the root of the step \
             and leave a smaller gap, against figure 21.",
        ),
        of("fig23", "area-grows-with-depth-speed").judged(
            "The contact area grows with the speed, as the depth does.",
            all_go(area, 1.0),
            ends(area, 1, "mm²"),
            "It falls with the depth, for the same reason.",
        ),
        of("fig23", "area-follows-depth").judged(
            "Contact area and embedding depth change alike.",
            all_go(area, 1.0) == all_go(depth, 1.0) && all_go(area, -1.0) == all_go(depth, -1.0),
            "Both change with the same sign in theory, simulation and all four means.".into(),
            "",
        ),
        spread(
            of("fig23", "depth-spread-speed"),
            "The largest difference between the four means of the depth is 0.21 mm.",
            DEPTH_SPREAD_MM.1,
            depth.experiment.spread(),
            ("mm", 3),
        ),
        spread(
            of("fig23", "area-spread-speed"),
            "The largest difference between the four means of the area is 2.71 mm².",
            AREA_SPREAD_MM2.1,
            area.experiment.spread(),
            ("mm²", 2),
        ),
        spreads_agree(sweep, "fig23", "depth-and-area-spreads-agree-speed", (DEPTH_SPREAD_MM.1, AREA_SPREAD_MM2.1)),
    ]
}

/// Whether a published spread of the area is what geometry makes of that of the depth.
fn spreads_agree(
    sweep: &Sweep,
    figure: &'static str,
    id: &'static str,
    (depth_mm, area_mm2): (f64, f64),
) -> Claim {
    let rise = |curves: &Curves| curves.theory[GRID - 1] - curves.theory[0];
    let per_depth = rise(&sweep.area) / rise(&sweep.depth);
    let expected = per_depth * depth_mm;
    Claim::of(figure, SECTION, id).judged(
        "The published spreads of depth and area belong to one wheel of 25 mm by 28 mm.",
        alike(expected, area_mm2),
        format!(
            "A tread that is {depth_mm} mm deeper touches {expected:.1} mm² more at lift-off; \
             published are {area_mm2} mm²."
        ),
        "The two do not belong together: the study does not say how it made areas of its sensors.",
    )
}

/// Largest difference of the measured from the true mean of means, mm.
fn measured_off(sweep: &Sweep) -> f64 {
    let pairs = sweep.gap.experiment.middle().into_iter().zip(sweep.true_gap.middle());
    pairs.map(|(measured, is)| (measured - is).abs()).fold(0.0, f64::max)
}
