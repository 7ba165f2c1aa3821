//! Contact of wheel and wall: the ring near a step, steady rolling elsewhere, and the
//! radial balance of both.

use super::{PlantError, Stride, VirtualRig};
use crate::plant::balance::{Axial, Balance, BalanceError, Solved};
use crate::plant::ledger::Moment;
use crate::plant::ring::{Contact, Motion};
use crate::plant::rolling::{self, Rolling};
use crate::plant::wall::LocalWall;

/// Distance kept from corner and edge when the ring wakes, mm: more than the wheel sinks
/// or rolls in a stride.
const REACH_MM: f64 = 0.5;

/// Largest change of height in a stride that is predicted by the last contact, mm.
const PREDICTED_MM: f64 = 0.05;

/// Change of tread speed or radial force that ends steady rolling, relative and
/// absolute, mm/s and N.
const UNSTEADY_PART: f64 = 0.03;
const UNSTEADY_MM_S: f64 = 0.01;
const UNSTEADY_N: f64 = 1e-3;

/// Separation from the wall up to which an unpressed wheel is on it, mm.
const OFF_MM: f64 = 1e-6;

/// Relaxation times after which the tread has forgotten what came before; it knows
/// nothing from before it came into the patch.
const FORGETS: f64 = 6.0;

/// Speed and radial force of the wheel, and for how long they have been steady.
#[derive(Clone, Copy, Debug)]
pub(super) struct SettleTimer {
    pub(super) tread_mm_s: f64,
    pub(super) pressing_n: f64,
    pub(super) for_s: f64,
}

impl VirtualRig {
    /// Whether speed and radial force have been steady for long enough, away from any step,
    /// for steady rolling.
    pub(super) fn settled(&mut self, local: &LocalWall, dt_s: f64) -> bool {
        let tread = self.truth.tread_mm_s;
        let (seat, added) = self.pressing(local);
        let pressing = (seat + added).max(0.0);
        let near = self.near_step(local);
        let settle_timer = &mut self.settle_timer;
        let most = UNSTEADY_PART * settle_timer.tread_mm_s.abs() + UNSTEADY_MM_S;
        let same = (tread - settle_timer.tread_mm_s).abs() <= most
            && (pressing - settle_timer.pressing_n).abs()
                <= UNSTEADY_PART * settle_timer.pressing_n + UNSTEADY_N;
        // Nor does a wheel roll that is off the wall.
        if same && !near && self.truth.separation_mm < OFF_MM {
            settle_timer.for_s += dt_s;
        } else {
            *settle_timer = SettleTimer { tread_mm_s: tread, pressing_n: pressing, for_s: 0.0 };
        }
        let for_s = settle_timer.for_s;
        // What is now under the wheel came in since.
        let patch = self.patch_mm(self.truth.height_mm - self.base_mm);
        for_s > FORGETS * self.parameters.ring.relaxations_s()[1]
            || for_s * tread.abs() > 2.0 * patch
    }

    /// Force of screw and spring at the undeformed radius over this wall, N, and what arm
    /// modes and thrust, through the arm, add to it. What the carriage's inertia would add is
    /// left out: with it, the arm's swing would have to carry the carriage along as the wheel
    /// rises.
    fn pressing(&self, local: &LocalWall) -> (f64, f64) {
        let base = local.base_mm - self.eccentric().1;
        let seat = self.preload.seat_n() + self.parameters.spring_n_per_mm * base;
        let arm = self.thrust_ratio() * self.thrust_n + self.pivot.force_n();
        let added = arm - self.vibration_n - self.hung_n;
        if !self.blocked {
            return (seat, added);
        }
        // A block bears all.
        let lift = self.truth.height_mm - local.base_mm - self.parameters.ring.radius_mm;
        (seat, -(seat + self.parameters.spring_n_per_mm * lift).max(0.0))
    }

    /// Radial balance over this wall.
    fn balance(&self, local: &LocalWall, axial: Axial) -> Balance {
        let (preload_n, arm_n) = self.pressing(local);
        Balance { preload_n, spring_n_per_mm: self.parameters.spring_n_per_mm, arm_n, axial }
    }

    /// Whether the wheel all but touches a step, or an edge all but lies under its patch.
    pub(super) fn near_step(&self, local: &LocalWall) -> bool {
        let reach = self.parameters.ring.radius_mm + REACH_MM;
        let height = self.truth.height_mm - local.base_mm;
        let over = height - local.rise_mm;
        let (ahead, behind) = (local.ahead_mm, local.behind_mm - REACH_MM);
        // By the corner, or by the face where the centre is lower than that.
        let corner = if over > 0.0 { over * over } else { 0.0 };
        ahead * ahead + corner < reach * reach || behind < self.patch_mm(height)
    }

