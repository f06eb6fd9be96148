//! Keys of scenes against closed forms and independent integrals: negative angles, profiles over the axis, gaps, closed and
//! tangent splines, knots that part a curve, mirrors; and hints, each of which is applied and must help.

#[path = "support/command.rs"]
mod support;

use std::f64::consts::PI;
use std::fs;

use glam::DVec3;
use support::{below, run, run_within, scratch};
use voxlathe::Scene;

/// Numbers in (-1, 1), the same every time.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 52) as f64 - 1.0
    }
}

fn scene(text: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{text}")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn refused(text: &str) -> String {
    let found = Scene::parse(&format!("schema = 1\n{text}"));
    found.map(|_| ()).expect_err(text).to_string()
}

fn volume(text: &str) -> f64 {
    let found = scene(text).measures().expect("measured");
    assert!(found.error_estimate.volume <= 1e-9 * found.volume, "{text}");
    found.volume
}

#[track_caller]
fn close(found: f64, wanted: f64, tolerance: f64) {
    let off = (found - wanted).abs();
    assert!(
        off <= tolerance * wanted.abs().max(1e-300),
        "{found:e}, wanted {wanted:e}, off by {off:e}"
    );
}

/// A profile that is turned.
fn turned(profile: &str) -> String {
    format!("{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n")
}

const WALL: &str = "[profiles.p]\nboundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[2, 0], [3, 1], [1, 2], [1.5, 3]] }]\n";

/// Solids that take an angle: kind, keys and profile.
fn with_angle(angle: &str) -> Vec<String> {
    let solid = |keys: &str| format!("{WALL}[[solid]]\n{keys}\n{angle}\n");
    [
        "kind = 'torus'\nmajor = 2\nminor = 0.5",
        "kind = 'cylinder'\nradius = 2\nheight = 1",
        "kind = 'cone'\nradius1 = 2\nradius2 = 0.5\nheight = 1",
        "kind = 'sphere'\nradius = 2",
        "kind = 'revolve'\nprofile = 'p'",
        "kind = 'volume'\nconstruct = 'curve-ruled'\nprofile = 'p'",
        "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'p'",
        "kind = 'volume'\nconstruct = 'surface-circle'\nsection = { degrees = [1, 1], knots = [[0, 0, 1, 1], [0, 0, 1, 1]], points = [[1, 0], [2, 0], [1, 1], [2, 2]] }",
    ]
    .map(solid)
    .to_vec()
}

/// The same solid, told in two ways, `image` taking points of the first to those of the second.
fn same(a: &Scene, b: &Scene, image: impl Fn(DVec3) -> DVec3, what: &str) {
    let (one, other) = (a.assembly(), b.assembly());
    let bounds = one.bounds();
    let (middle, half) = (
        0.5 * (bounds.min + bounds.max),
        0.6 * (bounds.max - bounds.min),
    );
    let mut next = noise(7);
    let size = bounds.longest_side();
    for _ in 0..300 {
        let p = middle + half * DVec3::new(next(), next(), next());
        let q = image(p);
        let (d, e) = (one.signed_distance(p), other.signed_distance(q));
        // Edges of composites are within 1e-11 of the size.
        let room = if one.bodies().len() > 1 { 1e-11 } else { 1e-12 };
        assert!(
            (d - e).abs() <= 2.0 * room * size,
            "{what}: {p}: {d} and {e}"
        );
        if d.abs() > 1e-12 * size {
            assert_eq!(one.contains(p), other.contains(q), "{what}: {p}");
        }
    }
    let [m, n] = [a, b].map(|s| s.measures().expect("measured"));
    let bound = m.error_estimate.volume + n.error_estimate.volume;
    assert!(
        (m.volume - n.volume).abs() <= bound + 1e-13 * m.volume,
        "{what}: {} {}",
        m.volume,
        n.volume
    );
    let bound = m.error_estimate.area + n.error_estimate.area;
    assert!((m.area - n.area).abs() <= bound + 1e-13 * m.area, "{what}");
    if m.error_estimate.volume > 1e-9 * m.volume {
        return;
    }
    let [g, h] = [m.centroid, n.centroid].map(|c| c.expect("not empty"));
    assert!((image(g) - h).length() <= 1e-9 * size, "{what}: {g} {h}");
}

#[test]
fn negative_angles_turn_clockwise_from_the_start() {
    for (start, angle) in [(0.0, 90.0), (30.0, 250.0), (-45.5, 10.25), (270.0, 180.0)] {
        let there = with_angle(&format!("start = {}\nangle = {angle}", start - angle));
        let back = with_angle(&format!("start = {start}\nangle = {}", -angle));
        for (a, b) in there.iter().zip(&back) {
            same(&scene(a), &scene(b), |p| p, b);
        }
    }
    for (a, b) in with_angle("angle = 360")
        .iter()
        .zip(with_angle("angle = -360"))
    {
        same(&scene(a), &scene(&b), |p| p, &b);
    }
    for solid in with_angle("angle = -90") {
        let made = scene(&solid);
        // The caps are in the planes y = 0 and x = 0, exactly.
        for (on, beside) in [
            (DVec3::new(1.6, 0.0, 0.25), DVec3::new(0.0, 0.125, 0.0)),
            (DVec3::new(0.0, -1.6, 0.25), DVec3::new(-0.125, 0.0, 0.0)),
        ] {
            assert!(made.assembly().contains(on), "{solid}");
            assert!(!made.assembly().contains(on + 1e-12 * beside), "{solid}");
            assert_eq!(made.assembly().signed_distance(on), 0.0, "{solid}");
            assert_eq!(
                made.assembly().signed_distance(on + beside),
                0.125,
                "{solid}"
            );
        }
    }
    for bad in ["0", "-360.5", "400", "-1e-200"] {
        let text = format!("[[solid]]\nkind = 'sphere'\nradius = 1\nangle = {bad}");
        assert!(refused(&text).contains("wanted an angle other than 0, of at most 360 either way"));
    }
}

/// What the profile `curves` sweeps, with `across` told.
fn over(curves: &str, keys: &str) -> String {
    turned(&format!("[profiles.p]\n{keys}\ncurves = [{curves}]"))
}

fn circle(r: f64, z: f64, radius: f64) -> String {
    format!("{{ kind = 'circle', center = [{r:?}, {z:?}], radius = {radius:?} }}")
}

const CLIP: &str = "across = 'clip'";
const MIRROR: &str = "across = 'mirror'";

/// Volume of what a disc about r = c of that radius leaves at r >= 0, turned: 2 pi times the first moment of area.
fn clipped_disc(c: f64, radius: f64) -> f64 {
    let (low, high) = ((-c).max(-radius), radius);
    // The moment of (t + c) 2 sqrt(radius^2 - t^2) over t from low to high.
    let primitive = |t: f64| {
        let root = (radius * radius - t * t).max(0.0).sqrt();
        let area = t * root + radius * radius * (t / radius).clamp(-1.0, 1.0).asin();
        c * area - 2.0 / 3.0 * root.powi(3)
    };
    2.0 * PI * (primitive(high) - primitive(low))
}

