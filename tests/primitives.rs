//! Torus, cylinder, cone, sphere, ellipsoid and box as kinds of solids.

mod support;

use glam::DVec3;
use std::f64::consts::PI;
use support::oracle::{Big, big, small, sqrt};
use voxlathe::{Scene, sample};

fn scene(solids: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{solids}")).unwrap_or_else(|e| panic!("{e}\n{solids}"))
}

/// Numbers in [0, 1) that fill it evenly.
fn share(n: u32, k: u32) -> f64 {
    let step = [
        0.754_877_666_246_693,
        0.569_840_290_998_053,
        0.361_803_398_874_989,
    ][k as usize];
    (f64::from(n) * step).fract()
}

/// Points in a box around the solid, some of them well outside.
fn points(scene: &Scene, count: u32) -> impl Iterator<Item = DVec3> {
    let bounds = scene.bounds();
    let (middle, sides) = (0.5 * (bounds.min + bounds.max), bounds.sides());
    (0..count).map(move |n| {
        let spread = if n % 4 == 0 { 3.0 } else { 1.1 };
        middle + spread * sides * (DVec3::new(share(n, 0), share(n, 1), share(n, 2)) - 0.5)
    })
}

const PLACED: &str = "axis = { origin = [1, -2, 0.5], direction = [1, 2, 3], x = [1, 0, 0] }
    place = [{ scale = 1.5 }, { rotate = { axis = [0, 1, 1], degrees = 30 } }]";

/// A kind is a short form of a profile that is turned: every answer has the same bits.
#[test]
fn round_kinds_are_profiles_turned() {
    let pairs = [
        (
            "kind = 'torus'\nmajor = 2\nminor = 0.75",
            "curves = [{ kind = 'circle', center = [2, 0], radius = 0.75 }]",
        ),
        (
            "kind = 'cylinder'\nradius = 2\nheight = 3",
            "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[2, 0], [2, 3]] }]",
        ),
        (
            "kind = 'cone'\nradius1 = 2\nradius2 = 0.5\nheight = 3",
            "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[2, 0], [0.5, 3]] }]",
        ),
        (
            "kind = 'cone'\nradius1 = 0\nradius2 = 2\nheight = 3",
            "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[0, 0], [2, 3]] }]",
        ),
        (
            "kind = 'sphere'\nradius = 1.25",
            "boundary = 'to-axis'\ncurves = [{ kind = 'arc', center = [0, 0], radius = 1.25, from = -90, to = 90 }]",
        ),
    ];
    for (kind, profile) in pairs {
        for turn in ["", "angle = 250\nstart = 20"] {
            let short = scene(&format!("[[solid]]\n{kind}\n{turn}\n{PLACED}"));
            let long = scene(&format!(
                "[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{turn}\n{PLACED}"
            ));
            assert_eq!(short.bounds(), long.bounds());
            assert_eq!(short.measures(), long.measures());
            for p in points(&short, 500) {
                let (a, b) = (short.assembly(), long.assembly());
                assert_eq!(
                    a.signed_distance(p).to_bits(),
                    b.signed_distance(p).to_bits()
                );
            }
        }
    }
}

/// A tube wider than its ring: the union of the discs that the circle's mirror image makes too.
#[test]
fn a_spindle_torus_is_filled() {
    let (major, minor) = (0.75, 1.25);
    let spindle = scene("[[solid]]\nkind = 'torus'\nmajor = 0.75\nminor = 1.25");
    for p in points(&spindle, 4000) {
        let off = (p.x.hypot(p.y) - major).hypot(p.z) - minor;
        if off.abs() > 1e-12 {
            assert_eq!(spindle.assembly().contains(p), off < 0.0, "{p}");
        }
        if off > 1e-12 {
            // From outside the nearest point is on the tube, but on the axis beyond its tips.
            let sd = spindle.assembly().signed_distance(p);
            assert!((sd - off).abs() < 1e-14, "{p}: {sd} {off}");
        }
    }
    // Pappus for the arc beyond the axis and the segment that it cuts off.
    let most = (-major / minor).acos();
    let volume = 2.0
        * PI
        * (major * minor * minor * (most - 0.5 * (2.0 * most).sin())
            + 2.0 / 3.0 * minor.powi(3) * most.sin().powi(3));
    let found = spindle.measures().expect("one solid").volume;
    assert!((found - volume).abs() < 1e-14 * volume, "{found} {volume}");
}

