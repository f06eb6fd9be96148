//! What can be typed.

use super::failure::Failure;
use crate::math::{Kernel, SimdLevel};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Exact voxel grids and signed distances of solids of revolution given by NURBS profiles.
#[derive(Debug, Parser)]
#[command(
    name = "voxlathe",
    version,
    after_help = "\
Exit codes: 0 done; 1 a validation, comparison or digest failed; 2 bad usage or bad input;
3 input or output failed; 130 or 143 interrupted.

Example: voxlathe voxelize scenes/goblet.toml -o out/goblet --resolution 256",
    arg_required_else_help = true,
    subcommand_required = true
)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common,
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Args)]
pub(super) struct Common {
    /// Threads to use; all cores without it. The results do not depend on it
    #[arg(long, global = true, help_heading = "Common options", value_name = "N")]
    pub(super) threads: Option<NonZeroUsize>,
    /// Say nothing but errors
    #[arg(
        long,
        short,
        global = true,
        help_heading = "Common options",
        conflicts_with = "verbose"
    )]
    pub(super) quiet: bool,
    /// Say what is being done, on standard error
    #[arg(long, short, global = true, help_heading = "Common options")]
    pub(super) verbose: bool,
    /// When to colour what people read
    #[arg(long, global = true, help_heading = "Common options", value_name = "WHEN", value_enum, default_value_t = Color::Auto)]
    pub(super) color: Color,
    /// Instructions of the inner loops. The results do not depend on it
    #[arg(long, global = true, help_heading = "Common options", value_name = "LEVEL", value_enum, default_value_t = Simd::Auto)]
    pub(super) simd: Simd,
    /// Change a key of the scene, may be repeated: a dotted path with array indices from 0, and a
    /// value as TOML, else as a string (grid.resolution=64, solid.0.angle=270, units=mm)
    #[arg(
        long,
        global = true,
        help_heading = "Common options",
        value_name = "PATH=VALUE"
    )]
    pub(super) set: Vec<String>,
    /// Write one JSON document to standard output, and nothing else there
    #[arg(long, global = true, help_heading = "Common options")]
    pub(super) json: bool,
}

