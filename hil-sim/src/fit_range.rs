//! Where the reduced model is known to follow the ring: the crossings on which its fit is
//! checked, for any wheel.

use interstage::model::formula::Formula;

/// Ranges of the crossings on which the fit is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitRange {
    /// Least and largest speed, mm/s.
    pub speed_mm_s: (f64, f64),
    /// Least and largest preload, N.
    pub preload_n: (f64, f64),
    /// Least and largest step height, mm.
    pub step_mm: (f64, f64),
    /// Largest axial load, N.
    pub load_n: f64,
    /// Largest friction utilisation.
    pub utilisation: f64,
}

/// The ranges on the published wheel, from which the stored crossings are drawn.
pub const PUBLISHED: FitRange = FitRange {
    speed_mm_s: (1.0, 100.0),
    preload_n: (15.0, 150.0),
    step_mm: (2.0, 6.0),
    load_n: 20.0,
    utilisation: 1.5,
};

/// Part by which a quantity may pass an end that rounding shifts.
const ROUNDING: f64 = 1e-9;

/// A crossing that may be outside the ranges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Axial speed, mm/s.
    pub speed_mm_s: f64,
    pub preload_n: f64,
    /// Axial load, N; 0 if the wheel is pushed.
    pub load_n: f64,
    /// Friction utilisation that the model gives; 0 if the wheel is pushed.
    pub utilisation: f64,
}

impl FitRange {
    /// The ranges on this wheel. In units of the wheel the model is the same for all: speeds
    /// over `R / tau`, forces over `k_inf R^2 L`, steps over `R`.
    pub fn of(formula: &Formula) -> Self {
        let published = Formula::new(&interstage::rig::Rig::fe());
        let pace = |formula: &Formula| formula.radius_mm / formula.tau_s;
        let speed = pace(formula) / pace(&published);
        let force = formula.unit_force_n() / published.unit_force_n();
        let length = formula.radius_mm / published.radius_mm;
        let scaled = |(low, high): (f64, f64), by: f64| (low * by, high * by);
        Self {
            speed_mm_s: scaled(PUBLISHED.speed_mm_s, speed),
            preload_n: scaled(PUBLISHED.preload_n, force),
            step_mm: scaled(PUBLISHED.step_mm, length),
            load_n: PUBLISHED.load_n * force,
            utilisation: PUBLISHED.utilisation,
        }
    }

    /// Every quantity of this crossing that is outside, as half a sentence each.
    pub fn outside(&self, step_mm: f64, asked: &Asked) -> Vec<String> {
        let load = (0.0, self.load_n);
        let utilisation = (0.0, self.utilisation);
        [
            ("speed", asked.speed_mm_s.abs(), self.speed_mm_s, " mm/s"),
            ("preload", asked.preload_n, self.preload_n, " N"),
            ("step height", step_mm, self.step_mm, " mm"),
            ("load", asked.load_n, load, " N"),
            ("friction needed", asked.utilisation, utilisation, ""),
        ]
        .into_iter()
        .filter(|(_, value, (low, high), _)| {
            // What is no number is outside too.
            !(low * (1.0 - ROUNDING)..=high * (1.0 + ROUNDING)).contains(value)
        })
        .map(|(name, value, (low, high), unit)| {
            format!("{name} {value:.4}{unit}, range {low:.4} to {high:.4}{unit}")
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use interstage::model::effective_stiffness::STEP_RANGE;
    use interstage::rig::Rig;

    use super::*;

    const INSIDE: Asked =
        Asked { speed_mm_s: 5.0, preload_n: 100.0, load_n: 5.0, utilisation: 0.8 };

    #[test]
    fn each_quantity_that_is_outside_is_named() {
        let range = FitRange::of(&Formula::new(&Rig::prototype()));
        let outside = |step_mm, asked: Asked| range.outside(step_mm, &asked);
        assert!(outside(4.0, INSIDE).is_empty());
        for edge in [(15.0, 1.0), (150.0, 100.0)] {
            let asked = Asked { preload_n: edge.0, speed_mm_s: edge.1, ..INSIDE };
            assert!(outside(4.0, asked).is_empty(), "{edge:?}");
        }
        for (step_mm, asked, name) in [
            (4.0, Asked { preload_n: 300.0, ..INSIDE }, "preload 300"),
            (4.0, Asked { preload_n: 14.0, ..INSIDE }, "preload 14"),
            (4.0, Asked { speed_mm_s: 0.5, ..INSIDE }, "speed 0.5"),
            (6.5, INSIDE, "step height 6.5"),
            (4.0, Asked { load_n: 21.0, ..INSIDE }, "load 21"),
            (4.0, Asked { utilisation: f64::NAN, ..INSIDE }, "friction needed NaN"),
        ] {
            let found = outside(step_mm, asked);
            assert!(found.len() == 1 && found[0].starts_with(name), "{found:?}");
        }
    }

    #[test]
    fn another_wheel_has_its_own_range() {
        let mut rig = Rig::prototype();
        rig.tread.k_inf_pa_per_m *= 2.0;
        rig.tread.tau_s *= 0.5;
        let range = FitRange::of(&Formula::new(&rig));
        assert!((range.preload_n.1 - 300.0).abs() < 1e-9, "{range:?}");
        assert!((range.speed_mm_s.1 - 200.0).abs() < 1e-9, "{range:?}");
        assert_eq!(range.step_mm, PUBLISHED.step_mm);
        // The range of steps that the model covers without holding its end contains it.
        let (low, high) = STEP_RANGE;
        assert!(low * 25.0 <= range.step_mm.0 && range.step_mm.1 <= high * 25.0);
    }
}
