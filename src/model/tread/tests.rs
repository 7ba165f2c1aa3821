use super::*;
use crate::model::rollout::{Run, roll};
use crate::rig::Rig;

#[test]
fn prints() {
    let rig = Rig::prototype();
    let tread = Tread::try_build(&rig).unwrap();
    let mut state = TreadState::default();
    for (direction, axial, v, p, exact) in [
        (Direction::Deploy, Axial::Pushed, 8.0, 48.0, 2.4560),
        (Direction::Deploy, Axial::Driven(q16(6_700_000)), 8.0, 48.0, 2.6459),
        (Direction::Deploy, Axial::Driven(q16(6_700_000)), 30.0, 60.0, 2.6989),
        (Direction::Retract, Axial::Pushed, 8.0, 48.0, 2.0783),
        (Direction::Retract, Axial::Driven(q16(6_700_000)), 8.0, 48.0, 2.2289),
    ] {
        let (from, until) = match direction {
            Direction::Deploy => (q16(-38_000_000), q16(10_000_000)),
            Direction::Retract => (q16(25_000_000), q16(-25_000_000)),
        };
        let run = Run { direction, axial, scale: Q16::ONE, level: true, from, until };
        let got = roll(&tread, &mut state, &run, |_| (Q16::from_num(v), Q16::from_num(p)));
        let gap: f64 = got.lift.gap.to_num();
        println!(
            "{direction:?} {axial:?} {v} {p}: {gap:.4} {:+.2} % {got:?}",
            100.0 * (gap / exact - 1.0)
        );
    }
}
#[test]
fn prints_pivot() {
    let rig = Rig::prototype();
    let tread = Tread::try_build(&rig).unwrap();
    let mut state = TreadState::default();
    for level in [true, false] {
        for from in [25.0, 5.0, 1.2] {
            for v in [21.1, 24.1] {
                let run = Run {
                    direction: Direction::Retract,
                    axial: Axial::Driven(q16(6_666_666)),
                    scale: Q16::ONE,
                    level,
                    from: Q16::from_num(from),
                    until: q16(-14_000_000),
                };
                let mut n = 0;
                let mut xs = std::vec::Vec::new();
                let got = roll(&tread, &mut state, &run, |x| {
                    n += 1;
                    if n % 8 == 0 {
                        xs.push(x.to_num::<f32>());
                    }
                    (Q16::from_num(v), q16(52_700_000))
                });
                println!(
                    "{level} {from} {v}: gap {} x {} y {} strides {n} {xs:?}",
                    got.lift.gap, got.lift.position, got.lift.centre
                );
            }
        }
    }
}