impl Common {
    /// The inner loops that were asked for.
    pub(super) fn kernel(&self) -> Result<Kernel, Failure> {
        let level = match self.simd {
            Simd::Auto => SimdLevel::Auto,
            Simd::Scalar => SimdLevel::Scalar,
            Simd::Avx2 => SimdLevel::Avx2,
            Simd::Avx512 => SimdLevel::Avx512,
        };
        Kernel::new(level).map_err(|e| Failure::usage(format!("--simd: {e}; choose auto")))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Simd {
    /// The widest this machine has
    Auto,
    /// One value at a time
    Scalar,
    /// AVX2
    Avx2,
    /// AVX-512
    Avx512,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Color {
    /// On a terminal, unless NO_COLOR is set
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Sample a scene into a stack of EXR images and a manifest
    Voxelize(Voxelize),
    /// Membership and signed distance at given points
    Query(Query),
    /// Exact volume, area, centroid, inertia tensor and bounds
    Measure(Measure),
    /// Compare inside tests and distances with the tessellated boundary
    Validate(Validate),
    /// Errors of volumes and distances over several resolutions, with fitted orders
    Converge(Converge),
    /// Write the tessellated boundary: .stl, .obj or .ply
    Mesh(Mesh),
    /// Write the solids as exact NURBS volumes: .g2, .mesh (MFEM), .json (geomdl) or .xml (G+Smo)
    Export(Export),
    /// Draw the solid, shaded or as a section with distance isolines
    Render(Render),
    /// Write one HTML page that shows the solid, its voxels and their values
    View(View),
    /// Measure each stage's throughput against writing the same bytes
    Bench(Bench),
    /// Show what a finished stack holds, and verify its digests
    Info(Info),
    /// Write a manual page, shell completions or the schema of scene files to standard output
    Generate(Generate),
}

#[derive(Debug, Args)]
#[command(after_help = "\
DIR/slice-0000.exr ... hold one z layer each: column = x, row = y, row 0 is the smallest y. The other formats are one
file for each channel (npy, nrrd, mhd, raw) or for all (vti, zarr, h5, vdb). Files appear under their final names only
when all are whole; DIR/manifest.json comes last. An output that ends in .vti, .nrrd, .npy, .h5, .vdb or .zarr is that
one file, without a manifest.

Examples: voxlathe voxelize scenes/torus.toml -o out/torus --channels occupancy,sdf --band 3
          voxlathe voxelize scenes/torus.toml -o out/torus --formats vti,zarr,vdb
          voxlathe voxelize scenes/torus.toml -o torus.vti")]
pub(super) struct Voxelize {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Directory to write, or one file: .vti, .nrrd, .npy, .h5, .vdb or .zarr
    #[arg(long, short, value_name = "DIR")]
    pub(super) output: PathBuf,
    #[command(flatten)]
    pub(super) step: Step,
    /// What to sample: occupancy, fraction, sdf, material
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(super) channels: Vec<String>,
    /// Formats to write: exr, vti, npy, nrrd, mhd, raw, zarr, vdb, h5
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(super) formats: Vec<String>,
    /// Of exr: none, rle, zips, zip, piz, pxr24 (24-bit floats: lossy) or auto
    #[arg(long, value_name = "KIND")]
    pub(super) compression: Option<String>,
    /// How .vti files hold their arrays
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub(super) vti_encoding: VtiFlag,
    /// Give .vti files values at points, the voxel centres, instead of cells
    #[arg(long)]
    pub(super) vti_points: bool,
    /// How .nrrd files hold their array
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub(super) nrrd_encoding: NrrdFlag,
    /// How .zarr chunks are compressed
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub(super) zarr_codec: ZarrFlag,
    /// How .h5 arrays are compressed
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub(super) h5_codec: H5Flag,
    /// Of all but occupancy and material, in npy, nrrd, mhd, raw, vti, zarr and h5
    #[arg(long, value_name = "TYPE", value_enum, default_value_t)]
    pub(super) precision: Precision,
    /// Clamp distances to this many voxels on both sides of the surface
    #[arg(long, value_name = "VOXELS", allow_negative_numbers = true)]
    pub(super) band: Option<f64>,
    /// Error allowed to a fraction, a share of the voxel, 1e-14 to 1e-2 [default: 1e-9]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub(super) fraction_error: Option<f64>,
    /// Most memory the process may take, as 512MiB, 2G or bytes; half of the machine's without it
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub(super) memory_limit: Option<u64>,
    /// Replace the stack in DIR: exactly the files its manifest lists, and stale slices; or the one file
    #[arg(long)]
    pub(super) force: bool,
    /// Say what would be written, and write nothing
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Draw preview.png, the solid, and preview-slices.png, nine of the slices, beside the stack
    #[arg(long)]
    pub(super) preview: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum VtiFlag {
    /// Appended as they are
    #[default]
    Raw,
    /// Appended in blocks of deflate
    Zlib,
    /// In the XML itself, for readers that take no appended data
    Base64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum NrrdFlag {
    /// As it is
    #[default]
    Raw,
    /// As a gzip stream
    Gzip,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum ZarrFlag {
    /// Not at all
    #[default]
    None,
    /// Zstandard
    Zstd,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum H5Flag {
    /// Not at all
    #[default]
    None,
    /// Deflate; needs the feature hdf5
    Gzip,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Precision {
    /// 32-bit floats
    #[default]
    F32,
    /// 64-bit floats
    F64,
}

/// Flags in place of the scene's resolution, spacing, origin and dims; its bounds stay.
#[derive(Debug, Args)]
pub(super) struct Step {
    /// Voxels along the longest side, or along each side as NX,NY,NZ
    #[arg(
        long,
        value_name = "N",
        value_delimiter = ',',
        num_args = 1,
        conflicts_with = "spacing"
    )]
    pub(super) resolution: Vec<u32>,
    /// Size of a voxel in scene units, or DX,DY,DZ
    #[arg(
        long,
        value_name = "D",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true
    )]
    pub(super) spacing: Vec<f64>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Without -o the table goes to standard output as CSV. A .npy file gets float64 of shape (n, columns).

Example: voxlathe query scenes/torus.toml --points points.csv --columns sdf")]
pub(super) struct Query {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Points: .csv (x,y,z on a line), .npy (float64, shape (n, 3)) or - for .csv on standard input
    #[arg(long, value_name = "FILE")]
    pub(super) points: PathBuf,
    /// File to write, .csv or .npy
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Columns: inside (0 or 1), sdf (signed distance in scene units, negative inside)
    #[arg(
        long,
        value_name = "A,B",
        value_delimiter = ',',
        default_value = "inside,sdf"
    )]
    pub(super) columns: Vec<Column>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Column {
    /// 1 inside, 0 outside
    Inside,
    /// Signed distance
    Sdf,
    /// 1 where the distance is exact, 0 where its size is a lower bound
    Certainty,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Each solid is measured by itself, then all together as the total. Line integrals along the profile, so nothing
depends on a grid; +- is an estimate of the absolute error that is not below it. Area counts the whole boundary, flat
caps included; inertia is about the centroid, for density 1.

Example: voxlathe measure scenes/goblet.toml --json")]
pub(super) struct Measure {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Every voxel centre is asked of the exact path, of a ray's crossings with the triangles and of their winding number.
Where they differ, the exact surface must lie within the triangles' chord error; then the distance is checked: finite,
of the right sign, no steeper than 1, of slope 1 away from the medial axis, zero where the triangles are.

Exit code 1 when a difference is not explained or a check fails.

Example: voxlathe validate scenes/goblet.toml --resolution 64 -o goblet.html")]
pub(super) struct Validate {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    #[command(flatten)]
    pub(super) step: Step,
    /// Look at this many random points of the grid's box instead of every voxel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(super) samples: Option<u64>,
    /// Largest distance between triangles and true surface, in scene units; a tenth of the smallest
    /// grid spacing without it
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub(super) chord_error: Option<f64>,
    /// Most memory the process may take, as 512MiB, 2G or bytes; half of the machine's without it
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub(super) memory_limit: Option<u64>,
    /// Page to write the report to, .html
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Volumes are compared with the exact one, distances as stored with those in f64; where the scene has a [reference],
everything is compared with that closed form. The volume by occupancy is a lattice count, so its order is fitted to the
mean over grids moved by parts of a voxel.

Example: voxlathe converge scenes/torus.toml --resolutions 16,32,64,128 -o out/convergence")]
pub(super) struct Converge {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Voxels along the longest side, one grid for each
    #[arg(
        long,
        value_name = "N,M",
        value_delimiter = ',',
        default_value = "16,32,64,128,256",
        value_parser = clap::value_parser!(u32).range(1..=MOST_CONVERGED)
    )]
    pub(super) resolutions: Vec<u32>,
    /// Moved grids that the error by occupancy is averaged over
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(0..=4096))]
    pub(super) offsets: u32,
    /// Most memory the process may take, as 512MiB, 2G or bytes; half of the machine's without it
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub(super) memory_limit: Option<u64>,
    /// Directory for converge.csv, converge.png and the page converge.html
    #[arg(long, short, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Replace the three files in DIR
    #[arg(long)]
    pub(super) force: bool,
}

/// Largest resolution of `converge`: its layers are held whole.
const MOST_CONVERGED: i64 = 4096;

#[derive(Debug, Args)]
#[command(after_help = "\
The mesh is closed, oriented outward and nowhere further from the true surface than the chord error, nor that from
the mesh. Solids that share axis and turn become one mesh; --parts writes each solid's own to FILE's stem, -, the
solid's name and the extension. STL has single precision; OBJ and PLY keep all digits.

Example: voxlathe mesh scenes/goblet.toml -o goblet.ply --chord-error 0.05")]
pub(super) struct Mesh {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// File to write, .stl, .obj or .ply
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Largest distance between mesh and true surface, in scene units; a tenth of the smallest grid
    /// spacing without it
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub(super) chord_error: Option<f64>,
    /// Write each solid's own mesh
    #[arg(long)]
    pub(super) parts: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Every kind of solid can be written but some that are revolved: their profile must be one chain to the axis along which z
never turns back. The file holds all patches of all solids in order, placed; what is subtracted or intersected can only be
written by itself, with --solid. Solids that overlap are written whole, so a reader of the file counts what they share
twice. A scene reads it back as kind = \"volume\", file = \"FILE\".

Example: voxlathe export scenes/cylinder.toml -o cylinder.g2")]
pub(super) struct Export {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// File to write, .g2 (GoTools), .mesh (MFEM), .json (geomdl) or .xml (G+Smo)
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Write only the solid of this name
    #[arg(long, value_name = "NAME")]
    pub(super) solid: Option<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Both kinds are drawn from the exact distance, not from voxels or a mesh. The shaded picture is orthographic with +z up,
so its scale bar holds everywhere; a section is to scale.

Examples: voxlathe render scenes/goblet.toml -o goblet.png --cut quarter
          voxlathe render scenes/goblet.toml -o section.png --slice y=0")]
pub(super) struct Render {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// File to write, .png
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Pixels along x, 1 to 16384; 1200 for a shaded picture, by the solid's shape for a section
    #[arg(long, value_name = "PIXELS")]
    pub(super) width: Option<usize>,
    /// Pixels along y, 1 to 16384; 900 for a shaded picture, by the solid's shape for a section
    #[arg(long, value_name = "PIXELS")]
    pub(super) height: Option<usize>,
    /// Where it is seen from, in degrees: azimuth from +x towards +y, elevation; -55,24 without it
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true,
        allow_hyphen_values = true,
        conflicts_with = "slice"
    )]
    pub(super) view: Vec<f64>,
    /// Cut away what is nearest to the camera, through the axis, to show the inside
    #[arg(long, value_name = "PART", value_enum, conflicts_with = "slice")]
    pub(super) cut: Option<CutKind>,
    /// Draw the section by a plane instead: x, y or z and its value in scene units, as z=0.5
    #[arg(long, value_name = "AXIS=VALUE")]
    pub(super) slice: Option<String>,
    /// Distance between isolines in scene units; a round one without it
    #[arg(
        long,
        value_name = "STEP",
        allow_negative_numbers = true,
        requires = "slice"
    )]
    pub(super) isolines: Option<f64>,
    /// Parameter lines between knots on the faces of volumes, 0 for none, 4 without it; those at the
    /// knots are stronger
    #[arg(long, value_name = "N", conflicts_with = "slice")]
    pub(super) lines: Option<usize>,
    /// Leave out scale bar, axes, names and colour bar
    #[arg(long)]
    pub(super) plain: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
The page needs no network and no other file: open it in a browser. It draws the surface, turns, cuts and slices it, and
shows the stored value of every channel under the pointer, with volume, area, bounds and digests beside it. It has 20 MB at
most and says what it leaves out. DIR is a finished stack with files of exr, npy, raw or mhd.

Examples: voxlathe view scenes/goblet.toml -o goblet.html --resolution 256
          voxlathe view out/goblet -o goblet.html")]
pub(super) struct View {
    /// The scene (TOML, JSON by its ending, or - for TOML on standard input), or the directory of a finished stack
    #[arg(value_name = "SCENE|DIR")]
    pub(super) source: PathBuf,
    /// File to write, .html
    #[arg(long, short, value_name = "PAGE.html")]
    pub(super) output: PathBuf,
    #[command(flatten)]
    pub(super) step: Step,
    /// Channels to show; those of the scene's output with sdf, or all of a stack, without it
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(super) channels: Vec<String>,
    /// Most memory the process may take, as 512MiB, 2G or bytes; half of the machine's without it
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub(super) memory_limit: Option<u64>,
    /// Replace the file
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CutKind {
    /// A quarter of the turn
    Quarter,
    /// The half in front
    Half,
}

impl CutKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Quarter => "quarter",
            Self::Half => "half",
        }
    }
}

