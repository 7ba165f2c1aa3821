//! Over friction and load on the wheel: which preload strategy completes without slip, and in
//! which time. Once with both known to the controller, once with a controller that believes the
//! nominal ones.

mod grid;
mod picture;

use serde::{Deserialize, Serialize};

use crate::campaign::{Campaign, Watch};
use crate::compare::STRATEGIES;
use crate::report::verdict::SLIP_SEEN_MM;
use crate::scenario::{ControllerKind, Scenario};
use crate::session::{Options, RunError, Session, run_session};

pub use grid::Grid;
pub(crate) use picture::picture;

/// One strategy at one place of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Friction of tread on wall.
    pub friction: f64,
    /// Axial load on this wheel, N.
    pub load_n: f64,
    /// Whether the controller knows both; else it believes the scenario's.
    pub known: bool,
    pub controller: ControllerKind,
    /// Whether the drive reached the end of travel with every step crossed and no fault.
    pub completed: bool,
    /// Gross slip, mm; none if no run could be made.
    pub slip_mm: Option<f64>,
    /// From the accepted command to arrival, s; none if the run did not complete.
    pub duration_s: Option<f64>,
}

impl Cell {
    /// Whether it completed without slip.
    pub fn good(&self) -> bool {
        self.completed && self.slip_mm.is_some_and(|slip_mm| slip_mm <= SLIP_SEEN_MM)
    }

    /// Whether this is another strategy's cell at the same place.
    fn same_place(&self, other: &Self) -> bool {
        (self.friction, self.load_n, self.known) == (other.friction, other.load_n, other.known)
    }
}

/// Part of the grid in which a strategy completes without slip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Area {
    /// With friction and load known to the controller.
    pub known: f64,
    /// With a controller that believes the nominal ones.
    pub unknown: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    /// Frictions, ascending.
    pub frictions: Vec<f64>,
    /// Loads on the wheel, ascending, N.
    pub loads_n: Vec<f64>,
    /// Friction and load that the controller believes, N.
    pub nominal: (f64, f64),
    /// Every cell: known first, then by friction, load and strategy.
    pub cells: Vec<Cell>,
}

impl Envelope {
    /// Part of the grid in which this strategy completes without slip.
    pub fn area(&self, controller: ControllerKind) -> Area {
        let part = |known: bool| {
            let of = |cell: &&Cell| cell.controller == controller && cell.known == known;
            let all = self.cells.iter().filter(of);
            let good = all.clone().filter(|cell| cell.good()).count();
            good as f64 / all.count().max(1) as f64
        };
        Area { known: part(true), unknown: part(false) }
    }

    /// The cells in which another strategy completes without slip and the scheduled one does
    /// not; none if its region contains those of the others.
    pub fn not_contained(&self) -> Vec<&Cell> {
        let scheduled = |cell: &Cell| cell.controller == ControllerKind::Scheduled;
        let lacks = |cell: &&Cell| {
            self.cells.iter().any(|own| scheduled(own) && own.same_place(cell) && !own.good())
        };
        self.cells.iter().filter(|cell| cell.good() && !scheduled(cell)).filter(lacks).collect()
    }

    /// Mean of this strategy's time over the scheduled one's, in the cells where both complete
    /// without slip; none without such a cell.
    pub(crate) fn time_ratio(&self, controller: ControllerKind, known: bool) -> Option<f64> {
        let good = || self.cells.iter().filter(move |cell| cell.known == known && cell.good());
        let of = |kind| good().filter(move |cell| cell.controller == kind);
        let ratio = |cell: &Cell| {
            let own = of(ControllerKind::Scheduled).find(|own| own.same_place(cell))?;
            Some(cell.duration_s? / own.duration_s?)
        };
        let ratios: Vec<f64> = of(controller).filter_map(ratio).collect();
        (!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64)
    }
}

/// Known or not, friction and load, N.
type Place = (bool, f64, f64);

