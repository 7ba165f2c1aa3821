//! The tread gives way along the wall: under traction it winds up against the hub, and rolling it
//! creeps. That is travel of the wheel that moves no axle.
//!
//! Traction F displaces the rim against the hub by w: `F = k (w + (s - 1) (w - q))`, the
//! three-parameter solid of the tread with the memory q. Rolling brings unstrained rubber into the
//! contact: the memory is lost over half its length. Creep is Carter's (1926),
//! `2 / (1 + sqrt(1 - p))` times the one of little traction, with the part p of friction used.

use super::tread::Contact;
use crate::numeric::{between, checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, Newtons, Q16, Ratio, Seconds, Travel, q16};

/// Part of friction beyond which the wheel is about to slip.
const MOST: Ratio = q16(990_000);
/// Logarithm of the ticks over which what gives way is spread: a corner that is felt late would jolt
/// the drive.
const SMOOTH: u32 = 4;
const SMOOTHER: u32 = 6;
/// Length of a contact over the chord of the wall through the undeformed wheel: 1 of a row of elements,
/// 0.6 of a bonded layer.
pub const CONTACT: Ratio = q16(800_000);

/// Rubber between rim and hub. The default is a place to read one into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Shear {
    /// Displacement of the relaxed tread per traction, mm/N.
    compliance: Q16,
    /// Instant over relaxed stiffness, less 1.
    pub(crate) stiffens: Ratio,
    /// Reciprocal of the relaxation time, 1/s.
    per_tau: Q16,
    /// Relaxation length over the length of the contact.
    relaxation_lengths: Ratio,
    friction: Ratio,
}

/// What pulls at a tread while it rolls.
#[derive(Clone, Copy, Debug)]
pub struct Pull {
    /// Traction outwards, and the normal force of the contact, N.
    pub traction: Newtons,
    /// See `traction`.
    pub normal: Newtons,
    /// Length of the contact, and travel of the rim, mm.
    pub contact: Millimetres,
    /// See `contact`.
    pub rolled: Millimetres,
    /// Compression by the wall below an edge, and half the length of its contact, mm.
    pub floor: Millimetres,
    /// See `floor`.
    pub patch: Millimetres,
    /// Duration, s.
    pub duration: Seconds,
}

/// Displacement of the rim against the hub.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Winding {
    /// Outwards, mm.
    pub displaced: Millimetres,
    memory: Millimetres,
    /// What the tread remembers of its compression by the lower wall where it leaves that, and over
    /// all of the patch, mm.
    pub floor: Millimetres,
    /// See `floor`.
    pub sunk: Millimetres,
}

/// What gives way, spread over so much time that a drive which makes up for it does not jolt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Travel of the tread that moved no axle, outwards.
    pub gave: Travel,
    /// What a tick adds to it, smooth enough for the drive.
    pub gives: Travel,
    /// The sum of that.
    held: Travel,
    /// What is not in `gave` yet.
    pub owes: Travel,
    /// The drive makes up for no more of it.
    pub stops: bool,
}

impl Shear {
    /// The tread of a rig; fails where a parameter is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let shear = rig.shear();
        let key = "tread.thickness_mm";
        Ok(Self {
            compliance: checked(key, 1.0 / shear.n_per_mm)?,
            stiffens: checked("tread.stiffening", rig.tread.stiffening - 1.0)?,
            per_tau: checked("tread.tau_s", 1.0 / rig.tread.tau_s)?,
            relaxation_lengths: checked(key, shear.relaxation_lengths)?,
            friction: checked("plant.mu", rig.plant.mu)?,
        })
    }

    /// Part of a compression that is remembered at which a wall lets go of the tread: `(s - 1) / s`.
    pub fn short(&self) -> Ratio {
        divide(self.stiffens, Ratio::ONE + self.stiffens)
    }

    /// A tread that has relaxed under this load, N.
    pub fn rest(&self, load: Newtons) -> Winding {
        let displaced = load * self.compliance;
        Winding { displaced, memory: displaced, ..Winding::default() }
    }

    /// Rolls on by a stride of a tread that was rolled out, as far as it gives way outwards, mm.
    pub fn follow(
        &self,
        state: &mut Winding,
        contact: &Contact,
        stride: (Millimetres, Seconds),
    ) -> Millimetres {
        let leans = divide(contact.axial, contact.radial.max(Newtons::ONE));
        let normal = contact.radial * sqrt(Ratio::ONE + leans * leans);
        let pull = Pull {
            traction: contact.utilisation * normal,
            normal,
            contact: stride.0 * Q16::from_num(contact.visits.max(1)) * CONTACT,
            rolled: stride.0,
            floor: Q16::ZERO,
            patch: Q16::ZERO,
            duration: stride.1,
        };
        let [creeps, winds] = self.roll(state, &pull);
        creeps + winds
    }

    /// Rolls on under a pull; by how much the tread creeps, and by how much it winds up, mm.
    pub fn roll(&self, state: &mut Winding, pull: &Pull) -> [Millimetres; 2] {
        let part = divide(pull.traction, self.friction * pull.normal.max(Newtons::ONE));
        let part = between(part, Q16::ZERO, MOST);
        let rolls = divide(pull.rolled, pull.contact);
        let (relaxes, renewed) = (pull.duration * self.per_tau, rolls + rolls);
        let keeps = divide(Ratio::ONE, Ratio::ONE + relaxes + renewed);
        let (follows, kept) = (relaxes * keeps, state.memory * keeps);
        let pulls = pull.traction * self.compliance;
        let stiffer = Ratio::ONE + self.stiffens * (Ratio::ONE - follows);
        let displaced = divide(pulls + self.stiffens * kept, stiffer);
        let unrelaxed = divide(renewed, (renewed + relaxes).max(Q16::DELTA));
        let rolling = Ratio::ONE + self.stiffens * unrelaxed;
        let carter = Ratio::ONE + sqrt(Ratio::ONE - part);
        let creeps = divide(pulls * renewed, self.relaxation_lengths * rolling * carter);
        let winds = displaced - state.displaced;
        (state.displaced, state.memory) = (displaced, follows * displaced + kept);
        // Of the floor, by its own patch.
        let passes = divide(pull.rolled, (pull.patch * CONTACT).max(pull.rolled));
        let floor = relaxes * pull.floor + state.floor;
        state.floor = divide(floor, Ratio::ONE + relaxes + passes);
        [creeps, winds]
    }

    /// How far ahead of the centre of a wheel that has rolled so far for so long its wall carries, mm: the
    /// lever of the rolling resistance on a contact with this half. Where the tread relaxes within D of
    /// that half it is `(s - 1) D / (1 + (1 + s) D + 2.5 s D^2)` of it: exact for little D and much, a tenth
    /// off between (test).
    pub fn drag(&self, rolled: Millimetres, half: Millimetres, duration: Seconds) -> Millimetres {
        let relaxes = half * (duration * self.per_tau);
        let part = divide(rolled.abs(), relaxes.max(Q16::DELTA)).min(q16(20_000_000));
        let s = Ratio::ONE + self.stiffens;
        let below = Ratio::ONE + part * (Ratio::ONE + s + s * part * q16(2_500_000));
        let drag = half * divide(self.stiffens * part, below);
        if rolled < Q16::ZERO { -drag } else { drag }
    }

    /// Sinks on under a pull.
    pub fn sink(&self, state: &mut Winding, pull: &Pull) {
        let relaxes = pull.duration * self.per_tau;
        // The half of a patch that sinks in leads its memory by about as much as the other half lags:
        // what is left is of the second order in the travel of a relaxation over half the patch.
        let passes = divide(pull.rolled, pull.patch.max(pull.rolled));
        let renewed = passes * divide(passes, relaxes.max(Q16::DELTA)).min(Ratio::ONE);
        state.sunk = divide(relaxes * pull.floor + state.sunk, Ratio::ONE + relaxes + renewed);
    }
}

