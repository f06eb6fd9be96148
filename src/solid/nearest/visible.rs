//! Whether a point of a body's surface is on the boundary of the composite.
//!
//! It is where the composite differs beside it. The sides of most bodies are those of the point itself: their surfaces
//! are further than the places asked. Of the others each place asks again, so that faces that coincide count as they
//! lie: on the same side, or back to back.
//!
//! Lengths, as shares of the composite's size:
//!
//! ```text
//!   TOUCH  1e-13   surfaces nearer than this count as meeting at the point
//!   HAIR   2e-12   how far beside the point is asked, less where a surface that does not meet it is nearer
//!   ASIDE  1e-5    where surfaces that only touch at the point are told apart
//! ```
//!
//! What is thinner than a hair may be missed or taken for more. The boundary then passes within a hair of the point that
//! is called visible, and no point that is further than a hair from a change of the composite is; distances differ by
//! no more.

use super::super::body::Body;
use super::super::terms::Term;
use super::boxes::away;
use super::sheet::Sheet;
use crate::math::Side;
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;

const TOUCH: f64 = 1e-13;
const HAIR: f64 = 2e-12;
const ASIDE: f64 = 1e-5;
/// Directions that faces are unlikely to lie along.
const ASKEW: [[f64; 3]; 3] = [
    [0.51, 0.29, 0.81],
    [-0.37, 0.86, -0.35],
    [0.77, -0.53, -0.36],
];

/// A point of the surface of one body, with its normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub(super) point: DVec3,
    /// A unit vector, of either sign.
    pub(super) normal: DVec3,
    pub(super) body: usize,
}

/// The bodies of a composite about its middle, and what it is of them.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) bodies: Vec<Arc<Body>>,
    pub(super) terms: Vec<Term>,
    pub(super) sheets: Vec<Sheet>,
    /// For each sheet those of other bodies that are on the same surface.
    pub(super) same: Vec<Vec<usize>>,
    /// The longest side of the box of all bodies.
    pub(super) size: f64,
}

/// How a body's surface is to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Near {
    /// Far: one side all around.
    Far(Side),
    /// Through the point, or nearly.
    Here,
}

/// The bodies about a point.
struct Around {
    near: SmallVec<[Near; 16]>,
    /// How far the places beside the point are.
    step: f64,
    /// Whether surfaces other than those given meet the point.
    met: bool,
}

/// Unit vectors across a normal, all around it, none of them along an axis as a rule.
fn directions(normal: DVec3) -> impl Iterator<Item = DVec3> {
    const COUNT: u32 = 8;
    let e = normal.any_orthonormal_vector();
    let f = normal.cross(e);
    (0..COUNT).map(move |k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4 + 0.1).sin_cos();
        e * cos + f * sin
    })
}

impl Scene {
    /// Surfaces nearer than this count as meeting.
    pub(super) fn touch(&self) -> f64 {
        TOUCH * self.size
    }

    pub(super) fn hair(&self) -> f64 {
        HAIR * self.size
    }

    /// Unsigned distance to the surface of a body, or the limit.
    pub(super) fn distance(&self, body: usize, x: DVec3, limit: f64) -> f64 {
        let body = &*self.bodies[body];
        if away(&body.bounds(), x) >= limit {
            return limit;
        }
        body.distance(x, body.side(x) != Side::Outside, limit)
    }

    /// The interior of the composite, where no side is `On`.
    fn holds(&self, side: impl Fn(usize) -> Side) -> bool {
        let within = |term: &Term| {
            let mut factors = term.factors.iter();
            factors.all(|f| f.side(side(f.body)) == Side::Inside)
        };
        self.terms.iter().any(within)
    }

    /// The bodies about a point that is on the surfaces of the bodies `own`.
    fn around(&self, x: DVec3, own: &[usize]) -> Around {
        let hair = self.hair();
        let limit = 4.0 * hair;
        let (mut step, mut met) = (hair, false);
        let near = self.bodies.iter().enumerate().map(|(b, body)| {
            if own.contains(&b) {
                return Near::Here;
            }
            if away(&body.bounds(), x) > limit {
                return Near::Far(Side::Outside);
            }
            let side = body.side(x);
            let distance = body.distance(x, side != Side::Outside, limit);
            if distance >= limit {
                return Near::Far(side);
            }
            if distance > self.touch() {
                step = step.min(0.3 * distance);
                return Near::Far(side);
            }
            met = true;
            Near::Here
        });
        let near = near.collect();
        Around { near, step, met }
    }

    /// Whether the composite holds a place; `None` where it is on the surface of a body, so that what is beside it
    /// tells.
    fn state(&self, around: &Around, x: DVec3) -> Option<bool> {
        let sides: SmallVec<[Side; 16]> = (around.near.iter().enumerate())
            .map(|(b, near)| match near {
                Near::Far(side) => *side,
                Near::Here => self.bodies[b].side(x),
            })
            .collect();
        (!sides.contains(&Side::On)).then(|| self.holds(|b| sides[b]))
    }

    /// Whether the composite holds a place, or one just beside it where a face passes through.
    fn holds_beside(&self, around: &Around, x: DVec3) -> bool {
        let aside = ASKEW.map(|d| x + DVec3::from_array(d) * (0.1 * around.step));
        let places = std::iter::once(x).chain(aside);
        (places.filter_map(|x| self.state(around, x)).next()).unwrap_or_default()
    }

