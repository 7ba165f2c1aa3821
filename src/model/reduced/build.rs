//! Specialises the formulas to a rig and its load, once at start.

mod cells;
mod least_squares;
mod polynomial;

use super::ReducedModel;
use super::direction_model::{DirectionModel, TERMS};
use super::shape::Shape;
use crate::model::effective_stiffness::{
    FAST_DEGREE, FORCE_END, Folded, Kind, RUN_DEGREE, RUN_END,
};
use crate::model::formula::{Formula, LEAST_RUN};
use crate::numeric::{checked, fits, fits_with_slope};
use crate::rig::{Rig, RigError};
use crate::units::Direction;
use polynomial::{interpolate, rows, value};

/// Largest unit of force, N: forces from 8 to 256 N are resolved, of which no rig needs more.
const MOST_UNIT_N: f64 = 1024.0;

/// 2 to a power.
const fn two_to(power: u32) -> f64 {
    (1_u64 << power) as f64
}

impl ReducedModel {
    /// The model of a rig whose wheel is driven against its load.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Self::try_build_for(rig, Some(rig.plant.top_load_n * rig.plant.top_load_share))
    }

    /// The model of a rig driven against this load, N; `None` pushes a frictionless wheel.
    pub fn try_build_for(rig: &Rig, load_n: Option<f64>) -> Result<Self, RigError> {
        rig.validate()?;
        let formula = Formula::new(rig);
        let start = Start::new(&formula, load_n);
        let shape = start.shape(rig)?;
        Ok(Self {
            directions: [
                start.direction(rig, Direction::Deploy)?,
                start.direction(rig, Direction::Retract)?,
            ],
            shape,
            driven: load_n.is_some(),
            friction: checked("plant.mu", rig.plant.mu)?,
        })
    }
}

/// What both directions are built from. The run is a part r of the longest, w = r - 1/2.
struct Start<'a> {
    formula: &'a Formula,
    driven: bool,
    load_n: f64,
    longest_mm: f64,
    /// Unit of force, N: the power of two above the largest relaxed one of the fit times s.
    unit_n: f64,
    /// Relaxed force times s over r^2 and the unit, slope of the contact: by w.
    force: [f64; 5],
    slope: [f64; 5],
}

impl<'a> Start<'a> {
    fn new(formula: &'a Formula, load_n: Option<f64>) -> Self {
        let kind = Kind { direction: Direction::Deploy, driven: load_n.is_some() };
        let most = FORCE_END * formula.unit_force_n() * formula.stiffening;
        let unit_n = libm::exp2(libm::ceil(libm::log2(most))).min(MOST_UNIT_N);
        // No further than to where the unit is reached.
        let within = |run: f64| {
            formula.relaxed_force_n(kind, formula.gap_after_mm(run)) * formula.stiffening <= unit_n
        };
        let mut longest_mm = formula.largest_run_mm(kind);
        if !within(longest_mm) {
            let mut low = 0.0;
            for _ in 0..40 {
                let middle = 0.5 * (low + longest_mm);
                if within(middle) { low = middle } else { longest_mm = middle }
            }
        }
        let unit_at_rest_n = unit_n / formula.stiffening;
        let gap = |w: f64| formula.gap_after_mm(longest_mm * (w + 0.5));
        Self {
            formula,
            driven: load_n.is_some(),
            load_n: load_n.unwrap_or(0.0),
            longest_mm,
            unit_n,
            force: interpolate(|w| {
                let run = w + 0.5;
                formula.relaxed_force_n(kind, gap(w)) / (unit_at_rest_n * run * run)
            }),
            slope: interpolate(|w| formula.contact(gap(w)).slope()),
        }
    }

