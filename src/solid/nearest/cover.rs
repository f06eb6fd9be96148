//! Boxes around what of a body's surface may be on the composite's boundary, and around what may not.
//!
//! Each sheet is divided into tiles until a tile is all visible or all hidden: no other surface comes as near to its
//! middle as the tile reaches, or only such as are the same surface all over the tile. Tiles along edges are divided to a
//! share of the composite's size and count as both.
//!
//! All of this is asked for by threads that sample, and made by the first of them, in turn: one that made it in parallel
//! would take up another's layer while it waits for the rest, and wait there for itself.

use super::boxes::{Boxes, away};
use super::sheet::{Sheet, Tile};
use super::visible::{Scene, Spot};
use crate::math::Aabb;

/// Reach of the tiles along edges, as a share of the composite's size.
const FINE: f64 = 1.0 / 256.0;
/// Reach of hidden tiles: boxes around larger ones would hold much that is visible.
const COARSE: f64 = 1.0 / 32.0;
/// Tiles looked at of all sheets together; what is left of a sheet's share is not divided.
const MOST_TILES: usize = 1_000_000;

/// Shortest side of a body's box, as a share of the composite's size, below which nothing is said to be empty.
const SLENDER: f64 = 1e-2;

/// One body's boxes.
#[derive(Debug)]
pub(super) struct Cover {
    /// Around what may be hidden.
    pub(super) hidden: Boxes,
    /// Around what may be visible.
    pub(super) visible: Boxes,
}

enum Sort {
    Visible,
    Hidden,
    Either,
}

/// The covers of all bodies.
pub(super) fn covers(scene: &Scene) -> Vec<Cover> {
    let sheets = 0..scene.sheets.len();
    let parts: Vec<[Vec<Aabb>; 2]> = sheets.map(|i| divide(scene, i)).collect();
    let of_body = |b: usize| {
        let mut all = [Vec::new(), Vec::new()];
        for (sheet, part) in scene.sheets.iter().zip(&parts) {
            if sheet.body == b {
                for k in 0..2 {
                    all[k].extend_from_slice(&part[k]);
                }
            }
        }
        let [hidden, visible] = all.map(Boxes::new);
        Cover { hidden, visible }
    };
    (0..scene.bodies.len()).map(of_body).collect()
}

/// Whether no sheet is seen anywhere: neither as a tile nor in the middle of one that is not told. Not where a body is so
/// slender that tiles may have passed over what is left of it.
pub(super) fn are_hidden(scene: &Scene) -> bool {
    let slender = |b: &Aabb| b.sides().min_element() < SLENDER * scene.size;
    if scene.bodies.iter().any(|b| slender(&b.bounds())) {
        return false;
    }
    let is_hidden = |index: usize| {
        let sheet = &scene.sheets[index];
        let mut hidden = true;
        divide_with(scene, index, |tile, sort| {
            hidden &= match sort {
                Sort::Visible => false,
                Sort::Hidden => true,
                Sort::Either => !spot(scene, sheet, tile).is_some_and(|s| scene.is_visible(s)),
            };
        });
        hidden
    };
    (0..scene.sheets.len()).all(is_hidden)
}

/// The boxes of the tiles of a sheet that may be hidden, and of those that may be visible.
fn divide(scene: &Scene, index: usize) -> [Vec<Aabb>; 2] {
    let sheet = &scene.sheets[index];
    let room = 1e-9 * scene.size;
    let mut out = [Vec::new(), Vec::new()];
    divide_with(scene, index, |tile, sort| {
        let bounds = sheet.tile_box(tile);
        let bounds = Aabb {
            min: bounds.min - room,
            max: bounds.max + room,
        };
        if !matches!(sort, Sort::Visible) {
            out[0].push(bounds);
        }
        if !matches!(sort, Sort::Hidden) {
            out[1].push(bounds);
        }
    });
    out
}

/// Calls `each` with the tiles that a sheet is divided into.
fn divide_with(scene: &Scene, index: usize, mut each: impl FnMut(&Tile, Sort)) {
    let sheet = &scene.sheets[index];
    let fine = FINE * scene.size;
    let share = (MOST_TILES / scene.sheets.len()).min(MOST_TILES / 20);
    let mut work = std::collections::VecDeque::from([Tile::ALL]);
    let mut seen = 0;
    while let Some(tile) = work.pop_front() {
        seen += 1;
        let sides = sheet.reach(&tile);
        let reach = sides[0].hypot(sides[1]);
        let sort = sort(scene, index, &tile, reach);
        let large = match sort {
            Sort::Visible => f64::INFINITY,
            Sort::Hidden => COARSE * scene.size,
            Sort::Either => fine,
        };
        if reach > large && seen < share {
            work.extend(tile.halves(usize::from(sides[1] > sides[0])));
        } else {
            each(&tile, sort);
        }
    }
}

/// The middle of a tile, where that is well within the sheet's borders.
fn spot(scene: &Scene, sheet: &Sheet, tile: &Tile) -> Option<Spot> {
    let point = sheet.point(tile.middle());
    let within = sheet.margin(point) > 4.0 * scene.hair();
    let normal = sheet.value(point).1.try_normalize().filter(|_| within)?;
    Some(Spot {
        point,
        normal,
        body: sheet.body,
    })
}

fn sort(scene: &Scene, index: usize, tile: &Tile, reach: f64) -> Sort {
    let sheet = &scene.sheets[index];
    let x = sheet.point(tile.middle());
    if sheet.margin(x) < -reach {
        // Beyond a cap's region there is no surface.
        return Sort::Hidden;
    }
    let reach = reach + scene.hair();
    for (b, body) in scene.bodies.iter().enumerate() {
        if b == sheet.body || away(&body.bounds(), x) > reach {
            continue;
        }
        if scene.distance(b, x, reach) < reach && !same_all_over(scene, index, b, x, reach) {
            return Sort::Either;
        }
    }
    match spot(scene, sheet, tile) {
        Some(spot) if scene.is_visible(spot) => Sort::Visible,
        Some(_) => Sort::Hidden,
        None => Sort::Either,
    }
}

/// Whether what of a body comes near is the sheet's own surface, further than the reach from its borders.
fn same_all_over(scene: &Scene, index: usize, body: usize, x: glam::DVec3, reach: f64) -> bool {
    let mut found = false;
    for (k, other) in scene.sheets.iter().enumerate() {
        if other.body != body || away(&other.bounds, x) >= reach {
            continue;
        }
        let margin = other.margin(x);
        let near = other.value(x).0.abs() < reach && margin > -reach;
        if !near {
            continue;
        }
        if !scene.same[index].contains(&k) || margin <= reach {
            return false;
        }
        found = true;
    }
    found
}
