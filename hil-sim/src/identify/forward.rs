//! The forward model: the plant's ring led through a log by the recorded turn of the
//! wheel and the recorded preload. It answers with the compression, the height of the
//! centre and the traction that such a tread would have shown.
//!
//! Motor and pre-tightener are thus no part of it: their errors do not add up along the
//! way. Derivatives are differences of runs. Steps act only where they stand, so one run
//! with all of them moved gives the derivatives by each.

use rayon::prelude::*;

use super::coordinates::{
    ARM_ZERO, CREEP, Coordinates, DRIVE, FRICTION, GEARBOX, LOAD, LOAD_GAIN, RADIUS, STIFFENING,
    STIFFNESS, TAU, TREAD_GAIN,
};
use super::record::{Record, TICK_S};
use super::traces::{Traces, at};
use crate::plant::arm::Arm;
use crate::plant::draw::PlantParameters;
use crate::plant::rig::{PlantError, Resolution, VirtualRig};

/// How finely the forward model is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Elements of the ring.
    pub elements: usize,
    /// Longest way of a ring step, mm.
    pub stride_mm: f64,
    /// Step, ticks.
    pub step: usize,
}

impl Default for Fineness {
    fn default() -> Self {
        Self { elements: 1440, stride_mm: 0.04, step: 2 }
    }
}

/// What the forward model says, every so many ticks.
#[derive(Clone, Debug)]
pub struct Course {
    first: usize,
    step: usize,
    compression_mm: Vec<f64>,
    height_mm: Vec<f64>,
    traction_n: Vec<f64>,
    position_mm: Vec<f64>,
    most_utilisation: f64,
}

/// A record with what the forward model needs of it.
#[derive(Clone, Debug)]
pub struct Run {
    /// Where it begins, mm.
    start_mm: f64,
    arm_delay: f64,
    tread_delay: f64,
    arm: Arm,
    wall_radius_mm: f64,
    stall_n: f64,
    no_load_mm_s: f64,
    reflected_kg: f64,
    /// The record's traces.
    pub traces: Traces,
    /// Its name.
    pub name: String,
}

/// What is compared: one value a used bin, by channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channels {
    /// Compression, mm.
    pub compression: Vec<f64>,
    /// Arm angle, mrad.
    pub arm: Vec<f64>,
    /// Drive effort, N.
    pub effort: Vec<f64>,
}

impl Channels {
    /// All values, channel after channel.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        [&self.compression, &self.arm, &self.effort].into_iter().flatten().copied()
    }

    /// Names of the channels, with their units.
    pub const NAMES: [(&'static str, &'static str); 3] =
        [("compression", "mm"), ("arm angle", "mrad"), ("drive effort", "N")];

    /// The channels in the order of their names.
    #[must_use]
    pub fn each(&self) -> [&[f64]; 3] {
        [&self.compression, &self.arm, &self.effort]
    }
}

impl Run {
    /// Makes a record ready.
    ///
    /// # Errors
    /// As of [`Traces::of`].
    pub fn of(record: &Record, coordinates: &Coordinates) -> Result<Self, super::IdentifyError> {
        let nominal = coordinates.nominal();
        Ok(Self {
            start_mm: record.start_mm(),
            arm_delay: record.arm_delay_s / TICK_S,
            tread_delay: record.scenario.noise.tread_delay_s / TICK_S,
            arm: nominal.arm,
            wall_radius_mm: nominal.wall_radius_mm,
            stall_n: nominal.drive.stall_n,
            no_load_mm_s: nominal.drive.no_load_mm_s,
            reflected_kg: nominal.drive.mass_kg,
            traces: Traces::of(record)?,
            name: record.name.clone(),
        })
    }

