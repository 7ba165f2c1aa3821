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
}
