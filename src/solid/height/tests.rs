//! Cells of one sheet against what knows nothing of heights: circles through the cell for turned bodies, and the surface's
//! integral for volumes.

use super::{Swept, share_of_patch, swept};
use crate::math::Side;
use crate::math::quadrature::Integral;
use crate::scene::Scene;
use crate::solid::circles::cut_cell;
use crate::solid::{Assembly, Body};
use glam::DVec3;

const GOAL: f64 = 1e-10;

fn assembly(text: &str) -> Assembly {
    let scene = Scene::parse(&format!("schema = 1\n{text}")).expect("a scene");
    scene.assembly().clone()
}

fn single(of: &Assembly) -> &Body {
    of.single().expect("one body")
}

const WALL: &str =
    "profiles.wall.curves = [{ kind = 'polyline', points = [[0.5, 2], [0.5, 0], [1, 0]] },
    { kind = 'bezier', points = [[1, 0], [1.8, 0.7], [0.9, 2]] },
    { kind = 'polyline', points = [[0.9, 2], [0.5, 2]] }]
";

fn turned() -> Vec<String> {
    let solid = |one: &str| format!("solid = [{{ {one} }}]");
    let wall =
        |rest: &str| format!("{WALL}solid = [{{ kind = 'revolve', profile = 'wall'{rest} }}]");
    vec![
        solid("kind = 'torus', major = 3, minor = 1"),
        solid("kind = 'torus', major = 3, minor = 1, axis = { direction = [1, 2, 3] }"),
        solid("kind = 'sphere', radius = 2"),
        solid("kind = 'cylinder', radius = 1, height = 2"),
        solid("kind = 'cylinder', radius = 1, height = 2, axis = { direction = [1, 0, 0] }"),
        solid(
            "kind = 'cone', radius1 = 2, radius2 = 0, height = 3, axis = { direction = [0, 1, 1] }",
        ),
        wall(""),
        wall(", axis = { direction = [3, 1, 2] }"),
        wall(", axis = { origin = [1e3, 1e-3, 7], direction = [0, 1, 0] }"),
        wall(", angle = 90"),
        wall(", angle = 270, axis = { direction = [1, -2, 3] }"),
    ]
}

/// Grids that hold the solid tightly, so that faces lie in the sides of cells, and shifted ones.
fn cells(of: &Assembly, count: u32, room: f64) -> impl Iterator<Item = (DVec3, DVec3)> {
    let bounds = of.bounds();
    let low = bounds.min - room * bounds.sides();
    let sides = (1.0 + 2.0 * room) * bounds.sides() / f64::from(count);
    (0..count.pow(3)).map(move |n| {
        let place = [n % count, n / count % count, n / count / count];
        (
            low + sides * (DVec3::from_array(place.map(f64::from)) + 0.5),
            sides,
        )
    })
}

#[test]
fn sheets_of_turned_bodies_are_what_circles_say() {
    for text in turned() {
        let of = assembly(&text);
        let body = single(&of);
        let turned = body.turned_region().expect("a turned body");
        let (mut seen, mut near, mut worst) = (0, 0, 0.0_f64);
        for (count, room) in [(8, 0.0), (16, 0.0), (11, 0.07)] {
            for (n, (centre, sides)) in cells(&of, count, room).enumerate() {
                let inside = body.contains(centre);
                if body.distance(centre, inside, 1e9) > 0.5 * sides.length() || n % 3 != 0 {
                    continue;
                }
                near += 1;
                for complement in [false, true] {
                    let Some(a) =
                        body.sheet_cell(complement, (centre, inside != complement), sides, GOAL)
                    else {
                        continue;
                    };
                    seen += 1;
                    let b = cut_cell(turned, complement, centre, sides, 1e-11);
                    let faces = [sides.y * sides.z, sides.z * sides.x, sides.x * sides.y];
                    let largest = faces.iter().fold(0.0, |m: f64, f| m.max(*f));
                    let within = a.error + b.error + 1e-11;
                    let mut hold = |x: f64, y: f64, unit: f64, what: &str| {
                        let off = (x - y).abs() / unit;
                        worst = worst.max(off);
                        assert!(
                            off <= within,
                            "{text}: {what} of {centre} / {sides} ({complement}): {x} {y}\n{a:?}\n{b:?}"
                        );
                    };
                    hold(a.volume, b.volume, 1.0, "volume");
                    hold(a.area, b.area, 3.0 * largest, "area");
                    for c in 0..3 {
                        hold(a.first[c], b.first[c], 1.0, "moment");
                        hold(a.sides[c][0], b.sides[c][0], 1.0, "lower side");
                        hold(a.sides[c][1], b.sides[c][1], 1.0, "upper side");
                        hold(a.boundary[c], b.boundary[c], 3.0 * largest, "boundary");
                        hold(a.normal[c], b.normal[c], 3.0 * largest, "normal");
                    }
                }
            }
        }
        eprintln!("{seen} of {}, off by {worst:.1e}: {text}", 2 * near);
        assert!(seen > 30, "{text}");
    }
}

