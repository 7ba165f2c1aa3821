//! Axial position: the wheel's travel, less what rolling over corners takes, corrected at
//! every recognised step.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{divide, sqrt};
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Steps whose tolerance weighs as much as the odometry from a sure position: a sleeve is
/// machined to 0.3 mm, odometry is off by less than 0.1 mm over the 22 mm between two steps.
const SURE: u8 = 9;

/// Largest correction at one step, mm: beyond it the step is not the one expected.
const LARGEST: Millimetres = q16(2_000_000);

/// Travel of the tread after which it is converted to axial travel, mm. Shorter, the noise
/// of the rise would count; longer, the position would lag on a corner.
const CHORD: Millimetres = q16(800_000);

/// Offset of the position from the wheel's travel, and the chord that is not converted yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Odometry {
    offset: Travel,
    /// Steps of the table that the offset is the mean of; [`SURE`] for a position that is known.
    steps: u8,
    from: Option<Start>,
}

/// How the wheel rolls in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Rolling {
    /// Distance of the centre from the pillar axis, mm.
    pub radius: Millimetres,
    /// Compression over the rolling radius, by which the tread runs farther than the axle.
    pub lag: Ratio,
    /// The wheel rises or sinks over a corner.
    pub on_corner: bool,
}

/// Where a chord began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Start {
    travel: Travel,
    radius: Millimetres,
}

impl Odometry {
    /// Position by this travel, mm from the stow end.
    pub fn position(&self, travel: Travel) -> Millimetres {
        let position = travel.saturating_add(self.offset);
        Q16::narrow(position)
    }

    /// Declares that the wheel is at `position`.
    pub fn set(&mut self, travel: Travel, position: Millimetres) {
        self.offset = position.widen().saturating_sub(travel);
        self.steps = SURE;
        self.from = None;
    }

    /// Declares that the wheel is at `position` because a step was found: as sure as that
    /// step's place.
    pub fn set_by_step(&mut self, travel: Travel, position: Millimetres) {
        self.set(travel, position);
        self.steps = 1;
    }

    /// Begins a run: what moved the arm since the last one was no rolling.
    pub fn begin_run(&mut self) {
        self.from = None;
    }

    /// Takes over the part of the difference between where a step was found and where the
    /// table has it, mm, by which the offset is the mean over the steps found.
    pub fn correct(&mut self, residual: Millimetres) {
        let steps = (self.steps + 1).min(SURE + 1);
        let share = divide(residual.clamp(-LARGEST, LARGEST), Q16::from_num(steps));
        self.steps = steps.min(SURE);
        self.offset = self.offset.saturating_sub(share.widen());
    }

    /// The step found last lies `shift` further out than its residual had it, mm.
    pub fn refine(&mut self, shift: Millimetres) {
        let share = divide(shift, Q16::from_num(self.steps.max(1)));
        self.offset = self.offset.saturating_sub(share.widen());
    }

