//! How wheel and wall bear on each other: the ring near a step, steady rolling
//! elsewhere, and the radial balance of both.

use super::traction::JAMMED_BELOW;
use super::{PlantError, VirtualRig};
use crate::plant::balance::{Axial, Balance, BalanceError, Solved};
use crate::plant::ledger::Moment;
use crate::plant::ring::{Contact, Motion};
use crate::plant::rolling::{self, Rolling};
use crate::plant::wall::LocalWall;

/// Distance kept from corner and edge when the ring wakes, mm: more than the wheel sinks
/// or rolls in a stride.
const REACH_MM: f64 = 0.5;

/// Largest change of height in a stride that is foreseen by the last contact, mm.
const FORESEEN_MM: f64 = 0.05;

/// Change of tread speed or radial force that ends steady rolling, relative and
/// absolute, mm/s and N.
const UNSTEADY_PART: f64 = 0.03;
const UNSTEADY_MM_S: f64 = 0.01;
const UNSTEADY_N: f64 = 1e-3;

/// Relaxation times after which the tread has forgotten what came before; it knows
/// nothing from before it came into the patch.
const FORGETS: f64 = 6.0;

/// What the wheel has been rolling at, and for how long.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calm {
    pub(super) tread_mm_s: f64,
    pub(super) pressing_n: f64,
    pub(super) for_s: f64,
}

impl VirtualRig {
    /// Whether speed and radial force have stood long enough, and away from any step, for
    /// steady rolling.
    pub(super) fn settled(&mut self, local: &LocalWall, axial: Axial, dt_s: f64) -> bool {
        let (tread, pressing) = (self.truth.tread_mm_s, self.balance(local, axial).preload_n);
        let near = self.near_step(local);
        let calm = &mut self.calm;
        let most = UNSTEADY_PART * calm.tread_mm_s.abs() + UNSTEADY_MM_S;
        let same = (tread - calm.tread_mm_s).abs() <= most
            && (pressing - calm.pressing_n).abs() <= UNSTEADY_PART * calm.pressing_n + UNSTEADY_N;
        if same && !near {
            calm.for_s += dt_s;
        } else {
            *calm = Calm { tread_mm_s: tread, pressing_n: pressing, for_s: 0.0 };
        }
        let for_s = calm.for_s;
        // What is now under the wheel came in since.
        let patch = self.patch_mm(self.truth.height_mm - self.base_mm);
        for_s > FORGETS * self.parameters.ring.tau_s || for_s * tread.abs() > 2.0 * patch
    }

