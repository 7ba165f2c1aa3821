//! The legs of a run, one a step, in the coordinate that grows along the run.

use interstage::rig::Rig;

use super::drive::{Driven, Limits};
use super::{BROKEN_S, Bounds};
use crate::plant::draw::PlantParameters;
use crate::report::verdict::SLIP_SEEN_MM;
use crate::session::RunError;

/// Distance behind a step's event at which its leg ends, mm: cruise speed is reached again.
const LEG_MM: f64 = 17.0;
/// Part of the preload limit that each leg leaves to the next: the wheel still rises a little as
/// its patch leaves the edge behind it, and the screw answers late.
const HANDED_OVER: f64 = 1e-3;
const LONGEST_S: f64 = 12.0;

/// Speed and preload of a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// Crossing speed of the tread, mm/s.
    pub(super) speed_mm_s: f64,
    /// Distance before the event at which it is reached, mm.
    pub(super) before_mm: f64,
    /// Distance behind the event up to which it is kept, mm; negative is before it.
    pub(super) after_mm: f64,
    pub(super) preload_n: f64,
    /// Time before which the wheel rests, s.
    pub(super) start_s: f64,
}

impl Leg {
    /// The leg with these changes of `before_mm`, `after_mm`, `preload_n`, `start_s`, the
    /// preload at most this, N.
    pub(super) fn changed(&self, changes: &[f64; 4], most_n: f64) -> Self {
        let [before, after, preload, start] = changes;
        let before_mm = (self.before_mm + before).clamp(0.0, 5.0);
        Self {
            before_mm,
            after_mm: (self.after_mm + after).clamp(-before_mm, 5.0),
            preload_n: (self.preload_n + preload).clamp(0.2 * most_n, most_n),
            start_s: (self.start_s + start).max(0.0),
            ..*self
        }
    }
}

/// The steps of a plant along the run, and what must be kept.
pub(super) struct Track<'a> {
    pub(super) rig: &'a Rig,
    /// Coordinates of the events, ascending, mm.
    pub(super) events: Vec<f64>,
    limits: Limits,
    bounds: &'a Bounds,
    mu: f64,
}

/// How a leg ends.
#[derive(Clone)]
pub(super) struct Reached {
    pub(super) driven: Driven,
    /// Gap over its bound, relative, less 1.
    pub(super) gap_excess: f64,
    /// By how much each bound is broken, relative; zero if it is kept.
    broken: [(&'static str, f64); 6],
    /// Time at its end, and what the speed that is still missing will cost, s.
    time_s: f64,
}

impl Reached {
    /// Time, s; with more than any time where a bound is broken.
    pub(super) fn cost(&self) -> f64 {
        let broken: f64 = self.broken.iter().map(|(_, by)| by).sum();
        self.time_s + if broken > 0.0 { BROKEN_S * (1.0 + broken) } else { 0.0 }
    }

    /// The bound that is broken most, and by how much; none if all are kept.
    pub(super) fn fails(&self) -> Option<(&'static str, f64)> {
        let worst = self.broken.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        worst.filter(|(_, by)| *by > 0.0)
    }
}

impl<'a> Track<'a> {
    pub(super) fn new(
        rig: &'a Rig,
        plant: &PlantParameters,
        bounds: &'a Bounds,
        limits: Limits,
    ) -> Self {
        // At the event the centre is a radius above the lower wall, this far from the face.
        let reach = plant.ring.radius_mm + bounds.gap_mm;
        let face_mm = (reach * reach - plant.ring.radius_mm.powi(2)).max(0.0).sqrt();
        let steps = plant.wall.steps().iter();
        let mut events: Vec<f64> =
            steps.map(|step| limits.sign * (step.position_mm - face_mm)).collect();
        events.sort_by(f64::total_cmp);
        Self { rig, events, limits, bounds, mu: plant.mu }
    }

    /// Runs one leg from this state.
    pub(super) fn run(&self, from: &Driven, index: usize, leg: &Leg) -> Result<Reached, RunError> {
        let event = self.events[index];
        let next = self.events.get(index + 1).copied();
        // Steps close to one another share the distance.
        let last = next.map_or(event + LEG_MM, |next| (event + LEG_MM).min(0.5 * (event + next)));
        let last = last.min(self.limits.end_mm - 1.0).max(event + leg.after_mm.max(0.0) + 0.1);
        let mut driven = from.clone();
        let until_s = driven.time_s() + LONGEST_S;
        let slow = Some((event - leg.before_mm, event + leg.after_mm, leg.speed_mm_s));
        while driven.along_mm() < last && driven.time_s() < until_s {
            driven.step(leg.start_s, slow, leg.preload_n)?;
        }
        let plant = &driven.plant;
        let crossing = plant.ledger().crossings().get(index);
        let gap = crossing.map_or(f64::INFINITY, |crossing| crossing.gap_mm);
        let peaks = driven.peaks;
        let used = crossing.map_or(self.mu, |crossing| crossing.peak_utilisation);
        let over = |value: f64, most: f64| (value / most - 1.0).max(0.0);
        let legs_left = (self.events.len() - 1 - index) as f64;
        let most_n = self.rig.preload.limit_n * (1.0 - HANDED_OVER * legs_left);
        let rolling_margin = self.rig.control.slip_margin;
        // A crossing that was not made breaks as much as a gap ten times as large.
        let gap_excess = (gap / self.bounds.gap_mm - 1.0).min(10.0);
        let broken = [
            ("gap", gap_excess.max(0.0)),
            ("slip margin", over(used, self.mu - self.bounds.slip_margin)),
            ("rolling margin", over(peaks.rolling_utilisation, self.mu - rolling_margin)),
            ("preload", over(peaks.preload_n, most_n)),
            ("separation", over(peaks.separation_mm, self.bounds.gap_mm)),
            ("slip", over(plant.truth().slip_mm, SLIP_SEEN_MM)),
        ];
        let time_s = driven.time_s() + driven.missing_speed_s();
        Ok(Reached { driven, gap_excess, broken, time_s })
    }
}
