//! OpenVDB: `NAME.vdb`, with the grids `surface`, a level set in a narrow band, and `density`, a fog volume.
//!
//! ```text
//!   layers ──> bands      of each layer what is in the band, 8 x 8 voxels at a time
//!          ──> leaves     8 layers together: 8 x 8 x 8 voxels, written to a file without a name
//!   finish ──> tree       of all leaves, then their values in the order of the tree
//! ```
//!
//! Index (i, j, k) is the centre of voxel (i, j, k). Within the band the values are those sampled, bit for bit; beyond it
//! only the side is kept. What is in memory follows the band: 16 bytes and a mask for each leaf, a bit for every other
//! block of 8 x 8 x 8.
//!
//! Source: OpenVDB 10, file format version 224: `io/Archive.cc`, `io/Compression.h`, `tree/*.h`.

mod band;
mod file;
mod leaves;
mod tree;

use std::io::{BufWriter, Write as _};

use super::error::IoError;
use super::exr::Samples;
use super::format::{Description, Format, Layer, Needs, record};
use super::manifest::FileRecord;
use super::staged::{StagedFile, StagedFiles, WrittenFile};
use band::Rule;
use leaves::Leaves;

/// Voxels along a leaf.
const SIDE: usize = 8;

pub(super) fn check(of: &Description, half_width: f64) -> Result<(), String> {
    if grids(of, 1.0).is_empty() {
        return Err("a .vdb file holds surface, made of sdf, and density, made of fraction, and neither is sampled; add one to the channels, or leave vdb out of the formats".into());
    }
    #[allow(clippy::cast_possible_truncation, reason = "that is what is checked")]
    let stored = half_width as f32;
    if !(stored.is_normal() && stored > 0.0) {
        return Err(format!(
            "a .vdb file's band of {half_width:e} {} is beyond f32; choose another unit or band",
            of.units
        ));
    }
    if of.grid.dims().iter().any(|n| *n > 1 << 21) {
        return Err(
            "a .vdb file holds at most 2097152 voxels along an axis; choose another format".into(),
        );
    }
    Ok(())
}

/// The grids that the channels give: the channel's number, the grid's name and its rule.
fn grids(of: &Description, half_width: f64) -> Vec<(usize, &'static str, Rule)> {
    let find = |name: &str| of.channels.iter().position(|c| c.name == name);
    #[allow(clippy::cast_possible_truncation, reason = "checked to fit")]
    let level_set = Rule::LevelSet {
        background: half_width as f32,
    };
    let surface = find("sdf").map(|n| (n, "surface", level_set));
    let density = find("fraction").map(|n| (n, "density", Rule::Fog));
    surface.into_iter().chain(density).collect()
}

pub(super) fn needs(of: &Description) -> Needs {
    let grids = grids(of, 1.0).len() as u64;
    let blocks: Vec<u64> = of
        .grid
        .dims()
        .iter()
        .map(|n| n.div_ceil(SIDE) as u64)
        .collect();
    let count = blocks.iter().product::<u64>();
    let layer = of.grid.layer_len() as u64;
    // A surface that crosses the box once or twice along each axis, in a band of two leaves.
    let faces = blocks[0] * blocks[1] + blocks[1] * blocks[2] + blocks[2] * blocks[0];
    let leaves = count.min(6 * faces);
    /// Bytes of a full leaf with its masks.
    const LEAF: u64 = 64 + 1 + 64 + 2048;
    Needs {
        disk: grids * (count * (64 + LEAF) * 2 + (1 << 21)),
        disk_is_sure: false,
        memory: grids * (leaves * leaves::BYTES + count / 8 + 12 * layer) + (1 << 20),
        each: 2 * layer + (1 << 20),
    }
}

/// The file in the making.
#[derive(Debug)]
pub(super) struct Grids {
    of: Description,
    staged: StagedFile,
    grids: Vec<(usize, &'static str, Leaves)>,
}

impl Grids {
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        half_width: f64,
    ) -> Result<Self, IoError> {
        let staged = files.create(&of.whole_file("vdb"))?;
        let grids = grids(of, half_width)
            .into_iter()
            .map(|(channel, name, rule)| {
                Ok((
                    channel,
                    name,
                    Leaves::new(rule, of.grid.dims(), files.scratch()?),
                ))
            });
        Ok(Self {
            of: of.clone(),
            grids: grids.collect::<Result<_, IoError>>()?,
            staged,
        })
    }
}

impl Format for Grids {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (channel, _, leaves) in &self.grids {
            if let Samples::Float(values) = layer.channels[*channel].1 {
                leaves.layer(layer.k, values).map_err(files.failed())?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let Self { of, staged, grids } = *self;
        let write = || {
            let mut out = file::Counted::new(BufWriter::with_capacity(1 << 18, staged.file()));
            file::head(&mut out, &of, grids.len())?;
            for (_, name, leaves) in grids {
                file::grid(&mut out, &of, name, &leaves.finish())?;
            }
            out.flush()?;
            // The places of the grids are put there last.
            let fixes = out.finish();
            let mut digest = blake3::Hasher::new();
            let length = file::fix_and_digest(staged.file(), &fixes, &mut digest)?;
            Ok(WrittenFile::new(length, digest.finalize()))
        };
        let written = write().map_err(|source| staged.failed(source))?;
        let name = staged.name().to_owned();
        files.close(staged)?;
        Ok(vec![record((name, written))])
    }
}
