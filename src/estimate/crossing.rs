//! Detects a step by what it does to arm and tread, and measures the gap.
//!
//! On the continuous wall the wheel centre's radius less the tread's compression is constant:
//! the baseline. A corner that carries lifts the wheel off it. The lower wall stops carrying
//! when the centre is y above it: the undeformed radius R on retract, on deploy less by what
//! the tread's memory keeps of its compression. Then the compression c, the corner's depth,
//! gives the gap without odometry: `gap = sqrt((R-c)^2 + y^2 - (y-h)^2) - R`.

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod measure;

pub use self::measure::Measured;
use self::measure::is_clear;
use crate::numeric::{LowPass, LowPassState, between, divide, sqrt};
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, Travel, q16};

/// Rise above which the baseline is held, mm: two steps of the angle code.
const HOLD: Millimetres = q16(80_000);
/// Rise above the baseline that counts as a corner, mm: four steps of the angle code.
const TOUCH: Millimetres = q16(160_000);
/// Dip below the wall at which an edge left behind shows its place, mm: nearer to it the
/// distance is not seen in the height.
const DIP: Millimetres = q16(1_000_000);
/// Ticks that it must last.
const TOUCH_TICKS: u8 = 3;
/// Travel from one sample of the baseline to the next, mm: a wall is averaged over a hundred, 6 mm,
/// against the 2.8 mm in which a wheel sinks by [`TOUCH`] off an edge, however slow it is.
const SAMPLE: Travel = q16(60_000).widen();
/// Rise below which a corner is taken for a false alarm, mm.
const RELEASE: Millimetres = q16(60_000);
/// Ticks that this must last.
const RELEASE_TICKS: u8 = 60;
/// Short of the full step height, the wheel counts as over the corner, mm.
const OVER: Millimetres = q16(400_000);
/// Rise above the wall expected behind a step that counts as the next corner where one is
/// expected, mm: a touch, on a wall known to the angle code's steps. Elsewhere the step behind
/// may be higher than its table.
const AGAIN: Millimetres = q16(320_000);
/// Largest deviation of a step's height from its table, mm: a quarter of the published step. More
/// shows that the wall was not yet reached.
pub const HEIGHT_MOST: Millimetres = q16(1_000_000);
/// Falls of a retracting wheel at which its compression is kept, over the range of heights.
const FALLS: usize = 32;
/// Reciprocal of their distance, 1/mm.
const PER_FALL: Q16 = q16(16_000_000);
/// Ticks over which the new wall's baseline is averaged.
const SETTLE_TICKS: u8 = 50;

/// Geometry of the measurement.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CrossingWatch {
    pub(super) radius: Millimetres,
    step: Millimetres,
    /// Baseline of the outermost wall by the table, mm.
    outermost: Millimetres,
    baseline: LowPass,
    settle: LowPass,
}

/// What carries the wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// The continuous wall.
    #[default]
    Wall,
    /// Lower wall and corner.
    Both,
    /// The corner alone.
    Corner,
    /// The next wall, the corner being left; its baseline is not known yet.
    Leaving,
}

/// State of the watch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WatchState {
    /// What carries.
    pub contact: Contact,
    /// Radius less compression on the wall, mm.
    baseline: LowPassState,
    /// Travel at its last sample; off the wall that since which the ground is flat.
    sampled: Travel,
    /// That ground, mm.
    level: Millimetres,
    /// The same on the next wall.
    next: LowPassState,
    ticks: u8,
    /// Ticks for which the next corner has touched while leaving the last.
    again: u8,
    /// Largest compression of the crossing, mm.
    pub deepest: Millimetres,
    /// Largest compression to 3/2 over the load so far, and the part of it that an edge has lost.
    edge: Q16,
    pub(super) eased: Ratio,
    lift: Option<Lift>,
    /// Compression as the wheel first sank so far; 0 where it has not.
    depths: [Millimetres; FALLS],
}

/// The instant at which the lower wall stops (retract: begins) to carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// Tread depth at the corner, mm.
    pub depth: Millimetres,
    /// Height of the centre above the lower wall, mm.
    pub height: Millimetres,
    /// Gap, mm.
    pub gap: Millimetres,
    /// Axial distance between wheel centre and face, mm.
    pub distance: Millimetres,
}

/// What the watch noticed in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CrossingEvent {
    /// The corner carries.
    Touched,
    /// What looked like a corner is gone.
    Released,
    /// The lower wall stopped (retract: began) to carry.
    Lifted(Lift),
    /// The wheel has left the corner for the next wall.
    Passed,
    /// The next wall's baseline is known.
    GapClosed(Measured),
    /// The next corner carries before the wall between was measured; the gap of the
    /// last one with the nominal height, mm.
    Retouched {
        /// Gap.
        gap_as_table: Millimetres,
    },
}

