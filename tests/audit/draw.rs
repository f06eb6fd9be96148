//! Random scenes: their text for the library, and the same solids for the truth.
//!
//! Every solid is told twice: in the kind under test (a round shape, a volume made by construction, a
//! profile), and as a turned profile, whose curves and frame the oracle reads.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

use voxlathe::scene::{SceneFormat, parse_model};

use super::support::oracle::Oracle;
use super::support::sampling::Random;
use super::truth::{Op, Shape, Solid, Truth};
use glam::DVec3;

/// A drawn scene.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// The library's scene.
    pub(crate) text: String,
    pub(crate) truth: Truth,
    /// The volume of the scene's one solid.
    pub(crate) volume: Option<f64>,
    /// About the length of the solids.
    pub(crate) size: f64,
    /// Where they are, about.
    pub(crate) middle: DVec3,
}

/// Families of solids.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kinds {
    /// Turned: round shapes and profiles of all curves.
    Turned,
    /// Volumes by construction.
    Volumes,
    /// Ellipsoids and boxes.
    Quadrics,
    /// Any of them.
    All,
}

/// How frames are drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Where {
    /// Whether axes may be slanted.
    pub(crate) slanted: bool,
    /// Whether turns may be partial.
    pub(crate) partial: bool,
    /// Powers of ten, each as likely: of the scale of everything.
    pub(crate) powers: &'static [i32],
    /// Whether all of it may be a million sizes away.
    pub(crate) far: bool,
}

/// A solid about its own origin.
struct Body {
    /// Keys of the library's solid, and its profile or nothing.
    keys: String,
    profile: String,
    /// Keys of the truth's profile.
    truth: String,
    shape: Shape,
    /// Of the whole turn.
    volume: f64,
    /// Half the length.
    reach: f64,
    /// Whether `start` and `angle` are keys.
    turns: bool,
}

/// A multiple of an eighth.
fn eighths(random: &mut Random, low: f64, high: f64) -> f64 {
    (8.0 * random.between(low, high)).round() / 8.0
}

/// A number that is round now and then.
fn length(random: &mut Random, low: f64, high: f64) -> f64 {
    if random.below(2) == 0 {
        eighths(random, low, high).max(0.125)
    } else {
        random.between(low, high)
    }
}

