//! One z layer as an OpenEXR file in memory, and back.
//!
//! Image column = i, image row = j (row 0 is the smallest y), one scan-line part, channels in
//! alphabetical order as the format wants. `occupancy` is HALF, `fraction` and `sdf` FLOAT,
//! `material` UINT; any further channel is one of these three sample types.
//!
//! * Attributes: the header's attributes are written in the order of their names. The `exr` crate
//!   keeps custom ones in a hash map, whose order differs from run to run; the header is rewritten
//!   in sorted order, which moves no byte after it, so the chunk offsets stay right.
//! * Numbers in text have 17 significant digits, which every f64 survives.
//! * Accuracy: every compression but `pxr24` gives back the same bits. `pxr24` rounds floats to 24
//!   bits, 2^-16 of the value; integers and halves survive it.
//! * Source: Academy Software Foundation, *OpenEXR File Layout*, on headers, scan-line blocks and
//!   the offset table.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Cursor;
use std::str::FromStr;

use ::exr::block::reader::ChunksReader as _;
use ::exr::block::writer::ChunksWriter as _;
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::meta::BlockDescription;
use ::exr::meta::header::{Header, LayerAttributes};
use ::exr::prelude::{
    AttributeValue, ChannelDescription, Compression as ExrCompression, LineOrder, SampleType,
    SmallVec, Text, Vec2,
};
use half::f16;
use serde::{Deserialize, Serialize};

use crate::grid::GridSpec;

pub use super::stack::{StackChannel, write_stack};

/// What the sign of the distance means, as `voxlathe:signConvention` says it.
pub const SIGN_CONVENTION: &str = "negative-inside";

/// The largest side of an image: OpenEXR's windows are signed 32-bit and readers want headroom.
const MAX_SIDE: usize = (i32::MAX / 2) as usize;

/// No compression here shrinks by more than this: deflate reaches 1032, after the 24-bit rounding of
/// `pxr24` 4/3 of that, runs in PIZ's Huffman code about 500. An image that promises more bytes for
/// each byte of its file is refused before anything is allocated for it.
const MAX_EXPANSION: u64 = 2048;

/// Samples reserved at once when decoding; more come as the file delivers them.
const MAX_RESERVED: usize = 1 << 20;

/// Why a layer cannot be encoded or decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExrError {
    /// An image needs a channel.
    #[error("a layer needs at least one channel; name one, such as sdf")]
    NoChannels,
    /// A channel's name is unusable.
    #[error(
        "channel name {name:?} is not usable; use 1 to 255 printable ASCII characters without blanks"
    )]
    ChannelName {
        /// The name.
        name: String,
    },
    /// Two channels have one name.
    #[error("channel {name:?} appears twice; each channel needs its own name")]
    DuplicateChannel {
        /// The name.
        name: String,
    },
    /// A channel has the wrong number of samples.
    #[error("channel {name:?} has {found} samples; a layer of {width} x {height} voxels needs {}", width * height)]
    ChannelLength {
        /// The channel.
        name: String,
        /// Its samples.
        found: usize,
        /// Voxels along x.
        width: usize,
        /// Voxels along y.
        height: usize,
    },
    /// The image is larger than the format can hold.
    #[error(
        "a layer of {width} x {height} voxels does not fit an OpenEXR file; use a coarser grid"
    )]
    Size {
        /// Voxels along x.
        width: usize,
        /// Voxels along y.
        height: usize,
    },
    /// A header attribute is unusable.
    #[error("header attribute {name:?} {reason}; rename or drop it")]
    Attribute {
        /// The attribute.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The encoder refused.
    #[error("the layer could not be encoded ({reason}); please report this")]
    Encode {
        /// The encoder's reason.
        reason: String,
    },
    /// The bytes are not an intact OpenEXR file.
    #[error("not an intact OpenEXR file ({reason}); write the stack again")]
    Damaged {
        /// The decoder's reason.
        reason: String,
    },
    /// The file is intact, perhaps, but of a kind that stacks do not have.
    #[error("{reason}; a slice is one flat scan-line image")]
    Unsupported {
        /// What was found.
        reason: &'static str,
    },
}

/// How the pixels of a slice are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Not at all.
    None,
    /// Runs of equal bytes.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines together.
    Zip,
    /// Wavelets and Huffman codes, 32 lines together.
    Piz,
    /// Deflate after rounding floats to 24 bits: lossy, 2^-16 of the value.
    Pxr24,
    /// Lossless, chosen from the channels; see [`Compression::resolve`].
    #[default]
    Auto,
}