    /// Leads the plant of these parameters through the record.
    ///
    /// # Errors
    /// [`PlantError`] where it has no balance.
    pub fn lead(
        &self,
        plant: &PlantParameters,
        load_gain: f64,
        fineness: Fineness,
    ) -> Result<Course, PlantError> {
        let traces = &self.traces;
        let (first, last) = (traces.span.start, traces.span.end - 1);
        let step = fineness.step;
        let dt = step as f64 * TICK_S;
        let mut plant = plant.clone();
        plant.ring.elements = fineness.elements;
        let radius = plant.ring.radius_mm;
        let preload = |tick: usize| traces.preload_n[tick] / load_gain;
        let mut rig = VirtualRig::new(plant, self.start_mm, preload(first), dt)
            .with_resolution(Resolution { stride_mm: fineness.stride_mm, always_awake: false });
        let count = (last - first) / step + 1;
        let mut course = Course {
            first,
            step,
            compression_mm: Vec::with_capacity(count),
            height_mm: Vec::with_capacity(count),
            traction_n: Vec::with_capacity(count),
            position_mm: Vec::with_capacity(count),
            most_utilisation: 0.0,
        };
        course.note(&rig);
        for k in 1..count {
            let (from, to) = (first + (k - 1) * step, first + k * step);
            let tread = radius * (traces.turn_rad[to] - traces.turn_rad[from]) / dt;
            rig.follow(tread, preload(to), dt)?;
            course.note(&rig);
        }
        Ok(course)
    }

    /// What the sensors would have said in the used bins.
    #[must_use]
    pub fn said(&self, course: &Course, x: &[f64]) -> Channels {
        let traces = &self.traces;
        let mut said = Channels::default();
        for bin in traces.bins.iter().filter(|bin| bin.used) {
            let depth = course.mean(&course.compression_mm, &bin.ticks, self.tread_delay);
            said.compression.push(depth * x[TREAD_GAIN].exp());
            if bin.arm_rad.is_some() {
                let height = course.mean(&course.height_mm, &bin.ticks, self.arm_delay);
                said.arm.push(1e3 * self.arm.angle(self.wall_radius_mm - height) + x[ARM_ZERO]);
            }
        }
        let radius = x[RADIUS];
        for effort in traces.efforts.iter().filter(|effort| effort.used) {
            let sense = effort.turn_rad_s.signum();
            // The worm gear holds what would help.
            let traction = course.mean(&course.traction_n, &effort.ticks, 0.0) * sense;
            let inertia = 1e-3 * self.reflected_kg * effort.gain_rad_s2 * radius;
            let loss = self.stall_n * effort.turn_rad_s * radius / self.no_load_mm_s;
            let force = sense * (traction.max(0.0) + x[GEARBOX]) + inertia;
            said.effort.push(force / x[DRIVE].exp() + loss);
        }
        said
    }

    /// What the sensors did say there.
    #[must_use]
    pub fn heard(&self) -> Channels {
        let used = self.traces.bins.iter().filter(|bin| bin.used);
        let efforts = self.traces.efforts.iter().filter(|effort| effort.used);
        Channels {
            compression: used.clone().map(|bin| bin.compression_mm).collect(),
            arm: used.filter_map(|bin| bin.arm_rad).map(|arm| 1e3 * arm).collect(),
            effort: efforts.map(|effort| self.stall_n * effort.duty).collect(),
        }
    }

    /// Times of the values of each channel, s.
    #[must_use]
    pub fn times(&self) -> Channels {
        let mid = |ticks: &std::ops::Range<usize>| 0.5e-3 * (ticks.start + ticks.end) as f64;
        let used = self.traces.bins.iter().filter(|bin| bin.used);
        let efforts = self.traces.efforts.iter().filter(|effort| effort.used);
        Channels {
            compression: used.clone().map(|bin| mid(&bin.ticks)).collect(),
            arm: used.filter(|bin| bin.arm_rad.is_some()).map(|bin| mid(&bin.ticks)).collect(),
            effort: efforts.map(|effort| mid(&effort.ticks)).collect(),
        }
    }
}

impl Course {
    fn note(&mut self, rig: &VirtualRig) {
        let truth = rig.truth();
        self.compression_mm.push(truth.depth_mm);
        self.height_mm.push(truth.height_mm);
        self.traction_n.push(rig.traction_n());
        self.position_mm.push(truth.position_mm);
        self.most_utilisation = self.most_utilisation.max(truth.utilisation.abs());
    }

    /// Mean over the readings of a bin, each `delay` ticks old.
    fn mean(&self, values: &[f64], ticks: &std::ops::Range<usize>, delay: f64) -> f64 {
        let place = |tick: usize| (tick as f64 - delay - self.first as f64) / self.step as f64;
        let sum: f64 = ticks.clone().map(|tick| at(values, place(tick))).sum();
        sum / ticks.len() as f64
    }