    /// Half the length of the patch at this height above the wall, mm.
    pub(super) fn patch_mm(&self, height_mm: f64) -> f64 {
        let radius = self.parameters.ring.radius_mm;
        (radius * radius - height_mm * height_mm).max(0.0).sqrt()
    }

    /// Brings the ring into the state of steady rolling.
    pub(super) fn wake(&mut self, position_mm: f64) {
        let local = self.parameters.wall.local(position_mm);
        let height = self.truth.height_mm - local.base_mm;
        let table = rolling::profile(&self.parameters.ring, height, self.rolled_mm_s);
        // The ring starts its turns afresh; only the angle to the wall matters.
        let interpolate = |angle: f64| {
            let at = table.partition_point(|node| node.0 < angle);
            match (at.checked_sub(1).and_then(|i| table.get(i)), table.get(at)) {
                (Some(a), Some(b)) => {
                    let part = (angle - a.0) / (b.0 - a.0);
                    let between = |a: f64, b: f64| a + part * (b - a);
                    let memory = [0, 1].map(|i| between(a.2[i], b.2[i]));
                    (between(a.1, b.1), memory)
                }
                _ => (0.0, [0.0; 2]),
            }
        };
        let within = table.last().map_or(0.0, |node| node.0);
        self.ring.seed(self.truth.time_s, within, interpolate);
        self.awake = true;
    }

    /// Radial balance with the ring resolved.
    pub(super) fn resolve(
        &mut self,
        local: &LocalWall,
        stride: Stride,
        finer: bool,
    ) -> Result<bool, PlantError> {
        let Stride { travel_mm, turn_rad, dt_s, .. } = stride;
        // Predicted: the rise by the travel, and by the new load with the last contact's
        // stiffness.
        let settled_mm = self.load_response(local, &stride);
        let balance = self.balance(local, stride.axial());
        let current = self.truth.height_mm - local.base_mm;
        let pressed = balance.pressed(current - self.parameters.ring.radius_mm).0 > 0.0;
        let predicted = current + self.drift * travel_mm + self.creep * dt_s + settled_mm;
        let height_mm = if pressed { predicted } else { current };
        let motion = Motion { wall: *local, height_mm, turn_rad, dt_s };
        let solved = balance.solve_near(&mut self.ring, motion);
        let solved = solved.map_err(|source| self.unbalanced(source))?;
        if finer && self.off_prediction(&stride, &solved) {
            return Ok(false);
        }
        self.ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        let rise = solved.height_mm + local.base_mm - self.truth.height_mm;
        self.learn_rise(&solved.contact, travel_mm, rise);
        if travel_mm.abs() > 1e-6 {
            (self.drift, self.creep) = ((rise - settled_mm) / travel_mm, 0.0);
        } else {
            (self.drift, self.creep) = (0.0, (rise - settled_mm) / dt_s);
        }
        self.stiffness = Some(solved.contact.slope);
        self.adopt(local, &solved, &stride);
        self.truth.ring_awake = true;
        self.truth.preload_n = self.preload_now();
        self.ledger.record(&Moment {
            time_s: self.truth.time_s,
            position_mm: self.truth.position_mm + self.eccentric().0,
            height_mm: self.truth.height_mm,
            base_mm: local.base_mm + local.root_mm,
            speed_mm_s: self.truth.speed_mm_s,
            preload_n: self.truth.preload_n,
            utilisation: self.truth.utilisation,
            slip_mm: self.truth.slip_mm,
            corner_n: self.truth.corner_n,
            floor_pressure: solved.contact.floor_pressure,
        });
        Ok(true)
    }

    /// Change of the height, mm, by which the last contact would carry the present load.
    fn load_response(&self, local: &LocalWall, stride: &Stride) -> f64 {
        let Some(slopes) = self.stiffness else { return 0.0 };
        let (_, cosine, sine) = self.forces;
        let lift = self.truth.height_mm - local.base_mm - self.parameters.ring.radius_mm;
        // A gripping wheel carries about the load.
        let axial = match stride.axial() {
            Axial::Carried(grip) if !self.sliding => Axial::Driven(grip.load_n),
            axial => axial,
        };
        let (residual, slope, _) =
            self.balance(local, axial).residual((cosine, sine), slopes, lift);
        let change = -residual / slope;
        if change.abs() < PREDICTED_MM { change } else { 0.0 }
    }

