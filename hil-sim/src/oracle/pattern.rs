//! Search without derivatives: a pattern search over several variables and a root search over
//! one.

/// Hooke and Jeeves' exploratory moves: each variable is moved by its step in both senses from
/// the best place so far; a round without gain halves the steps, and after this many halvings it
/// ends. `try_move` gets the changes of all variables, and returns whether it kept them.
pub(crate) fn pattern_search<const N: usize>(
    steps: &[f64; N],
    halvings: usize,
    mut try_move: impl FnMut(&[f64; N]) -> bool,
) {
    /// Rounds of one step size.
    const MOST_ROUNDS: usize = 8;
    // The sense that last gained is tried first.
    let mut senses = [1.0; N];
    for halving in 0..=halvings {
        let part = 0.5f64.powi(halving as i32);
        for _ in 0..MOST_ROUNDS {
            let mut gained = false;
            for variable in (0..N).filter(|variable| steps[*variable] != 0.0) {
                for _ in 0..2 {
                    let mut changes = [0.0; N];
                    changes[variable] = senses[variable] * part * steps[variable];
                    if try_move(&changes) {
                        gained = true;
                        break;
                    }
                    senses[variable] = -senses[variable];
                }
            }
            if !gained {
                break;
            }
        }
    }
}

/// A place and the excess there.
type Known = (f64, f64);

/// Looks for the largest x in `range` at which `excess`, which rises with x, is not positive:
/// by secants from `guess`, between the ends that are known. Calls `excess` at most `tries`
/// times, and stops early within a thousandth below zero.
pub(crate) fn largest_below<E>(
    (low, high): (f64, f64),
    guess: f64,
    tries: usize,
    mut excess: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(), E> {
    /// Excess that is near enough; half of it is aimed at.
    const NEAR: f64 = 1e-3;
    /// Excess per relative change of x, until two places are known.
    const SLOPE: f64 = 0.2;
    let (mut below, mut above): (Option<Known>, Option<Known>) = (None, None);
    let (mut x, mut last) = (guess.clamp(low, high), None);
    for _ in 0..tries {
        let f = excess(x)?;
        let near = (-NEAR..=0.0).contains(&f);
        if near || (f <= 0.0 && x >= high) || (f > 0.0 && x <= low) || f.is_nan() {
            break;
        }
        let f = f + 0.5 * NEAR;
        let (near_end, far_end) =
            if f <= 0.0 { (&mut below, &mut above) } else { (&mut above, &mut below) };
        *near_end = Some((x, f));
        // An end that stays twice counts half, so that both come in (Illinois).
        if let (Some(far), true) = (far_end, last == Some(f <= 0.0)) {
            far.1 *= 0.5;
        }
        last = Some(f <= 0.0);
        x = match (below, above) {
            (Some(a), Some(b)) => (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1),
            _ => (x * (1.0 - f / SLOPE)).clamp(0.5 * x, 2.0 * x).clamp(low, high),
        };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_finds_the_least_of_a_valley() {
        let cost =
            |x: &[f64; 2]| (x[0] - 1.3).powi(2) + 3.0 * (x[1] + 0.4).powi(2) + 0.5 * x[0] * x[1];
        let mut best = ([0.0, 0.0], cost(&[0.0, 0.0]));
        pattern_search(&[0.5, 0.5], 8, |changes| {
            let tried = [best.0[0] + changes[0], best.0[1] + changes[1]];
            let gains = cost(&tried) < best.1;
            if gains {
                best = (tried, cost(&tried));
            }
            gains
        });
        // Where both derivatives vanish.
        let exact = [1.3 * 6.0 + 0.5 * 1.2, 0.0].map(|x| x / (12.0 - 0.25));
        assert!((best.0[0] - 2.0 * exact[0]).abs() < 0.05, "{best:?}");
        // A variable without a step is not moved.
        pattern_search(&[0.0, 0.0], 3, |_| panic!("moved"));
    }

    #[test]
    fn the_largest_that_keeps_the_bound_is_found() {
        type Curve = fn(f64) -> f64;
        let curves: [(Curve, f64); 3] = [
            (|x| 0.03 * (x - 7.0), 7.0),
            (|x| 0.2 * (x / 12.0).ln(), 12.0),
            (|x| (x / 5.0).powi(2) - 1.0, 5.0),
        ];
        for (curve, root) in curves {
            for guess in [3.0, 8.0, 29.0] {
                let (mut best, mut calls) = (0.0f64, 0);
                largest_below((3.0, 30.0), guess, 8, |x| {
                    calls += 1;
                    if curve(x) <= 0.0 {
                        best = best.max(x);
                    }
                    Ok::<_, ()>(curve(x))
                })
                .unwrap();
                assert!(best <= root && best > 0.9 * root, "{best} {root} from {guess}");
                assert!(calls <= 8);
            }
        }
    }

    #[test]
    fn ends_are_tried_and_errors_passed_on() {
        for (excess, end) in [(-1.0, 30.0), (1.0, 3.0)] {
            let mut last = f64::NAN;
            largest_below((3.0, 30.0), 8.0, 6, |x| {
                last = x;
                Ok::<_, ()>(excess)
            })
            .unwrap();
            assert_eq!(last, end);
        }
        assert_eq!(largest_below((3.0, 30.0), 8.0, 6, |_| Err("no")), Err("no"));
    }
}
