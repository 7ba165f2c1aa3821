//! The forward model: the plant's ring follows a log's wheel rotation and preload. It
//! gives the compression, the height of the centre and the load on the drive that such a tread
//! would have shown.
//!
//! Motor and pre-tightener are no part of it, so their errors do not accumulate over the
//! travel. Derivatives are central differences of simulations.

use std::ops::Range;

use rayon::prelude::*;

use super::coordinates::{
    ARM_ZERO, Coordinates, DRIVE, FRICTION, GEARBOX, LOAD_GAIN, Moves, NO_LOAD, RADIUS, ROWS,
    TREAD_GAIN,
};
use super::record::Record;
use super::traces::{Bin, Effort, Traces, at};
use crate::plant::draw::PlantParameters;
use crate::plant::rig::{PlantError, VirtualRig};
use crate::scenario::TICK_S;

/// Step of the forward model, ticks.
const STEP: usize = 2;

/// Series of a [`Trajectory`]: compression, mm, height of the centre, mm, load on the drive, N.
const COMPRESSION: usize = 0;
const HEIGHT: usize = 1;
const DRIVE_LOAD: usize = 2;

/// What the forward model gives, every few ticks, or a change of it.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    first: usize,
    series: [Vec<f64>; 3],
    /// Largest friction utilisation.
    pub most_utilisation: f64,
    /// Number of each step crossed, from 1, and its gap, mm.
    pub gaps_mm: Vec<(usize, f64)>,
}

/// A record with what the forward model needs of it.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Where it begins, mm.
    start_mm: f64,
    /// Coordinate of how far that is off, if it begins as an earlier run has ended: pressed, and
    /// without a latch that carries the load.
    start: Option<usize>,
    arm_delay: f64,
    compression_delay: f64,
    nominal: PlantParameters,
    /// The record's traces.
    pub traces: Traces,
    pub name: String,
}

/// What is compared, one value a used bin: compression, mm, arm angle, mrad, and drive
/// effort, N.
pub(crate) type Channels = [Vec<f64>; 3];

/// Names of the channels, with their units.
pub(crate) const CHANNELS: [(&str, &str); 3] =
    [("compression", "mm"), ("arm angle", "mrad"), ("drive effort", "N")];

/// `of` of each pair of values.
fn combined(a: &Channels, b: &Channels, of: impl Fn(f64, f64) -> f64) -> Channels {
    std::array::from_fn(|i| a[i].iter().zip(&b[i]).map(|(a, b)| of(*a, *b)).collect())
}

/// Difference of two channels' values, divided by `over`.
pub(super) fn quotient(a: &Channels, b: &Channels, over: f64) -> Channels {
    combined(a, b, |a, b| (a - b) * (1.0 / over))
}

impl Run {
    /// Prepares a record.
    pub(crate) fn of(
        record: &Record,
        coordinates: &mut Coordinates,
    ) -> Result<Self, super::IdentifyError> {
        let traces = Traces::of(record)?;
        Ok(Self {
            start_mm: record.start_mm(),
            start: traces.is_loaded().then(|| coordinates.add_start()),
            arm_delay: record.scenario.noise.arm_angle_delay_s / TICK_S,
            compression_delay: record.scenario.noise.compression_sensor_delay_s / TICK_S,
            nominal: coordinates.nominal().clone(),
            traces,
            name: record.name.clone(),
        })
    }

    /// Simulates the record with the plant of these coordinates.
    pub(crate) fn simulate(&self, of: &Coordinates, x: &[f64]) -> Result<Trajectory, PlantError> {
        let (traces, plant) = (&self.traces, of.plant(x));
        let (first, last) = (traces.span.start, traces.span.end - 1);
        let dt_s = STEP as f64 * TICK_S;
        let radius = plant.ring.radius_mm;
        let gain = x[LOAD_GAIN].exp();
        let preload = |tick: usize| traces.preload_n[tick] / gain;
        let start_mm = self.start_mm + self.start.map_or(0.0, |start| x[start]);
        let mut rig = VirtualRig::new(plant, start_mm, preload(first), dt_s);
        if self.start.is_some() {
            rig = rig.with_speed(0.0);
        }
        let count = (last - first) / STEP + 1;
        let series = [(); 3].map(|()| Vec::with_capacity(count));
        let mut trajectory =
            Trajectory { first, series, most_utilisation: 0.0, gaps_mm: Vec::new() };
        trajectory.note(&rig);
        for to in (first..=last).step_by(STEP).skip(1) {
            let turn = traces.turn_rad[to] - traces.turn_rad[to - STEP];
            rig.follow(radius * turn / dt_s, preload(to), dt_s)?;
            trajectory.note(&rig);
        }
        let crossings = rig.ledger().crossings().iter();
        trajectory.gaps_mm = crossings.map(|crossing| (crossing.index, crossing.gap_mm)).collect();
        Ok(trajectory)
    }