fn turned(random: &mut Random) -> Body {
    let to_axis = |curve: &str| format!("boundary = 'to-axis'\ncurves = [{curve}]");
    let line = |points: &[[f64; 2]]| format!("{{ kind = 'polyline', points = {points:?} }}");
    let (r, h) = (length(random, 0.4, 1.5), length(random, 0.3, 2.0));
    let plain = |keys: String, truth: String, volume: f64, reach: f64| Body {
        keys,
        profile: String::new(),
        truth,
        shape: Shape::Turned,
        volume,
        reach,
        turns: true,
    };
    let profile = |text: String, volume: f64, reach: f64| Body {
        keys: "kind = 'revolve'\nprofile = 'NAME'".to_owned(),
        profile: text.clone(),
        truth: text,
        shape: Shape::Turned,
        volume,
        reach,
        turns: true,
    };
    match random.below(9) {
        0 => {
            let (a, b) = (r + 0.5, length(random, 0.2, 0.5));
            plain(
                format!("kind = 'torus'\nmajor = {a:?}\nminor = {b:?}"),
                format!("curves = [{{ kind = 'circle', center = [{a:?}, 0], radius = {b:?} }}]"),
                2.0 * PI * PI * a * b * b,
                a + b,
            )
        }
        1 => plain(
            format!("kind = 'cylinder'\nradius = {r:?}\nheight = {h:?}"),
            to_axis(&line(&[[r, 0.0], [r, h]])),
            PI * r * r * h,
            r.max(h),
        ),
        2 => {
            let top = if random.below(2) == 0 {
                0.0
            } else {
                length(random, 0.1, 1.2)
            };
            plain(
                format!("kind = 'cone'\nradius1 = {r:?}\nradius2 = {top:?}\nheight = {h:?}"),
                to_axis(&line(&[[r, 0.0], [top, h]])),
                PI * h * (r * r + r * top + top * top) / 3.0,
                r.max(top).max(h),
            )
        }
        3 => plain(
            format!("kind = 'sphere'\nradius = {r:?}"),
            to_axis(&format!(
                "{{ kind = 'arc', center = [0, 0], radius = {r:?}, from = -90, to = 90 }}"
            )),
            4.0 / 3.0 * PI * r * r * r,
            r,
        ),
        4 => {
            let (low, tube) = (length(random, 0.2, 0.6), length(random, 0.2, 0.8));
            let points = [
                [low, 0.0],
                [low + tube, 0.0],
                [low + tube, h],
                [low, h],
                [low, 0.0],
            ];
            profile(
                format!("curves = [{}]", line(&points)),
                PI * h * ((low + tube).powi(2) - low * low),
                (low + tube).max(h),
            )
        }
        5 => {
            let (a, b, c) = (r + 0.7, length(random, 0.2, 0.6), length(random, 0.2, 0.9));
            let tilt = if random.below(2) == 0 {
                0.0
            } else {
                random.between(0.0, 180.0)
            };
            profile(
                format!(
                    "curves = [{{ kind = 'ellipse', center = [{a:?}, 0], radii = [{b:?}, {c:?}], tilt = {tilt:?} }}]"
                ),
                2.0 * PI * PI * a * b * c,
                a + b.max(c),
            )
        }
        6 => free(random, true),
        7 => free(random, false),
        _ => {
            let count = 3 + random.below(4);
            let text = loop {
                let points: Vec<[f64; 2]> = (0..count)
                    .map(|k| [random.between(0.3, 1.5), 0.5 * k as f64])
                    .collect();
                let degree = 1 + random.below(3.min(count - 1));
                let text = to_axis(&format!(
                    "{{ kind = 'interpolate', points = {points:?}, degree = {degree} }}"
                ));
                if rises(&text) {
                    break text;
                }
            };
            let volume = swept(&text);
            profile(text, volume, 1.6_f64.max(0.5 * count as f64))
        }
    }
}

/// A weighted curve that rises to the axis or beside it.
fn free(random: &mut Random, bezier: bool) -> Body {
    let count = if bezier {
        3 + random.below(3)
    } else {
        4 + random.below(4)
    };
    let points: Vec<[f64; 2]> = (0..count)
        .map(|k| {
            let end = k == 0 || k + 1 == count;
            let r = if end && random.below(3) == 0 {
                0.0
            } else {
                length(random, 0.2, 1.6)
            };
            [r, 0.4 * k as f64]
        })
        .collect();
    let weights: Vec<f64> = (0..count).map(|_| random.between(0.4, 2.5)).collect();
    let text = if bezier {
        format!("{{ kind = 'bezier', points = {points:?}, weights = {weights:?} }}")
    } else {
        let degree = 2 + random.below(2);
        format!(
            "{{ kind = 'nurbs', degree = {degree}, points = {points:?}, weights = {weights:?} }}"
        )
    };
    let text = format!("boundary = 'to-axis'\ncurves = [{text}]");
    Body {
        keys: "kind = 'revolve'\nprofile = 'NAME'".to_owned(),
        volume: swept(&text),
        profile: text.clone(),
        truth: text,
        shape: Shape::Turned,
        reach: 0.4 * count as f64,
        turns: true,
    }
}

/// The oracle's region of a profile.
fn region(profile: &str) -> super::support::oracle::Region {
    let text = format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n"
    );
    let model =
        parse_model(&text, SceneFormat::Toml, "drawn", Path::new(""), &[]).expect("a model");
    Oracle::new(&model).solids.swap_remove(0).region
}

