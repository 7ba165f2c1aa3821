//! The rolled-out tread of `interstage::model::tread` in floating point: the same scheme, for its
//! cycles and as the reference of its rounding. Nothing ships from here.

use super::number::Number;

/// Facets of the wall.
const LOWER: usize = 0;
const FACE: usize = 1;
const UPPER: usize = 2;

/// Wheel, rubber and step: mm, N/mm^3 of relaxed stiffness, s.
#[derive(Clone, Copy, Debug)]
pub struct Wheel {
    /// Radius and width.
    pub radius_mm: f64,
    /// See `radius_mm`.
    pub width_mm: f64,
    /// Step height.
    pub height_mm: f64,
    /// Relaxed stiffness per area.
    pub k_inf: f64,
    /// Instant over relaxed stiffness.
    pub stiffening: f64,
    /// Relaxation time.
    pub tau_s: f64,
    /// Axial load that it is driven against, if it is not pushed, N.
    pub load_n: Option<f64>,
}

/// A course at constant speed and preload.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Whether it deploys.
    pub forward: bool,
    /// Where it begins and ends, mm from the face.
    pub from_mm: f64,
    /// See `from_mm`.
    pub until_mm: f64,
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Radial force, N.
    pub pressed_n: f64,
}

/// What a crossing gives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Crossing {
    /// Gap, mm.
    pub gap_mm: f64,
    /// Largest friction needed.
    pub utilisation: f64,
    /// Largest axial force, N.
    pub corner_force_n: f64,
}

/// An element: memory and depth, mm.
type Element<N> = [N; 2];

#[derive(Clone, Copy, Debug)]
struct Ray<N> {
    sin: N,
    cos: N,
    sec: N,
    tan: N,
}

/// Contact after a stride.
#[derive(Clone, Copy, Debug)]
struct Contact<N> {
    x: N,
    y: N,
    axial: N,
    utilisation: N,
    floor: N,
}

/// The tread, and where it is.
#[derive(Clone, Debug)]
pub struct FloatTread<N, const PITCH: u32, const ELEMENTS: usize> {
    radius: N,
    height: N,
    stride: N,
    rate: N,
    excess: N,
    tau: N,
    load: Option<N>,
    rays: [Ray<N>; ELEMENTS],
    elements: [Element<N>; ELEMENTS],
    corner: Element<N>,
    x: N,
    y: N,
    climb: N,
    bottom: i32,
    facets: [i32; 2],
    /// Places on the three facets from one to before another.
    touched: [[i32; 2]; 3],
}

/// The solid over a stride: parts of memory, depth and earlier depth; pressure per depth.
struct Law<N> {
    keeps: N,
    takes: N,
    took: N,
    loads: N,
    excess: N,
}

impl<N: Number> Law<N> {
    fn new(ratio: f64, excess: N) -> Self {
        let keeps = libm::exp(-ratio);
        let mean = -libm::expm1(-ratio) / ratio;
        Self {
            keeps: N::of(keeps),
            takes: N::of(1.0 - mean),
            took: N::of(mean - keeps),
            loads: N::of(1.0) + excess * N::of(mean),
            excess,
        }
    }

    #[inline(always)]
    fn pressure(&self, [memory, before]: Element<N>, depth: N) -> N {
        self.loads * depth - self.excess * (memory * self.keeps + before * self.took)
    }

    #[inline(always)]
    fn pressed(&self, [memory, before]: Element<N>, depth: N) -> Element<N> {
        [memory * self.keeps + depth * self.takes + before * self.took, depth]
    }
}

/// Sums over the contact.
struct Sums<N> {
    cos: N,
    sin: N,
    moves: N,
    tan: N,
    floor: Option<N>,
    visits: u32,
}

impl<N: Number> Sums<N> {
    #[inline(always)]
    fn add(&mut self, pressure: N, moves: N, ray: &Ray<N>) {
        self.cos = self.cos + pressure * ray.cos;
        self.sin = self.sin + pressure * ray.sin;
        self.moves = self.moves + moves;
        self.tan = self.tan + moves * ray.tan;
    }

    /// A patch ends between these two.
    fn end(&mut self, carries: N, ray: &Ray<N>, pulls: N, level: bool) {
        let (half, part) = (N::of(0.5), carries / (carries - pulls));
        let moves = if level { part - half } else { N::of(0.0) };
        self.add((part - N::of(1.0)) * half * carries, moves, ray);
    }
}

/// Mean over a cell from a to b, and how it grows with b alone or both.
fn mean<N: Number>(a: N, b: N, both: bool) -> [N; 2] {
    let (zero, half, one) = (N::of(0.0), N::of(0.5), N::of(1.0));
    match (a > zero, b > zero) {
        (true, true) => [half * (a + b), if both { one } else { half }],
        (false, false) => [zero, zero],
        (true, false) => {
            let part = a / (a - b);
            [half * a * part, if both { part } else { zero }]
        }
        (false, true) => {
            let part = b / (b - a);
            [half * b * part, if both { part } else { part - half * part * part }]
        }
    }
}

