//! Nearly raw raster data: `CHANNEL.nrrd`, a header of lines and the samples after it.
//!
//! `space origin` is the centre of the first voxel. `space dimension` is given, and not a `space` of a patient: readers
//! of medical images would turn the axes.
//!
//! A gzip stream is made of pieces that are compressed by themselves and end at a byte; since each begins with nothing
//! to refer back to, they may be made at the same time and put one after the other.
//!
//! Source: Kindlmann, *Definition of NRRD File Format*; Deutsch, RFC 1951 and RFC 1952.

use std::os::unix::fs::FileExt as _;
use std::sync::{Mutex, PoisonError};

use flate2::Crc;

use super::deflate;
use super::error::IoError;
use super::format::{
    BUFFER, Description, Element, Format, Layer, Needs, NrrdEncoding, decimal, digest_bytes, record,
};
use super::manifest::FileRecord;
use super::raw::{Array, spread};
use super::stack::ChannelSpec;
use super::staged::{Groups, OrderedFile, StagedFiles};

pub(super) fn needs(of: &Description, encoding: NrrdEncoding) -> Needs {
    let arrays = of.array_bytes();
    let heads = super::format::SMALL * of.channels.len() as u64;
    match encoding {
        NrrdEncoding::Raw => Needs {
            disk: arrays.saturating_add(heads),
            disk_is_sure: true,
            memory: digest_bytes(arrays),
            each: BUFFER,
        },
        NrrdEncoding::Gzip => Needs {
            // Deflate adds 5 bytes to each 16 KiB that it cannot make smaller; what waits for its turn is there twice.
            disk: (arrays + arrays / 1000).saturating_mul(2) + heads,
            disk_is_sure: false,
            memory: kept(of),
            each: compressed_bytes(of),
        },
    }
}

/// Bytes that are kept of layers that are too small to be compressed by themselves.
pub(super) fn kept(of: &Description) -> u64 {
    let layers = of.grid.dims()[2];
    let each = of.channels.iter();
    each.map(|c| Groups::kept(of.layer_bytes(c), layers)).sum()
}

/// Bytes of the largest piece while it is compressed, the compressor's own state included.
pub(super) fn compressed_bytes(of: &Description) -> u64 {
    let layers = of.grid.dims()[2];
    let largest = of.channels.iter().map(|c| {
        let groups = Groups::new(of.layer_bytes(c), layers);
        groups.piece_bytes() as u64
    });
    3 * largest.max().unwrap_or(0) / 2 + (1 << 20)
}

pub(super) fn begin(
    files: &StagedFiles,
    of: &Description,
    encoding: NrrdEncoding,
) -> Result<Box<dyn Format>, IoError> {
    let name = |channel| of.channel_file(channel, "nrrd");
    Ok(match encoding {
        NrrdEncoding::Raw => {
            let arrays = of.channels.iter().enumerate().map(|(n, channel)| {
                let head = header(of, channel, "raw");
                Array::begin(files, of, n, &name(channel), head.as_bytes())
            });
            Box::new(Plain {
                arrays: arrays.collect::<Result<_, _>>()?,
                of: of.clone(),
            })
        }
        NrrdEncoding::Gzip => {
            let streams = of.channels.iter().map(|channel| {
                let head = header(of, channel, "gzip").into_bytes();
                Stream::begin(files, of, channel, &name(channel), head)
            });
            Box::new(Gzipped {
                streams: streams.collect::<Result<_, _>>()?,
                of: of.clone(),
            })
        }
    })
}

/// Arrays as they are.
#[derive(Debug)]
struct Plain {
    of: Description,
    arrays: Vec<Array>,
}

impl Format for Plain {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        spread(&self.of, &self.arrays, layer)
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let arrays = self.arrays.into_iter();
        arrays.map(|array| array.finish(files)).collect()
    }
}

/// Arrays as gzip streams.
#[derive(Debug)]
struct Gzipped {
    of: Description,
    streams: Vec<Stream>,
}

impl Format for Gzipped {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (channel, stream) in self.streams.iter().enumerate() {
            for (k, bytes) in layer.parts(&self.of, channel) {
                stream.layer(files, k, &bytes)?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let streams = self.streams.into_iter();
        streams.map(|stream| stream.finish(files)).collect()
    }
}

/// What a gzip stream begins with: deflate, no name, no time, an unknown system.
const GZIP: [u8; 10] = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];

/// One gzip stream in the making.
#[derive(Debug)]
struct Stream {
    file: OrderedFile,
    head: Vec<u8>,
    groups: Groups,
    checks: Mutex<Vec<Option<Crc>>>,
}

