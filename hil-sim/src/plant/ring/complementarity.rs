//! Contact of a compliant rim with rigid walls: pressures p >= 0 whose displacements z = C p
//! are no less than the walls ask for, g, with p = 0 where they are more (linear
//! complementarity; primal-dual active set: Hintermueller, Ito & Kunisch 2003).
//!
//! C depends on the distance of two elements alone, so its factors depend on the pattern of
//! those in contact alone, which a rolling wheel repeats: they are kept.

/// Displacement by which an element may be short of its wall, mm.
const TOLERANCE_MM: f64 = 1e-10;

/// Rounds in which all that violate a condition change at once; from then on only the worst.
const AT_ONCE: usize = 20;

/// Most rounds.
const ROUNDS: usize = 400;

/// Factors kept.
const KEPT: usize = 8;

/// Factors of C for a pattern: rows of D L^T, one after the other, each from its diagonal on.
#[derive(Clone, Debug, Default)]
struct Factors {
    pattern: Vec<usize>,
    rows: Vec<f64>,
}

impl Factors {
    fn new(pattern: &[usize], compliance: &[f64]) -> Self {
        let count = pattern.len();
        let mut rows = Vec::with_capacity(count * (count + 1) / 2);
        for (j, from) in pattern.iter().enumerate() {
            rows.extend(pattern[j..].iter().map(|to| compliance[to - from]));
        }
        let mut left = rows.as_mut_slice();
        for j in 0..count {
            let (row, mut below) = left.split_at_mut(count - j);
            for i in 1..row.len() {
                let factor = row[i] / row[0];
                let (target, rest) = below.split_at_mut(count - j - i);
                for (a, b) in target.iter_mut().zip(&row[i..]) {
                    *a -= factor * b;
                }
                below = rest;
            }
            left = &mut left[count - j..];
        }
        Self { pattern: pattern.to_vec(), rows }
    }

    fn solve(&self, x: &mut [f64]) {
        let count = x.len();
        let mut rest = self.rows.as_slice();
        for j in 0..count {
            let (row, below) = rest.split_at(count - j);
            let value = x[j] / row[0];
            for (a, b) in x[j + 1..].iter_mut().zip(&row[1..]) {
                *a -= value * b;
            }
            x[j] = value;
            rest = below;
        }
        let mut end = self.rows.len();
        for j in (0..count).rev() {
            let row = &self.rows[end - (count - j)..end];
            let sum: f64 = row[1..].iter().zip(&x[j + 1..]).map(|(a, b)| a * b).sum();
            x[j] -= sum / row[0];
            end -= count - j;
        }
    }
}

/// The problem of one rim and its last solution.
#[derive(Clone, Debug, Default)]
pub(super) struct Complementarity {
    /// Displacement by a pressure, by their distance from -(n-1) to n-1 elements.
    compliance: Vec<f64>,
    most: usize,
    kept: Vec<Factors>,
    pattern: Vec<usize>,
    indices: Vec<usize>,
    right: Vec<f64>,
    /// Pressures and displacements, mm, of the last solution, by element of the row.
    pub(super) pressures: Vec<f64>,
    pub(super) displacement: Vec<f64>,
}

impl Complementarity {
    /// For at most `most` elements in a row, their compliance by distance.
    pub(super) fn new(compliance: &[f64], most: usize) -> Self {
        let lags = &compliance[1..most];
        let compliance: Vec<f64> =
            lags.iter().rev().chain(&compliance[..1]).chain(lags).copied().collect();
        Self { compliance, most, ..Self::default() }
    }

    /// Compliance of an element at itself.
    pub(super) fn own(&self) -> f64 {
        self.compliance[self.most - 1]
    }

    /// Solves for the displacements that the walls ask for, mm, starting from the elements
    /// thought to be in contact; leaves there those that are.
    pub(super) fn solve(&mut self, wanted: &[f64], active: &mut [bool]) {
        for round in 0..ROUNDS {
            self.gather(active);
            let mut right = std::mem::take(&mut self.right);
            right.clear();
            right.extend(self.indices.iter().map(|i| wanted[*i]));
            self.factors().solve(&mut right);
            self.pressures.clear();
            self.pressures.resize(wanted.len(), 0.0);
            for (i, p) in self.indices.iter().zip(&right) {
                self.pressures[*i] = *p;
            }
            self.right = right;
            let (pressures, indices) = (&self.pressures, &self.indices);
            spread(
                &self.compliance,
                self.most,
                pressures,
                indices,
                0,
                wanted.len(),
                &mut self.displacement,
            );
            if !self.revise(wanted, active, round < AT_ONCE) {
                return;
            }
        }
    }

