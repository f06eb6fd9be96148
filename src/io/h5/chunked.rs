//! Arrays in chunks of some layers, each a zlib stream.
//!
//! The chunks of all arrays stand in the order of their layers, whoever brings them; then the trees that find them. The
//! head, whose size is known beforehand, comes last.
//!
//! Source: The HDF Group, *HDF5 File Format Specification*, version 3.0, III.A.1 (version 1 B-trees).

use std::borrow::Cow;
use std::fs;
use std::io;
use std::os::unix::fs::FileExt as _;

use super::head::{self, Array, Held};
use super::object::UNDEFINED;
use crate::io::deflate;
use crate::io::error::IoError;
use crate::io::format::{Description, Element, Format, Layer, Needs, record};
use crate::io::manifest::FileRecord;
use crate::io::staged::{Groups, OrderedFile, StagedFiles};

/// Children of a node at most: twice the rank that a superblock without an extension has.
const CHILDREN: usize = 64;
/// Sides of an array and of its elements.
const SIDES: usize = 4;
/// Bytes of a node: signature and siblings, children, and a key about each.
const NODE: usize = 24 + CHILDREN * 8 + (CHILDREN + 1) * KEY;
const KEY: usize = 8 + 8 * SIDES;

/// Layers of a chunk: the same for all channels, so that their chunks take turns.
fn depth(of: &Description) -> usize {
    let largest = of.channels.iter().map(|c| of.layer_bytes(c)).max();
    Groups::layers_of_each(largest.unwrap_or(1), of.grid.dims()[2])
}

pub(super) fn needs(of: &Description, head: u64) -> Needs {
    let (arrays, layers) = (of.array_bytes(), of.grid.dims()[2] as u64);
    let count = of.channels.len() as u64;
    let chunk = of.all_layer_bytes().saturating_mul(depth(of) as u64);
    let trees = count * (layers / 32 + 2) * NODE as u64;
    Needs {
        // The last chunk is whole, and what waits for its turn is there twice.
        disk: (arrays + arrays / 1000 + chunk).saturating_mul(2) + trees + head,
        disk_is_sure: false,
        memory: 2 * chunk + trees + 2 * head,
        each: 3 * chunk / 2 + (1 << 20),
    }
}

/// The file in the making.
#[derive(Debug)]
pub(super) struct File {
    of: Description,
    file: OrderedFile,
    arrays: Vec<(Array, Groups)>,
    head: u64,
    depth: usize,
}

impl File {
    pub(super) fn begin(files: &StagedFiles, of: &Description) -> Result<Self, IoError> {
        let depth = depth(of);
        let none = Held::Chunks {
            layers: depth as u64,
            trees: vec![0; head::arrays(of).len()],
            length: 0,
        };
        let head = head::of(of, &none).bytes.len() as u64;
        let arrays = head::arrays(of).into_iter().map(|array| {
            let groups = Groups::of_layers(depth, array.layer_bytes, array.dims[2]);
            (array, groups)
        });
        Ok(Self {
            file: OrderedFile::create(files, &of.whole_file("h5"), head)?,
            arrays: arrays.collect(),
            of: of.clone(),
            head,
            depth,
        })
    }
}

