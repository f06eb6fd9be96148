//! What a scene may hold at most, each with its reason.
//!
//! The limits keep hostile input from exhausting memory or the stack, and keep every later product
//! and quotient of scene numbers inside the range of f64. Real scenes stay orders of magnitude inside.

/// Bytes of scene text, and of all point files of a scene together. A tree of values is at most some twenty times its
/// densest text, so this also bounds the memory that reading takes.
pub const MAX_TEXT_BYTES: usize = 64 << 20;

/// Keys of one table; only those that name things, as materials do, are as many as they like.
pub const MAX_KEYS: usize = 100_000;

/// Tables of one text, arrays of tables and inline ones included: a table takes some hundred bytes, whatever it is
/// written with.
pub const MAX_TABLES: usize = 1_000_000;

/// Solids of one scene: each is held against all others before the first voxel, which takes some ten seconds here.
pub const MAX_SOLIDS: usize = 4096;

/// Nesting of arrays and tables. A scene needs eight; the reader recurses once per level.
pub(super) const MAX_DEPTH: usize = 64;

/// Bytes of a TOML text that is read a second time, by the `toml` crate, for what it says of a slip. It takes seventy
/// times as much.
pub(super) const MAX_EXPLAINED: usize = 128 << 10;

/// Stack of the thread that does so: the crate goes into brackets to 80 levels, and into dotted keys to as many at each.
/// The memory is touched only as far as it is used.
pub(super) const TOML_STACK_BYTES: usize = 64 << 20;

/// Segments of a `--set` path.
pub(super) const MAX_SET_SEGMENTS: usize = 32;

/// Files of points and of splines that one scene names.
pub(super) const MAX_FILES: usize = 100_000;

/// Points read from files by one scene, all curves together, so that a short scene that names one
/// long file many times stays bounded.
pub const MAX_FILE_POINTS: usize = 1_000_000;

/// Magnitude of coordinates, lengths, knots and angles. Cubes of it stay finite (1e300), so that
/// volumes do; a length beyond it is a slip.
pub const MAX_MAGNITUDE: f64 = 1e100;

/// Least magnitude of a length, a factor or a direction: its cube stays a normal number.
pub const MIN_MAGNITUDE: f64 = 1e-100;

/// Degree of a curve. Bernstein coefficients of a product of two curves have binomials of twice the
/// degree, and those of 64 still fit f64 to the last digit that matters.
pub const MAX_DEGREE: usize = 32;

/// Voxels along one side of a grid: what an OpenEXR window can number.
pub const MAX_VOXELS: u32 = i32::MAX as u32;

/// Least sine of the angle between an axis and its zero-angle direction. Below it the direction left
/// after projecting has fewer than seven digits.
pub const MIN_SINE: f64 = 1e-9;

/// Bézier cells of one volume, all patches together: they take some 10 kB and a quarter of a
/// millisecond each to prepare.
pub const MAX_CELLS: usize = 100_000;

/// Bézier coefficients of one volume, all cells of all patches together: a cell of degree 32 has 35 937
/// of them, of some hundred bytes each, whatever few control points it came from.
pub const MAX_COEFFICIENTS: usize = 1 << 23;

/// Ratio of the largest to the least weight of one Bézier cell. Beyond it the rounding of the largest,
/// times a point near the least, is more than the distances asked for.
pub(super) const MAX_WEIGHT_RATIO: f64 = 1e12;

/// Least length of an ellipsoid or a box as a share of its largest: squares of the quotient keep half of
/// their digits.
pub const MIN_ASPECT: f64 = 1e-8;

/// Characters of the name of a scene, profile, solid or material: names go into file headers.
pub const MAX_NAME: usize = 255;

/// Characters of a value that an error repeats.
pub(super) const MAX_SHOWN: usize = 60;

/// Characters of a word for which a nearest name is looked up; comparing longer ones takes time and
/// helps nobody.
pub(super) const MAX_HINTED: usize = 64;