#[test]
fn circles_over_the_axis_are_clipped_or_mirrored() {
    for scale in [1.0, 1e-6, 1e6] {
        for c in [0.0, 2.0, 0.5, 1e-7, 2.9999999, 3.0, 4.0] {
            let ring = circle(c * scale, 7.0 * scale, 3.0 * scale);
            let wanted = clipped_disc(c, 3.0) * scale.powi(3);
            for keys in [CLIP, MIRROR] {
                close(volume(&over(&ring, keys)), wanted, 1e-12);
            }
            // From the other side what is over the axis is a lens, and its image the whole.
            let ring = circle(-c * scale, 7.0 * scale, 3.0 * scale);
            close(volume(&over(&ring, MIRROR)), wanted, 1e-12);
            if c < 2.9 {
                let lens = clipped_disc(-c, 3.0) * scale.powi(3);
                close(volume(&over(&ring, CLIP)), lens, 1e-11);
            }
        }
    }
    let ball = scene(&over(&circle(0.0, 0.0, 5.0), CLIP));
    assert!(ball.warnings().is_empty());
    assert_eq!(ball.assembly().signed_distance(DVec3::ZERO), -5.0);
    assert_eq!(
        ball.assembly().signed_distance(DVec3::new(0.0, 0.0, 7.0)),
        2.0
    );
    assert_eq!(ball.bounds().min.to_array(), [-5.0; 3]);
    let sphere = scene("[[solid]]\nkind = 'sphere'\nradius = 5");
    same(&ball, &sphere, |p| p, "a clipped circle is a ball");
    let both = scene(&over(&circle(0.0, 0.0, 5.0), MIRROR));
    same(&both, &sphere, |p| p, "and is its own image");
    // A shell: the hole goes over the axis, too.
    for keys in [CLIP, MIRROR] {
        let shell = turned(&format!(
            "[profiles.p]\n{keys}\nloops = [[{}], [{}]]",
            circle(0.0, 0.0, 5.0),
            circle(0.0, 0.0, 2.0)
        ));
        close(volume(&shell), 4.0 / 3.0 * PI * 117.0, 1e-13);
    }
}

/// A band of slope 1 over the axis, and where its image is.
const BAND: &str = "{ kind = 'polyline', points = [[-2, 0], [1, 3], [1, 4], [-2, 1], [-2, 0]] }";

#[test]
fn a_band_and_its_image_are_united() {
    close(volume(&over(BAND, CLIP)), PI, 1e-13);
    let text = over(BAND, MIRROR);
    // Of width 1 + 2 r up to r = 1/2, 2 up to 1, 1 up to 2.
    close(volume(&text), 2.0 * PI * (0.125 + 0.25 / 3.0 + 2.25), 1e-13);
    let made = scene(&text);
    let solid = made.assembly();
    let inside = |r: f64, z: f64| {
        let own = |r: f64| (-2.0..=1.0).contains(&r) && (r + 2.0..=r + 3.0).contains(&z);
        own(r) || own(-r)
    };
    // Edges of both that bound the union, by points: an upper bound of the distance and nearly the distance itself.
    let mut edge = Vec::new();
    for i in 0..=40_000 {
        let s = 3.0 * f64::from(i) / 40_000.0 - 2.0;
        for [r, z, out_r, out_z] in [
            [s, s + 2.0, 1.0, -1.0],
            [s, s + 3.0, -1.0, 1.0],
            [1.0, 3.0 + (s + 2.0) / 3.0, 1.0, 0.0],
            [-2.0, (s + 2.0) / 3.0, -1.0, 0.0],
        ] {
            for side in [1.0, -1.0] {
                let (r, out) = (side * r, side * out_r);
                if (0.0..=2.0).contains(&r) && !inside((r + 1e-9 * out).abs(), z + 1e-9 * out_z) {
                    edge.push([r, z]);
                }
            }
        }
    }
    let mut next = noise(3);
    for _ in 0..150 {
        let (r, z, angle) = (1.5 * (next() + 1.0), 2.0 + 2.5 * next(), PI * next());
        let p = DVec3::new(r * angle.cos(), r * angle.sin(), z);
        assert_eq!(solid.contains(p), inside(r, z), "{r} {z}");
        let near = edge.iter().map(|e| (e[0] - r).hypot(e[1] - z));
        let near = near.fold(f64::INFINITY, f64::min);
        let found = solid.signed_distance(p);
        assert_eq!(found <= 0.0, inside(r, z));
        assert!((found.abs() - near).abs() < 2e-4, "{r} {z}: {found} {near}");
    }
    // The crossing of a curve with its image is no slip; that with itself is.
    assert!(made.warnings().is_empty(), "{:?}", made.warnings());
    let bow = "{ kind = 'polyline', points = [[-2, 0], [2, 2], [2, 0.5], [-2, 2.5], [-2, 0]] }";
    assert!(scene(&over(bow, MIRROR)).warnings()[0].contains("cross themselves"));
}

