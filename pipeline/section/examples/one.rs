use section::{compare::*, dome::Section};
use geometry::profile::*;
fn main() {
    let a: Vec<f64> = std::env::args().skip(1).map(|x| x.parse().unwrap()).collect();
    let base = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.0, radius_mm: 1.7 };
    let relief = Elements { width_mm: 0.1, shapes: vec![Shape::Os1; 17], rounding: Rounding::default() };
    let s = Section::new(&base, &relief, a[0] as usize, a[1], 0.55, [1.41, 1.0]).unwrap();
    let mut r = Request::default();
    r.sources.count = a[2] as usize;
    r.paths = 1 << (a[3] as usize);
    println!("{:?}", cost(&s, r.resolution));
    let t = std::time::Instant::now();
    let c = compare(&s, &r, |p| eprintln!("{p} {:?}", t.elapsed())).unwrap();
    println!("{} rings, radius {}, unknowns {}, balance {:.1e} {:?}", c.rings, c.radius_um, c.unknowns, c.balance, t.elapsed());
    for f in &c.far_fields { let s: f64 = f.bins.iter().sum(); println!("{:?} sum {s} missing {:.1e} {:?}", f.model, f.missing, f.figures()); 
      let (b, _) = f.in_bins(5.0); println!("{}", b.iter().map(|x| format!("{:.2}", 100.0 * x)).collect::<Vec<_>>().join(" ")); }
    for d in &c.distances { println!("{:?} {} rms {:.4} noise {:.4} largest {:.4} l1 {:.4}", d.model, d.bin_deg, d.rms, d.noise, d.largest, d.l1); }
}
