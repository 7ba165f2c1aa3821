fn main(){ 
 let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
 let t = std::time::Instant::now();
 let r = hil_sim::stress::plant::run(n, 1, &|| {});
 eprintln!("{:?}", t.elapsed());
 println!("cases {} failures {} refusals {:?}", r.cases, r.failures.len(), r.refusals);
 for f in r.failures.iter().take(40) { println!("{} {:?}", f.why, f.case); }
 for w in &r.worst { println!("WORST {:?} {:.4} {:?}", w.figure, w.value, w.case); }
}
