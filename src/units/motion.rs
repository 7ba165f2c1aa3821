//! What moves the drive: direction, duty and the command of a bridge.

/// Direction of axial motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Direction {
    /// Outwards, onto the smaller radius: the wheel climbs the steps.
    #[default]
    Deploy,
    /// Back: the wheel drops off the steps.
    Retract,
}

impl Direction {
    /// Both directions.
    pub const ALL: [Self; 2] = [Self::Deploy, Self::Retract];

    /// +1 outwards, -1 back.
    pub const fn sign(self) -> i32 {
        if matches!(self, Self::Deploy) { 1 } else { -1 }
    }

    /// The other one.
    pub const fn opposite(self) -> Self {
        if matches!(self, Self::Deploy) { Self::Retract } else { Self::Deploy }
    }
}

/// Signed duty of a bridge, Q15: -32768 is full reverse, 32767 full forward,
/// LSB 3.1e-5. Forward deploys (drive) or raises the preload (pre-tightener).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Duty(i16);

impl Duty {
    /// No torque.
    pub const ZERO: Self = Self(0);

    /// A duty from its Q15 bits.
    pub const fn from_bits(bits: i16) -> Self {
        Self(bits)
    }

    /// The Q15 bits.
    pub const fn to_bits(self) -> i16 {
        self.0
    }

    /// The duty nearest to `ratio`, saturating at full duty.
    pub fn saturating(ratio: super::Ratio) -> Self {
        // Q16 to Q15.
        let bits = ratio.to_bits() >> 1;
        Self(bits.clamp(-32_767, 32_767) as i16)
    }
}

/// Command of one motor's bridge until the next call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotorCommand {
    /// Signed duty.
    pub duty: Duty,
    /// Bridge enabled. Disabled, the bridge is off and the self-locking gears hold the
    /// mechanism where it is; the duty is then ignored.
    pub enable: bool,
}

impl MotorCommand {
    /// Bridge off: the safe state of either motor.
    pub const OFF: Self = Self { duty: Duty::ZERO, enable: false };

    /// Bridge on with this duty.
    pub const fn on(duty: Duty) -> Self {
        Self { duty, enable: true }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Q16;
    use super::*;

    #[test]
    fn duties_saturate_and_keep_their_sign() {
        assert_eq!(Duty::saturating(Q16::from_num(0.5)).to_bits(), 16_384);
        assert_eq!(Duty::saturating(Q16::from_num(7)).to_bits(), 32_767);
        assert_eq!(Duty::saturating(Q16::from_num(-7)).to_bits(), -32_767);
        assert_eq!(Duty::saturating(Q16::ZERO), Duty::ZERO);
    }
}