impl Compression {
    /// All choices, in the order they are listed to users.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Rle,
        Self::Zips,
        Self::Zip,
        Self::Piz,
        Self::Pxr24,
        Self::Auto,
    ];

    /// The name users write.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "rle",
            Self::Zips => "zips",
            Self::Zip => "zip",
            Self::Piz => "piz",
            Self::Pxr24 => "pxr24",
            Self::Auto => "auto",
        }
    }

    /// The compression that `auto` stands for with these channels; every other is itself.
    ///
    /// A slice of a ball, 512 x 512, one thread of a 2-core Xeon, release build,
    /// `measure_compressions` below; file size over raw size, raw megabytes encoded in a second:
    ///
    /// | channels | none | rle | zips | zip | piz | pxr24 |
    /// |---|---|---|---|---|---|---|
    /// | sdf | 1.01 1041 | 1.01 187 | 1.01 21 | 0.98 20 | 0.79 18 | 0.23 57 |
    /// | occupancy, fraction, sdf | 1.00 1202 | 0.49 260 | 0.42 44 | 0.40 42 | 0.34 39 | 0.10 93 |
    /// | occupancy, fraction | 1.01 1055 | 0.14 299 | 0.023 78 | 0.010 146 | 0.076 69 | 0.009 171 |
    /// | occupancy | 1.02 471 | 0.039 241 | 0.045 41 | 0.008 114 | 0.017 31 | 0.008 131 |
    ///
    /// The last bits of an f32 distance are noise to every lossless codec: zip saves 2 % and piz
    /// 21 % of it, both at a fiftieth of the speed, so a stack with `sdf`, or with a channel of
    /// unknown content, is left alone. Masks, fractions and ids shrink a hundredfold under zip, so
    /// the disk has next to nothing to do; rle is twice as fast but leaves ten times the bytes.
    ///
    /// ```
    /// # use voxlathe::io::exr::Compression;
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "sdf"]), Compression::None);
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "fraction"]), Compression::Zip);
    /// assert_eq!(Compression::Piz.resolve(["sdf"]), Compression::Piz);
    /// ```
    #[must_use]
    pub fn resolve<'a>(self, channels: impl IntoIterator<Item = &'a str>) -> Self {
        if self != Self::Auto {
            return self;
        }
        let compressible = |name: &str| matches!(name, "occupancy" | "fraction" | "material");
        if channels.into_iter().all(compressible) {
            Self::Zip
        } else {
            Self::None
        }
    }

    fn to_exr(self) -> ExrCompression {
        match self {
            Self::None | Self::Auto => ExrCompression::Uncompressed,
            Self::Rle => ExrCompression::RLE,
            Self::Zips => ExrCompression::ZIP1,
            Self::Zip => ExrCompression::ZIP16,
            Self::Piz => ExrCompression::PIZ,
            Self::Pxr24 => ExrCompression::PXR24,
        }
    }
}

impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A compression name that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown compression {found:?}; it must be none, rle, zips, zip, piz, pxr24 or auto")]
pub struct UnknownCompression {
    /// The name given.
    pub found: String,
}

impl FromStr for Compression {
    type Err = UnknownCompression;

    fn from_str(name: &str) -> Result<Self, UnknownCompression> {
        Self::ALL
            .into_iter()
            .find(|c| c.name() == name)
            .ok_or_else(|| UnknownCompression { found: name.into() })
    }
}

/// The samples of one channel in one layer, x fastest, then y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples<'a> {
    /// Small whole numbers, stored as HALF (exact: a half holds every integer up to 2048).
    Half(&'a [u8]),
    /// Stored as FLOAT.
    Float(&'a [f32]),
    /// Stored as UINT.
    Uint(&'a [u32]),
}

impl Samples<'_> {
    /// How many samples there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Half(s) => s.len(),
            Self::Float(s) => s.len(),
            Self::Uint(s) => s.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type the samples have in the file.
    #[must_use]
    pub fn kind(&self) -> SampleKind {
        match self {
            Self::Half(_) => SampleKind::Half,
            Self::Float(_) => SampleKind::Float,
            Self::Uint(_) => SampleKind::Uint,
        }
    }
}

/// The type of a channel's samples in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SampleKind {
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Float,
    /// 32-bit unsigned integer.
    Uint,
}

impl SampleKind {
    /// Bytes of one sample.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Float | Self::Uint => 4,
        }
    }

    fn to_exr(self) -> SampleType {
        match self {
            Self::Half => SampleType::F16,
            Self::Float => SampleType::F32,
            Self::Uint => SampleType::U32,
        }
    }
}

/// The sampled channels of one layer; those that are `None` are not written.
///
/// Each slice holds nx * ny samples, x fastest, then y.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LayerChannels<'a> {
    /// 1 where the voxel centre is inside, else 0.
    pub occupancy: Option<&'a [u8]>,
    /// Inside part of the voxel's volume, 0 to 1.
    pub fraction: Option<&'a [f32]>,
    /// Signed distance at the voxel centre, in scene units, negative inside.
    pub sdf: Option<&'a [f32]>,
    /// Id of the material at the voxel centre, 0 where empty.
    pub material: Option<&'a [u32]>,
}

