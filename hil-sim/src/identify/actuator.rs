//! The fit of the pre-tightener: its duty through dead time, lag and slew, and the spring
//! that the rising wheel compresses, against the preload sensor.
//!
//! `P(t) = seat + slew int lag(duty(t - delay)) dt + spring (height(t) - R)`, as the screw
//! locks itself while its bridge is off. Of a duty it gets what friction leaves of it. The height of the centre comes from the fit of
//! the contact.

use std::ops::Range;

use nalgebra::DMatrix;

use super::IdentifyError;
use super::forward::{Run, Trajectory};
use super::least_squares::Noise;
use super::least_squares::{Model, SETTLED, covariance, minimise};
use super::record::{Record, Sample};
use crate::scenario::TICK_S;

/// Dead time, ms.
pub(crate) const DELAY: usize = 0;
/// Logarithm of the lag, s.
pub(crate) const LAG: usize = 1;
/// Slew, N/s by the preload sensor.
pub(crate) const SLEW: usize = 2;
/// Spring rate, N/mm by the preload sensor.
pub(crate) const SPRING: usize = 3;
/// Part of full duty that friction takes, and each pulse of the bridge that is cut short.
pub(crate) const LOST: usize = 4;
/// First of the seats, N, one a log.
const SEATS: usize = 5;

/// Longest dead time, ms.
const LONGEST_MS: f64 = 250.0;
/// Changes for the differences: ms, relative, and of the part that is lost.
const MOVED_MS: f64 = 0.5;
const MOVED_LAG: f64 = 0.01;
const MOVED_LOST: f64 = 1e-3;
/// Deviation of the first fit, N, and the least of the second.
const FIRST_N: f64 = 0.1;
const LEAST_N: f64 = 1e-4;
/// What the model is off by, one sigma, ms and logarithm: the root mean square error on 76 hidden
/// rigs on the emulated board, of the last range of [`super::CALIBRATION`]. By scatter alone two of
/// 20 others had 0.6 and 0.8 % for a lag that was 2.3 and 3 % off.
const OFF: [(usize, f64); 2] = [(DELAY, 0.6), (LAG, 0.011)];

/// The result.
#[derive(Clone, Debug)]
pub(crate) struct Actuator {
    /// Coordinates.
    pub x: Vec<f64>,
    pub covariance: DMatrix<f64>,
    pub residuals: Vec<Vec<f64>>,
    /// Their times, s.
    pub times: Vec<Vec<f64>>,
}

struct Log<'a> {
    samples: &'a [Sample],
    /// Ticks of the bins and the mean preload that the sensor showed in them, N.
    bins: Vec<(Range<usize>, f64)>,
    /// Rise of the centre above the undeformed wheel on the outermost wall, mm, in them.
    rise_mm: Vec<f64>,
    /// Age of a reading, ticks.
    delay: f64,
    /// One over the deviation, 1/N.
    weight: f64,
}

/// Force of the screw's position for a slew of 1 N/s, every tick and one more.
fn seat(samples: &[Sample], delay: usize, lag_s: f64, lost: f64) -> Vec<f64> {
    let keep = (-TICK_S / lag_s).exp();
    let (mut rate, mut seat) = (0.0, 0.0);
    let left = |duty: f64| ((duty.abs() - lost).max(0.0) / (1.0 - lost)).copysign(duty);
    let is_driven = |s: &Sample| s.pretightener_on && s.pretightener != 0.0;
    let duty = |s: &Sample| if is_driven(s) { left(s.pretightener) } else { 0.0 };
    let mut out = Vec::with_capacity(samples.len() + 1);
    out.push(0.0);
    for (n, sample) in samples.iter().enumerate() {
        if sample.pretightener_on {
            let target = n.checked_sub(delay).map_or(0.0, |then| duty(&samples[then]));
            seat += target * TICK_S + (rate - target) * lag_s * (1.0 - keep);
            rate = target + (rate - target) * keep;
        } else {
            rate = 0.0;
        }
        out.push(seat);
    }
    out
}

