//! Axial position: the wheel's travel, less what rolling over corners takes, corrected at
//! every recognised step. What the steps show of the wheel's rolling radius corrects the travel
//! after them, within the run: the next one finds the same steps again, which are no news.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{between, divide, sqrt};
use crate::units::{Direction, Millimetres, Q16, Ratio, Travel, q16};

/// Deviation of a step's place, mm: a sleeve is machined to 0.3 mm, evenly spread; its reciprocal.
const PLACE: Millimetres = q16(173_205);
const PER_PLACE: Q16 = q16(5_773_503);
/// Variance of a known position over that of a step's place: 0.03 mm.
const KNOWN: Ratio = q16(30_000);
/// What the variance of the position grows by from step to step: 0.03 mm, on a corner above all; and a
/// tenth of what the tread gives way by. So much more it creeps at one speed than at another, by its
/// model, if it relaxes in a third of its time or in three times that.
const WANDERS: Ratio = q16(30_000);
const WANDERS_PART: Ratio = q16(100_000);
/// The same of the travel after 64 mm while no step has shown the wheel's radius: 0.13 %, a wheel
/// that is made and worn to 0.05 mm.
const UNKNOWN_RADIUS: Ratio = q16(250_000);
/// Reciprocal of these 64 mm.
const PER_REACH: Q16 = q16(15_625);
/// The same of the part by which the tread winds up otherwise than by its model, per millimetre: 0.2,
/// of a compound and a hub that make it 0.7 to 1.4 times as compliant.
const UNKNOWN_WINDING: Ratio = q16(1_333_000);
/// The same of its creep, of the same compliance and of a contact that is 0.25 longer or shorter.
const UNKNOWN_CREEP: Ratio = q16(4_080_000);
/// Variance of where a step is found, over that of its place: as that, and by how it is seen: two codes
/// of the arm, 0.09 mm.
const FOUND: Ratio = q16(1_250_000);
/// By how much all edges of a sleeve seem off together, mm: rounded by up to 0.5 mm, of which half shows to
/// a wheel that climbs, and most to one that comes down, evenly spread; and while none has shown what the
/// compression sensor misses.
const ROUNDED: [Millimetres; 2] = [q16(140_000), q16(250_000)];
const UNREAD: Millimetres = q16(220_000);
/// How far an edge seems to move under a climbing wheel, mm: two codes of the arm, as above.
const EDGE: Millimetres = q16(90_000);
/// Largest correction of the travel, relative.
const MOST_SCALE: Ratio = q16(20_000);
/// The same of winding up and creep.
const MOST_MORE: Ratio = q16(2_000_000);

/// Travel of the tread after which it is converted to axial travel, mm. Shorter, the noise
/// of the rise would count; longer, the position would lag on a corner.
const CHORD: Millimetres = q16(800_000);

/// Offset of the position from the wheel's travel, and the chord that is not converted yet.
///
/// What is estimated from the residuals of the steps, by a Kalman filter (Kalman 1960): the offset of
/// the travel, its scale, and the parts by which the tread creeps and winds up more than by its
/// model. In units of a step's tolerance, over that of 64 mm, and over that of 1 mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Odometry {
    offset: Travel,
    /// Part by which the axle goes farther than the tread on its radius as known.
    scale: Ratio,
    /// Position from which the travel counts, mm.
    origin: Millimetres,
    /// Parts by which the tread creeps and winds up more than by its model.
    more: [Ratio; 2],
    /// By how much it did so since the origin, by the model, mm.
    gave: [Millimetres; 2],
    /// Covariance of place, scale, creep and winding up.
    covariance: [[Ratio; STATES]; STATES],
    /// By how much all edges may seem off together, mm, and the part of that in the position.
    edges: Millimetres,
    by_edges: Ratio,
    /// Part by which the tread carries more or less than by its model.
    unlike: Ratio,
    /// Parts of the last residual that the position took over, and each of them.
    share: Ratio,
    gains: [Ratio; STATES],
    /// How the states shifted the position where a step last corrected it.
    mark: [Ratio; STATES],
    from: Option<Start>,
}

