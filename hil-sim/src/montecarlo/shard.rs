//! Splits a campaign into parts for several machines.

use std::fmt;
use std::str::FromStr;

/// Part `index` of `of`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    of: u64,
}

/// The text is no part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected i/n with i from 1 to n, as in 1/4")]
pub struct ShardError;

impl Shard {
    /// All of the campaign.
    pub const ALL: Self = Self { index: 1, of: 1 };

    /// Whether the item at this place, counted from 0, belongs to this part: every n-th does.
    #[must_use]
    pub const fn has(self, place: u64) -> bool {
        place % self.of == self.index - 1
    }

    /// Every n-th of the `count` seeds that follow `base`: the parts together are all seeds.
    #[must_use]
    pub fn seeds(self, base: u64, count: u64) -> Vec<u64> {
        (0..count).filter(|offset| self.has(*offset)).map(|offset| base + 1 + offset).collect()
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let (index, of) = text.split_once('/').ok_or(ShardError)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| ShardError);
        let shard = Self { index: number(index)?, of: number(of)? };
        if (1..=shard.of).contains(&shard.index) { Ok(shard) } else { Err(ShardError) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_together_are_all_seeds() {
        for of in 1..=7 {
            let mut seeds: Vec<u64> = (1..=of)
                .flat_map(|index| format!("{index}/{of}").parse::<Shard>().unwrap().seeds(10, 5))
                .collect();
            seeds.sort_unstable();
            assert_eq!(seeds, [11, 12, 13, 14, 15], "{of}");
        }
        assert_eq!(Shard::ALL.seeds(0, 3), [1, 2, 3]);
    }

    #[test]
    fn what_is_no_part_is_refused() {
        for text in ["", "1", "0/4", "5/4", "0/0", "1/0", "-1/4", "a/b", "1/4/2", "1.5/4"] {
            assert_eq!(text.parse::<Shard>(), Err(ShardError), "{text}");
        }
        assert_eq!("2/4".parse::<Shard>().unwrap().to_string(), "2/4");
    }
}
