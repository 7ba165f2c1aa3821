//! Tests of the odometry and its filter.

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
    let at =
        |radius: i32| Rolling { radius: Q16::from_num(radius), lag: Q16::ZERO, on_corner: true };
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
    // The last is beyond two sigmas of both: so far has the position wandered.
    for (part, sigma, least) in [(-0.3, 0, 0.5), (0.3, 0, 0.5), (1.5, 900_000, 0.05)] {
        let mut odometry = Odometry::default();
        odometry.set(Travel::ZERO, Q16::from_num(50));
        odometry.correct(Q16::from_num(50), Q16::ZERO);
        odometry.give([q16(2_000_000), Q16::ZERO]);
        // The axle lags by more than the model has it: the edge seems to move outwards.
        let position = odometry.position(Travel::ZERO);
        let since = odometry.since(position);
        odometry.climb(position, &since, Q16::from_num(2.0 * part), q16(sigma));
        let (taken, more) = (position - odometry.position(Travel::ZERO), odometry.more[0]);
        let (taken, more) = (taken.to_num::<f64>() / (2.0 * part), more.to_num::<f64>() / part);
        assert!((0.5..1.0).contains(&taken) && (least..1.0).contains(&more), "{taken} {more}");
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

/// Of 1 mm of creep.
#[test]
fn a_tread_unlike_its_model_makes_the_place_less_sure() {
    for (unlike, sigma) in [(0, 0.247), (300_000, 0.503)] {
        let mut odometry = Odometry::default();
        odometry.doubt_tread(q16(unlike));
        odometry.set(Travel::ZERO, Q16::ZERO);
        odometry.give([Q16::ONE, Q16::ZERO]);
        let got = odometry.sigma(Q16::ZERO).to_num::<f64>();
        assert!((got - sigma).abs() < 0.005, "{unlike}: {got}");
    }
}

#[test]
fn readings_that_scatter_more_than_their_sigmas_make_the_place_less_sure() {
    let sigma = |off: i64| {
        let (mut odometry, at) = (Odometry::default(), Q16::ZERO);
        odometry.set(Travel::ZERO, at);
        for (step, climb) in [(1, -1), (-1, 1)] {
            odometry.correct(at, q16(step * off));
            odometry.give([Q16::ONE, Q16::ZERO]);
            let since = odometry.since(at);
            odometry.climb(at, &since, q16(climb * off), Q16::ZERO);
        }
        odometry.sigma(at).to_num::<f64>()
    };
    let [none, some, more] = [0, 150_000, 600_000].map(sigma);
    assert!(none == some && (1.5..4.0).contains(&(more / none)), "{none} {some} {more}");
}
