//! The plant's own record of each crossing: what really happened.

use super::wall::Step;

/// Travel of the axle over which the speed before lift-off counts, mm. The controller's
/// `model::history` has the same for the tread, which is what it can measure.
pub(crate) const REMEMBERED_MM: f64 = 0.5;

/// What is looked at every ring step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    pub time_s: f64,
    /// Axial position of the centre, mm.
    pub position_mm: f64,
    /// Height of the centre above the outermost wall, mm.
    pub height_mm: f64,
    /// Height of the wall under the centre, mm.
    pub base_mm: f64,
    pub speed_mm_s: f64,
    pub preload_n: f64,
    pub utilisation: f64,
    /// Gross slip so far, mm.
    pub slip_mm: f64,
    /// Force of corner and face, N.
    pub corner_n: f64,
    /// Largest pressure on the lower wall, negative when it carries nothing, N/mm^2.
    pub floor_pressure: f64,
}

/// One crossing, in either direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// Step number, from 1 at the outermost sleeve.
    pub index: usize,
    /// Where the step stands, mm.
    pub step_mm: f64,
    /// Whether it was climbed (else dropped off).
    pub climbing: bool,
    /// First touch of the corner, s; on retract, the centre passing the edge.
    pub touch_s: f64,
    /// Lower wall stopped (retract: began) to carry, s.
    pub lift_s: f64,
    /// Clearance of the step root from the undeformed wheel at that instant, mm.
    pub gap_mm: f64,
    /// Speed of the crossing: travel over time before that instant, with a weight that falls by e
    /// in `REMEMBERED_MM`, mm/s.
    pub speed_mm_s: f64,
    /// Preload at that instant, N.
    pub preload_n: f64,
    /// Largest force of corner and face, N.
    pub corner_n: f64,
    pub peak_preload_n: f64,
    pub peak_utilisation: f64,
    /// Gross slip in the crossing, mm.
    pub slip_mm: f64,
}

/// All crossings of a run.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    steps: Vec<Step>,
    radius_mm: f64,
    done: Vec<Crossing>,
    open: Option<Open>,
}

/// A crossing while the corner carries.
#[derive(Clone, Copy, Debug)]
struct Open {
    crossing: Crossing,
    slip_before: f64,
    last: Moment,
    /// Time per travel as the tread remembers it, s/mm.
    slowness: f64,
    /// The gap is known: the line stands at the end of the list.
    listed: bool,
}

impl Ledger {
    /// A ledger over these steps for a wheel of this radius, mm.
    pub(crate) fn new(steps: Vec<Step>, radius_mm: f64) -> Self {
        Self { steps, radius_mm, done: Vec::new(), open: None }
    }

    /// Crossings whose gap is known, in the order they happened; one under way is taken
    /// off again if the wheel slides back where it came from.
    pub fn crossings(&self) -> &[Crossing] {
        &self.done
    }

    pub(crate) fn record(&mut self, now: &Moment) {
        let Some(mut open) = self.open.take().or_else(|| self.begin(now)) else { return };
        // Off the corner, over the edge or back where it came from.
        let over = now.position_mm >= open.crossing.step_mm;
        if now.corner_n <= 0.0 || over {
            // A wheel that slid back has not crossed.
            if open.listed && over != open.crossing.climbing {
                self.done.pop();
            }
            return;
        }
        let travel = (now.position_mm - open.last.position_mm).abs();
        let time = now.time_s - open.last.time_s;
        open.slowness += (time - open.slowness * travel) / REMEMBERED_MM;
        let crossing = &mut open.crossing;
        crossing.corner_n = crossing.corner_n.max(now.corner_n);
        crossing.peak_preload_n = crossing.peak_preload_n.max(now.preload_n);
        crossing.peak_utilisation = crossing.peak_utilisation.max(now.utilisation.abs());
        crossing.slip_mm = now.slip_mm - open.slip_before;
        let (a, b) = (open.last.floor_pressure, now.floor_pressure);
        // A floor that carries by jerks is left with the last lift-off and met with the
        // first touch-down.
        let event = if crossing.climbing {
            a > 0.0 && b <= 0.0
        } else {
            a <= 0.0 && b > 0.0 && !open.listed
        };
        if event {
            self.measure(&mut open, now);
        }
        if open.listed {
            if event && open.crossing.lift_s > 0.0 && !self.is_last(&open.crossing) {
                self.done.push(open.crossing);
            } else if let Some(line) = self.done.last_mut() {
                *line = open.crossing;
            }
        }
        open.last = *now;
        self.open = Some(open);
    }

    /// Whether the last line is of this very crossing.
    fn is_last(&self, crossing: &Crossing) -> bool {
        self.done.last().is_some_and(|line| line.touch_s == crossing.touch_s)
    }