    /// Converts what the tread has travelled to axial travel once it makes a chord, or `now`.
    ///
    /// The wheel rolls by `ds = (1 - lag) ds_0` where its tread turns by ds_0; with the rise dy of the
    /// centre the axle advances by dx, `dx^2 + dy^2 = ds^2` (first order in the compression).
    /// `on_corner`: the rise counts; on the wall it is noise.
    pub fn roll(&mut self, travel: Travel, rolling: &Rolling, now: bool) {
        let Some(from) = self.from else {
            self.from = Some(Start { travel, radius: rolling.radius });
            return;
        };
        let signed = Q16::narrow(travel.saturating_sub(from.travel));
        let tread = signed.abs();
        if tread < CHORD && !now {
            return;
        }
        self.from = Some(Start { travel, radius: rolling.radius });
        let rolled = tread - tread * rolling.lag;
        let rise = if rolling.on_corner { rolling.radius - from.radius } else { Q16::ZERO };
        let advanced = sqrt((rolled * rolled - rise * rise).max(Q16::ZERO));
        let lost = if signed < Q16::ZERO { advanced - tread } else { tread - advanced };
        self.offset = self.offset.saturating_sub(lost.widen());
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Axial travel, mm, that the odometry makes of a wheel whose centre pivots about an edge
    /// at `reach`, from `angle` rad before it to upright, mm and ticks of `step` of tread.
    fn over_an_edge(reach: f64, angle: f64, step: f64, lag: f64, noise: &[f64]) -> f64 {
        let mut odometry = Odometry::default();
        let length = reach * angle / (1.0 - lag);
        let ticks = (length / step).ceil() as usize;
        let mut travel = Travel::ZERO;
        for tick in 0..=ticks {
            let tread = length * tick as f64 / ticks as f64;
            let left = angle - tread * (1.0 - lag) / reach;
            let rolling = Rolling {
                radius: Q16::from_num(150.0 - reach * left.cos() + noise[tick % noise.len()]),
                lag: Q16::from_num(lag),
                on_corner: true,
            };
            travel = Travel::from_num(tread);
            odometry.roll(travel, &rolling, tick == ticks);
        }
        odometry.position(travel).to_num()
    }

    proptest! {
        #[test]
        fn over_an_edge_the_axle_advances_by_the_sine(
            reach in 22.0..25.0f64,
            angle in 0.2..0.6f64,
            step in 0.002..0.05f64,
            lag in 0.0..0.02f64,
        ) {
            let advanced = over_an_edge(reach, angle, step, lag, &[0.0]);
            prop_assert!((advanced - reach * angle.sin()).abs() < 0.01, "{advanced}");
        }

        #[test]
        fn on_the_wall_only_the_rolling_radius_counts(
            travelled in -60.0..60.0f64,
            lag in 0.0..0.02f64,
        ) {
            let mut odometry = Odometry::default();
            let mut travel = Travel::ZERO;
            for tick in 0..=1000 {
                travel = Travel::from_num(travelled * f64::from(tick) / 1000.0);
                // An arm that shakes is no climb.
                let radius = Q16::from_num(125.0 + 0.05 * f64::from(tick % 2));
                let rolling = Rolling { radius, lag: Q16::from_num(lag), on_corner: false };
                odometry.roll(travel, &rolling, tick == 1000);
            }
            let position: f64 = odometry.position(travel).to_num();
            prop_assert!((position - travelled * (1.0 - lag)).abs() < 0.01, "{position}");
        }
    }

    #[test]
    fn noise_of_the_arm_costs_a_few_hundredths_over_a_corner() {
        let quiet = over_an_edge(24.0, 0.57, 0.008, 0.01, &[0.0]);
        let noise = [0.02, -0.01, 0.03, -0.03, 0.0, 0.01, -0.02];
        let noisy = over_an_edge(24.0, 0.57, 0.008, 0.01, &noise);
        assert!((noisy - quiet).abs() < 0.05, "{noisy} {quiet}");
    }

    #[test]
    fn what_moves_the_arm_between_runs_is_no_climb() {
        let mut odometry = Odometry::default();
        let at = |radius: i32| Rolling {
            radius: Q16::from_num(radius),
            lag: Q16::ZERO,
            on_corner: true,
        };
        odometry.roll(Travel::ZERO, &at(125), false);
        odometry.begin_run();
        odometry.roll(Travel::ZERO, &at(121), false);
        odometry.roll(Travel::from_num(5), &at(121), true);
        assert_eq!(odometry.position(Travel::from_num(5)), Q16::from_num(5));
    }

    #[test]
    fn of_a_sure_position_a_tenth_of_a_residual_is_taken_over() {
        let mut odometry = Odometry::default();
        odometry.set(Travel::ZERO, Q16::ZERO);
        odometry.correct(Q16::from_num(0.5));
        let position: f64 = odometry.position(Travel::from_num(20)).to_num();
        assert!((position - 19.95).abs() < 1e-3, "{position}");
    }

    #[test]
    fn a_step_that_is_refined_counts_as_if_it_had_been_found_there() {
        let [mut late, mut at_once] = [Odometry::default(); 2];
        for odometry in [&mut late, &mut at_once] {
            odometry.set_by_step(Travel::ZERO, Q16::ZERO);
        }
        late.correct(Q16::from_num(0.5));
        late.refine(Q16::from_num(-0.2));
        at_once.correct(Q16::from_num(0.3));
        let [late, at_once] = [late, at_once].map(|odometry| odometry.position(Travel::ZERO));
        assert!((late - at_once).abs() < q16(100), "{late} {at_once}");
    }

    #[test]
    fn a_position_that_steps_set_is_the_mean_over_their_places() {
        let places = [0.3, -0.2, 0.2, -0.1];
        let mut odometry = Odometry::default();
        // The step at 20 mm is found; the table has it off by its place error.
        odometry.set_by_step(Travel::ZERO, Q16::from_num(places[0]));
        for found in 2..=places.len() {
            let off: f64 = odometry.position(Travel::ZERO).to_num();
            odometry.correct(Q16::from_num(off - places[found - 1]));
            let mean = places[..found].iter().sum::<f64>() / found as f64;
            let off: f64 = odometry.position(Travel::ZERO).to_num();
            assert!((off - mean).abs() < 1e-3, "{off} {mean}");
        }
    }
}