    /// What the sensors would have shown in the used bins.
    pub(crate) fn predicted(&self, of: &Trajectory, x: &[f64]) -> Channels {
        let (plant, radius) = (&self.nominal, x[RADIUS]);
        let compression = |bin: &Bin| {
            of.mean(COMPRESSION, &bin.ticks, self.compression_delay) * x[TREAD_GAIN].exp()
        };
        let arm = |bin: &Bin, _| {
            let height = of.mean(HEIGHT, &bin.ticks, self.arm_delay);
            1e3 * plant.arm.angle(plant.wall_radius_mm - height) + x[ARM_ZERO]
        };
        let effort = |bin: &Effort| {
            let direction = bin.turn_rad_s.signum();
            // The worm gear holds a load along the motion.
            let load = of.mean(DRIVE_LOAD, &bin.ticks, 0.0) * direction;
            let inertia = 1e-3 * plant.drive.mass_kg * bin.gain_rad_s2 * radius;
            let no_load_mm_s = plant.drive.no_load_mm_s * x[NO_LOAD].exp();
            let loss = plant.drive.stall_n * bin.turn_rad_s * radius / no_load_mm_s;
            let force = direction * (load.max(0.0) + x[GEARBOX]) + inertia;
            force / x[DRIVE].exp() + loss
        };
        self.used(compression, arm, effort)
    }

    /// What the sensors did show there.
    pub(crate) fn measured(&self) -> Channels {
        let stall_n = self.nominal.drive.stall_n;
        self.used(|bin| bin.compression_mm, |_, arm| 1e3 * arm, |effort| stall_n * effort.duty)
    }

    /// Times of the values of each channel, s.
    pub(crate) fn times(&self) -> Channels {
        let mid = |ticks: &Range<usize>| 0.5e-3 * (ticks.start + ticks.end) as f64;
        self.used(|bin| mid(&bin.ticks), |bin, _| mid(&bin.ticks), |effort| mid(&effort.ticks))
    }

    /// What these functions give for the used bins, the second for those with an arm angle.
    fn used(
        &self,
        compression: impl Fn(&Bin) -> f64,
        arm: impl Fn(&Bin, f64) -> f64,
        effort: impl Fn(&Effort) -> f64,
    ) -> Channels {
        let bins = self.traces.bins.iter().filter(|bin| bin.used);
        let efforts = self.traces.efforts.iter().filter(|effort| effort.used);
        [
            bins.clone().map(compression).collect(),
            bins.filter_map(|bin| Some(arm(bin, bin.arm_rad?))).collect(),
            efforts.map(effort).collect(),
        ]
    }
}

impl Trajectory {
    fn note(&mut self, rig: &VirtualRig) {
        let truth = rig.truth();
        let now = [truth.depth_mm, truth.height_mm, rig.tread_load_n()];
        self.series.iter_mut().zip(now).for_each(|(series, value)| series.push(value));
        self.most_utilisation = self.most_utilisation.max(truth.utilisation.abs());
    }

    /// Mean of a series over the readings of a bin, each `delay` ticks old.
    fn mean(&self, series: usize, ticks: &Range<usize>, delay: f64) -> f64 {
        let sum: f64 = ticks.clone().map(|tick| self.at(series, tick as f64 - delay)).sum();
        sum / ticks.len() as f64
    }

    fn at(&self, series: usize, tick: f64) -> f64 {
        at(&self.series[series], (tick - self.first as f64) / STEP as f64)
    }

    /// Height of the centre above the outermost wall at a tick, mm.
    pub(crate) fn height_mm(&self, tick: f64) -> f64 {
        self.at(HEIGHT, tick)
    }

    /// Each value replaced by what `of` gives for its series, its index and itself.
    fn map(&self, of: impl Fn(usize, usize, f64) -> f64) -> Self {
        let each =
            |i: usize| self.series[i].iter().enumerate().map(|(k, v)| of(i, k, *v)).collect();
        Self { series: std::array::from_fn(each), gaps_mm: Vec::new(), ..*self }
    }

    /// This with a part of a change added.
    fn plus(&self, change: &Self, part: f64) -> Self {
        self.map(|i, k, value| value + part * change.series[i][k])
    }
}

/// By how much friction is moved at least, logarithm.
const LEAST_MOVED: f64 = 0.01;

/// Trajectories of all runs at these coordinates.
pub(crate) fn simulate(
    runs: &[Run],
    coordinates: &Coordinates,
    x: &[f64],
) -> Result<Vec<Trajectory>, PlantError> {
    runs.par_iter().map(|run| run.simulate(coordinates, x)).collect()
}

