//! The share of a voxel, less what half-spaces take, that a solid of rational patches fills: by the height of one smooth
//! sheet of the outer faces over a side of the voxel ([`height`]), else the surface integral of [`flux`] over them.

use super::flux::{self, Net, Place};
use super::height;
use super::patches::Patches;
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use crate::patch::FacePart;
use glam::DVec3;
use smallvec::SmallVec;

/// Parts of faces that pass a row of voxels, each about as large as a voxel.
///
/// They are cut once for the row, and for its layer before: what is left for a voxel starts from what is near it.
#[derive(Debug)]
pub(crate) struct RowSheets {
    /// In the voxels' sides, from the centre of the first.
    parts: Vec<Part>,
    /// For each voxel the parts that may come into it.
    near: Vec<SmallVec<[u32; 4]>>,
}

/// A part of a face.
#[derive(Debug, Clone)]
struct Part {
    face: u32,
    /// Where it begins in the face's parameters, and its sides there.
    low: [f64; 2],
    sides: [f64; 2],
    net: Net,
}

/// Sides of a part, in voxels, below which it is not cut.
const SMALL: f64 = 1.5;
/// Parts are halved so often at most, and a row has so many more parts than voxels at most.
const HALVINGS: u32 = 40;
const MOST: usize = 8;

impl RowSheets {
    /// Whether the surface may come into voxel `i`.
    pub(crate) fn may_touch(&self, i: usize) -> bool {
        !self.near[i].is_empty()
    }

    /// The share of voxel `i`, with a proved bound of its error; `None` where that is above `goal`.
    ///
    /// * `inside`: whether the centre is in the solid.
    pub(crate) fn share(&self, i: usize, inside: bool, goal: f64) -> Option<(Integral, bool)> {
        let near = &self.near[i];
        let part = |n: &u32| &self.parts[*n as usize];
        let empty = Integral {
            value: f64::from(u8::from(inside)),
            error: 0.0,
        };
        let Some(first) = near.first().map(part) else {
            return Some((empty, true));
        };
        if near.iter().all(|n| part(n).face == first.face)
            && let Some(found) = self.sheet(i, goal)
        {
            let Integral { value, error } = found.share;
            let share = match found.is_solid {
                None => empty,
                Some(below) => {
                    let value = if below { value } else { 1.0 - value };
                    Integral {
                        value: value.clamp(0.0, 1.0),
                        error,
                    }
                }
            };
            return Some((share, true));
        }
        let nets: Vec<Net> = self
            .parts
            .iter()
            .map(|part| seen_from(&part.net, i))
            .collect();
        let share = flux::share_along(0, &nets, goal);
        (share.error <= goal).then(|| {
            let value = share.value.clamp(0.0, 1.0);
            (Integral { value, ..share }, false)
        })
    }

    /// What is below the one face that comes into voxel `i`.
    fn sheet(&self, i: usize, goal: f64) -> Option<height::Below> {
        let near = || self.near[i].iter().map(|n| &self.parts[*n as usize]);
        let far = |part: &Part| {
            let bounds = seen_from(&part.net, i).bounds();
            let middle = bounds.map(|[low, high]| 0.5 * (low + high));
            middle.iter().map(|c| c * c).sum::<f64>()
        };
        // The part whose middle is nearest.
        let one = near().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let to_part = |k: usize, at: f64| (at - one.low[k]) / one.sides[k];
        let region = height::Region {
            domain: [0, 1].map(|k| [0.0, 1.0].map(|at| to_part(k, at))),
            parts: [0, 1].map(|k| {
                let ranges = near().map(|p| [p.low[k], p.low[k] + p.sides[k]]);
                let whole = ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], [c, d]| {
                    [a.min(c), b.max(d)]
                });
                whole.map(|at| to_part(k, at))
            }),
        };
        height::share_of_patch(&seen_from(&one.net, i), one.net.across(), &region, goal)
    }

    /// Cuts a part until it is small or beside the row, of `count` voxels.
    fn cut(&mut self, part: Part, count: f64, halvings: u32) {
        let [x, y, z] = part.net.bounds();
        let room = 0.5 + part.net.slack + 1e-9;
        let beside = |[low, high]: [f64; 2]| low > room || high < -room;
        if beside(y) || beside(z) || x[0] > count - 1.0 + room || x[1] < -room {
            return;
        }
        let small = [x, y, z].iter().all(|[low, high]| high - low <= SMALL);
        let many = self.parts.len() >= MOST * self.near.len() + 64;
        if small || many || halvings == 0 {
            self.parts.push(part);
            return;
        }
        let k = part.net.longer();
        for (n, mut net) in part.net.split(k, 0.5).into_iter().enumerate() {
            // Means of neighbours, one a level of the degree.
            let [x, y, z] = [x, y, z].map(|[low, high]| low.abs().max(high.abs()));
            let levels = if k == 0 {
                net.degrees[0]
            } else {
                net.degrees[1]
            };
            net.slack += 0.5 * f64::EPSILON * levels_of(levels) * x.max(y).max(z);
            let (mut low, mut sides) = (part.low, part.sides);
            sides[k] *= 0.5;
            if n == 1 {
                low[k] += sides[k];
            }
            let half = Part {
                face: part.face,
                low,
                sides,
                net,
            };
            self.cut(half, count, halvings - 1);
        }
    }
}

