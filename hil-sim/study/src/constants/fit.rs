//! Least squares of the effective stiffening.

use anyhow::{Context, Result};
use interstage::model::effective_stiffness::{
    Kind, fast_values, load_values, run_values, step_values,
};
use interstage::model::formula::Formula;
use nalgebra::{DMatrix, DVector};

use super::data::Row;
use super::design::{DesignPoint, Use};

/// Gap below which the wheel has all but sunk in, mm: not fitted.
const LEAST_GAP_MM: f64 = 0.01;
/// Utilisation above which no rubber holds: not fitted.
const MOST_UTILISATION: f64 = 1.8;
/// Radial forces, N, and speeds, mm/s, outside which the weight falls.
const WEIGHTED_N: (f64, f64) = (14.0, 170.0);
const WEIGHTED_MM_S: (f64, f64) = (1.0, 100.0);
/// Utilisation above which the weight is a third.
const WEIGHTED_UTILISATION: f64 = 1.55;
/// Relative error of the stiffness that a crossing of weight 1 turns into as many parts
/// of the gap's tolerance.
const SENSITIVITY: f64 = 5.0;

/// Effective over relaxed stiffness that a crossing of the ring shows.
pub fn observed_stiffness(formula: &Formula, row: &Row) -> f64 {
    let shape = Formula { step_mm: row.case.step_mm, ..*formula };
    let contact = shape.contact(row.gap_mm);
    let slope = contact.axial / contact.radial;
    let (force, per_stiffness) = if row.case.kind.driven {
        (row.case.preload_n - row.case.load_n * slope, contact.radial + slope * contact.axial)
    } else {
        (row.case.preload_n, contact.radial)
    };
    force / per_stiffness / formula.k_inf
}

/// Whether a crossing takes part in the fit.
pub fn takes_part(row: &Row) -> bool {
    row.of != Use::Hold && row.gap_mm > LEAST_GAP_MM && row.utilisation < MOST_UTILISATION
}

/// Coefficients of a kind in the order of [`Kind::terms`]: weighted least squares of the
/// relative error of the effective stiffness.
pub fn fit(formula: &Formula, kind: Kind, rows: &[Row]) -> Result<Vec<f64>> {
    let used: Vec<&Row> = rows.iter().filter(|r| r.case.kind == kind && takes_part(r)).collect();
    let terms: Vec<[usize; 4]> = kind.terms().collect();
    let mut matrix = DMatrix::zeros(used.len(), terms.len());
    let mut right = DVector::zeros(used.len());
    for (index, row) in used.iter().enumerate() {
        let shape = Formula { step_mm: row.case.step_mm, ..*formula };
        let stiffness = observed_stiffness(formula, row);
        let weight = weight(&shape, row, stiffness) / stiffness;
        let x = shape.fast_part(kind, row.case.speed_mm_s);
        let by_x = fast_values(x);
        let by_run = run_values(shape.run_mm(row.gap_mm) / shape.radius_mm);
        let by_step = step_values(shape.step_mm / shape.radius_mm);
        let by_load = load_values(row.case.load_n / shape.unit_force_n());
        let factor = weight * (shape.stiffening - 1.0) * x;
        for (column, &[i, j, k, l]) in terms.iter().enumerate() {
            matrix[(index, column)] = factor * by_x[i] * by_run[j] * by_step[k] * by_load[l];
        }
        right[index] = weight * (stiffness - 1.0);
    }
    let (q, r) = matrix.qr().unpack();
    let solution = r.solve_upper_triangular(&q.tr_mul(&right)).context("the fit is singular")?;
    Ok(solution.iter().copied().collect())
}

/// Weight of a crossing: by the root of how its stiffness moves the gap, so that neither
/// gap nor force is fitted at the other's cost, and falling outside the domain of use.
fn weight(shape: &Formula, row: &Row, stiffness: f64) -> f64 {
    let DesignPoint { kind, speed_mm_s, preload_n, load_n, .. } = row.case;
    let force = |gap: f64| {
        let elastic = stiffness * shape.relaxed_force_n(kind, gap);
        elastic + load_n * shape.contact(gap).slope()
    };
    let little = 1e-4;
    let slope = (force(row.gap_mm + little) / force(row.gap_mm - little)).ln() / (2.0 * little);
    let sensitivity = -1.0 / slope / (0.01 * row.gap_mm).max(0.01);
    let inside = |value: f64, (low, high): (f64, f64)| (value / low).min(high / value).min(1.0);
    let held = if row.utilisation > WEIGHTED_UTILISATION { 0.3 } else { 1.0 };
    inside(preload_n, WEIGHTED_N).powi(3)
        * inside(speed_mm_s, WEIGHTED_MM_S)
        * (sensitivity / SENSITIVITY).clamp(0.1, 10.0).sqrt()
        * held
}

/// Error of the built-in constants' gap at a crossing, in parts of 1 % of the gap or
/// 10 um, whichever is larger.
pub fn gap_error(formula: &Formula, row: &Row) -> f64 {
    let DesignPoint { kind, step_mm, speed_mm_s, preload_n, load_n } = row.case;
    let shape = Formula { step_mm, ..*formula };
    let load = kind.driven.then_some(load_n);
    let gap = shape.gap_mm(kind.direction, speed_mm_s, preload_n, load);
    (gap - row.gap_mm) / (0.01 * row.gap_mm).max(0.01)
}