/// Place, scale, creep and winding up.
const STATES: usize = 4;

impl Default for Odometry {
    fn default() -> Self {
        let zero = Ratio::ZERO;
        Self {
            offset: Travel::ZERO,
            scale: Ratio::ZERO,
            origin: Millimetres::ZERO,
            more: [Ratio::ZERO; 2],
            gave: [Millimetres::ZERO; 2],
            covariance: [
                [KNOWN, zero, zero, zero],
                [zero, UNKNOWN_RADIUS, zero, zero],
                [zero, zero, UNKNOWN_CREEP, UNKNOWN_WINDING],
                [zero, zero, UNKNOWN_WINDING, UNKNOWN_WINDING],
            ],
            edges: UNREAD,
            by_edges: Ratio::ZERO,
            unlike: Ratio::ZERO,
            share: Ratio::ZERO,
            gains: [Ratio::ZERO; STATES],
            mark: [Ratio::ONE, Ratio::ZERO, Ratio::ZERO, Ratio::ZERO],
            from: None,
        }
    }
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

fn sum(parts: &[Ratio; STATES], weights: &[Ratio; STATES]) -> Ratio {
    parts.iter().zip(weights).fold(Q16::ZERO, |sum, (part, weight)| sum + *part * *weight)
}

impl Odometry {
    /// Position by this travel, mm from the stow end.
    pub fn position(&self, travel: Travel) -> Millimetres {
        Q16::narrow(travel.saturating_add(self.offset))
    }

    /// Declares that the wheel is at `position`.
    pub fn set(&mut self, travel: Travel, position: Millimetres) {
        let offset = position.widen().saturating_sub(travel);
        self.restart(Self { offset, origin: position, ..Self::default() });
    }

    /// Starts again like this, with what is known of tread and sensor.
    fn restart(&mut self, fresh: Self) {
        let unlike = self.unlike;
        *self = Self { edges: self.edges, unlike: Ratio::ZERO, ..fresh };
        self.doubt_tread(unlike);
    }

    /// The tread carries so much more or less than by its model, part of it: as much it may give way
    /// otherwise, too.
    pub(super) fn doubt_tread(&mut self, unlike: Ratio) {
        let (before, now) = (self.unlike, between(unlike, self.unlike, Ratio::ONE));
        self.unlike = now;
        let more = now * now - before * before;
        for row in &mut self.covariance[2..] {
            row[2..].iter_mut().for_each(|part| *part += more * PER_PLACE * PER_PLACE);
        }
    }

    /// Declares that the wheel is at `position`: a step was found there, as sure as its place.
    pub fn set_by_step(&mut self, travel: Travel, position: Millimetres) {
        self.set(travel, position);
        self.covariance[0][0] = Ratio::ONE;
        (self.share, self.by_edges) = (Ratio::ONE, Ratio::ONE);
    }

    /// Begins a run at `position`: what moved the arm since the last one was no rolling. A run back
    /// finds the same steps again, which show no more of the tread.
    pub fn begin_run(&mut self, position: Millimetres, back: bool) {
        self.from = None;
        if !back {
            return;
        }
        let place = self.variance(position).max(KNOWN);
        let Self { offset, by_edges, .. } = *self;
        self.restart(Self { offset, by_edges, origin: position, ..Self::default() });
        self.covariance[0][0] = place;
    }

    /// One sigma of `position`, mm.
    pub fn sigma(&self, position: Millimetres) -> Millimetres {
        let (spread, edges) = (self.spread(position), self.edges * self.by_edges);
        sqrt(spread * spread + edges * edges)
    }

    /// The same against steps whose edges are all the same, mm.
    pub(super) fn spread(&self, position: Millimetres) -> Millimetres {
        sqrt(self.variance(position).max(Q16::ZERO)) * PLACE
    }

    fn variance(&self, position: Millimetres) -> Ratio {
        let weights = self.weights(position);
        self.expect(&weights).1 + self.wander(&self.since(position))
    }