    fn shape(&self, rig: &Rig) -> Result<Shape, RigError> {
        let f = self.formula;
        let radius = f.radius_mm;
        let stiff = || refused("tread.k_inf_pa_per_m", rig.tread.k_inf_pa_per_m, 1e7, 5e9);
        let quartic = |coefficients: [f64; 5], fraction| {
            to_bits(coefficients, fraction).filter(|bits| fits_with_slope(bits)).ok_or_else(stiff)
        };
        let free = f.free_run_mm() / radius;
        let longest = self.longest_mm / radius;
        let longest_bits = (longest * two_to(32)) as u32;
        let longest_shift = longest_bits.leading_zeros();
        let normalised = longest_bits << longest_shift;
        // 4 or more, as the unit is bounded.
        let force_places = (14 - libm::log2(self.unit_n) as i32).unsigned_abs();
        let deflection_um = 1e3 * self.unit_n / f.impact.arm_n_per_mm;
        let at = |w: f64| self.longest_mm * (w + 0.5);
        let part = |force_n: f64| (force_n / self.unit_n * two_to(30)) as i32;
        // A rig without modes has nothing that could swing.
        let swings = f.impact.mode_rad_s > 0.0;
        let ramp = if swings { 2.0 / (f.impact.mode_rad_s * self.longest_mm) } else { 0.0 };
        let deflection_um = if swings { deflection_um } else { 0.0 };
        let slope_at = |w: f64| value(&self.slope, w);
        let driven = self.driven;
        Ok(Shape {
            free: (free * two_to(32)) as u32,
            longest: longest_bits,
            longest_shift,
            longest_inverse: (two_to(63) / f64::from(normalised)).min(two_to(32) - 1.0) as u32,
            least: (LEAST_RUN / longest * two_to(31)) as i32,
            half_radius: (0.5 * radius * two_to(19)) as i32,
            inverse_radius: (two_to(33) / radius) as i32,
            force: quartic(self.force, 29)?,
            slope: quartic(self.slope, 30)?,
            cosine: to_bits(
                interpolate(|w| {
                    let slope = if driven { slope_at(w) } else { 0.0 };
                    1.0 / (1.0 + slope * slope)
                }),
                30,
            )
            .filter(|bits| fits(bits))
            .ok_or_else(stiff)?,
            gap: to_bits(interpolate(|w| f.gap_after_mm(at(w))), 27)
                .filter(|bits| fits(bits))
                .ok_or_else(stiff)?,
            depth: quartic(interpolate(|w| f.depth_mm(f.gap_after_mm(at(w))) / at(w)), 30)?,
            load: part(self.load_n),
            most_lifting: part(self.load_n * slope_at(-0.5)),
            middle_lifting: part(self.load_n * slope_at(0.0)),
            force_places,
            most_force: (1 << 28) >> force_places,
            stress: (f.impact.stress_per_speed * 1e-3 * two_to(32)).min(two_to(32) - 1.0) as u32,
            deflection: bits(deflection_um, 15).ok_or_else(stiff)?,
            swing: bits(deflection_um * ramp, 28).ok_or_else(stiff)?,
        })
    }

    fn direction(&self, rig: &Rig, direction: Direction) -> Result<DirectionModel, RigError> {
        let f = self.formula;
        let kind = Kind { direction, driven: self.driven };
        let stiff = || refused("tread.stiffening", rig.tread.stiffening, 1.0, 20.0);
        let stiffening = self.stiffening(&f.fold(kind, self.load_n));
        let mut terms = [0; TERMS];
        for (slot, value) in terms.iter_mut().zip(triangle(&stiffening)) {
            *slot = bits(value, 23).ok_or_else(stiff)?;
        }
        if !holds(&stiffening) {
            return Err(stiff());
        }
        let half_speed = (f.half_speed_mm_s(kind) * two_to(16)).clamp(1.0, two_to(31) - 1.0) as u32;
        let half_speed_shift = half_speed.leading_zeros();
        Ok(DirectionModel {
            half_speed,
            half_speed_normalised: half_speed << half_speed_shift,
            half_speed_shift,
            relaxed: (two_to(26) / f.stiffening) as i32,
            stiffening: terms,
            run_cells: self.run_cells(&stiffening).ok_or_else(stiff)?,
            speed_cells: self.speed_cells(&stiffening).ok_or_else(stiff)?,
        })
    }

    /// `(s - 1)/s E` by powers of the centred fast part u and of w.
    fn stiffening(&self, folded: &Folded) -> Folded {
        let part = (self.formula.stiffening - 1.0) / self.formula.stiffening;
        let by_speed = rows::<{ FAST_DEGREE + 1 }>(2.0, 0.0);
        let longest = self.longest_mm / (RUN_END * self.formula.radius_mm);
        let by_run = rows::<{ RUN_DEGREE + 1 }>(2.0 * longest, longest - 1.0);
        let mut stiffening = Folded::default();
        for (row, speed) in folded.iter().zip(&by_speed) {
            for (c, run) in row.iter().zip(&by_run) {
                for (out, u) in stiffening.iter_mut().zip(speed) {
                    for (out, w) in out.iter_mut().zip(run) {
                        *out += part * c * u * w;
                    }
                }
            }
        }
        stiffening
    }

