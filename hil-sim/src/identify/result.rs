//! The result of identification: each parameter with its interval and its evidence, the
//! residuals, and the scenario with the new values.

use std::collections::BTreeMap;

use interstage::rig::Rig;
use serde::Serialize;
use toml::{Table, Value};

use super::IdentifyError;
use super::actuator::{self, Actuator};
use super::contact::{self, Contact};
use super::coordinates::{Coordinates, LOAD_GAIN, NO_LOAD, RADIUS, ROWS, itself};
use super::forward::{CHANNELS, Run};
use super::least_squares::Noise;
use super::record::Record;
use super::traces::Zero;
use crate::scenario::Scenario;

/// Half-width of an interval in standard deviations: of a rig's 26 values all are within theirs
/// with 95 %, each with 0.998 (Bonferroni).
pub(super) const WITHIN: f64 = 3.1;
/// Part of the prior deviation that the logs must leave for a parameter to count as
/// identified: where nothing was known, and where a tolerance was.
const LEAVES: (f64, f64) = (0.1, 0.5);
/// Evidence of a parameter that has none.
const NOTHING: &str = "not in these logs";

/// What stands between interval and logs in the source of a value that identification has found.
pub(crate) const BY: &str = ", identified from ";

/// A parameter with its interval: a rig's values are all within theirs with 95 %.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its key in a scenario, or its name where a scenario has none.
    pub name: String,
    /// Unit; empty for ratios.
    pub unit: &'static str,
    /// The most likely value, whether the logs determine it well or not.
    pub value: f64,
    /// Lower end of the interval; none where nothing determines it.
    pub low: Option<f64>,
    /// Its upper end.
    pub high: Option<f64>,
    /// Whether the logs determine it.
    pub identified: bool,
    /// By what, or why not.
    pub by: String,
}

impl Parameter {
    fn new(
        name: &str,
        unit: &'static str,
        value: f64,
        interval: Option<[f64; 2]>,
        identified: bool,
        by: &str,
    ) -> Self {
        let (low, high) = interval.map(|[low, high]| (low, high)).unzip();
        Self { name: name.to_owned(), unit, value, low, high, identified, by: by.to_owned() }
    }

    /// Its interval in words.
    pub(crate) fn interval(&self) -> String {
        let width = self.high.zip(self.low).map_or(0.0, |(high, low)| high - low);
        let end = |end: Option<f64>| end.map_or("-".to_owned(), |end| figures(end, width));
        format!("{} to {}", end(self.low), end(self.high))
    }
}

/// Residuals of a channel of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Residuals {
    pub log: String,
    pub channel: &'static str,
    pub unit: &'static str,
    /// Root mean square.
    pub rms: f64,
    /// Values compared.
    pub count: usize,
    /// Values that count as independent.
    pub independent: f64,
    /// Time, s, and residual of each.
    #[serde(skip)]
    pub series: Vec<(f64, f64)>,
}

impl Residuals {
    fn of(
        run: &Run,
        (channel, unit): (&'static str, &'static str),
        times: &[f64],
        values: &[f64],
    ) -> Self {
        let noise = Noise::of(values);
        Self {
            log: run.name.clone(),
            channel,
            unit,
            rms: noise.deviation,
            count: values.len(),
            independent: values.len() as f64 / noise.inflation,
            series: times.iter().copied().zip(values.iter().copied()).collect(),
        }
    }
}

/// Everything that was identified.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    pub parameters: Vec<Parameter>,
    pub residuals: Vec<Residuals>,
    /// Values compared less parameters fitted.
    pub degrees_of_freedom: usize,
    /// What is missing of the logs, and what they do not determine, in sentences.
    pub notes: Vec<String>,
    /// Whether nothing is missing of the logs.
    pub is_complete: bool,
    /// The scenario with what was identified.
    #[serde(skip)]
    pub scenario: Scenario,
}

/// The fit behind a result.
pub(super) struct Fit {
    pub(super) coordinates: Coordinates,
    pub(super) runs: Vec<Run>,
    pub(super) contact: Contact,
    pub(super) actuator: Actuator,
}

/// Identifies the rig of `scenario` from its logs.
pub fn identify(records: &[Record], scenario: &Scenario) -> Result<Identification, IdentifyError> {
    let (found, fit) = fitted(records, scenario)?;
    fit.agree(records)?;
    Ok(found)
}

