//! From samples to the bytes of a file, in one pass over both.
//!
//! ```text
//!   for each band of lines   look at the samples     from memory into the cache
//!                            copy them               from cache to cache
//!                            digest what is written  from the cache
//! ```
//!
//! A band is about 128 KiB. Without compression the place of every line is known beforehand and
//! the bytes are assembled here, as are runs; the `exr` crate compresses every other kind. A
//! [`LayerEncoder`] keeps its buffer from layer to layer, so that no layer waits for memory pages,
//! and works on the calling thread alone: layers, not lines, are what threads share.

use std::ops::Range;

use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::meta::header::Header;
use ::exr::prelude::{Compression as ExrCompression, Vec2};

use super::header::{append_header, check_channel_name, header};
use super::runs::Runs;
use super::{Attributes, Compression, ExrError, Samples};

/// The largest side of an image: OpenEXR's windows are signed 32-bit and readers want headroom.
const MAX_SIDE: usize = (i32::MAX / 2) as usize;

/// Bytes of a file that are written and digested in one go: they fit the second cache level beside
/// the samples they come from, and BLAKE3 is at its best with powers of two.
const BAND: usize = 1 << 17;

/// The y coordinate and the size in front of each block.
const BLOCK_HEAD: usize = 8;

/// Encodes layer after layer into one buffer.
///
/// ```
/// # use voxlathe::io::exr::{Attributes, Compression, LayerEncoder, Samples, encode_layer};
/// let mut encoder = LayerEncoder::default();
/// for sdf in [[-0.5_f32, 0.25], [1.0, 2.0]] {
///     let channels = [("sdf", Samples::Float(&sdf))];
///     let bytes = encoder.encode([2, 1], &channels, &Attributes::new(), Compression::None)?;
///     assert_eq!(
///         bytes,
///         encode_layer([2, 1], &channels, &Attributes::new(), Compression::None)?
///     );
/// }
/// # Ok::<(), voxlathe::io::exr::ExrError>(())
/// ```
#[derive(Debug, Default)]
pub struct LayerEncoder {
    bytes: Vec<u8>,
    head: Vec<u8>,
    block: Vec<u8>,
    runs: Runs,
}

/// A layer's bytes and their digest.
#[derive(Debug)]
pub(crate) struct Encoded<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) blake3: blake3::Hash,
}

/// What a layer is to become.
struct Plan<'a> {
    size: [usize; 2],
    /// Channels in the order of the file.
    channels: Vec<(&'a str, Samples<'a>)>,
    /// Bytes of a line of the image.
    line: usize,
    header: Header,
}

