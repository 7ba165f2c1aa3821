//! Over friction and load, known and unknown: the scheduled strategy and the others.

use hil_sim::envelope::{Grid, envelope};
use hil_sim::scenario::Scenario;

#[test]
fn the_scheduled_strategy_completes_wherever_another_one_does() {
    let scenario = Scenario::resolve(None, None, &[]).expect("a scenario");
    let found = envelope(&scenario, Grid::USUAL, &|| {}).expect("an envelope");
    assert!(found.not_contained().is_empty(), "{:?}", found.not_contained());
    let (scheduled, constant) = (found.area("scheduled"), found.area("constant"));
    assert!(scheduled.known >= 1.2 * constant.known, "{scheduled:?} {constant:?}");
    assert!(scheduled.unknown >= 1.2 * constant.unknown, "{scheduled:?} {constant:?}");
}
