//! Bounds on what is measured: `budget.toml` of this package.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::Report;
use super::arithmetic::Variant;
use super::skipping::Firmware;

/// The bounds.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Of the shipping reduced model.
    pub model: ModelBudget,
    /// Of the control tick.
    pub tick: TickBudget,
    /// Of the plant.
    pub plant: PlantBudget,
    /// Of the whole firmware on the emulated board.
    pub board: BoardBudget,
    /// What is aimed at.
    pub aims: Aims,
}

/// The shipping reduced model: largest relative errors against the formulas, and
/// textbook cycles at worst.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelBudget {
    /// Of the gap, forwards, and of the force, back.
    pub max_rel_error: f64,
    /// Forwards: everything of a crossing from speed and force.
    pub forward_cycles: f64,
    /// Back: force from speed and gap.
    pub inverse_cycles: f64,
}

/// Textbook cycles of the control tick at worst.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TickBudget {
    /// In any phase.
    pub cycles: f64,
    /// On the smooth wall.
    pub smooth_cycles: f64,
}

/// Largest errors of the plant's default resolution, relative, and what skipping saves.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantBudget {
    /// Of the gap.
    pub max_gap_error: f64,
    /// Of the largest axial force.
    pub max_force_error: f64,
    /// Least factor by which letting the ring sleep saves elements visited.
    pub least_saving_of_elements: f64,
}

/// The whole firmware on the emulated board, over a deployment or the way back.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardBudget {
    /// Part of the time in which the core does not sleep.
    pub mean_load: f64,
    /// Longest control tick, part of its period.
    pub worst_tick: f64,
    /// Most of the stack, part of the memory that the statics leave.
    pub stack: f64,
}

/// What is aimed at: factors that depend on the machine, and what is not reached yet.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aims {
    /// Largest relative error of the reduced model in fixed point.
    pub model_error: f64,
    /// Cycles of the reduced model, either direction.
    pub model_cycles: f64,
    /// Cycles of the tick.
    pub tick_cycles: f64,
    /// Cycles of the tick on the smooth wall.
    pub smooth_tick_cycles: f64,
    /// Times faster than real time, the plant alone.
    pub plant_real_time_factor: f64,
    /// Cost of a crossing over that of the smooth wall.
    pub crossing_over_smooth: f64,
}

/// A bound and what was reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What is bounded.
    pub name: String,
    /// The bound.
    pub bound: f64,
    /// Whether it is a least value.
    pub at_least: bool,
    /// What was reached.
    pub reached: f64,
    /// Whether the bound is kept.
    pub holds: bool,
    /// Whether it is an aim, and fails nothing: the machine decides, or it is not reached
    /// yet.
    pub aim: bool,
}

impl Line {
    /// At most `bound`, whatever the machine.
    #[must_use]
    pub fn at_most(name: &str, bound: f64, reached: f64) -> Self {
        let holds = reached <= bound;
        Self { name: name.to_owned(), bound, at_least: false, reached, holds, aim: false }
    }

    /// At least `bound`, whatever the machine.
    #[must_use]
    pub fn at_least(name: &str, bound: f64, reached: f64) -> Self {
        Self { aim: false, ..Self::aim(name, bound, reached) }
    }

    /// At most `bound`, aimed at.
    #[must_use]
    pub fn aim_below(name: &str, bound: f64, reached: f64) -> Self {
        Self { aim: true, ..Self::at_most(name, bound, reached) }
    }

    /// At least `bound`, aimed at.
    #[must_use]
    pub fn aim(name: &str, bound: f64, reached: f64) -> Self {
        let holds = reached >= bound;
        Self { name: name.to_owned(), bound, at_least: true, reached, holds, aim: true }
    }

    /// Whether it is broken and no aim.
    #[must_use]
    pub fn broken(&self) -> bool {
        !self.holds && !self.aim
    }
}

impl Budget {
    /// The budget of this package.
    ///
    /// # Errors
    /// If the file is not as expected.
    pub fn shipped() -> Result<Self> {
        toml::from_str(include_str!("../../budget.toml")).context("budget.toml")
    }

