//! Ranges and tick marks of axes.

pub(crate) use crate::table::label;

/// What an axis shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Scale {
    /// A quantity.
    #[default]
    Linear,
    /// The decimal logarithm of a quantity, labelled by the quantity.
    Log,
    /// These places alone, with their names: categories, or rows and columns of a map.
    Named(Vec<(f64, String)>),
}

impl Scale {
    /// Places in `range` and their labels; of a quantity at most so many.
    pub(super) fn ticks(&self, range: (f64, f64), most: usize) -> Vec<(f64, String)> {
        match self {
            Self::Linear => {
                let (places, decimals) = ticks(range, most);
                places.into_iter().map(|at| (at, label(at, decimals))).collect()
            }
            Self::Log => decades(range),
            Self::Named(places) => places.clone(),
        }
    }
}

/// Ticks of decimal logarithms: decades, or 1, 2 and 5 where these are few.
fn decades((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let within: &[f64] = if high - low < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let all = (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|decade| within.iter().map(move |part| part.log10() + f64::from(decade)));
    all.filter(|tick| (low..=high).contains(tick)).map(|tick| (tick, power(tick))).collect()
}

/// A power of ten with as many digits as it takes.
fn power(exponent: f64) -> String {
    let value = 10_f64.powf(exponent);
    if (1e-3..1e5).contains(&value) {
        format!("{value:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.0e}")
    }
}

/// Least and largest finite number; None if there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| v.is_finite()).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// `range` with a margin of `part` of it on both sides, and never empty.
pub fn padded(range: (f64, f64), part: f64) -> (f64, f64) {
    let least = 1e-3_f64.max(1e-3 * range.0.abs().max(range.1.abs()));
    let margin = if range.1 - range.0 < least { least } else { part * (range.1 - range.0) };
    (range.0 - margin, range.1 + margin)
}

/// Round numbers inside `range`, at most `most` of them, and how many decimals
/// distinguish them.
fn ticks(range: (f64, f64), most: usize) -> (Vec<f64>, usize) {
    let rough = (range.1 - range.0) / most.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return (Vec::new(), 0);
    }
    let step = steps(rough).next().unwrap_or(rough);
    let first = (range.0 / step - 1e-9).ceil() as i64;
    let last = (range.1 / step + 1e-9).floor() as i64;
    let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
    ((first..=last).map(|n| n as f64 * step).collect(), decimals)
}

/// The steps of 1, 2 and 5 in each decade, from `least` on.
pub(crate) fn steps(least: f64) -> impl Iterator<Item = f64> {
    let of = |decade| [1.0, 2.0, 5.0].map(|n| n * 10_f64.powi(decade));
    let all = (least.log10().floor() as i32..).flat_map(of);
    all.skip_while(move |step| *step < least * (1.0 - 1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks((0.0, 10.0), 5), (vec![0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 0));
        let (marks, decimals) = ticks((1.53, 1.92), 6);
        let labels: Vec<String> = marks.iter().map(|&m| label(m, decimals)).collect();
        assert_eq!(labels, ["1.6", "1.7", "1.8", "1.9"]);
        assert_eq!(ticks((0.0, f64::NAN), 5).0.len(), 0);
        assert_eq!(ticks((0.0, 0.2), 4), (vec![0.0, 0.05, 0.1, 0.15000000000000002, 0.2], 2));
    }

    #[test]
    fn a_logarithmic_axis_is_labelled_by_its_quantity() {
        let labels = |range| -> Vec<String> {
            Scale::Log.ticks(range, 1).into_iter().map(|tick| tick.1).collect()
        };
        assert_eq!(labels((-1.1, 0.4)), ["0.1", "0.2", "0.5", "1", "2"]);
        assert_eq!(labels((-4.0, 0.0)), ["1e-4", "0.001", "0.01", "0.1", "1"]);
    }

    #[test]
    fn a_range_is_never_empty_and_skips_what_is_not_a_number() {
        assert_eq!(extent([f64::NAN, 2.0, -1.0, f64::INFINITY]), Some((-1.0, 2.0)));
        assert_eq!(extent([f64::NAN]), None);
        let (low, high) = padded((33.3, 33.3), 0.1);
        assert!(high > low);
        assert_eq!(padded((0.0, 10.0), 0.1), (-1.0, 11.0));
    }
}