impl Spread {
    /// A tick.
    pub fn step(&mut self) {
        let gives = self.eases();
        self.gave = self.gave.saturating_add(gives);
        self.held = self.held.saturating_add(self.gives);
    }

    /// A tick of which the sums are not asked for; what gives way in it.
    pub fn eases(&mut self) -> Travel {
        let gives = self.owes >> SMOOTH;
        self.owes -= gives;
        let (asked, smooth) = if self.stops { (Travel::ZERO, SMOOTH) } else { (gives, SMOOTHER) };
        self.gives += (asked - self.gives) >> smooth;
        gives
    }

    /// By how much more it has given way than the drive makes up for, mm.
    pub fn lags(&self) -> Travel {
        self.gave.saturating_sub(self.held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lever of the resistance over half the contact, of elements that relax within D of it, by their sum.
    fn drag_by_elements(part: f64, stiffens: f64) -> f64 {
        let (mut force, mut moment) = (0.0, 0.0);
        for n in 0..2000 {
            let x = (f64::from(n) + 0.5) / 1000.0;
            let left = 1.0 - (-x / part).exp();
            let lags = part * ((1.0 + part) * left - x);
            let pressure = (x - 0.5 * x * x + stiffens * lags).max(0.0);
            force += pressure;
            moment += pressure * (1.0 - x);
        }
        moment / force
    }

    #[test]
    fn rolling_resistance_is_that_of_the_elements_within_a_tenth() {
        for stiffening in [1.5, 2.0, 4.2235, 8.0] {
            let mut rig = Rig::prototype();
            rig.tread.stiffening = stiffening;
            let shear = Shear::try_build(&rig).unwrap();
            for part in [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 2.0, 10.0] {
                let rolled = Q16::from_num(5.0 * part * 8e-3 / rig.tread.tau_s);
                let drag = shear.drag(rolled, Q16::from_num(5), q16(8_000)).to_num::<f64>() / 5.0;
                assert_eq!(
                    shear.drag(-rolled, Q16::from_num(5), q16(8_000)).to_num::<f64>(),
                    -5.0 * drag
                );
                let exact = drag_by_elements(part, stiffening - 1.0);
                assert!((drag / exact - 1.0).abs() < 0.13, "{stiffening} {part}: {drag} {exact}");
            }
        }
    }

    #[test]
    fn a_patch_that_rolls_lags_in_the_second_order() {
        let (shear, tau_s) =
            (Shear::try_build(&Rig::prototype()).unwrap(), Rig::prototype().tread.tau_s);
        for speed in [0.0, 8.0, 20.0, 40.0] {
            let mut winding = Winding::default();
            let pull = Pull {
                traction: Q16::ZERO,
                normal: q16(30_000_000),
                contact: q16(8_000_000),
                rolled: Q16::from_num(0.008 * speed),
                floor: Q16::ONE,
                patch: q16(5_000_000),
                duration: q16(8_000),
            };
            for _ in 0..1000 {
                shear.sink(&mut winding, &pull);
            }
            let lag = speed * tau_s / 5.0;
            let (sunk, exact) = (winding.sunk.to_num::<f64>(), 1.0 / (1.0 + lag * lag));
            assert!((sunk - exact).abs() < 0.01, "{speed}: {sunk} {exact}");
        }
    }
}
