//! One solid of a scene by itself.

use super::body::Body;
use super::revolved::Revolved;
use super::surface_point::SurfacePoint;
use super::turn::Turn;
use crate::math::{Aabb, Similarity};
use crate::region::Region;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// What a solid does with what the solids before it have made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Operation {
    /// Joins it.
    #[default]
    Add,
    /// Takes itself away.
    Subtract,
    /// Leaves only what it holds itself.
    Intersect,
}

/// One placed solid, and what it does to the solids before it.
#[derive(Debug, Clone)]
pub struct Part {
    name: String,
    material: u32,
    operation: Operation,
    /// What is turned, where something is.
    region: Option<Arc<Region>>,
    body: Arc<Body>,
}

impl Part {
    /// A solid, to be added.
    #[must_use]
    pub fn new(name: String, material: u32, body: Body) -> Self {
        Self {
            name,
            material,
            operation: Operation::Add,
            region: None,
            body: Arc::new(body),
        }
    }

    /// A region turned about the third axis of `frame` (local lengths in scene units), to be added.
    #[must_use]
    pub fn revolved(
        name: String,
        material: u32,
        region: Arc<Region>,
        frame: &Similarity,
        turn: Turn,
    ) -> Self {
        let frame = frame.with_local_unit(region.unit());
        let section = region.section().clone();
        let body = Body::Revolved(Revolved::new(frame, turn, section));
        Self {
            region: Some(region),
            ..Self::new(name, material, body)
        }
    }

    /// The part with another operation.
    #[must_use]
    pub fn with_operation(self, operation: Operation) -> Self {
        Self { operation, ..self }
    }

    /// The part's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The part's material id.
    #[must_use]
    pub fn material(&self) -> u32 {
        self.material
    }

    /// What the part does to those before it.
    #[must_use]
    pub fn operation(&self) -> Operation {
        self.operation
    }

    /// The part's solid.
    #[must_use]
    pub fn body(&self) -> &Arc<Body> {
        &self.body
    }

    /// The region that is turned, with what it became.
    pub(super) fn turned(&self) -> Option<(&Region, &Revolved)> {
        Some((self.region.as_deref()?, self.body.revolved()?))
    }

    /// Height and radius of a point about the part's axis, (r, z) in scene units before the part was placed; `None` of a
    /// part that no region was turned to.
    pub(crate) fn meridian_point(&self, point: DVec3) -> Option<[f64; 2]> {
        let (region, body) = self.turned()?;
        let local = body.frame().to_local(point).point * region.unit();
        Some([local.x.hypot(local.y), local.z])
    }

    /// Whether a point of the part's surface is on a flat cap of a partial turn.
    pub(crate) fn is_on_cap(&self, at: &SurfacePoint) -> bool {
        /// How far, as a share of the distance from the axis, a point may be off the plane of a cap.
        const TOUCH: f64 = 1e-9;
        let Some(body) = self.body.revolved() else {
            return false;
        };
        let Turn::Partial(wedge) = body.turn() else {
            return false;
        };
        let frame = body.frame();
        let p = frame.to_local(at.point).point;
        let normal = frame.vector_to_local(at.normal);
        let (flat, normal) = (DVec2::new(p.x, p.y), DVec2::new(normal.x, normal.y));
        wedge.directions().iter().any(|d| {
            let is_near = flat.dot(*d) >= 0.0 && flat.perp_dot(*d).abs() <= TOUCH * flat.length();
            // On the edge of a cap the normal is across neither.
            is_near && normal.perp_dot(*d).abs() > normal.dot(*d).abs()
        })
    }

    /// The smallest box around the part, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.body.bounds()
    }

    /// What a user should know about the part's profile.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        self.region.as_deref().map_or(&[], Region::warnings)
    }

    /// Whether the closed part holds the point.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        self.body.contains(point)
    }
}