impl<'a> Log<'a> {
    fn of(record: &'a Record, run: &Run, at: &Trajectory, radius_mm: f64) -> Self {
        let delay = record.scenario.noise.preload_sensor_delay_s / TICK_S;
        let used = run.traces.bins.iter().filter(|bin| bin.pressed);
        let bins: Vec<_> = used.map(|bin| (bin.ticks.clone(), bin.preload_n)).collect();
        let middle = |ticks: &Range<usize>| 0.5 * (ticks.start + ticks.end - 1) as f64 - delay;
        let rise = |(ticks, _): &(Range<usize>, f64)| at.height_mm(middle(ticks)) - radius_mm;
        let rise_mm = bins.iter().map(rise).collect();
        Self { samples: &record.samples, bins, rise_mm, delay, weight: 1.0 / FIRST_N }
    }

    /// The seat for a slew of 1 N/s in the bins, interpolated between two dead times of integer ticks.
    fn seats(&self, delay_ms: f64, lag_s: f64, lost: f64) -> Vec<f64> {
        let ticks = delay_ms.floor();
        let [early, late] =
            [0, 1].map(|more| seat(self.samples, ticks as usize + more, lag_s, lost));
        let part = delay_ms - ticks;
        let mixed: Vec<f64> = early.iter().zip(&late).map(|(a, b)| a + part * (b - a)).collect();
        let mean = |(ticks, _): &(Range<usize>, f64)| {
            let of = |tick: usize| super::traces::at(&mixed, tick as f64 - self.delay);
            ticks.clone().map(of).sum::<f64>() / ticks.len() as f64
        };
        self.bins.iter().map(mean).collect()
    }

    /// Predicted less measured preload in the bins, N.
    fn remaining(&self, x: &[f64], seat_n: f64, seats: &[f64]) -> Vec<f64> {
        let predicted = seats.iter().zip(&self.rise_mm);
        let predicted = predicted.map(|(seat, rise)| seat_n + x[SLEW] * seat + x[SPRING] * rise);
        predicted.zip(&self.bins).map(|(predicted, (_, measured))| predicted - measured).collect()
    }
}

struct Screw<'a>(Vec<Log<'a>>);

impl Screw<'_> {
    /// Predicted less measured preload, N, by log.
    fn remaining(&self, x: &[f64], at: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let logs = self.0.iter().zip(at).zip(&x[SEATS..]);
        logs.map(|((log, seats), seat_n)| log.remaining(x, *seat_n, seats)).collect()
    }
}

impl Model for Screw<'_> {
    /// Seats for a slew of 1 N/s, by log.
    type At = Vec<Vec<f64>>;

    fn at(&self, x: &[f64]) -> Option<Self::At> {
        let within = (0.0..LONGEST_MS).contains(&x[DELAY]) && x[LAG].abs() < 9.0;
        let within = within && x[LOST].abs() < 0.5;
        let seats = |log: &Log<'_>| log.seats(x[DELAY], x[LAG].exp(), x[LOST]);
        within.then(|| self.0.iter().map(seats).collect())
    }

    fn residuals(&self, x: &[f64], at: &Self::At) -> Vec<f64> {
        let logs = self.0.iter().zip(self.remaining(x, at));
        logs.flat_map(|(log, left)| left.into_iter().map(|left| log.weight * left)).collect()
    }

    fn jacobian(&self, x: &[f64], at: &Self::At) -> Option<Vec<Vec<f64>>> {
        let mut columns = vec![Vec::new(); x.len()];
        for (index, log) in self.0.iter().enumerate() {
            let between = |a: Vec<f64>, b: Vec<f64>, over: f64| -> Vec<f64> {
                a.iter().zip(&b).map(|(a, b)| log.weight * x[SLEW] * (a - b) / over).collect()
            };
            let (delay, lag, lost) = (x[DELAY], x[LAG].exp(), x[LOST]);
            let least = (delay - MOVED_MS).max(0.0);
            let (later, sooner) =
                (log.seats(delay + MOVED_MS, lag, lost), log.seats(least, lag, lost));
            columns[DELAY].extend(between(later, sooner, delay + MOVED_MS - least));
            let (up, down) = (lag * MOVED_LAG.exp(), lag * (-MOVED_LAG).exp());
            let (slower, faster) = (log.seats(delay, up, lost), log.seats(delay, down, lost));
            columns[LAG].extend(between(slower, faster, 2.0 * MOVED_LAG));
            let [more, less] = [1.0, -1.0].map(|by| log.seats(delay, lag, lost + by * MOVED_LOST));
            columns[LOST].extend(between(more, less, 2.0 * MOVED_LOST));
            columns[SLEW].extend(at[index].iter().map(|seat| log.weight * seat));
            columns[SPRING].extend(log.rise_mm.iter().map(|rise| log.weight * rise));
            for other in 0..self.0.len() {
                let one = if other == index { log.weight } else { 0.0 };
                columns[SEATS + other].extend(log.bins.iter().map(|_| one));
            }
        }
        Some(columns)
    }
}

