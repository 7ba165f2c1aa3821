//! The inner wall of the sleeve along one meridian: level pieces with steps
//! between them.

/// A step: the wall rises by `height_mm` towards the pillar at `position_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Axial position of the face, mm.
    pub position_mm: f64,
    pub height_mm: f64,
}

/// How the wall departs from level pieces with sharp edges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Form {
    /// Radius of the steps' edges, mm.
    pub edge_radius_mm: f64,
    /// Rise from position 0 to the length, mm.
    pub taper_mm: f64,
    /// Rise in the middle above the line between the ends, mm.
    pub bend_mm: f64,
    /// Length that taper and bend go by, mm.
    pub length_mm: f64,
}

impl Form {
    /// Rise of the wall at an axial position, mm, and its slope: a straight line and a
    /// parabola, which go on beyond the ends.
    pub(crate) fn rise(&self, x_mm: f64) -> (f64, f64) {
        if (self.taper_mm, self.bend_mm) == (0.0, 0.0) {
            return (0.0, 0.0);
        }
        let part = x_mm / self.length_mm;
        let rise = self.taper_mm * part + 4.0 * self.bend_mm * part * (1.0 - part);
        let slope = self.taper_mm + 4.0 * self.bend_mm * (1.0 - 2.0 * part);
        (rise, slope / self.length_mm)
    }
}

/// How far before the face of a step an undeformed wheel touches its corner, mm.
pub fn touch_mm(radius_mm: f64, step_mm: f64) -> f64 {
    (step_mm * (2.0 * radius_mm - step_mm)).max(0.0).sqrt()
}

/// The wall's profile: ascending steps, level 0 before the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wall {
    steps: Vec<Step>,
    form: Form,
}

/// The wall as the wheel sees it: heights relative to the wall under the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalWall {
    /// Height of the wall under the centre above level 0, mm.
    pub base_mm: f64,
    /// Number of steps behind (below) the centre.
    pub level: usize,
    /// Distance to the face ahead, mm; infinite if there is none.
    pub ahead_mm: f64,
    /// Height of the step ahead, mm.
    pub rise_mm: f64,
    /// Distance back to the edge behind, mm; infinite if there is none.
    pub behind_mm: f64,
    /// Height of the step behind, mm.
    pub drop_mm: f64,
    /// Height of the root of the step ahead above the wall under the centre, mm.
    pub root_mm: f64,
    /// Rise of the wall per axial travel.
    pub slope: f64,
    pub edge_radius_mm: f64,
}

/// Direction of the edge behind, from straight down towards the back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    sin: f64,
    cos: f64,
}

impl Edge {
    /// Its sine and cosine.
    #[inline]
    pub(super) fn direction(&self) -> (f64, f64) {
        (self.sin, self.cos)
    }

    /// Part of an element `pitch` wide (rad) that does not reach past the edge, given
    /// sine and cosine of its angle. The wall ends there at once; without this a whole
    /// element would.
    #[inline]
    pub(crate) fn covered(&self, sin: f64, cos: f64, pitch: f64) -> f64 {
        // Sine of the angle from the edge to the element.
        let within = self.sin * cos + self.cos * sin;
        (0.5 + within / pitch).clamp(0.0, 1.0)
    }
}

impl Wall {
    /// A wall with these steps, sorted by position.
    pub fn new(mut steps: Vec<Step>) -> Self {
        steps.sort_by(|a, b| a.position_mm.total_cmp(&b.position_mm));
        Self { steps, form: Form::default() }
    }

    /// The same wall of this form.
    pub(crate) fn with_form(mut self, form: Form) -> Self {
        let plain = (form.edge_radius_mm, form.taper_mm, form.bend_mm) == (0.0, 0.0, 0.0);
        self.form = if plain { Form::default() } else { form };
        self
    }

    /// The same wall with its steps elsewhere by so much, mm.
    pub fn moved(&self, by_mm: &[f64]) -> Self {
        let mut moved = self.clone();
        moved.steps.iter_mut().zip(by_mm).for_each(|(step, by_mm)| step.position_mm += by_mm);
        moved
    }

    /// The steps, ascending.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The wall around axial position `x_mm`.
    pub fn local(&self, x_mm: f64) -> LocalWall {
        let (rise_mm, slope) = self.form.rise(x_mm);
        let mut local = LocalWall {
            base_mm: rise_mm,
            level: 0,
            ahead_mm: f64::INFINITY,
            rise_mm: 0.0,
            behind_mm: f64::INFINITY,
            drop_mm: 0.0,
            root_mm: 0.0,
            slope,
            edge_radius_mm: self.form.edge_radius_mm,
        };
        for step in &self.steps {
            if step.position_mm <= x_mm {
                local.base_mm += step.height_mm;
                local.level += 1;
                local.behind_mm = x_mm - step.position_mm;
                local.drop_mm = step.height_mm + rise_mm - self.form.rise(step.position_mm).0;
            } else {
                local.ahead_mm = step.position_mm - x_mm;
                local.root_mm = self.form.rise(step.position_mm).0 - rise_mm;
                local.rise_mm = step.height_mm + local.root_mm;
                break;
            }
        }
        local
    }
}

impl LocalWall {
    /// Cosine and sine sums of a contact with the level wall, turned by the wall's slope.
    #[inline]
    pub(super) fn tilt(&self, (cosine, sine): (f64, f64)) -> (f64, f64) {
        (cosine - self.slope * sine, sine + self.slope * cosine)
    }