/// Whether a curve nowhere turns back on its way up, so that its loop cannot cross itself.
fn rises(profile: &str) -> bool {
    let region = region(profile);
    region.small.iter().all(|chain| {
        let own = chain.iter().filter(|piece| piece.control.len() > 2);
        let heights: Vec<f64> = own
            .flat_map(|piece| (0..=64).map(|k| blended(&piece.control, f64::from(k) / 64.0)))
            .map(|h| h[1] / h[2])
            .collect();
        heights.is_sorted() || heights.is_sorted_by(|a, b| a >= b)
    })
}

/// The volume of a whole turn of a single loop, ∮ π r² dz over the oracle's pieces.
fn swept(profile: &str) -> f64 {
    let region = region(profile);
    let mut sum = 0.0;
    for piece in region.small.iter().flatten() {
        let n = piece.control.len() - 1;
        let slopes: Vec<[f64; 3]> = piece
            .control
            .windows(2)
            .map(|w| [0, 1, 2].map(|c| n as f64 * (w[1][c] - w[0][c])))
            .collect();
        let mut term = |t: f64| {
            let (h, d) = (blended(&piece.control, t), blended(&slopes, t));
            let r = h[0] / h[2] + region.center[0];
            let dz = (d[1] - h[1] / h[2] * d[2]) / h[2];
            super::cubature::Estimate {
                value: PI * r * r * dz,
                error: 0.0,
            }
        };
        sum += super::cubature::integral([0.0, 1.0], 4, 1e-12, 20_000, &mut term).value;
    }
    sum.abs()
}

/// De Casteljau's point.
fn blended(control: &[[f64; 3]], t: f64) -> [f64; 3] {
    let mut p = control.to_vec();
    for level in 1..p.len() {
        for i in 0..p.len() - level {
            p[i] = [0, 1, 2].map(|c| (1.0 - t) * p[i][c] + t * p[i + 1][c]);
        }
    }
    p[0]
}

fn volumes(random: &mut Random) -> Body {
    if random.below(4) == 0 {
        let (a, b) = (length(random, 0.9, 1.6), length(random, 0.2, 0.6));
        let (c, w) = (b * 0.5_f64.sqrt(), 0.5_f64.sqrt());
        let points = [
            [a - c, -c],
            [a - 2.0 * c, 0.0],
            [a - c, c],
            [a, -2.0 * c],
            [a, 0.0],
            [a, 2.0 * c],
            [a + c, -c],
            [a + 2.0 * c, 0.0],
            [a + c, c],
        ];
        return Body {
            keys: format!(
                "kind = 'volume'\nconstruct = 'surface-circle'\nsection = {{ degrees = [2, 2], \
                 knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1]], points = {points:?}, \
                 weights = [1, {w:?}, 1, {w:?}, 1, {w:?}, 1, {w:?}, 1] }}"
            ),
            profile: String::new(),
            truth: format!("curves = [{{ kind = 'circle', center = [{a:?}, 0], radius = {b:?} }}]"),
            shape: Shape::Turned,
            volume: 2.0 * PI * PI * a * b * b,
            reach: a + b,
            turns: true,
        };
    }
    // A chain that rises, by two constructions.
    let mut body = loop {
        let one = turned(random);
        if one.truth.starts_with("boundary") && !one.truth.contains("interpolate") {
            break one;
        }
    };
    let by = if random.below(2) == 0 {
        "curve-disc"
    } else {
        "curve-ruled"
    };
    body.keys = format!("kind = 'volume'\nconstruct = '{by}'\nprofile = 'NAME'");
    body.profile = body.truth.clone();
    body
}