/// What a tick shows, if anything.
type Noticed = Option<CrossingEvent>;

/// Direction, sensor values, and how far the wheel is off its baseline, mm.
type Risen<'a> = (Direction, &'a WatchInput, Millimetres);

/// Sensor values of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchInput {
    /// Wheel centre's distance from the pillar axis by its low-pass, mm.
    pub radius: Millimetres,
    /// Tread compression by its low-pass, mm.
    pub compression: Millimetres,
    /// Preload by its low-pass, N.
    pub preload: Newtons,
    /// Travel of the tread.
    pub travel: Travel,
    /// A step is expected here: hold the baseline.
    pub near: bool,
    /// By its travel the wheel is too far for the corner that it is on.
    pub over: bool,
    /// The wheel is clear of the step behind; none where only the ground can show that.
    pub clear: Option<bool>,
    /// Compression by the lower wall at which the tread's memory lets go of it, mm.
    pub short: Millimetres,
}

impl CrossingWatch {
    /// Takes the wall under the resting wheel as baseline, unless it is on a corner.
    pub fn rest(&self, state: &mut WatchState, seen: &WatchInput) {
        let off = state.baseline.output() - (seen.radius - seen.compression);
        if state.contact == Contact::Wall && off.abs() < HOLD {
            self.baseline.step(&mut state.baseline, seen.radius - seen.compression);
        }
    }

    /// Starts afresh on the wall under the wheel.
    pub fn begin(&self, state: &mut WatchState, seen: &WatchInput) {
        *state = WatchState {
            baseline: LowPassState::at(seen.radius - seen.compression),
            ..WatchState::default()
        };
    }

    /// Starts on a corner, towards the wall of `level`: nothing is measured until
    /// the wheel is on that wall.
    pub fn begin_on_corner(&self, state: &mut WatchState, direction: Direction, level: u8) {
        let wall = self.wall(level);
        let from = match direction {
            Direction::Deploy => wall + self.step,
            Direction::Retract => wall - self.step,
        };
        *state = WatchState {
            contact: Contact::Leaving,
            baseline: LowPassState::at(from),
            ..WatchState::default()
        };
    }

    /// Starts in the middle of a corner, moving over it from the wall of `level`: with
    /// that wall's baseline by the table.
    pub fn begin_between(
        &self,
        state: &mut WatchState,
        direction: Direction,
        level: u8,
        seen: &WatchInput,
    ) {
        *state =
            WatchState { baseline: LowPassState::at(self.wall(level)), ..WatchState::default() };
        self.touch(state, direction, seen);
    }

    /// Baseline of a level by the table, mm.
    fn wall(&self, level: u8) -> Millimetres {
        self.outermost - Millimetres::from_num(level) * self.step
    }

    /// How far inwards of the wall of `level` the wheel is, by the table, mm.
    pub fn height_over(
        &self,
        level: u8,
        radius: Millimetres,
        compression: Millimetres,
    ) -> Millimetres {
        self.wall(level) - (radius - compression)
    }

    /// Axial distance from the centre of a wheel on an edge to its face, mm: the
    /// edge lies `R - c` from the centre, and `y - h` below it. `level` is that of the lower
    /// wall.
    pub fn to_edge(&self, level: u8, radius: Millimetres, compression: Millimetres) -> Millimetres {
        let height = self.wall(level) + self.radius - radius;
        self.measure(compression, height, self.step).distance
    }

    /// Turns back, from now on in `direction`; the baseline is that of the wall which the
    /// wheel now comes from.
    pub fn reverse(&self, state: &mut WatchState, direction: Direction) {
        let other_wall = state.baseline.output()
            + match direction {
                Direction::Retract => -self.step,
                Direction::Deploy => self.step,
            };
        let (contact, baseline) = match (state.contact, direction) {
            (Contact::Wall, _) => (Contact::Wall, state.baseline.output()),
            // Still carried by the wall it came from, and going back onto it.
            (Contact::Both, Direction::Retract) => (Contact::Wall, state.baseline.output()),
            // On the edge alone and going back up: over it, without a lift-off.
            (Contact::Corner, Direction::Deploy) => (Contact::Leaving, other_wall),
            // On the edge and on down, or down already and up again: a crossing.
            (Contact::Corner, Direction::Retract) => (Contact::Corner, other_wall),
            (Contact::Both, Direction::Deploy) => (Contact::Both, other_wall),
            // Past the corner: on the wall behind it, whose baseline is not yet measured.
            (Contact::Leaving, _) => (Contact::Wall, other_wall),
        };
        *state = WatchState {
            contact,
            baseline: LowPassState::at(baseline),
            deepest: state.deepest,
            ..WatchState::default()
        };
    }