/// Where the parabola through three values at equal distances is zero, from the chord's zero.
fn falls_to_zero<N: Number>(earlier: N, before: N, now: N) -> N {
    let (half, chord) = (N::of(0.5), before / (before - now));
    let (bend, slope) = (half * (now + earlier) - before, half * (now - earlier));
    let missing = before + chord * (slope + chord * bend);
    chord - missing / (slope + chord * (bend + bend))
}

impl<N: Number, const PITCH: u32, const ELEMENTS: usize> FloatTread<N, PITCH, ELEMENTS> {
    const BEHIND: i32 = ELEMENTS as i32 * 3 / 8;
    const AHEAD: i32 = ELEMENTS as i32 - Self::BEHIND;

    /// The tread of a wheel.
    pub fn new(wheel: &Wheel) -> Self {
        let pitch = 1e-6 * f64::from(PITCH);
        let zero = N::of(0.0);
        Self {
            radius: N::of(wheel.radius_mm),
            height: N::of(wheel.height_mm),
            stride: N::of(pitch * wheel.radius_mm),
            rate: N::of(wheel.k_inf * wheel.width_mm * pitch * wheel.radius_mm),
            excess: N::of(wheel.stiffening - 1.0),
            tau: N::of(wheel.tau_s),
            load: wheel.load_n.map(N::of),
            rays: core::array::from_fn(|index| {
                let angle = pitch * f64::from(index as i32 - Self::BEHIND);
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                Ray {
                    sin: N::of(sin),
                    cos: N::of(cos),
                    sec: N::of(1.0 / cos),
                    tan: N::of(sin / cos),
                }
            }),
            elements: [[zero; 2]; ELEMENTS],
            corner: [zero; 2],
            x: zero,
            y: zero,
            climb: zero,
            bottom: 0,
            facets: [0; 2],
            touched: [[0; 2]; 3],
        }
    }

    #[inline(always)]
    fn ray(&self, place: i32) -> &Ray<N> {
        &self.rays[(place + Self::BEHIND).clamp(0, ELEMENTS as i32 - 1) as usize]
    }

    #[inline(always)]
    fn number(&self, place: i32) -> usize {
        self.bottom.wrapping_add(place) as usize % ELEMENTS
    }

    #[inline(always)]
    fn depth(&self, facet: usize, ray: &Ray<N>) -> N {
        self.radius
            - match facet {
                LOWER => self.y * ray.sec,
                UPPER => (self.y - self.height) * ray.sec,
                _ => (N::of(0.0) - self.x) / ray.sin,
            }
    }

    /// The first place between these from which on it is so.
    fn first(low: i32, high: i32, near: i32, so: impl Fn(i32) -> bool) -> i32 {
        let mut place = near.max(low).min(high);
        while place < high && !so(place) {
            place += 1;
        }
        while place > low && so(place - 1) {
            place -= 1;
        }
        place
    }

    fn look(&mut self) {
        let zero = N::of(0.0);
        let ahead = zero - self.x;
        let beyond =
            |below: N| move |tread: &Self, place: i32| below * tread.ray(place).tan >= ahead;
        let (upper, lower) = (beyond(self.y - self.height), beyond(self.y));
        let top =
            Self::first(-Self::BEHIND, Self::AHEAD, self.facets[1], |place| upper(self, place));
        let face = if ahead > zero {
            Self::first(0, top.max(0), self.facets[0], |place| lower(self, place)).min(top)
        } else {
            top
        };
        let clear = |facet: usize| {
            let [_, near] = self.touched[facet];
            let clear = |place: i32| self.depth(facet, self.ray(place)) <= zero;
            let high = Self::first(0, Self::AHEAD, near, clear);
            [(1 - high).max(-Self::BEHIND), high]
        };
        let [low, high] = clear(LOWER);
        let high = high.min(face);
        let floor = [low.min(high), high];
        let [low, high] = clear(UPPER);
        let low = low.max(top);
        let upper = [low, high.max(low)];
        let mut low = top;
        if upper[0] == top {
            while low > face && self.depth(FACE, self.ray(low - 1)) > zero {
                low -= 1;
            }
        }
        self.facets = [face, top];
        self.touched = [floor, [low, top], upper];
    }

    fn corner_depth(&self) -> Option<N> {
        let [_, top] = self.facets;
        let [low, high] = self.touched[UPPER];
        let z = self.y - self.height;
        let depth = self.radius - (self.x * self.x + z * z).sqrt();
        (low == top && high >= top && depth > N::of(0.0)).then_some(depth)
    }