    /// Height of the centre above the outermost wall at a tick, mm.
    #[must_use]
    pub fn height_mm(&self, tick: f64) -> f64 {
        at(&self.height_mm, (tick - self.first as f64) / self.step as f64)
    }

    /// Largest friction utilisation.
    #[must_use]
    pub const fn most_utilisation(&self) -> f64 {
        self.most_utilisation
    }

    /// This course with `change` per unit of a coordinate added.
    fn plus(&self, change: &Self, part: f64) -> Self {
        let add = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + part * b).collect();
        Self {
            compression_mm: add(&self.compression_mm, &change.compression_mm),
            height_mm: add(&self.height_mm, &change.height_mm),
            traction_n: add(&self.traction_n, &change.traction_n),
            position_mm: add(&self.position_mm, &change.position_mm),
            ..self.clone()
        }
    }

    /// Difference quotient of two courses.
    fn per(&self, base: &Self, change: f64) -> Self {
        self.plus(base, -1.0).scaled(1.0 / change)
    }

    fn scaled(&self, factor: f64) -> Self {
        let zero = Self {
            compression_mm: vec![0.0; self.compression_mm.len()],
            height_mm: vec![0.0; self.height_mm.len()],
            traction_n: vec![0.0; self.traction_n.len()],
            position_mm: vec![0.0; self.position_mm.len()],
            ..self.clone()
        };
        zero.plus(self, factor)
    }

    /// The part of a change that belongs to step `index` of those that stand at `stand`.
    fn near(&self, positions: &[f64], stand: &[f64], index: usize) -> Self {
        let after = |x: f64| index == 0 || is_behind(stand, x, index - 1);
        let here: Vec<bool> =
            positions.iter().map(|&x| after(x) && !is_behind(stand, x, index)).collect();
        let cut = |values: &[f64]| {
            values.iter().zip(&here).map(|(v, here)| if *here { *v } else { 0.0 }).collect()
        };
        Self {
            compression_mm: cut(&self.compression_mm),
            height_mm: cut(&self.height_mm),
            traction_n: cut(&self.traction_n),
            position_mm: cut(&self.position_mm),
            ..self.clone()
        }
    }
}

/// Coordinates by which runs are differenced, and by how much to either side: so far that
/// the ring's elements, which meet a corner one by one, do not show.
const MOVED: [(usize, f64); 7] = [
    (STIFFNESS, 0.01),
    (STIFFENING, 0.01),
    (TAU, 0.02),
    (FRICTION, 0.03),
    (LOAD, 0.02),
    (RADIUS, 0.04),
    (CREEP, 0.05),
];
/// By how much the steps are, mm.
const MOVED_POSITION_MM: f64 = 0.03;
const MOVED_HEIGHT_MM: f64 = 0.03;

/// How far before its face a corner is felt, mm, and the part of what is left between two
/// steps that belongs to the first, whose edge the patch has to leave.
const CORNER_MM: f64 = 14.5;
const PART_OF_CLEAR: f64 = 0.8;

/// Courses of all runs at these coordinates.
///
/// # Errors
/// [`PlantError`] where one has no balance.
pub fn courses(
    runs: &[Run],
    coordinates: &Coordinates,
    x: &[f64],
    fineness: Fineness,
) -> Result<Vec<Course>, PlantError> {
    let plant = coordinates.plant(x);
    runs.par_iter().map(|run| run.lead(&plant, x[LOAD_GAIN].exp(), fineness)).collect()
}