    /// Axial distance along the run to the face of the corner that carries, mm: the edge lies
    /// `R - c` from the centre, with the centre's height above the wall from the baseline. None
    /// while the corner is felt too little to show where it is.
    pub fn to_face(
        &self,
        state: &WatchState,
        direction: Direction,
        seen: &WatchInput,
    ) -> Option<Millimetres> {
        let enough = match direction {
            Direction::Deploy => TOUCH,
            Direction::Retract => DIP,
        };
        if self.rise(state, direction, seen) < enough {
            return None;
        }
        let height = self.height(state, seen);
        Some(match direction {
            Direction::Deploy => self.measure(seen.compression, height, self.step).distance,
            Direction::Retract => {
                -self.measure(seen.compression, height + self.step, self.step).distance
            }
        })
    }

    /// Height of the centre over the wall that the wheel came from, mm.
    pub fn height(&self, state: &WatchState, seen: &WatchInput) -> Millimetres {
        state.baseline.output() + self.radius - seen.radius
    }

    /// Distance from a face at which an undeformed wheel on this ground touches its edge, mm, over the
    /// wall above: `sqrt(R^2 - (R - f)^2)`.
    pub fn reach(&self, state: &WatchState, ground: Millimetres) -> Millimetres {
        let fallen = between(ground - state.baseline.output(), Q16::ZERO, self.step + HEIGHT_MOST);
        sqrt(fallen * (self.radius + self.radius - fallen))
    }

    /// How far the wheel is off its baseline in the direction of the step, mm.
    pub fn rise(&self, state: &WatchState, direction: Direction, seen: &WatchInput) -> Millimetres {
        let rise = state.baseline.output() - (seen.radius - seen.compression);
        match direction {
            Direction::Deploy => rise,
            Direction::Retract => -rise,
        }
    }

    /// Whether a retracting wheel may be over an edge by so much, mm: it sinks by `x^2 / 2 R`, or half of
    /// that.
    pub fn may_be_over(&self, state: &WatchState, seen: &WatchInput, over: Millimetres) -> bool {
        let sunk = self.rise(state, Direction::Retract, seen) + TOUCH;
        over * over < sunk * self.radius * q16(4_000_000)
    }

    /// Whether the wheel is on a wall, far from any edge.
    pub fn is_level(&self, state: &WatchState, direction: Direction, seen: &WatchInput) -> bool {
        state.contact == Contact::Wall && self.rise(state, direction, seen).abs() < HOLD
    }

    /// Compression by the wall, or beside a corner by the lower one, mm.
    pub fn floor(
        &self,
        state: &WatchState,
        direction: Direction,
        seen: &WatchInput,
    ) -> Millimetres {
        let dropped = direction == Direction::Retract && state.contact != Contact::Wall;
        let wall = state.baseline.output() + if dropped { self.step } else { Q16::ZERO };
        (seen.radius - wall).max(Q16::ZERO)
    }

    /// One tick.
    pub fn step(&self, state: &mut WatchState, direction: Direction, seen: &WatchInput) -> Noticed {
        let risen = (direction, seen, self.rise(state, direction, seen));
        if state.contact != Contact::Wall {
            state.deepest = state.deepest.max(seen.compression);
            let preload = seen.preload.max(Newtons::ONE);
            let bears = divide(seen.compression * sqrt(seen.compression), preload);
            state.edge = state.edge.max(bears);
            state.eased = Ratio::ONE - divide(bears, state.edge.max(Q16::DELTA));
            if direction == Direction::Retract {
                self.keep_depth(state, seen);
            }
        }
        match state.contact {
            Contact::Wall => self.on_wall(state, risen),
            Contact::Both | Contact::Corner => self.on_corner(state, risen),
            Contact::Leaving => self.leave(state, risen),
        }
    }

    fn on_wall(&self, state: &mut WatchState, (direction, seen, rise): Risen<'_>) -> Noticed {
        if rise < TOUCH {
            state.ticks = 0;
            let level = rise.abs() < HOLD;
            // What looks like the foot of a step, or a wheel rolling back off one, must not
            // drag the baseline along.
            let due = seen.travel.saturating_sub(state.sampled).saturating_abs() >= SAMPLE;
            if level && !seen.near && due {
                state.sampled = seen.travel;
                self.baseline.step(&mut state.baseline, seen.radius - seen.compression);
            }
            return None;
        }
        state.ticks += 1;
        if state.ticks < TOUCH_TICKS {
            return None;
        }
        self.touch(state, direction, seen);
        Some(CrossingEvent::Touched)
    }

