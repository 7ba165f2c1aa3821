//! A campaign: many cases, each computed by itself, and what is made of all of them.

mod frame;
mod shard;

use rayon::prelude::*;

pub use frame::{Column, Frame, column};
pub use shard::{Shard, ShardError};

/// Computes a case; calls its second argument after each of its steps.
type Run<'a, C, L, E> = dyn Fn(&C, &(dyn Fn() + Sync)) -> Result<L, E> + Sync + 'a;
/// Makes an outcome of cases and their lines, in the order of the cases.
type Fold<'a, C, L, O> = dyn FnOnce(Vec<(C, L)>) -> O + 'a;

/// Cases, how one is computed, and what is made of all.
pub struct Campaign<'a, C, L, O, E> {
    /// What the steps of a case are called, and how many there are at most.
    pub steps: (&'static str, usize),
    /// The cases.
    pub cases: Vec<C>,
    /// Gives the line of a case.
    pub run: Box<Run<'a, C, L, E>>,
    /// Gives the outcome.
    pub fold: Box<Fold<'a, C, L, O>>,
}

impl<C: Sync, L: Send, O, E: Send> Campaign<'_, C, L, O, E> {
    /// The lines of the cases at these places, on all processors, without those that had not
    /// begun when `stop` was wanted; `done` is called after each step. The lines do not depend
    /// on the number of processors.
    ///
    /// # Errors
    /// The first one of a case.
    pub fn lines(
        &self,
        places: &[usize],
        stop: &(dyn Fn() -> bool + Sync),
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<(usize, L)>, E> {
        let Self { cases, run, .. } = self;
        let line = |place: &usize| Ok((*place, run(&cases[*place], done)?));
        places.par_iter().filter(|_| !stop()).map(line).collect()
    }

    /// The outcome of these lines, each with the place of its case.
    pub fn outcome(self, lines: Vec<(usize, L)>) -> O {
        let mut lines: std::collections::BTreeMap<usize, L> = lines.into_iter().collect();
        let cases = self.cases.into_iter().enumerate();
        (self.fold)(cases.filter_map(|(at, case)| Some((case, lines.remove(&at)?))).collect())
    }

    /// The outcome of all cases.
    ///
    /// # Errors
    /// The first one of a case.
    pub fn complete(self, done: &(dyn Fn() + Sync)) -> Result<O, E> {
        let places: Vec<usize> = (0..self.cases.len()).collect();
        let lines = self.lines(&places, &|| false, done)?;
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
            run: Box::new(|case: &i32, step| {
                step();
                Ok::<_, ()>(case * case)
            }),
            fold: Box::new(|lines: Vec<(i32, i32)>| lines),
        };
        let count = || {
            done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        };
        assert_eq!(squares().complete(&count), Ok(vec![(3, 9), (1, 1), (2, 4)]));
        assert_eq!(done.into_inner(), 3);
        assert_eq!(squares().lines(&[0, 1, 2], &|| true, &|| {}), Ok(Vec::new()));
        assert_eq!(squares().outcome(vec![(2, 4), (0, 9)]), [(3, 9), (2, 4)]);
    }
}