#[derive(Debug, Args)]
#[command(
    after_help = "Exit code 1 when a file is missing, its digest differs, or the manifest says what the slices contradict."
)]
pub(super) struct Info {
    /// Directory of a finished stack
    #[arg(value_name = "DIR")]
    pub(super) directory: PathBuf,
    /// Print a line for each file: its size, digest and name
    #[arg(long)]
    pub(super) files: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Stages: prepare, occupancy, occupancy-slab, sdf, sdf-slab, sdf-band, fraction, basis, encode, write, voxelize. The
ratio says how fast a stage writes its bytes, compared with a plain fill of the whole grid's bytes by the same threads
in the same run.

Example: voxlathe bench scenes/goblet.toml --resolution 512 --stages occupancy,sdf")]
pub(super) struct Bench {
    /// The scene: TOML, JSON by its ending, or - for TOML on standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    #[command(flatten)]
    pub(super) step: Step,
    /// Stages to run; all without it
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(super) stages: Vec<String>,
}

#[derive(Debug, Args)]
pub(super) struct Generate {
    /// What to write
    #[arg(value_enum)]
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// Manual page (troff)
    Man,
    /// Completions for bash
    Bash,
    /// Completions for zsh
    Zsh,
    /// Completions for fish
    Fish,
    /// Completions for PowerShell
    Powershell,
    /// JSON Schema of scene files
    Schema,
}

/// A number of bytes: a number and a unit, 1024-based for KiB, MiB, GiB, TiB and the bare letters,
/// 1000-based for kB, MB, GB, TB.
fn parse_size(text: &str) -> Result<u64, String> {
    let wanted = || {
        format!(
            "{text:?} is not a size; write bytes, or a number with KiB, MiB, GiB, TiB, K, M, G, T, kB, MB, GB or TB"
        )
    };
    let split = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| wanted())?;
    let factor = match unit.trim() {
        "" | "B" => 1.0,
        "K" | "k" | "KiB" => 1024.0,
        "M" | "MiB" => 1024.0 * 1024.0,
        "G" | "GiB" => 1024.0 * 1024.0 * 1024.0,
        "T" | "TiB" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        "kB" => 1e3,
        "MB" => 1e6,
        "GB" => 1e9,
        "TB" => 1e12,
        _ => return Err(wanted()),
    };
    let bytes = number * factor;
    if !(1.0..9e18).contains(&bytes) {
        return Err(wanted());
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked just above"
    )]
    Ok(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_are_read_with_their_units() {
        assert_eq!(parse_size("512"), Ok(512));
        assert_eq!(parse_size("1.5KiB"), Ok(1536));
        assert_eq!(parse_size("2G"), Ok(2 << 30));
        assert_eq!(parse_size("3MB"), Ok(3_000_000));
        for bad in ["", "x", "-1", "1e3", "10 parsecs", "NaN", "0"] {
            assert!(parse_size(bad).is_err(), "{bad:?}");
        }
    }
}