    /// Gap, speed and preload at the instant the lower wall stops or begins to carry.
    fn measure(&self, open: &mut Open, now: &Moment) {
        let (a, b) = (open.last.floor_pressure, now.floor_pressure);
        let part = a / (a - b);
        let mix = |from: f64, to: f64| from + part * (to - from);
        let crossing = &mut open.crossing;
        let ahead = crossing.step_mm - mix(open.last.position_mm, now.position_mm);
        let height = mix(open.last.height_mm, now.height_mm) - now.base_mm;
        crossing.gap_mm = ahead.hypot(height) - self.radius_mm;
        crossing.lift_s = mix(open.last.time_s, now.time_s);
        crossing.speed_mm_s = 1.0 / open.slowness;
        crossing.preload_n = mix(open.last.preload_n, now.preload_n);
        open.listed = true;
    }

    fn begin(&self, now: &Moment) -> Option<Open> {
        let near = |(_, step): &(usize, &Step)| {
            let ahead = step.position_mm - now.position_mm;
            ahead > 0.0 && ahead < self.radius_mm
        };
        let (index, step) = self.steps.iter().enumerate().find(near)?;
        if now.corner_n <= 0.0 {
            return None;
        }
        // Carried by the lower wall as well: a climb begins. By the corner alone: the
        // wheel has just come back over the edge.
        let climbing = now.floor_pressure > 0.0;
        Some(Open {
            crossing: Crossing {
                index: index + 1,
                step_mm: step.position_mm,
                climbing,
                touch_s: now.time_s,
                ..Crossing::default()
            },
            slip_before: now.slip_mm,
            last: *now,
            slowness: 1.0 / now.speed_mm_s.abs().max(0.1),
            listed: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at a wheel 0.5 mm above its undeformed height: position, force of the
    /// corner, largest pressure on the lower wall.
    fn look(ledger: &mut Ledger, moments: &[(f64, f64, f64)]) {
        for &(position_mm, corner_n, floor_pressure) in moments {
            ledger.record(&Moment {
                // Distinct times, in the order of the looks.
                time_s: ledger.seen(),
                position_mm,
                height_mm: if position_mm >= 20.0 { 29.5 } else { 25.5 },
                base_mm: if position_mm >= 20.0 { 4.0 } else { 0.0 },
                speed_mm_s: 5.0,
                preload_n: 40.0,
                utilisation: 0.7,
                slip_mm: 0.0,
                corner_n,
                floor_pressure,
            });
        }
    }

    impl Ledger {
        fn seen(&self) -> f64 {
            self.open.map_or(0.0, |open| open.last.time_s) + 1.0
        }
    }

    fn ledger() -> Ledger {
        Ledger::new(vec![Step { position_mm: 20.0, height_mm: 4.0 }], 25.0)
    }

    #[test]
    fn a_climb_is_measured_where_the_lower_wall_lets_go() {
        let mut ledger = ledger();
        look(&mut ledger, &[(6.0, 0.0, 0.4), (7.0, 5.0, 0.3), (8.0, 9.0, 0.1), (8.5, 9.0, -0.1)]);
        let [crossing] = ledger.crossings() else { panic!("{ledger:?}") };
        // Half way between the last two looks.
        assert!((crossing.gap_mm - (11.75f64.hypot(25.5) - 25.0)).abs() < 1e-12);
        assert!(crossing.climbing && crossing.index == 1);
        look(&mut ledger, &[(15.0, 12.0, -0.2), (20.0, 0.0, 0.5)]);
        assert_eq!(ledger.crossings().len(), 1);
        assert_eq!(ledger.crossings()[0].corner_n, 12.0);
    }

    #[test]
    fn the_last_of_several_lift_offs_counts() {
        let mut ledger = ledger();
        look(&mut ledger, &[(7.0, 5.0, 0.3), (8.0, 9.0, -0.1), (8.1, 9.0, 0.1), (8.3, 9.0, -0.1)]);
        let [crossing] = ledger.crossings() else { panic!("{ledger:?}") };
        assert!((crossing.gap_mm - (11.8f64.hypot(25.5) - 25.0)).abs() < 1e-12);
    }

    #[test]
    fn a_wheel_that_slides_back_has_not_crossed() {
        let mut ledger = ledger();
        look(&mut ledger, &[(7.0, 5.0, 0.3), (8.0, 9.0, -0.1)]);
        assert_eq!(ledger.crossings().len(), 1);
        look(&mut ledger, &[(7.0, 5.0, 0.2), (6.0, 0.0, 0.4)]);
        assert!(ledger.crossings().is_empty());
        look(&mut ledger, &[(7.0, 5.0, 0.3), (8.0, 9.0, -0.1), (20.0, 0.0, 0.5)]);
        assert_eq!(ledger.crossings().len(), 1);
    }

    #[test]
    fn a_drop_is_measured_at_its_first_touch_down() {
        let mut ledger = ledger();
        look(&mut ledger, &[(20.5, 0.0, 0.4), (19.0, 30.0, -2.0), (9.0, 9.0, -0.1)]);
        look(&mut ledger, &[(8.5, 9.0, 0.1), (8.4, 9.0, -0.1), (8.0, 5.0, 0.2), (5.0, 0.0, 0.4)]);
        let [crossing] = ledger.crossings() else { panic!("{ledger:?}") };
        assert!(!crossing.climbing);
        assert!((crossing.gap_mm - (11.25f64.hypot(25.5) - 25.0)).abs() < 1e-12);
    }
}
