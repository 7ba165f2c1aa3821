//! Collision, impact and vibration over one deployment.

use super::published::LOG_S;

/// Interval of theory and simulation, s.
pub(super) const INTERVAL_S: f64 = 0.01;

/// Points: time, s, and value.
pub(super) type Points = Vec<(f64, f64)>;

/// The state of a deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Instant {
    /// Time since the motion began, s.
    pub time_s: f64,
    /// Axial position of the wheel, mm.
    pub position_mm: f64,
    /// Collision force: the axial force of the contact beyond rolling resistance, N.
    pub collision_n: f64,
    /// Impact stress: that force over the surface that the step cuts off, at the hub, kPa.
    pub impact_kpa: f64,
    /// Deflection of the arm at the wheel, um.
    pub arm_um: f64,
    /// Clearance of the undeformed wheel from the root of the step ahead, mm; none
    /// farther than a radius from it.
    pub clearance_mm: Option<f64>,
}

/// A deployment, an instant an interval: the arm's deflection is the largest in the interval
/// before.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct History {
    pub instants: Vec<Instant>,
    largest_um: f64,
}

impl History {
    /// Takes an instant not before the last; whether it is kept.
    pub(super) fn push(&mut self, now: &Instant, interval_s: f64) -> bool {
        self.largest_um = self.largest_um.max(now.arm_um.abs());
        if now.time_s < self.instants.len() as f64 * interval_s - 1e-9 {
            return false;
        }
        self.instants.push(Instant { arm_um: std::mem::take(&mut self.largest_um), ..*now });
        true
    }

    /// The mean of the first `lines` of some logs.
    pub(super) fn mean(logs: &[&Self], lines: usize) -> Self {
        let instant = |line: usize| {
            let mean = |of: fn(&Instant) -> f64| {
                logs.iter().map(|log| of(&log.instants[line])).sum::<f64>() / logs.len() as f64
            };
            Instant {
                time_s: line as f64 * LOG_S,
                position_mm: mean(|now| now.position_mm),
                collision_n: mean(|now| now.collision_n),
                impact_kpa: mean(|now| now.impact_kpa),
                arm_um: mean(|now| now.arm_um),
                // Where all have one.
                clearance_mm: Some(mean(|now| now.clearance_mm.unwrap_or(f64::NAN))),
            }
        };
        Self { instants: (0..lines).map(instant).collect(), largest_um: 0.0 }
    }

    pub(super) fn points(&self, quantity: Quantity) -> Points {
        self.instants.iter().map(|now| (now.time_s, quantity.of(now))).collect()
    }

    /// Clearance at the first step before this time, s, where there is one.
    pub(super) fn clearance_until(&self, end_s: f64) -> Points {
        let clearance = |now: &Instant| Some((now.time_s, now.clearance_mm?));
        let points = self.instants.iter().filter_map(clearance);
        points.filter(|(time_s, mm)| *time_s < end_s && mm.is_finite()).collect()
    }
}

/// One of the quantities of an [`Instant`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// [`Instant::collision_n`].
    Collision,
    /// [`Instant::impact_kpa`].
    Impact,
    /// [`Instant::arm_um`].
    Vibration,
}

impl Quantity {
    /// All three, in the order of cause and effect.
    pub(super) const ALL: [Self; 3] = [Self::Collision, Self::Impact, Self::Vibration];

    /// Name and unit.
    pub(super) const fn axis(self) -> &'static str {
        ["collision, N", "impact, kPa", "vibration, µm"][self as usize]
    }

    pub(super) fn of(self, now: &Instant) -> f64 {
        [now.collision_n, now.impact_kpa, now.arm_um][self as usize]
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
        assert_eq!(history.instants.iter().map(|now| now.arm_um).fold(0.0, f64::max), 9.0);
        assert!((history.instants[7].collision_n - 0.07).abs() < 1e-9);
        assert!(history.clearance_until(1.0).is_empty());
    }
}
