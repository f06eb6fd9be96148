//! A scene as plain data: every default filled in, every value checked by itself, nothing computed.
//!
//! Lengths are in the scene's units, angles in degrees as written. The geometry that follows from
//! the data (loops that close, r >= 0, bounds) is not looked at here; errors found there are placed
//! with [`SceneModel::sources`], the `place` and the `path` of each part.

use std::collections::BTreeMap;

use super::error::{Place, SceneError, Sources};
use super::keys::nearest;
use crate::grid::Channel;
use crate::solid::Shape;

/// An enum whose variants have names in scene files.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant,)+ }

        impl $name {
            /// Every variant, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The name in scene files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }

            /// The variant of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($text => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}

named! {
    /// What one unit of length is. A label: nothing is rescaled.
    Units {
        /// Metre.
        Metre = "m",
        /// Centimetre.
        Centimetre = "cm",
        /// Millimetre.
        Millimetre = "mm",
        /// Micrometre.
        Micrometre = "um",
        /// Nanometre.
        Nanometre = "nm",
        /// Kilometre.
        Kilometre = "km",
        /// Inch.
        Inch = "in",
        /// Foot.
        Foot = "ft",
    }
}

/// A channel of the output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChannelModel {
    /// What every scene has.
    Known(Channel),
    /// The share of each voxel that is of a material.
    MaterialFraction {
        /// The material's id.
        id: u32,
        /// `fraction-ID`.
        name: String,
    },
    /// A parameter or a field of the volumes, by name.
    Scalar(String),
}

impl ChannelModel {
    /// The channel's name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Known(known) => known.name(),
            Self::MaterialFraction { name, .. } | Self::Scalar(name) => name,
        }
    }
}

/// What is wrong with the name of a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelProblem {
    /// What is wanted instead.
    pub wanted: String,
    /// The nearest name.
    pub hint: Option<String>,
}

/// The parameters of volumes, as channels are called.
pub const PARAMETERS: [&str; 3] = ["u", "v", "w"];

named! {
    /// A file format of the samples.
    FormatName {
        /// A stack of OpenEXR images, one for each layer.
        Exr = "exr",
        /// VTK image data.
        Vti = "vti",
        /// NumPy arrays.
        Npy = "npy",
        /// Nearly raw raster data.
        Nrrd = "nrrd",
        /// MetaImage headers with their raw arrays.
        Mhd = "mhd",
        /// Bare arrays.
        Raw = "raw",
        /// A Zarr v3 group.
        Zarr = "zarr",
        /// OpenVDB grids.
        Vdb = "vdb",
        /// HDF5.
        H5 = "h5",
    }
}

named! {
    /// How the samples are compressed.
    CompressionName {
        /// Chosen from the channels for write speed; lossless.
        Auto = "auto",
        /// Not at all.
        None = "none",
        /// Run lengths.
        Rle = "rle",
        /// Deflate, line by line.
        Zips = "zips",
        /// Deflate, 16 lines at a time.
        Zip = "zip",
        /// Wavelet and Huffman.
        Piz = "piz",
        /// Floats cut to 24 bits: lossy.
        Pxr24 = "pxr24",
    }
}

named! {
    /// How the curves of a profile make a region.
    Boundary {
        /// The curves form closed loops; the region is what they enclose.
        Closed = "closed",
        /// The curves form one open chain; the region lies between it and the axis.
        ToAxis = "to-axis",
    }
}

named! {
    /// How several loops combine.
    Fill {
        /// Inside where the winding number is odd.
        EvenOdd = "even-odd",
        /// Inside where the winding number is not zero.
        NonZero = "nonzero",
    }
}

named! {
    /// What becomes of a profile that reaches over the axis.
    Across {
        /// It is refused.
        Refuse = "refuse",
        /// What lies at r >= 0 is taken.
        Clip = "clip",
        /// The union with its mirror image in the axis is taken.
        Mirror = "mirror",
    }
}

named! {
    /// What a solid does to what the solids before it have made.
    Operation {
        /// Union.
        Add = "add",
        /// Difference.
        Subtract = "subtract",
        /// Intersection.
        Intersect = "intersect",
    }
}

