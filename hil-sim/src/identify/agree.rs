//! Whether logs are of one rig.

use super::coordinates::RADIUS;
use super::least_squares::Noise;
use super::record::Record;
use super::result::Fit;
use super::{IdentifyError, actuator, contact};

/// Largest shift of logs of one rig, see [`Fit::agree`]: mostly 3, but up to 30 where a fit ends in a
/// small minimum (2 of 120 rigs); 55 and more between rigs whose friction differs by a quarter.
const AGREE: f64 = 40.0;
/// Least deviation of the preload, N: with a supply within 2 %, the slews of two logs of one rig are
/// up to 4 % apart, which is so much of the 15 N that a run builds up, in the mean of both.
const DRIFT_N: f64 = 0.3;

impl Fit {
    /// Refuses logs of several rigs, by contact or by pre-tightener. The square of the shift from
    /// what a log's own fit leaves to what the common fit leaves, in deviations of the own one, is
    /// about the number of coordinates where noise alone differs. The one shifted most is named.
    pub(super) fn agree(&self, records: &[Record]) -> Result<(), IdentifyError> {
        if records.len() < 2 {
            return Ok(());
        }
        let named =
            records.iter().enumerate().map(|(log, of)| (of.name.clone(), self.shift(records, log)));
        match named.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((name, shift)) if shift > AGREE => Err(IdentifyError::Several(name, shift.sqrt())),
            _ => Ok(()),
        }
    }

    /// Of a log, a coordinate. One that settles nothing alone contradicts nothing.
    fn shift(&self, records: &[Record], log: usize) -> f64 {
        let (run, at) = (&self.runs[log..=log], &self.contact.trajectories[log..=log]);
        let own = contact::refit(run, &self.coordinates, (&self.contact.x, at)).ok();
        let common = &self.contact.residuals[log];
        let contact = own.map(|own| moved(&own.residuals[0], common, &contact::LEAST, own.x.len()));
        let own = actuator::fit(&records[log..=log], run, at, self.contact.x[RADIUS]).ok();
        let (common, least) = (&self.actuator.residuals[log..=log], [DRIFT_N]);
        let screw = own.map(|own| moved(&own.residuals, common, &least, own.x.len()));
        contact.into_iter().chain(screw).fold(0.0, f64::max)
    }
}

fn moved(own: &[Vec<f64>], common: &[Vec<f64>], least: &[f64], coordinates: usize) -> f64 {
    let channel = |((own, common), least): ((&Vec<f64>, &Vec<f64>), &f64)| -> f64 {
        let deviation = Noise::of(own).effective().max(*least);
        own.iter().zip(common).map(|(own, common)| ((own - common) / deviation).powi(2)).sum()
    };
    own.iter().zip(common).zip(least).map(channel).sum::<f64>() / coordinates as f64
}
