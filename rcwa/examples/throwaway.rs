use num_complex::Complex64;
use rcwa::accuracy::{converge_hemisphere, hemisphere_change};
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::relief::{Polygon, Relief};
use rcwa::{Side, Truncation, no_progress};
fn triangle(period: f64, apex: [f64; 2], [above, below]: [Complex64; 2]) -> Interface {
    let points = vec![[0.0, 0.0], apex, [period, 0.0]];
    let ridge = Polygon { index: above, points };
    Interface { relief: Relief::new(period, apex[1], below, vec![ridge]).unwrap(), wavelength: 0.55, n_top: above, n_bottom: below }
}
fn main() {
    for (index, period, apex) in [(Complex64::new(1.5, 0.2), 1.2, [0.9, 0.5]), (Complex64::new(3.0, 0.05), 0.8, [0.6, 0.4]), (Complex64::new(0.96, 6.7), 0.6, [0.3, 0.1]), (Complex64::new(1.5, 0.02), 3.0, [1.5, 0.8])] {
        let i = triangle(period, apex, [1.5.into(), index]);
        let reflected = |r: &Resolution| -> Vec<f64> {
            let d = Directions { kx_per_zone: 1, ky: vec![0.0, 0.5] };
            let all = hemisphere(&i, &d, r, &no_progress).unwrap().incidences;
            all.iter().map(|i| i.efficiencies.iter().filter(|s| s.0 == Side::Top).map(|s| s.2).sum::<f64>()).collect()
        };
        for tol in [3e-2, 1e-2] {
            let t = std::time::Instant::now();
            match converge_hemisphere(&i, tol, &no_progress) {
                Ok((found, estimate)) => {
                    let s = t.elapsed().as_secs_f64();
                    let finer = Resolution { truncation: Truncation::new(2 * found.truncation.highest()).unwrap(), plan: found.plan.refined(2) };
                    let e = hemisphere_change(&reflected(&found), &reflected(&finer));
                    println!("{index} {tol:e}: M {} slices {} stated {estimate:.1e} true {e:.1e} {s:.2} s", found.truncation.highest(), found.plan.count());
                }
                Err(error) => println!("{index} {tol:e}: {error} {:.2} s", t.elapsed().as_secs_f64()),
            }
        }
    }
}
