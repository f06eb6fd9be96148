//! Membership in images of NURBS volumes, against closed forms.

mod patch_nets;

use glam::DVec3;
use patch_nets::*;
use voxlathe::math::Side;
use voxlathe::patch::Cells;

fn band(size: f64, p: DVec3) -> f64 {
    8.0 * f64::EPSILON * (size + p.length())
}

/// Mean, median, 99 % and largest.
fn times(mut t: Vec<f64>) -> String {
    t.sort_by(f64::total_cmp);
    let at = |q: f64| t[((t.len() - 1) as f64 * q) as usize];
    let mean = t.iter().sum::<f64>() / t.len() as f64;
    format!(
        "mean {mean:.2}, median {:.2}, 99 % {:.1}, most {:.0}",
        at(0.5),
        at(0.99),
        at(1.0)
    )
}

#[test]
fn random_points_and_points_near_the_surface() {
    let mut random = Random(1);
    for solid in solids() {
        let start = std::time::Instant::now();
        let cells = Cells::new(&solid.volumes).expect("valid");
        let built = start.elapsed();
        let (mut wrong, mut decided) = (Vec::new(), 0);
        let mut check = |p: DVec3, times: &mut Vec<f64>| {
            let start = std::time::Instant::now();
            let found = side(&cells, p);
            times.push(start.elapsed().as_secs_f64() * 1e6);
            let d = (solid.sdf)(p);
            if d.abs() > band(solid.size, p) {
                decided += 1;
                if (found != Side::Outside) != (d < 0.0) || found == Side::On {
                    wrong.push((p, d, found));
                }
            }
        };
        let (mut anywhere, mut near) = (Vec::new(), Vec::new());
        for _ in 0..4000 {
            let reach = 0.75 * solid.size;
            let p = DVec3::from_array(std::array::from_fn(|_| random.within(-reach, reach)));
            check(p, &mut anywhere);
        }
        for i in 0..4000 {
            let (p, n) = (solid.surface)(&mut random);
            let d = 10f64.powf(random.within(-16.0, -1.0)) * solid.size;
            check(p + n * if i % 2 == 0 { d } else { -d }, &mut near);
        }
        println!(
            "{:22} {} cells, {:6} leaves, built in {built:.1?}; {decided} decided; us {}, near {}",
            solid.name,
            cells.len(),
            cells.leaves(),
            times(anywhere),
            times(near),
        );
        assert!(
            wrong.is_empty(),
            "{}: {} wrong, {:?}",
            solid.name,
            wrong.len(),
            &wrong[..wrong.len().min(4)]
        );
    }
}
