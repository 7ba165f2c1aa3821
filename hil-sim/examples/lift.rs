//! lift
use hil_sim::plant::{balance::Axial, crossing::*, ring::RingParameters, rolling};
fn main() {
    let ring = RingParameters { radius_mm: 25.0, width_mm: 28.0, k_inf: 0.6044, k_0: 0.6044 * 4.2235, tau_s: 0.1059, elements: 2880 };
    for (p, t) in [(33.3, 6.7), (50.0, 6.7), (55.0, 6.7), (100.0, 20.0), (150.0, 20.0)] { for v in [3.0, 5.0, 8.0, 12.0, 20.0, 30.0] {
        for d in [1.0, -1.0] {
        let r = cross(&CrossingCase { ring, step_height_mm: 4.0, speed_mm_s: v * d, preload_n: p, axial: Axial::Driven(t), stride_mm: 0.01 }).unwrap();
        let flat = rolling::solve(&ring, v, 24.7, |c| c.cosine_n - p);
        let c = 25.0 - flat.height_mm; let eps = 25.0 - r.lift.1;
        let run = 13.5647 + r.lift.0;
        let meas = ((25.0f64 - r.lift_depth_mm).powi(2) + r.lift.1.powi(2) - (r.lift.1 - 4.0).powi(2)).sqrt() - 25.0;
        println!("d {d} P {p} v {v} gap {:.4} meas@lift {:.4} c_flat {c:.4} eps {eps:.4} ratio {:.3} De {:.3} depth {:.4}", r.gap_mm, meas, eps / c, v * 0.1059 / run, r.lift_depth_mm);
        }
    } }
}