fn quadrics(random: &mut Random) -> Body {
    let sides = [0, 1, 2].map(|_| length(random, 0.3, 1.5));
    let ellipsoid = random.below(2) == 0;
    let volume = sides.iter().product::<f64>();
    let (keys, shape, volume) = if ellipsoid {
        (
            format!("kind = 'ellipsoid'\nradii = {sides:?}"),
            Shape::Ellipsoid(DVec3::from(sides)),
            4.0 / 3.0 * PI * volume,
        )
    } else {
        (
            format!("kind = 'box'\nsize = {:?}", sides.map(|v| 2.0 * v)),
            Shape::Block(DVec3::from(sides)),
            8.0 * volume,
        )
    };
    Body {
        keys,
        profile: String::new(),
        // Its frame is what counts.
        truth: "boundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[1, 0], [1, 1]] }]"
            .to_owned(),
        shape,
        volume,
        reach: DVec3::from(sides).length(),
        turns: false,
    }
}

/// Keys of an axis.
fn axis(random: &mut Random, slanted: bool, spread: f64) -> String {
    let lattice = [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [-4.0, 0.0, -3.0],
        [1.0, 2.0, 2.0],
    ];
    let direction = match random.below(8) {
        7 if slanted => [0, 1, 2].map(|_| random.between(-1.0, 1.0)),
        k if slanted => lattice[k % 6],
        k => lattice[k % 4],
    };
    let origin = match random.below(3) {
        0 => [0.0; 3],
        1 => [0, 1, 2].map(|_| eighths(random, -spread, spread)),
        _ => [0, 1, 2].map(|_| random.between(-spread, spread)),
    };
    format!("axis = {{ origin = {origin:?}, direction = {direction:?} }}")
}

/// A scene of `count` solids.
pub(crate) fn scene(kinds: Kinds, place: Where, count: usize, random: &mut Random) -> Drawn {
    let scale = 10_f64.powi(place.powers[random.below(place.powers.len())]);
    let far = place.far && random.below(4) == 0;
    let offset = if far {
        DVec3::from([0, 1, 2].map(|_| scale * 1e6 * random.between(-1.0, 1.0).round()))
    } else {
        DVec3::ZERO
    };
    let mut steps = String::new();
    if place.slanted && random.below(4) == 0 {
        let degrees = [30.0, 45.0, 90.0, 77.0][random.below(4)];
        write!(
            steps,
            "{{ rotate = {{ axis = [1, 2, 3], degrees = {degrees:?} }} }}, "
        )
        .expect("text");
    }
    if scale != 1.0 {
        write!(steps, "{{ scale = {scale:?} }}, ").expect("text");
    }
    if far {
        write!(steps, "{{ translate = {:?} }}", offset.to_array()).expect("text");
    }
    let (mut text, mut truth) = ("schema = 1\n".to_owned(), "schema = 1\n".to_owned());
    let (mut solids, mut profiles) = (
        [String::new(), String::new()],
        [String::new(), String::new()],
    );
    let mut shapes = Vec::new();
    let (mut volume, mut size) = (None, 0.0_f64);
    for n in 0..count {
        let body = match (kinds, random.below(6)) {
            (Kinds::Turned, _) | (Kinds::All, 0..=2) => turned(random),
            (Kinds::Volumes, _) | (Kinds::All, 3) => volumes(random),
            _ => quadrics(random),
        };
        let mut turn = String::new();
        let mut share = 1.0;
        if body.turns && place.partial && random.below(3) > 0 {
            let angle = match random.below(3) {
                0 => [90.0, 180.0, 270.0][random.below(3)],
                _ => random.between(10.0, 350.0).round(),
            };
            let start = [0.0, 90.0, 45.0, random.between(0.0, 360.0).round()][random.below(4)];
            turn = format!("start = {start:?}\nangle = {angle:?}\n");
            share = angle / 360.0;
        }
        let spread = if count == 1 { 1.0 } else { 0.8 };
        let axis = axis(random, place.slanted, spread);
        let (op, name) = match random.below(6) {
            _ if n == 0 => (Op::Add, "add"),
            0..=2 => (Op::Add, "add"),
            3 | 4 => (Op::Subtract, "subtract"),
            _ => (Op::Intersect, "intersect"),
        };
        let common = format!("{turn}{axis}\nplace = [{steps}]\noperation = '{name}'\n");
        let profile = format!("p{n}");
        if !body.profile.is_empty() {
            write!(profiles[0], "[profiles.{profile}]\n{}\n", body.profile).expect("text");
        }
        let keys = body.keys.replace("NAME", &profile);
        write!(solids[0], "[[solid]]\n{keys}\n{common}").expect("text");
        write!(profiles[1], "[profiles.{profile}]\n{}\n", body.truth).expect("text");
        write!(
            solids[1],
            "[[solid]]\nkind = 'revolve'\nprofile = '{profile}'\n{common}"
        )
        .expect("text");
        shapes.push((op, body.shape));
        volume = (count == 1).then_some(body.volume * share * scale.powi(3));
        size = size.max(2.0 * body.reach * scale);
    }
    text += &(profiles[0].clone() + &solids[0]);
    truth += &(profiles[1].clone() + &solids[1]);
    let model = parse_model(&truth, SceneFormat::Toml, "drawn", Path::new(""), &[])
        .unwrap_or_else(|e| panic!("{e}\n{truth}"));
    let frames = Oracle::new(&model).solids;
    let solids = shapes.into_iter().zip(frames);
    let solids: Vec<Solid> = solids
        .map(|((op, shape), frame)| Solid { op, shape, frame })
        .collect();
    Drawn {
        text,
        middle: solids.iter().map(|s| s.frame.origin_small).sum::<DVec3>() / count as f64,
        truth: Truth { solids },
        volume,
        size,
    }
}