impl Format for File {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        let count = self.arrays.len();
        for (number, (array, groups)) in self.arrays.iter().enumerate() {
            for (k, bytes) in array.parts(&self.of, layer) {
                groups.add(k, &bytes, |piece, bytes| {
                    let mut whole = Cow::Borrowed(bytes);
                    if bytes.len() < groups.piece_bytes() {
                        // The last chunk is as large as the others.
                        whole.to_mut().resize(groups.piece_bytes(), 0);
                    }
                    let compressed = deflate::zlib(&whole);
                    self.file.add(files, piece * count + number, &compressed)
                })?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let Self {
            of,
            file,
            arrays,
            head,
            depth,
        } = *self;
        // An array that is one layer longer may have a chunk more: the others have nothing there.
        let count = arrays.len();
        let most = arrays
            .iter()
            .map(|(_, groups)| groups.count())
            .max()
            .unwrap_or(0);
        for (number, (_, groups)) in arrays.iter().enumerate() {
            for piece in groups.count()..most {
                file.add(files, piece * count + number, &[])?;
            }
        }
        let ending = |file: &fs::File, end: u64, sizes: &[u64]| {
            let mut at = head;
            let mut chunks = vec![Vec::new(); count];
            for (n, &size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0) {
                chunks[n % count].push((at, size));
                at += size;
            }
            let mut next = end.next_multiple_of(8);
            let mut trees = Vec::new();
            for ((array, _), chunks) in arrays.iter().zip(&chunks) {
                let element = Element::of(of.channels[array.channel].kind).bytes() as u64;
                let [nx, ny, _] = array.dims.map(|n| n as u64);
                let (bytes, root) = tree(chunks, next, [depth as u64, ny, nx, element])?;
                file.write_all_at(&bytes, next)?;
                next += bytes.len() as u64;
                trees.push(root);
            }
            let held = Held::Chunks {
                layers: depth as u64,
                trees,
                length: next,
            };
            file.write_all_at(&head::of(&of, &held).bytes, 0)
        };
        Ok(vec![file.finish(files, ending).map(record)?])
    }
}

/// The nodes of a tree of chunks, which begin at `start`, and where its root is.
///
/// * `chunks`: place and size of each, by rising layers.
/// * `sides`: of a chunk, and of an element.
fn tree(chunks: &[(u64, u64)], start: u64, sides: [u64; SIDES]) -> io::Result<(Vec<u8>, u64)> {
    let mut bytes = Vec::new();
    // Address, size and number of the first chunk of each child.
    let mut children: Vec<(u64, u64, u64)> = (chunks.iter().zip(0..))
        .map(|(&(at, size), n)| (at, size, n))
        .collect();
    let key = |size: u64, n: u64, is_end: bool| -> io::Result<Vec<u8>> {
        let size = u32::try_from(size).map_err(|_| {
            io::Error::other("a chunk has more than 4 GiB, which HDF5 does not allow")
        })?;
        let mut key = size.to_le_bytes().to_vec();
        key.extend([0; 4]);
        // What is beyond the last chunk is one further along each side.
        let beyond = u64::from(is_end);
        for (axis, side) in sides.iter().enumerate() {
            let place = if axis == 0 { n } else { beyond };
            key.extend((place * side).to_le_bytes());
        }
        Ok(key)
    };
    for level in 0_u8.. {
        let nodes: Vec<_> = children.chunks(CHILDREN).collect();
        let (first, count) = (start + bytes.len() as u64, nodes.len());
        let address = |node: usize| first + (node * NODE) as u64;
        let mut above = Vec::new();
        for (node, list) in nodes.iter().enumerate() {
            let mut text = b"TREE\x01".to_vec();
            text.push(level);
            #[allow(clippy::cast_possible_truncation, reason = "64 at most")]
            text.extend((list.len() as u16).to_le_bytes());
            let left = node.checked_sub(1).map_or(UNDEFINED, address);
            let right = if node + 1 < count {
                address(node + 1)
            } else {
                UNDEFINED
            };
            text.extend([left.to_le_bytes(), right.to_le_bytes()].concat());
            for &(at, size, n) in *list {
                text.extend(key(size, n, false)?);
                text.extend(at.to_le_bytes());
            }
            let next = nodes.get(node + 1).map(|next| next[0]);
            text.extend(match next {
                Some((_, size, n)) => key(size, n, false)?,
                None => key(0, chunks.len() as u64, true)?,
            });
            text.resize(NODE, 0);
            above.push((address(node), list[0].1, list[0].2));
            bytes.extend(text);
        }
        if count == 1 {
            return Ok((bytes, first));
        }
        children = above;
    }
    Err(io::Error::other("a tree of chunks has no root"))
}
