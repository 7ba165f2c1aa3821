//! run
use hil_sim::{scenario::Scenario, sil};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let s = Scenario::resolve(None, None, &args).unwrap();
    let r = sil::run(&s, sil::Options { rows: true, speed: None }).unwrap();
    for l in &r.log { println!("{:8.3} {}", l.t_s, l.text); }
    println!("{}", hil_sim::table::run(&r.summary, &[]));
    hil_sim::report::write_html(&r, std::path::Path::new("/tmp/r.html")).unwrap();
    hil_sim::export::write_csv(&r, std::path::Path::new("/tmp/r.csv")).unwrap();
}