#[test]
fn boxes_are_closed_and_exact() {
    let b = scene(
        "[[solid]]\nkind = 'box'\nsize = [0.2, 0.6, 1.4]\nplace = [{ translate = [0.1, 0.3, 0.7] }]",
    );
    let held = |p: [f64; 3]| b.assembly().contains(p.into());
    // The sums of the decimals, not what f64 rounds them to.
    assert!(held([0.0, 0.0, 0.0]) && held([0.2, 0.6, 1.4]));
    assert!(!held([-1e-20, 0.3, 0.7]));
    let sd = |p: [f64; 3]| b.assembly().signed_distance(p.into());
    assert_eq!(sd([0.1, 0.3, 0.7]), -0.1);
    assert!((sd([0.2 + 0.3, 0.6 + 0.4, 0.7]) - 0.5).abs() < 1e-15);
    assert_eq!(sd([0.2, 0.1, 0.3]), 0.0);
    let tilted = scene(&format!(
        "[[solid]]\nkind = 'box'\nsize = [2, 1, 0.5]\n{PLACED}"
    ));
    let found = tilted.measures().expect("one solid");
    let volume = 1.5_f64.powi(3);
    assert!((found.volume - volume).abs() <= found.error_estimate.volume);
    assert!((found.area - 1.5 * 1.5 * 7.0).abs() <= found.error_estimate.area);
    // The sides show in the distance: it is a length away wherever its gradient is.
    let mut near = 0;
    for p in points(&tilted, 3000) {
        let d = tilted.assembly().signed_distance(p);
        let e = 1e-6;
        let slope = DVec3::from_array(DVec3::AXES.map(|a| {
            let f = |s: f64| tilted.assembly().signed_distance(p + s * e * a);
            (f(1.0) - f(-1.0)) / (2.0 * e)
        }));
        if (slope.length() - 1.0).abs() < 1e-6 {
            let foot = p - slope * d;
            assert!(tilted.assembly().signed_distance(foot).abs() < 1e-6 * d.abs().max(1.0));
            near += 1;
        }
    }
    assert!(near > 2500);
}

