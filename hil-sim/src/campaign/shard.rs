//! Splits a campaign into parts for several machines.

use std::fmt;
use std::str::FromStr;

/// Part `index` of `of`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: u64,
    of: u64,
}

impl Shard {
    /// All of the campaign.
    pub(crate) const ALL: Self = Self { index: 1, of: 1 };

    /// The places of a campaign of `count` cases that belong to this part: every n-th does, so
    /// that the parts together are all.
    pub(crate) fn places(self, count: usize) -> Vec<usize> {
        (0..count).filter(|place| *place as u64 % self.of == self.index - 1).collect()
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
        let parts = text.split_once('/').and_then(|(index, of)| {
            Some(Self { index: index.parse().ok()?, of: of.parse().ok()? })
        });
        let sound = parts.filter(|shard| (1..=shard.of).contains(&shard.index));
        sound.ok_or("expected i/n with i from 1 to n, as in 1/4")
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
    fn the_parts_together_are_all_places() {
        for of in 1..=7 {
            let mut places: Vec<usize> = (1..=of)
                .flat_map(|index| format!("{index}/{of}").parse::<Shard>().unwrap().places(5))
                .collect();
            places.sort_unstable();
            assert_eq!(places, [0, 1, 2, 3, 4], "{of}");
        }
    }

    #[test]
    fn what_is_no_part_is_refused() {
        for text in ["", "1", "0/4", "5/4", "0/0", "1/0", "-1/4", "a/b", "1/4/2", "1.5/4"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
        assert_eq!("2/4".parse::<Shard>().unwrap().to_string(), "2/4");
    }
}