/// The coordinates that simulations move, and by how much. `most`: largest friction utilisation.
fn moves(coordinates: &Coordinates, x: &[f64], most: f64) -> Vec<(usize, f64)> {
    // Steps by half an element, so that elements meet the corner alike on either side.
    let by_mm = 0.5 * coordinates.nominal().ring.pitch_mm();
    let places = coordinates.of_steps().map(|index| (index, by_mm));
    // Friction by half of what keeps the wheel from slipping at most.
    let room = 0.5 * (x[FRICTION].exp() / most).ln();
    let moved = ROWS.iter().enumerate().filter_map(|(index, row)| match row.moves {
        Moves::Rig(by) if index == FRICTION => Some((index, by.min(room.max(LEAST_MOVED)))),
        Moves::Rig(by) => Some((index, by)),
        Moves::Sensors | Moves::Forces => None,
    });
    moved.chain(places).collect()
}

/// Derivatives of what a run's sensors would have shown by each coordinate.
pub(crate) fn derivatives(
    run: &Run,
    coordinates: &Coordinates,
    x: &[f64],
    base: &Trajectory,
) -> Result<Vec<Channels>, PlantError> {
    let moves = moves(coordinates, x, base.most_utilisation);
    let difference = |&(index, by): &(usize, f64)| {
        let moved = |by: f64| {
            let mut x = x.to_vec();
            x[index] += by;
            run.simulate(coordinates, &x)
        };
        let (up, down) = (moved(by)?, moved(-by)?);
        let factor = 1.0 / (2.0 * by);
        Ok(up.map(|i, k, value| (value - down.series[i][k]) * factor))
    };
    let changes: Vec<Trajectory> =
        moves.par_iter().map(difference).collect::<Result<_, PlantError>>()?;
    let (predicted, scale) = (run.predicted(base, x), coordinates.scale(x));
    // By a small part of the change: the geometry of the arm is not linear.
    let by_change = |change: &Trajectory| {
        const PART: f64 = 1e-3;
        quotient(&run.predicted(&base.plus(change, PART), x), &predicted, PART)
    };
    // Of what the sensors make of the same trajectory.
    let by_sensors = |index: usize, by: f64| {
        let mut moved = x.to_vec();
        moved[index] += by;
        quotient(&run.predicted(base, &moved), &predicted, by)
    };
    let mut columns = vec![quotient(&predicted, &predicted, 1.0); x.len()];
    for (&(index, _), change) in moves.iter().zip(&changes) {
        columns[index] = by_change(change);
    }
    // From farther on all steps are nearer.
    if let Some(start) = run.start {
        for step in 0..coordinates.steps() {
            let nearer = &columns[coordinates.position(step)];
            columns[start] = combined(&columns[start], nearer, |sum, by| sum - by / scale);
        }
    }
    // The drive's effort depends on the radius, too.
    columns[RADIUS] = combined(&columns[RADIUS], &by_sensors(RADIUS, 1e-3), |a, b| a + b);
    for (index, _) in (0..).zip(&ROWS).filter(|(_, row)| row.moves == Moves::Sensors) {
        columns[index] = by_sensors(index, 1e-4);
    }
    // All forces scaled alike change no geometry: a preload sensor that reads high is a
    // stiffer tread under a larger load, its forces taken too large.
    let (stiffer, loaded) = (&changes[0], &changes[4]);
    let mut scaled = stiffer.plus(loaded, 1.0);
    for (change, load) in scaled.series[DRIVE_LOAD].iter_mut().zip(&base.series[DRIVE_LOAD]) {
        *change -= load;
    }
    columns[LOAD_GAIN] = by_change(&scaled);
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    #[test]
    fn elements_of_any_ring_meet_a_step_alike_on_both_sides_to_which_it_is_moved() {
        let mut scenario = Scenario::default();
        scenario.rig.rig.wheel_radius_mm = 40.0;
        let coordinates = Coordinates::of(&scenario).coarse();
        let x: Vec<f64> = coordinates.priors().iter().map(|prior| prior.mean).collect();
        let (step, pitch_mm) = (coordinates.position(0), coordinates.nominal().ring.pitch_mm());
        let moves = moves(&coordinates, &x, 0.5);
        let (_, by_mm) = moves.into_iter().find(|(index, _)| *index == step).unwrap();
        let [low, still, high] = [-by_mm, 0.0, by_mm].map(|by_mm| {
            let mut x = x.clone();
            x[step] += by_mm;
            let mut rig = VirtualRig::new(coordinates.plant(&x), 0.0, 40.0, 1e-3);
            (0..3000).for_each(|_| rig.follow(pitch_mm / 0.03, 40.0, 1e-3).unwrap());
            rig.ledger().crossings()[0].gap_mm
        });
        assert!((high - low).abs() < 5e-4 && (still - low).abs() > 2e-3, "{low} {still} {high}");
    }
}