impl<'a> Plan<'a> {
    /// Fills `out` with these lines of the image: for each the samples of one channel after the
    /// other, in the byte order of `fill`.
    fn fill(
        &self,
        lines: Range<usize>,
        mut out: &mut [u8],
        fill: impl Fn(&Samples<'a>, Range<usize>, &mut [u8]),
    ) {
        let width = self.size[0];
        for y in lines {
            for (_, samples) in &self.channels {
                let part = out.split_off_mut(..width * samples.kind().bytes());
                fill(
                    samples,
                    y * width..(y + 1) * width,
                    part.unwrap_or_default(),
                );
            }
        }
    }
}

impl LayerEncoder {
    /// One layer of `size` (voxels along x and y) as an OpenEXR file; see [`encode_layer`].
    ///
    /// # Errors
    /// As [`encode_layer`].
    pub fn encode(
        &mut self,
        size: [usize; 2],
        channels: &[(&str, Samples<'_>)],
        attributes: &Attributes,
        compression: Compression,
    ) -> Result<&[u8], ExrError> {
        let plan = plan(size, channels, attributes, compression)?;
        self.assemble(&plan, |_| Ok(()), None)?;
        Ok(&self.bytes)
    }

    /// As [`encode`](Self::encode), with the digest. Each band of lines is shown to `look` while
    /// it is in the cache, before it is encoded, in order and once.
    pub(crate) fn encode_watched<E: From<ExrError>>(
        &mut self,
        size: [usize; 2],
        channels: &[(&str, Samples<'_>)],
        attributes: &Attributes,
        compression: Compression,
        look: impl FnMut(Range<usize>) -> Result<(), E>,
    ) -> Result<Encoded<'_>, E> {
        let plan = plan(size, channels, attributes, compression)?;
        let mut digest = Digest::default();
        self.assemble(&plan, look, Some(&mut digest))?;
        Ok(Encoded {
            blake3: digest.finish(&self.bytes),
            bytes: &self.bytes,
        })
    }

    fn assemble<E: From<ExrError>>(
        &mut self,
        plan: &Plan<'_>,
        look: impl FnMut(Range<usize>) -> Result<(), E>,
        digest: Option<&mut Digest>,
    ) -> Result<(), E> {
        self.head.clear();
        append_header(&mut self.head, &plan.header)?;
        if plan.header.compression == ExrCompression::Uncompressed {
            self.copy(plan, look, digest)
        } else {
            // The offsets, which come first, are known last.
            self.compress(plan, look)
        }
    }

    /// Each line is a block and has its size.
    fn copy<E>(
        &mut self,
        plan: &Plan<'_>,
        mut look: impl FnMut(Range<usize>) -> Result<(), E>,
        mut digest: Option<&mut Digest>,
    ) -> Result<(), E> {
        let height = plan.size[1];
        let block = BLOCK_HEAD + plan.line;
        let start = self.head.len() + 8 * height;
        // Whatever a former layer left is written over.
        self.bytes.resize(start + height * block, 0);
        self.bytes[..self.head.len()].copy_from_slice(&self.head);
        for (y, offset) in self.bytes[self.head.len()..start]
            .chunks_exact_mut(8)
            .enumerate()
        {
            offset.copy_from_slice(&((start + y * block) as u64).to_le_bytes());
        }
        let lines = (BAND / block).max(1);
        for first in (0..height).step_by(lines) {
            let last = (first + lines).min(height);
            look(first..last)?;
            let band = start + first * block..start + last * block;
            for (y, out) in (first..last).zip(self.bytes[band.clone()].chunks_exact_mut(block)) {
                let (head, line) = out.split_at_mut(BLOCK_HEAD);
                head.copy_from_slice(&block_head(y, plan.line));
                plan.fill(y..y + 1, line, Samples::fill_le);
            }
            if let Some(digest) = &mut digest {
                digest.reached(&self.bytes, band.end);
            }
        }
        Ok(())
    }

    fn compress<E: From<ExrError>>(
        &mut self,
        plan: &Plan<'_>,
        mut look: impl FnMut(Range<usize>) -> Result<(), E>,
    ) -> Result<(), E> {
        let height = plan.size[1];
        let lines = plan.header.compression.scan_lines_per_block().min(height);
        let table = self.head.len();
        self.bytes.clear();
        self.bytes.extend_from_slice(&self.head);
        self.bytes.resize(table + 8 * height.div_ceil(lines), 0);
        for (index, first) in (0..height).step_by(lines).enumerate() {
            let last = (first + lines).min(height);
            look(first..last)?;
            let at = self.bytes.len();
            self.bytes[table + 8 * index..][..8].copy_from_slice(&(at as u64).to_le_bytes());
            // Its size is known once it is there.
            self.bytes.extend_from_slice(&[0; BLOCK_HEAD]);
            if plan.header.compression == ExrCompression::RLE {
                self.block.resize((last - first) * plan.line, 0);
                plan.fill(first..last, &mut self.block, Samples::fill_le);
                self.runs.append(&self.block, &mut self.bytes);
            } else {
                let mut data = vec![0; (last - first) * plan.line];
                plan.fill(first..last, &mut data, Samples::fill_native);
                let pixels = compressed(&plan.header, [first, last - first], data)?;
                self.bytes.extend_from_slice(&pixels);
            }
            let head = block_head(first, self.bytes.len() - at - BLOCK_HEAD);
            self.bytes[at..at + BLOCK_HEAD].copy_from_slice(&head);
        }
        Ok(())
    }
}

/// The block of `[first, count]` lines, compressed by the crate.
fn compressed(
    header: &Header,
    [first, count]: [usize; 2],
    data: Vec<u8>,
) -> Result<Vec<u8>, ExrError> {
    let index = BlockIndex {
        layer: 0,
        pixel_position: Vec2(0, first),
        pixel_size: Vec2(header.layer_size.width(), count),
        level: Vec2(0, 0),
    };
    let chunk = UncompressedBlock { index, data }.compress_to_chunk(std::slice::from_ref(header));
    match chunk {
        Ok(Chunk {
            compressed_block: CompressedBlock::ScanLine(block),
            ..
        }) => Ok(block.compressed_pixels_le),
        Ok(_) => Err(ExrError::Encode {
            reason: "its lines did not give a block of lines".into(),
        }),
        Err(error) => Err(ExrError::Encode {
            reason: error.to_string(),
        }),
    }
}

fn block_head(y: usize, size: usize) -> [u8; BLOCK_HEAD] {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "both were checked to fit an i32"
    )]
    let [y, size] = [y as u32, size as u32].map(u32::to_le_bytes);
    let mut head = [0; BLOCK_HEAD];
    head[..4].copy_from_slice(&y);
    head[4..].copy_from_slice(&size);
    head
}

/// The digest of a growing file.
#[derive(Debug, Default)]
struct Digest {
    hasher: blake3::Hasher,
    done: usize,
}

impl Digest {
    /// The bytes before `end` are final: takes all whole bands of them.
    fn reached(&mut self, bytes: &[u8], end: usize) {
        while self.done + BAND <= end {
            self.hasher.update(&bytes[self.done..self.done + BAND]);
            self.done += BAND;
        }
    }

