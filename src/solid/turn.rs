//! How far a profile is turned.

use crate::math::Side;
use crate::math::tolerance::{ON_BOUNDARY, U};
use crate::math::{Dd, Real};
use glam::DVec2;

/// The middle of a wedge, and half the angle turned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HalfTurn {
    /// Unit direction in the middle of the turn, in the plane normal to the axis.
    pub(crate) middle: [f64; 2],
    pub(crate) sin: f64,
    pub(crate) cos: f64,
}

/// A full turn, or the wedge between two half-planes.
#[derive(Debug, Clone, PartialEq)]
pub enum Turn {
    /// 360 degrees.
    Full,
    /// Less than 360 degrees, counter-clockwise seen from the tip of the axis.
    Partial(Wedge),
}

/// The wedge from a start to an end direction in the plane normal to the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Wedge {
    start: [Dd; 2],
    end: [Dd; 2],
    /// Angle turned, in degrees.
    degrees: f64,
    /// Where the turn starts, in degrees.
    from: Dd,
}

impl Turn {
    /// A turn by `degrees` (not 0, at most 360 either way; negative: clockwise) from `from` degrees.
    #[must_use]
    pub fn new(from: f64, degrees: f64) -> Self {
        if degrees.abs() >= 360.0 {
            return Self::Full;
        }
        let direction = |a: Dd| {
            let (s, c) = a.sin_cos_degrees();
            [c, s]
        };
        let [mut start, mut end] = [Dd::of(from), Dd::sum(from, degrees)];
        if degrees < 0.0 {
            std::mem::swap(&mut start, &mut end);
        }
        Self::Partial(Wedge {
            start: direction(start),
            end: direction(end),
            degrees: degrees.abs(),
            from: start,
        })
    }

    /// The mirror image in the plane of the zero angle and the axis.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let image = |[c, s]: [Dd; 2]| [c, -s];
        match self {
            Self::Full => Self::Full,
            Self::Partial(w) => Self::Partial(Wedge {
                start: image(w.end),
                end: image(w.start),
                degrees: w.degrees,
                from: -(w.from + Dd::of(w.degrees)),
            }),
        }
    }

    /// The angle turned, in degrees.
    #[must_use]
    pub fn degrees(&self) -> f64 {
        match self {
            Self::Full => 360.0,
            Self::Partial(w) => w.degrees,
        }
    }

    /// The angle turned, in radians.
    #[must_use]
    pub fn radians(&self) -> f64 {
        match self {
            Self::Full => std::f64::consts::TAU,
            Self::Partial(w) => w.degrees.to_radians(),
        }
    }
}

impl Turn {
    /// Half the angle turned in radians, its sine and its cosine.
    pub(super) fn half(&self) -> (Dd, Dd, Dd) {
        let half = Dd::of(0.5 * self.degrees());
        let (sin, cos) = half.sin_cos_degrees();
        (half * Dd::PI / Dd::of(180.0), sin, cos)
    }

    /// Either half of the wedge; `None` of a full turn.
    pub(crate) fn halves(&self) -> Option<HalfTurn> {
        let (_, sin, cos) = self.half();
        (*self != Self::Full).then(|| HalfTurn {
            middle: self.middle().map(Real::f64),
            sin: sin.f64(),
            cos: cos.f64(),
        })
    }

    /// The direction in the middle of the turn.
    pub(super) fn middle(&self) -> [Dd; 2] {
        match self {
            Self::Full => [Dd::ONE, Dd::ZERO],
            Self::Partial(w) => {
                let (s, c) = (w.from + Dd::of(0.5 * w.degrees)).sin_cos_degrees();
                [c, s]
            }
        }
    }
}

impl Wedge {
    /// The angle turned, in degrees.
    #[must_use]
    pub fn degrees(&self) -> f64 {
        self.degrees
    }

    /// Where the turn starts, in degrees.
    #[must_use]
    pub fn from(&self) -> f64 {
        self.from.f64()
    }

    /// Unit vectors along the two caps.
    #[must_use]
    pub fn directions(&self) -> [DVec2; 2] {
        [self.start, self.end].map(|d| DVec2::new(d[0].f64(), d[1].f64()))
    }

    /// The same in double-double.
    #[must_use]
    pub fn directions_exact(&self) -> [[Dd; 2]; 2] {
        [self.start, self.end]
    }

    /// Whether the wedge is larger than half a turn.
    #[must_use]
    pub fn is_reflex(&self) -> bool {
        self.degrees > 180.0
    }

    fn combine(&self, left_of_start: bool, right_of_end: bool) -> bool {
        if self.is_reflex() {
            left_of_start || right_of_end
        } else {
            left_of_start && right_of_end
        }
    }

    /// Whether the closed wedge holds a point known to within `error`; `None` where that does not
    /// decide.
    pub(crate) fn contains(&self, p: DVec2, error: f64) -> Option<bool> {
        let [s, e] = self.directions();
        let bound = 2.0 * error + 8.0 * U * (p.x.abs() + p.y.abs());
        let (a, b) = (s.perp_dot(p), p.perp_dot(e));
        if a.abs() <= bound || b.abs() <= bound {
            // One side alone may already decide.
            let (sure_a, sure_b) = (a.abs() > bound, b.abs() > bound);
            return match self.is_reflex() {
                true if sure_a && a > 0.0 || sure_b && b > 0.0 => Some(true),
                false if sure_a && a < 0.0 || sure_b && b < 0.0 => Some(false),
                _ => None,
            };
        }
        Some(self.combine(a > 0.0, b > 0.0))
    }

    /// The side of a point; a cap's plane is met to within double-double.
    pub(crate) fn side_exact(&self, p: [Dd; 2]) -> Side {
        let cross = |a: [Dd; 2], b: [Dd; 2]| a[0] * b[1] - a[1] * b[0];
        let half_plane = |v: Dd| match v.f64() {
            v if v.abs() <= ON_BOUNDARY => Side::On,
            v if v > 0.0 => Side::Inside,
            _ => Side::Outside,
        };
        let (a, b) = (
            half_plane(cross(self.start, p)),
            half_plane(cross(p, self.end)),
        );
        if self.is_reflex() { a.max(b) } else { a.min(b) }
    }
}
