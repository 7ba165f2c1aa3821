//! Error against cost of the ring: the same crossings at every setting, compared with a
//! setting twenty times as fine.

use std::time::Instant;

use interstage::rig::Rig;
use serde::Serialize;

use super::balance::{Axial, BalanceError};
use super::crossing::{CrossingCase, cross};
use super::draw::ELEMENTS;
use super::rig::Resolution;

/// How much finer the reference is, in elements and in stride.
pub const FINER: usize = 20;

/// How finely a ring is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Elements around the ring.
    pub elements: usize,
    /// Longest axial travel of a step, mm.
    pub stride_mm: f64,
}

impl Setting {
    /// As deployments are computed.
    pub fn usual() -> Self {
        Self { elements: ELEMENTS, stride_mm: Resolution::default().stride_mm }
    }

    /// This much finer in both.
    pub fn finer(self, times: usize) -> Self {
        Self { elements: self.elements * times, stride_mm: self.stride_mm / times as f64 }
    }

    /// Elements and stride.
    pub const fn both(self) -> (usize, f64) {
        (self.elements, self.stride_mm)
    }

    /// From coarse to fine: the settings of the curve.
    pub fn sweep() -> Vec<Self> {
        let strides = [0.08, 0.04, 0.02, 0.01];
        let of = |elements| strides.map(|stride_mm| Self { elements, stride_mm });
        [360, 720, 1440, 2880].into_iter().flat_map(of).collect()
    }
}

/// A point of the curve: error of the worst crossing, cost of the mean one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Elements around the ring.
    pub elements: usize,
    /// Axial travel of a step, mm.
    pub stride_mm: f64,
    /// Largest relative error of the gap.
    pub gap_error: f64,
    /// Largest relative error of the largest climbing force.
    pub force_error: f64,
    /// Time of a crossing, ns; the least of several.
    pub wall_ns: f64,
}

/// The crossings that the error is measured on: speed, negative on retraction, preload and load.
pub fn cases() -> Vec<(f64, f64, Axial)> {
    let mut all = Vec::new();
    for (speed, preload) in [(5.0, 100.0), (8.0, 40.0), (25.0, 60.0)] {
        for axial in [Axial::Pushed, Axial::Driven(6.7)] {
            all.extend([(speed, preload, axial), (-speed, preload, axial)]);
        }
    }
    all
}

/// Errors of isolated crossings at these settings, against the usual one made
/// [`FINER`] times as fine; `done` is called after every crossing of the reference.
pub fn work_precision(
    rig: &Rig,
    settings: &[Setting],
    repeats: usize,
    done: impl Fn(),
) -> Result<Vec<Point>, BalanceError> {
    let reference = Setting::usual().finer(FINER);
    let mut exact = Vec::new();
    for of in cases() {
        let result = cross(&CrossingCase::of(rig, reference.both(), of))?;
        exact.push((of, result.gap_mm, result.corner_force_n));
        done();
    }
    let point = |&setting: &Setting| {
        let mut point = Point {
            elements: setting.elements,
            stride_mm: setting.stride_mm,
            gap_error: 0.0,
            force_error: 0.0,
            wall_ns: 0.0,
        };
        for &(of, gap_mm, force_n) in &exact {
            let mut least = f64::INFINITY;
            for _ in 0..repeats.max(1) {
                let started = Instant::now();
                let result = cross(&CrossingCase::of(rig, setting.both(), of))?;
                least = least.min(started.elapsed().as_nanos() as f64);
                point.gap_error = point.gap_error.max((result.gap_mm / gap_mm - 1.0).abs());
                let force = (result.corner_force_n / force_n - 1.0).abs();
                point.force_error = point.force_error.max(force);
            }
            point.wall_ns += least / exact.len() as f64;
        }
        Ok(point)
    };
    settings.iter().map(point).collect()
}