    /// How the states shift the position.
    fn weights(&self, position: Millimetres) -> [Ratio; STATES] {
        let [crept, wound] = self.gave;
        [Ratio::ONE, (position - self.origin) * PER_REACH, crept, wound]
    }

    /// Covariance of the states with their sum by these weights, and its variance.
    fn expect(&self, weights: &[Ratio; STATES]) -> ([Ratio; STATES], Ratio) {
        let with = self.covariance.each_ref().map(|row| sum(row, weights));
        (with, sum(&with, weights))
    }

    /// The gains of a residual with these weights, whose variance is `noise`; it shows what the position
    /// has wandered by, of this variance.
    fn learn(
        &mut self,
        weights: &[Ratio; STATES],
        noise: Ratio,
        wandered: Ratio,
    ) -> [Ratio; STATES] {
        let (mut with, expected) = self.expect(weights);
        with[0] += wandered;
        let gains = with.map(|part| divide(part, noise + expected + wandered));
        for (row, gain) in self.covariance.iter_mut().zip(gains) {
            for (part, other) in row.iter_mut().zip(with) {
                *part -= gain * other;
            }
        }
        gains
    }

    /// Variance of the position by what it has wandered since then.
    fn wander(&self, [.., crept, wound]: &[Ratio; STATES]) -> Ratio {
        let part = self.unlike.max(WANDERS_PART) * PER_PLACE;
        (*crept * *crept + *wound * *wound) * part * part
    }

    /// The tread creeps and winds up by so much, mm; by how much as far as the steps show.
    pub(super) fn give(&mut self, by: [Millimetres; 2]) -> Millimetres {
        self.gave.iter_mut().zip(by).for_each(|(gave, by)| *gave += by);
        by.iter().zip(self.more).fold(Q16::ZERO, |all, (by, more)| all + *by + *by * more)
    }

    /// The wheel has slipped: the axle is `lost` further in than the tread's travel has it, give or
    /// take `sigma`, mm.
    pub fn slip(&mut self, lost: Millimetres, sigma: Millimetres) {
        self.offset = self.offset.saturating_sub(lost.widen());
        let parts = sigma * PER_PLACE;
        self.covariance[0][0] += parts * parts;
    }

    /// Takes over its part of the difference between where a step was found, near `position`, and
    /// where the table has it, mm; what is left of it.
    pub fn correct(&mut self, position: Millimetres, residual: Millimetres) -> Millimetres {
        let wandered = self.wander(&self.since(position));
        self.covariance[0][0] += wandered + WANDERS;
        self.mark = self.weights(position);
        self.gains = self.learn(&self.mark.clone(), FOUND, Q16::ZERO);
        self.share = sum(&self.gains, &self.mark);
        self.by_edges += (Ratio::ONE - self.by_edges) * self.share;
        self.refine(residual)
    }

    /// How the states shifted the position since a step last corrected it.
    pub fn since(&self, position: Millimetres) -> [Ratio; STATES] {
        let weights = self.weights(position);
        core::array::from_fn(|i| weights[i] - self.mark[i])
    }

    /// The edge that last corrected the position seems to have moved outwards by so much, give or take
    /// `sigma`, mm, `since` then: so far the tread gave way by more than its model has it.
    pub fn climb(
        &mut self,
        position: Millimetres,
        since: &[Ratio; STATES],
        moved: Millimetres,
        sigma: Millimetres,
    ) {
        let parts = (sigma + EDGE).min(Millimetres::ONE) * PER_PLACE;
        let wandered = self.wander(since);
        self.covariance[0][0] += wandered;
        self.mark = core::array::from_fn(|i| self.mark[i] + since[i]);
        let gains = self.learn(since, parts * parts, wandered);
        self.take(moved, sum(&gains, &self.weights(position)), gains);
    }

    /// All edges may seem off by so much, mm: a misread compression.
    pub fn misread(&mut self, direction: Direction, by: Millimetres) {
        let rounded = ROUNDED[direction as usize];
        self.edges = sqrt(rounded * rounded + by * by);
    }

