//! The fit of the pre-tightener: its duty through dead time, lag and slew, and the spring
//! that the wheel's rise compresses, against the load cell.
//!
//! `P(t) = seat + slew int lag(duty(t - delay)) dt + spring (height(t) - R)`, as the screw
//! locks itself while its bridge is off. The height of the centre comes from the fit of
//! the contact.

use nalgebra_lm::DMatrix;

use super::IdentifyError;
use super::forward::{Course, Run};
use super::least_squares::{Model, covariance, minimise};
use super::noise::Noise;
use super::record::{Record, Sample, TICK_S};

/// Dead time, ms.
pub const DELAY: usize = 0;
/// Logarithm of the lag, s.
pub const LAG: usize = 1;
/// Slew, N/s by the load cell.
pub const SLEW: usize = 2;
/// Spring rate, N/mm by the load cell.
pub const SPRING: usize = 3;
/// First of the seats, N, one a log.
const SEATS: usize = 4;

/// Longest dead time, ms.
const LONGEST_MS: f64 = 250.0;
/// Changes for the differences: ms, and relative.
const MOVED_MS: f64 = 0.5;
const MOVED_LAG: f64 = 0.01;
/// Deviation that the first fit assumes, N.
const FIRST_N: f64 = 0.1;

/// The result.
#[derive(Clone, Debug)]
pub struct Actuator {
    /// Coordinates.
    pub x: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// What is left, N, by log.
    pub residuals: Vec<Vec<f64>>,
    /// Times of it, s.
    pub times: Vec<Vec<f64>>,
    /// Its noise, by log.
    pub noise: Vec<Noise>,
}

/// One log.
struct Log<'a> {
    samples: &'a [Sample],
    /// Ticks of the bins and what the load cell said in them, N.
    bins: Vec<(std::ops::Range<usize>, f64)>,
    /// Rise of the centre above the undeformed wheel on the outermost wall, mm, in them.
    rise_mm: Vec<f64>,
    /// Age of a reading, ticks.
    delay: f64,
}

struct Screw<'a> {
    logs: Vec<Log<'a>>,
    weights: Vec<f64>,
}

/// Force of the screw's position for a slew of 1 N/s, every tick and one more.
fn seat(samples: &[Sample], delay: usize, lag_s: f64) -> Vec<f64> {
    let keep = (-TICK_S / lag_s).exp();
    let (mut rate, mut seat) = (0.0, 0.0);
    let duty = |s: &Sample| if s.pretightener_on { s.pretightener } else { 0.0 };
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

impl Log<'_> {
    /// The seat for a slew of 1 N/s, in the bins; between two whole dead times it is mixed.
    fn way(&self, delay_ms: f64, lag_s: f64) -> Vec<f64> {
        let whole = delay_ms.floor();
        let [early, late] = [0, 1].map(|more| seat(self.samples, whole as usize + more, lag_s));
        let part = delay_ms - whole;
        let mixed: Vec<f64> = early.iter().zip(&late).map(|(a, b)| a + part * (b - a)).collect();
        let mean = |ticks: &std::ops::Range<usize>| {
            let of = |tick: usize| super::traces::at(&mixed, tick as f64 - self.delay);
            ticks.clone().map(of).sum::<f64>() / ticks.len() as f64
        };
        self.bins.iter().map(|(ticks, _)| mean(ticks)).collect()
    }
}

impl Model for Screw<'_> {
    /// Ways of the screw, by log.
    type At = Vec<Vec<f64>>;

    fn at(&self, x: &[f64]) -> Option<Self::At> {
        let within = (0.0..LONGEST_MS).contains(&x[DELAY]) && x[LAG].abs() < 9.0;
        within.then(|| self.logs.iter().map(|log| log.way(x[DELAY], x[LAG].exp())).collect())
    }

    fn residuals(&self, x: &[f64], at: &Self::At) -> Vec<f64> {
        let of = |index: usize| {
            let (log, weight) = (&self.logs[index], self.weights[index]);
            let force = move |(way, rise): (&f64, &f64)| {
                x[SEATS + index] + x[SLEW] * way + x[SPRING] * rise
            };
            let said = at[index].iter().zip(&log.rise_mm).map(force);
            said.zip(&log.bins).map(move |(said, (_, heard))| weight * (said - heard))
        };
        (0..self.logs.len()).flat_map(of).collect()
    }

    fn jacobian(&self, x: &[f64], at: &Self::At) -> Option<Vec<Vec<f64>>> {
        let mut columns = vec![Vec::new(); x.len()];
        for (index, log) in self.logs.iter().enumerate() {
            let weight = self.weights[index];
            let between = |a: Vec<f64>, b: Vec<f64>, over: f64| -> Vec<f64> {
                a.iter().zip(&b).map(|(a, b)| weight * x[SLEW] * (a - b) / over).collect()
            };
            let (delay, lag) = (x[DELAY], x[LAG].exp());
            let least = (delay - MOVED_MS).max(0.0);
            let (later, sooner) = (log.way(delay + MOVED_MS, lag), log.way(least, lag));
            columns[DELAY].extend(between(later, sooner, delay + MOVED_MS - least));
            let (up, down) = (lag * MOVED_LAG.exp(), lag * (-MOVED_LAG).exp());
            let (slower, faster) = (log.way(delay, up), log.way(delay, down));
            columns[LAG].extend(between(slower, faster, 2.0 * MOVED_LAG));
            columns[SLEW].extend(at[index].iter().map(|way| weight * way));
            columns[SPRING].extend(log.rise_mm.iter().map(|rise| weight * rise));
            for other in 0..self.logs.len() {
                let one = if other == index { weight } else { 0.0 };
                columns[SEATS + other].extend(log.bins.iter().map(|_| one));
            }
        }
        Some(columns)
    }
}

