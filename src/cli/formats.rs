//! What `--formats`, the flags of each format and the name of the output come to.

use super::arguments::{H5Flag, NrrdFlag, Precision, Voxelize, VtiFlag, ZarrFlag};
use super::failure::Failure;
use crate::grid::GridSpec;
use crate::io::exr::{Compression, SampleKind};
use crate::io::format::{
    Description, FormatKind, H5Codec, Needs, NrrdEncoding, VtiEncoding, ZarrCodec,
};
use crate::io::stack::{ChannelSpec, SceneLabel};
use crate::scene::{CompressionName, FormatName, Scene};

/// Half width of a level set's band where none is given, in voxels: OpenVDB's own.
const HALF_WIDTH: f64 = 3.0;
/// The best ratio a compressor reaches, on a constant layer.
const BEST: u64 = 1000;

/// The formats of a run, and what they take.
#[derive(Debug, Clone)]
pub(super) struct Formats {
    pub(super) kinds: Vec<FormatKind>,
    /// Whether the output is one file, without a manifest.
    pub(super) is_single: bool,
    /// What all together take.
    pub(super) needs: Needs,
    /// Bytes of the disk that are taken at least.
    pub(super) least: u64,
}

impl Formats {
    /// Those that the command and the scene ask for.
    pub(super) fn of(
        scene: &Scene,
        arguments: &Voxelize,
        grid: &GridSpec,
        channels: &[ChannelSpec],
    ) -> Result<Self, Failure> {
        check_codecs(arguments, channels)?;
        let is_single = single(arguments)?.is_some();
        let names = scene.model().output.formats.iter();
        let kinds: Vec<FormatKind> = names
            .map(|name| kind(*name, scene, arguments, grid, channels))
            .collect();
        let of = Description {
            grid: *grid,
            units: scene.model().units.name().to_owned(),
            scene: Some(SceneLabel {
                name: scene.name().to_owned(),
                hash: String::new(),
            }),
            channels: channels.to_vec(),
            file: None,
        };
        let mut all = Needs {
            disk_is_sure: true,
            ..Needs::default()
        };
        let mut least = 0_u64;
        for kind in &kinds {
            let checked = kind.check(&of);
            checked.map_err(|reason| Failure::usage(format!("{}: {reason}", kind.name())))?;
            let needs = kind.needs(&of);
            all.disk = all.disk.saturating_add(needs.disk);
            all.memory = all.memory.saturating_add(needs.memory);
            all.each = all.each.saturating_add(needs.each);
            all.disk_is_sure &= needs.disk_is_sure;
            let sure = if needs.disk_is_sure { 1 } else { BEST };
            least = least.saturating_add(needs.disk / sure);
        }
        Ok(Self {
            kinds,
            is_single,
            needs: all,
            least,
        })
    }

    /// Their names, in the order asked.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.kinds.iter().map(FormatKind::name).collect()
    }

    /// The compression of slices, where there are any.
    pub(super) fn compression(&self) -> Option<Compression> {
        self.kinds.iter().find_map(|kind| match kind {
            FormatKind::Exr(compression) => Some(*compression),
            _ => None,
        })
    }

    /// Whether what a layer takes on the disk is told by no more than its making.
    pub(super) fn are_compressed_slices(&self) -> bool {
        match self.kinds[..] {
            [FormatKind::Exr(compression)] => compression != Compression::None,
            _ => false,
        }
    }

    /// What is to be said of voxels that are no cubes.
    pub(super) fn warning(&self, grid: &GridSpec, channels: &[ChannelSpec]) -> Option<String> {
        let [dx, dy, dz] = grid.spacing().to_array();
        let is_vdb = |kind: &FormatKind| matches!(kind, FormatKind::Vdb { .. });
        let has_surface = channels.iter().any(|channel| channel.name == "sdf");
        (self.kinds.iter().any(is_vdb) && has_surface && !(dx == dy && dy == dz)).then(|| {
            format!(
                "vdb: the voxels of surface are {dx} x {dy} x {dz}; some tools take level sets of cubes only"
            )
        })
    }
}