/// Distance to an ellipsoid in 256 bits: bisection of t in Σ (r_i x_i / (t + r_i²))² = 1.
fn ellipsoid_distance(radii: [f64; 3], point: [f64; 3]) -> f64 {
    let (r, x) = (radii.map(big), point.map(|c| big(c.abs())));
    let least = radii.iter().copied().fold(f64::INFINITY, f64::min);
    let value = |t: &Big| {
        let terms = (0..3).map(|i| {
            let q = &r[i] * &x[i] / (t + &r[i] * &r[i]);
            &q * &q
        });
        terms.fold(big(0.0), |s, q| s + q)
    };
    let reach: f64 = (0..3).map(|i| radii[i] * point[i].abs()).sum();
    let (mut low, mut high) = (-big(least) * big(least), big(reach) + big(reach));
    // Just above the pole.
    let pole = low.clone() * (big(1.0) - big(2.0_f64.powi(-180)));
    if value(&pole) < big(1.0) {
        low = pole;
        high = low.clone();
    }
    for _ in 0..240 {
        let middle = (&low + &high) / big(2.0);
        if value(&middle) > big(1.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut foot: Vec<Big> = (0..3)
        .map(|i| &r[i] * &r[i] * &x[i] / (&high + &r[i] * &r[i]))
        .collect();
    // Along the least axis whatever is left.
    let axis = radii
        .iter()
        .position(|&v| v == least)
        .expect("one of three");
    let rest = (0..3).filter(|&i| i != axis).fold(big(1.0), |s, i| {
        let q = &foot[i] / &r[i];
        s - &q * &q
    });
    foot[axis] = &r[axis] * sqrt(&rest);
    let off = (0..3).fold(big(0.0), |s, i| {
        let d = &foot[i] - &x[i];
        s + &d * &d
    });
    small(&sqrt(&off))
}

#[test]
fn ellipsoid_distances_agree_with_256_bits() {
    let mut worst = 0.0_f64;
    for radii in [
        [1.0, 0.5, 0.25],
        [0.3, 1.0, 0.3],
        [1.0, 1.0, 0.2],
        [1.0, 0.02, 0.4],
        [1.0, 0.999_999, 0.999_998],
        [1.0, 1.0, 1.0],
    ] {
        for n in 0..400_u32 {
            let spread = [0.05, 0.9, 1.0, 1.2, 4.0][(n % 5) as usize];
            let mut p: [f64; 3] =
                std::array::from_fn(|i| (share(n, i as u32) - 0.5) * 2.0 * spread * radii[i]);
            match n % 7 {
                // On axes and planes of symmetry, where feet leave the plane.
                0 => p[(n / 7 % 3) as usize] = 0.0,
                1 => p[(n / 7 % 3) as usize] *= 1e-14,
                2 => p[2] = 1e-300,
                _ => {}
            }
            let e = scene(&format!("[[solid]]\nkind = 'ellipsoid'\nradii = {radii:?}"));
            let found = e.assembly().signed_distance(p.into());
            // Where two radii are equal the oracle puts what is left on one of them; as far away.
            let wanted = ellipsoid_distance(radii, p);
            let error = (found.abs() - wanted).abs();
            worst = worst.max(error);
            assert!(error <= 1e-12 * 2.0, "{radii:?} {p:?}: {found} {wanted}");
            let squares: f64 = (0..3).map(|i| (p[i] / radii[i]).powi(2)).sum();
            if (squares - 1.0).abs() > 1e-13 {
                assert_eq!(found < 0.0, squares < 1.0);
            }
        }
    }
    eprintln!("ellipsoids: worst error of the distance {worst:e}");
}

/// Rows are filled in runs; every voxel is what a question for its centre says.
#[test]
fn grids_agree_with_points() {
    let texts = [
        format!("[[solid]]\nkind = 'ellipsoid'\nradii = [1, 0.4, 0.7]\n{PLACED}"),
        format!("[[solid]]\nkind = 'box'\nsize = [1, 0.4, 0.7]\n{PLACED}"),
        "[[solid]]\nkind = 'box'\nsize = [2, 4, 2]".to_owned(),
        "[[solid]]\nkind = 'ellipsoid'\nradii = [2, 1, 1]".to_owned(),
        "[[solid]]\nkind = 'box'\nsize = [2, 4, 2]\n[[solid]]\nkind = 'ellipsoid'\nradii = [2, 1, 1]\noperation = 'subtract'"
            .to_owned(),
    ];
    for text in texts {
        for grid in ["resolution = [23, 17, 19]", "spacing = 0.25\npadding = 1"] {
            let one = scene(&format!("[grid]\n{grid}\n{text}"));
            let grid = one.grid().expect("a grid");
            let occupancy = sample::occupancy(&one, &grid).expect("a volume");
            let sdf = sample::signed_distance(&one, &grid).expect("a volume");
            let fraction = sample::fraction(&one, &grid).expect("a volume");
            let [nx, ny, nz] = grid.dims();
            let mut volume = 0.0;
            for k in 0..nz {
                for j in 0..ny {
                    for i in 0..nx {
                        let n = (k * ny + j) * nx + i;
                        let p = grid.centre(i, j, k);
                        let inside = one.assembly().contains(p);
                        assert_eq!(occupancy.data()[n] == 1, inside, "{text} {p}");
                        assert_eq!(sdf.data()[n] <= 0.0, inside, "{text} {p}");
                        volume += f64::from(fraction.data()[n]);
                    }
                }
            }
            let exact = one.exact_volume().expect("few solids").value;
            let found = volume * grid.spacing().element_product();
            assert!(
                (found - exact).abs() < 1e-6 * exact,
                "{text}: {found} {exact}"
            );
        }
    }
}

#[test]
fn booleans_of_boxes_and_ellipsoids_have_known_measures() {
    let octant = scene(
        "[[solid]]\nkind = 'ellipsoid'\nradii = [3, 2, 1]
         [[solid]]\nkind = 'box'\nsize = [4, 4, 4]\naxis = { origin = [2, 2, 2] }\noperation = 'intersect'",
    );
    let whole = scene("[[solid]]\nkind = 'ellipsoid'\nradii = [3, 2, 1]");
    let (part, all) = (
        octant.measures().expect("two solids"),
        whole.measures().expect("one solid"),
    );
    let check = |what: &str, found: f64, wanted: f64, estimate: f64| {
        let error = (found - wanted).abs();
        eprintln!("{what}: off by {error:e}, estimate {estimate:e}");
        assert!(
            error <= estimate + 1e-14 * wanted.abs(),
            "{what}: {found} {wanted}"
        );
        assert!(estimate < 1e-9 * wanted.abs(), "{what}: {estimate}");
    };
    check(
        "volume of the octant",
        part.volume,
        PI,
        part.error_estimate.volume,
    );
    let quarters = PI / 4.0 * (3.0 * 2.0 + 2.0 * 1.0 + 1.0 * 3.0);
    check(
        "its area",
        part.area,
        all.area / 8.0 + quarters,
        part.error_estimate.area,
    );
    let centroid = part.centroid.expect("not empty");
    let wanted = DVec3::new(9.0, 6.0, 3.0) / 8.0;
    assert!(
        (centroid - wanted).length() <= part.error_estimate.centroid + 1e-14,
        "{centroid}"
    );
    let bounds = part.bounds.expect("not empty");
    assert!((bounds.max - DVec3::new(3.0, 2.0, 1.0)).abs().max_element() < 1e-9);

    let drilled = scene(
        "[[solid]]\nkind = 'box'\nsize = [4, 3, 2]
         [[solid]]\nkind = 'cylinder'\nradius = 1\nheight = 4\naxis = { origin = [0, 0, -2] }\noperation = 'subtract'",
    );
    let found = drilled.measures().expect("two solids");
    check(
        "drilled box",
        found.volume,
        24.0 - 2.0 * PI,
        found.error_estimate.volume,
    );
    check(
        "its area",
        found.area,
        52.0 - 2.0 * PI + 4.0 * PI,
        found.error_estimate.area,
    );

    // Boxes that share faces.
    let stair = scene(
        "[[solid]]\nkind = 'box'\nsize = [2, 1, 1]
         [[solid]]\nkind = 'box'\nsize = [1, 1, 1]\naxis = { origin = [0.5, 0, 1] }
         [[solid]]\nkind = 'box'\nsize = [1, 1, 0.5]\naxis = { origin = [-0.5, 0, -0.25] }\noperation = 'subtract'",
    );
    let found = stair.measures().expect("three solids");
    check("stair", found.volume, 2.5, found.error_estimate.volume);
    check("its area", found.area, 13.0, found.error_estimate.area);
}

#[test]
fn bad_sizes_are_refused_with_their_place() {
    let refused = |text: &str, wanted: &str| {
        let error = Scene::parse(&format!("schema = 1\n[[solid]]\n{text}"));
        let error = error.expect_err(text).to_string();
        assert!(error.contains(wanted), "{text}: {error}");
    };
    refused("kind = 'box'\nsize = [1, 2]", "<text>:4:8: solid[0].size");
    refused(
        "kind = 'box'\nsize = [1, 2, 0]",
        "<text>:4:15: solid[0].size[2]",
    );
    refused(
        "kind = 'ellipsoid'\nradii = [1, 1e-12, 1]",
        "none is below 1e-8 of the largest",
    );
    refused(
        "kind = 'torus'\nmajor = 1",
        "solid[0]: found no key `minor`",
    );
    refused(
        "kind = 'cone'\nradius1 = 0\nradius2 = 0\nheight = 1",
        "a radius greater than 0",
    );
    refused(
        "kind = 'sphere'\nradius = -1",
        "<text>:4:10: solid[0].radius",
    );
    refused("kind = 'shpere'\nradius = 1", "did you mean `sphere`?");
    refused(
        "kind = 'box'\nsize = [1, 1, 1]\nangle = 90",
        "unknown key `angle`",
    );
}
