//! A key over a range, or several over a grid: the places, the rows, the picture.

mod picture;

use std::str::FromStr;

use serde_json::{Map, Value};

pub(crate) use picture::{Plot, picture};

/// Most places of a grid.
pub(crate) const MOST: usize = 10_000;

/// A key with the values that it takes one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    pub key: String,
    /// Its values, as `--set` takes them.
    pub values: Vec<String>,
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "expected KEY=LOW..HIGH:COUNT, KEY=LOW..HIGH:COUNTlog or KEY=A,B,C, \
                    as in tread.tau_s=0.02..0.2:7";
        let (key, values) = text.split_once('=').ok_or(form)?;
        let values = match values.split_once("..") {
            Some((low, rest)) => range(low, rest).map_err(|why| format!("{form} ({why})"))?,
            None => values.split(',').map(|value| value.trim().to_owned()).collect(),
        };
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(form.to_owned());
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// The values of `low..high:count`, even, or even in their logarithm.
fn range(low: &str, rest: &str) -> Result<Vec<String>, String> {
    let (high, count) = rest.split_once(':').ok_or("how many values: LOW..HIGH:COUNT")?;
    let (count, is_log) = count.strip_suffix("log").map_or((count, false), |count| (count, true));
    let number = |text: &str| {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("{text} is no number"))
    };
    let (low, high) = (number(low)?, number(high)?);
    let count: usize = count.trim().parse().map_err(|_| format!("{count} is no count"))?;
    if !(2..=MOST).contains(&count) {
        return Err(format!("2 to {MOST} values"));
    }
    if is_log && (low <= 0.0 || high <= 0.0) {
        return Err("a logarithm takes values above 0".to_owned());
    }
    let at = |index: usize| {
        let part = index as f64 / (count - 1) as f64;
        match index {
            _ if index + 1 == count => high,
            _ if is_log => low * (high / low).powf(part),
            _ => low + (high - low) * part,
        }
    };
    Ok((0..count).map(|index| rounded(at(index))).collect())
}

/// Nine digits are enough, and show no rounding.
fn rounded(value: f64) -> String {
    let short: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    short.to_string()
}

/// Every place of the grid, the last key fastest: a value of each axis.
pub(crate) fn places<'a>(axes: &'a [Axis]) -> Vec<Vec<&'a str>> {
    let mut places = vec![Vec::new()];
    for axis in axes {
        let with = |place: &Vec<&'a str>| -> Vec<Vec<&'a str>> {
            axis.values.iter().map(|value| [&place[..], &[value.as_str()]].concat()).collect()
        };
        places = places.iter().flat_map(with).collect();
    }
    places
}

/// A row: the values of the keys, then what was found there.
pub(crate) fn row(axes: &[Axis], place: &[&str], found: Map<String, Value>) -> Map<String, Value> {
    let value = |text: &str| {
        let number = text.parse::<f64>().ok().and_then(serde_json::Number::from_f64);
        number.map_or_else(|| Value::from(text), Value::Number)
    };
    let keys = axes.iter().zip(place).map(|(axis, text)| (axis.key.clone(), value(text)));
    keys.chain(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        text.parse::<Axis>().unwrap().values
    }

    #[test]
    fn ranges_are_even_or_even_in_their_logarithm_and_end_where_they_should() {
        assert_eq!(values("tread.tau_s=0.02..0.2:7")[..3], ["0.02", "0.05", "0.08"]);
        assert_eq!(values("tread.tau_s=0.02..0.2:7")[6], "0.2");
        assert_eq!(values("a=1..100:3log"), ["1", "10", "100"]);
        assert_eq!(values("run.seed=1..5:5"), ["1", "2", "3", "4", "5"]);
        assert_eq!(values("a=3..1:3"), ["3", "2", "1"]);
        assert_eq!(values("run.controller=limit, constant"), ["limit", "constant"]);
    }

    #[test]
    fn what_is_no_range_is_refused_with_an_example() {
        for text in
            ["tau", "=1..2:3", "a=", "a=1..2", "a=1..x:3", "a=1..2:1", "a=0..2:3log", "a=1,,2"]
        {
            let error = text.parse::<Axis>().unwrap_err();
            assert!(error.contains("tread.tau_s=0.02..0.2:7"), "{text}: {error}");
        }
    }

    #[test]
    fn a_grid_has_every_combination_in_order() {
        let axes = ["a=1,2", "b=x,y,z"].map(|text| text.parse::<Axis>().unwrap());
        let all = places(&axes);
        assert_eq!(all.len(), 6);
        assert_eq!((&all[0][..], &all[4][..]), (&["1", "x"][..], &["2", "y"][..]));
        let rows: Vec<_> = all.iter().map(|place| row(&axes, place, Map::new())).collect();
        assert_eq!((&rows[4]["a"], &rows[4]["b"]), (&2.0.into(), &"y".into()));
    }
}
