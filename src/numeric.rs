//! Fixed-point primitives that [`fixed`] lacks or makes slow on a 32-bit core, exact to the bit on
//! every machine. None divides 64-bit numbers, loops without a bound or panics. Floats convert SI
//! numbers at the start, in `build` alone.

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod divide;
mod high;
mod low_pass;
mod roots;
mod sine;

pub use build::{checked, cosine_of_turns};
pub use divide::{Divisor, divide, part, reciprocal_of_normalised};
pub(crate) use high::horner;
pub use high::{high, high_unsigned};
pub use low_pass::{LowPass, LowPassState};
pub use roots::sqrt;
pub use sine::sin_cos;

/// `value`, but no less than `low` and no more than `high`; `high` if the bounds are reversed,
/// where [`Ord::clamp`] panics. For bounds from the parameters.
pub fn between<T: Ord>(value: T, low: T, high: T) -> T {
    value.max(low).min(high)
}

/// Arguments from `first` on by this stride, and the last; all with `RIG_LONG=1`.
#[cfg(test)]
fn lattice(first: u32, stride: usize) -> impl Iterator<Item = u32> {
    let stride = if std::env::var_os("RIG_LONG").is_some() { 1 } else { stride };
    (first..=u32::MAX).step_by(stride).chain([u32::MAX])
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn reversed_bounds_end_at_the_upper() {
        assert_eq!([-3, 1, 9].map(|value| between(value, 0, 5)), [0, 1, 5]);
        assert_eq!([-3, 1, 9].map(|value| between(value, 5, 0)), [0, 0, 0]);
    }
}
