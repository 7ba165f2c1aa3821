//! Axial position: the wheel's travel, less what rolling over corners takes, corrected at
//! every recognised step. What the steps show of the wheel's rolling radius corrects the travel
//! after them, within the run: the next one finds the same steps again, which are no news.

use crate::numeric::{between, divide, sqrt};
use crate::units::{Direction, Millimetres, Q16, Ratio, Travel, q16};

/// Deviation of a step's place, mm: a sleeve is machined to 0.3 mm, evenly spread; its reciprocal.
const PLACE: Millimetres = q16(173_205);
const PER_PLACE: Q16 = q16(5_773_503);
/// Variance of a known position over that of a step's place: 0.03 mm.
const KNOWN: Ratio = q16(30_000);
/// What the variance of the position grows by from step to step: 0.03 mm, on a corner above all; and a
/// tenth of what the tread gives way by. So much more it creeps at one speed than at another, by its
/// model, if it relaxes in a third of its time or in three times that.
const WANDERS: Ratio = q16(30_000);
const WANDERS_PART: Ratio = q16(100_000);
/// Creep that counts, mm: of a corner. On a wall it is always the same.
const ON_CORNER: Millimetres = q16(2_000_000);
/// The same of the travel after 64 mm while no step has shown the wheel's radius: 0.13 %, a wheel
/// that is made and worn to 0.05 mm.
const UNKNOWN_RADIUS: Ratio = q16(250_000);
/// Reciprocal of these 64 mm.
const PER_REACH: Q16 = q16(15_625);
/// The same of the part by which the tread winds up otherwise than by its model, per millimetre: 0.2,
/// of a compound and a hub that make it 0.7 to 1.4 times as compliant.
const UNKNOWN_WINDING: Ratio = q16(1_333_000);
/// The same of its creep, of the same compliance and of a contact that is 0.1 longer or shorter.
const UNKNOWN_CREEP: Ratio = q16(1_667_000);
/// Variance of where a step is found, over that of its place: as that, and by how it is seen: two codes
/// of the arm, 0.09 mm.
const FOUND: Ratio = q16(1_250_000);
/// By how much all edges of a sleeve seem off together, mm: rounded by up to 0.5 mm, of which half shows to
/// a wheel that climbs, and most to one that comes down, evenly spread; and while none has shown what the
/// compression sensor misses.
const ROUNDED: [Millimetres; 2] = [q16(140_000), q16(250_000)];
const UNREAD: Millimetres = q16(220_000);
/// Number of readings that count as scattering by their sigmas before the first: as many as a run over
/// three steps has. The scatter of few is chance.
const AGREED: Ratio = q16(6_000_000);
/// How far an edge seems to move under a climbing wheel, mm: two codes of the arm, as above.
const EDGE: Millimetres = q16(90_000);
/// Sigma beyond which an edge tells nothing, mm: ten times what a tread gives way by.
const UNTOLD: Millimetres = q16(10_000_000);
/// Largest correction of the travel, relative.
const MOST_SCALE: Ratio = q16(20_000);
/// The same of winding up and creep.
const MOST_MORE: Ratio = q16(2_000_000);

/// Travel of the tread after which it is converted to axial travel, mm. Shorter, the noise
/// of the rise would count; longer, the position would lag on a corner.
const CHORD: Millimetres = q16(800_000);

/// Offset of the position from the wheel's travel, and the chord that is not converted yet.
///
/// What is estimated from the residuals of the steps, by a Kalman filter (Kalman 1960): the offset of
/// the travel, its scale, and the parts by which the tread creeps and winds up more than by its
/// model. In units of a step's tolerance, over that of 64 mm, and over that of 1 mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Odometry {
    offset: Travel,
    /// Part by which the axle goes farther than the tread on its radius as known.
    scale: Ratio,
    /// Position from which the travel counts, mm.
    origin: Millimetres,
    /// Parts by which the tread creeps and winds up more than by its model.
    more: [Ratio; 2],
    /// By how much it did so since the origin, by the model, mm.
    gave: [Millimetres; 2],
    /// Covariance of place, scale, creep and winding up.
    covariance: [[Ratio; STATES]; STATES],
    /// By how much all edges may seem off together, mm, and the part of that in the position.
    edges: Millimetres,
    by_edges: Ratio,
    /// Part by which the tread carries more or less than by its model.
    unlike: Ratio,
    /// Parts of the last residual that the position took over, and each of them.
    share: Ratio,
    gains: [Ratio; STATES],
    /// How the states shifted the position where a step last corrected it.
    mark: [Ratio; STATES],
    /// Squares of the readings before the last step's over their variances, and how many: [`AGREED`] more.
    scatter: [Ratio; 2],
    /// The last step's residual over its sigma, and what a millimetre adds to that.
    last: [Ratio; 2],
    from: Option<Start>,
}

