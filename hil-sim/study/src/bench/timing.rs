//! Comparable times.

use std::hint::black_box;

use cpu_time::ThreadTime;

/// Repeats after the run that warms up.
const REPEATS: usize = 9;
/// Time after which no further repeat is begun, s.
const WITHIN_S: f64 = 0.4;

/// Least processor time of this thread for one run of `work`, s, and its last answer. The
/// first run warms up and does not count.
pub(super) fn least<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut answer = black_box(work());
    let (mut best, mut spent) = (f64::INFINITY, 0.0);
    for _ in 0..REPEATS {
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
    fn more_work_takes_longer() {
        let sum = |n: u64| move || (0..n).fold(0, |a, b| black_box(a ^ b));
        let (short, long) = (least(sum(10_000)).0, least(sum(1_000_000)).0);
        assert!(long > 10.0 * short, "{long} {short}");
    }

    #[test]
    fn waiting_is_not_working() {
        let (seconds, ()) = least(|| std::thread::sleep(std::time::Duration::from_millis(20)));
        assert!(seconds < 0.01, "{seconds}");
    }
}