    /// Stiffness over the instant one, at a fast part by powers of w.
    fn stiffness_by_run(&self, stiffening: &Folded, x: f64) -> [f64; RUN_DEGREE + 1] {
        let mut row = [0.0; RUN_DEGREE + 1];
        for terms in stiffening.iter().rev() {
            for (sum, c) in row.iter_mut().zip(terms) {
                *sum = *sum * (x - 0.5) + c;
            }
        }
        row = row.map(|c| x * c);
        row[0] += 1.0 / self.formula.stiffening;
        row
    }

    /// The same at one run.
    fn stiffness(&self, stiffening: &Folded, x: f64, w: f64) -> f64 {
        value(&self.stiffness_by_run(stiffening, x), w)
    }
}

/// The terms in the order of [`DirectionModel::stiffening`].
fn triangle(stiffening: &Folded) -> impl Iterator<Item = f64> {
    (0..=RUN_DEGREE).flat_map(move |j| {
        let most = (30 - 5 * j) / 6;
        stiffening.iter().take(most + 1).map(move |row| row.get(j).copied().unwrap_or(0.0))
    })
}

/// Whether the effective stiffness stays below 16, and its derivatives in their formats,
/// for every speed and run.
fn holds(stiffening: &Folded) -> bool {
    let bound = |sum: f64, c: f64| 0.5 * sum + libm::fabs(c);
    let mut by_speed = [0.0; FAST_DEGREE + 1];
    let mut by_run = [0.0; RUN_DEGREE + 1];
    for (sum, row) in by_speed.iter_mut().zip(stiffening) {
        *sum = row.iter().rev().fold(0.0, |sum, c| bound(sum, *c));
    }
    for row in stiffening.iter().rev() {
        for (sum, c) in by_run.iter_mut().zip(row) {
            *sum = bound(*sum, *c);
        }
    }
    let most = by_run.iter().rev().fold(0.0, |sum, c| bound(sum, *c));
    let fit = |bits: Option<&[i32]>| bits.is_some_and(fits_with_slope);
    // Two places to spare for what is made from the derivatives.
    fit(to_bits(by_speed, 25).as_ref().map(<[i32; 6]>::as_slice))
        && fit(to_bits(by_run, 25).as_ref().map(<[i32; 7]>::as_slice))
        && most < 16.0
}

/// A number in units of 2^-places, if it fits.
fn bits(value: f64, places: u32) -> Option<i32> {
    let bits = libm::round(value * two_to(places));
    (libm::fabs(bits) < two_to(31)).then_some(bits as i32)
}

fn to_bits<const N: usize>(values: [f64; N], places: u32) -> Option<[i32; N]> {
    let mut all = [0; N];
    for (slot, value) in all.iter_mut().zip(values) {
        *slot = bits(value, places)?;
    }
    Some(all)
}