/// Place, scale, creep and winding up.
const STATES: usize = 4;

impl Default for Odometry {
    fn default() -> Self {
        let zero = Ratio::ZERO;
        Self {
            offset: Travel::ZERO,
            scale: Ratio::ZERO,
            origin: Millimetres::ZERO,
            more: [Ratio::ZERO; 2],
            gave: [Millimetres::ZERO; 2],
            covariance: [
                [KNOWN, zero, zero, zero],
                [zero, UNKNOWN_RADIUS, zero, zero],
                [zero, zero, UNKNOWN_CREEP, UNKNOWN_WINDING],
                [zero, zero, UNKNOWN_WINDING, UNKNOWN_WINDING],
            ],
            edges: UNREAD,
            by_edges: Ratio::ZERO,
            unlike: Ratio::ZERO,
            share: Ratio::ZERO,
            gains: [Ratio::ZERO; STATES],
            mark: [Ratio::ONE, Ratio::ZERO, Ratio::ZERO, Ratio::ZERO],
            scatter: [AGREED; 2],
            last: [Ratio::ZERO; 2],
            from: None,
        }
    }
}

/// How the wheel rolls in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Rolling {
    /// Distance of the centre from the pillar axis, mm.
    pub radius: Millimetres,
    /// Compression over the rolling radius, by which the tread runs farther than the axle.
    pub lag: Ratio,
    /// The wheel rises or sinks over a corner.
    pub on_corner: bool,
}

/// Where a chord began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Start {
    travel: Travel,
    radius: Millimetres,
}

fn sum(parts: &[Ratio; STATES], weights: &[Ratio; STATES]) -> Ratio {
    parts.iter().zip(weights).fold(Q16::ZERO, |sum, (part, weight)| sum + *part * *weight)
}

impl Odometry {
    /// Position by this travel, mm from the stow end.
    pub fn position(&self, travel: Travel) -> Millimetres {
        Q16::narrow(travel.saturating_add(self.offset))
    }

    /// Declares that the wheel is at `position`.
    pub fn set(&mut self, travel: Travel, position: Millimetres) {
        let offset = position.widen().saturating_sub(travel);
        self.restart(Self { offset, origin: position, ..Self::default() });
    }

    /// Starts again like this, with what is known of tread and sensor.
    fn restart(&mut self, fresh: Self) {
        let unlike = self.unlike;
        *self = Self { edges: self.edges, unlike: Ratio::ZERO, ..fresh };
        self.doubt_tread(unlike);
    }

    /// The tread carries so much more or less than by its model, part of it: by as much its compliance may
    /// be another one, and the length of its contact.
    pub(super) fn doubt_tread(&mut self, unlike: Ratio) {
        let (before, now) = (self.unlike, between(unlike, self.unlike, Ratio::ONE));
        self.unlike = now;
        let more = (now * now - before * before) * PER_PLACE * PER_PLACE;
        let [_, _, [.., creep, both], [.., other, winding]] = &mut self.covariance;
        *creep += more + more;
        for part in [both, other, winding] {
            *part += more;
        }
    }

    /// Declares that the wheel is at `position`: a step was found there, as sure as its place.
    pub fn set_by_step(&mut self, travel: Travel, position: Millimetres) {
        self.set(travel, position);
        self.covariance[0][0] = Ratio::ONE;
        (self.share, self.by_edges) = (Ratio::ONE, Ratio::ONE);
    }

    /// Begins a run at `position`: what moved the arm since the last one was no rolling. A run back
    /// finds the same steps again, which show no more of the tread.
    pub fn begin_run(&mut self, position: Millimetres, back: bool) {
        self.from = None;
        if !back {
            return;
        }
        let place = (self.variance(position) * self.disagree()).max(KNOWN);
        let Self { offset, by_edges, .. } = *self;
        self.restart(Self { offset, by_edges, origin: position, ..Self::default() });
        self.covariance[0][0] = place;
    }

