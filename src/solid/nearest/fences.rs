//! What a sheet's borders lie on, as zero sets of smooth functions.
//!
//! A curve on a sheet is within its borders or beyond them all along, if it passes no fence.
//!
//! ```text
//!   swept line     the planes normal to it at its ends, turned
//!   swept circle   the radii at its ends, turned
//!   of a wedge     the half-planes that it turns between
//!   face           its four sides
//!   cap            the axis, and where other sheets of the body meet it
//!   swept curve    where other sheets of the body meet it
//! ```

use super::sheet::{Form, Jet, Profile, Sheet, over_axis};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// The zero set of one function, where another is at least 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fence {
    pub(super) across: Jet,
    pub(super) along: Option<Jet>,
}

#[derive(Debug)]
pub(super) struct Fences {
    pub(super) each: SmallVec<[Fence; 4]>,
    /// Whether the sheet ends nowhere else. Otherwise it does where other sheets of its body meet it, too.
    pub(super) are_all: bool,
}

/// Linear functions of the half-plane, with their gradients, that are 0 at the ends of a profile's piece.
fn ends(profile: &Profile, q: DVec2) -> Option<[(f64, DVec2); 2]> {
    match profile {
        Profile::Line {
            start,
            along,
            length,
        } => {
            let s = along.dot(q - *start);
            Some([(s, *along), (length - s, -*along)])
        }
        Profile::Circle { centre, ends, .. } => {
            let normals = ends.map(|p| (p - *centre).normalize_or_zero().perp());
            Some(normals.map(|n| (n.dot(q - *centre), n)))
        }
        Profile::Rational { .. } => None,
    }
}

impl Sheet {
    /// The fences about a point, with bounds that hold within `reach` of it.
    pub(super) fn fences(&self, x: DVec3, reach: f64) -> Fences {
        let q = self.place.local(x);
        let linear = |value: f64, gradient: DVec3| Jet {
            value,
            gradient: self.place.turned(gradient),
            bend: 0.0,
        };
        // Along a direction normal to the axis, and across it.
        let upright = |d: DVec2| {
            let across = DVec3::new(-d.y, d.x, 0.0);
            let along = d.extend(0.0);
            [across, along].map(|n| linear(n.dot(q), n))
        };
        let mut each = SmallVec::new();
        let mut fence = |across, along| each.push(Fence { across, along });
        let mut are_all = true;
        match &self.form {
            Form::Swept { profile, wedge, .. } => {
                let flat = DVec2::new(q.x, q.y);
                let (rho, out) = (flat.length(), flat.normalize_or(DVec2::X));
                let ends = ends(profile, DVec2::new(rho, q.z));
                are_all = ends.is_some();
                for (value, n) in ends.into_iter().flatten() {
                    let bend = over_axis(n.x, rho - reach);
                    let across = linear(value, (out * n.x).extend(n.y));
                    fence(Jet { bend, ..across }, None);
                }
                for direction in wedge.iter().flat_map(|w| w.directions()) {
                    let [across, along] = upright(direction);
                    fence(across, Some(along));
                }
            }
            Form::Face { half, axis, .. } => {
                for k in (0..3).filter(|k| k != axis) {
                    for sign in [-1.0, 1.0] {
                        fence(linear(sign * q[k] - half[k], DVec3::AXES[k] * sign), None);
                    }
                }
            }
            Form::Cap { direction, .. } => {
                are_all = false;
                fence(upright(*direction)[1], None);
            }
            Form::Ellipsoid { .. } => {}
        }
        Fences { each, are_all }
    }
}
