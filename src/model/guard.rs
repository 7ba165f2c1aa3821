//! Resonance guard: speeds at which the drive's torque ripple would excite a mode.

use crate::numeric::checked;
use crate::rig::{MAX_MODES, Rig, RigError};
use crate::units::MillimetresPerSecond;

/// Bands of speed to keep out of, ascending and apart.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Guard {
    bands: heapless::Vec<(MillimetresPerSecond, MillimetresPerSecond), MAX_MODES>,
}

impl Guard {
    /// Bands of a rig: ripple frequency v / pitch within the guard of a mode.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let mut guard = Self::default();
        let mut modes = rig.drive.modes_hz.clone();
        modes.sort_unstable_by(f64::total_cmp);
        for hz in modes {
            let centre = hz * rig.drive.ripple_pitch_mm;
            let ends = [1.0 - rig.drive.guard_band, 1.0 + rig.drive.guard_band]
                .map(|part| (centre * part).min(30_000.0));
            let low = checked("drive.modes_hz", ends[0])?;
            let high = checked("drive.modes_hz", ends[1])?;
            match guard.bands.last_mut() {
                Some(last) if last.1 >= low => last.1 = last.1.max(high),
                // Never full: there are no more bands than modes.
                _ => {
                    let _ = guard.bands.push((low, high));
                }
            }
        }
        Ok(guard)
    }

    /// The largest speed up to `speed` outside the bands, and whether it was moved.
    pub fn below(&self, speed: MillimetresPerSecond) -> (MillimetresPerSecond, bool) {
        let inside = self.bands.iter().find(|(low, high)| speed > *low && speed < *high);
        inside.map_or((speed, false), |(low, _)| (*low, true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Q16;
    use proptest::prelude::*;

    #[test]
    fn a_speed_in_a_band_moves_to_its_lower_edge() {
        let guard = Guard::try_build(&Rig::prototype()).unwrap();
        let resonant = 163.0 * 0.1309;
        let (speed, moved) = guard.below(Q16::from_num(resonant));
        assert!(moved);
        assert!((speed.to_num::<f64>() - 0.92 * resonant).abs() < 1e-3);
        assert_eq!(guard.below(Q16::from_num(5)), (Q16::from_num(5), false));
    }

    proptest! {
        #[test]
        fn no_speed_given_lies_inside_a_band(
            modes in proptest::collection::vec(1.0..2000.0f64, 0..4),
            band in 0.0..0.5f64,
            speed in 0.0..200.0f64,
        ) {
            let mut rig = Rig::prototype();
            rig.drive.modes_hz = modes.iter().copied().collect();
            rig.drive.guard_band = band;
            let guard = Guard::try_build(&rig).unwrap();
            let (given, _) = guard.below(Q16::from_num(speed));
            prop_assert!(given <= Q16::from_num(speed));
            for mode in modes {
                let ratio = given.to_num::<f64>() / (mode * rig.drive.ripple_pitch_mm);
                prop_assert!(
                    (ratio - 1.0).abs() >= band - 1e-3 - 2e-5 / (mode * 0.13) ,
                    "{ratio} {band}"
                );
            }
        }
    }
}
