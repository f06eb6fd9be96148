//! Surfaces as families of lines: what integrals over the faces of a composite run along.
//!
//! ```text
//!   ∬ f dA = ∫ dt ∫ f(x(t, s)) |n(t, s)| ds        n = ∂x/∂t × ∂x/∂s, outward
//! ```
//!
//! A patch of a body's surface gives for each parameter t a path in s, with the normal along it.

use super::patches::FaceLine;
use super::path::Path;
use glam::DVec3;
use std::sync::Arc;

/// One patch of a body's surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Patch {
    /// Which of the body's pieces or faces.
    pub(super) number: usize,
    /// For a turned region: `None` for what the piece sweeps; else the cap, 0 or 1.
    pub(super) cap: Option<usize>,
}

impl Patch {
    /// A patch of a body without caps.
    pub(super) fn face(number: usize) -> Self {
        Self { number, cap: None }
    }
}

/// A ball around a part of a patch: its radius is the sum of both lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cover {
    pub(super) centre: DVec3,
    /// What the part adds to the radius across the lines, in scene units.
    pub(super) across: f64,
    /// And along them.
    pub(super) along: f64,
}

/// A line on a patch with what its integrals need.
pub(super) struct Rule {
    pub(super) path: Path,
    /// The paths a hair outward and inward of the body.
    pub(super) beside: [Path; 2],
    pub(super) range: [f64; 2],
    pub(super) normal: Normal,
    pub(super) area: Area,
}

/// Area per unit of both parameters.
#[derive(Debug, Clone, Copy)]
pub(super) enum Area {
    /// The same all along the line, with a sign where areas are taken from each other.
    Even(f64),
    /// The length of the normal.
    OfNormal,
}

/// A normal outward of the body, its length the area per unit of both parameters.
#[derive(Debug, Clone)]
pub(super) enum Normal {
    /// `u cos s + v sin s + along`.
    Turning { u: DVec3, v: DVec3, along: DVec3 },
    /// The same all along the line.
    Fixed(DVec3),
    /// That of a rational patch, or its opposite.
    Face { line: Arc<FaceLine>, sign: f64 },
}

impl Normal {
    pub(super) fn at(&self, s: f64) -> DVec3 {
        match self {
            Self::Turning { u, v, along } => {
                let (sin, cos) = s.sin_cos();
                *u * cos + *v * sin + *along
            }
            Self::Fixed(n) => *n,
            Self::Face { line, sign } => line.normal(s) * *sign,
        }
    }
}

impl Rule {
    /// Area per unit of both parameters, where the normal is `normal`.
    pub(super) fn area(&self, normal: DVec3) -> f64 {
        match self.area {
            Area::Even(area) => area,
            Area::OfNormal => normal.length(),
        }
    }

    /// Whether the integrands are polynomials, of the line's parameter or of its sine and cosine.
    pub(super) fn is_polynomial(&self) -> bool {
        matches!(self.area, Area::Even(_))
    }
}