    fn sums(&self, law: &Law<N>) -> Sums<N> {
        let (zero, half, one) = (N::of(0.0), N::of(0.5), N::of(1.0));
        let mut sums =
            Sums { cos: zero, sin: zero, moves: zero, tan: zero, floor: None, visits: 0 };
        let [face, top] = self.facets;
        let ends = [[-Self::BEHIND, face], [face, top], [top, Self::AHEAD]];
        for (facet, [from, until]) in ends.into_iter().enumerate() {
            let [low, high] = self.touched[facet];
            if low >= high {
                continue;
            }
            let level = facet != FACE;
            let pressure = |place: i32| {
                law.pressure(self.elements[self.number(place)], self.depth(facet, self.ray(place)))
            };
            let mut before = pressure(if low > from { low - 1 } else { low });
            for place in low..high {
                let now = pressure(place);
                if facet == LOWER && sums.floor.is_none_or(|floor| now > floor) {
                    sums.floor = Some(now);
                }
                if now > zero {
                    sums.add(now, if level { one } else { zero }, self.ray(place));
                    if before <= zero {
                        sums.end(now, self.ray(place), before, level);
                    }
                } else if before > zero {
                    sums.end(before, self.ray(place - 1), now, level);
                }
                before = now;
                sums.visits += 1;
            }
            if before > zero && high < until {
                let outside = pressure(high);
                let pulls = if outside < zero { outside } else { zero };
                sums.end(before, self.ray(high - 1), pulls, level);
            }
        }
        if let Some(depth) = self.corner_depth() {
            let (low, ray) = (self.ray(top - 1), self.ray(top));
            let at = |place, facet, ray| {
                law.pressure(self.elements[self.number(place)], self.depth(facet, ray))
            };
            let above = at(top, UPPER, ray);
            let corner = law.pressure(self.corner, depth);
            let z = self.y - self.height;
            let part = (zero - self.x - z * low.tan) / (z * ray.tan - z * low.tan);
            let part = if part < zero { zero } else { part };
            let part = if part > one { one } else { part };
            let [on_top, yields] = mean(above, corner, true);
            let share = |p: N, part: N| if p > zero { part } else { zero };
            let mut carried = (one - part) * on_top - share(above, half * above);
            let mut moves = (one - part) * yields - share(above, half);
            if top > face {
                let below = at(top - 1, FACE, low);
                let [on_face, yields] = mean(below, corner, false);
                carried = carried + part * on_face - share(below, half * below);
                moves = moves + part * yields;
            }
            sums.add(carried, moves, ray);
        }
        sums
    }

    /// Contact and correction of the height.
    fn balance(&self, sums: &Sums<N>, law: &Law<N>, pressed: N) -> ([N; 2], N) {
        let zero = N::of(0.0);
        let (c, s) = (sums.cos, sums.sin);
        let dc = zero - law.loads * sums.moves;
        let ds = zero - law.loads * sums.tan;
        let used = |c: N, s: N| match self.load {
            Some(load) if c > zero => (load / self.rate + s) / c,
            _ => zero,
        };
        let u = used(c, s);
        let du = if u == zero { u } else { (ds - u * dc) / c };
        let slope = dc + u * ds + du * s;
        let missing = pressed / self.rate - c - u * s;
        let change = if slope < zero { missing / slope } else { zero - missing };
        let (c, s) = (c + dc * change, s + ds * change);
        ([s * self.rate, used(c, s)], change)
    }

    fn commit(&mut self, law: &Law<N>, was: [[i32; 2]; 2], forward: bool) {
        for facet in [LOWER, FACE, UPPER] {
            let [low, high] = self.touched[facet];
            for place in low..high {
                let depth = self.depth(facet, self.ray(place));
                let number = self.number(place);
                self.elements[number] = law.pressed(self.elements[number], depth);
            }
        }
        let by = if forward { -1 } else { 1 };
        let now = self.patches();
        let has = |place: i32| now.iter().any(|[low, high]| (*low..*high).contains(&place));
        for [low, high] in was {
            for place in (low + by..high + by).filter(|place| !has(*place)) {
                let number = self.number(place);
                self.elements[number] = [N::of(0.0); 2];
            }
        }
        self.corner = match self.corner_depth() {
            Some(depth) => law.pressed(self.corner, depth),
            None => [N::of(0.0); 2],
        };
    }

    fn patches(&self) -> [[i32; 2]; 2] {
        let [floor, face, upper] = self.touched;
        [floor, [face[0], upper[1]]]
    }

