//! A campaign: many cases, each computed by itself, and what is made of all of them. Each but
//! `sweep`'s is in a module of its own (as in `montecarlo`); its verb in `cli/` (as `stress.rs`) is in
//! `cli.rs` a module and a row of `verbs!` that names its `campaign`.

mod frame;
mod shard;

use rayon::prelude::*;

pub(crate) use frame::{AS_GIVEN, Column, Frame, column};
pub(crate) use shard::Shard;

/// What watches a campaign.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called after each step of a case.
    pub done: &'a (dyn Fn() + Sync),
    /// Whether an end is wanted.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Computes a case; none if it was given up, as an end was wanted.
type Run<'a, C, L, E> = dyn Fn(&C, Watch) -> Result<Option<L>, E> + Sync + 'a;
/// Makes an outcome of cases and their lines, in the order of the cases.
type Fold<'a, C, L, O> = dyn FnOnce(Vec<(C, L)>) -> O + 'a;

/// Cases, how one is computed, and what is made of all.
pub struct Campaign<'a, C, L, O, E> {
    /// What the steps of a case are called, and how many there are at most, each a call of `done`.
    pub steps: (&'static str, usize),
    pub cases: Vec<C>,
    /// Gives the line of a case.
    pub run: Box<Run<'a, C, L, E>>,
    pub fold: Box<Fold<'a, C, L, O>>,
}

impl<C: Sync, L: Send, O, E: Send> Campaign<'_, C, L, O, E> {
    /// The lines of the cases at these places, on all processors, without those that had not
    /// begun or were given up when an end was wanted. The lines do not depend on the number of
    /// processors.
    pub(crate) fn lines(&self, places: &[usize], watch: Watch) -> Result<Vec<(usize, L)>, E> {
        let Self { cases, run, .. } = self;
        let line = |place: &usize| {
            let line = run(&cases[*place], watch).transpose()?;
            Some(line.map(|line| (*place, line)))
        };
        places.par_iter().filter(|_| !(watch.stop)()).filter_map(line).collect()
    }

    /// The outcome of these lines, each with the place of its case.
    pub(crate) fn outcome(self, lines: Vec<(usize, L)>) -> O {
        let mut lines: std::collections::BTreeMap<usize, L> = lines.into_iter().collect();
        let cases = self.cases.into_iter().enumerate();
        (self.fold)(cases.filter_map(|(at, case)| Some((case, lines.remove(&at)?))).collect())
    }

    /// The outcome of all cases.
    pub fn complete(self, done: &(dyn Fn() + Sync)) -> Result<O, E> {
        let places: Vec<usize> = (0..self.cases.len()).collect();
        let lines = self.lines(&places, Watch { done, stop: &|| false })?;
        Ok(self.outcome(lines))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stopped_keeps_what_is_done() {
        let done = std::sync::atomic::AtomicUsize::new(0);
        let squares = || Campaign {
            steps: ("squares", 1),
            cases: vec![3, 1, 2],
            run: Box::new(|case: &i32, watch| {
                (watch.done)();
                Ok::<_, ()>((!(watch.stop)()).then_some(case * case))
            }),
            fold: Box::new(|lines: Vec<(i32, i32)>| lines),
        };
        let count = || {
            done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        };
        assert_eq!(squares().complete(&count), Ok(vec![(3, 9), (1, 1), (2, 4)]));
        assert_eq!(done.into_inner(), 3);
        // An end that is wanted from the third question on: the second case is given up.
        let asked = std::sync::atomic::AtomicUsize::new(0);
        let stop = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 2;
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let lines =
            one.install(|| squares().lines(&[0, 1, 2], Watch { done: &|| {}, stop: &stop }));
        assert_eq!(lines, Ok(vec![(0, 9)]));
        assert_eq!(squares().outcome(vec![(2, 4), (0, 9)]), [(3, 9), (2, 4)]);
    }
}