    /// The step found last lies `shift` further out than its residual had it, mm; what is left of
    /// that.
    pub fn refine(&mut self, shift: Millimetres) -> Millimetres {
        self.take(shift, self.share, self.gains)
    }

    /// The step found last may lie elsewhere by `sigma`, mm.
    pub fn doubt(&mut self, sigma: Millimetres) {
        self.slip(Q16::ZERO, sigma * self.share);
    }

    fn take(&mut self, shift: Millimetres, share: Ratio, gains: [Ratio; STATES]) -> Millimetres {
        let taken = shift * share;
        self.offset = self.offset.saturating_sub(taken.widen());
        let [_, scale, more @ ..] = gains;
        let scale = self.scale - shift * scale * PER_REACH;
        self.scale = scale.clamp(-MOST_SCALE, MOST_SCALE);
        for (part, gain) in self.more.iter_mut().zip(more) {
            *part = (*part + shift * gain).clamp(-MOST_MORE, MOST_MORE);
        }
        shift - taken
    }

    /// Converts what the tread has travelled to axial travel once it makes a chord, or `now`.
    ///
    /// The wheel rolls by `ds = (1 - lag + scale) ds_0` where its tread turns by ds_0; with the rise
    /// dy of the centre the axle advances by dx, `dx^2 + dy^2 = ds^2` (first order in the
    /// compression).
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
        let rolled = tread - tread * (rolling.lag - self.scale);
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
        odometry.begin_run(Q16::ZERO, false);
        odometry.roll(Travel::ZERO, &at(121), false);
        odometry.roll(Travel::from_num(5), &at(121), true);
        assert_eq!(odometry.position(Travel::from_num(5)), Q16::from_num(5));
    }

    /// What is left of the last of these residuals, each with its weights, by Gaussian regression:
    /// with their covariance S and their noise V in it, that of the last is in `V S^-1 y`.
    fn least_squares(place: f64, found: &[([f64; STATES], f64)]) -> f64 {
        let prior = Odometry::default().covariance.map(|row| row.map(Q16::to_num::<f64>));
        let covariance = |i: usize, j: usize| {
            let wanders: f64 = (0..=i.min(j))
                .map(|k| {
                    let before = k.checked_sub(1).map_or([0.0; STATES], |k| found[k].0);
                    let gave = [2, 3].map(|n| found[k].0[n] - before[n]);
                    let part = (WANDERS_PART * PER_PLACE).to_num::<f64>();
                    WANDERS.to_num::<f64>() + part * part * (gave[0].powi(2) + gave[1].powi(2))
                })
                .sum();
            let mut sum = place - prior[0][0] + wanders;
            for (a, row) in found[i].0.iter().zip(prior) {
                sum += found[j].0.iter().zip(row).map(|(b, part)| a * b * part).sum::<f64>();
            }
            sum + f64::from(u8::from(i == j)) * FOUND.to_num::<f64>()
        };
        // Gaussian elimination: the last of its unknowns is all that counts.
        let count = found.len();
        let mut rows: Vec<Vec<f64>> = (0..count)
            .map(|i| (0..count).map(|j| covariance(i, j)).chain([found[i].1]).collect())
            .collect();
        for i in 0..count {
            let pivot = rows[i].clone();
            for row in &mut rows[i + 1..] {
                let part = row[i] / pivot[i];
                row.iter_mut().zip(&pivot).for_each(|(a, b)| *a -= part * b);
            }
        }
        FOUND.to_num::<f64>() * rows[count - 1][count] / rows[count - 1][count - 1]
    }