impl Stream {
    fn begin(
        files: &StagedFiles,
        of: &Description,
        channel: &ChannelSpec,
        name: &str,
        mut head: Vec<u8>,
    ) -> Result<Self, IoError> {
        head.extend(GZIP);
        let lattice = of.lattice(channel);
        let groups = Groups::new(lattice.layer_bytes(channel), lattice.dims[2]);
        Ok(Self {
            file: OrderedFile::create(files, name, head.len() as u64)?,
            head,
            checks: Mutex::new((0..groups.count()).map(|_| None).collect()),
            groups,
        })
    }

    fn layer(&self, files: &StagedFiles, k: usize, bytes: &[u8]) -> Result<(), IoError> {
        self.groups.add(k, bytes, |piece, bytes| {
            let mut check = Crc::new();
            check.update(bytes);
            let compressed = deflate::piece(bytes);
            let mut checks = self.checks.lock().unwrap_or_else(PoisonError::into_inner);
            checks[piece] = Some(check);
            drop(checks);
            self.file.add(files, piece, &compressed)
        })
    }

    fn finish(self, files: &StagedFiles) -> Result<FileRecord, IoError> {
        let mut whole = Crc::new();
        let checks = self
            .checks
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        checks
            .iter()
            .flatten()
            .for_each(|check| whole.combine(check));
        let tail = [
            &deflate::LAST[..],
            &whole.sum().to_le_bytes(),
            &whole.amount().to_le_bytes(),
        ]
        .concat();
        let ending = |file: &std::fs::File, end, _: &[u64]| {
            file.write_all_at(&self.head, 0)?;
            file.write_all_at(&tail, end)
        };
        self.file.finish(files, ending).map(record)
    }
}

fn header(of: &Description, channel: &ChannelSpec, encoding: &str) -> String {
    let lattice = of.lattice(channel);
    let kind = match Element::of(channel.kind) {
        Element::U8 => "uint8",
        Element::U32 => "uint32",
        Element::F32 => "float",
        Element::F64 => "double",
    };
    let [nx, ny, nz] = lattice.dims;
    let [dx, dy, dz] = lattice.spacing.map(decimal);
    let [x, y, z] = lattice.first.map(decimal);
    let units = &of.units;
    format!(
        "NRRD0005\n\
         # {}, {} of {}\n\
         type: {kind}\n\
         dimension: 3\n\
         space dimension: 3\n\
         sizes: {nx} {ny} {nz}\n\
         space directions: ({dx},0,0) (0,{dy},0) (0,0,{dz})\n\
         kinds: domain domain domain\n\
         centers: cell cell cell\n\
         endian: little\n\
         encoding: {encoding}\n\
         space units: \"{units}\" \"{units}\" \"{units}\"\n\
         space origin: ({x},{y},{z})\n\
         length_unit:={units}\n\
         sign_convention:={}\n\
         \n",
        concat!("voxlathe ", env!("CARGO_PKG_VERSION")),
        channel.name,
        of.name(),
        of.sign(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::exr::SampleKind;
    use crate::io::format::FormatKind;
    use crate::io::format::tests::{description, float, orders, written};
    use std::io::Read as _;

    #[test]
    fn one_stream_holds_all_pieces() {
        let of = description(&[("sdf", SampleKind::Float)]);
        let samples: Vec<u8> = (0..385).flat_map(|n| float(n).to_le_bytes()).collect();
        for order in orders(11) {
            for encoding in [NrrdEncoding::Raw, NrrdEncoding::Gzip] {
                let dir = tempfile::tempdir().unwrap();
                written(dir.path(), FormatKind::Nrrd(encoding), &of, &order);
                let bytes = std::fs::read(dir.path().join("sdf.nrrd")).unwrap();
                let end = bytes.windows(2).position(|w| w == b"\n\n").unwrap() + 2;
                let text = std::str::from_utf8(&bytes[..end]).unwrap();
                assert!(
                    text.contains("\nspace origin: (-1.0,0.25,7.35)\n"),
                    "{text}"
                );
                assert!(text.contains("\nsizes: 7 5 11\n"));
                let mut found = Vec::new();
                match encoding {
                    NrrdEncoding::Raw => found.extend(&bytes[end..]),
                    NrrdEncoding::Gzip => {
                        let mut stream = flate2::bufread::GzDecoder::new(&bytes[end..]);
                        stream.read_to_end(&mut found).unwrap();
                        assert!(stream.into_inner().is_empty());
                    }
                }
                assert_eq!(found, samples);
            }
        }
    }
}