    fn finish(mut self, bytes: &[u8]) -> blake3::Hash {
        self.hasher.update(&bytes[self.done..]);
        self.hasher.finalize()
    }
}

/// One layer of `size` (voxels along x and y) as an OpenEXR file.
///
/// Equal arguments give equal bytes. The work is done on the calling thread. For many layers a
/// [`LayerEncoder`] spares the memory of each.
///
/// # Errors
/// [`ExrError`] when a channel's name or length is wrong or the layer does not fit the format.
///
/// ```
/// # use voxlathe::io::exr::{Attributes, Compression, Samples, decode_layer, encode_layer};
/// let sdf = [-0.5_f32, 0.25, 1.0, 2.0, 3.0, 4.0];
/// let channels = [("sdf", Samples::Float(&sdf))];
/// let bytes = encode_layer([3, 2], &channels, &Attributes::new(), Compression::Zip)?;
/// assert_eq!(decode_layer(&bytes)?.channel("sdf").unwrap().to_f32(), sdf);
/// # Ok::<(), voxlathe::io::exr::ExrError>(())
/// ```
pub fn encode_layer(
    size: [usize; 2],
    channels: &[(&str, Samples<'_>)],
    attributes: &Attributes,
    compression: Compression,
) -> Result<Vec<u8>, ExrError> {
    let mut encoder = LayerEncoder::default();
    encoder.encode(size, channels, attributes, compression)?;
    Ok(encoder.bytes)
}

fn plan<'a>(
    size: [usize; 2],
    channels: &[(&'a str, Samples<'a>)],
    attributes: &Attributes,
    compression: Compression,
) -> Result<Plan<'a>, ExrError> {
    let [width, height] = size;
    let compression = compression.resolve(channels.iter().map(|c| c.0)).to_exr();
    let mut channels = channels.to_vec();
    channels.sort_by(|a, b| a.0.as_bytes().cmp(b.0.as_bytes()));
    check_channels(size, &channels)?;
    let bytes_per_pixel: usize = channels.iter().map(|c| c.1.kind().bytes()).sum();
    let lines = compression.scan_lines_per_block().min(height);
    // A block's size is an i32 in the file.
    let block_bytes = width as u128 * bytes_per_pixel as u128 * lines as u128;
    if width.max(height) > MAX_SIDE || width.min(height) == 0 || block_bytes > i32::MAX as u128 {
        return Err(ExrError::Size { width, height });
    }
    Ok(Plan {
        size,
        line: width * bytes_per_pixel,
        header: header(size, &channels, attributes, compression)?,
        channels,
    })
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
#[cfg(test)]
mod tests;
