//! What a crossing gives, and the steps that its two forms share.

use crate::reference::case::Case;
use hil_sim::plant::ring::{Contact, Motion, Ring};
use hil_sim::plant::wall::{Step, Wall};

/// The wheel at one instant. The wall is y = 0 before the face at x = 0, y = h behind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time since the wheel's undeformed circle touched the corner, s.
    pub t_s: f64,
    /// Centre, mm.
    pub x_mm: f64,
    /// Centre above the lower wall, mm.
    pub y_mm: f64,
    /// What the pressure of the contact holds against the motion, N, without friction:
    /// the collision force.
    pub axial_n: f64,
    /// Force of the contact away from the wall, N: the preload, less what accelerates.
    pub radial_n: f64,
    /// Part of it that the lower wall carries, N.
    pub floor_n: f64,
    /// Magnitude of the force of face and corner, N.
    pub corner_n: f64,
    /// Mean pressure of the contact, Pa; 0 without contact.
    pub pressure_pa: f64,
    /// Contact area, mm^2, averaged over the way of one element: elements enter and leave
    /// whole.
    pub area_mm2: f64,
    /// Largest depth of the tread, mm: the embedding depth.
    pub depth_mm: f64,
    /// Clearance between step root and undeformed wheel, mm.
    pub clearance_mm: f64,
    /// Friction utilisation; 0 when frictionless.
    pub utilisation: f64,
}

/// The instant at which the lower wall stops carrying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// Time since the touch, s.
    pub t_s: f64,
    /// The gap: clearance at the step root, mm.
    pub gap_mm: f64,
}

/// One crossing over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// From shortly before the touch until the wheel rolls on the upper wall.
    pub samples: Vec<Sample>,
    /// Lift-off; none if the wheel sinks in so far that the lower wall carries until
    /// the step lies under its centre.
    pub lift: Option<Lift>,
    /// Mean contact pressure of steady rolling before the step, Pa.
    pub cruise_pressure_pa: f64,
}

impl Crossing {
    /// Largest force against the motion, N.
    #[must_use]
    pub fn peak_n(&self) -> f64 {
        self.samples.iter().map(|sample| sample.axial_n).fold(0.0, f64::max)
    }

    /// Largest depth of the tread, mm.
    #[must_use]
    pub fn embedding_mm(&self) -> f64 {
        self.samples.iter().map(|sample| sample.depth_mm).fold(0.0, f64::max)
    }

    /// Work of the contact against the motion, mJ. Frictionless and without memory it
    /// is preload times step height, less 0.1 % at 100 N: the pressure acts along the
    /// rays, which lean from the wall's normal by their angle.
    #[must_use]
    pub fn work_mj(&self) -> f64 {
        let pieces = self.samples.windows(2);
        pieces.map(|p| 0.5 * (p[0].axial_n + p[1].axial_n) * (p[1].x_mm - p[0].x_mm)).sum()
    }
}

/// The way of a crossing: where it is run from and to.
#[derive(Clone, Debug)]
pub(super) struct Way {
    pub(super) wall: Wall,
    /// Undeformed radius, mm.
    pub(super) radius_mm: f64,
    /// Where the wheel is put down, the samples begin, and the crossing ends, mm.
    pub(super) start_mm: f64,
    pub(super) shown_mm: f64,
    pub(super) end_mm: f64,
}

impl Way {
    pub(super) fn of(case: &Case) -> Self {
        let radius = case.rig.rig.wheel_radius_mm;
        let height = case.step_height_mm;
        let run = (height * (2.0 * radius - height)).sqrt();
        // Far enough to forget how the wheel was put down, or to have turned once round.
        let forget = 8.0 * case.rig.tread.tau_s * case.speed_mm_s;
        let settle = (forget + 0.5 * radius).min(7.0 * radius);
        Self {
            wall: Wall::new(vec![Step { position_mm: 0.0, height_mm: height }]),
            radius_mm: radius,
            start_mm: -run - 0.1 * radius - settle,
            shown_mm: -run - 0.1 * radius,
            end_mm: 0.6 * radius,
        }
    }

    /// The step of the ring to the centre `(x, y)`.
    pub(super) fn motion(&self, x_mm: f64, y_mm: f64, turn_rad: f64, dt_s: f64) -> Motion {
        let wall = self.wall.local(x_mm);
        Motion { wall, height_mm: y_mm - wall.base_mm, turn_rad, dt_s }
    }
}