/// A whole scene.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SceneModel {
    /// Name of the scene.
    pub name: String,
    /// What a unit of length is.
    pub units: Units,
    /// Where the voxels are.
    pub grid: GridModel,
    /// What is written.
    pub output: OutputModel,
    /// Names of material ids.
    pub materials: BTreeMap<u32, String>,
    /// Profiles in the order of their names.
    pub profiles: Vec<(String, ProfileModel)>,
    /// Solids, at least one, in the order in which they combine.
    pub solids: Vec<SolidModel>,
    /// The closed form that the scene is compared with.
    pub reference: Option<ReferenceModel>,
    /// The texts all places refer to.
    pub sources: Sources,
}

impl SceneModel {
    /// The names of the channels that the scene's volumes add: their parameters, where there are
    /// volumes, and their fields.
    #[must_use]
    pub fn scalar_names(&self) -> Vec<&str> {
        let volumes = self.solids.iter().filter_map(|s| match &s.kind {
            SolidKind::Volume(volume) => Some(&volume.source),
            _ => None,
        });
        let mut names: Vec<&str> = Vec::new();
        for source in volumes {
            let fields = match source {
                VolumeSource::Patches(patches) => patches[0].fields.as_slice(),
                _ => &[],
            };
            let fields = fields.iter().map(|f| f.name.as_str());
            for name in PARAMETERS.into_iter().chain(fields) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        names
    }

    /// The shares of the materials that the added solids have.
    fn material_fractions(&self) -> Vec<ChannelModel> {
        let added = self.solids.iter().enumerate();
        let added = added.filter(|(n, s)| *n == 0 || s.operation == Operation::Add);
        let ids: std::collections::BTreeSet<u32> = added.map(|(_, s)| s.material).collect();
        let one = |id: u32| ChannelModel::MaterialFraction {
            id,
            name: format!("fraction-{id}"),
        };
        ids.into_iter().map(one).collect()
    }

    /// The channels of those names.
    ///
    /// # Errors
    /// The index of the first name that the scene has no channel of, or that is there twice.
    pub fn channels(&self, names: &[&str]) -> Result<Vec<ChannelModel>, (usize, ChannelProblem)> {
        let scalars = self.scalar_names();
        let materials = self.material_fractions();
        let mut found: Vec<ChannelModel> = Vec::new();
        for (index, &name) in names.iter().enumerate() {
            let known = Channel::from_name(name).map(ChannelModel::Known);
            let of_material = || materials.iter().find(|m| m.name() == name).cloned();
            let scalar = || {
                let is_one = scalars.contains(&name);
                is_one.then(|| ChannelModel::Scalar(name.to_owned()))
            };
            let Some(channel) = known.or_else(of_material).or_else(scalar) else {
                let known = Channel::ALL.iter().map(|c| c.name());
                let of_materials = materials.iter().map(ChannelModel::name);
                let all: Vec<&str> = (known.chain(of_materials))
                    .chain(scalars.iter().copied())
                    .collect();
                return Err((
                    index,
                    ChannelProblem {
                        wanted: format!("one of {}", all.join(", ")),
                        hint: nearest(name, all.iter().copied()).map(str::to_owned),
                    },
                ));
            };
            if found.contains(&channel) {
                let problem = ChannelProblem {
                    wanted: "each name once".to_owned(),
                    hint: None,
                };
                return Err((index, problem));
            }
            found.push(channel);
        }
        Ok(found)
    }

    /// An error about the value at `place`; see [`Sources::error`].
    pub fn error(
        &self,
        place: Place,
        path: &str,
        found: Option<String>,
        wanted: &str,
        hint: Option<String>,
    ) -> SceneError {
        self.sources.error(place, path, found, wanted, hint)
    }
}

/// Where the voxels are: `[grid]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct GridModel {
    /// Size or number of the voxels.
    pub step: GridStep,
    /// The box to fill, minimum and maximum corner; `None` for the bounds of the added solids, and
    /// for a verbatim grid.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Voxels added on every side; means nothing with `bounds` or a verbatim grid.
    pub padding: u32,
    /// The table, or the scene where there is none.
    pub place: Place,
}

/// Size or number of the voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum GridStep {
    /// Voxels along the longest side.
    Resolution(u32),
    /// Voxels along each side.
    Resolutions([u32; 3]),
    /// Size of a voxel along each axis.
    Spacing([f64; 3]),
    /// The grid as it stands.
    Verbatim {
        /// Minimum corner of the first voxel.
        origin: [f64; 3],
        /// Size of a voxel.
        spacing: [f64; 3],
        /// Number of voxels.
        dims: [u32; 3],
    },
}