    /// The edge behind as seen from the centre, `y` mm above the wall under it.
    pub(crate) fn edge(&self, y: f64) -> Edge {
        if self.behind_mm == f64::INFINITY {
            return Edge { sin: 1.0, cos: 0.0 };
        }
        let away = (self.behind_mm * self.behind_mm + y * y).sqrt();
        Edge { sin: self.behind_mm / away, cos: y / away }
    }

    /// Distance from the centre, `y` mm above the wall under it, to the nearest point
    /// of the wall: straight down or the corner ahead.
    pub(crate) fn nearest(&self, y: f64) -> f64 {
        let round = self.edge_radius_mm;
        let over = y - self.rise_mm;
        if round == 0.0 {
            return y.min((self.ahead_mm * self.ahead_mm + over * over).sqrt());
        }
        let below = if self.behind_mm < round {
            (round - self.behind_mm).hypot(y + round) - round
        } else {
            y
        };
        below.min((self.ahead_mm + round).hypot(over + round) - round)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// What a ray meets.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(in crate::plant) enum Facet {
        /// The wall under the centre, or the one behind and below it.
        Floor,
        /// Face or top of the step ahead.
        Step,
    }

    impl LocalWall {
        /// Distance from the centre, `y` mm above the wall under it, to the wall along
        /// the ray at angle psi from straight down (positive ahead), given its sine and
        /// cosine (> 0), and which part of the wall it meets.
        pub(in crate::plant) fn ray(&self, y: f64, sin: f64, cos: f64) -> (f64, Facet) {
            let run = y * sin;
            if run > self.ahead_mm * cos {
                // Past the root of the step ahead: its face below the corner, else its top.
                if (y - self.rise_mm) * sin <= self.ahead_mm * cos {
                    (self.ahead_mm / sin, Facet::Step)
                } else {
                    ((y - self.rise_mm) / cos, Facet::Step)
                }
            } else if -run > self.behind_mm * cos {
                ((y + self.drop_mm) / cos, Facet::Floor)
            } else {
                (y / cos, Facet::Floor)
            }
        }
    }

    #[test]
    fn rays_meet_floor_face_and_top_in_turn() {
        let wall = Wall::new(vec![Step { position_mm: 10.0, height_mm: 4.0 }]);
        let local = wall.local(0.0);
        let at = |degrees: f64| {
            let a = degrees.to_radians();
            local.ray(25.0, a.sin(), a.cos())
        };
        assert_eq!(at(0.0), (25.0, Facet::Floor));
        // Root at atan(10/25) = 21.8 deg, corner at atan(10/21) = 25.46 deg.
        assert_eq!(at(21.0).1, Facet::Floor);
        let face = at(23.0);
        assert_eq!(face.1, Facet::Step);
        assert!((face.0 - 10.0 / 23f64.to_radians().sin()).abs() < 1e-12);
        let top = at(30.0);
        assert!((top.0 - 21.0 / 30f64.to_radians().cos()).abs() < 1e-12);
    }

    #[test]
    fn the_distance_is_continuous_at_root_and_corner() {
        let local = Wall::new(vec![Step { position_mm: 12.0, height_mm: 4.0 }]).local(0.0);
        for corner in [(12f64 / 24.5).atan(), (12f64 / 20.5).atan()] {
            let (a, b) = (corner - 1e-9, corner + 1e-9);
            let near = local.ray(24.5, a.sin(), a.cos()).0;
            let far = local.ray(24.5, b.sin(), b.cos()).0;
            assert!((near - far).abs() < 1e-6, "{near} {far}");
        }
    }

    #[test]
    fn an_element_reaches_past_the_edge_by_and_by() {
        let local = Wall::new(vec![Step { position_mm: 10.0, height_mm: 4.0 }]).local(11.0);
        let (edge, pitch) = (local.edge(24.0), 0.01);
        let covered = |angle: f64| edge.covered(angle.sin(), angle.cos(), pitch);
        let corner = -(1f64 / 24.0).atan();
        assert!((covered(corner) - 0.5).abs() < 1e-12);
        assert!((covered(corner + 0.2 * pitch) - 0.7).abs() < 1e-4);
        assert_eq!((covered(corner + 0.6 * pitch), covered(corner - 0.6 * pitch)), (1.0, 0.0));
        assert_eq!((covered(0.3), covered(-0.3)), (1.0, 0.0));
        // Without an edge every element lies on the wall.
        let edge = Wall::default().local(0.0).edge(24.0);
        assert_eq!((edge.covered(0.3, 0.95, pitch), edge.covered(-0.3, 0.95, pitch)), (1.0, 1.0));
    }

    #[test]
    fn behind_an_edge_the_lower_wall_is_met() {
        let wall = Wall::new(vec![Step { position_mm: 10.0, height_mm: 4.0 }]);
        let local = wall.local(11.0);
        assert_eq!(local.level, 1);
        assert_eq!(local.base_mm, 4.0);
        let a = -10f64.to_radians();
        let (distance, facet) = local.ray(24.0, a.sin(), a.cos());
        assert_eq!(facet, Facet::Floor);
        assert!((distance - 28.0 / a.cos()).abs() < 1e-12);
    }
}
