//! Friction in the arm's pivot and play in the drive: what depends on the direction of motion.

/// Travel over which the pivot's friction turns round, mm at the wheel. Chosen, so that it is
/// softer than the tread.
const TURNS_IN_MM: f64 = 0.05;

/// Coulomb friction in the arm's pivot that turns round over a short travel (Dahl's model,
/// linear up to its bound).
#[derive(Clone, Copy, Debug, Default)]
pub struct Pivot {
    /// Friction, N at the wheel.
    friction_n: f64,
    /// Travel since friction turned round, mm, bounded either way.
    bent_mm: f64,
}

impl Pivot {
    /// A pivot with this friction, N at the wheel, relaxed.
    pub const fn new(friction_n: f64) -> Self {
        Self { friction_n, bent_mm: 0.0 }
    }

    /// The wheel has moved by this towards the pillar, mm.
    pub fn follow(&mut self, rise_mm: f64) {
        self.bent_mm = (self.bent_mm + rise_mm).clamp(-TURNS_IN_MM, TURNS_IN_MM);
    }

    /// Force that presses the wheel to the wall, N: against its motion.
    pub fn force_n(&self) -> f64 {
        self.friction_n * self.bent_mm / TURNS_IN_MM
    }
}

/// Play of the drive: the wheel between the flanks of its gear.
#[derive(Clone, Copy, Debug, Default)]
pub struct Play {
    /// Travel of the tread from flank to flank, mm.
    width_mm: f64,
    /// How far the tread has run ahead of the flank that drives it forwards, mm.
    ahead_mm: f64,
    /// Speed of the motor, as travel of the tread, while the wheel is free, mm/s.
    free: Option<f64>,
}

impl Play {
    /// Play of this width, mm, the wheel on the flank that drives it forwards.
    pub const fn new(width_mm: f64) -> Self {
        Self { width_mm, ahead_mm: 0.0, free: None }
    }

    /// Speed of the motor while the wheel is between the flanks, mm/s.
    pub const fn motor_mm_s(&self) -> Option<f64> {
        self.free
    }

    /// The flank in contact had to push with this force, N, positive forwards, at this speed of
    /// the motor: it cannot pull, and lets go.
    pub fn pushed(&mut self, force_n: f64, motor_mm_s: f64) {
        let leaves =
            force_n < 0.0 && self.ahead_mm < self.width_mm || force_n > 0.0 && self.ahead_mm > 0.0;
        self.free = leaves.then_some(motor_mm_s);
    }

    /// Free of the flanks the tread has travelled this much farther than the motor, mm, which
    /// ended with this speed. Returns whether it is still free.
    pub fn travelled(&mut self, farther_mm: f64, motor_mm_s: f64) -> bool {
        let ahead = self.ahead_mm + farther_mm;
        self.ahead_mm = ahead.clamp(0.0, self.width_mm);
        self.free = (ahead == self.ahead_mm).then_some(motor_mm_s);
        self.free.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_presses_against_the_motion_up_to_its_bound() {
        let mut pivot = Pivot::new(2.0);
        assert_eq!(pivot.force_n(), 0.0);
        pivot.follow(0.025);
        assert_eq!(pivot.force_n(), 1.0);
        pivot.follow(3.0);
        assert_eq!(pivot.force_n(), 2.0);
        // Both bounds apart: the hysteresis.
        pivot.follow(-0.1);
        assert_eq!(pivot.force_n(), -2.0);
    }

    #[test]
    fn a_flank_pushes_and_never_pulls() {
        let mut play = Play::new(0.1);
        play.pushed(5.0, 3.0);
        assert_eq!(play.motor_mm_s(), None);
        play.pushed(-1.0, 3.0);
        assert_eq!(play.motor_mm_s(), Some(3.0));
        assert!(play.travelled(0.06, 2.0));
        assert!(!play.travelled(0.06, 1.0));
        play.pushed(-1.0, 1.0);
        assert_eq!(play.motor_mm_s(), None);
        play.pushed(1.0, 1.0);
        assert!(!play.travelled(-0.2, 1.0));
        // Without play it never lets go.
        let mut none = Play::new(0.0);
        none.pushed(-1.0, 1.0);
        assert_eq!(none.motor_mm_s(), None);
    }
}