    /// The bounds beside what was reached.
    #[must_use]
    pub fn lines(&self, report: &Report) -> Vec<Line> {
        let mut lines = Vec::new();
        if let Some(shipping) = report.variants.first() {
            lines.extend(self.model.lines(shipping));
            lines.extend(self.aims.model(shipping));
        }
        if let Some(account) = &report.account {
            lines.extend(self.tick.lines(account));
            let most = account.most as f64;
            lines.push(Line::aim_below("control tick, cycles", self.aims.tick_cycles, most));
            lines.push(Line::aim_below(
                "control tick on the smooth wall, cycles",
                self.aims.smooth_tick_cycles,
                account.smooth_most() as f64,
            ));
        }
        if let Some(usual) = report.plant.usual() {
            lines.extend(self.plant.lines(usual.gap_error, usual.force_error));
        }
        let costs = &report.plant.costs;
        let aims = &self.aims;
        lines.push(Line::at_least(
            "plant, elements visited without skipping over with",
            self.plant.least_saving_of_elements,
            costs.saving_of_elements,
        ));
        lines.push(Line::aim(
            "plant, times real time",
            aims.plant_real_time_factor,
            costs.plant_real_time_factor,
        ));
        lines.push(Line::aim(
            "cost of a crossing over the smooth wall",
            aims.crossing_over_smooth,
            costs.crossing_over_smooth.unwrap_or(f64::NAN),
        ));
        lines
    }
}

impl ModelBudget {
    /// Its lines for the shipping model; those of cycles if they are known.
    #[must_use]
    pub fn lines(&self, shipping: &Variant) -> Vec<Line> {
        let mut lines = Vec::new();
        for (name, course, cycles) in [
            ("forward", &shipping.forward, self.forward_cycles),
            ("inverse", &shipping.inverse, self.inverse_cycles),
        ] {
            let error = format!("model, {name}, error");
            lines.push(Line::at_most(&error, self.max_rel_error, course.max_rel_error));
            if let Some(reached) = course.cycles {
                let name = format!("model, {name}, cycles");
                lines.push(Line::at_most(&name, cycles, reached as f64));
            }
        }
        lines
    }
}

impl Aims {
    /// Those for the shipping model.
    fn model(&self, shipping: &Variant) -> Vec<Line> {
        let (forward, inverse) = (&shipping.forward, &shipping.inverse);
        let error = forward.max_rel_error.max(inverse.max_rel_error);
        let mut lines = vec![Line::aim_below("model, error", self.model_error, error)];
        if let Some(cycles) = forward.cycles.max(inverse.cycles) {
            let off = f64::from(u8::from(!shipping.on_front));
            lines.push(Line::aim_below("model, cycles", self.model_cycles, cycles as f64));
            lines.push(Line::aim_below("model, off the front of the five", 0.0, off));
        }
        lines
    }
}

impl TickBudget {
    /// Its lines for this account.
    #[must_use]
    pub fn lines(&self, account: &Firmware) -> [Line; 2] {
        let smooth = account.smooth_most() as f64;
        [
            Line::at_most("control tick, cycles", self.cycles, account.most as f64),
            Line::at_most("control tick on the smooth wall, cycles", self.smooth_cycles, smooth),
        ]
    }
}

impl PlantBudget {
    /// Its lines for these errors.
    #[must_use]
    pub fn lines(&self, gap_error: f64, force_error: f64) -> [Line; 2] {
        [
            Line::at_most("plant, error of the gap", self.max_gap_error, gap_error),
            Line::at_most("plant, error of the force", self.max_force_error, force_error),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_budget_reads() {
        let budget = Budget::shipped().unwrap();
        assert!(
            budget.plant.max_gap_error <= 0.005,
            "the gap's error is asked to be at most 0.5 %"
        );
    }

    #[test]
    fn a_bound_is_kept_exactly_and_broken_just_beyond() {
        assert!(Line::at_most("a", 1.0, 1.0).holds);
        let beyond = Line::at_most("a", 1.0, 1.0 + 1e-9);
        assert!(!beyond.holds && beyond.broken());
        assert!(Line::at_most("a", 1.0, f64::NAN).broken());
        let aim = Line::aim("b", 2.0, 1.9);
        assert!(!aim.holds && !aim.broken());
        assert!(Line::aim("b", 2.0, 2.0).holds);
    }

    #[test]
    fn an_unknown_bound_is_refused() {
        let text = include_str!("../../budget.toml").replace("max_gap_error", "max_gap_eror");
        assert!(toml::from_str::<Budget>(&text).is_err());
    }
}
