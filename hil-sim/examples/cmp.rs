//! cmp
use hil_sim::{compare, scenario::Scenario};
fn main() {
    let args: Vec<String> = std::env::args().skip(2).collect();
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let base = Scenario::resolve(None, None, &args).unwrap();
    let t = std::time::Instant::now();
    let c = compare::compare(&base, 1, n, &|| ()).unwrap();
    println!("ref {} {:?}", c.gap_ref_mm, t.elapsed());
    for e in c.equal_gap.iter().chain(&c.equal_speed) { println!("{:10} {:?} v {:?} res {:.3} tuned {} T {:.3} gap {:.3} slip {} inc {} P {:.1} E {:.3} W {:.5}", e.controller, e.policy, e.crossing_speed_mm_s, e.gap_reserve, e.tuned, e.deploy_time_s, e.worst_gap_mm, e.slip_events, e.incomplete, e.mean_preload_n, e.energy_j, e.wear_j); }
    for a in compare::aims(&c) { println!("{a:?}"); }
}
