//! What the animation of a run shows: geometry of the rig, events of the crossings and the
//! run's own rows, thinned.

use interstage::rig::Rig;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::record::{CrossingLine, Recording, Row};
use crate::scenario::Scenario;

/// Rows kept of a crossing's surroundings, at most.
const ROWS_OF_ONE: usize = 500;
/// Rows kept around all crossings together, and of the rest of the run, at most.
const ROWS: (usize, usize) = (2500, 1500);
/// Surroundings of a crossing: before the first touch and after lift-off, s.
pub(super) const AROUND_S: (f64, f64) = (0.5, 0.8);

/// A column of [`Scene::rows`]: name, decimals, value. `NaN` becomes null.
type Column = (&'static str, i32, fn(&Geometry, &Row) -> f64);

pub(super) const COLUMNS: [Column; 9] = [
    ("t_s", 3, |_, row| row.controller.t_s),
    ("position_mm", 3, |_, row| row.position_mm()),
    ("radius_mm", 3, |_, row| row.known(|t| t.radius_true_mm, |c| c.radius_mm)),
    ("preload_n", 2, |_, row| row.known(|t| t.preload_true_n, |c| c.preload_n)),
    ("preload_ref_n", 2, |_, row| row.controller.preload_ref_n),
    ("corner_force_n", 2, |_, row| row.of_truth(|t| t.corner_force_n)),
    ("floor_force_n", 2, |_, row| row.of_truth(|t| t.floor_force_n)),
    ("root_clearance_mm", 3, |geometry, row| {
        row.known(|t| t.root_clearance_mm, |c| geometry.clearance_mm(c.position_mm, c.radius_mm))
    }),
    ("speed_mm_s", 2, |_, row| row.known(|t| t.speed_true_mm_s, |c| c.wheel_speed_mm_s)),
];

/// A run as the script draws it.
#[derive(Debug, Serialize)]
pub(super) struct Scene {
    /// The rows are what the controller measured: no truth is known.
    pub(super) measured: bool,
    pub(super) retracts: bool,
    /// Reference of the gap, mm; unknown in a log without parameters.
    pub(super) gap_ref_mm: f64,
    pub(super) geometry: Geometry,
    pub(super) crossings: Vec<Event>,
    pub(super) columns: [&'static str; COLUMNS.len()],
    pub(super) rows: Vec<[f64; COLUMNS.len()]>,
}

/// Geometry of rig and sleeve.
#[derive(Debug, Serialize)]
pub(crate) struct Geometry {
    /// Undeformed wheel radius R, mm.
    pub(super) wheel_radius_mm: f64,
    /// Outermost wall from the pillar axis, mm.
    pub(super) wall_radius_mm: f64,
    pub(super) arm_length_mm: f64,
    /// Arm's pivot from the pillar axis, mm.
    pub(super) arm_pivot_radius_mm: f64,
    /// Side of the pivot: 1 ahead of the wheel in the direction of deployment, -1 behind it.
    pub(super) pivot_side: f64,
    /// Spring rate seen at the wheel, N/mm.
    pub(super) spring_n_per_mm: f64,
    /// Preload on the smooth wall, N.
    pub(super) cruise_n: f64,
    pub(super) limit_n: f64,
    /// Position of each face and height of its step, mm, ascending.
    pub(super) steps: Vec<(f64, f64)>,
}

impl Geometry {
    /// That of `rig` as the controller knows it.
    pub(crate) fn of_rig(rig: &Rig) -> Self {
        Self::new(rig, &Map::new())
    }

    /// That of `rig`, with what the seed drew of it.
    fn new(rig: &Rig, drawn: &Map<String, Value>) -> Self {
        let list = |key: &str| -> Option<Vec<f64>> {
            drawn.get(key)?.as_array()?.iter().map(Value::as_f64).collect()
        };
        let number = |key: &str, stated| drawn.get(key).and_then(Value::as_f64).unwrap_or(stated);
        let faces = list("rig.step_positions_mm");
        let faces = faces.unwrap_or_else(|| rig.rig.step_positions_mm.to_vec());
        let heights = list("rig.step_height_mm").unwrap_or_default();
        let height = |place| heights.get(place).copied().unwrap_or(rig.rig.step_height_mm);
        Self {
            wheel_radius_mm: number("rig.wheel_radius_mm", rig.rig.wheel_radius_mm),
            wall_radius_mm: rig.rig.wall_radius_mm,
            arm_length_mm: rig.rig.arm_length_mm,
            arm_pivot_radius_mm: rig.rig.arm_pivot_radius_mm,
            pivot_side: if rig.plant.arm_coupling < 0.0 { -1.0 } else { 1.0 },
            spring_n_per_mm: number("preload.spring_n_per_mm", rig.preload.spring_n_per_mm),
            cruise_n: rig.preload.cruise_n,
            limit_n: rig.preload.limit_n,
            steps: faces.into_iter().enumerate().map(|(n, face)| (face, height(n))).collect(),
        }
    }

    /// Height of the wall at `position_mm` above the outermost one, mm.
    pub(super) fn wall_mm(&self, position_mm: f64) -> f64 {
        self.steps.iter().filter(|step| step.0 <= position_mm).map(|step| step.1).sum()
    }

    /// Clearance of the next step's root from the undeformed wheel, mm; `NaN` if the step is
    /// farther away than the wheel reaches.
    pub(crate) fn clearance_mm(&self, position_mm: f64, radius_mm: f64) -> f64 {
        let faces = self.steps.iter().map(|step| step.0 - position_mm);
        let ahead = faces.filter(|ahead| *ahead > 0.0).fold(f64::INFINITY, f64::min);
        let height = self.wall_radius_mm - radius_mm - self.wall_mm(position_mm);
        if ahead < self.wheel_radius_mm {
            ahead.hypot(height) - self.wheel_radius_mm
        } else {
            f64::NAN
        }
    }

    /// Height of the step whose face is nearest to `position_mm`, mm.
    fn height_mm(&self, position_mm: f64) -> f64 {
        let away = |step: &&(f64, f64)| (step.0 - position_mm).abs();
        let nearest = self.steps.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map_or(f64::NAN, |step| step.1)
    }
}

/// One crossing.
#[derive(Debug, Serialize)]
pub(super) struct Event {
    /// Step number, from 1.
    pub(super) index: u8,
    /// First touch of the corner, s.
    pub(super) touch_s: f64,
    /// Lift-off from the lower wall (retract: touch-down), s.
    pub(super) lift_s: f64,
    /// Position of the face, mm.
    pub(super) face_mm: f64,
    /// Height of the step, mm.
    pub(super) height_mm: f64,
    /// Distance before the face at the first touch, mm.
    pub(super) touch_mm: f64,
    /// Preload at the instant of the gap, N.
    pub(super) preload_n: f64,
    /// Gap, mm: true, or measured where there is no truth.
    pub(super) gap_mm: f64,
}

impl Scene {
    /// The scene of `recording`; none without rows or known parameters.
    pub(super) fn new(recording: &Recording) -> Option<Self> {
        let summary = &recording.summary;
        let scenario = Scenario::parse("parameters", &recording.parameters, &[]).ok()?;
        let known = recording.rows.iter().filter(|row| row.position_mm().is_finite());
        let rows: Vec<&Row> = known.collect();
        rows.first()?;
        let measured = rows.iter().all(|row| row.truth.is_none());
        let drawn = if measured { Map::new() } else { summary.drawn.clone() };
        let geometry = Geometry::new(&scenario.rig, &drawn);
        let retracts = summary.direction == "retract";
        let event = |line: &CrossingLine| event(&geometry, &rows, line);
        let crossings: Vec<Event> = summary.crossings.iter().map(event).collect();
        let rows = thinned(&rows, &crossings);
        let rows = rows.into_iter().map(|row| values(&geometry, row)).collect();
        let columns = COLUMNS.map(|column| column.0);
        let gap_ref_mm = summary.gap_ref_mm;
        Some(Self { measured, retracts, gap_ref_mm, geometry, crossings, columns, rows })
    }

    /// The row at this time, or the first behind it, of the last one at most.
    pub(super) fn row(&self, t_s: f64) -> &[f64; COLUMNS.len()] {
        let place = self.rows.partition_point(|row| row[0] < t_s);
        &self.rows[place.min(self.rows.len() - 1)]
    }

    /// As JSON that can be a script's content.
    pub(super) fn json(&self) -> String {
        serde_json::to_string(self).expect("numbers and words").replace('<', "\\u003c")
    }
}

fn event(geometry: &Geometry, rows: &[&Row], line: &CrossingLine) -> Event {
    let at = rows.partition_point(|row| row.controller.t_s < line.touch_s).min(rows.len() - 1);
    let gap_mm = if line.gap_mm.is_finite() { Some(line.gap_mm) } else { line.gap_measured_mm };
    Event {
        index: line.index,
        touch_s: line.touch_s,
        lift_s: line.lift_s,
        face_mm: line.step_mm,
        height_mm: geometry.height_mm(line.step_mm),
        touch_mm: line.step_mm - rows[at].position_mm(),
        preload_n: line.preload_n,
        gap_mm: gap_mm.unwrap_or(f64::NAN),
    }
}

fn values(geometry: &Geometry, row: &Row) -> [f64; COLUMNS.len()] {
    COLUMNS.map(|(_, decimals, of)| {
        let scale = 10_f64.powi(decimals);
        // Plus zero: what rounds to zero has no sign.
        (of(geometry, row) * scale).round() / scale + 0.0
    })
}

/// About [`ROWS`] of the rows at most, dense around the crossings. The first and the last are kept,
/// and both rows where corner or wall begins or ceases to carry.
fn thinned<'a>(rows: &[&'a Row], crossings: &[Event]) -> Vec<&'a Row> {
    let near = |row: &Row| {
        let t_s = row.controller.t_s;
        crossings.iter().position(|crossing| {
            let (a, b) = (crossing.touch_s, crossing.lift_s);
            (a.min(b) - AROUND_S.0..=a.max(b) + AROUND_S.1).contains(&t_s)
        })
    };
    let far = rows.iter().filter(|row| near(row).is_none()).count();
    let mut kept: Vec<&Row> = Vec::new();
    for piece in rows.chunk_by(|a, b| near(a) == near(b)) {
        let (count, most) = match near(piece[0]) {
            Some(_) => (piece.len(), ROWS_OF_ONE.min(ROWS.0 / crossings.len())),
            None => (far, ROWS.1),
        };
        let every = count.div_ceil(most).max(1);
        let carries =
            |row: &Row| row.truth.map(|t| (t.corner_force_n > 0.0, t.floor_force_n > 0.0));
        let changes = |place: usize| {
            let near = &piece[place.saturating_sub(1)..piece.len().min(place + 2)];
            near.iter().any(|row| carries(row) != carries(piece[place]))
        };
        let is_kept = |(place, _): &(usize, &&Row)| place % every == 0 || changes(*place);
        kept.extend(piece.iter().enumerate().filter(is_kept).map(|(_, row)| row));
    }
    if kept.last().map(|row| row.controller.tick) != rows.last().map(|row| row.controller.tick) {
        kept.extend(rows.last());
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_rows_are_the_runs_own() {
        let recording = example::deploy();
        let scene = Scene::new(&recording).unwrap();
        assert!(scene.rows.len() > 1000 && scene.rows.len() <= 3 * ROWS_OF_ONE + ROWS.1 + 10);
        for shown in &scene.rows {
            let row = &recording.rows[(1e3 * shown[0]).round() as usize];
            let truth = row.truth.unwrap();
            for (shown, is, within) in [
                (shown[1], truth.position_true_mm, 6e-4),
                (shown[2], truth.radius_true_mm, 6e-4),
                (shown[3], truth.preload_true_n, 6e-3),
                (shown[5], truth.corner_force_n, 6e-3),
                (shown[6], truth.floor_force_n, 6e-3),
                (shown[8], truth.speed_true_mm_s, 6e-3),
            ] {
                assert!((shown - is).abs() < within, "{shown} {is}");
            }
        }
        let last = recording.rows.last().unwrap().controller.t_s;
        assert!((scene.rows.last().unwrap()[0] - last).abs() < 1e-9);
    }

    #[test]
    fn the_geometry_gives_the_plants_clearance() {
        let recording = example::deploy();
        let geometry = Scene::new(&recording).unwrap().geometry;
        let mut seen = 0;
        for truth in recording.rows.iter().filter_map(|row| row.truth) {
            let by_geometry = geometry.clearance_mm(truth.position_true_mm, truth.radius_true_mm);
            assert_eq!(by_geometry.is_nan(), truth.root_clearance_mm.is_nan());
            if by_geometry.is_finite() {
                assert!((by_geometry - truth.root_clearance_mm).abs() < 1e-6);
                seen += 1;
            }
        }
        assert!(seen > 1000);
    }

    #[test]
    fn the_corner_touches_where_circle_and_edge_meet() {
        let recording = example::deploy();
        let scene = Scene::new(&recording).unwrap();
        assert_eq!(scene.crossings.len(), 3);
        for crossing in &scene.crossings {
            // The compression lowers the axle, so that it touches a little earlier.
            let rigid_mm = crate::plant::wall::touch_mm(25.0, crossing.height_mm);
            let earlier_mm = crossing.touch_mm - rigid_mm;
            assert!(earlier_mm > 0.0 && earlier_mm < 0.6, "{crossing:?} {rigid_mm}");
        }
    }

    #[test]
    fn a_log_without_truth_is_shown_by_its_measurements() {
        let mut recording = example::deploy();
        recording.rows.iter_mut().for_each(|row| row.truth = None);
        let scene = Scene::new(&recording).unwrap();
        assert!(scene.measured);
        assert!(scene.rows.iter().all(|row| row[5].is_nan() && row[6].is_nan()));
        let clearances = scene.rows.iter().map(|row| row[7]).filter(|gap| gap.is_finite());
        let least = clearances.fold(f64::INFINITY, f64::min);
        assert!((2.0..3.0).contains(&least), "{least}");
        assert!(!scene.json().contains("NaN"));
        // With unknown parameters there is none.
        recording.parameters = "not parameters".to_owned();
        assert!(Scene::new(&recording).is_none());
    }
}
