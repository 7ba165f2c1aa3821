//! Collision, impact and vibration over a deployment.

use super::published::LOG_S;

/// Interval of theory and simulation, s.
pub const INTERVAL_S: f64 = 0.01;

/// Points: time, s, and value.
pub type Points = Vec<(f64, f64)>;

/// The state of a deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant {
    /// Time since the motion began, s.
    pub time_s: f64,
    /// Axial position of the wheel, mm.
    pub position_mm: f64,
    /// Collision force, N.
    pub collision_n: f64,
    /// Impact stress, kPa.
    pub impact_kpa: f64,
    /// Deflection of the arm at the wheel, um.
    pub arm_um: f64,
    /// Clearance of the undeformed wheel from the root of the step ahead, mm; none
    /// farther than a radius from it.
    pub clearance_mm: Option<f64>,
}

/// A deployment, one point an interval: collision and impact at its time, of the arm's
/// deflection the largest in the interval before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// Axial position of the wheel, mm.
    pub position_mm: Vec<f64>,
    /// Axial force of the contact beyond rolling resistance, N.
    pub collision: Points,
    /// That force over the surface that the step cuts off, at the hub, kPa.
    pub impact: Points,
    /// Deflection of the arm, um.
    pub vibration: Points,
    /// Clearance at the step ahead, mm; not a number where there is none.
    pub clearance: Points,
    largest_um: f64,
}

impl History {
    /// Takes an instant not before the last; whether it makes a point.
    pub fn push(&mut self, now: &Instant, interval_s: f64) -> bool {
        self.largest_um = self.largest_um.max(now.arm_um.abs());
        let due_s = self.collision.len() as f64 * interval_s;
        if now.time_s < due_s - 1e-9 {
            return false;
        }
        self.position_mm.push(now.position_mm);
        self.collision.push((now.time_s, now.collision_n));
        self.impact.push((now.time_s, now.impact_kpa));
        self.vibration.push((now.time_s, self.largest_um));
        self.clearance.push((now.time_s, now.clearance_mm.unwrap_or(f64::NAN)));
        self.largest_um = 0.0;
        true
    }

    /// The mean of the first `lines` of some logs.
    pub(super) fn mean(logs: &[&Self], lines: usize) -> Self {
        let mean = |of: fn(&Self) -> &Points| {
            let sum = |line: usize| logs.iter().map(|log| of(log)[line].1).sum::<f64>();
            let point = |line| (line as f64 * LOG_S, sum(line) / logs.len() as f64);
            (0..lines).map(point).collect()
        };
        let position = |line| {
            let sum = logs.iter().map(|log| log.position_mm[line]).sum::<f64>();
            sum / logs.len() as f64
        };
        Self {
            position_mm: (0..lines).map(position).collect(),
            collision: mean(|log| &log.collision),
            impact: mean(|log| &log.impact),
            vibration: mean(|log| &log.vibration),
            clearance: mean(|log| &log.clearance),
            largest_um: 0.0,
        }
    }

    /// Clearance at the first step before this time, s, where there is one.
    pub(super) fn clearance_until(&self, end_s: f64) -> Points {
        let shown = |p: &(f64, f64)| p.0 < end_s && p.1.is_finite();
        self.clearance.iter().copied().filter(shown).collect()
    }
}

/// One of the quantities of a [`History`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// [`History::collision`].
    Collision,
    /// [`History::impact`].
    Impact,
    /// [`History::vibration`].
    Vibration,
}

impl Quantity {
    /// All three, in the order of cause and effect.
    pub const ALL: [Self; 3] = [Self::Collision, Self::Impact, Self::Vibration];

    /// Name and unit.
    pub const fn axis(self) -> &'static str {
        ["collision, N", "impact, kPa", "vibration, µm"][self as usize]
    }

    pub(super) fn of(self, history: &History) -> &Points {
        [&history.collision, &history.impact, &history.vibration][self as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_is_even_and_keeps_the_arm_s_peaks() {
        let mut history = History::default();
        for index in 0..100 {
            let arm_um = if index == 55 { -9.0 } else { 1.0 };
            let time_s = f64::from(index) * 1e-3;
            let now = Instant { time_s, arm_um, collision_n: time_s, ..Instant::default() };
            assert_eq!(history.push(&now, INTERVAL_S), index % 10 == 0);
        }
        assert_eq!(history.vibration.iter().map(|p| p.1).fold(0.0, f64::max), 9.0);
        assert!((history.collision[7].1 - 0.07).abs() < 1e-9);
        assert!(history.clearance_until(1.0).is_empty());
    }
}
