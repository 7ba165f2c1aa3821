//! A log run again: recorded inputs through the controller on this host, whose outputs must
//! be the recorded ones to the bit.

use interstage::fault::Limit;
use interstage::log::{Flags, Record};
use interstage::model::{Plan, PlanRequest, Planner};
use interstage::rig::{Rig, RigError};
use interstage::supervise::Mode;
use interstage::tick::{Controller, Entry, Event, Input, Output, State};
use serde::Serialize;
use serde_json::Value;

use crate::record::{self, Columns, Mark, Run};

/// Outcome of a replay.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Replayed {
    /// Ticks run again.
    pub ticks: u64,
    /// Ticks that could not be run, because data before them is missing.
    pub blind: u64,
    /// The first mark of missing data, and the tick after it.
    pub missing: Option<(u32, Mark)>,
    /// Log entries compared.
    pub events: u64,
    /// Plans from the log, and plans that were computed again.
    pub plans: (u64, u64),
    pub difference: Option<Difference>,
}

impl Replayed {
    /// Every tick of the log was run again and gave what was recorded.
    pub const fn is_equal(&self) -> bool {
        self.difference.is_none() && self.blind == 0 && self.ticks > 0
    }
}

/// First difference between replay and log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    pub tick: u32,
    /// Its contact stage, as recorded.
    pub contact: &'static str,
    /// The stage of the tick that gave the quantity.
    pub stage: &'static str,
    pub quantity: &'static str,
    pub recorded: String,
    pub replayed: String,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { tick, contact, stage, quantity, recorded, replayed } = self;
        write!(
            f,
            "tick {tick} ({contact}): {stage}: {quantity} was {recorded} and is now {replayed}"
        )
    }
}

/// Runs a log again on the controller of `rig`, up to the first difference.
///
/// After a gap in the log the controller's state is not known: ticks from there to the
/// next start of the target are counted as blind.
pub fn replay(run: &Run, rig: &Rig) -> Result<Replayed, RigError> {
    let controller = Controller::try_build(rig)?;
    let mut replay = Replay {
        planner: Planner::try_build(rig)?,
        since: run.since_boot(0),
        state: State::default(),
        request: None,
        result: Replayed::default(),
    };
    let (mut marks, mut blind) = (run.marks.iter().peekable(), starts_late(run));
    let mut boot = 0;
    replay.begin();
    for (place, row) in run.rows.iter().enumerate() {
        while let Some((_, mark)) = marks.next_if(|(at, _)| *at <= place) {
            match mark {
                Mark::Restart => {
                    (boot, blind) = (boot + 1, false);
                    replay.since = run.since_boot(boot);
                    replay.begin();
                }
                // Garbage was no frame before either; the flag of the next tick marks those
                // that never ran.
                Mark::Garbage { .. } | Mark::Overrun { .. } => {}
                Mark::Lost { .. }
                | Mark::Skipped { .. }
                | Mark::Joined { .. }
                | Mark::Schema { .. } => {
                    blind = true;
                    replay.result.missing.get_or_insert((row.tick, *mark));
                }
            }
        }
        if blind {
            replay.result.blind += 1;
            continue;
        }
        replay.result.ticks += 1;
        replay.result.difference = replay.tick(&controller, row);
        if replay.result.difference.is_some() {
            break;
        }
    }
    Ok(replay.result)
}

/// Whether the rows begin after boot: their first mode shows it.
fn starts_late(run: &Run) -> bool {
    let first = run.rows.first().and_then(Columns::telemetry);
    first.is_some_and(|seen| !matches!(seen.mode, Mode::Boot | Mode::SelfTest))
}

/// A replay in progress.
struct Replay {
    planner: Planner,
    /// The part of the log since the present start.
    since: Run,
    state: State,
    /// The latest request, for a plan that is not in the log.
    request: Option<PlanRequest>,
    result: Replayed,
}

impl Replay {
    /// The target starts; the position is that of the record of the run before.
    fn begin(&mut self) {
        let place = self.since.restart().and_then(|restart| restart.place());
        (self.state, self.request) = (State::restored(place), None);
    }

    /// Runs a tick again; the first thing that differs.
    fn tick(&mut self, controller: &Controller, row: &Columns) -> Option<Difference> {
        let flags = row.flags();
        let input = Input {
            now: row.tick,
            sensors: row.sensors(),
            command: flags.command(),
            service: flags.has(Flags::SERVICE).then(|| self.since.service(row.tick)),
            plan: flags.has(Flags::PLAN).then(|| self.plan(row.tick)).flatten(),
            overrun: flags.has(Flags::OVERRUN),
            emergency_stop: flags.has(Flags::EMERGENCY),
        };
        let output = controller.step(&mut self.state, &input);
        if let Some(request) = output.request {
            self.request = Some(request);
        }
        self.compare(row, &input, &output)
    }

