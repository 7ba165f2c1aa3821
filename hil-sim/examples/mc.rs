//! mc
use hil_sim::{scenario::Scenario, sil};
use rayon::prelude::*;
fn main() {
    let args: Vec<String> = std::env::args().skip(2).collect();
    let n: u64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let base = Scenario::resolve(None, None, &args).unwrap();
    let t = std::time::Instant::now();
    let rs: Vec<_> = (1..=n).into_par_iter().map(|seed| { let mut s = base.clone(); s.run.seed = seed; sil::run(&s, sil::Options::default()).map(|r| r.summary) }).collect();
    let mut g = vec![]; let mut d = vec![]; let mut lead: Vec<f64> = vec![]; let mut er = vec![]; let mut mu: Vec<f64> = vec![]; let mut perr = vec![];
    let mut peak = 0f64; let mut lim = std::collections::BTreeMap::new(); let mut mp=0.0;
    for r in &rs { match r { Err(e) => println!("ERR {e}"), Ok(s) => {
        if !s.completed || s.slip_mm > 0.05 { println!("seed {} completed {} slip {:.3} faults {:?} crossings {}", s.seed, s.completed, s.slip_mm, s.faults, s.crossings.len()); }
        for l in &s.limits { *lim.entry(l.code).or_insert(0) += 1; }
        d.push(s.duration_s); mp += s.mean_preload_n;
        for c in &s.crossings { g.push(c.gap_mm / s.gap_ref_mm); lead.push(c.lead_time_s.unwrap()); mu.push(c.peak_utilisation); peak = peak.max(c.peak_preload_n);
          if let Some(m) = c.gap_measured_mm { er.push(m / c.gap_mm - 1.0); perr.push(c.gap_predicted_mm.unwrap()/c.gap_mm-1.0); } else { println!("seed {} no report", s.seed); } }
    } } }
    let q = |v: &mut Vec<f64>, p: f64| { v.sort_by(f64::total_cmp); v[((v.len() - 1) as f64 * p) as usize] };
    println!("{:?} gap/ref p1 {:.3} p50 {:.3} p95 {:.3} max {:.3} | dur p50 {:.2} max {:.2} | lead min {:.3} | mu max {:.3} | meas err p1 {:.4} p50 {:.4} p99 {:.4} | pred err {:.4} {:.4} {:.4} | peak P {:.2} mean P {:.2} lim {:?}", t.elapsed(), q(&mut g, 0.01), q(&mut g, 0.5), q(&mut g, 0.95), q(&mut g, 1.0), q(&mut d, 0.5), q(&mut d, 1.0), q(&mut lead, 0.0), q(&mut mu, 1.0), q(&mut er, 0.01), q(&mut er, 0.5), q(&mut er, 0.99), q(&mut perr, 0.01), q(&mut perr, 0.5), q(&mut perr, 0.99), peak, mp/rs.len() as f64, lim);
}