    /// One sigma of `position`, mm.
    pub fn sigma(&self, position: Millimetres) -> Millimetres {
        let (spread, edges) = (self.spread(position), self.edges * self.by_edges);
        sqrt(spread * spread * self.disagree() + edges * edges)
    }

    /// By how much more the readings scatter than by their variances, at least 1 (Birge 1932).
    fn disagree(&self) -> Ratio {
        let ([squares, number], [last, _]) = (self.scatter, self.last);
        divide(squares + last * last, number).max(Ratio::ONE)
    }

    /// Counts a reading of this variance, in units of [`PLACE`]; how many sigmas a millimetre of it is.
    fn compare(&mut self, variance: Ratio) -> Ratio {
        self.scatter[1] += Ratio::ONE;
        divide(PER_PLACE, sqrt(variance))
    }

    /// The same against steps whose edges are all the same, mm.
    pub(super) fn spread(&self, position: Millimetres) -> Millimetres {
        sqrt(self.variance(position).max(Q16::ZERO)) * PLACE
    }

    fn variance(&self, position: Millimetres) -> Ratio {
        let weights = self.weights(position);
        self.expect(&weights).1 + self.wander(&self.since(position))
    }

    /// How the states shift the position.
    fn weights(&self, position: Millimetres) -> [Ratio; STATES] {
        let [crept, wound] = self.gave;
        [Ratio::ONE, (position - self.origin) * PER_REACH, crept, wound]
    }

    /// Covariance of the states with their sum by these weights, and its variance.
    fn expect(&self, weights: &[Ratio; STATES]) -> ([Ratio; STATES], Ratio) {
        let with = self.covariance.each_ref().map(|row| sum(row, weights));
        (with, sum(&with, weights))
    }

    /// The gains of a residual with these weights, whose variance is `noise`; it shows what the position
    /// has wandered by, of this variance.
    fn learn(
        &mut self,
        weights: &[Ratio; STATES],
        noise: Ratio,
        wandered: Ratio,
    ) -> [Ratio; STATES] {
        let (mut with, expected) = self.expect(weights);
        with[0] += wandered;
        let gains = with.map(|part| divide(part, noise + expected + wandered));
        for (row, gain) in self.covariance.iter_mut().zip(gains) {
            for (part, other) in row.iter_mut().zip(with) {
                *part -= gain * other;
            }
        }
        gains
    }

    /// Variance of the position by what it has wandered since then.
    fn wander(&self, [.., crept, wound]: &[Ratio; STATES]) -> Ratio {
        let part = self.unlike.half().max(WANDERS_PART) * PER_PLACE;
        let crept = crept.abs().min(ON_CORNER);
        (crept * crept + *wound * *wound) * part * part
    }

    /// The tread creeps and winds up by so much, mm; by how much as far as the steps show.
    pub(super) fn give(&mut self, by: [Millimetres; 2]) -> Millimetres {
        self.gave.iter_mut().zip(by).for_each(|(gave, by)| *gave += by);
        by.iter().zip(self.more).fold(Q16::ZERO, |all, (by, more)| all + *by + *by * more)
    }

    /// The wheel has slipped: the axle is `lost` further in than the tread's travel has it, give or
    /// take `sigma`, mm.
    pub fn slip(&mut self, lost: Millimetres, sigma: Millimetres) {
        self.offset = self.offset.saturating_sub(lost.widen());
        let parts = sigma * PER_PLACE;
        self.covariance[0][0] += parts * parts;
    }

    /// Takes over its part of the difference between where a step was found, near `position`, and
    /// where the table has it, mm; what is left of it.
    pub fn correct(&mut self, position: Millimetres, residual: Millimetres) -> Millimetres {
        let wandered = self.wander(&self.since(position));
        self.covariance[0][0] += wandered + WANDERS;
        self.mark = self.weights(position);
        let known = self.expect(&self.mark).1 + FOUND;
        self.scatter[0] += self.last[0] * self.last[0];
        self.last = [Ratio::ZERO, self.compare(known)];
        self.gains = self.learn(&self.mark.clone(), FOUND, Q16::ZERO);
        self.share = sum(&self.gains, &self.mark);
        self.by_edges += (Ratio::ONE - self.by_edges) * self.share;
        self.refine(residual)
    }

