//! Solids that are images of trivariate NURBS volumes.
//!
//! The solid is the union of the images of all Bézier cells, a closed set. Nothing is known of it but its nets, so
//! that one moved by hand is answered as one made by [`construct`](crate::construct). Membership comes from the
//! cells, distances and crossings from the faces that bound them:
//!
//! ```text
//!   cells      the volumes' Bézier cells in double-double, relative to a common centre
//!   shared     which faces of cells are interior, collapsed or outer
//!   leaf       parts of cells on which the map is certified one to one, and a box tree over them
//!   newton     the one root in such a part, with a bound
//!   invert     membership and preimages
//!   turned     volumes proved to be turned about an axis: preimages one parameter at a time, by
//!              arc (angles), monotone (heights) and section (the half-plane, a disc)
//!   net        nets of Bernstein coefficients
//!   face*      the faces of cells that are not shared and not collapsed, with a tree over their parts
//!   distance   the nearest point of them, certified
//!   line       where a line may meet them
//!   bounds     how far they reach along a direction
//! ```
//!
//! Which point of the parameters a point of space comes from is asked of [`Cells`], where the surface is of a
//! [`FaceSet`]. A cylinder has six outer faces, four of them quarters of its wall:
//!
//! ```
//! use glam::DVec3;
//! use voxlathe::construct::{AngleInterval, AxisFrame, Construction, DiscForm, cylinder_volume};
//! use voxlathe::patch::{Cells, FaceSet};
//!
//! let by = Construction::CurveDisc(DiscForm::Biquadratic);
//! let volumes = [cylinder_volume(2.0, 3.0, by, AngleInterval::FULL, &AxisFrame::WORLD)?];
//! let cells = Cells::new(&volumes)?;
//! let p = DVec3::new(0.5, -0.25, 1.5);
//! let from = cells.invert(p).expect("it is inside");
//! let back = DVec3::from_array(volumes[from.volume].evaluate(from.parameters)?);
//! assert!(back.distance(p) < 1e-14);
//! assert!((from.parameters[0] - 0.5).abs() < 1e-15); // u runs along z
//! assert_eq!(cells.invert(DVec3::new(1.5, 1.5, 1.0)), None);
//!
//! let faces = FaceSet::new(&volumes)?;
//! assert_eq!(faces.faces().len(), 6);
//! let nearest = faces.nearest(DVec3::new(3.0, 4.0, 1.0)).expect("there are faces");
//! assert!((nearest.distance - 3.0).abs() < 1e-14);
//! assert!(nearest.foot.distance(DVec3::new(1.2, 1.6, 1.0)) < 1e-7);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What may share a face: cells of one volume, its two ends where it closes on itself, and patches whose faces have
//! the same net after refinement. Shared faces are no boundary, nor are those collapsed to a line or a point.
//! Patches that overlap otherwise are each counted, and each one's faces bound it.

mod arc;
mod bounds;
mod cells;
mod distance;
mod face;
mod face_match;
mod face_net;
mod face_set;
#[cfg(test)]
mod face_testing;
mod face_tree;
mod invert;
mod leaf;
mod line;
mod monotone;
mod net;
mod newton;
mod section;
mod shared;
mod turned;

pub use cells::Cells;
pub use face::{End, OuterFace, outer_faces};
pub(crate) use face_set::FacePart;
pub use face_set::{FaceSet, NearestFace};
pub use invert::Preimage;
