//! Bounds on what is measured: `budget.toml` of this package.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::Report;

/// The bounds.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Of the plant.
    pub plant: PlantBudget,
    /// What depends on the machine.
    pub aims: Aims,
}

/// Largest errors of the plant's default resolution, relative.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantBudget {
    /// Of the gap.
    pub max_gap_error: f64,
    /// Of the largest axial force.
    pub max_force_error: f64,
}

/// Least factors that depend on the machine.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aims {
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
    /// Whether the machine decides: then it is an aim, and fails nothing.
    pub machine: bool,
}

impl Line {
    /// At most `bound`, whatever the machine.
    #[must_use]
    pub fn at_most(name: &str, bound: f64, reached: f64) -> Self {
        let holds = reached <= bound;
        Self { name: name.to_owned(), bound, at_least: false, reached, holds, machine: false }
    }

    /// At least `bound`, depending on the machine.
    #[must_use]
    pub fn aim(name: &str, bound: f64, reached: f64) -> Self {
        let holds = reached >= bound;
        Self { name: name.to_owned(), bound, at_least: true, reached, holds, machine: true }
    }

    /// Whether it is broken and the machine is no excuse.
    #[must_use]
    pub fn broken(&self) -> bool {
        !self.holds && !self.machine
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
        if let Some(mesh) = report.plant.default_mesh() {
            lines.extend(self.plant.lines(mesh.max_gap_error, mesh.max_force_error));
        }
        let costs = &report.plant.costs;
        let aims = &self.aims;
        lines.push(Line::aim(
            "plant, times real time",
            aims.plant_real_time_factor,
            costs.plant_real_time_factor,
        ));
        lines.push(Line::aim(
            "cost of a crossing over the smooth wall",
            aims.crossing_over_smooth,
            costs.crossing_over_smooth,
        ));
        lines
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
