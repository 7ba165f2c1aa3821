//! What a campaign draws.

use serde::Serialize;

use crate::plant::mismatch::Mismatch;
use crate::plant::spread::Section;
use crate::scenario::{MismatchDraw, Scenario};

/// A key that differs from run to run, or by which the runs differ from the rig that the
/// controller knows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Drawn {
    pub key: String,
    /// Least value over the runs.
    pub least: f64,
    /// Largest value over the runs.
    pub most: f64,
}

/// The mismatch of these seeds: every key that is not neutral in all of them.
pub(super) fn mismatch(scenario: &Scenario, seeds: &[u64]) -> Vec<Drawn> {
    let of = |seed: u64| {
        let mut scenario = scenario.clone();
        scenario.run.seed = seed;
        scenario.drawn_mismatch()
    };
    // As stated, all of them are the same.
    let seeds = if scenario.run.mismatch != MismatchDraw::Stated { seeds } else { &seeds[..1] };
    let drawn: Vec<Mismatch> = seeds.iter().map(|seed| of(*seed)).collect();
    let range = |index: usize| {
        let values = drawn.iter().filter_map(|one| Some(one.values().nth(index)?.1));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    };
    Mismatch::default()
        .values()
        .enumerate()
        .map(|(index, (field, neutral))| (field, neutral, range(index)))
        .filter(|(_, neutral, range)| *range != (*neutral, *neutral))
        .map(|(field, _, (least, most))| {
            let key = format!("mismatch.{}", field.name);
            Drawn { key, least, most }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_or_stated_is_listed() {
        let mut scenario = Scenario::default();
        assert!(mismatch(&scenario, &[1, 2]).is_empty());
        scenario.mismatch.backlash_mm = 0.2;
        let stated = mismatch(&scenario, &[1, 2]);
        assert_eq!(stated.len(), 1);
        assert_eq!((stated[0].least, stated[0].most), (0.2, 0.2));
        scenario.run.mismatch = MismatchDraw::Wide;
        let wide = mismatch(&scenario, &[1, 2]);
        let drawn = Mismatch::FIELDS.iter().filter(|field| field.wide.is_some()).count();
        assert_eq!(wide.len(), drawn);
        assert!(wide[0].key == "mismatch.friction" && wide[0].least < wide[0].most);
    }
}