impl<'a> LayerChannels<'a> {
    /// The channels that are present, with their names.
    #[must_use]
    pub fn list(&self) -> Vec<(&'static str, Samples<'a>)> {
        [
            self.occupancy.map(|s| ("occupancy", Samples::Half(s))),
            self.fraction.map(|s| ("fraction", Samples::Float(s))),
            self.sdf.map(|s| ("sdf", Samples::Float(s))),
            self.material.map(|s| ("material", Samples::Uint(s))),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// The value of a custom header attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// ASCII text; other characters are written as `\u{...}`.
    Text(String),
    /// A 32-bit integer.
    Int(i32),
    /// A double.
    Double(f64),
}

/// Custom header attributes by name.
pub type Attributes = BTreeMap<String, Attribute>;

/// The `voxlathe:` attributes of layer `k`.
///
/// * `units`: label of the scene's lengths.
/// * `scene`: name and BLAKE3 digest of the resolved scene, where there is one.
#[must_use]
pub fn layer_attributes(
    grid: &GridSpec,
    k: usize,
    units: &str,
    scene: Option<(&str, &str)>,
) -> Attributes {
    let triple = |v: glam::DVec3| Attribute::Text(v.to_array().map(decimal17).join(" "));
    let mut attributes = Attributes::new();
    let mut set = |name: &str, value| attributes.insert(format!("voxlathe:{name}"), value);
    set("origin", triple(grid.origin()));
    set("spacing", triple(grid.spacing()));
    set(
        "dims",
        Attribute::Text(grid.dims().map(|d| d.to_string()).join(" ")),
    );
    set(
        "slice",
        // A grid dimension fits i32, so the other arm is never taken.
        Attribute::Int(i32::try_from(k).unwrap_or(i32::MAX)),
    );
    set("z", Attribute::Double(grid.centre_along(2, k)));
    set("units", Attribute::Text(units.into()));
    set("signConvention", Attribute::Text(SIGN_CONVENTION.into()));
    if let Some((name, hash)) = scene {
        set("scene", Attribute::Text(name.into()));
        set("sceneHash", Attribute::Text(hash.into()));
    }
    attributes
}

/// `value` in decimal with 17 significant digits, trailing zeros dropped, as C's `%.17g` has it.
#[must_use]
pub fn decimal17(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let scientific = format!("{value:.16e}");
    let Some((mantissa, Ok(exponent))) = scientific
        .split_once('e')
        .map(|(m, e)| (m, e.parse::<i32>()))
    else {
        return scientific;
    };
    if (-4..17).contains(&exponent) {
        // As many decimals as make 17 digits in all.
        let decimals = usize::try_from(16 - exponent).unwrap_or(0);
        trim_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{}e{exponent:+03}", trim_zeros(mantissa))
    }
}

fn trim_zeros(decimal: &str) -> &str {
    if decimal.contains('.') {
        decimal.trim_end_matches('0').trim_end_matches('.')
    } else {
        decimal
    }
}

/// `text` in printable ASCII: OpenEXR text is bytes, and readers differ on what they mean.
fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c == ' ' || c.is_ascii_graphic() {
            out.push(c);
        } else {
            out.extend(c.escape_unicode());
        }
    }
    out
}

