//! Builds the fixed-point tables from the formulas, once at start.

use super::{GAP_POINTS, ReducedModel};
use crate::model::constants::{DEPLOY, RETRACT};
use crate::model::formula::Formula;
use crate::numeric::{Table, checked};
use crate::rig::{Rig, RigError};
use crate::supervise::Direction;

/// Shortest run over the corner that the tables cover, mm.
const SHORTEST_RUN_MM: f64 = 0.25;

/// Part of the unloaded gap at which the tables begin.
const LEAST_PART: f64 = 0.25;

impl ReducedModel {
    /// Tables of a rig.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range or the tables cannot hold it.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        rig.validate()?;
        let formula = Formula::new(rig);
        let reach = formula.free_run_mm() - SHORTEST_RUN_MM;
        let highest =
            libm::sqrt(reach * reach + formula.radius_mm * formula.radius_mm) - formula.radius_mm;
        let lowest = LEAST_PART * formula.largest_gap_mm();
        let table = |f: &dyn Fn(f64) -> f64| {
            Table::<GAP_POINTS>::build(lowest, highest, f).ok_or(RigError::OutOfRange {
                key: "tread.k_inf_pa_per_m",
                value: rig.tread.k_inf_pa_per_m,
                min: 1e7,
                max: 5e10,
            })
        };
        let slope = |gap: f64| {
            let contact = formula.contact(gap);
            contact.axial / contact.radial
        };
        let felt = |constants: &[i32; 33]| {
            Table::<33>::build(0.0, 1.0, |z| {
                let index = libm::round(z * 32.0) as usize;
                constants.get(index).map_or(0.0, |&value| f64::from(value) * 1e-6)
            })
            .ok_or(RigError::OutOfRange {
                key: "tread.stiffening",
                value: rig.tread.stiffening,
                min: 1.0,
                max: 20.0,
            })
        };
        Ok(Self {
            radial: table(&|gap| formula.k_inf * formula.contact(gap).radial)?,
            driven: table(&|gap| {
                let contact = formula.contact(gap);
                formula.k_inf * (contact.radial + slope(gap) * contact.axial)
            })?,
            slope: table(&slope)?,
            pace: [
                table(&|gap| formula.deborah_per_speed(Direction::Deploy, gap))?,
                table(&|gap| formula.deborah_per_speed(Direction::Retract, gap))?,
            ],
            depth: table(&|gap| formula.depth_mm(gap))?,
            felt: [felt(&DEPLOY)?, felt(&RETRACT)?],
            excess: checked("tread.stiffening", rig.tread.stiffening - 1.0)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::reduced::Point;
    use crate::units::Q16;
    use proptest::prelude::*;

    fn point(direction: Direction, speed: f64, load: f64) -> Point {
        Point {
            direction,
            speed: Q16::from_num(speed),
            load: Q16::from_num(load),
            scale: Q16::from_num(1),
        }
    }

    proptest! {
        #[test]
        fn fixed_point_follows_the_formulas(
            back in any::<bool>(),
            speed in 1.0..60.0f64,
            force in 25.0..120.0f64,
            load in 0.0..7.0f64,
        ) {
            let rig = Rig::prototype();
            let model = ReducedModel::try_build(&rig).unwrap();
            let formula = Formula::new(&rig);
            let direction = if back { Direction::Retract } else { Direction::Deploy };
            let at = point(direction, speed, load);
            let exact = formula.gap_mm(direction, speed, force, Some(load));
            let got = model.gap(&at, Q16::from_num(force)).to_num::<f64>();
            prop_assert!((got - exact).abs() < 3e-4 * exact, "{got} {exact}");
            let used = formula.utilisation(direction, speed, exact, load);
            let got = model.utilisation(&at, Q16::from_num(exact)).to_num::<f64>();
            prop_assert!((got - used).abs() < 1e-3, "{got} {used}");
        }

        #[test]
        fn the_inverse_closes(
            back in any::<bool>(),
            speed in 3.0..40.0f64,
            force in 25.0..60.0f64,
        ) {
            let model = ReducedModel::try_build(&Rig::prototype()).unwrap();
            let direction = if back { Direction::Retract } else { Direction::Deploy };
            let at = point(direction, speed, 6.7);
            let gap = model.gap(&at, Q16::from_num(force));
            let again = model.force(&at, gap).to_num::<f64>();
            prop_assert!((again / force - 1.0).abs() < 2e-3, "{again} {force}");
            let scale = model.observed_scale(&at, gap, Q16::from_num(force)).to_num::<f64>();
            prop_assert!((scale - 1.0).abs() < 3e-3, "{scale}");
        }
    }

    #[test]
    fn the_speed_found_is_the_largest_that_holds() {
        let model = ReducedModel::try_build(&Rig::prototype()).unwrap();
        let at = point(Direction::Deploy, 0.0, 6.7);
        let gap = Q16::from_num(2.7);
        let speed = model.speed(&at, gap, Q16::from_num(45), Q16::from_num(3), Q16::from_num(60));
        let force = |v: Q16| model.force(&Point { speed: v, ..at }, gap).to_num::<f64>();
        assert!(force(speed) <= 45.0);
        assert!(force(speed + Q16::from_num(0.05)) > 45.0);
    }

    #[test]
    fn hostile_working_points_saturate_without_panic() {
        let model = ReducedModel::try_build(&Rig::prototype()).unwrap();
        for speed in [0.0, 32_767.0] {
            for force in [-32_768.0, 0.0, 32_767.0] {
                let at = point(Direction::Deploy, speed, 32_767.0);
                let gap = model.gap(&at, Q16::from_num(force));
                let (low, high) = model.gap_range();
                assert!(gap >= low && gap <= high);
                let _ = model.utilisation(&at, gap);
                let _ = model.observed_scale(&at, gap, Q16::from_num(force));
            }
        }
    }
}