/// What is written: `[output]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct OutputModel {
    /// What is sampled, each once.
    pub channels: Vec<ChannelModel>,
    /// Files, each once.
    pub formats: Vec<FormatName>,
    /// Compression of the files.
    pub compression: CompressionName,
    /// Half width, in voxels, of the band the distance is clamped to.
    pub band: Option<f64>,
    /// The table, or the scene where there is none.
    pub place: Place,
}

/// A region of the meridian half-plane: `[profiles.NAME]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ProfileModel {
    /// How the curves make a region.
    pub boundary: Boundary,
    /// How several loops combine.
    pub fill: Fill,
    /// Share of the profile's size up to which gaps are closed, from 0 to 1e-3.
    pub gap: f64,
    /// What becomes of curves that reach over the axis.
    pub across: Across,
    /// The loop (closed) or the open chain (to-axis), never empty; `None` where `loops` holds
    /// everything.
    pub curves: Option<Vec<CurveModel>>,
    /// Closed loops, none of them empty.
    pub loops: Vec<Vec<CurveModel>>,
    /// The table.
    pub place: Place,
    /// `profiles.bowl`.
    pub path: String,
}

/// One curve of a profile.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CurveModel {
    /// The curve as written.
    pub kind: CurveKind,
    /// Whether it is run through backwards.
    pub reverse: bool,
    /// The table.
    pub place: Place,
    /// `profiles.bowl.curves[2]`.
    pub path: String,
}

/// A point of the meridian half-plane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PointModel {
    /// Distance from the axis; negative for a control point outside the half-plane.
    pub r: f64,
    /// Height along the axis.
    pub z: f64,
    /// In the scene, or in the file of points.
    pub place: Place,
}

/// The kinds of curves.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum CurveKind {
    /// A rational B-spline.
    Nurbs {
        /// Degree, from 1 and below the number of points.
        degree: usize,
        /// Control points.
        points: Vec<PointModel>,
        /// One for each point, finite and positive.
        weights: Vec<f64>,
        /// Points + degree + 1 knots, not decreasing, none more than degree + 1 times.
        knots: Vec<f64>,
    },
    /// A rational Bézier curve, its degree one less than the points.
    Bezier {
        /// Control points, at least 2.
        points: Vec<PointModel>,
        /// One for each point, finite and positive.
        weights: Vec<f64>,
    },
    /// Straight segments.
    Polyline {
        /// Corners, at least 2.
        points: Vec<PointModel>,
    },
    /// A circular arc; counter-clockwise where `from < to`.
    Arc {
        /// Centre (r, z).
        center: [f64; 2],
        /// Radius.
        radius: f64,
        /// Angle of the start in degrees, from +r towards +z.
        from: f64,
        /// Angle of the end in degrees; not `from`, and within 360 of it.
        to: f64,
    },
    /// A full circle, counter-clockwise.
    Circle {
        /// Centre (r, z).
        center: [f64; 2],
        /// Radius.
        radius: f64,
    },
    /// A full ellipse, counter-clockwise.
    Ellipse {
        /// Centre (r, z).
        center: [f64; 2],
        /// Half axes, before the tilt along r and z.
        radii: [f64; 2],
        /// Turn about the centre in degrees, counter-clockwise.
        tilt: f64,
    },
    /// The spline through the points.
    Interpolate {
        /// Points, at least 2, of a closed one 3.
        points: Vec<PointModel>,
        /// Degree; of an open one already reduced to one less than the points and tangents where there are few, of a
        /// closed one odd.
        degree: usize,
        /// Whether it goes back to its first point, smoothly.
        closed: bool,
        /// Derivatives by chord length at the ends of an open one.
        tangents: [Option<[f64; 2]>; 2],
    },
}

/// A solid: `[[solid]]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SolidModel {
    /// Name, unique in the scene.
    pub name: String,
    /// What it is made from.
    pub kind: SolidKind,
    /// Its axis: what is turned is turned about it, the rest is centred at its origin.
    pub axis: AxisModel,
    /// Steps that place it, first to last.
    pub steps: Vec<PlaceStep>,
    /// What it does to what the solids before it have made.
    pub operation: Operation,
    /// Id of the material, from 1.
    pub material: u32,
    /// The table.
    pub place: Place,
    /// `solid[1]`.
    pub path: String,
}