/// The share of the one sheet of a turned body in a cell.
fn share(body: &Body, centre: DVec3, sides: DVec3) -> Option<Integral> {
    let Some(Swept::Sheet(net, region, axis)) = swept(body.turned_region()?, sides, centre) else {
        return None;
    };
    let found = share_of_patch(&net, axis, &region, 1e-9)?;
    let Integral { value, error } = found.share;
    let value = if found.is_solid? { value } else { 1.0 - value };
    Some(Integral { value, error })
}

#[test]
fn shares_of_tilted_sheets_are_those_of_sections() {
    for text in turned() {
        let of = assembly(&text);
        let body = single(&of);
        let (mut seen, mut worst, mut claimed) = (0, 0.0_f64, 0.0_f64);
        for (count, room) in [(6, 0.0), (13, 0.1), (24, 0.0)] {
            for (n, (centre, sides)) in cells(&of, count, room).enumerate() {
                let inside = body.side(centre) != Side::Outside;
                if body.distance(centre, inside, 1e9) > 0.5 * sides.length() || n % 5 != 0 {
                    continue;
                }
                let shape = body.voxel_shape(sides);
                if let Some(share) = share(body, centre, sides) {
                    let other = body.fraction_within(&shape, centre, &[], 1e-11);
                    let off = (share.value - other.value).abs();
                    assert!(
                        off <= share.error + other.error + 1e-12,
                        "{text}: {centre} / {sides}: {share:?} {other:?}"
                    );
                    (worst, claimed) = (worst.max(off), claimed.max(share.error));
                    seen += 1;
                }
            }
        }
        eprintln!("{seen}, off by {worst:.1e}, claimed {claimed:.1e}: {text}");
        assert!(seen > 50, "{text}");
    }
}

/// A block of two patches, and one whose faces are exactly in the planes of the grid.
const BLOCKS: [&str; 3] = [
    "solid = [{ kind = 'volume', patches = [{ degrees = [2, 1, 2],
        knots = [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1], [0, 0, 0, 1, 1, 1]],
        points = [[0, 0, 0], [10, 0, -2], [20, 0, 0], [0, 15, 0], [10, 15, 0], [20, 16, 0],
          [-3, 0, 6], [10, -2, 6], [20, 0, 7], [0, 15, 6], [11, 15, 6], [20, 16, 7],
          [0, 0, 12], [10, 0, 13], [20, 0, 12], [0, 15, 12], [10, 15, 12], [20, 16, 14]],
        weights = [1, 1, 1, 1, 1, 1, 1, 2, 1, 1, 1, 0.75, 1, 1, 1, 1, 1, 1] }] }]",
    "solid = [{ kind = 'volume', patches = [{ degrees = [1, 1, 1],
        knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]],
        points = [[0, 0, 0], [8, 0, 0], [0, 8, 0], [8, 8, 0], [0, 0, 8], [8, 0, 8], [0, 8, 8], [8, 8, 6]] }] }]",
    "solid = [{ kind = 'volume', axis = { direction = [1, 1, 1] }, patches = [{ degrees = [1, 1, 1],
        knots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]],
        points = [[0, 0, 0], [8, 0, 0], [0, 8, 0], [8, 8, 0], [0, 0, 8], [8, 0, 8], [0, 8, 8], [8, 8, 8]] }] }]",
];

#[test]
fn rows_of_sheets_are_what_the_surface_s_integral_says() {
    for text in BLOCKS {
        let of = assembly(text);
        let body = single(&of);
        let (mut sheets, mut others, mut worst) = (0, 0, 0.0_f64);
        for (count, room) in [(4, 0.0), (8, 0.0), (16, 0.0), (7, 0.08)] {
            let cells: Vec<(DVec3, DVec3)> = cells(&of, count, room).collect();
            for (n, row) in cells.chunks(count as usize).enumerate() {
                let (first, sides) = row[0];
                let shape = body.voxel_shape(sides);
                let rows = body.row_sheets(&shape, first, row.len()).expect("rows");
                for (i, (centre, _)) in row.iter().enumerate() {
                    let inside = body.side(*centre) != Side::Outside;
                    let far = body.distance(*centre, inside, 1e9);
                    assert!(
                        rows.may_touch(i) || far >= 0.5 * sides.min_element() * (1.0 - 1e-9),
                        "{text}: {centre} is {far} from the surface"
                    );
                    if !rows.may_touch(i) || (n + i) % 5 != 0 {
                        continue;
                    }
                    let Some((share, is_sheet)) = rows.share(i, inside, 1e-9) else {
                        continue;
                    };
                    *(if is_sheet { &mut sheets } else { &mut others }) += 1;
                    let other = body.fraction_within(&shape, *centre, &[], 1e-10);
                    let off = (share.value - other.value).abs();
                    worst = worst.max(off);
                    assert!(
                        off <= share.error + other.error,
                        "{text}: {centre} / {sides}: {share:?} {other:?}"
                    );
                }
            }
        }
        eprintln!("{sheets} sheets, {others} others, off by {worst:.1e}");
        assert!(sheets > 50, "{text}");
    }
}