    /// The plan that the tick was given: that of the log, or the planner's own.
    fn plan(&mut self, tick: u32) -> Option<Plan> {
        let logged = self.since.plans.iter().find(|(at, _)| *at == tick);
        if let Some((_, plan)) = logged {
            self.result.plans.0 += 1;
            return Some(*plan);
        }
        self.result.plans.1 += 1;
        self.request.map(|request| self.planner.plan(&request))
    }

    /// The logged plan of this tick and the planner's answer to the same request; none if plan
    /// or request is not in the log, or two requests have this number.
    fn planned(&self, tick: u32) -> Option<(Plan, Plan)> {
        let (_, recorded) = self.since.plans.iter().find(|(at, _)| *at == tick)?;
        let all = self.since.requests.iter().map(|(_, request)| request);
        let mut asked = all.filter(|request| request.sequence == recorded.sequence);
        let request = asked.next().filter(|_| asked.next().is_none())?;
        Some((*recorded, self.planner.plan(request)))
    }

    fn compare(&mut self, row: &Columns, input: &Input, output: &Output) -> Option<Difference> {
        let differs = |stage, quantity, recorded: String, replayed: String| Difference {
            tick: row.tick,
            contact: record::stage_name(row.stage),
            stage,
            quantity,
            recorded,
            replayed,
        };
        let Some(seen) = row.telemetry_over(&output.telemetry) else {
            let numbers = format!("mode {}, stage {}", row.mode, row.stage);
            return Some(differs("log", "mode and stage", numbers, "a meaning".to_owned()));
        };
        if let Some((recorded, replayed)) = self.planned(row.tick)
            && recorded != replayed
        {
            return Some(differs("planner", "plan", text(&recorded), text(&replayed)));
        }
        let again = Record::of(input, output);
        if seen != output.telemetry {
            let recorded = Record { telemetry: seen, ..again };
            let [recorded, replayed] =
                [recorded, again].map(|record| columns(&Columns::of(&record, &input.sensors)));
            let differing = |name: &&str| recorded[*name] != replayed[*name];
            for stage in STAGES {
                if let Some(name) = given_by(stage).find(differing) {
                    let (recorded, replayed) = (&recorded[name], &replayed[name]);
                    return Some(differs(stage, name, recorded.to_string(), replayed.to_string()));
                }
            }
        }
        if again.flags != row.flags() {
            let bits = |bits: u16| format!("{bits:#018b}");
            let (flags, again) = (bits(row.flags), bits(again.flags.0));
            return Some(differs("bridges, requests and entries", "flags", flags, again));
        }
        let asked = self.since.requests.iter().find(|(at, _)| *at == row.tick);
        if let (Some((_, recorded)), Some(replayed)) = (asked, output.request)
            && *recorded != replayed
        {
            return Some(differs("request", "request for a plan", text(recorded), text(&replayed)));
        }
        let (recorded, replayed) = self.events(row.tick, output);
        (recorded != replayed)
            .then(|| differs("log entries", "entries", text(&recorded), text(&replayed)))
    }

    /// Entries of a tick in the log and in the replay; none of either if the log lacks them.
    fn events(&mut self, tick: u32, output: &Output) -> (Vec<Entry>, Vec<Entry>) {
        let from = self.since.events.iter().filter(|entry| entry.at == tick);
        let logged: Vec<Entry> = from.filter(|entry| !is_of_board(entry.event)).copied().collect();
        if logged.len() != output.events.len() {
            return (Vec::new(), Vec::new());
        }
        self.result.events += logged.len() as u64;
        (logged, output.events.to_vec())
    }
}

fn text(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}")
}

/// The columns of a row by their names.
fn columns(row: &Columns) -> Value {
    serde_json::to_value(row).unwrap_or_default()
}

/// The stages of a tick in their order.
const STAGES: [&str; 8] =
    ["sensing", "odometry", "mode", "contact", "plan", "schedule", "loops", "vibration"];

/// Columns beside the quantities, and the stages that give them.
const OTHERS: [(&str, &[&str]); 3] = [
    ("mode", &["mode", "retracts", "fault"]),
    ("contact", &["stage", "level"]),
    ("loops", &["drive_duty", "pretightener_duty"]),
];

fn given_by(stage: &str) -> impl Iterator<Item = &'static str> {
    let others = OTHERS.into_iter().filter(move |one| one.0 == stage).flat_map(|one| one.1);
    let quantities = Columns::QUANTITIES.iter().filter(move |column| column.stage == stage);
    others.copied().chain(quantities.map(|column| column.name))
}