/// A grid about a drawn scene that its symmetries like: planes through the first solid's origin or a
/// part of a voxel from it, prime or one-voxel.
pub(crate) fn grid(drawn: &Drawn, random: &mut Random) -> String {
    let about = drawn.truth.solids[0].frame.origin_small;
    let n = [1, 2, 7, 11, 12, 13][random.below(6)];
    let spacing = match random.below(2) {
        // Powers of two keep planes where they are.
        0 => 2_f64.powf((1.2 * drawn.size / f64::from(n)).log2().round()),
        _ => 1.2 * drawn.size / f64::from(n),
    };
    let corner = match random.below(3) {
        0 => (f64::from(n) / 2.0).floor() * spacing,
        1 => f64::from(n) / 2.0 * spacing,
        _ => f64::from(n) / 2.0 * spacing * random.between(0.8, 1.2),
    };
    let (dims, origin) = if n == 1 {
        // A voxel off the middle, small, near the surface.
        let step = 0.1 * drawn.size;
        let by = DVec3::from([0, 1, 2].map(|_| step * random.between(-4.0, 4.0).round()));
        return format!(
            "[grid]\norigin = {:?}\nspacing = {step:?}\ndims = [1, 1, 1]\n",
            (about + by).to_array()
        );
    } else {
        ([n; 3], about - DVec3::splat(corner))
    };
    format!(
        "[grid]\norigin = {:?}\nspacing = {spacing:?}\ndims = {dims:?}\n",
        origin.to_array()
    )
}

/// A scene of one turned solid: keys of its profile and of itself.
pub(crate) fn from_profile(profile: &str, keys: &str) -> Drawn {
    let text = format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{keys}"
    );
    let model = parse_model(&text, SceneFormat::Toml, "drawn", Path::new(""), &[])
        .unwrap_or_else(|e| panic!("{e}\n{text}"));
    let frame = Oracle::new(&model).solids.remove(0);
    Drawn {
        text,
        volume: None,
        size: 2.0 * frame.region.extent * frame.scale_small,
        middle: frame.origin_small,
        truth: Truth {
            solids: vec![Solid {
                op: Op::Add,
                shape: Shape::Turned,
                frame,
            }],
        },
    }
}