/// Fits the pre-tightener to records whose contact is known, then once more with the noise
/// that this leaves.
pub(crate) fn fit(
    records: &[Record],
    runs: &[Run],
    trajectories: &[Trajectory],
    radius_mm: f64,
) -> Result<Actuator, IdentifyError> {
    let no_logs = || IdentifyError::NoFit("there are no logs".into());
    let preload = &records.first().ok_or_else(no_logs)?.scenario.rig.preload;
    let of = |((record, run), at): ((_, &Run), _)| Log::of(record, run, at, radius_mm);
    let mut model = Screw(records.iter().zip(runs).zip(trajectories).map(of).collect());
    let mut start = vec![
        preload.delay_s / TICK_S,
        preload.lag_s.ln(),
        preload.slew_n_per_s,
        preload.spring_n_per_mm,
        0.0,
    ];
    // Where the screw is before it first moves.
    start.extend(runs.iter().map(|run| run.traces.preload_n[run.traces.span.start]));
    let first = minimise(&model, &start, SETTLED)?;
    let residuals = model.remaining(&first.x, &first.at);
    for (log, residuals) in model.0.iter_mut().zip(&residuals) {
        log.weight = 1.0 / Noise::of(residuals).effective().max(LEAST_N);
    }
    let fitted = minimise(&model, &first.x, SETTLED)?;
    let mut covariance = covariance(&fitted.jacobian)?;
    for (index, off) in OFF {
        covariance[(index, index)] += off * off;
    }
    let mid = |(ticks, _): &(Range<usize>, f64)| TICK_S * (0.5 * (ticks.start + ticks.end) as f64);
    Ok(Actuator {
        covariance,
        residuals: model.remaining(&fitted.x, &fitted.at),
        times: model.0.iter().map(|log| log.bins.iter().map(mid).collect()).collect(),
        x: fitted.x,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::actuators::Pretightener;
    use proptest::prelude::*;

    proptest! {
        /// The screw of the plant, duty by duty, whatever its constants.
        #[test]
        fn the_seat_is_the_plants(
            delay in 0usize..150, lag in 0.01f64..0.2, slew in 5.0f64..80.0, at in 100usize..400,
            lost in 0.0f64..0.3,
        ) {
            let sample = |n: usize| Sample {
                pretightener: if n < at { 0.8 } else { -0.5 },
                pretightener_on: !(200..260).contains(&n),
                ..Sample::default()
            };
            let samples: Vec<Sample> = (0..600).map(sample).collect();
            let range = (-1e6, 1e6);
            let mut screw =
                Pretightener::new(slew, lag, delay as f64 * TICK_S, TICK_S, 0.0, range)
                    .with_losses(0.0, lost, 1.0);
            let seats = seat(&samples, delay, lag, lost);
            for (n, sample) in samples.iter().enumerate() {
                prop_assert!((slew * seats[n] - screw.seat_n()).abs() < 1e-9, "{n}");
                screw.step(sample.pretightener, sample.pretightener_on, 0.0, TICK_S);
            }
        }
    }
}
