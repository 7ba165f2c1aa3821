//! Over friction and load, known and unknown: the scheduled strategy and the others.

use hil_sim::envelope::{Grid, campaign};
use hil_sim::scenario::{ControllerKind, Scenario};

#[test]
fn the_scheduled_strategy_completes_wherever_another_one_does() {
    let scenario = Scenario::resolve(None, None, &[]).expect("a scenario");
    let found =
        campaign(&scenario, Grid::USUAL).and_then(|all| all.complete(&|| {})).expect("an envelope");
    assert!(found.not_contained().is_empty(), "{:?}", found.not_contained());
    let (scheduled, constant) =
        (found.area(ControllerKind::Scheduled), found.area(ControllerKind::Constant));
    assert!(scheduled.known >= 1.2 * constant.known, "{scheduled:?} {constant:?}");
    assert!(scheduled.unknown >= 1.2 * constant.unknown, "{scheduled:?} {constant:?}");
    // Each place has its four strategies in a row, the scheduled one first.
    let places = found.cells.chunks(4).filter(|at| at[0].good());
    let slower = places.filter(|at| {
        let mut others = at.iter().filter(|cell| cell.good());
        others.any(|cell| at[0].duration_s > cell.duration_s.map(|s| 1.03 * s))
    });
    let slower: Vec<_> = slower.map(|at| (at[0].known, at[0].friction, at[0].load_n)).collect();
    assert_eq!(slower, []);
}
