//! What was identified: each parameter with its interval and what it was identified by,
//! what was left over, and the scenario with the new values in it.

use std::f64::consts::TAU as TURN;

use serde::Serialize;

use super::IdentifyError;
use super::actuator::{self, Actuator};
use super::contact::{self, Contact};
use super::coordinates::{
    ARM_ZERO, CREEP, Coordinates, DRIVE, FRICTION, GEARBOX, LOAD, LOAD_GAIN, RADIUS, STIFFENING,
    STIFFNESS, TAU, TREAD_GAIN,
};
use super::forward::{Channels, Fineness, Run};
use super::noise::Noise;
use super::record::Record;
use super::traces::Zero;
use crate::scenario::Scenario;

/// Half-width of a 95 % interval in standard deviations.
pub const NORMAL_95: f64 = 1.96;
/// What the logs must leave of what was known before for a parameter to count as
/// identified: where nothing was known, and where a tolerance was.
const LEAVES: (f64, f64) = (0.1, 0.5);
/// Variance of a whole number of ticks that stands for any dead time, ms^2.
const TICK_VARIANCE: f64 = 1.0 / 12.0;

/// A parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its key in a scenario, or its name where a scenario has none.
    pub name: String,
    /// Unit; empty for ratios.
    pub unit: &'static str,
    /// Value; the most likely one, whether the logs tell it well or not.
    pub value: f64,
    /// Lower end of the interval; none where nothing is left to tell it.
    pub low: Option<f64>,
    /// Its upper end.
    pub high: Option<f64>,
    /// Whether the logs tell it.
    pub identified: bool,
    /// What tells it, or why nothing does.
    pub by: String,
}

/// What was left over in a channel of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Left {
    /// The log.
    pub log: String,
    /// The channel.
    pub channel: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Root mean square.
    pub rms: f64,
    /// Values compared.
    pub count: usize,
    /// Values that count as independent.
    pub independent: f64,
    /// Time, s, and residual of each.
    #[serde(skip)]
    pub course: Vec<(f64, f64)>,
}

/// Everything that was identified.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// What was left over.
    pub residuals: Vec<Left>,
    /// Values compared less parameters fitted.
    pub degrees_of_freedom: usize,
    /// What the logs could not tell, in sentences.
    pub notes: Vec<String>,
    /// The scenario with what was identified.
    #[serde(skip)]
    pub scenario: Scenario,
}

/// Identifies the rig of `scenario` from its logs.
///
/// # Errors
/// [`IdentifyError`] if a log cannot be used or the fit does not settle.
pub fn identify(
    records: &[Record],
    scenario: &Scenario,
    fineness: Fineness,
) -> Result<Identification, IdentifyError> {
    for record in records {
        let (its, ours) = (&record.scenario.rig, &scenario.rig);
        if its.rig != ours.rig || its.sense != ours.sense || its.drive != ours.drive {
            return Err(IdentifyError::Log {
                name: record.name.clone(),
                why: "its sleeve, wheel, drive or sensors are not those of the rig that is \
                      identified"
                    .into(),
            });
        }
    }
    let coordinates = Coordinates::of(scenario);
    let runs: Vec<Run> =
        records.iter().map(|record| Run::of(record, &coordinates)).collect::<Result<_, _>>()?;
    let contact = contact::fit(&runs, &coordinates, fineness)?;
    let actuator = actuator::fit(records, &runs, &contact.courses, contact.x[RADIUS])?;
    let report = Report { scenario, coordinates: &coordinates, runs: &runs, contact: &contact };
    let mut parameters = report.contact_parameters();
    parameters.extend(report.actuator_parameters(&actuator));
    parameters.extend(report.zeros());
    let compared: usize = actuator.residuals.iter().map(Vec::len).sum();
    let fitted = contact.x.len() + actuator.x.len();
    Ok(Identification {
        scenario: updated(scenario, &parameters),
        residuals: report.left(&actuator),
        degrees_of_freedom: (contact.values + compared).saturating_sub(fitted),
        notes: report.notes(&parameters),
        parameters,
    })
}

struct Report<'a> {
    scenario: &'a Scenario,
    coordinates: &'a Coordinates,
    runs: &'a [Run],
    contact: &'a Contact,
}

/// A coordinate on its way to a parameter.
struct Shown {
    index: usize,
    name: String,
    unit: &'static str,
    by: &'static str,
}

