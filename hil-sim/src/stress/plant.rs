//! The plant at the ends of its ranges: every case is refused by name, or its state
//! stays finite, its penetration bounded and its energy accounted for.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::cases::{Case, draw};
use super::{drive, roll};

/// Deepest that the tread may be pressed in, parts of the radius: the hub.
const DEEPEST: f64 = 0.75;

/// Most that the tread may be faster than the unloaded motor, relative.
const OVERSPEED: f64 = 1.0 + 1e-9;

/// Worst cases listed for each figure.
const LISTED: usize = 3;

/// Cases drawn for every one asked for, so that enough are left when some are refused.
const DRAWN: f64 = 1.6;

/// What is looked at in every case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Depth of the tread over the deepest allowed, ring alone.
    RingPenetration,
    /// Energy taken out of the tread over what the resolution explains, ring alone.
    RingEnergy,
    /// Depth of the tread over the deepest allowed, whole rig.
    Penetration,
    /// Energy gained over what the stated approximations explain, whole rig.
    Energy,
    /// Separation from the wall over the clearance that a step can leave, whole rig.
    Separation,
    /// Speed of the tread over that of the unloaded motor.
    Overspeed,
}

/// A figure of a case, in parts of its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Which figure.
    pub figure: Figure,
    /// Its value over its limit: above 1 it is a failure.
    pub value: f64,
    /// The case.
    pub case: Case,
}

/// A case that failed, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// What happened.
    pub why: String,
    /// The case.
    pub case: Case,
}

/// What the plant stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Cases run.
    pub cases: usize,
    /// Cases refused before the run, by reason.
    pub refusals: BTreeMap<&'static str, usize>,
    /// An example of each refusal.
    pub refused: BTreeMap<&'static str, String>,
    /// Cases that failed.
    pub failures: Vec<Failure>,
    /// The worst of each figure.
    pub worst: Vec<Worst>,
}

/// How a case ended.
enum Ended {
    Refused(&'static str, String),
    Failed(String),
    Ran(Vec<(Figure, f64)>),
}

/// Runs `count` cases, not counting those refused; `done` is called after each.
#[must_use]
pub fn run(count: usize, seed: u64, done: &(dyn Fn() + Sync)) -> Report {
    let all = draw((count as f64 * DRAWN) as usize + 256, seed);
    let accepted: Vec<(Case, Option<Ended>)> =
        all.into_par_iter().map(|case| (case, refusal(&case))).collect();
    let mut left = count;
    let chosen: Vec<(Case, Option<Ended>)> = accepted
        .into_iter()
        .take_while(|(_, refused)| {
            let more = left > 0;
            left -= usize::from(more && refused.is_none());
            more
        })
        .collect();
    let ended: Vec<(Case, Ended)> = chosen
        .into_par_iter()
        .map(|(case, refused)| {
            let ended = refused.unwrap_or_else(|| {
                let ended = one(&case);
                done();
                ended
            });
            (case, ended)
        })
        .collect();
    gather(ended)
}

fn refusal(case: &Case) -> Option<Ended> {
    let refusal = drive::plant(case).check(case.preload_n).err()?;
    Some(Ended::Refused(refusal.name(), refusal.to_string()))
}

fn one(case: &Case) -> Ended {
    let rolled = match roll::run(case) {
        Ok(rolled) => rolled,
        Err(error) => return Ended::Failed(format!("ring: {error}")),
    };
    let drove = match drive::run(case, &drive::plant(case)) {
        Ok(drove) => drove,
        Err(error) => return Ended::Failed(error.to_string()),
    };
    let deepest = DEEPEST * roll::RADIUS_MM;
    Ended::Ran(vec![
        (Figure::RingPenetration, rolled.depth_mm / deepest),
        (Figure::RingEnergy, rolled.created_mj / rolled.resolved_mj),
        (Figure::Penetration, drove.depth_mm / deepest),
        (Figure::Energy, drove.created_mj / drove.allowed_mj),
        (Figure::Separation, drove.separation_mm / (case.step_mm + 1.0)),
        (Figure::Overspeed, drove.overspeed / OVERSPEED),
    ])
}

fn gather(ended: Vec<(Case, Ended)>) -> Report {
    let mut report = Report::default();
    let mut figures: BTreeMap<Figure, Vec<(f64, Case)>> = BTreeMap::new();
    for (case, ended) in ended {
        match ended {
            Ended::Refused(name, text) => {
                *report.refusals.entry(name).or_default() += 1;
                report.refused.entry(name).or_insert(text);
                continue;
            }
            Ended::Failed(why) => report.failures.push(Failure { why, case }),
            Ended::Ran(found) => {
                for (figure, value) in found {
                    if value > 1.0 || value.is_nan() {
                        let why = format!("{figure:?} at {value:.3} of its limit");
                        report.failures.push(Failure { why, case });
                    }
                    figures.entry(figure).or_default().push((value, case));
                }
            }
        }
        report.cases += 1;
    }
    for (figure, mut values) in figures {
        values.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = values.into_iter().take(LISTED);
        report.worst.extend(worst.map(|(value, case)| Worst { figure, value, case }));
    }
    report
}