/// The campaign of every strategy at every place of the grid, on the plant of the scenario's seed
/// with that friction and load.
pub fn campaign(
    scenario: &Scenario,
    grid: Grid,
) -> Result<Campaign<'_, Place, Vec<Cell>, Envelope, RunError>, RunError> {
    // What is refused everywhere is no outcome.
    Session::new(scenario, Options::default())?;
    let (frictions, loads_n) = (grid.frictions(), grid.loads_n());
    let mut cases = Vec::new();
    for known in [true, false] {
        for &friction in &frictions {
            cases.extend(loads_n.iter().map(|load_n| (known, friction, *load_n)));
        }
    }
    // All strategies or none at a place, so that those of an interrupted campaign compare.
    let run = |place: &Place, watch: Watch| {
        let cells = STRATEGIES.map(|kind| cell(scenario, *place, kind));
        (watch.done)();
        Ok(Some(cells.to_vec()))
    };
    let loads = &scenario.rig.plant;
    let nominal = (loads.mu, loads.top_load_n * loads.top_load_share);
    let fold = move |lines: Vec<(Place, Vec<Cell>)>| {
        let cells = lines.into_iter().flat_map(|(_, cells)| cells).collect();
        Envelope { frictions, loads_n, nominal, cells }
    };
    Ok(Campaign { steps: ("places", 1), cases, run: Box::new(run), fold: Box::new(fold) })
}

fn cell(scenario: &Scenario, (known, friction, load_n): Place, controller: ControllerKind) -> Cell {
    let mut scenario = scenario.clone();
    scenario.run.controller = controller;
    if known {
        let loads = &mut scenario.rig.plant;
        (loads.mu, loads.top_load_n, loads.top_load_share) = (friction, load_n, 1.0);
    }
    // The plant has exactly these, whatever its seed draws.
    let session = Session::new(&scenario, Options::default()).map(|session| {
        session.with_plant(|plant, _| {
            plant.set_friction(friction);
            plant.set_load(load_n);
        })
    });
    let recording = session.and_then(|session| run_session(session, &scenario));
    let summary = recording.ok().map(|recording| recording.summary);
    let completed = summary.as_ref().is_some_and(|summary| summary.completed);
    Cell {
        friction,
        load_n,
        known,
        controller,
        completed,
        slip_mm: summary.as_ref().map(|summary| summary.slip_mm),
        duration_s: summary.and_then(|summary| summary.duration_s).filter(|_| completed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ControllerKind::{Limit, Scheduled};

    /// A cell that completed without slip in this time, or did not.
    fn made(controller: ControllerKind, friction: f64, duration_s: Option<f64>) -> Cell {
        Cell {
            friction,
            load_n: 5.0,
            known: true,
            controller,
            completed: duration_s.is_some(),
            slip_mm: Some(0.0),
            duration_s,
        }
    }

    #[test]
    fn areas_times_and_what_is_not_contained() {
        let mut cells = vec![
            made(Scheduled, 0.6, None),
            made(Scheduled, 0.9, Some(5.0)),
            made(Scheduled, 1.2, Some(4.0)),
            made(Limit, 0.6, Some(9.0)),
            made(Limit, 0.9, Some(6.0)),
            made(Limit, 1.2, Some(4.0)),
        ];
        let nominal = (1.1, 6.7);
        let envelope = |cells: &[Cell]| Envelope {
            frictions: vec![0.6, 0.9, 1.2],
            loads_n: vec![5.0],
            nominal,
            cells: cells.to_vec(),
        };
        let all = envelope(&cells);
        assert_eq!(all.area(Scheduled), Area { known: 2.0 / 3.0, unknown: 0.0 });
        assert_eq!(all.area(Limit).known, 1.0);
        let missing: Vec<f64> = all.not_contained().iter().map(|cell| cell.friction).collect();
        assert_eq!(missing, [0.6]);
        assert!((all.time_ratio(Limit, true).unwrap() - 1.1).abs() < 1e-12);
        assert_eq!(all.time_ratio(Limit, false), None);
        // With slip it has not done it.
        cells[3].slip_mm = Some(1.0);
        assert!(envelope(&cells).not_contained().is_empty());
    }
}