    /// Lets go of what pulls and takes in what is short of its wall; whether any changed.
    fn revise(&self, wanted: &[f64], active: &mut [bool], at_once: bool) -> bool {
        let own = self.own();
        let (mut worst, mut changed) = ((0.0, 0), false);
        for (i, active) in active.iter_mut().enumerate() {
            // How far beyond its condition, mm.
            let beyond = if *active {
                -own * self.pressures[i]
            } else {
                wanted[i] - self.displacement[i] - TOLERANCE_MM
            };
            if beyond > 0.0 {
                changed = true;
                if at_once {
                    *active = !*active;
                } else if beyond > worst.0 {
                    worst = (beyond, i);
                }
            }
        }
        if changed && !at_once {
            active[worst.1] = !active[worst.1];
        }
        changed
    }

    /// Elements in contact, ascending, and the pressures that this change of the walls adds
    /// there.
    pub(super) fn respond(&mut self, change: impl Fn(usize) -> f64) -> (&[usize], &[f64]) {
        let mut right = std::mem::take(&mut self.right);
        right.clear();
        right.extend(self.indices.iter().map(|i| change(*i)));
        self.factors().solve(&mut right);
        self.right = right;
        (&self.indices, &self.right)
    }

    /// Displacements of the last pressures over a longer row that starts `before` elements
    /// ahead of theirs, mm.
    pub(super) fn displacement_over(&self, before: usize, length: usize, out: &mut Vec<f64>) {
        spread(&self.compliance, self.most, &self.pressures, &self.indices, before, length, out);
    }

    fn gather(&mut self, active: &[bool]) {
        self.indices.clear();
        self.indices.extend((0..active.len()).filter(|i| active[*i]));
        let first = self.indices.first().copied().unwrap_or(0);
        self.pattern.clear();
        self.pattern.extend(self.indices.iter().map(|i| i - first));
    }

    /// Factors of the present pattern; the last used come first.
    fn factors(&mut self) -> &Factors {
        match self.kept.iter().position(|kept| kept.pattern == self.pattern) {
            Some(at) => self.kept[..=at].rotate_right(1),
            None => {
                self.kept.truncate(KEPT - 1);
                let lags = &self.compliance[self.most - 1..];
                self.kept.insert(0, Factors::new(&self.pattern, lags));
            }
        }
        &self.kept[0]
    }
}

/// Displacements by these pressures over a row that starts `before` elements ahead of theirs.
fn spread(
    compliance: &[f64],
    most: usize,
    pressures: &[f64],
    indices: &[usize],
    before: usize,
    length: usize,
    out: &mut Vec<f64>,
) {
    out.clear();
    out.resize(length, 0.0);
    for index in indices {
        let pressure = pressures[*index];
        let from = &compliance[most - 1 - (index + before)..];
        for (z, c) in out.iter_mut().zip(from) {
            *z += pressure * c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A compliance that falls off and turns over, as that of a layer.
    fn table(count: usize) -> Vec<f64> {
        (0..count).map(|i| (-0.2 * i as f64).exp() - 0.3 * (-0.07 * i as f64).exp()).collect()
    }

    proptest! {
        /// The conditions hold, whatever was thought to be in contact.
        #[test]
        fn the_conditions_hold(
            wanted in prop::collection::vec(-1.0f64..1.0, 40),
            thought in prop::collection::vec(any::<bool>(), 40),
        ) {
            let compliance = table(40);
            let mut contact = Complementarity::new(&compliance, 40);
            let mut active = thought;
            contact.solve(&wanted, &mut active);
            for i in 0..40 {
                let p = contact.pressures[i];
                let z: f64 = (0..40).map(|j| compliance[i.abs_diff(j)] * contact.pressures[j]).sum();
                prop_assert!((z - contact.displacement[i]).abs() < 1e-9);
                prop_assert!(p >= 0.0 && z >= wanted[i] - 1e-9, "{i}: {p} {z} {}", wanted[i]);
                prop_assert!(p == 0.0 || (z - wanted[i]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn factors_are_kept_by_pattern() {
        let mut contact = Complementarity::new(&table(40), 40);
        for shift in 0..20 {
            let wanted: Vec<f64> =
                (0..40).map(|i| if (shift..shift + 5).contains(&i) { 1.0 } else { -5.0 }).collect();
            let mut active: Vec<bool> = wanted.iter().map(|w| *w > 0.0).collect();
            contact.solve(&wanted, &mut active);
        }
        assert!(contact.kept.len() <= 4, "{}", contact.kept.len());
    }
}
