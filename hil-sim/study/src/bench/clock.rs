//! Times that can be compared: processor time of this thread, the least of several
//! runs, each from the same state and with its answer used.

use std::hint::black_box;
use std::time::Duration;

use cpu_time::ThreadTime;

/// How long a measurement may take, and how often it is repeated at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Repeats after the one that warms up.
    pub repeats: usize,
    /// Time after which no further repeat is begun.
    pub within: Duration,
}

impl Effort {
    /// For work of microseconds to a second.
    pub const USUAL: Self = Self { repeats: 9, within: Duration::from_millis(400) };
}

/// What a measurement gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed<T> {
    /// Least processor time of one run, s.
    pub seconds: f64,
    /// The answer of the last run.
    pub answer: T,
}

/// Runs `work` once to warm up, then repeatedly, each time on a fresh `prepare()`,
/// which is not timed.
pub fn least<S, T>(
    effort: Effort,
    mut prepare: impl FnMut() -> S,
    mut work: impl FnMut(S) -> T,
) -> Timed<T> {
    let mut spent = Duration::ZERO;
    let mut run = || {
        let state = black_box(prepare());
        let begun = ThreadTime::now();
        let answer = black_box(work(state));
        (begun.elapsed(), answer)
    };
    let (mut best, mut answer) = run();
    for _ in 0..effort.repeats {
        if spent >= effort.within {
            break;
        }
        let (took, given) = run();
        spent += took;
        best = best.min(took);
        answer = given;
    }
    Timed { seconds: best.as_secs_f64(), answer }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_work_takes_longer_and_the_state_is_restored() {
        let sum = |n: u64| {
            move |mut v: Vec<u64>| {
                v.push(n);
                (v.len(), (0..n).fold(0, |a, b| black_box(a ^ b)))
            }
        };
        let short = least(Effort::USUAL, Vec::new, sum(10_000));
        let long = least(Effort::USUAL, Vec::new, sum(1_000_000));
        assert_eq!((short.answer.0, long.answer.0), (1, 1), "a state of its own for each run");
        assert!(long.seconds > 10.0 * short.seconds, "{} {}", long.seconds, short.seconds);
    }

    #[test]
    fn waiting_is_not_working() {
        let effort = Effort { repeats: 1, within: Duration::ZERO };
        let slept = least(effort, || (), |()| std::thread::sleep(Duration::from_millis(30)));
        assert!(slept.seconds < 0.015, "{}", slept.seconds);
    }

    #[test]
    fn the_number_of_runs_is_bounded() {
        let mut runs = 0;
        let effort = Effort { repeats: 5, within: Duration::from_secs(10) };
        least(effort, || (), |()| runs += 1);
        assert_eq!(runs, 6);
    }
}
