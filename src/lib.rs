//! Exact voxel grids and signed distances of solids of revolution given by NURBS profiles, and of trivariate
//! NURBS volumes.
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
//!     │         │         │ │        │
//!     │         │         │ └─ patch └─ grid              picture draws scenes
//!     │         │         │      │
//!   exchange ───┴── nurbs ───────┘
//!   construct ────────┘
//!                   math
//! ```
//!
//! Text to solids:
//!
//! * [`scene`]: text, TOML or JSON, to plain data with the place of every value, then to solids.
//! * [`nurbs`]: knot vectors, basis functions and their cache; curves, surfaces and volumes; refinement, Bézier
//!   pieces and cells; Jacobian determinants with a certified sign, and integrals of them.
//! * [`construct`]: exact circles, discs, spheres, and solids of revolution as trivariate NURBS.
//! * [`exchange`]: curves, surfaces and volumes from and to the files of other programs.
//!
//! Families of solids. [`solid::Body`] is one of them, and answers for all: which side of it a point is on, how
//! far its surface is, where a row of voxels may change sides, what share of a voxel it fills, its moments.
//!
//! | body | what it is | answered by |
//! |---|---|---|
//! | [`solid::Revolved`] | a region turned about an axis; torus, cylinder, cone and sphere, too | [`region`], in the half-plane |
//! | [`solid::Ellipsoid`] | three half axes | its quadratic form |
//! | [`solid::Block`] | three side lengths | intervals |
//! | [`solid::Patches`] | images of trivariate NURBS | [`patch`], from the nets |
//!
//! * [`region`]: a profile's curves as bi-monotone rational pieces; membership by crossings,
//!   certified closest points, the boundary of the filled region, its moments as line integrals; the boundary as arcs,
//!   a quadtree of where the distance to them is smooth, and tables of it along one height.
//! * [`patch`]: images of trivariate NURBS: membership by certified point inversion, and the faces that bound
//!   them, for distances and rows.
//! * [`solid`]: bodies placed and joined; bounds, volume, area, centroid and inertia, row spans, volume fractions
//!   of voxels.
//!
//! Solids to files and pictures:
//!
//! * [`mesh`]: the boundary of a body as triangles with a proven chord error; crossings of rays, winding numbers
//!   and nearest points of triangles, for checks.
//! * [`grid`]: where the voxels are; it knows no geometry.
//! * [`sample`]: layers of occupancy, fraction, distance, material, and of the parameters and fields of volumes.
//! * [`validate`]: the exact answers held against the triangles, the field against what a distance is.
//! * [`converge`]: how the samples approach the solid as voxels become smaller.
//! * [`picture`]: shaded views, sections and contact sheets, from the exact distance.
//! * [`page`]: one HTML page that shows a solid, its voxels and its numbers; the frame of reports.
//! * [`io`]: stacks in nine formats with their manifest, tables of points, files of triangles; it knows no geometry.
//! * [`guide`]: pages for users of the command.
//! * [`math`]: double-double numbers, Bernstein polynomials, quadrature, discs and polygons.
//!
//! A volume goes the whole way in a few lines: made by construction, written and read, turned into a scene, asked.
//!
//! ```
//! use glam::DVec3;
//! use voxlathe::construct::{AngleInterval, AxisFrame, Construction, torus_volume};
//!
//! let torus = torus_volume(3.0, 1.0, Construction::SurfaceCircle, AngleInterval::FULL, &AxisFrame::WORLD)?;
//! let folder = tempfile::tempdir()?;
//! voxlathe::exchange::write_volumes(folder.path().join("torus.g2"), &[torus])?;
//! let scene = folder.path().join("torus.toml");
//! std::fs::write(&scene, "schema = 1\n[[solid]]\nkind = 'volume'\nfile = 'torus.g2'\n")?;
//!
//! let scene = voxlathe::Scene::load(&scene)?;
//! let solid = scene.assembly();
//! assert!(solid.contains(DVec3::new(0.0, 3.5, 0.25)));
//! assert!((solid.signed_distance(DVec3::ZERO) - 2.0).abs() < 1e-14);
//! let exact = 6.0 * std::f64::consts::PI.powi(2);
//! assert!((scene.exact_volume().expect("one solid").value - exact).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is exact, and how
//!
//! The solid is that of the f64 numbers in the scene. Every decision of membership is made in f64
//! with a bound on the rounding and, where the bound does not decide, in double-double; no
//! tolerance takes part beyond the one that calls a point at 2^-88 of the profile on its boundary.
//! Distances are minima over all stationary points of rational pieces, isolated by the signs of
//! Bernstein coefficients. Voxels of one solid of revolution take theirs from tables that are proved to be within a few
//! 1e-5 of a voxel: distances to arcs that are proved near the profile, in cubics or circles with a bound. Fractions are
//! integrals of closed-form areas. Volume, area and moments are line integrals along the profile in double-double, with
//! estimates of their errors. Nothing is sampled.
//!
//! For a volume the net is the solid: points are inverted in Bézier cells that are halved until the map is proved one
//! to one, and roots at faces are found again in double-double; distances are certified minima over the outer faces;
//! volume and moments are integrals of Jacobian determinants, area that of the faces' normals, each with its estimate.

#[cfg(feature = "cli")]
pub mod cli;
pub mod construct;
pub mod converge;
pub mod error;
pub mod exchange;
pub mod grid;
pub mod guide;
pub mod io;
pub mod math;
pub mod mesh;
pub mod nurbs;
pub mod page;
pub mod patch;
pub mod picture;
pub mod region;
pub mod sample;
pub mod scene;
pub mod solid;
pub mod validate;
mod work;

pub use error::Error;
pub use scene::Scene;

/// The README's examples compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