    proptest! {
        #[test]
        fn steps_give_position_radius_and_compliance_by_least_squares(
            back in any::<bool>(),
            by_step in any::<bool>(),
            places in proptest::collection::vec(-0.3..0.3f64, 1..8),
            gives in proptest::collection::vec([0.0..0.3f64, -0.2..0.7f64], 8),
            stretch in -0.003..0.003f64,
            more in [-0.4..0.4f64, -0.4..0.4f64],
            shift in -0.1..0.1f64,
        ) {
            let sign = if back { -1.0 } else { 1.0 };
            let (mut odometry, mut turned) = (Odometry::default(), Travel::ZERO);
            let (mut gave, mut modelled) = (Travel::ZERO, [0.0; 2]);
            if by_step {
                odometry.set_by_step(turned, Q16::from_num(50));
            } else {
                odometry.set(turned, Q16::from_num(50));
            }
            let place = odometry.covariance[0][0].to_num::<f64>();
            let rolling = Rolling { radius: Q16::ZERO, lag: Q16::ZERO, on_corner: false };
            odometry.roll(turned, &rolling, true);
            // Every 20 mm of the tread a step; the table has it off by its place, and by how much
            // farther the tread runs and gives way.
            let mut found = Vec::new();
            for (off, gives) in places.into_iter().zip(gives) {
                for _ in 0..20 {
                    turned += Travel::from_num(sign);
                    gave += odometry.give(gives.map(|by| Q16::from_num(by / 20.0))).widen();
                    odometry.roll(turned - gave, &rolling, true);
                }
                modelled = [0, 1].map(|i| modelled[i] + gives[i]);
                let rolled = turned.to_num::<f64>() - modelled[0] - modelled[1];
                let extra = rolled * stretch + more[0] * modelled[0] + more[1] * modelled[1] + off;
                found.push(([1.0, rolled / 64.0, modelled[0], modelled[1]], extra));
                let position = odometry.position(turned - gave);
                let at_table = 50.0 + rolled - extra;
                let residual = position - Q16::from_num(at_table);
                // Found a little off at first.
                let shift = Q16::from_num(shift);
                let left = odometry.correct(position, residual - shift) + odometry.refine(shift);
                let got = odometry.position(turned - gave);
                prop_assert!((got - position + residual - left).abs() < q16(1_000));
                let (got, exact) = (got.to_num::<f64>(), at_table + least_squares(place, &found));
                prop_assert!((got - exact).abs() < 0.01, "{got} {exact}");
            }
        }
    }

    #[test]
    fn an_edge_under_a_climbing_wheel_shows_creep() {
        for part in [-0.3, 0.3] {
            let mut odometry = Odometry::default();
            odometry.set(Travel::ZERO, Q16::from_num(50));
            odometry.correct(Q16::from_num(50), Q16::ZERO);
            odometry.give([q16(2_000_000), Q16::ZERO]);
            // The axle lags by more than the model has it: the edge seems to move outwards.
            let position = odometry.position(Travel::ZERO);
            let since = odometry.since(position);
            odometry.climb(position, &since, Q16::from_num(2.0 * part), Q16::ZERO);
            let (taken, more) = (position - odometry.position(Travel::ZERO), odometry.more[0]);
            let (taken, more) = (taken.to_num::<f64>() / (2.0 * part), more.to_num::<f64>() / part);
            assert!((0.5..1.0).contains(&taken) && (0.5..1.0).contains(&more), "{taken} {more}");
        }
    }

    #[test]
    fn the_same_steps_found_again_and_again_leave_the_radius_alone() {
        let mut odometry = Odometry::default();
        odometry.set(Travel::ZERO, Q16::ZERO);
        let mut least = Q16::MAX;
        for run in 0..500 {
            odometry.begin_run(Q16::from_num(if run % 2 == 0 { 0 } else { 80 }), true);
            assert_eq!(odometry.scale, Q16::ZERO);
            for (at, off) in [(18, 0.2), (40, -0.3), (62, 0.1)] {
                let (at, off) = (Q16::from_num(at), Q16::from_num(off));
                odometry.correct(at, odometry.position(at.widen()) - at - off);
            }
            least = least.min(odometry.covariance[0][0]);
        }
        // Never so sure that a step no longer counts, nor off by more than the steps are.
        let off: f64 = odometry.offset.to_num();
        assert!(off.abs() < 0.3 && least > q16(10_000), "{off} {least}");
    }
}
