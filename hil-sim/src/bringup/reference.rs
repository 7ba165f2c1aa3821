//! Two weights on the preload sensor, two gauges under the compression sensor: which way each
//! reads, and its full scale. No motor moves.

use interstage::rig::Rig;
use interstage::sense::raw::SensorId;

use super::operator::name;
use super::pretightener::Level;
use super::{Action, BringupError, Check, Row, Session, row};

/// Rows of a level.
const CALM_ROWS: u32 = 800;
/// Ratio of the two below which they prove nothing of each other.
const APART: f64 = 2.0;

/// What is put at a sensor.
pub(super) struct Reference {
    sensor: SensorId,
    /// Its direction, agreement and scale.
    rows: [Row; 3],
    what: &'static str,
    unit: &'static str,
    key: &'static str,
    /// How well it is known: part, and in the unit, with the noise.
    known: (f64, f64),
    full_scale: fn(&mut Rig) -> &mut f64,
}

/// A weight by a kitchen's scales; a gauge with dirt under it.
pub(super) const WEIGHT: Reference = Reference {
    sensor: SensorId::PreloadSensor,
    rows: [row::WEIGHT_DIRECTION, row::WEIGHTS_AGREE, row::WEIGHT_SCALE],
    what: "weight",
    unit: "N",
    key: "sense.preload_full_scale_n",
    known: (0.005, 0.03),
    full_scale: |rig| &mut rig.sense.preload_full_scale_n,
};
pub(super) const GAUGE: Reference = Reference {
    sensor: SensorId::CompressionSensor,
    rows: [row::GAUGE_DIRECTION, row::GAUGES_AGREE, row::GAUGE_SCALE],
    what: "gauge",
    unit: "mm",
    key: "sense.tread_full_scale_mm",
    known: (0.01, 0.01),
    full_scale: |rig| &mut rig.sense.tread_full_scale_mm,
};

/// Puts both at the sensor, one after the other, and takes them off again.
pub(super) fn run(
    session: &mut Session<'_, '_>,
    of: &Reference,
) -> Result<Vec<Check>, BringupError> {
    session.operator.act(Action::LiftOff)?;
    let none = level(session, of)?;
    // What is known, and what the sensor shows of it.
    let mut points = [(0.0, 0.0); 2];
    for (is_second, point) in [false, true].into_iter().zip(&mut points) {
        *point = (session.operator.put(of.sensor, is_second)?, level(session, of)? - none);
    }
    session.operator.act(Action::TakeOff(of.sensor))?;
    // What is left after the way up and down does not belong to the scale.
    let left = (level(session, of)? - none).abs();
    let full_scale = (of.full_scale)(&mut session.proposed.rig);
    let (checks, found) = judge(of, points, left, *full_scale);
    if let Some((value, within)) = found {
        *full_scale = value;
        session.measured(of.key, value, within, &format!("two {}s", of.what));
    }
    Ok(checks)
}

/// What the sensor shows, once a hand's motion has died away.
fn level(session: &mut Session<'_, '_>, of: &Reference) -> Result<f64, BringupError> {
    let rows = session.line.listen(CALM_ROWS)?;
    let Level { preload, compression, .. } = Level::of(&rows, &session.proposed.rig)?;
    Ok(if of.sensor == SensorId::PreloadSensor { preload } else { compression })
}

/// The checks, and the full scale with half its interval if all have passed.
fn judge(
    of: &Reference,
    points: [(f64, f64); 2],
    left: f64,
    full_scale: f64,
) -> (Vec<Check>, Option<(f64, f64)>) {
    let Reference { rows: [direction, agree, scale], what, unit, key, known, .. } = of;
    let sensor = name(of.sensor);
    let [first, second] = points.map(|(is, read)| read / is);
    let (far, apart) = (points[1].0, points[1].0 / points[0].0);
    let (least, off) = (first.min(second), first / second - 1.0);
    let advice = if least < -0.1 {
        format!("the {sensor} is reversed: swap its two signal leads")
    } else {
        format!("the {sensor} does not show the {what}: where it is mounted, its amplifier")
    };
    let shown = points.map(|(is, read)| format!("{is} {unit}: {read:+.3} {unit}")).join(", ");
    let mut checks = vec![direction.by(Some(least), shown, &advice)];
    let advice = if apart < APART {
        format!("take a second {what} of twice the first or more")
    } else {
        format!(
            "the {sensor} is not linear, touches something, or is at its stop; or a {what} is not \
             what was typed. Repeat with others"
        )
    };
    let differ = (apart >= APART).then(|| off.abs().max(left / far));
    let shown = format!("{:+.1} % apart, {left:.3} {unit} left when taken off", 100.0 * off);
    if checks[0].ok {
        checks.push(agree.by(differ, shown, &advice));
    }
    // The larger one is known best; the other says how far it holds.
    let value = (1e3 * full_scale / second).round() * 1e-3;
    let within = value * (known.0 + (known.1 + left) / far + 0.5 * off.abs());
    let shown = format!("{value:.3} {unit}, {within:.3} {unit} either way");
    let advice = format!(
        "the {sensor}'s scale is wrong by {second:.2}: its amplifier's gain, or its data sheet's. \
         Set {key} = {value:.2}, write it to the board and begin again"
    );
    if checks.iter().all(|check| check.ok) {
        checks.push(scale.by(Some(second), shown, &advice));
    }
    let found = checks.iter().all(|check| check.ok).then_some((value, within));
    (checks, found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::tests::on_a_silent_log;

    #[test]
    fn a_silent_log_shows_no_level() {
        assert!(on_a_silent_log(|session| level(session, &WEIGHT)).is_err());
    }

    #[test]
    fn the_full_scale_has_an_interval_and_what_is_wrong_is_named() {
        let of = |reads: [f64; 2], known: [f64; 2], left| {
            judge(&WEIGHT, [(known[0], reads[0]), (known[1], reads[1])], left, 200.0)
        };
        // A sensor that shows 1 % too much, weights that are 0.3 % light and heavy.
        let (checks, found) = of([5.035, 15.195], [5.0, 15.0], 0.01);
        let (value, within) = found.expect("it is found");
        assert!(checks.len() == 3 && (value - 200.0 / 1.01).abs() < within, "{value} {within}");
        assert!((0.8..2.5).contains(&within), "{within}");
        for (reads, known, left, name, advice) in [
            ([-5.0, -15.0], [5.0, 15.0], 0.0, "weight direction", "swap its two signal leads"),
            ([0.0, 0.1], [5.0, 15.0], 0.0, "weight direction", "does not show"),
            ([5.0, 13.0], [5.0, 15.0], 0.0, "weights agree", "not linear"),
            ([5.0, 15.0], [5.0, 15.0], 0.5, "weights agree", "touches"),
            ([5.0, 6.0], [5.0, 6.0], 0.0, "weights agree", "twice the first or more"),
            ([5.5, 16.5], [5.0, 15.0], 0.0, "weight scale", "wrong by 1.10"),
        ] {
            let (checks, found) = of(reads, known, left);
            let last = checks.last().expect("a check");
            assert!(found.is_none() && !last.ok && last.name == name, "{last:?}");
            assert!(last.advice.contains(advice), "{last:?}");
        }
    }
}