/// Collects the samples of a crossing and finds its lift-off.
#[derive(Debug, Default)]
pub(super) struct Recorder {
    pub(super) samples: Vec<Sample>,
    pub(super) lift: Option<Lift>,
    touch_s: f64,
    touched: bool,
    last: Option<(Sample, f64, f64)>,
}

impl Recorder {
    /// Takes the state at time, s, and centre, mm.
    pub(super) fn take(
        &mut self,
        way: &Way,
        case: &Case,
        (t_s, x_mm, y_mm): (f64, f64, f64),
        contact: &Contact,
        utilisation: f64,
    ) {
        let sample = Sample {
            t_s,
            x_mm,
            y_mm,
            axial_n: contact.sine_n,
            radial_n: contact.cosine_n + utilisation * contact.sine_n,
            floor_n: contact.floor_n,
            corner_n: contact.step_force_n(),
            // The normal force, until the area is averaged.
            pressure_pa: contact.normal_n,
            area_mm2: contact.area_mm2,
            depth_mm: contact.depth_mm,
            clearance_mm: x_mm.hypot(y_mm) - way.radius_mm,
            utilisation,
        };
        let corner_mm = x_mm.hypot(y_mm - case.step_height_mm) - way.radius_mm;
        if let Some((before, corner_before_mm, pressure)) = self.last {
            if !self.touched && corner_mm < 0.0 {
                let part = corner_before_mm / (corner_before_mm - corner_mm);
                self.touch_s = before.t_s + part * (t_s - before.t_s);
                self.touched = true;
            }
            let (a, b) = (pressure, contact.floor_pressure);
            if self.lift.is_none() && self.touched && x_mm < 0.0 && a > 0.0 && b <= 0.0 {
                let part = a / (a - b);
                let mix = |from: f64, to: f64| from + part * (to - from);
                let at = (mix(before.x_mm, x_mm), mix(before.y_mm, y_mm));
                let gap_mm = at.0.hypot(at.1) - way.radius_mm;
                self.lift = Some(Lift { t_s: mix(before.t_s, t_s), gap_mm });
            }
        }
        self.last = Some((sample, corner_mm, contact.floor_pressure));
        if x_mm >= way.shown_mm {
            self.samples.push(sample);
        }
    }

    /// The crossing, its time counted from the touch.
    pub(super) fn finish(mut self, case: &Case) -> Crossing {
        let ring = case.ring();
        let pitch_mm = std::f64::consts::TAU * ring.radius_mm / ring.elements as f64;
        let areas = averaged(&self.samples, pitch_mm);
        for (sample, area_mm2) in self.samples.iter_mut().zip(areas) {
            sample.t_s -= self.touch_s;
            sample.area_mm2 = area_mm2;
            let mean_pa = 1e6 * sample.pressure_pa / area_mm2;
            sample.pressure_pa = if area_mm2 > 0.0 { mean_pa } else { 0.0 };
        }
        // Steady until the touch.
        let cruise: Vec<f64> =
            self.samples.iter().filter(|s| s.t_s < 0.0).map(|s| s.pressure_pa).collect();
        let cruise_pressure_pa = cruise.iter().sum::<f64>() / cruise.len().max(1) as f64;
        Crossing {
            samples: self.samples,
            lift: self.lift.map(|lift| Lift { t_s: lift.t_s - self.touch_s, ..lift }),
            cruise_pressure_pa,
        }
    }
}

/// The contact area over way, averaged over `way_mm` around each sample.
fn averaged(samples: &[Sample], way_mm: f64) -> Vec<f64> {
    let mut sums = vec![0.0];
    for sample in samples {
        sums.push(sums[sums.len() - 1] + sample.area_mm2);
    }
    let within = |sample: &Sample| {
        let from = samples.partition_point(|s| s.x_mm <= sample.x_mm - 0.5 * way_mm);
        let to = samples.partition_point(|s| s.x_mm <= sample.x_mm + 0.5 * way_mm);
        (sums[to] - sums[from]) / (to - from).max(1) as f64
    };
    samples.iter().map(within).collect()
}

/// A ring at rest.
pub(super) fn ring(case: &Case) -> Ring {
    Ring::new(case.ring())
}