/// Derivatives of what a run would have said by each coordinate.
///
/// # Errors
/// [`PlantError`] where a changed plant has no balance.
pub fn derivatives(
    run: &Run,
    coordinates: &Coordinates,
    x: &[f64],
    base: &Course,
    fineness: Fineness,
) -> Result<Vec<Channels>, PlantError> {
    let steps = coordinates.steps();
    let moved = |indices: &[usize], by: f64| {
        let mut x = x.to_vec();
        for &index in indices {
            x[index] += by;
        }
        run.lead(&coordinates.plant(&x), x[LOAD_GAIN].exp(), fineness)
    };
    let mut changes: Vec<(Vec<usize>, f64)> =
        MOVED.iter().map(|&(index, by)| (vec![index], by)).collect();
    changes.push(((0..steps).map(|step| coordinates.position(step)).collect(), MOVED_POSITION_MM));
    changes.push(((0..steps).map(|step| coordinates.height(step)).collect(), MOVED_HEIGHT_MM));
    let quotient = |(indices, by): &(Vec<usize>, f64)| {
        let (up, down) = (moved(indices, *by)?, moved(indices, -by)?);
        Ok(up.per(&down, 2.0 * by))
    };
    let changes: Vec<Course> =
        changes.par_iter().map(quotient).collect::<Result<_, PlantError>>()?;
    let said = run.said(base, x);
    // By a small part of a course's change: the geometry of the arm is not linear.
    let by_course = |change: &Course| {
        const PART: f64 = 1e-3;
        run.said(&base.plus(change, PART), x).minus(&said).scaled(1.0 / PART)
    };
    let mut columns = vec![said.scaled(0.0); x.len()];
    for (&(index, _), change) in MOVED.iter().zip(&changes) {
        columns[index] = by_course(change);
    }
    // The radius is in the turn's way of the drive, too.
    columns[RADIUS] = columns[RADIUS].plus(&by_coordinate(run, base, x, RADIUS, 1e-3));
    for index in [GEARBOX, TREAD_GAIN, ARM_ZERO, DRIVE] {
        columns[index] = by_coordinate(run, base, x, index, 1e-4);
    }
    // All forces scaled alike change no geometry: a load cell that reads high is a
    // stiffer tread under a larger load, its forces taken too large.
    let (stiffer, loaded) = (&changes[0], &changes[4]);
    let mut scaled = stiffer.plus(loaded, 1.0);
    for (change, traction) in scaled.traction_n.iter_mut().zip(&base.traction_n) {
        *change -= traction;
    }
    columns[LOAD_GAIN] = by_course(&scaled);
    step_columns(coordinates, x, base, &changes[MOVED.len()..], &mut columns, by_course);
    Ok(columns)
}

/// Whether a wheel at `x` has nothing to do with step `index` any more: past its face by
/// most of the way that is left to the corner of the next.
fn is_behind(stand: &[f64], x: f64, index: usize) -> bool {
    let clear = |next: &f64| PART_OF_CLEAR * (next - stand[index] - CORNER_MM).max(0.0);
    stand.get(index + 1).is_some_and(|next| x > stand[index] + clear(next))
}

fn step_columns(
    coordinates: &Coordinates,
    x: &[f64],
    base: &Course,
    changes: &[Course],
    columns: &mut [Channels],
    by_course: impl Fn(&Course) -> Channels,
) {
    let steps = coordinates.steps();
    let scale = coordinates.scale(x);
    let stand: Vec<f64> = (0..steps).map(|step| scale * x[coordinates.position(step)]).collect();
    let (by_position, mut by_height) = (&changes[0], changes[1].clone());
    // Heights add up along the way: each step alone, above the wall before it.
    let before = |x: f64, index: usize| is_behind(&stand, x, index);
    let positions = &base.position_mm;
    for (height, &x) in by_height.height_mm.iter_mut().zip(positions) {
        *height -= (0..steps).filter(|&index| before(x, index)).count() as f64;
    }
    for index in 0..steps {
        columns[coordinates.position(index)] =
            by_course(&by_position.near(positions, &stand, index));
        let mut change = by_height.near(positions, &stand, index);
        for (height, &x) in change.height_mm.iter_mut().zip(positions) {
            if before(x, index) {
                *height += 1.0;
            }
        }
        columns[coordinates.height(index)] = by_course(&change);
    }
}

fn by_coordinate(run: &Run, base: &Course, x: &[f64], index: usize, by: f64) -> Channels {
    let mut moved = x.to_vec();
    moved[index] += by;
    run.said(base, &moved).minus(&run.said(base, x)).scaled(1.0 / by)
}

impl Channels {
    fn with(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let each = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect();
        Self {
            compression: each(&self.compression, &other.compression),
            arm: each(&self.arm, &other.arm),
            effort: each(&self.effort, &other.effort),
        }
    }

    /// Difference.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.with(other, |a, b| a - b)
    }

    fn plus(&self, other: &Self) -> Self {
        self.with(other, |a, b| a + b)
    }

    fn scaled(&self, factor: f64) -> Self {
        self.with(self, |a, _| a * factor)
    }
}