/// The format of the one file that the output is, where it is one.
pub(super) fn single(arguments: &Voxelize) -> Result<Option<FormatName>, Failure> {
    let Some(name) = FormatKind::single_name(&arguments.output) else {
        return Ok(None);
    };
    if !arguments.formats.is_empty() {
        return Err(Failure::usage(format!(
            "--formats: {} is one .{name} file, whose format its name tells; leave --formats out, or name a directory",
            arguments.output.display()
        )));
    }
    if arguments.preview {
        return Err(Failure::usage(format!(
            "--preview: {} is one .{name} file, and pictures lie beside a stack; name a directory, or use voxlathe render",
            arguments.output.display()
        )));
    }
    Ok(FormatName::from_name(name))
}

/// Refuses what this build, or these channels, cannot have.
fn check_codecs(arguments: &Voxelize, channels: &[ChannelSpec]) -> Result<(), Failure> {
    if arguments.h5_codec == H5Flag::Gzip && !cfg!(feature = "hdf5") {
        return Err(Failure::usage(
            "--h5-codec gzip: this build has not the feature hdf5; build one that has, by cargo install --path . --features \
             hdf5, or take --h5-codec none and h5repack -f GZIP=6 afterwards",
        ));
    }
    let single: Vec<&str> = channels
        .iter()
        .filter(|channel| channel.kind == SampleKind::Float)
        .map(|channel| channel.name.as_str())
        .collect();
    if arguments.precision == Precision::F64 && !single.is_empty() {
        return Err(Failure::usage(format!(
            "--precision f64: {} are sampled in single precision; leave the flag out, or ask for points with voxlathe query, \
             which answers in double precision",
            single.join(", ")
        )));
    }
    Ok(())
}

/// A format with its flags.
fn kind(
    name: FormatName,
    scene: &Scene,
    arguments: &Voxelize,
    grid: &GridSpec,
    channels: &[ChannelSpec],
) -> FormatKind {
    let output = &scene.model().output;
    match name {
        FormatName::Exr => {
            let compression = compression(output.compression);
            FormatKind::Exr(compression.resolve(channels.iter().map(|c| c.name.as_str())))
        }
        FormatName::Vti => FormatKind::Vti {
            encoding: match arguments.vti_encoding {
                VtiFlag::Raw => VtiEncoding::Raw,
                VtiFlag::Zlib => VtiEncoding::Zlib,
                VtiFlag::Base64 => VtiEncoding::Base64,
            },
            points: arguments.vti_points,
        },
        FormatName::Npy => FormatKind::Npy,
        FormatName::Nrrd => FormatKind::Nrrd(match arguments.nrrd_encoding {
            NrrdFlag::Raw => NrrdEncoding::Raw,
            NrrdFlag::Gzip => NrrdEncoding::Gzip,
        }),
        FormatName::Mhd => FormatKind::Mhd,
        FormatName::Raw => FormatKind::Raw,
        FormatName::Zarr => FormatKind::Zarr(match arguments.zarr_codec {
            ZarrFlag::None => ZarrCodec::None,
            ZarrFlag::Zstd => ZarrCodec::Zstd,
        }),
        FormatName::Vdb => FormatKind::Vdb {
            half_width: output.band.unwrap_or(HALF_WIDTH) * grid.spacing().max_element(),
        },
        FormatName::H5 => FormatKind::H5(h5_codec(arguments)),
    }
}

#[cfg(feature = "hdf5")]
fn h5_codec(arguments: &Voxelize) -> H5Codec {
    match arguments.h5_codec {
        H5Flag::None => H5Codec::None,
        H5Flag::Gzip => H5Codec::Gzip,
    }
}

/// The only one that such a build has; [`check_codecs`] has refused the other.
#[cfg(not(feature = "hdf5"))]
fn h5_codec(_arguments: &Voxelize) -> H5Codec {
    H5Codec::None
}

fn compression(name: CompressionName) -> Compression {
    match name {
        CompressionName::Auto => Compression::Auto,
        CompressionName::None => Compression::None,
        CompressionName::Rle => Compression::Rle,
        CompressionName::Zips => Compression::Zips,
        CompressionName::Zip => Compression::Zip,
        CompressionName::Piz => Compression::Piz,
        CompressionName::Pxr24 => Compression::Pxr24,
    }
}