/// The same with the fit.
pub(super) fn fitted(
    records: &[Record],
    scenario: &Scenario,
) -> Result<(Identification, Fit), IdentifyError> {
    for record in records {
        let (its, ours) = (&record.scenario.rig, &scenario.rig);
        if its.rig != ours.rig || its.sense != ours.sense || its.drive != ours.drive {
            let why = "its sleeve, wheel, drive or sensors are not those of the rig that is \
                       identified";
            return Err(IdentifyError::Log(record.name.clone(), why.to_owned()));
        }
    }
    let mut coordinates = Coordinates::of(scenario);
    let run = |record| Run::of(record, &mut coordinates);
    let runs: Vec<Run> = records.iter().map(run).collect::<Result<_, _>>()?;
    let contact = contact::fit(&runs, &coordinates)?;
    let actuator = actuator::fit(records, &runs, &contact.trajectories, contact.x[RADIUS])?;
    let lost = actuator.x[actuator::LOST];
    let report =
        Document { scenario, coordinates: &coordinates, runs: &runs, contact: &contact, lost };
    let mut parameters = report.contact_parameters();
    parameters.extend(report.actuator_parameters(&actuator));
    parameters.extend(report.zeros());
    let missing = |record: &Record| -> Vec<String> {
        record.missing.iter().map(|what| format!("{}: {what}", record.name)).collect()
    };
    let missing: Vec<String> = records.iter().flat_map(missing).collect();
    let is_complete = missing.is_empty();
    let compared = contact.residuals.iter().flatten().chain(&actuator.residuals).map(Vec::len);
    let fitted = contact.x.len() + actuator.x.len();
    let logs: Vec<&str> = records.iter().map(|record| &*record.name).collect();
    let found = Identification {
        scenario: updated(scenario, &parameters, &logs.join(", ")),
        residuals: report.residuals(&actuator),
        degrees_of_freedom: compared.sum::<usize>().saturating_sub(fitted),
        notes: [missing, report.notes(&parameters)].concat(),
        is_complete,
        parameters,
    };
    Ok((found, Fit { coordinates, runs, contact, actuator }))
}

struct Document<'a> {
    scenario: &'a Scenario,
    coordinates: &'a Coordinates,
    runs: &'a [Run],
    contact: &'a Contact,
    /// Part of full duty that a bridge loses.
    lost: f64,
}

