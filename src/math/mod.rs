//! Numbers only: no geometry type of a solid, no grid, no file.

pub mod bernstein;
pub mod dd;
pub mod disc;
pub mod gauss;
pub mod quadrature;
pub mod similarity;
pub mod tetrahedra;
pub mod tolerance;

mod aabb;
mod root;
mod side;
mod simd;

pub use aabb::Aabb;
pub use dd::{Dd, Real};
pub(crate) use root::root;
pub use side::Side;
#[cfg(test)]
pub(crate) use simd::every_kernel;
pub use simd::{Kernel, SimdLevel, SimdUnavailable};
pub use similarity::Similarity;