#[test]
fn chains_to_the_axis_end_beyond_it() {
    let chain = "{ kind = 'polyline', points = [[2, 0], [-1, 3]] }";
    let keys = |across: &str| format!("boundary = 'to-axis'\n{across}");
    close(volume(&over(chain, &keys(CLIP))), 8.0 * PI / 3.0, 1e-13);
    close(volume(&over(chain, &keys(MIRROR))), 3.0 * PI, 1e-13);
    // Wholly beyond: nothing to clip, and all of it in the mirror.
    let beyond = "{ kind = 'polyline', points = [[-2, 0], [-1, 3]] }";
    let said = refused(&over(beyond, &keys(CLIP)));
    assert!(said.contains("no area"), "{said}");
    close(volume(&over(beyond, &keys(MIRROR))), 7.0 * PI, 1e-13);
    // A wave that crosses five times: what is clipped runs back and forth along the axis.
    let wave = "{ kind = 'bezier', points = [[1, 0], [-9, 3], [9, -3], [-9, 6], [9, 0], [-1, 3]], reverse = true }, { kind = 'polyline', points = [[1, 0], [3, 0], [3, 3], [-1, 3]] }";
    let wave = over(wave, CLIP);
    let found = scene(&wave);
    let mut next = noise(5);
    let bezier = |t: f64| {
        let mut p = [
            [1.0, 0.0],
            [-9.0, 3.0],
            [9.0, -3.0],
            [-9.0, 6.0],
            [9.0, 0.0],
            [-1.0, 3.0_f64],
        ];
        for n in (1..6).rev() {
            for i in 0..n {
                p[i] = [0, 1].map(|k| p[i][k] + t * (p[i + 1][k] - p[i][k]));
            }
        }
        p[0]
    };
    let outline: Vec<[f64; 2]> = [[1.0, 0.0], [3.0, 0.0], [3.0, 3.0], [-1.0, 3.0]]
        .into_iter()
        .chain((1..20_000).rev().map(|i| bezier(f64::from(i) / 20_000.0)))
        .collect();
    for _ in 0..300 {
        let (r, z) = (1.75 * (next() + 1.0), 1.5 + 2.0 * next());
        let mut odd = false;
        let mut near = f64::INFINITY;
        for (k, a) in outline.iter().enumerate() {
            let b = outline[(k + 1) % outline.len()];
            if (a[1] > z) != (b[1] > z) {
                odd ^= r < a[0] + (z - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            }
            near = near.min((a[0] - r).hypot(a[1] - z));
        }
        if near > 2e-3 {
            assert_eq!(
                found.assembly().contains(DVec3::new(r, 0.0, z)),
                odd,
                "{r} {z}"
            );
        }
    }
}

/// The hint of an error.
fn hint(said: &str) -> &str {
    said.split_once("; ").map_or("", |(_, hint)| hint)
}

#[test]
fn the_refusal_of_a_profile_over_the_axis_offers_what_helps() {
    for (curves, helps) in [
        (circle(0.0, 0.0, 5.0), [true, true]),
        (circle(1.0, 0.0, 5.0), [true, true]),
        (circle(-9.0, 0.0, 5.0), [false, true]),
    ] {
        let said = refused(&over(&curves, ""));
        for (across, helps) in ["clip", "mirror"].into_iter().zip(helps) {
            let offered = hint(&said).contains(&format!("across = \"{across}\""));
            assert_eq!(offered, helps, "{said}");
            let applied = format!(
                "schema = 1\n{}",
                over(&curves, &format!("across = '{across}'"))
            );
            assert_eq!(Scene::parse(&applied).is_ok(), helps, "{applied}");
        }
        assert!(!said.contains("control points"), "{said}");
    }
    // A volume knows no other side: no hint that would not help.
    for keys in ["", CLIP] {
        let text = format!(
            "[profiles.p]\nboundary = 'to-axis'\n{keys}\ncurves = [{{ kind = 'polyline', points = [[2, 0], [-1, 3]] }}]\n[[solid]]\nkind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'p'\n"
        );
        let said = refused(&text);
        assert!(
            said.contains("r = -1e0") && !said.contains("across"),
            "{said}"
        );
    }
}

/// An arc and a line whose ends were written with six decimals.
fn six_decimals(keys: &str) -> String {
    turned(&format!(
        "[profiles.p]\nboundary = 'to-axis'\n{keys}\n[[profiles.p.curves]]\nkind = 'nurbs'\ndegree = 2\npoints = [[3.333333, 0.0], [3.333333, 1.414214], [1.885618, 2.414214]]\nweights = [1, 0.92388, 1]\n[[profiles.p.curves]]\nkind = 'polyline'\npoints = [[1.885619, 2.414213], [1.2, 5]]"
    ))
}

#[test]
fn gaps_are_joined_as_wide_as_the_profile_says() {
    // Integrals of pi r^2 dz over the two curves and the segment between them, by Gauss in numpy.
    close(volume(&six_decimals("gap = 1e-6")), 84.0347566397849, 1e-13);
    let said = refused(&six_decimals(""));
    for part in [
        "profiles.p.curves[0]",
        "profiles.p.curves[1]",
        "a gap of 1.4142",
        "(1.885618, 2.414214)",
        "gap = 1e-6 in the profile joins them",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(refused(&six_decimals("gap = 1e-7")).contains("gap = 1e-6"));
    // With no gap at all, only ends that are equal meet.
    assert!(refused(&six_decimals("gap = 0")).contains("gap = 1e-6"));
    scene(&over(&circle(2.0, 0.0, 1.0), "gap = 0"));
    for bad in ["0.002", "-1e-9", "'wide'", "nan"] {
        assert!(refused(&six_decimals(&format!("gap = {bad}"))).contains("from 0 to 1e-3"));
    }
    // What is too far apart is not offered to be joined.
    let wide = "{ kind = 'polyline', points = [[1, 0], [2, 0]] }, { kind = 'polyline', points = [[2.1, 0], [2, 2], [1, 0]] }";
    let said = refused(&over(wide, ""));
    assert!(
        hint(&said) == "move an end, or add a segment between them",
        "{said}"
    );
    // An open chain: to the axis, where that makes something.
    let open = "{ kind = 'polyline', points = [[1, 0], [2, 1], [1, 3]] }";
    let said = refused(&over(open, ""));
    assert!(hint(&said).contains("boundary = \"to-axis\""), "{said}");
    scene(&over(open, "boundary = 'to-axis'"));
    let level = "{ kind = 'polyline', points = [[1, 0], [2, 0]] }";
    let said = refused(&over(level, ""));
    assert!(!hint(&said).contains("to-axis"), "{said}");
    // As wide as the size allows, at every scale.
    for scale in [1e-6, 1.0, 1e9] {
        let square = |off: f64| {
            let p = |r: f64, z: f64| format!("[{:?}, {:?}]", r * scale, z * scale);
            let points = [
                p(1.0, 0.0),
                p(2.0, 0.0),
                p(2.0, 1.0),
                p(1.0, 1.0),
                p(1.0, off),
            ];
            format!("{{ kind = 'polyline', points = [{}] }}", points.join(", "))
        };
        close(
            volume(&over(&square(9e-4), "gap = 1e-3")),
            3.0 * PI * scale.powi(3),
            1e-12,
        );
        assert!(refused(&over(&square(1.1e-3), "gap = 1e-3")).contains("gap of"));
    }
}

const SEVEN: &str = "[[2, 0], [3, 0.2], [4, 1], [3.5, 2.5], [2.2, 2.8], [1, 2], [1.2, 0.7]]";

/// Volumes by Gauss over `scipy.interpolate.make_interp_spline` at the chord lengths, of bc_type "periodic" or with
/// derivatives at the ends on the averaged knots.
#[test]
fn splines_through_points_are_closed_or_have_tangents() {
    let closed = |points: &str, degree: u32| {
        over(
            &format!(
                "{{ kind = 'interpolate', closed = true, degree = {degree}, points = {points} }}"
            ),
            "",
        )
    };
    let square = "[[1, 0], [2, 0], [2, 1], [1, 1]]";
    let three = "[[1, 0], [3, 0], [2, 2]]";
    for (points, degree, wanted) in [
        (square, 1, 9.424777960769378),
        (square, 3, 14.372786390173301),
        (square, 5, 14.761570168527701),
        (square, 7, 14.799811973191112),
        (SEVEN, 1, 91.69261758277412),
        (SEVEN, 3, 106.51101258689454),
        (SEVEN, 5, 106.72353960528034),
        (SEVEN, 7, 106.63037381232789),
        (three, 1, 25.132741228718352),
        (three, 3, 52.97565060794276),
        (three, 5, 59.175311259522644),
        (three, 7, 60.65519365276232),
    ] {
        close(volume(&closed(points, degree)), wanted, 1e-12);
    }
    // Many points: the band and its border. On a circle a spline of degree 7 is the circle to many digits.
    let around: Vec<String> = (0..400)
        .map(|i| f64::from(i) * PI / 200.0)
        .map(|a| format!("[{:?}, {:?}]", 3.0 + a.cos(), a.sin()))
        .collect();
    let around = format!("[{}]", around.join(", "));
    close(volume(&closed(&around, 7)), 6.0 * PI * PI, 1e-13);
    close(volume(&closed(&around, 3)), 6.0 * PI * PI, 1e-8);
    let open = |keys: &str, points: &str| {
        over(
            &format!("{{ kind = 'interpolate', points = {points}, {keys} }}"),
            "boundary = 'to-axis'",
        )
    };
    let five = "[[2, 0], [3, 1], [2.5, 2.5], [1.5, 3], [1, 4]]";
    for (keys, wanted) in [
        (
            "start-tangent = [1, 0], end-tangent = [0, 1]",
            74.4771123117922,
        ),
        ("start-tangent = [1, 0.5]", 72.85792175187574),
        ("end-tangent = [-0.5, 1]", 74.98743486616337),
        (
            "degree = 2, start-tangent = [1, 0], end-tangent = [0, 1]",
            73.9357925148097,
        ),
        (
            "degree = 5, start-tangent = [1, 0], end-tangent = [0, 1]",
            74.93593452497437,
        ),
    ] {
        close(volume(&open(keys, five)), wanted, 1e-12);
    }
    let two = open(
        "start-tangent = [1, 0], end-tangent = [0, 1]",
        "[[2, 0], [1, 3]]",
    );
    close(volume(&two), 27.72428647862659, 1e-13);
    // Turned round it is the same.
    let back = "reverse = true, closed = true";
    let back = over(
        &format!("{{ kind = 'interpolate', points = {SEVEN}, {back} }}"),
        "",
    );
    close(volume(&back), 106.51101258689454, 1e-12);
    for (keys, points, wanted) in [
        (
            "closed = true, degree = 2",
            SEVEN,
            "an odd degree for closed = true",
        ),
        (
            "closed = true, start-tangent = [1, 0]",
            SEVEN,
            "a closed curve has no ends",
        ),
        (
            "closed = true",
            "[[1, 0], [2, 0]]",
            "at least 3 points for closed = true",
        ),
        (
            "closed = true",
            "[[1, 0], [2, 0], [2, 1], [1, 0]]",
            "leave the last one out",
        ),
        (
            "degree = 1, end-tangent = [1, 0]",
            SEVEN,
            "degree 2 or more",
        ),
        ("end-tangent = [1, 0, 0]", SEVEN, "a derivative [dr, dz]"),
        ("closed = 1", SEVEN, "true or false"),
        (
            "periodic = true",
            SEVEN,
            "`closed = true` makes a closed smooth curve",
        ),
    ] {
        let said = refused(&open(keys, points));
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
    // The open spline that does not close says how it would.
    let lone = |keys: &str| {
        over(
            &format!("{{ kind = 'interpolate', points = {SEVEN}{keys} }}"),
            "",
        )
    };
    let said = refused(&lone(""));
    assert!(hint(&said).contains("closed = true"), "{said}");
    scene(&lone(", closed = true"));
}

#[test]
fn a_curve_may_fall_into_two_where_it_is_continuous() {
    let nurbs = |fifth: &str, keys: &str| {
        over(
            &format!(
                "{{ kind = 'nurbs', degree = 3, knots = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2], points = [[2, 0], [3, 0.5], [3, 1.5], [2, 2], {fifth}, [1, 2.5], [1.5, 3.5], [1, 4]], weights = [1, 2, 2, 1, 3, 1, 1, 1] }}"
            ),
            &format!("boundary = 'to-axis'\n{keys}"),
        )
    };
    // Two rational Béziers, by Gauss in numpy.
    close(volume(&nurbs("[2, 2]", "")), 55.69517432825674, 1e-13);
    let said = refused(&nurbs("[2, 2.001]", ""));
    for part in [
        "a jump of 9.99",
        "at parameter 1, from (r, z) = (2, 2)",
        "gap = 1e-3",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    scene(&nurbs("[2, 2.001]", "gap = 1e-3"));
    let said = refused(&nurbs("[2, 2.5]", ""));
    assert_eq!(hint(&said), "make the two control points equal", "{said}");
    // As volumes, whose pieces have weights of their own.
    let revolved = nurbs("[2, 2]", "");
    let as_volume = revolved.replace(
        "kind = 'revolve'",
        "kind = 'volume'\nconstruct = 'curve-disc'",
    );
    close(volume(&as_volume), 55.69517432825674, 1e-12);
    // One more is no knot vector, and of a volume's net the limit stays.
    let many = revolved.replace("1, 1, 1, 1, 2, 2, 2, 2]", "1, 1, 1, 1, 1, 2, 2, 2]");
    assert!(refused(&many).contains("at most 4 equal knots"));
}

/// Every family, with what is easily lost in a mirror: turns, skew nets, fields, axes that lie askew, other steps.
fn families() -> Vec<(&'static str, String)> {
    let profile = "[profiles.p]\nboundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[2, 0], [3, 1], [1, 2], [1.5, 3]] }]\n[profiles.q]\ncurves = [{ kind = 'ellipse', center = [3, 1], radii = [1, 0.5], tilt = 20 }]\n";
    let axis = "axis = { origin = [0.5, 1, -0.25], direction = [1, 2, 3], x = [0, 1, 0.5] }";
    let net = "kind = 'volume'\npatches = [{ degrees = [1, 1, 2], knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 0, 1, 1, 1]], points = [[0,0,0],[2,0.2,0],[0.1,1,0],[2,1.5,0.3],[0,0.3,1],[2.5,0,1],[0,1.2,1.1],[2,1.4,1],[0.2,0,2],[2,0,2.2],[0,1,2],[2.1,1.3,2.4]], weights = [1,1,2,1,1,0.5,1,1,1,1,1,3] }]";
    let solid = |keys: &str| format!("{profile}[[solid]]\n{keys}\n");
    vec![
        (
            "revolve",
            solid(&format!(
                "kind = 'revolve'\nprofile = 'q'\nstart = 20\nangle = 130\n{axis}"
            )),
        ),
        (
            "reflex",
            solid(&format!(
                "kind = 'revolve'\nprofile = 'p'\nstart = -70\nangle = 290\n{axis}"
            )),
        ),
        (
            "clockwise",
            solid("kind = 'revolve'\nprofile = 'p'\nstart = 90\nangle = -90"),
        ),
        (
            "torus",
            solid("kind = 'torus'\nmajor = 3\nminor = 1\nstart = 10\nangle = 100"),
        ),
        (
            "cone",
            solid(&format!(
                "kind = 'cone'\nradius1 = 2\nradius2 = 0\nheight = 3\n{axis}"
            )),
        ),
        (
            "ellipsoid",
            solid(&format!("kind = 'ellipsoid'\nradii = [1, 2, 3]\n{axis}")),
        ),
        (
            "box",
            solid(&format!("kind = 'box'\nsize = [1, 2, 3]\n{axis}")),
        ),
        ("net", solid(&format!("{net}\n{axis}"))),
        ("net upright", solid(net)),
        (
            "ruled",
            solid(
                "kind = 'volume'\nconstruct = 'curve-ruled'\nprofile = 'p'\nstart = 30\nangle = 200",
            ),
        ),
        (
            "disc",
            solid(&format!(
                "kind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'p'\n{axis}"
            )),
        ),
        (
            "composite",
            format!(
                "{profile}[[solid]]\nkind = 'revolve'\nprofile = 'p'\nstart = 10\nangle = 200\n{axis}\nplace = []\n[[solid]]\nkind = 'box'\nsize = [2, 3, 2]\noperation = 'subtract'\naxis = {{ origin = [1, 1, 1], direction = [0, 1, 4] }}\nplace = []\n"
            ),
        ),
        (
            "coaxial",
            format!(
                "{profile}[[solid]]\nkind = 'revolve'\nprofile = 'p'\nstart = 10\nangle = 200\nplace = []\n[[solid]]\nkind = 'cylinder'\nradius = 0.5\nheight = 9\nstart = 10\nangle = 200\noperation = 'subtract'\nplace = []\n"
            ),
        ),
    ]
}

/// The scene with each of its solids placed by those steps.
fn steps(text: &str, steps: &str) -> String {
    if text.contains("place = []") {
        text.replace("place = []", &format!("place = [{steps}]"))
    } else {
        format!("{text}place = [{steps}]\n")
    }
}

/// Reflection in the plane through the origin with that normal.
fn reflect(normal: DVec3) -> impl Fn(DVec3) -> DVec3 + Copy {
    move |p| p - 2.0 * normal.dot(p) / normal.length_squared() * normal
}

#[test]
fn mirrors_reflect_every_family() {
    for (name, text) in families() {
        let plain = scene(&text);
        for n in [
            DVec3::X,
            DVec3::Z * -3.0,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(0.3, -2.0, 1.1),
        ] {
            let [x, y, z] = n.to_array();
            let mirror = format!("{{ mirror = [{x:?}, {y:?}, {z:?}] }}");
            let image = scene(&steps(&text, &mirror));
            same(&plain, &image, reflect(n), &format!("{name} in {n}"));
            // Twice is as if nothing had been, moved and grown between or not.
            let twice = scene(&steps(
                &text,
                &format!(
                    "{mirror}, {{ scale = 2 }}, {{ mirror = [1, 2, 0] }}, {{ translate = [1, 0, 0] }}"
                ),
            ));
            let then = move |p| reflect(DVec3::new(1.0, 2.0, 0.0))(2.0 * reflect(n)(p)) + DVec3::X;
            for p in [
                DVec3::ZERO,
                DVec3::new(1.5, 0.5, 1.0),
                DVec3::new(-0.5, 2.0, 0.75),
            ] {
                let (d, e) = (
                    plain.assembly().signed_distance(p),
                    twice.assembly().signed_distance(then(p)),
                );
                assert!((2.0 * d - e).abs() < 1e-12, "{name}: {d} {e}");
            }
        }
    }
}

#[test]
fn mirrored_samples_are_the_samples_mirrored() {
    use voxlathe::sample::{fraction, occupancy, signed_distance};
    for (name, text) in families() {
        // A grid about the origin is its own image in x = 0.
        let grid = "[grid]\norigin = [-5, -4.75, -4.9]\nspacing = [0.625, 0.61, 0.63]\ndims = [16, 16, 16]\n";
        let [plain, image] = [text.clone(), steps(&text, "{ mirror = [2, 0, 0] }")]
            .map(|t| scene(&format!("{grid}{t}")));
        let g = plain.grid().expect("a grid");
        let dims = g.dims();
        let each = |scene: &Scene| {
            (
                occupancy(scene, &g).expect("sampled"),
                fraction(scene, &g).expect("sampled"),
                signed_distance(scene, &g).expect("sampled"),
            )
        };
        let (a, b) = (each(&plain), each(&image));
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                for i in 0..dims[0] {
                    let at = (k * dims[1] + j) * dims[0];
                    let (p, q) = (at + i, at + dims[0] - 1 - i);
                    assert_eq!(
                        a.0.data()[p],
                        b.0.data()[q],
                        "{name}: occupancy at {i} {j} {k}"
                    );
                    let (f, h) = (a.1.data()[p], b.1.data()[q]);
                    assert!(
                        (f - h).abs() < 5e-6,
                        "{name}: fraction at {i} {j} {k}: {f} {h}"
                    );
                    let (d, e) = (a.2.data()[p], b.2.data()[q]);
                    assert!((d - e).abs() < 1e-5, "{name}: sdf at {i} {j} {k}: {d} {e}");
                }
            }
        }
    }
}

#[test]
fn mirrored_solids_are_meshed_validated_and_exported() {
    let folder = scratch();
    for (name, text) in families() {
        let from = below(&folder, "scene.toml");
        let text = steps(&text, "{ mirror = [1, 2, 0.5] }");
        fs::write(
            &from,
            format!("schema = 1\n[grid]\nresolution = 12\n{text}"),
        )
        .expect("a scene");
        let done = run(&["validate", &from, "--json"]).exits(0).json();
        assert_eq!(done["ok"], true, "{name}: {done}");
        if name.starts_with("co") && name != "cone" || name == "revolve" {
            continue;
        }
        // What is written is read back as the same solid, its Jacobian determinant positive where it was.
        let file = below(&folder, "out.g2");
        run(&["export", &from, "-o", &file]).exits(0);
        let written = scene(&text);
        let read = scene(&format!("[[solid]]\nkind = 'volume'\nfile = '{file}'\n"));
        let mut next = noise(2);
        for _ in 0..200 {
            let p = 4.0 * DVec3::new(next(), next(), next());
            let d = written.assembly().signed_distance(p);
            let e = read.assembly().signed_distance(p);
            assert!((d - e).abs() < 1e-11, "{name}: {p}: {d} {e}");
        }
        for volume in voxlathe::exchange::read_volumes(&file).expect("volumes") {
            let integral = volume.moments().expect("measured").volume;
            assert!(integral.value > 0.0, "{name}: {integral:?}");
        }
    }
}

#[test]
fn parameters_of_a_mirrored_net_are_those_of_the_net() {
    let (_, text) = families()
        .into_iter()
        .find(|(n, _)| *n == "net upright")
        .expect("there");
    let folder = scratch();
    let column = |text: &str, name: &str| -> Vec<f32> {
        let from = below(&folder, "scene.toml");
        let grid = "[grid]\norigin = [-3, -3, -3]\nspacing = 0.5\ndims = [12, 12, 12]\n[output]\nchannels = ['u', 'v', 'w']\n";
        fs::write(&from, format!("schema = 1\n{grid}{text}")).expect("a scene");
        let to = below(&folder, name);
        run(&["voxelize", &from, "-o", &to]).exits(0);
        let stack = support::Stack::read(&to);
        ["u", "v", "w"]
            .iter()
            .flat_map(|c| stack.channel(c).to_vec())
            .collect()
    };
    let plain = column(&text, "plain");
    let image = column(&steps(&text, "{ mirror = [1, 0, 0] }"), "image");
    let mut filled = 0;
    for (at, value) in plain.iter().enumerate() {
        let other = image[at - at % 12 + 11 - at % 12];
        let same = value == &other || (value - other).abs() < 1e-6;
        assert!(
            same || value.is_nan() && other.is_nan(),
            "{at}: {value} {other}"
        );
        filled += usize::from(*value > 0.0);
    }
    assert!(filled > 100, "{filled}");
}

#[test]
fn steps_of_a_mirror_are_checked() {
    let placed = |step: &str| format!("[[solid]]\nkind = 'sphere'\nradius = 1\nplace = [{step}]\n");
    for (step, wanted) in [
        (
            "{ mirror = [0, 0, 0] }",
            "a direction: a vector [x, y, z] that is not zero",
        ),
        ("{ mirror = 'x' }", "a vector [x, y, z]"),
        ("{ mirror = [1, 0, 0], scale = 2 }", "a table for each step"),
        ("{ miror = [1, 0, 0] }", "did you mean `mirror`?"),
        ("{ reflect = [1, 0, 0] }", "`mirror` takes the normal"),
        ("{}", "one of scale, rotate, translate, mirror"),
    ] {
        let said = refused(&placed(step));
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
    let made = scene(&placed("{ translate = [1, 0, 0] }, { mirror = [1, 0, 0] }"));
    assert_eq!(made.bounds().min.to_array(), [-2.0, -1.0, -1.0]);
    // What is resolved is a scene again.
    let text = made.model().resolve().to_string();
    let folder = scratch();
    let file = below(&folder, "again.json");
    fs::write(&file, text).expect("written");
    assert_eq!(Scene::load(&file).expect("a scene").hash(), made.hash());
}

#[test]
fn hints_are_remedies() {
    // The end of a turn: `angle` is what is missing, not `kind`, which is there.
    let end = refused("[[solid]]\nkind = 'torus'\nmajor = 2\nminor = 0.5\nstart = 300\nend = 60\n");
    assert!(
        hint(&end).starts_with("`angle` is how far it turns from `start`"),
        "{end}"
    );
    // No hint at a key that is there already.
    let twice = refused("[[solid]]\nkind = 'sphere'\nradius = 1\nradiu = 2\n");
    assert!(hint(&twice).is_empty(), "{twice}");
    // Loops as tables: what the hint writes is TOML, and a scene.
    let plate = |loops: &str| turned(&format!("[profiles.p]\nloops = {loops}\n"));
    let outside =
        "{ boundary = 'to-axis', curves = [{ kind = 'polyline', points = [[6, 0], [6, 2]] }] }";
    let flat = circle(6.0, 0.0, 1.0);
    let bare = "{ curves = [{ kind = 'polyline', points = [[6, 0], [6, 2]] }] }";
    for loops in [outside, &flat, bare] {
        let said = refused(&plate(&format!("[{loops}]")));
        let written = hint(&said);
        let from = written
            .find("loops = [[")
            .unwrap_or_else(|| panic!("{said}"));
        let to = written[from..].find("]]").expect("closed") + from + 2;
        scene(&plate(written[from..to].trim_start_matches("loops = ")));
    }
    // A table where an array of tables is meant, under any name.
    for name in ["p", "'my p'"] {
        let text = |open: &str, close: &str| {
            format!(
                "{open}profiles.{name}.curves{close}\nkind = 'circle'\ncenter = [3, 0]\nradius = 1\n[[solid]]\nkind = 'revolve'\nprofile = {}\n",
                if name == "p" { "'p'" } else { name }
            )
        };
        let said = refused(&text("[", "]"));
        let header = hint(&said)
            .split("write ")
            .nth(1)
            .and_then(|h| h.split(", with").next());
        let header = header.unwrap_or_else(|| panic!("{said}"));
        scene(&text("[", "]").replace(&format!("[profiles.{name}.curves]"), header));
    }
    let said =
        refused("[profiles.\"a\\\"b\".curves]\nkind = 'circle'\ncenter = [3, 0]\nradius = 1\n");
    assert!(hint(&said).is_empty(), "{said}");
}

#[test]
fn a_grid_that_holds_none_or_not_all_is_told() {
    let folder = scratch();
    let (from, to) = (below(&folder, "scene.toml"), below(&folder, "out"));
    let warned = |grid: &str, solids: &str| -> Vec<String> {
        fs::write(&from, format!("schema = 1\n{grid}\n{solids}")).expect("a scene");
        let done = run(&["voxelize", &from, "-o", &to, "--json", "--force"]).exits(0);
        let found = done.json();
        let list = found["warnings"].as_array().expect("a list").clone();
        let list: Vec<String> = list
            .iter()
            .map(|w| w.as_str().expect("text").to_owned())
            .collect();
        for warning in &list {
            assert!(
                done.err.contains(warning.as_str()),
                "{warning}: {}",
                done.err
            );
        }
        list
    };
    let ball = "[[solid]]\nkind = 'sphere'\nradius = 2\n";
    let off = "[grid]\norigin = [10, 10, 10]\nspacing = 0.5\ndims = [7, 5, 3]";
    assert!(warned(off, ball)[0].starts_with("the grid holds none of the solid"));
    let half = "[grid]\nbounds = [[0, -2, -2], [2, 2, 2]]\nresolution = 8";
    assert!(warned(half, ball)[0].starts_with("the grid does not hold all of the solid"));
    for all in [
        "[grid]\nresolution = 8",
        "[grid]\nbounds = [[-2, -2, -2], [2, 2, 2]]\nresolution = 7",
        "[grid]\nresolution = 8\npadding = 0",
    ] {
        assert!(warned(all, ball).is_empty(), "{all}");
    }
    // What is cut away need not be held, and what is said of it is no more than known.
    let cut = format!("{ball}[[solid]]\nkind = 'box'\nsize = [2, 4, 4]\noperation = 'intersect'\n");
    let narrow = "[grid]\nbounds = [[-1, -2, -2], [1, 2, 2]]\nresolution = 8";
    assert!(warned(narrow, &cut).is_empty());
    let cut = cut.replace("intersect", "subtract");
    assert!(warned(half, &cut)[0].starts_with("the grid may not hold all"));
}

#[test]
fn points_come_from_standard_input_and_in_quotes() {
    let folder = scratch();
    let from = below(&folder, "scene.toml");
    fs::write(
        &from,
        "schema = 1\n[[solid]]\nkind = 'sphere'\nradius = 1\n",
    )
    .expect("a scene");
    let limit = std::time::Duration::from_secs(60);
    let ask = |points: &str| run_within(limit, points, &["query", &from, "--points", "-"]);
    let done = ask("x,y,z\n0,0,0\n2,0,0\n").exits(0);
    assert_eq!(done.out, "inside,sdf\n1,-1\n0,1\n");
    let done = ask("\"2\",\"0\",\"0\"\n0,0,1\n").exits(0);
    assert_eq!(done.out, "inside,sdf\n0,1\n1,0\n");
    let done = ask("1,2\n").exits(2);
    assert!(done.err.contains("<stdin>:1:"), "{}", done.err);
    let both = run_within(limit, "", &["query", "-", "--points", "-"]).exits(2);
    assert!(both.err.contains("one of them"), "{}", both.err);
    let file = below(&folder, "p.csv");
    fs::write(&file, "\"2\",\"0\",\"0\"\n0,0,1\n").expect("points");
    let done = run(&["query", &from, "--points", &file]).exits(0);
    assert_eq!(done.out, "inside,sdf\n0,1\n1,0\n");
}

#[test]
fn files_of_tables_and_of_other_editors_are_read() {
    let folder = scratch();
    fs::write(
        folder.path().join("wall.csv"),
        "r,z\n2,0\n3,1\n2.5,2\n2,3\n2.2,4\n",
    )
    .expect("points");
    let from = below(&folder, "scene.toml");
    let text = turned(
        "[profiles.p]\nboundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = { file = 'wall.csv' } }]",
    );
    fs::write(&from, format!("schema = 1\n{text}")).expect("a scene");
    let cone = |a: f64, b: f64| PI / 3.0 * (a * a + a * b + b * b);
    let wanted = cone(2.0, 3.0) + cone(3.0, 2.5) + cone(2.5, 2.0) + cone(2.0, 2.2);
    let found = Scene::load(&from)
        .expect("a scene")
        .measures()
        .expect("measured");
    close(found.volume, wanted, 1e-13);
    let from = below(&folder, "scene.json");
    fs::write(
        &from,
        "\u{feff}{\"schema\": 1, \"solid\": [{\"kind\": \"sphere\", \"radius\": 1}]}",
    )
    .expect("a scene");
    Scene::load(&from).expect("a byte order mark is passed over");
}

/// A cylinder of radius 2 and height 3 as a biquadratic disc times a segment; `premultiplied` or not, as the format is.
fn cylinder_g2(premultiplied: bool) -> String {
    let (h, s) = (2.0_f64.sqrt(), 0.5_f64.sqrt());
    let mut text = "700 1 0 0\n3 1\n3 3\n0 0 0 1 1 1\n3 3\n0 0 0 1 1 1\n2 2\n0 0 1 1\n".to_owned();
    for z in [0.0, 3.0] {
        for [x, y, w] in [
            [-h, -h, 1.0],
            [0.0, -2.0 * h, s],
            [h, -h, 1.0],
            [-2.0 * h, 0.0, s],
            [0.0, 0.0, 1.0],
            [2.0 * h, 0.0, s],
            [-h, h, 1.0],
            [0.0, 2.0 * h, s],
            [h, h, 1.0],
        ] {
            let f = if premultiplied { w } else { 1.0 };
            text += &format!("{:?} {:?} {:?} {w:?}\n", x * f, y * f, z * f);
        }
    }
    text
}

#[test]
fn volumes_are_read_out_of_files_that_hold_more() {
    let folder = scratch();
    let read = |name: &str, text: &str| {
        let file = below(&folder, name);
        fs::write(&file, text).expect("a file");
        Scene::parse(&format!(
            "schema = 1\n[[solid]]\nkind = 'volume'\nfile = '{file}'\n"
        ))
    };
    let sheet = "200 1 0 0\n3 0\n2 2\n0 0 1 1\n2 2\n0 0 1 1\n5 0 0\n6 0 0\n5 1 0\n6 1 0\n\n";
    let line = "100 1 0 0\n3 0\n2 2\n0 0 1 1\n0 0 0\n1 2 0.5\n\n";
    let found = read(
        "more.g2",
        &format!("{sheet}{}{line}{sheet}", cylinder_g2(true)),
    )
    .expect("a volume");
    close(found.measures().expect("measured").volume, 12.0 * PI, 1e-12);
    let said = found.warnings().join("\n");
    assert!(
        said.contains("only the volumes are read; left out: one curve, 2 surfaces"),
        "{said}"
    );
    let said = read("less.g2", sheet)
        .map(|_| ())
        .expect_err("no volume")
        .to_string();
    assert!(
        said.contains("a surface") && said.contains("at least one volume"),
        "{said}"
    );
    // The weights not multiplied in: it folds, and what may be why is said.
    let said = read("raw.g2", &cylinder_g2(false))
        .map(|_| ())
        .expect_err("it folds")
        .to_string();
    for part in ["taken as premultiplied", "look Cartesian", "folds"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // Two blocks, 2 and 3 wide.
    let block = |a: u32, b: u32| {
        format!(
            "knotvectors\n3\n1 2 0 0 1 1\n1 2 0 0 1 1\n1 2 0 0 1 1\n\ndimensions\n3\n\ncontrolpoints\n{a} 0 0 1\n{b} 0 0 1\n{a} 1 0 1\n{b} 1 0 1\n{a} 0 3 1\n{b} 0 3 1\n{a} 1 3 1\n{b} 1 3 1\n\n"
        )
    };
    let mesh = format!(
        "MFEM NURBS mesh v1.0\n\ndimension\n3\n\nelements\n2\n1 5 0 1 4 3 6 7 10 9\n1 5 1 2 5 4 7 8 11 10\n\nboundary\n0\n\nedges\n0\n\nvertices\n12\n\npatches\n\n{}{}",
        block(0, 2),
        block(2, 5)
    );
    let found = read("word.mesh", &mesh).expect("blocks");
    close(found.measures().expect("measured").volume, 15.0, 1e-13);
    let said = found.warnings().join("\n");
    assert!(
        said.contains("\"dimensions\" is taken for \"dimension\""),
        "{said}"
    );
    let said = read("word.mesh", &mesh.replace("dimensions", "dimension3"))
        .map(|_| ())
        .expect_err("a word")
        .to_string();
    assert!(said.contains("the word \"dimension\""), "{said}");
    // A prism with a skew side; the spacing of one knot vector stands beside it.
    let mesh = "MFEM NURBS mesh v1.0\n\ndimension\n3\n\nelements\n1\n1 5 0 1 2 3 4 5 6 7\n\nboundary\n6\n1 3 3 2 1 0\n1 3 0 1 5 4\n1 3 1 2 6 5\n1 3 2 3 7 6\n1 3 3 0 4 7\n1 3 4 5 6 7\n\nedges\n12\n0 0 1\n1 1 2\n0 3 2\n1 0 3\n0 4 5\n1 5 6\n0 7 6\n1 4 7\n2 0 4\n2 1 5\n2 2 6\n2 3 7\n\nvertices\n8\n\nknotvectors\n3\n1 2 0 0 1 1\nspacing\n5 3 1 1 0 1 10.0\n1 2 0 0 1 1\n1 2 0 0 1 1\n\nweights\n1\n1\n1\n1\n1\n1\n1\n1\n\nFiniteElementSpace\nFiniteElementCollection: NURBS1\nVDim: 3\nOrdering: 1\n\n0 0 0\n2 0 0\n2.5 1 0\n0 1 0\n0 0 3\n2 0 3\n2.5 1 3\n0 1 3\n";
    let found = read("spacing.mesh", mesh).expect("a prism");
    close(found.measures().expect("measured").volume, 6.75, 1e-13);
    let said = found.warnings().join("\n");
    assert!(
        said.contains("spacing of knot vector 0 is passed over"),
        "{said}"
    );
    assert!(
        read(
            "spacing.mesh",
            &mesh.replace("5 3 1 1 0 1 10.0", "5 9 1 1 0 1 10.0")
        )
        .is_err()
    );
}

/// Profiles that are closed loops, and how many patches they become.
const LOOPS: &[(&str, &str, usize)] = &[
    (
        "circle",
        "curves = [{ kind = 'circle', center = [3, 1], radius = 1 }]",
        1,
    ),
    (
        "tangent circle",
        "loops = [[{ kind = 'circle', center = [1, 1], radius = 1 }]]",
        1,
    ),
    (
        "ellipse",
        "curves = [{ kind = 'ellipse', center = [3, 1], radii = [1, 0.4], tilt = 25 }]",
        1,
    ),
    (
        "box",
        "curves = [{ kind = 'polyline', points = [[1, 0], [2, 0], [2, 3], [1, 3], [1, 0]] }]",
        1,
    ),
    (
        "triangle",
        "curves = [{ kind = 'polyline', points = [[1, 0], [3, 1], [1.5, 2], [1, 0]] }]",
        2,
    ),
    // A wall of 1 between two walls that bulge: each turns at a height of its own.
    (
        "wall",
        "curves = [{ kind = 'bezier', points = [[2, 0], [4, 1], [1, 3], [3, 4]] }, { kind = 'polyline', points = [[3, 4], [2, 4]] }, { kind = 'bezier', points = [[2, 4], [0.5, 3], [2.5, 1.5], [1.5, 0]], weights = [1, 2, 1, 3] }, { kind = 'polyline', points = [[1.5, 0], [2, 0]] }]",
        5,
    ),
    // Two arcs that meet in points.
    (
        "lens",
        "curves = [{ kind = 'arc', center = [2, 0], radius = 1, from = -60, to = 60 }, { kind = 'arc', center = [3, 0], radius = 1, from = 120, to = 240 }]",
        2,
    ),
    (
        "along the axis",
        "curves = [{ kind = 'polyline', points = [[0, 0], [2, 0], [1, 2], [0, 3], [0, 0]] }]",
        2,
    ),
    (
        "clipped",
        "across = 'clip'\ncurves = [{ kind = 'circle', center = [0.5, 0], radius = 2 }]",
        4,
    ),
    (
        "spline",
        "curves = [{ kind = 'interpolate', closed = true, points = [[2, 0], [3, 0.5], [3.2, 2], [1.8, 1.5]] }]",
        7,
    ),
];

#[test]
fn closed_profiles_are_exported_as_sections_that_are_turned() {
    let folder = scratch();
    let (from, file) = (below(&folder, "scene.toml"), below(&folder, "out.g2"));
    for (name, profile, patches) in LOOPS {
        for keys in [
            "",
            "start = 20\nangle = -140\nplace = [{ mirror = [1, 2, 0] }, { translate = [1, 0, 3] }]",
        ] {
            let text = format!("{}{keys}\n", turned(&format!("[profiles.p]\n{profile}")));
            fs::write(&from, format!("schema = 1\n{text}")).expect("a scene");
            run(&["export", &from, "-o", &file]).exits(0);
            let volumes = voxlathe::exchange::read_volumes(&file).expect("volumes");
            assert_eq!(volumes.len(), *patches, "{name}");
            for volume in &volumes {
                let integral = volume.moments().expect("measured").volume;
                assert!(integral.value > 0.0, "{name}: {integral:?}");
            }
            let (written, read) = (
                scene(&text),
                scene(&format!("[[solid]]\nkind = 'volume'\nfile = '{file}'\n")),
            );
            same(&written, &read, |p| p, name);
        }
    }
    for (profile, why) in [
        // A flange: a step.
        (
            "curves = [{ kind = 'polyline', points = [[1, 0], [4, 0], [4, 1], [2, 1], [2, 3], [1, 3], [1, 0]] }]",
            "a step at z = 1, where it goes from r = 1 ... 4 to r = 1 ... 2",
        ),
        (
            "loops = [[{ kind = 'circle', center = [3, 0], radius = 1 }], [{ kind = 'circle', center = [3, 0], radius = 0.5 }]]",
            "in 2 parts at z = ",
        ),
        (
            "loops = [[{ kind = 'circle', center = [3, 0], radius = 1 }], [{ kind = 'circle', center = [6, 0], radius = 1 }]]",
            "in 2 parts at z = ",
        ),
    ] {
        let text = turned(&format!("[profiles.p]\n{profile}"));
        fs::write(&from, format!("schema = 1\n{text}")).expect("a scene");
        let done = run(&["export", &from, "-o", &below(&folder, "none.g2")]).exits(2);
        assert!(
            done.err.contains(why) && done.err.contains("revolve 1"),
            "{why}: {}",
            done.err
        );
    }
    assert!(!folder.path().join("none.g2").exists());
}