impl Report<'_> {
    /// The parameter of a coordinate: `of` takes it to the parameter's own unit.
    fn parameter(&self, shown: Shown, of: impl Fn(f64) -> f64) -> Parameter {
        let Shown { index, name, unit, by } = shown;
        let (x, prior) = (self.contact.x[index], self.coordinates.priors()[index]);
        let deviation = self.contact.covariance[(index, index)].sqrt();
        let ends = [of(x - NORMAL_95 * deviation), of(x + NORMAL_95 * deviation)];
        let leaves = if prior.tolerance { LEAVES.1 } else { LEAVES.0 };
        let identified = deviation < leaves * prior.deviation;
        let by = match (identified, prior.tolerance) {
            (true, _) => by.to_owned(),
            (false, true) => "its tolerance".to_owned(),
            (false, false) => "not in these logs".to_owned(),
        };
        Parameter {
            name,
            unit,
            value: of(x),
            low: Some(ends[0].min(ends[1])),
            high: Some(ends[0].max(ends[1])),
            identified,
            by,
        }
    }

    fn contact_parameters(&self) -> Vec<Parameter> {
        let shown = |index, name: &str, unit, by| Shown { index, name: name.to_owned(), unit, by };
        let rig = &self.scenario.rig;
        let share = rig.plant.top_load_share;
        let zero_code = rig.sense.angle_zero_code;
        let friction = "creep at the climbs, by its law";
        let pressed = "compression under known preload, at rest";
        let mut list = vec![
            self.parameter(shown(STIFFNESS, "tread.k_inf_pa_per_m", "Pa/m", pressed), |x| {
                1e9 * x.exp()
            }),
            self.parameter(
                shown(STIFFENING, "tread.stiffening", "", "compression at rest and rolling"),
                f64::exp,
            ),
            self.parameter(
                shown(TAU, "tread.tau_s", "s", "compression and lift at several speeds"),
                f64::exp,
            ),
            self.parameter(shown(FRICTION, "plant.mu", "", friction), f64::exp),
            self.parameter(
                shown(LOAD, "plant.top_load_n", "N", "wedge of the arm and drive effort"),
                |x| x.exp() / share.max(1e-9),
            ),
            self.parameter(
                shown(GEARBOX, "gearbox friction", "N", "drive effort on the smooth wall"),
                |x| x,
            ),
            self.parameter(
                shown(RADIUS, "rig.wheel_radius_mm", "mm", "shape of the climbs"),
                |x| x,
            ),
            self.parameter(
                shown(LOAD_GAIN, "load cell gain", "", "loads against the drive"),
                f64::exp,
            ),
            self.parameter(
                shown(TREAD_GAIN, "displacement gain", "", "compression against the arm"),
                f64::exp,
            ),
            self.parameter(
                shown(CREEP, "plant.elastic_creep", "", "creep at the climbs"),
                f64::exp,
            ),
            self.parameter(
                shown(DRIVE, "drive force over nominal", "", "effort against load"),
                f64::exp,
            ),
            self.parameter(
                shown(ARM_ZERO, "sense.angle_zero_code", "codes", "arm angle at known radii"),
                |mrad| zero_code + 16_384.0 * 1e-3 * mrad / TURN,
            ),
        ];
        for step in 0..self.coordinates.steps() {
            let index = self.coordinates.position(step);
            let name = format!("rig.step_positions_mm[{}]", step + 1);
            let by = "turn of the wheel at the climb";
            let turned = self.parameter(Shown { index, name, unit: "mm", by }, |x| x);
            // The turn is told by the logs; the way, by the radius as well.
            let (value, variance) =
                self.coordinates.place(step, &self.contact.x, &self.contact.covariance);
            let half = NORMAL_95 * variance.sqrt();
            list.push(Parameter {
                value,
                low: Some(value - half),
                high: Some(value + half),
                ..turned
            });
        }
        for step in 0..self.coordinates.steps() {
            let index = self.coordinates.height(step);
            let name = format!("rig.step_height_mm[{}]", step + 1);
            list.push(self.parameter(
                Shown { index, name, unit: "mm", by: "arm angle before and after" },
                |x| x,
            ));
        }
        list
    }

    fn actuator_parameters(&self, actuator: &Actuator) -> Vec<Parameter> {
        // What the load cell scales: its gain, and how well that is known.
        let gain = self.contact.x[LOAD_GAIN].exp();
        let gain_variance = self.contact.covariance[(LOAD_GAIN, LOAD_GAIN)];
        let x = &actuator.x;
        let variance = |index: usize| actuator.covariance[(index, index)];
        let by = "load cell against duty".to_owned();
        let of = |name: &str, unit, value: f64, low: f64, high: f64| Parameter {
            name: name.to_owned(),
            unit,
            value,
            low: Some(low),
            high: Some(high),
            identified: high - low < 0.5 * value.abs(),
            by: by.clone(),
        };
        let around = |name: &str, unit, value: f64, deviation: f64| {
            let half = NORMAL_95 * deviation;
            of(name, unit, value, value - half, value + half)
        };
        let scaled = |name: &str, unit, index: usize| {
            let value = x[index] / gain;
            let relative = variance(index) / (x[index] * x[index]) + gain_variance;
            around(name, unit, value, value.abs() * relative.sqrt())
        };
        let delay = (variance(actuator::DELAY) + TICK_VARIANCE).sqrt();
        let (lag, deviation) = (x[actuator::LAG], variance(actuator::LAG).sqrt());
        let lag = [lag, lag - NORMAL_95 * deviation, lag + NORMAL_95 * deviation].map(f64::exp);
        vec![
            around("preload.delay_s", "s", 1e-3 * x[actuator::DELAY], 1e-3 * delay),
            of("preload.lag_s", "s", lag[0], lag[1], lag[2]),
            scaled("preload.slew_n_per_s", "N/s", actuator::SLEW),
            scaled("preload.spring_n_per_mm", "N/mm", actuator::SPRING),
        ]
    }

    fn zeros(&self) -> Vec<Parameter> {
        let of = |name: &str, unit, zeros: Vec<Zero>| {
            // Weighted by their readings.
            let count: usize = zeros.iter().map(|zero| zero.count).sum();
            let n = count.max(1) as f64;
            let part = |zero: &Zero| zero.count as f64 / n;
            let value: f64 = zeros.iter().map(|zero| part(zero) * zero.value).sum();
            let variance: f64 =
                zeros.iter().map(|zero| (part(zero) * zero.error).powi(2)).sum::<f64>();
            let half = NORMAL_95 * variance.sqrt();
            let known = count > 0;
            Parameter {
                name: name.to_owned(),
                unit,
                value,
                low: known.then_some(value - half),
                high: known.then_some(value + half),
                identified: known,
                by: if known { "the unloaded rig" } else { "not in these logs" }.to_owned(),
            }
        };
        let each = |pick: fn(&Run) -> Zero| self.runs.iter().map(pick).collect();
        vec![
            of("load cell zero", "N", each(|run| run.traces.load_cell)),
            of("displacement zero", "mm", each(|run| run.traces.tread)),
        ]
    }

    fn left(&self, actuator: &Actuator) -> Vec<Left> {
        let mut left = Vec::new();
        for (index, run) in self.runs.iter().enumerate() {
            let (times, values) = (run.times(), &self.contact.residuals[index]);
            let channels = Channels::NAMES.into_iter().zip(times.each()).zip(values.each());
            for (((channel, unit), times), values) in channels {
                left.push(of_channel(&run.name, (channel, unit), times, values));
            }
            let (times, values) = (&actuator.times[index], &actuator.residuals[index]);
            left.push(of_channel(&run.name, ("preload", "N"), times, values));
        }
        left
    }

    fn notes(&self, parameters: &[Parameter]) -> Vec<String> {
        let mut notes = Vec::new();
        let courses = &self.contact.courses;
        let most = courses.iter().map(|c| c.most_utilisation()).fold(0.0, f64::max);
        notes.push(format!(
            "friction: the climbs used {most:.2}, so that it is at least that; the rest is what \
             their creep tells, given plant.elastic_creep"
        ));
        for run in self.runs.iter().filter(|run| run.traces.slip.is_some()) {
            notes.push(format!(
                "{}: slips at a step without getting up; what comes after is not compared",
                run.name
            ));
        }
        if self.runs.iter().all(|run| run.traces.load_cell.count == 0) {
            notes.push(
                "no log begins with the rig unloaded: the sensors' zeros are taken for \
                        none"
                    .to_owned(),
            );
        }
        for parameter in parameters.iter().filter(|p| !p.identified) {
            if parameter.by == "not in these logs" {
                notes.push(format!("{}: not in these logs, left as it was", parameter.name));
            }
        }
        notes
    }
}