impl Document<'_> {
    /// The parameter of a coordinate by its name, unit and evidence: `of` takes it to its own unit.
    fn parameter(
        &self,
        index: usize,
        (name, unit, by): (&str, &'static str, &str),
        of: fn(f64, &Rig) -> f64,
    ) -> Parameter {
        let of = |x: f64| of(x, &self.scenario.rig);
        let (x, prior) = (self.contact.x[index], self.coordinates.priors()[index]);
        // A bridge cuts some pulses short, at full duty none: the drive's as the pre-tightener's.
        let cut = if index == NO_LOAD { self.lost } else { 0.0 };
        let deviation = self.contact.covariance[(index, index)].sqrt().hypot(cut);
        let ends = [of(x - WITHIN * deviation), of(x + WITHIN * deviation)];
        let leaves = if prior.tolerance { LEAVES.1 } else { LEAVES.0 };
        let identified = deviation < leaves * prior.deviation;
        let by = match (identified, prior.tolerance) {
            (true, _) => by,
            (false, true) => "its tolerance",
            (false, false) => NOTHING,
        };
        let interval = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        Parameter::new(name, unit, of(x), Some(interval), identified, by)
    }

    fn contact_parameters(&self) -> Vec<Parameter> {
        let rows = ROWS.iter().enumerate();
        let mut list: Vec<Parameter> =
            rows.map(|(index, row)| self.parameter(index, row.shown, row.of)).collect();
        for step in 0..self.coordinates.steps() {
            let name = format!("rig.step_positions_mm[{}]", step + 1);
            let by = "turn of the wheel at the climb";
            let index = self.coordinates.position(step);
            let turned = self.parameter(index, (&name, "mm", by), itself);
            // The logs determine the turn; the position depends on the radius as well.
            let (value, variance) =
                self.coordinates.place(step, &self.contact.x, &self.contact.covariance);
            let half = WITHIN * variance.sqrt();
            let (low, high) = (Some(value - half), Some(value + half));
            list.push(Parameter { value, low, high, ..turned });
        }
        for step in 0..self.coordinates.steps() {
            let name = format!("rig.step_height_mm[{}]", step + 1);
            let by = "arm angle before and after";
            list.push(self.parameter(self.coordinates.height(step), (&name, "mm", by), itself));
        }
        list
    }

    fn actuator_parameters(&self, actuator: &Actuator) -> Vec<Parameter> {
        // The gain of the preload sensor scales forces and their intervals.
        let gain = self.contact.x[LOAD_GAIN].exp();
        let gain_variance = self.contact.covariance[(LOAD_GAIN, LOAD_GAIN)];
        let x = &actuator.x;
        let variance = |index: usize| actuator.covariance[(index, index)];
        let of = |name: &str, unit, value: f64, [low, high]: [f64; 2]| {
            let identified = high - low < 0.5 * value.abs();
            let by = "preload sensor against duty";
            Parameter::new(name, unit, value, Some([low, high]), identified, by)
        };
        let around = |name: &str, unit, value: f64, deviation: f64| {
            let half = WITHIN * deviation;
            of(name, unit, value, [value - half, value + half])
        };
        let scaled = |name: &str, unit, index: usize| {
            let value = x[index] / gain;
            let relative = variance(index) / (x[index] * x[index]) + gain_variance;
            around(name, unit, value, value.abs() * relative.sqrt())
        };
        let delay = variance(actuator::DELAY).sqrt();
        let (lag, deviation) = (x[actuator::LAG], variance(actuator::LAG).sqrt());
        let lag = [lag, lag - WITHIN * deviation, lag + WITHIN * deviation].map(f64::exp);
        vec![
            around("preload.delay_s", "s", 1e-3 * x[actuator::DELAY], 1e-3 * delay),
            of("preload.lag_s", "s", lag[0], [lag[1], lag[2]]),
            scaled("preload.slew_n_per_s", "N/s", actuator::SLEW),
            scaled("preload.spring_n_per_mm", "N/mm", actuator::SPRING),
            around("pre-tightener friction", "", self.lost, variance(actuator::LOST).sqrt()),
        ]
    }

    fn zeros(&self) -> [Parameter; 2] {
        let of = |name: &str, unit, pick: fn(&Run) -> Zero| {
            let zeros: Vec<Zero> = self.runs.iter().map(pick).collect();
            // Weighted by their readings.
            let count: usize = zeros.iter().map(|zero| zero.count).sum();
            let n = count.max(1) as f64;
            let part = |zero: &Zero| zero.count as f64 / n;
            let value: f64 = zeros.iter().map(|zero| part(zero) * zero.value).sum();
            let variance: f64 =
                zeros.iter().map(|zero| (part(zero) * zero.error).powi(2)).sum::<f64>();
            let half = WITHIN * variance.sqrt();
            let interval = (count > 0).then_some([value - half, value + half]);
            let by = interval.map_or(NOTHING, |_| "the unloaded rig");
            Parameter::new(name, unit, value, interval, count > 0, by)
        };
        [
            of("preload sensor zero", "N", |run| run.traces.preload_zero),
            of("compression sensor zero", "mm", |run| run.traces.compression_zero),
        ]
    }

    fn residuals(&self, actuator: &Actuator) -> Vec<Residuals> {
        let mut all = Vec::new();
        for (index, run) in self.runs.iter().enumerate() {
            let (times, values) = (run.times(), &self.contact.residuals[index]);
            let channels = CHANNELS.into_iter().zip(&times).zip(values);
            all.extend(channels.map(|((name, times), of)| Residuals::of(run, name, times, of)));
            let (times, values) = (&actuator.times[index], &actuator.residuals[index]);
            all.push(Residuals::of(run, ("preload", "N"), times, values));
        }
        all
    }

    fn notes(&self, parameters: &[Parameter]) -> Vec<String> {
        let trajectories = self.contact.trajectories.iter();
        let most = trajectories.map(|t| t.most_utilisation).fold(0.0, f64::max);
        let mut notes = vec![format!(
            "friction: the climbs used {most:.2}, so that it is at least that; the rest is what \
             their creep shows, beside the compliance along the wall"
        )];
        notes.extend(self.runs.iter().filter(|run| run.traces.slips).map(|run| {
            let name = &run.name;
            format!("{name}: slips at a step without getting up; what comes after is not compared")
        }));
        if self.runs.iter().all(|run| run.traces.preload_zero.count == 0) {
            let note = "no log begins with the rig unloaded: the sensors' zeros are taken for none";
            notes.push(note.to_owned());
        }
        let left = parameters.iter().filter(|p| !p.identified && p.by == NOTHING);
        notes.extend(left.map(|p| format!("{}: {NOTHING}, left as it was", p.name)));
        notes
    }
}

