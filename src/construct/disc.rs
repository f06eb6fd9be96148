//! Discs and sectors as rational tensor-product surfaces in the plane z = 0.
//!
//! ```text
//!   biquadratic, 3 x 3     points                            weights      s = √2 / 2
//!     v = 0     (-s,-s)  (0,-2s)  (s,-s)                     1 s 1
//!               (-2s,0)  (0,0)    (2s,0)                     s 1 s
//!     v = 1     (-s,s)   (0,2s)   (s,s)                      1 s 1
//!
//!   polar, degree 1 x 2    D(a, t) = a c(t)                  c the circle, or an arc for a sector
//! ```
//!
//! Each edge of the biquadratic disc is a quarter of the rim. Its Jacobian is 4 at the centre,
//! 8 (√2 - 1) at the middle of an edge and 0 at the four corners alone, where both tangents lie along the
//! rim. The polar disc's is a (c × c'), 0 on the whole edge a = 0, which is the centre. So the
//! biquadratic disc has the better centre, the polar one a full rim, sectors and angles.
//!
//! The reference point `W_00` of a construction has to be (1, 0). The polar disc's rim starts there; the
//! biquadratic disc's first corner is at 225 degrees, and the *turned* disc is that disc times
//! (-s, s), a turn by 135 degrees.
//!
//! * Shapes: nets with the first index along the row (biquadratic) or from the centre out (polar).
//! * Units: centres and radii in model units, angles in degrees; all domains are [0, 1].
//! * Accuracy: control points in double-double, rounded once.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §7.3 for the rims; the biquadratic disc is the
//!   Bézier patch on the square with four quarter circles as its edges.

use super::circle::{Rim, Weighted, complex_product, half_root};
use super::{AngleInterval, ConstructError, check_length};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsSurface};

/// Which disc a curve is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DiscForm {
    /// 3 x 3 control points, degree 2 x 2: regular at the centre, full turns only.
    Biquadratic,
    /// Radius times circle, degree 1 x 2: any turn.
    #[default]
    Polar,
}

/// A planar net in double-double, about the origin, first index fastest.
#[derive(Debug, Clone)]
pub(super) struct Disc {
    pub(super) knots: [KnotVector; 2],
    pub(super) net: Vec<Weighted>,
}

impl Disc {
    /// The unit disc whose reference point is at the turn's start, or its sector.
    pub(super) fn new(form: DiscForm, turn: AngleInterval) -> Result<Self, ConstructError> {
        match form {
            DiscForm::Polar => Self::polar(turn),
            DiscForm::Biquadratic if turn.angle() == 360.0 => {
                let upright = Self::upright()?;
                let (sin, cos) = (Dd::of(turn.start()) + Dd::of(135.0)).sin_cos_degrees();
                Ok(upright.times([cos, sin]))
            }
            DiscForm::Biquadratic => Err(ConstructError::TurnOfForm {
                form: "a biquadratic disc",
                angle: turn.angle(),
                wanted: "360",
            }),
        }
    }

    /// The biquadratic disc with its first corner at 225 degrees.
    fn upright() -> Result<Self, ConstructError> {
        let s = half_root();
        let (o, d) = (Dd::ZERO, s + s);
        let (one, corner) = (Dd::ONE, s);
        let net = vec![
            ([-s, -s], one),
            ([o, -d], corner),
            ([s, -s], one),
            ([-d, o], corner),
            ([o, o], one),
            ([d, o], corner),
            ([-s, s], one),
            ([o, d], corner),
            ([s, s], one),
        ];
        Ok(Self {
            knots: [KnotVector::bezier(2)?, KnotVector::bezier(2)?],
            net,
        })
    }

    fn polar(turn: AngleInterval) -> Result<Self, ConstructError> {
        let rim = Rim::new(super::CircleForm::Quadratic, turn)?;
        let center = [Dd::ZERO; 2];
        let spoke = |&(p, w): &Weighted| [(center, w), (p, w)];
        Ok(Self {
            net: rim.net.iter().flat_map(spoke).collect(),
            knots: [KnotVector::bezier(1)?, rim.knots],
        })
    }

    /// Every point times the complex number.
    fn times(mut self, factor: [Dd; 2]) -> Self {
        for (p, _) in &mut self.net {
            *p = complex_product(*p, factor);
        }
        self
    }

    fn to_surface(&self, center: [f64; 2], radius: f64) -> Result<NurbsSurface, ConstructError> {
        check_length("the radius", radius)?;
        let place = |&(p, _): &Weighted| {
            let at = |i: usize| (Dd::of(center[i]) + Dd::of(radius) * p[i]).f64();
            [at(0), at(1), 0.0]
        };
        Ok(NurbsSurface::new(
            self.knots.clone(),
            self.net.iter().map(place).collect(),
            self.net.iter().map(|(_, w)| w.f64()).collect(),
        )?)
    }
}

/// The biquadratic disc in the plane z = 0, its edges parallel to the axes: the first corner is at 225
/// degrees, u runs along x and v along y.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::biquadratic_disc;
/// let disc = biquadratic_disc([0.0, 0.0], 1.0)?;
/// let [x, y, z] = disc.evaluate([0.25, 0.5])?;
/// assert!((x + 0.5).abs() < 1e-15 && y.abs() < 1e-15 && z == 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn biquadratic_disc(center: [f64; 2], radius: f64) -> Result<NurbsSurface, ConstructError> {
    Disc::upright()?.to_surface(center, radius)
}

/// The biquadratic disc in the plane z = 0 turned so that its first corner, the reference point of
/// constructions, is at angle `start`.
///
/// * `start`: degrees.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Turn`] where `start` is not finite;
/// [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::biquadratic_disc_turned;
/// let disc = biquadratic_disc_turned([0.0, 0.0], 3.0, 0.0)?;
/// assert_eq!(disc.control_points()[0], [3.0, 0.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn biquadratic_disc_turned(
    center: [f64; 2],
    radius: f64,
    start: f64,
) -> Result<NurbsSurface, ConstructError> {
    let turn = AngleInterval::new(start, 360.0)?;
    Disc::new(DiscForm::Biquadratic, turn)?.to_surface(center, radius)
}

/// The disc in the plane z = 0 as radius times the nine-point circle: the first parameter runs from the
/// centre out, the second round.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
pub fn polar_disc(center: [f64; 2], radius: f64) -> Result<NurbsSurface, ConstructError> {
    sector(center, radius, AngleInterval::FULL)
}

/// The sector in the plane z = 0 over the turn, as radius times arc.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::{AngleInterval, sector};
/// let quarter = sector([0.0, 0.0], 2.0, AngleInterval::new(0.0, 90.0)?)?;
/// assert_eq!(quarter.evaluate([0.5, 1.0])?, [0.0, 1.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sector(
    center: [f64; 2],
    radius: f64,
    turn: AngleInterval,
) -> Result<NurbsSurface, ConstructError> {
    Disc::polar(turn)?.to_surface(center, radius)
}