    /// Radial balance of steady rolling on the continuous wall.
    pub(super) fn roll_steadily(
        &mut self,
        local: &LocalWall,
        stride: Stride,
        finer: bool,
    ) -> Result<bool, PlantError> {
        let guess = self.truth.height_mm - self.base_mm + self.load_response(local, &stride);
        let speed = stride.tread_mm_s;
        let solved = self.roll_balanced(local, stride.axial(), speed, guess);
        let solved = solved.map_err(|source| self.unbalanced(source))?;
        if finer && self.off_prediction(&stride, &solved) {
            return Ok(false);
        }
        self.rolled_mm_s = speed;
        (self.drift, self.creep, self.tread_intake) = (0.0, 0.0, 0.0);
        self.stiffness = Some(solved.contact.slope);
        self.adopt(local, &solved, &stride);
        self.truth.ring_awake = false;
        Ok(true)
    }

    /// Brings a wheel on the continuous wall to the height of steady rolling at its speed; one
    /// that nothing carries there stays where it is.
    pub(super) fn roll_on(&mut self) {
        let local = self.parameters.wall.local(self.truth.position_mm + self.eccentric().0);
        let (load, guess) = (Axial::Driven(self.thrust_n), self.truth.height_mm - local.base_mm);
        if let Ok(solved) = self.roll_balanced(&local, load, self.truth.tread_mm_s, guess) {
            self.truth.height_mm = solved.height_mm + local.base_mm;
            self.truth.depth_mm = solved.contact.depth_mm;
            let contact = &solved.contact;
            self.forces = (contact.normal_n, contact.cosine_n, contact.sine_n);
            self.contact_mm = contact.area_mm2 / self.parameters.ring.width_mm;
            self.wind_steadily();
        }
    }

    fn roll_balanced(
        &mut self,
        local: &LocalWall,
        axial: Axial,
        speed_mm_s: f64,
        guess_mm: f64,
    ) -> Result<Solved, BalanceError> {
        let ring = self.parameters.ring;
        let balance = self.balance(local, axial);
        let residual = |c: &Rolling| {
            let lift = c.height_mm - ring.radius_mm;
            balance.residual(local.tilt((c.cosine_n, c.sine_n)), local.tilt(slopes(c)), lift)
        };
        let rolling = self.steady.solve(&ring, speed_mm_s, guess_mm, |c| {
            let (force, slope, _) = residual(c);
            (force, slope)
        });
        let (residual_n, _, utilisation) = residual(&rolling);
        let height_mm = rolling.height_mm;
        let preload_n = balance.preload_n + balance.arm_n;
        if residual_n.abs() > 1e-3 * preload_n.max(1.0) {
            return Err(BalanceError { preload_n, residual_n, height_mm });
        }
        let (cosine_n, sine_n) = local.tilt((rolling.cosine_n, rolling.sine_n));
        let contact = Contact {
            normal_n: rolling.normal_n,
            cosine_n,
            sine_n,
            floor_n: cosine_n,
            depth_mm: ring.radius_mm - height_mm,
            area_mm2: rolling.area_mm2,
            slope: local.tilt(slopes(&rolling)),
            ..Contact::default()
        };
        Ok(Solved { height_mm, contact, utilisation })
    }

    fn unbalanced(&self, source: BalanceError) -> PlantError {
        PlantError::Balance {
            time_s: self.truth.time_s,
            position_mm: self.truth.position_mm,
            source,
        }
    }

    fn adopt(&mut self, local: &LocalWall, solved: &Solved, stride: &Stride) {
        let contact = &solved.contact;
        self.base_mm = local.base_mm;
        let height_mm = solved.height_mm + local.base_mm;
        self.pivot.follow(height_mm - self.truth.height_mm);
        self.truth.height_mm = height_mm;
        self.truth.depth_mm = contact.depth_mm.max(0.0);
        self.truth.corner_n = contact.step_force_n();
        self.truth.floor_n = contact.floor_n;
        self.truth.resistance_n = contact.sine_n - contact.step_sine_n;
        self.truth.utilisation = solved.utilisation;
        self.truth.separation_mm = if contact.depth_mm > 0.0 {
            0.0
        } else {
            (solved.height_mm - self.parameters.ring.radius_mm).max(0.0)
        };
        self.forces = (contact.normal_n, contact.cosine_n, contact.sine_n);
        if contact.area_mm2 > 0.0 {
            self.contact_mm = contact.area_mm2 / self.parameters.ring.width_mm;
        }
        let lift = solved.height_mm - self.parameters.ring.radius_mm;
        let (seat, added) = self.pressing(local);
        let spring = (seat + self.parameters.spring_n_per_mm * lift).max(0.0);
        let carried = contact.cosine_n + solved.utilisation * contact.sine_n;
        self.truth.unbalanced_n = carried - (spring + added).max(0.0);
        self.complete(stride);
    }
}

/// Derivatives of the cosine and sine sums of steady rolling by the height, N/mm.
fn slopes(rolling: &Rolling) -> (f64, f64) {
    (rolling.slope, rolling.slope * rolling.sine_n / rolling.cosine_n.max(1e-9))
}