    fn advance(&mut self, law: &Law<N>, pressed: N, forward: bool) -> Contact<N> {
        let zero = N::of(0.0);
        self.bottom = self.bottom.wrapping_add(if forward { 1 } else { -1 });
        self.x = if forward { self.x + self.stride } else { self.x - self.stride };
        let (before, was) = (self.y, self.patches());
        self.y = self.y + self.climb;
        let steepest = N::of(0.95) * self.stride;
        self.look();
        let mut contact =
            Contact { x: self.x, y: self.y, axial: zero, utilisation: zero, floor: zero };
        let mut floor = None;
        for _ in 0..4 {
            let sums = self.sums(law);
            let ([axial, utilisation], change) = self.balance(&sums, law, pressed);
            let change = if sums.visits == 0 { N::of(-0.25) * steepest } else { change };
            let change = if change > steepest { steepest } else { change };
            let change = if change < zero - steepest { zero - steepest } else { change };
            self.y = self.y + change;
            self.look();
            floor = sums.floor.or(floor).map(|pressure| pressure - law.loads * change);
            contact = Contact { axial, utilisation, ..contact };
            let half = sums.floor.map_or(zero, |pressure| N::of(0.5) * pressure);
            let leaves = half > zero && floor.is_some_and(|floor| floor < half);
            let near = steepest * N::of(1.0 / 16.0);
            if !leaves && change < near && zero - change < near {
                break;
            }
        }
        self.climb = self.y - before;
        self.commit(law, was, forward);
        let off = if self.y > self.radius { self.y - self.radius } else { self.radius - self.y };
        Contact { y: self.y, floor: floor.unwrap_or(zero - law.loads * off), ..contact }
    }

    /// Rolls over the step.
    pub fn cross(&mut self, course: &Course) -> Crossing {
        let (zero, one) = (N::of(0.0), N::of(1.0));
        let Course { forward, from_mm, until_mm, speed_mm_s, pressed_n } = *course;
        self.elements = [[zero; 2]; ELEMENTS];
        (self.corner, self.touched, self.facets, self.climb, self.bottom) =
            ([zero; 2], [[0; 2]; 3], [0; 2], zero, 0);
        self.x = N::of(from_mm);
        self.y = if from_mm >= 0.0 { self.radius + self.height } else { self.radius };
        let pressed = N::of(pressed_n);
        let still = Law::new(1e9, self.excess);
        for _ in 0..12 {
            self.look();
            let sums = self.sums(&still);
            let change = self.balance(&sums, &still, pressed).1;
            let change = if sums.visits == 0 { N::of(-0.1) } else { change };
            let most = N::of(10_000.0 / 65_536.0);
            let change = if change > most { most } else { change };
            self.y = self.y + if change < zero - most { zero - most } else { change };
        }
        self.look();
        self.commit(&still, [[0; 2]; 2], true);
        let seconds = self.stride.value() / speed_mm_s;
        let law = Law::new(seconds / self.tau.value(), self.excess);
        let mut found = Crossing::default();
        let until = N::of(until_mm);
        let mut contacts: [Option<Contact<N>>; 3] = [None; 3];
        let mut lifted: Option<N> = None;
        let mut stride = 0;
        loop {
            let now = self.advance(&law, pressed, forward);
            contacts = [contacts[1], contacts[2], Some(now)];
            if stride > 8 {
                found.utilisation = found.utilisation.max(now.utilisation.value());
                found.corner_force_n = found.corner_force_n.max(now.axial.value());
            }
            let peak = |found: &mut Crossing, first: Contact<N>, second: Contact<N>, part: N| {
                let at = |first: N, second: N| (first + part * (first - second)).value();
                let used = at(first.utilisation, second.utilisation);
                found.utilisation = found.utilisation.max(used);
                found.corner_force_n = found.corner_force_n.max(at(first.axial, second.axial));
            };
            if let [Some(earlier), Some(before), Some(now)] = contacts {
                if let Some(part) = lifted.take() {
                    peak(&mut found, before, now, one - part);
                }
                let carries = |contact: &Contact<N>| contact.floor > zero;
                let turns = carries(&before) == forward && carries(&now) != forward;
                if turns && self.x < zero && found.gap_mm == 0.0 {
                    let part = if forward {
                        falls_to_zero(earlier.floor, before.floor, now.floor)
                    } else {
                        (before.y - self.radius) / (earlier.y - before.y)
                    };
                    let part = if part < zero { zero } else { part };
                    let part = if part > one { one } else { part };
                    let x = before.x + part * (now.x - before.x);
                    let y =
                        if forward { before.y + part * (now.y - before.y) } else { self.radius };
                    found.gap_mm = ((x * x + y * y).sqrt() - self.radius).value();
                    if forward {
                        lifted = Some(part);
                    } else {
                        peak(&mut found, before, earlier, part);
                    }
                }
            }
            stride += 1;
            if (self.x > until) == forward || stride > 4000 {
                return found;
            }
        }
    }
}