/// Fits the pre-tightener to records whose contact is known.
///
/// # Errors
/// [`IdentifyError::NoFit`] if it does not settle.
pub fn fit(
    records: &[Record],
    runs: &[Run],
    courses: &[Course],
    radius_mm: f64,
) -> Result<Actuator, IdentifyError> {
    let logs: Vec<Log<'_>> = records
        .iter()
        .zip(runs.iter().zip(courses))
        .map(|(record, (run, course))| {
            let used = run.traces.bins.iter().filter(|bin| bin.pressed);
            let delay = record.scenario.noise.load_cell_delay_s / TICK_S;
            let middle =
                |ticks: &std::ops::Range<usize>| 0.5 * (ticks.start + ticks.end - 1) as f64 - delay;
            Log {
                samples: &record.samples,
                rise_mm: used
                    .clone()
                    .map(|bin| course.height_mm(middle(&bin.ticks)) - radius_mm)
                    .collect(),
                bins: used.map(|bin| (bin.ticks.clone(), bin.preload_n)).collect(),
                delay,
            }
        })
        .collect();
    let times = logs
        .iter()
        .map(|log| {
            let mid = |ticks: &std::ops::Range<usize>| 0.5 * (ticks.start + ticks.end) as f64;
            log.bins.iter().map(|(ticks, _)| TICK_S * mid(ticks)).collect()
        })
        .collect();
    let preload = &records.first().ok_or_else(no_logs)?.scenario.rig.preload;
    let mut start = vec![
        preload.delay_s / TICK_S,
        preload.lag_s.ln(),
        preload.slew_n_per_s,
        preload.spring_n_per_mm,
    ];
    // Where the screw stands before it first moves.
    start.extend(runs.iter().map(|run| run.traces.preload_n[run.traces.span.start]));
    let counts: Vec<usize> = logs.iter().map(|log| log.bins.len()).collect();
    let mut model = Screw { weights: vec![1.0 / FIRST_N; logs.len()], logs };
    let first = minimise(&model, &start)?;
    let noise = noise_of(first.residuals.as_slice(), &counts, &model.weights);
    model.weights = noise.iter().map(|noise| 1.0 / noise.effective().max(1e-4)).collect();
    let fitted = minimise(&model, &first.x)?;
    let residuals = split(fitted.residuals.as_slice(), &counts, &model.weights);
    Ok(Actuator {
        covariance: covariance(&fitted.jacobian)?,
        noise: residuals.iter().map(|of| Noise::of(of)).collect(),
        x: fitted.x,
        residuals,
        times,
    })
}

fn no_logs() -> IdentifyError {
    IdentifyError::NoFit { why: "there are no logs".into() }
}

/// Residuals by log, their weights taken off.
fn split(residuals: &[f64], counts: &[usize], weights: &[f64]) -> Vec<Vec<f64>> {
    let mut rest = residuals;
    counts
        .iter()
        .zip(weights)
        .map(|(&count, weight)| {
            let (these, others) = rest.split_at(count);
            rest = others;
            these.iter().map(|r| r / weight).collect()
        })
        .collect()
}

fn noise_of(residuals: &[f64], counts: &[usize], weights: &[f64]) -> Vec<Noise> {
    split(residuals, counts, weights).iter().map(|of| Noise::of(of)).collect()
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
        ) {
            let sample = |n: usize| Sample {
                pretightener: if n < at { 0.8 } else { -0.5 },
                pretightener_on: !(200..260).contains(&n),
                ..Sample::default()
            };
            let samples: Vec<Sample> = (0..600).map(sample).collect();
            let range = (-1e6, 1e6);
            let mut screw =
                Pretightener::new(slew, lag, delay as f64 * TICK_S, TICK_S, 0.0, range);
            let way = seat(&samples, delay, lag);
            for (n, sample) in samples.iter().enumerate() {
                prop_assert!((slew * way[n] - screw.seat_n()).abs() < 1e-9, "{n}");
                screw.step(sample.pretightener, sample.pretightener_on, TICK_S);
            }
        }
    }

    #[test]
    fn residuals_are_split_by_log_without_their_weights() {
        let split = split(&[2.0, 4.0, 9.0], &[2, 1], &[2.0, 3.0]);
        assert_eq!(split, [vec![1.0, 2.0], vec![3.0]]);
    }
}