    fn on_corner(&self, state: &mut WatchState, (direction, seen, rise): Risen<'_>) -> Noticed {
        // Height of the centre that the tread's memory still lacks at this instant.
        let short = match direction {
            Direction::Deploy => seen.short,
            Direction::Retract => Q16::ZERO,
        };
        let free = match direction {
            Direction::Deploy => seen.radius <= state.baseline.output() + short,
            Direction::Retract => seen.radius >= state.baseline.output() + self.step,
        };
        // A step lower than its table is over before the arm says so.
        if state.lift.is_none() && (free || rise >= self.step - OVER || seen.over) {
            state.contact = match direction {
                Direction::Deploy => Contact::Corner,
                Direction::Retract => Contact::Both,
            };
            let height = match direction {
                Direction::Deploy => self.radius - short,
                Direction::Retract => {
                    state.baseline.output() + self.step + self.radius - seen.radius
                }
            };
            let lift = self.measure(seen.compression, height, self.step);
            state.lift = Some(lift);
            return Some(CrossingEvent::Lifted(lift));
        }
        let clear = is_clear(state, seen);
        if state.lift.is_some() && (rise >= self.step - OVER || clear) {
            state.contact = Contact::Leaving;
            state.ticks = 0;
            return Some(CrossingEvent::Passed);
        }
        if rise < RELEASE {
            state.ticks = state.ticks.saturating_add(1);
            if state.ticks >= RELEASE_TICKS {
                state.contact = Contact::Wall;
                state.ticks = 0;
                return Some(CrossingEvent::Released);
            }
        } else {
            state.ticks = 0;
        }
        None
    }

    fn leave(&self, state: &mut WatchState, (direction, seen, rise): Risen<'_>) -> Noticed {
        let ground = seen.radius - seen.compression;
        // Off the wall that the table promises: the next corner already touches.
        let beyond = rise - self.step;
        let again = if seen.near { AGAIN } else { AGAIN + HEIGHT_MOST };
        // A wall that is measured does not rise.
        let drift = match direction {
            Direction::Deploy => state.next.output() - ground,
            Direction::Retract => ground - state.next.output(),
        };
        let touches = if state.ticks > 0 { drift > TOUCH } else { beyond > again };
        state.again = if touches { state.again + 1 } else { 0 };
        if state.again >= TOUCH_TICKS {
            let shift = match direction {
                Direction::Deploy => -self.step,
                Direction::Retract => self.step,
            };
            let base = state.baseline.output() + shift;
            let gap_as_table = state.lift.map_or(Q16::ZERO, |lift| lift.gap);
            state.baseline = LowPassState::at(base);
            self.touch(state, direction, seen);
            return Some(CrossingEvent::Retouched { gap_as_table });
        }
        if !is_clear(state, seen) {
            state.ticks = 0;
            return None;
        }
        if state.ticks == 0 {
            state.next = LowPassState::at(ground);
        }
        self.settle.step(&mut state.next, ground);
        state.ticks += 1;
        if state.ticks < SETTLE_TICKS {
            return None;
        }
        let height = (state.baseline.output() - state.next.output()).abs();
        let plausible = (height - self.step).abs() <= HEIGHT_MOST;
        let height = if plausible { height } else { self.step };
        let [gap, gap_as_table, shift] =
            state.lift.map_or([Q16::ZERO; 3], |lift| match direction {
                Direction::Deploy => {
                    let seen = self.measure(lift.depth, lift.height, height);
                    [seen.gap, lift.gap, seen.distance - lift.distance]
                }
                // The lower wall carries from the height on that is known now. The edge was seen
                // from the upper wall.
                Direction::Retract => {
                    let depth = self.depth_at(state, height).unwrap_or(lift.depth);
                    let gap = |step| self.measure(depth, self.radius, step).gap;
                    [gap(height), gap(self.step), Q16::ZERO]
                }
            });
        state.baseline = state.next;
        state.contact = Contact::Wall;
        state.ticks = 0;
        let measured = Measured { height, gap, gap_as_table, shift, plausible };
        Some(CrossingEvent::GapClosed(measured))
    }

    /// A corner begins to carry.
    fn touch(&self, state: &mut WatchState, direction: Direction, seen: &WatchInput) {
        state.ticks = 0;
        state.again = 0;
        state.deepest = seen.compression;
        (state.edge, state.eased) = (Q16::ZERO, Ratio::ZERO);
        state.lift = None;
        state.depths = [Q16::ZERO; FALLS];
        // On retract the wheel is on the edge alone as soon as it dips.
        state.contact = match direction {
            Direction::Deploy => Contact::Both,
            Direction::Retract => Contact::Corner,
        };
    }
}