    /// Whether the composite's boundary passes a spot.
    pub(super) fn is_visible(&self, spot: Spot) -> bool {
        let around = self.around(spot.point, &[spot.body]);
        if !around.met {
            // Nothing else is there: even the tip of a crack that is thinner than a hair counts.
            let with = |own: Side| {
                self.holds(|b| match around.near[b] {
                    Near::Far(side) => side,
                    Near::Here => own,
                })
            };
            return with(Side::Inside) != with(Side::Outside);
        }
        self.differs(&around, &spot) || self.differs_aside(&around, &spot)
    }

    fn differs(&self, around: &Around, spot: &Spot) -> bool {
        let differs = |aside: DVec3| {
            let place = |sign: f64| spot.point + aside + spot.normal * (sign * around.step);
            Some(self.state(around, place(1.0))? != self.state(around, place(-1.0))?)
        };
        // Where a face passes through a place, as faces that are flush do, both its sides are asked.
        differs(DVec3::ZERO).unwrap_or_else(|| {
            let mut all = directions(spot.normal).map(|d| d * (0.5 * around.step));
            all.any(|aside| differs(aside) == Some(true))
        })
    }

    /// Where a surface that meets the spot has the same tangent plane there, what is between the two is nothing at the
    /// spot, but may be something beside it.
    #[cold]
    fn differs_aside(&self, around: &Around, spot: &Spot) -> bool {
        if !self.touches_any(around, spot) {
            return false;
        }
        let aside = ASIDE * self.size;
        directions(spot.normal).any(|direction| {
            let place = spot.point + direction * aside;
            let body = &self.bodies[spot.body];
            let foot = body.foot(place, body.side(place) != Side::Outside);
            let Some(point) = foot.filter(|p| p.distance(place) <= 0.1 * aside) else {
                return false;
            };
            let spot = Spot { point, ..*spot };
            let around = self.around(point, &[spot.body]);
            self.differs(&around, &spot)
        })
    }

    /// Whether a sheet of another body touches the one that the spot is on, and is not the same surface.
    fn touches_any(&self, around: &Around, spot: &Spot) -> bool {
        let here = |&i: &usize| {
            let sheet = &self.sheets[i];
            around.near[sheet.body] == Near::Here && self.touches(sheet, spot)
        };
        let all = || 0..self.sheets.len();
        let of_spot = |&i: &usize| self.sheets[i].body == spot.body;
        let own: SmallVec<[usize; 4]> = all().filter(of_spot).filter(here).collect();
        let same = |i: usize| own.iter().any(|&o| self.same[o].contains(&i));
        all().any(|i| !of_spot(&i) && here(&i) && !same(i))
    }

    /// Whether a sheet meets a spot with the same tangent plane.
    fn touches(&self, sheet: &Sheet, spot: &Spot) -> bool {
        let (value, gradient) = sheet.value(spot.point);
        value.abs() <= 4.0 * self.touch()
            && gradient.cross(spot.normal).length() <= 1e-3 * gradient.length()
            && sheet.margin(spot.point) >= -4.0 * self.touch()
    }

    /// Whether a face that meets an edge is visible beside it, though a surface that touches the face there leaves
    /// nothing at the edge itself.
    #[cold]
    fn is_cusp(&self, around: &Around, x: DVec3, normals: [DVec3; 2], bodies: [usize; 2]) -> bool {
        let along = normals[0].cross(normals[1]).normalize_or_zero();
        let aside = ASIDE * self.size;
        normals.into_iter().zip(bodies).any(|(normal, body)| {
            let here = Spot {
                point: x,
                normal,
                body,
            };
            if !self.touches_any(around, &here) {
                return false;
            }
            [-aside, aside].into_iter().any(|way| {
                let place = x + normal.cross(along) * way;
                let inside = self.bodies[body].side(place) != Side::Outside;
                let foot = self.bodies[body].foot(place, inside);
                foot.filter(|p| p.distance(place) <= 0.1 * aside)
                    .is_some_and(|point| {
                        let spot = Spot {
                            point,
                            normal,
                            body,
                        };
                        self.differs(&self.around(point, &[body]), &spot)
                    })
            })
        })
    }

    /// Whether the surfaces of two bodies make an edge of the composite where they cross, given the unit normals there.
    /// `crowded`: other surfaces go along the edge.
    pub(super) fn is_edge(
        &self,
        x: DVec3,
        [a, b]: [DVec3; 2],
        bodies: [usize; 2],
        crowded: bool,
    ) -> bool {
        let around = self.around(x, &bodies);
        let c = a.dot(b);
        // Each is along one normal and across the other.
        let (u, v) = (a - b * c, b - a * c);
        let state = |d: DVec3| {
            let d = d.normalize_or_zero();
            self.holds_beside(&around, x + d * around.step)
        };
        let [pp, pm, mp, mm] = [u + v, u - v, v - u, -u - v].map(state);
        if crowded || around.met {
            let e = a.normalize_or(DVec3::X);
            let f = u.cross(v).cross(e).normalize_or(e.any_orthonormal_vector());
            return pp != pm
                || pp != mp
                || pp != mm
                || (0..16).any(|k| {
                    let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 8.0 + 0.1).sin_cos();
                    state(e * cos + f * sin) != pp
                })
                || self.is_cusp(&around, x, [a, b], bodies);
        }
        let by_first = pp != mp || pm != mm;
        let by_second = pp != pm || mp != mm;
        by_first && by_second
    }
}