/// A net from the centre of voxel `i`.
fn seen_from(net: &Net, i: usize) -> Net {
    #[allow(clippy::cast_precision_loss, reason = "a place in a row")]
    let at = i as f64;
    let points = net.points.iter();
    Net {
        points: points
            .map(|h| [h[0] - at * h[3], h[1], h[2], h[3]])
            .collect(),
        ..net.clone()
    }
}

#[allow(clippy::cast_precision_loss, reason = "a degree")]
fn levels_of(degree: usize) -> f64 {
    degree as f64
}

impl Patches {
    /// The parts of the outer faces that pass a row of voxels along x.
    pub(super) fn row_sheets(&self, sides: DVec3, first: DVec3, count: usize) -> RowSheets {
        #[allow(clippy::cast_precision_loss, reason = "a count of voxels")]
        let long = count as f64;
        let frame = self.frame();
        let edges = DVec3::AXES.map(|e| frame.vector_to_local(e * sides));
        let local = frame.to_local(first + DVec3::X * (0.5 * (long - 1.0) * sides.x));
        let row = [edges[0] * long, edges[1], edges[2]];
        let row = Place::new(row, local.point, local.error);
        let local = frame.to_local(first);
        let place = Place::new(edges, local.point, local.error);
        let ahead = row.centre() - place.centre();
        let mut sheets = RowSheets {
            parts: Vec::new(),
            near: vec![SmallVec::new(); count],
        };
        let keep = |middle: DVec3, half| row.may_touch(middle - ahead, half);
        self.faces().parts(place.centre(), keep, |part| {
            if part.outward != 0 {
                let whole = Part {
                    face: part.face,
                    low: part.low,
                    sides: part.sides,
                    net: net_of(&place, part),
                };
                sheets.cut(whole, long, HALVINGS);
            }
        });
        for (n, part) in (0..).zip(&sheets.parts) {
            let [low, high] = part.net.bounds()[0];
            let room = 0.5 + part.net.slack + 1e-9;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "kept within the row"
            )]
            let [from, to] = [(low - room).ceil(), (high + room).floor()]
                .map(|x| x.clamp(0.0, long - 1.0) as usize);
            for near in &mut sheets.near[from..=to] {
                near.push(n);
            }
        }
        sheets
    }

    /// The share within the half-spaces, which are given from the voxel's centre, with a bound of its error: at most
    /// `goal`, or what the budget reaches.
    pub(super) fn fraction_within(
        &self,
        sides: DVec3,
        centre: DVec3,
        spaces: &[HalfSpace],
        goal: f64,
    ) -> Integral {
        let frame = self.frame();
        let edges = DVec3::AXES.map(|e| frame.vector_to_local(e * sides));
        let local = frame.to_local(centre);
        let place = Place::new(edges, local.point, local.error);
        let mut nets = Vec::new();
        let keep = |middle, half| place.is_in_line(middle, half);
        self.faces().parts(place.centre(), keep, |part| {
            if part.outward != 0 {
                nets.push(net_of(&place, part));
            }
        });
        let scale = frame.scale();
        let spaces = spaces
            .iter()
            .map(|s| place.space(frame.vector_to_local(s.normal) * scale, s.offset / scale));
        let spaces: SmallVec<[HalfSpace; 8]> = spaces.collect();
        flux::share(&nets, &spaces, goal)
    }
}

/// A part of a face in a voxel's coordinates.
fn net_of(place: &Place, part: &FacePart<'_>) -> Net {
    let points = part.points.iter();
    let points = points.map(|h| [h[0] * part.unit, h[1] * part.unit, h[2] * part.unit, h[3]]);
    let outward = f64::from(part.outward);
    place.net(part.degrees, points, part.origin, outward, part.slack)
}