fn of_channel(
    log: &str,
    (channel, unit): (&'static str, &'static str),
    times: &[f64],
    values: &[f64],
) -> Left {
    let noise = Noise::of(values);
    Left {
        log: log.to_owned(),
        channel,
        unit,
        rms: noise.deviation,
        count: values.len(),
        independent: values.len() as f64 / noise.inflation,
        course: times.iter().copied().zip(values.iter().copied()).collect(),
    }
}

/// The scenario with what was identified in it; what was not stays as it was.
fn updated(scenario: &Scenario, parameters: &[Parameter]) -> Scenario {
    let mut scenario = scenario.clone();
    let rig = &mut scenario.rig;
    let mut heights = Vec::new();
    for parameter in parameters.iter().filter(|parameter| parameter.identified) {
        let value = parameter.value;
        let (key, index) = match parameter.name.split_once('[') {
            Some((key, index)) => (key, index.trim_end_matches(']').parse().unwrap_or(0)),
            None => (parameter.name.as_str(), 0usize),
        };
        match key {
            "tread.k_inf_pa_per_m" => rig.tread.k_inf_pa_per_m = value,
            "tread.stiffening" => rig.tread.stiffening = value,
            "tread.tau_s" => rig.tread.tau_s = value,
            "plant.mu" => rig.plant.mu = value,
            "plant.elastic_creep" => rig.plant.elastic_creep = value,
            "plant.top_load_n" => rig.plant.top_load_n = value,
            "rig.wheel_radius_mm" => rig.rig.wheel_radius_mm = value,
            "sense.angle_zero_code" => rig.sense.angle_zero_code = value,
            "preload.delay_s" => rig.preload.delay_s = value,
            "preload.lag_s" => rig.preload.lag_s = value,
            "preload.slew_n_per_s" => rig.preload.slew_n_per_s = value,
            "preload.spring_n_per_mm" => rig.preload.spring_n_per_mm = value,
            "rig.step_height_mm" => heights.push(value),
            "rig.step_positions_mm" => {
                if let Some(position) = rig.rig.step_positions_mm.get_mut(index.wrapping_sub(1)) {
                    *position = value;
                }
            }
            _ => {}
        }
    }
    // A scenario has one height for all steps.
    if !heights.is_empty() {
        rig.rig.step_height_mm = heights.iter().sum::<f64>() / heights.len() as f64;
    }
    scenario
}

