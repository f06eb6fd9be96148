//! Solids given by trivariate rational splines: their outer faces, and distances, lines and bounds
//! taken from those.

mod bounds;
mod distance;
mod face;
mod face_match;
mod face_net;
mod face_set;
#[cfg(test)]
mod face_testing;
mod face_tree;
mod line;

pub use face::{End, OuterFace, outer_faces};
pub use face_set::{FaceSet, NearestFace};