/// The kinds of solids.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SolidKind {
    /// A profile turned about an axis.
    Revolve {
        /// Index of the profile in [`SceneModel::profiles`].
        profile: usize,
        /// How far, and from where.
        turn: TurnModel,
    },
    /// A torus, cylinder, cone or sphere; cylinder and cone rise from the axis's origin.
    Round {
        /// Which, and its sizes. A torus may have a minor radius above the major one.
        shape: Shape,
        /// How far it is turned, and from where.
        turn: TurnModel,
    },
    /// An ellipsoid about the axis's origin.
    Ellipsoid {
        /// Half axes along the zero-angle direction, across it and along the axis.
        radii: [f64; 3],
    },
    /// A rectangular block about the axis's origin.
    Box {
        /// Side lengths along the zero-angle direction, across it and along the axis.
        size: [f64; 3],
    },
    /// Trivariate NURBS.
    Volume(VolumeModel),
}

/// A solid made of trivariate NURBS.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct VolumeModel {
    /// Where the nets come from.
    pub source: VolumeSource,
    /// What reading a file of them had to assume.
    pub notes: Vec<String>,
}

/// Where the nets of a volume come from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum VolumeSource {
    /// Given, inline or in a file.
    Patches(Vec<PatchModel>),
    /// The chain of a profile, joined to the axis and turned.
    Curve {
        /// Which construction.
        form: CurveForm,
        /// Index of the profile in [`SceneModel::profiles`].
        profile: usize,
        /// How far, and from where.
        turn: TurnModel,
        /// Whether chains that run back along the axis are taken as their stack of discs.
        union: bool,
    },
    /// A surface of the half-plane, turned.
    Section {
        /// The surface.
        section: SectionModel,
        /// How far, and from where.
        turn: TurnModel,
    },
}

/// How a chain becomes a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveForm {
    /// Construction a: the curve times a disc.
    Disc,
    /// Construction c: the curve joined to the axis by radial lines, times a circle.
    Ruled,
}

/// A trivariate NURBS.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PatchModel {
    /// Degrees in u, v and w.
    pub degrees: [usize; 3],
    /// Knot vectors in u, v and w.
    pub knots: [Vec<f64>; 3],
    /// Control points, the index of u fastest.
    pub points: Vec<[f64; 3]>,
    /// One for each point.
    pub weights: Vec<f64>,
    /// Scalars over the same basis, in the order of their names.
    pub fields: Vec<FieldModel>,
    /// The table.
    pub place: Place,
}

/// A scalar of a patch.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FieldModel {
    /// Its name, which its channel bears.
    pub name: String,
    /// A value for each control point.
    pub values: Vec<f64>,
}

/// A planar NURBS surface in the half-plane.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SectionModel {
    /// Degrees in u and v.
    pub degrees: [usize; 2],
    /// Knot vectors in u and v.
    pub knots: [Vec<f64>; 2],
    /// Control points (r, z), the index of u fastest.
    pub points: Vec<[f64; 2]>,
    /// One for each point.
    pub weights: Vec<f64>,
    /// The table.
    pub place: Place,
}

/// Part of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TurnModel {
    /// Angle turned in degrees, not 0 and at most 360 either way; negative: clockwise.
    pub angle: f64,
    /// Angle at which the turn starts, in degrees.
    pub start: f64,
}

/// A closed form to compare with: `[reference]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ReferenceModel {
    /// The shape.
    pub shape: Shape,
    /// Its axis; cylinder and cone rise from its origin, the others are centred there.
    pub axis: AxisModel,
    /// Steps that place it, first to last.
    pub steps: Vec<PlaceStep>,
    /// The table.
    pub place: Place,
}

/// An axis of revolution.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct AxisModel {
    /// A point of the axis, height 0.
    pub origin: [f64; 3],
    /// Direction of the axis, not zero, of any length.
    pub direction: [f64; 3],
    /// Zero-angle direction, not parallel to the axis; `None` for +x, or +y where the axis is
    /// within a degree of +-x.
    pub x: Option<[f64; 3]>,
    /// The table, or the solid where there is none.
    pub place: Place,
}

/// A step that places a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PlaceStep {
    /// Scaling about the origin by a positive factor.
    Scale(f64),
    /// Turning about an axis through the origin.
    Rotate {
        /// Direction, not zero, of any length.
        axis: [f64; 3],
        /// Angle in degrees, counter-clockwise seen from the tip of the axis.
        degrees: f64,
    },
    /// Moving.
    Translate([f64; 3]),
    /// Reflection in the plane through the origin with that normal, not zero, of any length.
    Mirror([f64; 3]),
}