const fn refused(key: &'static str, value: f64, min: f64, max: f64) -> RigError {
    RigError::OutOfRange { key, value, min, max }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::reduced::{Point, Scale};
    use crate::units::Q16;
    use proptest::prelude::*;

    #[test]
    fn what_the_formats_do_not_hold_is_refused_by_name() {
        let refuses = |change: fn(&mut Rig), key: &str| {
            let mut rig = Rig::prototype();
            change(&mut rig);
            let formula = Formula::new(&rig);
            let start = Start::new(&formula, None);
            let shape = start.shape(&rig).err();
            let error = shape.or_else(|| start.direction(&rig, Direction::Deploy).err());
            let named =
                matches!(error, Some(RigError::OutOfRange { key: named, .. }) if named == key);
            assert!(named, "{key}: {error:?}");
        };
        refuses(|rig| rig.tread.k_inf_pa_per_m = 1e11, "tread.k_inf_pa_per_m");
        refuses(|rig| rig.tread.stiffening = 30.0, "tread.stiffening");
        refuses(|rig| rig.tread.stiffening = 0.1, "tread.stiffening");
    }

    /// Largest relative errors against the formulas over a grid of the domain: gap, force of the
    /// inverse, corner force, utilisation (absolute), speed as the force that it needs, and gap
    /// of another scale.
    #[derive(Debug, Default)]
    struct Errors {
        gap: f64,
        force: f64,
        corner: f64,
        used: f64,
        speed: f64,
        scaled: f64,
        vibration: f64,
        lost: usize,
    }

    fn errors(rig: &Rig, load: Option<f64>) -> Errors {
        let model = ReducedModel::try_build_for(rig, load).unwrap();
        let formula = Formula::new(rig);
        let mut errors = Errors::default();
        let (low, high) = model.gap_range();
        let lsb = 1.0 / 65_536.0;
        for direction in Direction::ALL {
            if direction == Direction::Retract && load.is_none() {
                continue;
            }
            for (i, j) in (0..24).flat_map(|i| (0..24).map(move |j| (i, j))) {
                let speed = 100f64.powf(f64::from(i) / 23.0);
                let force = 15.0 * 10f64.powf(f64::from(j) / 23.0);
                let at = Point::nominal(direction, Q16::from_num(speed));
                let (speed, wanted) = (at.speed.to_num::<f64>(), Q16::from_num(force));
                let force = wanted.to_num::<f64>();
                let exact = formula.crossing(direction, speed, force, load);
                // Beyond what rubber holds, or the ends of the model.
                if exact.utilisation > 1.5
                    || exact.gap_mm < low.to_num::<f64>() + 1e-4
                    || exact.gap_mm > high.to_num::<f64>() - 1e-4
                {
                    continue;
                }
                let got = model.crossing(&at, wanted);
                let beyond = |got: Q16, exact: f64, lsbs: f64| {
                    let off = (got.to_num::<f64>() - exact).abs() - lsbs * lsb;
                    off.max(0.0) / exact.abs()
                };
                errors.gap = errors.gap.max(beyond(got.gap, exact.gap_mm, 1.0));
                errors.corner =
                    errors.corner.max(beyond(got.corner_force, exact.corner_force_n, 1.0));
                errors.vibration =
                    errors.vibration.max(beyond(got.vibration_um, 1e3 * exact.vibration_mm, 1.0));
                let used = (got.utilisation.to_num::<f64>() - exact.utilisation).abs();
                errors.used = errors.used.max(used);
                let near = Q16::from_num(exact.gap_mm);
                let held = formula.force_n(direction, speed, near.to_num(), load);
                errors.force = errors.force.max(beyond(model.force(&at, near), held, 1.0));
                let fastest = model.speed(&at, near, wanted, Q16::ZERO, Q16::from_num(200));
                let needs = formula.force_n(direction, fastest.to_num(), near.to_num(), load);
                if fastest > Q16::ZERO {
                    errors.speed = errors.speed.max((needs / force - 1.0).abs());
                } else {
                    // The force of a gap holds it at the speed that it was computed for.
                    errors.lost += 1;
                }
                for scale in [0.8, 1.25] {
                    let at = Point { scale: Scale::new(Q16::from_num(scale)), ..at };
                    let scale = at.scale.ratio().to_num::<f64>();
                    let gap = model.gap(&at, wanted).to_num::<f64>();
                    if gap < low.to_num::<f64>() + 1e-4 || gap > high.to_num::<f64>() - 1e-4 {
                        continue;
                    }
                    // The scale multiplies what exceeds the lift on the mean slope.
                    let kind = Kind { direction, driven: load.is_some() };
                    let middle = formula.gap_after_mm(0.5 * formula.largest_run_mm(kind));
                    let lifting = load.unwrap_or(0.0) * formula.contact(middle).slope();
                    // The forces of the domain, as the unscaled tread feels them.
                    if !(15.0..=150.0).contains(&((force - lifting) / scale + lifting)) {
                        continue;
                    }
                    let excess = formula.force_n(direction, speed, gap, load) - lifting;
                    let off = ((scale * excess + lifting) / force - 1.0).abs();
                    errors.scaled = errors.scaled.max(off);
                }
            }
        }
        errors
    }

    #[test]
    fn fixed_point_follows_the_formulas() {
        for step_mm in [2.0, 3.0, 4.0, 5.0, 6.0] {
            for load in [Some(0.0), Some(20.0 / 3.0), Some(20.0), None] {
                let mut rig = Rig::prototype();
                rig.rig.step_height_mm = step_mm;
                let errors = errors(&rig, load);
                // Pushed over 2 mm, 150 N all but sink the wheel.
                let pushed = step_mm < 3.0 && load.is_none();
                let bounds = [
                    (errors.gap, if pushed { 1e-3 } else { 1e-5 }),
                    (errors.force, 5e-6),
                    (errors.corner, if pushed { 2e-4 } else { 5e-5 }),
                    (errors.used, 1e-4),
                    (errors.speed, if pushed { 4e-3 } else { 2e-3 }),
                    (errors.scaled, if pushed { 1e-2 } else { 2e-4 }),
                    (errors.vibration, if pushed { 3e-4 } else { 1e-4 }),
                ];
                for (error, bound) in bounds {
                    assert!(error < bound, "{step_mm} {load:?} {bound} {errors:?}");
                }
                assert_eq!(errors.lost, 0, "{step_mm} {load:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn hostile_working_points_stay_without_panic(
            speed in any::<i32>(),
            force in any::<i32>(),
            gap in any::<i32>(),
            scale in any::<i32>(),
            back in any::<bool>(),
        ) {
            let rig = Rig::prototype();
            let model = ReducedModel::try_build(&rig).unwrap();
            let q = Q16::from_bits;
            let at = Point {
                direction: Direction::ALL[usize::from(back)],
                speed: q(speed),
                scale: Scale::new(q(scale)),
                extra_load: q(gap),
            };
            let crossing = model.crossing(&at, q(force));
            let (low, high) = model.gap_range();
            prop_assert!(crossing.gap >= low && crossing.gap <= high);
            let _ = model.force(&at, q(gap));
            let _ = model.utilisation(&at, q(gap));
            let _ = model.observed_scale(&at, q(gap), q(force));
            let speed = model.speed(&at, q(gap), q(force), q(1 << 16), q(60 << 16));
            prop_assert!(speed >= q(1 << 16) && speed <= q(60 << 16));
        }
    }

    #[test]
    fn a_stiffening_beyond_its_format_is_refused() {
        let mut stiffening = Folded::default();
        assert!(holds(&stiffening));
        stiffening[0][0] = 15.9;
        assert!(holds(&stiffening));
        stiffening[0][0] = 20.0;
        assert!(!holds(&stiffening));
        // Not at the middle of speed and run, but at an end.
        stiffening[0][0] = 15.0;
        stiffening[1][0] = 1.5;
        assert!(holds(&stiffening));
        stiffening[0][1] = 1.5;
        assert!(!holds(&stiffening));
    }

    #[test]
    fn a_scale_is_kept_within_a_quarter_and_four() {
        for (ratio, kept) in [(0.1, 0.25), (0.25, 0.25), (1.25, 1.25), (4.0, 4.0), (9.0, 4.0)] {
            assert_eq!(Scale::new(Q16::from_num(ratio)).ratio(), Q16::from_num(kept));
        }
        assert_eq!(Scale::NOMINAL.ratio(), Q16::ONE);
    }

    #[test]
    fn the_first_touch_presses_as_the_formula_has_it() {
        let rig = Rig::prototype();
        let model = ReducedModel::try_build(&rig).unwrap();
        let formula = Formula::new(&rig);
        for speed in [2.0, 8.0, 30.0, 100.0] {
            let at = Point::nominal(Direction::Deploy, Q16::from_num(speed));
            let got = model.crossing(&at, Q16::from_num(60)).impact_stress_kpa.to_num::<f64>();
            let exact = 1e-3 * formula.impact.stress_pa(speed);
            assert!((got - exact).abs() < 5e-5 + 1e-4 * exact, "{got} {exact}");
        }
    }

    /// Short runs do not even lift such a load.
    #[test]
    fn a_heavy_load_has_its_guesses_too() {
        let errors = errors(&Rig::prototype(), Some(60.0));
        assert!(errors.gap < 1e-5 && errors.force < 5e-6, "{errors:?}");
    }
}