/// Whether the board reports it, not the controller.
const fn is_of_board(event: Event) -> bool {
    matches!(event, Event::Lost(_) | Event::Restart(_) | Event::Limit(Limit::CoreHalted))
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use interstage::units::Millimetres;

    use super::*;
    use crate::scenario::Scenario;
    use crate::session::{self, RunningRig};

    fn stream() -> &'static [u8] {
        static STREAM: OnceLock<Vec<u8>> = OnceLock::new();
        STREAM.get_or_init(|| {
            let sets = ["run.seed=4".to_owned()];
            let scenario = Scenario::resolve(Some("prototype"), None, &sets).unwrap();
            session::run(&scenario, session::Options::ROWS).unwrap().stream
        })
    }

    #[test]
    fn rows_alone_do_and_the_planner_makes_up_for_the_plans() {
        let run = Run::of_stream(stream());
        let rows = Run { rows: run.rows.clone(), ..Run::default() };
        let result = replay(&rows, &Rig::prototype()).unwrap();
        assert!(result.is_equal(), "{result:?}");
        assert_eq!(result.plans, (0, replay(&run, &Rig::prototype()).unwrap().plans.0));
    }

    #[test]
    fn a_plan_that_is_not_the_planner_s_is_found() {
        let mut run = Run::of_stream(stream());
        let (tick, plan) = &mut run.plans[1];
        plan.gap += interstage::units::Q16::from_bits(1);
        let tick = *tick;
        let difference = replay(&run, &Rig::prototype()).unwrap().difference.expect("different");
        assert_eq!((difference.tick, difference.stage), (tick, "planner"));
    }

    #[test]
    fn a_start_from_the_record_of_the_run_before_is_run_again_from_there() {
        let scenario = Scenario::resolve(Some("prototype"), None, &[]).unwrap();
        let mut session = session::Session::new(&scenario, session::Options::ROWS).unwrap();
        let mut bytes = Vec::new();
        for _ in 0..2 {
            let operator = session::once(scenario.run.direction);
            session::drive(&mut session, 4.0, operator, |_, _, _| false).unwrap();
            bytes.extend(session.take_log(false));
            session.restart();
        }
        let run = Run::of_stream(&bytes);
        assert_eq!(run.counts.restarts, 1);
        let place = run.since_boot(1).restart().and_then(|restart| restart.place());
        assert!(place.is_some_and(|place| place.position > Millimetres::from_num(10)), "{place:?}");
        let result = replay(&run, &Rig::prototype()).unwrap();
        assert!(result.difference.is_none() && result.blind == 0, "{result:?}");
        // Ticks of both starts have the same numbers but different plans.
        assert!(result.plans.0 >= 3 && result.plans.1 == 0, "{:?}", result.plans);
        let mut forgotten = run.clone();
        forgotten.events.retain(|entry| !matches!(entry.event, Event::Restart(_)));
        for boot in &mut forgotten.boots {
            boot.events = 0;
        }
        let result = replay(&forgotten, &Rig::prototype()).unwrap();
        assert!(result.difference.is_some());
    }

    #[test]
    fn every_column_of_the_state_belongs_to_a_stage() {
        let staged: Vec<&str> = STAGES.into_iter().flat_map(given_by).collect();
        let row = columns(&Columns::default());
        let row = row.as_object().unwrap();
        assert!(staged.iter().all(|name| row.contains_key(*name)));
        let given = |name: &str| {
            ["tick", "t_s", "command", "flags"].contains(&name)
                || ["_code", "_at", "_on", "_error"].iter().any(|end| name.ends_with(end))
        };
        let missing: Vec<_> =
            row.keys().filter(|n| !given(n) && !staged.contains(&&n[..])).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn another_rig_differs() {
        let mut rig = Rig::prototype();
        rig.sense.angle_zero_code += 2.0;
        let result = replay(&Run::of_stream(stream()), &rig).unwrap();
        assert!(!result.is_equal());
        assert_eq!(result.difference.map(|difference| difference.quantity), Some("radius_mm"));
    }

    #[test]
    fn ticks_after_a_gap_do_not_count_as_equal() {
        let mut frames = Vec::new();
        record::Decoder::new().read(stream(), &mut |item| {
            frames.extend(if let record::Item::Frame(bytes) = item { Some(bytes) } else { None });
        });
        frames.remove(40);
        let torn = frames.concat();
        let run = Run::of_stream(&torn);
        let result = replay(&run, &Rig::prototype()).unwrap();
        assert!(result.difference.is_none() && !result.is_equal());
        assert!(matches!(result.missing, Some((_, Mark::Lost { frames: 1, .. }))));
        assert_eq!(result.ticks + result.blind, run.rows.len() as u64);
        // After a restart the state is known again.
        let twice = [&torn[..], stream()].concat();
        let result = replay(&Run::of_stream(&twice), &Rig::prototype()).unwrap();
        assert!(result.ticks > result.blind && result.difference.is_none());
    }
}
