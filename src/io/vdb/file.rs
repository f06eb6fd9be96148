//! The file around the trees.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt as _;

use super::band::Rule;
use super::leaves::Done;
use super::tree::Tree;
use crate::io::format::Description;

/// The version that OpenVDB has written since 5; 225 adds grids of half floats.
const VERSION: u32 = 224;
/// The library whose grids these are.
const LIBRARY: [u32; 2] = [10, 0];
/// Only active values are there, and a mask tells of the others.
const ACTIVE_MASK: u32 = 2;

/// A writer that knows where it is, and what is to be put where later.
#[derive(Debug)]
pub(super) struct Counted<W> {
    to: W,
    at: u64,
    fixes: Vec<(u64, [u8; 24])>,
}

impl<W: Write> Counted<W> {
    pub(super) fn new(to: W) -> Self {
        Self {
            to,
            at: 0,
            fixes: Vec::new(),
        }
    }

    /// What is to be put where.
    pub(super) fn finish(self) -> Vec<(u64, [u8; 24])> {
        self.fixes
    }
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.to.write(bytes)?;
        self.at += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// A value of metadata.
enum Meta<'a> {
    Text(&'a str),
    Bool(bool),
    Int64(u64),
    Vec3i([i64; 3]),
}

fn text(out: &mut impl Write, text: &str) -> io::Result<()> {
    #[allow(clippy::cast_possible_truncation, reason = "names are short")]
    out.write_all(&(text.len() as u32).to_le_bytes())?;
    out.write_all(text.as_bytes())
}

/// Metadata: names in their order, with types, sizes and values.
fn metadata(out: &mut impl Write, values: &[(&str, Meta<'_>)]) -> io::Result<()> {
    let mut sorted: Vec<&(&str, Meta<'_>)> = values.iter().collect();
    sorted.sort_by_key(|value| value.0);
    #[allow(clippy::cast_possible_truncation, reason = "a dozen")]
    out.write_all(&(sorted.len() as u32).to_le_bytes())?;
    for (name, value) in sorted {
        text(out, name)?;
        #[allow(clippy::cast_possible_truncation, reason = "indices of voxels")]
        let (kind, bytes) = match value {
            Meta::Text(value) => ("string", value.as_bytes().to_vec()),
            Meta::Bool(value) => ("bool", vec![u8::from(*value)]),
            Meta::Int64(value) => ("int64", value.to_le_bytes().to_vec()),
            Meta::Vec3i(value) => (
                "vec3i",
                value
                    .iter()
                    .flat_map(|n| (*n as i32).to_le_bytes())
                    .collect(),
            ),
        };
        text(out, kind)?;
        #[allow(clippy::cast_possible_truncation, reason = "texts are short")]
        out.write_all(&(bytes.len() as u32).to_le_bytes())?;
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// What stands before the grids.
pub(super) fn head(out: &mut impl Write, of: &Description, grids: usize) -> io::Result<()> {
    out.write_all(&0x5644_4220_u64.to_le_bytes())?;
    for number in [VERSION, LIBRARY[0], LIBRARY[1]] {
        out.write_all(&number.to_le_bytes())?;
    }
    // Places of grids are told.
    out.write_all(&[1])?;
    out.write_all(identity(of).as_bytes())?;
    let creator = concat!("voxlathe/", env!("CARGO_PKG_VERSION"));
    metadata(out, &[("creator", Meta::Text(creator))])?;
    #[allow(clippy::cast_possible_truncation, reason = "two at most")]
    out.write_all(&(grids as u32).to_le_bytes())
}

/// The file's identity, the same in equal runs.
fn identity(of: &Description) -> String {
    let grid = format!("{:?} {:?}", of.grid, of.scene);
    let digits = blake3::hash(grid.as_bytes()).to_hex();
    let digits = digits.as_str();
    let parts = [0..8, 8..12, 12..16, 16..20, 20..32];
    parts.map(|part| &digits[part]).join("-")
}

/// Writes a grid of this name.
pub(super) fn grid<W: Write>(
    out: &mut Counted<W>,
    of: &Description,
    name: &str,
    done: &Done,
) -> io::Result<()> {
    let tree = Tree::new(done);
    text(out, name)?;
    text(out, "Tree_float_5_4_3")?;
    // It shares no tree with another grid.
    text(out, "")?;
    let places = out.at;
    out.write_all(&[0; 24])?;
    let start = out.at;
    out.write_all(&ACTIVE_MASK.to_le_bytes())?;
    let (class, meaning) = match done.rule {
        Rule::LevelSet { .. } => ("level set", "signed distance, negative inside"),
        Rule::Fog => ("fog volume", "share of the voxel inside"),
    };
    let (count, [low, high]) = tree.active();
    let mut values = vec![
        ("class", Meta::Text(class)),
        ("file_bbox_max", Meta::Vec3i(high)),
        ("file_bbox_min", Meta::Vec3i(low)),
        ("file_compression", Meta::Text("active values")),
        ("file_voxel_count", Meta::Int64(count)),
        ("is_saved_as_half_float", Meta::Bool(false)),
        ("meaning", Meta::Text(meaning)),
        ("name", Meta::Text(name)),
        ("sign_convention", Meta::Text(of.sign())),
        ("units", Meta::Text(&of.units)),
        ("vector_type", Meta::Text("invariant")),
    ];
    if let Some(scene) = &of.scene {
        values.push(("scene", Meta::Text(&scene.name)));
        values.push(("scene_hash", Meta::Text(&scene.hash)));
    }
    metadata(out, &values)?;
    transform(out, of)?;
    tree.topology(out)?;
    let blocks = out.at;
    let mut leaf = Vec::new();
    for found in tree.leaves() {
        leaf.resize(found.size as usize, 0);
        done.room.read_exact_at(&mut leaf, found.start)?;
        out.write_all(&leaf)?;
    }
    let mut fix = [0; 24];
    for (part, place) in fix.chunks_exact_mut(8).zip([start, blocks, out.at]) {
        part.copy_from_slice(&place.to_le_bytes());
    }
    out.fixes.push((places, fix));
    Ok(())
}

/// Where index (0, 0, 0) is, and how far the next are.
fn transform(out: &mut impl Write, of: &Description) -> io::Result<()> {
    let lattice = of.centres();
    let [dx, dy, dz] = lattice.spacing;
    let same = dx.to_bits() == dy.to_bits() && dy.to_bits() == dz.to_bits();
    text(
        out,
        if same {
            "UniformScaleTranslateMap"
        } else {
            "ScaleTranslateMap"
        },
    )?;
    let step = lattice.spacing;
    for vector in [
        lattice.first,
        step,
        step,
        step.map(|d| 1.0 / d),
        step.map(|d| 1.0 / (d * d)),
        step.map(|d| 0.5 / d),
    ] {
        vector
            .iter()
            .try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}

/// Puts what is missing in its place, and digests the file; its length.
pub(super) fn fix_and_digest(
    file: &File,
    fixes: &[(u64, [u8; 24])],
    digest: &mut blake3::Hasher,
) -> io::Result<u64> {
    for (at, bytes) in fixes {
        file.write_all_at(bytes, *at)?;
    }
    let length = file.metadata()?.len();
    let mut buffer = vec![0; 1 << 18];
    let mut at = 0;
    while at < length {
        let part = buffer.len().min((length - at) as usize);
        file.read_exact_at(&mut buffer[..part], at)?;
        digest.update(&buffer[..part]);
        at += part as u64;
    }
    Ok(length)
}
