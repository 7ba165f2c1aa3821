//! Run time against error: the rolled-out tread and the plant's resolution.
//!
//! Times are processor time of one thread, the least of several runs from the same state.
//! They depend on the machine; errors and cycles do not.

pub mod cycles;
pub(crate) mod page;
pub mod rollout;

use std::hint::black_box;

use anyhow::Result;
use cpu_time::ThreadTime;
use interstage::rig::Rig;
use serde::Serialize;

use hil_sim::plant::precision::{FINER, Point, Setting, work_precision};

use cycles::Tick;
use rollout::Variant;

/// Repeats of a crossing; the fastest counts.
const REPEATS: usize = 5;

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Cycles on the emulated core; builds it if need be.
    pub cycles: bool,
    /// Two resolutions of the plant instead of all.
    pub quick: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// The rolled-out tread.
    pub variants: Vec<Variant>,
    /// The control tick on the emulated core, if it was measured.
    pub tick: Option<Tick>,
    /// Why there are no cycles.
    pub cycles_left_out: Option<String>,
    pub plant: Plant,
    /// Other engines and solvers on one crossing: what `peers/run.py` stored, which runs on demand.
    pub peers: serde_json::Value,
}

/// Error and time of the plant by resolution.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plant {
    /// How much finer the reference of the errors is, in elements and in stride.
    pub finer: usize,
    /// The setting of deployments.
    pub default: Setting,
    /// Error and time by setting.
    pub settings: Vec<Point>,
}

impl Plant {
    /// The default setting's errors and time.
    pub fn usual(&self) -> Option<&Point> {
        self.settings.iter().find(|point| {
            (point.elements, point.stride_mm) == (self.default.elements, self.default.stride_mm)
        })
    }
}

/// Measures; `say` is called with each part's name.
pub fn measure(options: Options, say: &dyn Fn(&str)) -> Result<Report> {
    let one_line = |error: &anyhow::Error| Some(format!("{error:#}").replace('\n', " "));
    say("rollout");
    let mut variants = rollout::measure()?;
    let (tick, cycles_left_out) = if options.cycles {
        say("cycles");
        match cycles::run(&rollout::inputs()?) {
            Ok((calls, tick)) => {
                rollout::fill(&calls, &mut variants)?;
                (Some(tick), None)
            }
            Err(error) => (None, one_line(&error)),
        }
    } else {
        (None, Some("not asked for".to_owned()))
    };
    say("plant");
    let default = Setting::usual();
    let coarse = Setting { elements: default.elements / 4, stride_mm: 4.0 * default.stride_mm };
    let (sweep, repeats) =
        if options.quick { (vec![coarse, default], 1) } else { (Setting::sweep(), REPEATS) };
    let settings = work_precision(&Rig::prototype(), &sweep, repeats, || ())?;
    let plant = Plant { finer: FINER, default, settings };
    let peers = serde_json::from_str(include_str!("../peers/results.json"))?;
    Ok(Report { variants, tick, cycles_left_out, plant, peers })
}

/// Repeats after the run that warms up.
const TIMED: usize = 9;
/// Time after which no further repeat is begun, s.
const WITHIN_S: f64 = 0.4;

/// Least processor time of this thread for one run of `work`, s, and its last answer. The
/// first run warms up and does not count.
fn least<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut answer = black_box(work());
    let (mut best, mut spent) = (f64::INFINITY, 0.0);
    for _ in 0..TIMED {
        let begun = ThreadTime::now();
        answer = black_box(work());
        let took = begun.elapsed().as_secs_f64();
        best = best.min(took);
        spent += took;
        if spent > WITHIN_S {
            break;
        }
    }
    (best, answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_is_not_working() {
        let (seconds, ()) = least(|| std::thread::sleep(std::time::Duration::from_millis(20)));
        assert!(seconds < 0.01, "{seconds}");
    }
}