    /// The wheel leaves the wall of a step that may correct the position later: its climb begins here.
    pub(super) fn leave(&mut self, position: Millimetres) {
        self.covariance[0][0] += self.wander(&self.since(position));
        self.mark = self.weights(position);
    }

    /// How the states shifted the position since a step last corrected it, or was left.
    pub fn since(&self, position: Millimetres) -> [Ratio; STATES] {
        let weights = self.weights(position);
        core::array::from_fn(|i| weights[i] - self.mark[i])
    }

    /// The edge that the wheel climbed seems to have moved outwards by so much, give or take `sigma`,
    /// mm, `since` the wheel left the wall: so far the tread gave way by more than its model has it.
    pub fn climb(
        &mut self,
        position: Millimetres,
        since: &[Ratio; STATES],
        moved: Millimetres,
        sigma: Millimetres,
    ) {
        let parts = (sigma + EDGE).min(UNTOLD) * PER_PLACE;
        let noise = parts * parts;
        // What is beyond two sigmas no model explains: so far has the place wandered.
        let far = (moved * PER_PLACE).half();
        let known = self.expect(since).1 + noise;
        let wandered = self.wander(since).max(far * far - known);
        let off = moved * self.compare(known);
        self.scatter[0] += off * off;
        self.covariance[0][0] += wandered;
        self.mark = core::array::from_fn(|i| self.mark[i] + since[i]);
        let gains = self.learn(since, noise, wandered);
        self.take(moved, sum(&gains, &self.weights(position)), gains);
    }

    /// All edges may seem off by so much, mm: a misread compression.
    pub fn misread(&mut self, direction: Direction, by: Millimetres) {
        let rounded = ROUNDED[direction as usize];
        self.edges = sqrt(rounded * rounded + by * by);
    }

    /// The step found last lies `shift` further out than its residual had it, mm; what is left of
    /// that.
    pub fn refine(&mut self, shift: Millimetres) -> Millimetres {
        self.last[0] += shift * self.last[1];
        self.take(shift, self.share, self.gains)
    }

    /// The step found last may lie elsewhere by `sigma`, mm.
    pub fn doubt(&mut self, sigma: Millimetres) {
        self.slip(Q16::ZERO, sigma * self.share);
    }

    fn take(&mut self, shift: Millimetres, share: Ratio, gains: [Ratio; STATES]) -> Millimetres {
        let taken = shift * share;
        self.offset = self.offset.saturating_sub(taken.widen());
        let [_, scale, more @ ..] = gains;
        let scale = self.scale - shift * scale * PER_REACH;
        self.scale = scale.clamp(-MOST_SCALE, MOST_SCALE);
        for (part, gain) in self.more.iter_mut().zip(more) {
            *part = (*part + shift * gain).clamp(-MOST_MORE, MOST_MORE);
        }
        shift - taken
    }

    /// Converts what the tread has travelled to axial travel once it makes a chord, or `now`.
    ///
    /// The wheel rolls by `ds = (1 - lag + scale) ds_0` where its tread turns by ds_0; with the rise
    /// dy of the centre the axle advances by dx, `dx^2 + dy^2 = ds^2` (first order in the
    /// compression).
    /// `on_corner`: the rise counts; on the wall it is noise.
    pub fn roll(&mut self, travel: Travel, rolling: &Rolling, now: bool) {
        let Some(from) = self.from else {
            self.from = Some(Start { travel, radius: rolling.radius });
            return;
        };
        let signed = Q16::narrow(travel.saturating_sub(from.travel));
        let tread = signed.abs();
        if tread < CHORD && !now {
            return;
        }
        self.from = Some(Start { travel, radius: rolling.radius });
        let rolled = tread - tread * (rolling.lag - self.scale);
        let rise = if rolling.on_corner { rolling.radius - from.radius } else { Q16::ZERO };
        let advanced = sqrt((rolled * rolled - rise * rise).max(Q16::ZERO));
        let lost = if signed < Q16::ZERO { advanced - tread } else { tread - advanced };
        self.offset = self.offset.saturating_sub(lost.widen());
    }
}

#[cfg(test)]
#[path = "odometry_tests.rs"]
mod tests;