    /// Radial balance over this wall: screw, spring, arm modes, and the wedge of a
    /// gripping wheel's thrust.
    fn balance(&self, local: &LocalWall, axial: Axial) -> Balance {
        let seat = self.preload.seat_n() + self.parameters.spring_n_per_mm * local.base_mm;
        let thrust = match axial {
            Axial::Driven(load) => load,
            _ => 0.0,
        };
        Balance {
            preload_n: (seat + self.wedge() * thrust - self.vibration_n).max(0.0),
            spring_n_per_mm: self.parameters.spring_n_per_mm,
            axial,
        }
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
                    (a.1 + part * (b.1 - a.1), a.2 + part * (b.2 - a.2))
                }
                _ => (0.0, 0.0),
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
        axial: Axial,
        turn: f64,
        dt_s: f64,
    ) -> Result<(), PlantError> {
        let way = self.truth.speed_mm_s * dt_s;
        // Foreseen: what the way has brought, and what the new load brings by the last
        // contact's stiffness.
        let sunk = self.sinks(local, axial);
        let motion = Motion {
            wall: *local,
            height_mm: self.truth.height_mm - local.base_mm
                + self.drift * way
                + self.creep * dt_s
                + sunk,
            turn_rad: turn,
            dt_s,
        };
        let solved =
            self.bear(axial, |rig, axial| rig.balance(local, axial).solve(&mut rig.ring, motion))?;
        self.ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        let rise = solved.height_mm + local.base_mm - self.truth.height_mm;
        if way.abs() > 1e-6 {
            self.slope = rise / way;
            (self.drift, self.creep) = ((rise - sunk) / way, 0.0);
        } else {
            (self.drift, self.creep) = (0.0, (rise - sunk) / dt_s);
        }
        self.stiffness = Some(solved.contact.slope);
        self.take(local, &solved);
        self.truth.ring_awake = true;
        self.truth.preload_n = self.preload_now();
        self.ledger.record(&Moment {
            time_s: self.truth.time_s,
            position_mm: self.truth.position_mm,
            height_mm: self.truth.height_mm,
            base_mm: local.base_mm,
            speed_mm_s: self.truth.speed_mm_s,
            preload_n: self.truth.preload_n,
            utilisation: self.truth.utilisation,
            slip_mm: self.truth.slip_mm,
            corner_n: self.truth.corner_n,
            floor_pressure: solved.contact.floor_pressure,
        });
        Ok(())
    }

    /// Change of the height, mm, by which the last contact would carry the present load.
    fn sinks(&self, local: &LocalWall, axial: Axial) -> f64 {
        let Some(slopes) = self.stiffness else { return 0.0 };
        let (_, cosine, sine) = self.forces;
        let lift = self.truth.height_mm - local.base_mm - self.parameters.ring.radius_mm;
        let (residual, slope, _) =
            self.balance(local, axial).residual((cosine, sine), slopes, lift);
        let change = -residual / slope;
        if change.abs() < FORESEEN_MM { change } else { 0.0 }
    }

    /// Radial balance of steady rolling on the continuous wall.
    pub(super) fn roll_steadily(
        &mut self,
        local: &LocalWall,
        axial: Axial,
    ) -> Result<(), PlantError> {
        let guess = self.truth.height_mm - self.base_mm + self.sinks(local, axial);
        let solved = self.bear(axial, |rig, axial| rig.roll_balanced(local, axial, guess))?;
        self.rolled_mm_s = self.truth.tread_mm_s;
        (self.slope, self.drift, self.creep) = (0.0, 0.0, 0.0);
        self.stiffness = Some(solved.contact.slope);
        self.take(local, &solved);
        self.truth.ring_awake = false;
        Ok(())
    }

    fn roll_balanced(
        &mut self,
        local: &LocalWall,
        axial: Axial,
        guess_mm: f64,
    ) -> Result<Solved, BalanceError> {
        let ring = self.parameters.ring;
        let balance = self.balance(local, axial);
        let residual = |c: &Rolling| {
            let lift = c.height_mm - ring.radius_mm;
            balance.residual((c.cosine_n, c.sine_n), (0.0, 0.0), lift)
        };
        let speed = self.truth.tread_mm_s;
        let spring = -balance.spring_n_per_mm;
        let rolling = self.steady.solve(&ring, speed, guess_mm, spring, |c| residual(c).0);
        let (residual_n, _, utilisation) = residual(&rolling);
        let height_mm = rolling.height_mm;
        if residual_n.abs() > 1e-3 * balance.preload_n.max(1.0) {
            let preload_n = balance.preload_n;
            return Err(BalanceError { preload_n, residual_n, height_mm });
        }
        let contact = Contact {
            normal_n: rolling.normal_n,
            cosine_n: rolling.cosine_n,
            sine_n: rolling.sine_n,
            floor_n: rolling.cosine_n,
            depth_mm: ring.radius_mm - height_mm,
            area_mm2: rolling.area_mm2,
            slope: (rolling.slope, rolling.slope * rolling.sine_n / rolling.cosine_n.max(1e-9)),
            ..Contact::default()
        };
        Ok(Solved { height_mm, contact, utilisation })
    }

    /// Solves with the friction asked for, or with what is possible: no more than there
    /// is, none where the arm would jam a sliding wheel.
    fn bear(
        &mut self,
        axial: Axial,
        solve: impl Fn(&mut Self, Axial) -> Result<Solved, BalanceError>,
    ) -> Result<Solved, PlantError> {
        let mu = self.parameters.mu;
        let slides = |rig: &mut Self, sense: f64| {
            let axial = Axial::Wedged { utilisation: mu.copysign(sense), wedge: rig.wedge() };
            solve(rig, axial).ok().filter(|solved| {
                let c = &solved.contact;
                let forces = (c.normal_n, c.cosine_n, c.sine_n);
                rig.freedom(mu.copysign(sense), forces) >= JAMMED_BELOW
            })
        };
        let jammed =
            |solved: Solved| Solved { utilisation: solved.utilisation.clamp(-mu, mu), ..solved };
        let solved = match axial {
            Axial::Driven(load) => match solve(self, axial) {
                Ok(solved) if solved.utilisation.abs() <= mu => Ok(solved),
                Ok(solved) => Ok(slides(self, solved.utilisation).unwrap_or(jammed(solved))),
                Err(error) => slides(self, load).ok_or(error),
            },
            Axial::Wedged { utilisation, .. } => match slides(self, utilisation) {
                Some(solved) => Ok(solved),
                None => {
                    self.sliding = false;
                    solve(self, Axial::Driven(self.parameters.load_n)).map(jammed)
                }
            },
            Axial::Pushed | Axial::Utilised(_) => solve(self, axial),
        };
        // Hardly pressed, a wheel on a corner may find no balance with any friction.
        solved.or_else(|_| solve(self, Axial::Utilised(0.0))).map_err(|source| {
            PlantError::Balance {
                time_s: self.truth.time_s,
                position_mm: self.truth.position_mm,
                source,
            }
        })
    }

    fn take(&mut self, local: &LocalWall, solved: &Solved) {
        let contact = &solved.contact;
        self.base_mm = local.base_mm;
        self.truth.height_mm = solved.height_mm + local.base_mm;
        self.truth.depth_mm = contact.depth_mm.max(0.0);
        self.truth.corner_n = contact.step_force_n();
        self.truth.floor_n = contact.floor_n;
        self.truth.utilisation = solved.utilisation;
        self.truth.separation_mm = if contact.depth_mm > 0.0 {
            0.0
        } else {
            (solved.height_mm - self.parameters.ring.radius_mm).max(0.0)
        };
        self.forces = (contact.normal_n, contact.cosine_n, contact.sine_n);
    }
}
