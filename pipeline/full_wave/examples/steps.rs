use full_wave::*;
use std::time::Instant;
fn main() {
    let a: Vec<f64> = std::env::args().skip(1).map(|x| x.parse().unwrap()).collect();
    let (rings, width, ppw) = (a[0] as usize, a[1], a[2]);
    // circle of radius rings*width*2/sqrt(..): treads of `width` across, steps on a circle
    let radius = rings as f64 * width * 1.0;
    let mut o = Outline::on_mirror([radius, 0.0]);
    for i in (0..rings).rev() {
        let x = i as f64 * width;
        let z = (radius * radius - x * x).sqrt();
        let [lx, _] = o.last();
        o = o.line_to([lx, z]);
        if i > 0 {
            o = o.line_to([x, z]);
        }
    }
    // flat top mirrored
    let right: Vec<[f64; 2]> = {
        let mut p = vec![];
        let mut l = o.points(1e9);
        p.append(&mut l);
        p
    };
    for p in right.iter().rev() {
        o = o.line_to([-p[0], p[1]]);
    }
    let r = Resolution { nodes_per_wavelength: ppw, max_bytes: 12e9 };
    let body = Body::new(&o, 0.55, [1.41, 1.0], r).unwrap();
    println!("{:?} length {}", body.cost(), o.length());
    let sources =
        [[0.0, 0.3 * radius], [0.15 * radius, 0.2 * radius], [-0.2 * radius, 0.25 * radius]];
    for pol in [Polarisation::Te, Polarisation::Tm] {
        let t = Instant::now();
        let f = body.solve(pol, &sources).unwrap();
        let t1 = t.elapsed();
        let (e, ra) = (f.emitted(), f.radiated());
        let bal: Vec<f64> = e.iter().zip(&ra).map(|(a, b)| (a - b).abs()).collect();
        let rec = (f.between(0, 1) - f.between(1, 0)).norm() / f.between(0, 1).norm();
        let edges: Vec<f64> = (0..=36).map(|i| (-90.0 + 5.0 * f64::from(i)).to_radians()).collect();
        let bins = f.bins(&edges);
        print!(
            "{pol:?} {t1:?} all {:?} emitted {e:?} balance {bal:?} reciprocity {rec:.1e}\nBINS",
            t.elapsed()
        );
        for b in &bins {
            print!(" {:.10}", b[1]);
        }
        println!();
    }
}