/// One layer of `size` (voxels along x and y) as an OpenEXR file.
///
/// Equal arguments give equal bytes. The work is done on the calling thread.
///
/// # Errors
/// [`ExrError`] when a channel's name or length is wrong or the layer does not fit the format.
///
/// ```
/// # use voxlathe::io::exr::{Attributes, Compression, LayerChannels, decode_layer, encode_layer};
/// let sdf = [-0.5_f32, 0.25, 1.0, 2.0, 3.0, 4.0];
/// let channels = LayerChannels { sdf: Some(&sdf), ..Default::default() };
/// let bytes = encode_layer([3, 2], &channels.list(), &Attributes::new(), Compression::Zip)?;
/// assert_eq!(decode_layer(&bytes)?.channel("sdf").unwrap().to_f32(), sdf);
/// # Ok::<(), voxlathe::io::exr::ExrError>(())
/// ```
pub fn encode_layer(
    size: [usize; 2],
    channels: &[(&str, Samples<'_>)],
    attributes: &Attributes,
    compression: Compression,
) -> Result<Vec<u8>, ExrError> {
    let [width, height] = size;
    let compression = compression.resolve(channels.iter().map(|c| c.0)).to_exr();
    let mut sorted: Vec<_> = channels.to_vec();
    sorted.sort_by(|a, b| a.0.as_bytes().cmp(b.0.as_bytes()));
    check_channels(size, &sorted)?;
    let bytes_per_pixel: usize = sorted.iter().map(|c| c.1.kind().bytes()).sum();
    let lines = compression.scan_lines_per_block().min(height);
    // A block's size is an i32 in the file.
    let block_bytes = width as u128 * bytes_per_pixel as u128 * lines as u128;
    if width.max(height) > MAX_SIDE || width.min(height) == 0 || block_bytes > i32::MAX as u128 {
        return Err(ExrError::Size { width, height });
    }

    let descriptions: SmallVec<[ChannelDescription; 5]> = sorted
        .iter()
        .map(|(name, samples)| {
            // "Linear" only steers lossy codecs that are not offered here.
            Ok(ChannelDescription::new(
                text(name)?,
                samples.kind().to_exr(),
                true,
            ))
        })
        .collect::<Result<_, ExrError>>()?;
    let mut own = LayerAttributes {
        software_name: Some(text(concat!("voxlathe ", env!("CARGO_PKG_VERSION")))?),
        ..LayerAttributes::default()
    };
    for (name, value) in attributes {
        check_attribute_name(name)?;
        let value = match value {
            Attribute::Text(t) => AttributeValue::Text(text(&ascii(t))?),
            Attribute::Int(i) => AttributeValue::I32(*i),
            Attribute::Double(d) => AttributeValue::F64(*d),
        };
        own.other.insert(text(name)?, value);
    }
    let header = Header::new(Text::default(), Vec2(width, height), descriptions)
        .with_encoding(
            compression,
            BlockDescription::ScanLines,
            LineOrder::Increasing,
        )
        .with_attributes(own);

    let mut bytes = Vec::with_capacity(4096 + 8 * height);
    ::exr::block::write(
        Cursor::new(&mut bytes),
        SmallVec::from_vec(vec![header]),
        true,
        |meta, writer| {
            let mut compressor = writer.sequential_blocks_compressor(&meta);
            for (index, y) in (0..height).step_by(lines).enumerate() {
                let rows = lines.min(height - y);
                let mut data = Vec::with_capacity(width * rows * bytes_per_pixel);
                for row in y..y + rows {
                    for (_, samples) in &sorted {
                        append_native(&mut data, samples, row * width..(row + 1) * width);
                    }
                }
                let place = BlockIndex {
                    layer: 0,
                    pixel_position: Vec2(0, y),
                    pixel_size: Vec2(width, rows),
                    level: Vec2(0, 0),
                };
                compressor.compress_block(index, UncompressedBlock { index: place, data })?;
            }
            Ok(())
        },
    )
    .map_err(|e| ExrError::Encode {
        reason: e.to_string(),
    })?;
    sort_header(&mut bytes).ok_or_else(|| ExrError::Encode {
        reason: "its header is not laid out as expected".into(),
    })?;
    Ok(bytes)
}

fn check_channels(size: [usize; 2], sorted: &[(&str, Samples<'_>)]) -> Result<(), ExrError> {
    let [width, height] = size;
    let expected = width
        .checked_mul(height)
        .ok_or(ExrError::Size { width, height })?;
    if sorted.is_empty() {
        return Err(ExrError::NoChannels);
    }
    for (index, (name, samples)) in sorted.iter().enumerate() {
        check_channel_name(name)?;
        if index > 0 && sorted[index - 1].0 == *name {
            return Err(ExrError::DuplicateChannel {
                name: (*name).into(),
            });
        }
        if samples.len() != expected {
            return Err(ExrError::ChannelLength {
                name: (*name).into(),
                found: samples.len(),
                width,
                height,
            });
        }
    }
    Ok(())
}

pub(crate) fn check_channel_name(name: &str) -> Result<(), ExrError> {
    if name.is_empty() || name.len() > 255 || !name.bytes().all(|b| b.is_ascii_graphic()) {
        return Err(ExrError::ChannelName { name: name.into() });
    }
    Ok(())
}

fn check_attribute_name(name: &str) -> Result<(), ExrError> {
    let refuse = |reason| {
        Err(ExrError::Attribute {
            name: name.into(),
            reason,
        })
    };
    if name.is_empty() || name.len() > 255 || !name.bytes().all(|b| b.is_ascii_graphic()) {
        return refuse("must be 1 to 255 printable ASCII characters without blanks");
    }
    if ::exr::meta::header::standard_names::ALL.contains(&name.as_bytes()) {
        return refuse("is one of the format's own");
    }
    Ok(())
}

fn text(ascii: &str) -> Result<Text, ExrError> {
    Text::new_or_none(ascii).ok_or_else(|| ExrError::Attribute {
        name: ascii.into(),
        reason: "is not ASCII",
    })
}

/// Appends the samples in the machine's byte order, as the block writer wants them.
fn append_native(data: &mut Vec<u8>, samples: &Samples<'_>, range: std::ops::Range<usize>) {
    match samples {
        Samples::Half(s) => {
            for &value in &s[range] {
                data.extend_from_slice(&f16::from(value).to_bits().to_ne_bytes());
            }
        }
        Samples::Float(s) => data.extend_from_slice(bytemuck::cast_slice(&s[range])),
        Samples::Uint(s) => data.extend_from_slice(bytemuck::cast_slice(&s[range])),
    }
}

/// Where a header's attributes are: name and whole entry of each, and the end of the list.
type HeaderEntries<'a> = (Vec<(&'a [u8], &'a [u8])>, usize);

/// The attribute list starts after magic number and version, 4 bytes each.
const HEADER_START: usize = 8;

/// Splits the header: each entry is `name\0 type\0 size(i32) value`, and a zero byte ends the list.
fn header_entries(bytes: &[u8]) -> Option<HeaderEntries<'_>> {
    let until_zero = |from: usize| {
        let rest = bytes.get(from..)?;
        Some(from + rest.iter().position(|&b| b == 0)?)
    };
    let mut entries = Vec::new();
    let mut at = HEADER_START;
    while *bytes.get(at)? != 0 {
        let name_end = until_zero(at)?;
        let size_at = until_zero(name_end + 1)? + 1;
        let size = bytes.get(size_at..size_at.checked_add(4)?)?;
        let size = i32::from_le_bytes(size.try_into().ok()?);
        let end = (size_at + 4).checked_add(usize::try_from(size).ok()?)?;
        entries.push((&bytes[at..name_end], bytes.get(at..end)?));
        at = end;
    }
    Some((entries, at))
}

/// Puts the header's attributes in the order of their names; the file's length stays.
fn sort_header(bytes: &mut [u8]) -> Option<()> {
    let (mut entries, end) = header_entries(bytes)?;
    entries.sort_by(|a, b| a.0.cmp(b.0));
    let sorted: Vec<u8> = entries.into_iter().flat_map(|e| e.1).copied().collect();
    let list = bytes.get_mut(HEADER_START..end)?;
    if list.len() != sorted.len() {
        return None;
    }
    list.copy_from_slice(&sorted);
    Some(())
}

/// The samples of one channel of a decoded layer.
#[derive(Debug, Clone, PartialEq)]
pub enum DecodedSamples {
    /// HALF.
    Half(Vec<f16>),
    /// FLOAT.
    Float(Vec<f32>),
    /// UINT.
    Uint(Vec<u32>),
}

impl DecodedSamples {
    /// The values as f32: exact for halves and floats, rounded for integers above 2^24.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "the rounding is documented")]
    pub fn to_f32(&self) -> Vec<f32> {
        match self {
            Self::Half(s) => s.iter().map(|v| v.to_f32()).collect(),
            Self::Float(s) => s.clone(),
            Self::Uint(s) => s.iter().map(|&v| v as f32).collect(),
        }
    }

    /// The type of the samples in the file.
    #[must_use]
    pub fn kind(&self) -> SampleKind {
        match self {
            Self::Half(_) => SampleKind::Half,
            Self::Float(_) => SampleKind::Float,
            Self::Uint(_) => SampleKind::Uint,
        }
    }

    fn with_capacity(kind: SampleType, n: usize) -> Self {
        match kind {
            SampleType::F16 => Self::Half(Vec::with_capacity(n)),
            SampleType::F32 => Self::Float(Vec::with_capacity(n)),
            SampleType::U32 => Self::Uint(Vec::with_capacity(n)),
        }
    }

    /// Appends samples in the machine's byte order.
    fn extend_native(&mut self, bytes: &[u8]) {
        let four = |b: &[u8]| [b[0], b[1], b[2], b[3]];
        match self {
            Self::Half(s) => s.extend(
                bytes
                    .chunks_exact(2)
                    .map(|b| f16::from_ne_bytes([b[0], b[1]])),
            ),
            Self::Float(s) => {
                s.extend(bytes.chunks_exact(4).map(|b| f32::from_ne_bytes(four(b))));
            }
            Self::Uint(s) => {
                s.extend(bytes.chunks_exact(4).map(|b| u32::from_ne_bytes(four(b))));
            }
        }
    }
}

/// A layer read back.
#[derive(Debug, Clone, PartialEq)]
pub struct DecodedLayer {
    /// Voxels along x and y.
    pub size: [usize; 2],
    /// Channels in alphabetical order.
    pub channels: Vec<(String, DecodedSamples)>,
    /// Custom attributes of the types that stacks have.
    pub attributes: Attributes,
}

impl DecodedLayer {
    /// The samples of the channel with this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&DecodedSamples> {
        self.channels.iter().find(|c| c.0 == name).map(|c| &c.1)
    }
}

/// The layer in the OpenEXR file `bytes`.
///
/// The memory taken is bounded by a multiple of the file's size, whatever its header says.
///
/// # Errors
/// [`ExrError::Damaged`] when the bytes are not an intact file, [`ExrError::Unsupported`] when it
/// is not one flat scan-line image at the origin.
pub fn decode_layer(bytes: &[u8]) -> Result<DecodedLayer, ExrError> {
    let damaged = |e: ::exr::error::Error| ExrError::Damaged {
        reason: e.to_string(),
    };
    let unsupported = |reason| Err(ExrError::Unsupported { reason });
    let reader = ::exr::block::read(Cursor::new(bytes), true).map_err(damaged)?;
    let [header] = reader.headers() else {
        return unsupported("the file has several parts");
    };
    if header.deep || header.blocks != BlockDescription::ScanLines {
        return unsupported("the file has tiles or deep samples");
    }
    if header.own_attributes.layer_position != Vec2(0, 0) {
        return unsupported("the data window does not start at (0, 0)");
    }
    if header
        .channels
        .list
        .iter()
        .any(|c| c.sampling != Vec2(1, 1))
    {
        return unsupported("a channel is subsampled");
    }
    let Vec2(width, height) = header.layer_size;
    let promised = (width as u64)
        .saturating_mul(height as u64)
        .saturating_mul(header.channels.bytes_per_pixel as u64);
    if promised > (bytes.len() as u64).saturating_mul(MAX_EXPANSION) {
        return Err(ExrError::Damaged {
            reason: format!(
                "{width} x {height} voxels cannot come from {} bytes",
                bytes.len()
            ),
        });
    }
    let mut channels: Vec<(String, DecodedSamples)> = header
        .channels
        .list
        .iter()
        .map(|c| {
            let n = width.saturating_mul(height).min(MAX_RESERVED);
            let samples = DecodedSamples::with_capacity(c.sample_type, n);
            (c.name.to_string(), samples)
        })
        .collect();
    let widths: Vec<usize> = header
        .channels
        .list
        .iter()
        .map(|c| c.sample_type.bytes_per_sample() * width)
        .collect();
    let attributes = decoded_attributes(&header.own_attributes);

    let mut blocks = reader
        .all_chunks(true)
        .map_err(damaged)?
        .sequential_decompressor(true);
    let mut next_row = 0;
    while let Some(block) = blocks.decompress_next_block() {
        let block = block.map_err(damaged)?;
        let rows = block.index.pixel_size.height();
        let line: usize = widths.iter().sum();
        if block.index.pixel_position != Vec2(0, next_row)
            || block.index.pixel_size.width() != width
            || block.data.len() != line * rows
        {
            return Err(ExrError::Damaged {
                reason: format!("the lines after row {next_row} are out of order"),
            });
        }
        let mut rest = block.data.as_slice();
        for _ in 0..rows {
            for (channel, &n) in channels.iter_mut().zip(&widths) {
                let (head, tail) = rest.split_at(n);
                channel.1.extend_native(head);
                rest = tail;
            }
        }
        next_row += rows;
    }
    if next_row != height {
        return Err(ExrError::Damaged {
            reason: format!("{next_row} of {height} rows are there"),
        });
    }
    Ok(DecodedLayer {
        size: [width, height],
        channels,
        attributes,
    })
}

fn decoded_attributes(own: &LayerAttributes) -> Attributes {
    own.other
        .iter()
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(t) => Attribute::Text(t.to_string()),
                AttributeValue::I32(i) => Attribute::Int(*i),
                AttributeValue::F64(d) => Attribute::Double(*d),
                _ => return None,
            };
            Some((name.to_string(), value))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const SIZE: [usize; 2] = [7, 13];

    struct Layer {
        occupancy: Vec<u8>,
        fraction: Vec<f32>,
        sdf: Vec<f32>,
        material: Vec<u32>,
    }

    impl Layer {
        /// A ball of radius 0.35 in the unit square, all channels.
        #[allow(clippy::cast_precision_loss, reason = "small test images")]
        fn ball([nx, ny]: [usize; 2]) -> Self {
            let sdf: Vec<f32> = (0..nx * ny)
                .map(|n| {
                    let x = ((n % nx) as f64 + 0.5) / nx as f64 - 0.5;
                    let y = ((n / nx) as f64 + 0.5) / ny as f64 - 0.5;
                    (x.hypot(y).hypot(0.1) - 0.35) as f32
                })
                .collect();
            Self {
                occupancy: sdf.iter().map(|&d| u8::from(d <= 0.0)).collect(),
                fraction: sdf
                    .iter()
                    .map(|&d| (0.5 - d * nx as f32).clamp(0.0, 1.0))
                    .collect(),
                material: sdf
                    .iter()
                    .map(|&d| if d <= 0.0 { 70_000 } else { 0 })
                    .collect(),
                sdf,
            }
        }

        fn channels(&self) -> LayerChannels<'_> {
            LayerChannels {
                occupancy: Some(&self.occupancy),
                fraction: Some(&self.fraction),
                sdf: Some(&self.sdf),
                material: Some(&self.material),
            }
        }
    }

    fn grid() -> GridSpec {
        GridSpec::new([7, 13, 5], DVec3::new(-0.1, 0.0, 1e-7), DVec3::splat(0.3)).unwrap()
    }

    fn attributes() -> Attributes {
        layer_attributes(&grid(), 3, "mm", Some(("tour \u{e9}", "abc123")))
    }

    #[test]
    fn every_compression_and_channel_comes_back() {
        let layer = Layer::ball(SIZE);
        for compression in Compression::ALL {
            let list = layer.channels().list();
            let bytes = encode_layer(SIZE, &list, &attributes(), compression).unwrap();
            let found = decode_layer(&bytes).unwrap();
            assert_eq!(found.size, SIZE);
            let names: Vec<_> = found.channels.iter().map(|c| c.0.as_str()).collect();
            assert_eq!(names, ["fraction", "material", "occupancy", "sdf"]);
            assert_eq!(
                found.channel("material"),
                Some(&DecodedSamples::Uint(layer.material.clone())),
                "{compression}"
            );
            let occupancy = layer.occupancy.iter().map(|&v| f16::from(v)).collect();
            assert_eq!(
                found.channel("occupancy"),
                Some(&DecodedSamples::Half(occupancy)),
                "{compression}"
            );
            for (name, wanted) in [("sdf", &layer.sdf), ("fraction", &layer.fraction)] {
                let values = found.channel(name).unwrap().to_f32();
                let allowed = if compression == Compression::Pxr24 {
                    1.0 / 65536.0
                } else {
                    0.0
                };
                for (a, b) in values.iter().zip(wanted) {
                    assert!(
                        (a - b).abs() <= allowed * b.abs(),
                        "{compression} {name}: {a} is not {b}"
                    );
                }
            }
            assert_eq!(found.attributes["voxlathe:slice"], Attribute::Int(3));
        }
    }

    #[test]
    fn every_single_channel_and_odd_size_comes_back() {
        for size in [[1, 1], [1, 67], [67, 1], [33, 17]] {
            let layer = Layer::ball(size);
            for compression in Compression::ALL {
                for (name, samples) in layer.channels().list() {
                    let bytes =
                        encode_layer(size, &[(name, samples)], &Attributes::new(), compression)
                            .unwrap();
                    let found = decode_layer(&bytes).unwrap();
                    assert_eq!(found.size, size);
                    assert_eq!(found.channels[0].0, name);
                    assert_eq!(found.channels[0].1.kind(), samples.kind());
                }
            }
        }
    }

    #[test]
    fn constant_layers_come_back_however_small_the_file() {
        let zeros = vec![0.0_f32; 1024 * 1024];
        let list = [("fraction", Samples::Float(&zeros))];
        for compression in Compression::ALL {
            let bytes = encode_layer([1024, 1024], &list, &Attributes::new(), compression).unwrap();
            let found = decode_layer(&bytes).unwrap();
            assert!(found.channel("fraction") == Some(&DecodedSamples::Float(zeros.clone())));
        }
    }

    #[test]
    fn a_header_alone_cannot_claim_memory() {
        let list = [("sdf", Samples::Float(&[0.0]))];
        let mut bytes = encode_layer([1, 1], &list, &Attributes::new(), Compression::None).unwrap();
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        bytes[at + 8..at + 12].copy_from_slice(&1_000_000_000_i32.to_le_bytes());
        let error = decode_layer(&bytes).unwrap_err().to_string();
        assert!(
            error.starts_with("not an intact OpenEXR file (1000000001 x 1 voxels"),
            "{error}"
        );
        bytes[at + 12..at + 16].copy_from_slice(&1_000_000_000_i32.to_le_bytes());
        assert!(decode_layer(&bytes).is_err());
    }

    #[test]
    fn special_floats_keep_their_bits() {
        let sdf = [
            f32::INFINITY,
            f32::NEG_INFINITY,
            -0.0,
            f32::from_bits(1),
            f32::MAX,
            f32::MIN_POSITIVE,
        ];
        for compression in Compression::ALL {
            if compression == Compression::Pxr24 {
                continue;
            }
            let list = [("sdf", Samples::Float(&sdf))];
            let bytes = encode_layer([3, 2], &list, &Attributes::new(), compression).unwrap();
            let found = decode_layer(&bytes)
                .unwrap()
                .channel("sdf")
                .unwrap()
                .to_f32();
            let bits = |s: &[f32]| s.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&found), bits(&sdf), "{compression}");
        }
    }

    #[test]
    fn attributes_say_where_the_layer_is() {
        let layer = Layer::ball(SIZE);
        let bytes = encode_layer(
            SIZE,
            &layer.channels().list(),
            &attributes(),
            Compression::Zip,
        )
        .unwrap();
        let found = decode_layer(&bytes).unwrap().attributes;
        let text = |s: &str| Attribute::Text(s.into());
        let wanted = [
            ("voxlathe:dims", text("7 13 5")),
            (
                "voxlathe:origin",
                text("-0.10000000000000001 0 9.9999999999999995e-08"),
            ),
            ("voxlathe:scene", text("tour \\u{e9}")),
            ("voxlathe:sceneHash", text("abc123")),
            ("voxlathe:signConvention", text("negative-inside")),
            ("voxlathe:slice", Attribute::Int(3)),
            (
                "voxlathe:spacing",
                text("0.29999999999999999 0.29999999999999999 0.29999999999999999"),
            ),
            ("voxlathe:units", text("mm")),
            ("voxlathe:z", Attribute::Double(grid().centre_along(2, 3))),
        ];
        let found: Vec<_> = found.iter().map(|(n, v)| (n.as_str(), v.clone())).collect();
        assert_eq!(found, wanted);
    }

    #[test]
    fn header_is_sorted_and_chunk_offsets_are_right() {
        let layer = Layer::ball([7, 67]);
        let mut many = attributes();
        for n in 0..40 {
            many.insert(format!("user:attribute{n:02}"), Attribute::Int(n));
        }
        for compression in Compression::ALL {
            let bytes =
                encode_layer([7, 67], &layer.channels().list(), &many, compression).unwrap();
            let (entries, end) = header_entries(&bytes).unwrap();
            assert!(entries.len() > 50);
            assert!(
                entries.windows(2).all(|w| w[0].0 < w[1].0),
                "sorted, no duplicates"
            );
            let lines = compression.resolve(["sdf"]).to_exr().scan_lines_per_block();
            let mut at = end + 1 + 8 * 67_usize.div_ceil(lines);
            for (n, y) in (0..67).step_by(lines).enumerate() {
                let slot = end + 1 + 8 * n;
                let offset = u64::from_le_bytes(bytes[slot..slot + 8].try_into().unwrap());
                assert_eq!(offset, at as u64, "{compression}, block {n}");
                let int = |p: usize| i32::from_le_bytes(bytes[p..p + 4].try_into().unwrap());
                assert_eq!(int(at), y);
                at += 8 + usize::try_from(int(at + 4)).unwrap();
            }
            assert_eq!(at, bytes.len());
        }
    }

    #[test]
    fn equal_layers_give_equal_bytes() {
        let layer = Layer::ball(SIZE);
        let mut many = attributes();
        for n in 0..40 {
            many.insert(format!("user:attribute{n:02}"), Attribute::Int(n));
        }
        let list = layer.channels().list();
        let mut reversed = list.clone();
        reversed.reverse();
        let first = encode_layer(SIZE, &list, &many, Compression::Zip).unwrap();
        for _ in 0..20 {
            // Every hash map of the process has its own seed, so each round shuffles anew.
            assert_eq!(
                encode_layer(SIZE, &list, &many, Compression::Zip).unwrap(),
                first
            );
        }
        assert_eq!(
            encode_layer(SIZE, &reversed, &many, Compression::Zip).unwrap(),
            first
        );
    }

    /// Writes a layer where the parent test wants it; alone it does nothing.
    #[test]
    #[ignore = "the child half of separate_processes_give_equal_bytes"]
    fn layer_child() {
        let Some(file) = std::env::var_os("VOXLATHE_TEST_OUT") else {
            return;
        };
        let layer = Layer::ball(SIZE);
        let list = layer.channels().list();
        let bytes = encode_layer(SIZE, &list, &attributes(), Compression::Piz).unwrap();
        std::fs::write(file, bytes).unwrap();
    }

    #[test]
    fn separate_processes_give_equal_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let files: Vec<_> = (0..2)
            .map(|n| {
                let file = dir.path().join(n.to_string());
                let status = std::process::Command::new(std::env::current_exe().unwrap())
                    .args(["--ignored", "--exact", "io::exr::tests::layer_child"])
                    .env("VOXLATHE_TEST_OUT", &file)
                    .output()
                    .unwrap()
                    .status;
                assert!(status.success());
                std::fs::read(file).unwrap()
            })
            .collect();
        assert!(!files[0].is_empty());
        assert_eq!(files[0], files[1]);
    }

    #[test]
    fn bad_layers_are_refused_with_reasons() {
        let encode = |list: &[(&str, Samples<'_>)]| {
            encode_layer([2, 2], list, &Attributes::new(), Compression::Zip)
                .unwrap_err()
                .to_string()
        };
        let four = [0.0_f32; 4];
        assert_eq!(
            encode(&[]),
            "a layer needs at least one channel; name one, such as sdf"
        );
        assert_eq!(
            encode(&[("sdf", Samples::Float(&four[..3]))]),
            "channel \"sdf\" has 3 samples; a layer of 2 x 2 voxels needs 4"
        );
        assert_eq!(
            encode(&[
                ("sdf", Samples::Float(&four)),
                ("sdf", Samples::Float(&four))
            ]),
            "channel \"sdf\" appears twice; each channel needs its own name"
        );
        assert_eq!(
            encode(&[("a b", Samples::Float(&four))]),
            "channel name \"a b\" is not usable; use 1 to 255 printable ASCII characters without blanks"
        );
        let mut reserved = Attributes::new();
        reserved.insert("channels".into(), Attribute::Int(1));
        assert_eq!(
            encode_layer(
                [2, 2],
                &[("sdf", Samples::Float(&four))],
                &reserved,
                Compression::Zip
            )
            .unwrap_err()
            .to_string(),
            "header attribute \"channels\" is one of the format's own; rename or drop it"
        );
        assert_eq!(
            encode_layer(
                [0, 5],
                &[("sdf", Samples::Float(&[]))],
                &Attributes::new(),
                Compression::Zip
            ),
            Err(ExrError::Size {
                width: 0,
                height: 5
            })
        );
        assert!(
            encode_layer(
                [usize::MAX, 2],
                &[("sdf", Samples::Float(&four))],
                &Attributes::new(),
                Compression::Zip
            )
            .is_err()
        );
    }

    #[test]
    fn damaged_files_are_refused_without_panic() {
        let layer = Layer::ball(SIZE);
        for compression in Compression::ALL {
            let bytes =
                encode_layer(SIZE, &layer.channels().list(), &attributes(), compression).unwrap();
            for end in 0..bytes.len() {
                assert!(decode_layer(&bytes[..end]).is_err(), "cut at {end}");
            }
            let mut state = 1_u64;
            for _ in 0..3000 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let mut flipped = bytes.clone();
                let at = usize::try_from(state >> 33).unwrap() % flipped.len();
                flipped[at] ^= 1 << ((state >> 20) & 7);
                let _ = decode_layer(&flipped);
            }
        }
        assert!(matches!(
            decode_layer(b"not an image"),
            Err(ExrError::Damaged { .. })
        ));
    }

    #[test]
    fn compression_names_come_back() {
        for compression in Compression::ALL {
            assert_eq!(compression.name().parse(), Ok(compression));
            let json = serde_json::to_string(&compression).unwrap();
            assert_eq!(json, format!("\"{compression}\""));
        }
        assert_eq!(
            "gzip".parse::<Compression>().unwrap_err().to_string(),
            "unknown compression \"gzip\"; it must be none, rle, zips, zip, piz, pxr24 or auto"
        );
    }

    #[test]
    fn seventeen_digits_survive() {
        for (value, wanted) in [
            (0.1, "0.10000000000000001"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.0, "0"),
            (1e300, "1.0000000000000001e+300"),
            (1e-5, "1.0000000000000001e-05"),
            (123_456_789.0, "123456789"),
            (1e16, "10000000000000000"),
            (1e17, "1e+17"),
        ] {
            assert_eq!(decimal17(value), wanted);
        }
        let mut state = 7_u64;
        for _ in 0..10_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let value = f64::from_bits(state);
            if value.is_finite() {
                assert_eq!(decimal17(value).parse(), Ok(value));
            }
        }
    }

    /// How the table of [`Compression::resolve`] was made.
    #[test]
    #[ignore = "a measurement"]
    #[allow(clippy::cast_precision_loss, reason = "only printed")]
    fn measure_compressions() {
        let size = [512, 512];
        let layer = Layer::ball(size);
        let all = layer.channels();
        let masks = LayerChannels { sdf: None, ..all };
        let mut table = String::new();
        for (name, channels) in [
            (
                "sdf",
                LayerChannels {
                    sdf: all.sdf,
                    ..Default::default()
                },
            ),
            (
                "occupancy fraction sdf",
                LayerChannels {
                    material: None,
                    ..all
                },
            ),
            (
                "occupancy fraction",
                LayerChannels {
                    material: None,
                    ..masks
                },
            ),
            (
                "occupancy",
                LayerChannels {
                    occupancy: all.occupancy,
                    ..Default::default()
                },
            ),
        ] {
            let list = channels.list();
            let raw: usize = list.iter().map(|c| c.1.len() * c.1.kind().bytes()).sum();
            for compression in &Compression::ALL[..6] {
                let rounds = 5;
                let mut best = f64::INFINITY;
                let mut bytes = Vec::new();
                for _ in 0..rounds {
                    let start = std::time::Instant::now();
                    bytes = encode_layer(size, &list, &attributes(), *compression).unwrap();
                    best = best.min(start.elapsed().as_secs_f64());
                }
                use std::fmt::Write as _;
                writeln!(
                    table,
                    "{name:24} {compression:6} ratio {:.3}  {:6.0} MB/s",
                    bytes.len() as f64 / raw as f64,
                    raw as f64 / best / 1e6
                )
                .unwrap();
            }
        }
        eprintln!("{table}");
    }
}