/// The scenario with what was identified in it, and from which logs.
fn updated(scenario: &Scenario, parameters: &[Parameter], logs: &str) -> Scenario {
    let mut table = Table::try_from(scenario).expect("a scenario is always TOML");
    let (mut heights, mut intervals) = (Vec::new(), BTreeMap::<&str, Vec<String>>::new());
    for of in parameters.iter().filter(|of| of.identified) {
        if of.name.starts_with("rig.step_height_mm") {
            heights.push(of.value);
        }
        if let Some(place) = place_of(&mut table, &of.name) {
            *place = of.value.into();
            let key = of.name.split('[').next().unwrap_or_default();
            intervals.entry(key).or_default().push(of.interval());
        }
    }
    let mut found: Scenario = table.try_into().expect("numbers replace numbers");
    // A scenario has one height for all steps.
    if !heights.is_empty() {
        found.rig.rig.step_height_mm = heights.iter().sum::<f64>() / heights.len() as f64;
    }
    found.sources.clone_from(&scenario.sources);
    found.sources.extend(
        intervals
            .into_iter()
            .map(|(key, all)| (key.to_owned(), format!("{}{BY}{logs}", all.join("; ")))),
    );
    found
}

/// Where a scenario has the value of this parameter; none for what is no key. All steps have one
/// height.
pub(super) fn place_of<'a>(table: &'a mut Table, name: &str) -> Option<&'a mut Value> {
    let (section, name) = name.split_once('.')?;
    let (name, index) = name.split_once('[').unwrap_or((name, ""));
    match table.get_mut(section)?.get_mut(name)? {
        Value::Array(list) => {
            list.get_mut(index.trim_end_matches(']').parse::<usize>().ok()?.checked_sub(1)?)
        }
        value => Some(value),
    }
}

impl Identification {
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// The scenario file, which has the source of each identified value.
    pub(crate) fn to_toml(&self) -> String {
        "# One height is that of all steps; sensors' zeros are taken again at each start.\n"
            .to_owned()
            + &self.scenario.to_toml()
    }
}

/// As many decimals as the interval's width asks for; of large numbers five digits.
pub(crate) fn figures(value: f64, width: f64) -> String {
    if value.abs() >= 1e6 {
        return format!("{value:.4e}");
    }
    let decimals = if width > 0.0 && width.is_finite() {
        (1.0 - width.log10().floor()).clamp(0.0, 6.0) as usize
    } else {
        4
    };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str, value: f64, identified: bool) -> Parameter {
        Parameter::new(name, "", value, Some([value - 0.1, value + 0.1]), identified, "")
    }

    #[test]
    fn the_scenario_takes_over_what_was_identified_and_nothing_else() {
        let before = Scenario::default();
        let parameters = [
            parameter("tread.tau_s", 0.2, true),
            parameter("plant.mu", 0.7, false),
            parameter("rig.step_positions_mm[2]", 40.25, true),
            parameter("rig.step_height_mm[1]", 4.1, true),
            parameter("rig.step_height_mm[2]", 4.0, true),
            parameter("preload sensor zero", 3.0, true),
        ];
        let after = updated(&before, &parameters, "a log");
        assert_eq!(after.rig.tread.tau_s, 0.2);
        assert_eq!(after.rig.plant.mu, before.rig.plant.mu);
        assert_eq!(after.rig.rig.step_positions_mm[1], 40.25);
        assert_eq!(after.rig.rig.step_positions_mm[0], before.rig.rig.step_positions_mm[0]);
        assert!((after.rig.rig.step_height_mm - 4.05).abs() < 1e-12);
        let found = Identification {
            parameters: parameters.to_vec(),
            residuals: Vec::new(),
            degrees_of_freedom: 1,
            notes: Vec::new(),
            is_complete: true,
            scenario: after.clone(),
        };
        let read = Scenario::parse("identified.toml", &found.to_toml(), &[]).unwrap();
        assert_eq!(read, after);
        assert_eq!(read.sources["tread.tau_s"], "0.10 to 0.30, identified from a log");
        assert!(!read.assumed().contains(&"tread.tau_s".to_owned()) && read.assumed().len() > 9);
    }
}
