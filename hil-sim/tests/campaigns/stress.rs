//! Stress of plant and controller; skipped stages change no output.

use crate::common::{DIRECTIONS, scenario, starter};
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, RunningRig, Session};
use hil_sim::stress::{self, Figure};
use interstage::supervise::{Leg, Mode};
use interstage::tick::Output;

/// A complete run of `session`: `look` at every output.
fn run(mut session: Session, scenario: &Scenario, mut look: impl FnMut(&Output)) {
    let mut start = Some(starter(scenario.run.direction));
    while !matches!(session.mode(), Mode::Complete(_)) {
        assert!(session.time_s() < 60.0, "{:?}", session.mode());
        let command = if session.mode() == Mode::Idle { start.take() } else { None };
        look(&session.step(command).unwrap());
    }
}

#[test]
fn a_stage_that_is_skipped_leaves_no_trace_in_the_outputs() {
    for direction in DIRECTIONS {
        let scenario = scenario("prototype", direction, 0);
        let session = || Session::new(&scenario, Options::default()).unwrap();
        let [skipping, not] = [session(), session().without_skipping()].map(|session| {
            let mut outputs = Vec::new();
            run(session, &scenario, |output| outputs.push(format!("{output:?}")));
            outputs
        });
        assert!(skipping.len() > 3000);
        assert_eq!(skipping.len(), not.len());
        for (a, b) in skipping.iter().zip(&not) {
            assert_eq!(a, b);
        }
    }
}

/// Vibration observed in each crossing, all at 8 mm/s, um.
fn shaken(scenario: &Scenario) -> Vec<f64> {
    let mut peaks = Vec::new();
    let mut crossing = false;
    let options = Options { speed: Some((8.0, true)), ..Options::default() };
    run(Session::new(scenario, options).unwrap(), scenario, |output| {
        let now = matches!(output.telemetry.mode, Mode::Run(_, Leg::Crossing));
        if crossing && !now {
            peaks.push(output.telemetry.vibration.to_num::<f64>() * 1e3);
        }
        crossing = now;
    });
    peaks
}

#[test]
fn a_crossing_at_resonance_shows_vibration() {
    // Kept away from the modes, the arm shakes less than the sensor's noise, 2 um.
    let quiet = shaken(&Scenario::default());
    assert_eq!(quiet.len(), 3);
    assert!(quiet.iter().all(|&um| um > 0.0 && um < 2.5), "{quiet:?}");
    // Without the guard, and with a gearbox whose ripple at crossing speed is the mode. The tread
    // turns faster than that by what it gives way by.
    let mut loud = Scenario::default();
    loud.rig.drive.guard_band = 0.0;
    loud.rig.drive.ripple_pitch_mm = 8.2 / 276.0;
    let loud = shaken(&loud);
    assert!(loud.iter().zip(&quiet).all(|(loud, quiet)| *loud > 3.0 * quiet), "{loud:?}");
}

#[test]
fn the_plant_withstands_the_corners_of_its_ranges() {
    let Ok(report) = stress::campaign(200, 1).complete(&|| {});
    assert_eq!(report.cases, 200);
    assert!(report.failed.is_empty(), "{:#?}", report.failed);
    // Only impossible cases are refused, each with its parameters and its limit.
    assert_eq!(report.refused.values().map(|refused| refused.count).sum::<usize>(), 10);
    assert!(report.refused.values().all(|refused| refused.example.contains("at most")));
    // Each figure comes near its limit in some case.
    for figure in [Figure::RingPenetration, Figure::Penetration, Figure::Unbalanced] {
        let worst = report.worst.iter().find(|worst| worst.figure == figure).unwrap();
        assert!(worst.value > 0.2, "{worst:?}");
    }
}
