//! Exact voxel grids and signed distances of solids of revolution given by NURBS profiles.
//!
//! ```no_run
//! let scene = voxlathe::Scene::load("scenes/torus.toml")?;
//! let grid = scene.grid()?;
//! let sdf = voxlathe::sample::signed_distance(&scene, &grid)?; // Volume<f32>
//! voxlathe::io::exr::write_stack("out", &grid, &[("sdf", &sdf)])?;
//! # Ok::<(), voxlathe::Error>(())
//! ```
//!
//! # Tour
//!
//! Scene text becomes solids, solids meet a grid layer by layer, layers become files.
//!
//! ```text
//!                          ┌─────> mesh ─────┐
//!   scene ──> region ──> solid ──> sample ──> io          cli drives them all
//!               │          │         │
//!             nurbs        │        grid
//!               └── math ──┘              picture draws scenes
//! ```
//!
//! * [`scene`]: text, TOML or JSON, to plain data with the place of every value, then to solids.
//! * [`nurbs`]: knot vectors, basis functions and their cache, curves, refinement, Bézier pieces.
//! * [`construct`]: exact circles, discs, spheres, and solids of revolution as trivariate NURBS.
//! * [`exchange`]: curves, surfaces and volumes from and to the files of other programs.
//! * [`patch`]: solids that are images of trivariate NURBS: membership by certified point inversion, the
//!   faces that bound them.
//! * [`region`]: a profile's curves as bi-monotone rational pieces; membership by crossings,
//!   certified closest points, the boundary of the filled region, its moments as line integrals.
//! * [`solid`]: regions turned about an axis, placed and joined; bounds, volume, area, centroid and inertia,
//!   row spans, volume fractions of voxels.
//! * [`mesh`]: the boundary of a body as triangles with a proven chord error; crossings of rays, winding numbers
//!   and nearest points of triangles, for checks.
//! * [`grid`]: where the voxels are; it knows no geometry.
//! * [`sample`]: layers of occupancy, fraction, distance and material.
//! * [`validate`]: the exact answers held against the triangles, the field against what a distance is.
//! * [`converge`]: how the samples approach the solid as voxels become smaller.
//! * [`picture`]: shaded views, sections and contact sheets, from the exact distance.
//! * [`io`]: the EXR stack with its manifest, tables of points, files of triangles; it knows no geometry.
//! * [`math`]: double-double numbers, Bernstein polynomials, quadrature, discs and polygons.
//!
//! # What is exact, and how
//!
//! The solid is that of the f64 numbers in the scene. Every decision of membership is made in f64
//! with a bound on the rounding and, where the bound does not decide, in double-double; no
//! tolerance takes part beyond the one that calls a point at 2^-88 of the profile on its boundary.
//! Distances are minima over all stationary points of rational pieces, isolated by the signs of
//! Bernstein coefficients. Fractions are integrals of closed-form areas. Volume, area and moments are line integrals along the
//! profile in double-double, with estimates of their errors. Nothing is sampled.

#[cfg(feature = "cli")]
pub mod cli;
pub mod construct;
pub mod converge;
pub mod error;
pub mod exchange;
pub mod grid;
pub mod io;
pub mod math;
pub mod mesh;
pub mod nurbs;
pub mod patch;
pub mod picture;
pub mod region;
pub mod sample;
pub mod scene;
pub mod solid;
pub mod validate;

pub use error::Error;
pub use scene::Scene;

/// The README's examples compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
