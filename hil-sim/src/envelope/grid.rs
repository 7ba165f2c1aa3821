//! The places of the envelope.

use std::fmt;
use std::str::FromStr;

/// Least and largest friction of tread on wall.
const FRICTION: (f64, f64) = (0.6, 1.3);
/// Least and largest load on the wheel, N.
const LOAD_N: (f64, f64) = (0.0, 30.0);
/// Fewest and most places along an axis.
const PLACES: std::ops::RangeInclusive<usize> = 2..=100;

/// Numbers of frictions and loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    frictions: usize,
    loads: usize,
}

impl Grid {
    /// Steps of 0.1 of friction and of 5 N.
    pub const USUAL: Self = Self { frictions: 8, loads: 7 };

    /// The frictions, ascending.
    pub(crate) fn frictions(self) -> Vec<f64> {
        spread(FRICTION, self.frictions)
    }

    /// The loads on the wheel, ascending, N.
    pub(crate) fn loads_n(self) -> Vec<f64> {
        spread(LOAD_N, self.loads)
    }
}

/// So many numbers, evenly over the range, rounded to a millionth.
fn spread((low, high): (f64, f64), count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    let at = |index: usize| low + (high - low) * index as f64 / last;
    (0..count).map(|index| (at(index) * 1e6).round() / 1e6).collect()
}

impl FromStr for Grid {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
        let number = |text: &str| text.parse().ok().filter(|number| PLACES.contains(number));
        let parts = text.split_once(['x', 'X']).and_then(|(frictions, loads)| {
            Some(Self { frictions: number(frictions)?, loads: number(loads)? })
        });
        parts.ok_or("expected FRICTIONSxLOADS, each from 2 to 100, as in 8x7")
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.frictions, self.loads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_read_and_spread_over_its_ranges() {
        assert_eq!("8x7".parse(), Ok(Grid::USUAL));
        assert_eq!(Grid::USUAL.to_string(), "8x7");
        assert_eq!(Grid::USUAL.frictions(), [0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3]);
        assert_eq!(Grid::USUAL.loads_n(), [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
        for text in ["8", "1x7", "8x101", "x", "8x7x2", "-2x3", ""] {
            assert!(text.parse::<Grid>().is_err(), "{text}");
        }
    }
}
