//! Membership in images of NURBS volumes, against closed forms.

mod patch_nets;

use glam::DVec3;
use patch_nets::*;
use voxlathe::math::Side;
use voxlathe::patch::Cells;

fn band(size: f64, p: DVec3) -> f64 {
    8.0 * f64::EPSILON * (size + p.length())
}

#[test]
fn random_points_and_points_near_the_surface() {
    let mut random = Random(1);
    for solid in solids() {
        let start = std::time::Instant::now();
        let cells = Cells::new(&solid.volumes).expect("valid");
        let built = start.elapsed();
        let (mut wrong, mut decided) = (Vec::new(), 0);
        let mut check = |p: DVec3, time: &mut f64| {
            let start = std::time::Instant::now();
            let found = side(&cells, p);
            *time += start.elapsed().as_secs_f64();
            let d = (solid.sdf)(p);
            if d.abs() > band(solid.size, p) {
                decided += 1;
                if (found != Side::Outside) != (d < 0.0) || found == Side::On {
                    wrong.push((p, d, found));
                }
            }
        };
        let (mut anywhere, mut near) = (0.0, 0.0);
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
            "{:22} {} cells, {:6} leaves, built in {built:.1?}; {decided} decided; anywhere {:.2} us, near {:.2} us",
            solid.name,
            cells.len(),
            cells.leaves(),
            anywhere / 4000.0 * 1e6,
            near / 4000.0 * 1e6,
        );
        assert!(wrong.is_empty(), "{}: {} wrong, {:?}", solid.name, wrong.len(), &wrong[..wrong.len().min(4)]);
    }
}