impl Identification {
    /// A parameter by its name.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// The scenario file: what was identified stands in it, with its interval above.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::from("# Identified from logs; 95 % intervals:\n");
        for p in self.parameters.iter().filter(|p| p.identified) {
            if let (Some(low), Some(high)) = (p.low, p.high) {
                text += &format!("#   {} = {} ({low} to {high}) {}\n", p.name, p.value, p.unit);
            }
        }
        text += "# One height stands for all steps; sensors' zeros are taken anew at each start.\n";
        text + "\n" + &self.scenario.to_toml()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str, value: f64, identified: bool) -> Parameter {
        Parameter {
            name: name.into(),
            unit: "",
            value,
            low: Some(value - 0.1),
            high: Some(value + 0.1),
            identified,
            by: String::new(),
        }
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
            parameter("load cell zero", 3.0, true),
        ];
        let after = updated(&before, &parameters);
        assert_eq!(after.rig.tread.tau_s, 0.2);
        assert_eq!(after.rig.plant.mu, before.rig.plant.mu);
        assert_eq!(after.rig.rig.step_positions_mm[1], 40.25);
        assert_eq!(after.rig.rig.step_positions_mm[0], before.rig.rig.step_positions_mm[0]);
        assert!((after.rig.rig.step_height_mm - 4.05).abs() < 1e-12);
        let whole = Identification {
            parameters: parameters.to_vec(),
            residuals: Vec::new(),
            degrees_of_freedom: 1,
            notes: Vec::new(),
            scenario: after.clone(),
        };
        let read = Scenario::parse("identified.toml", &whole.to_toml(), &[]).unwrap();
        assert_eq!(read, after);
        assert!(whole.to_toml().contains("tread.tau_s = 0.2 (0.1 to 0.3"));
    }
}
