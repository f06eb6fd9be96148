//! Arrays in blocks of deflate.
//!
//! A block is one layer, or some where they are small: threads compress blocks at the same time. The first array goes
//! to its place at once; where the others begin is known when it ends, so they wait in files without names.

use std::fs::File;
use std::io::{self, Seek as _, SeekFrom};
use std::os::unix::fs::FileExt as _;

use super::head::{self, Held, TAIL};
use crate::io::deflate;
use crate::io::error::IoError;
use crate::io::format::{Description, Format, Layer, little_endian, record};
use crate::io::manifest::FileRecord;
use crate::io::staged::{Groups, OrderedFile, Pieces, StagedFiles};

#[derive(Debug)]
pub(super) struct Blocks {
    of: Description,
    points: bool,
    /// Bytes of the XML before the arrays.
    head: u64,
    first: OrderedFile,
    first_groups: Groups,
    others: Vec<Waiting>,
}

/// An array that waits for its place.
#[derive(Debug)]
struct Waiting {
    room: File,
    pieces: Pieces,
    groups: Groups,
}

impl Blocks {
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        points: bool,
    ) -> Result<Self, IoError> {
        let layers = of.grid.dims()[2];
        let groups = |n: usize| Groups::new(of.layer_bytes(&of.channels[n]), layers);
        let offsets = vec![0; of.channels.len()];
        let head = xml(of, points, &offsets).len() as u64;
        let first_groups = groups(0);
        let table = table_bytes(&first_groups);
        let others = (1..of.channels.len()).map(|n| {
            Ok(Waiting {
                room: files.scratch()?,
                pieces: Pieces::new(0),
                groups: groups(n),
            })
        });
        Ok(Self {
            of: of.clone(),
            points,
            head,
            first: OrderedFile::create(files, &of.whole_file("vti"), head + table)?,
            first_groups,
            others: others.collect::<Result<_, IoError>>()?,
        })
    }
}

/// The XML before the arrays, of the same length whatever the offsets are.
fn xml(of: &Description, points: bool, offsets: &[u64]) -> String {
    let mut text = head::begin(of, Held::Compressed, points);
    for (channel, offset) in of.channels.iter().zip(offsets) {
        text.push_str(&head::appended_padded(channel, *offset));
    }
    text.push_str(&head::end(Held::Compressed, points));
    text
}

/// Bytes of what stands before the blocks of an array.
fn table_bytes(groups: &Groups) -> u64 {
    8 * (3 + groups.count() as u64)
}

/// What stands before the blocks of an array: how many, of how many bytes, and how many they are compressed.
fn table(groups: &Groups, sizes: &[u64]) -> Vec<u8> {
    let (whole, last) = (groups.piece_bytes() as u64, groups.last_bytes() as u64);
    let partial = if last == whole { 0 } else { last };
    let numbers = [groups.count() as u64, whole, partial];
    let numbers = numbers.iter().chain(sizes);
    numbers.flat_map(|n| n.to_le_bytes()).collect()
}

impl Format for Blocks {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (n, (_, samples)) in layer.channels.iter().enumerate() {
            let bytes = little_endian(samples);
            match n.checked_sub(1).map(|n| &self.others[n]) {
                None => self.first_groups.add(layer.k, &bytes, |piece, bytes| {
                    self.first.add(files, piece, &deflate::zlib(bytes))
                })?,
                Some(other) => other.groups.add(layer.k, &bytes, |piece, bytes| {
                    (other.pieces).add(files, &other.room, piece, &deflate::zlib(bytes))
                })?,
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let Self {
            of,
            points,
            head,
            first,
            first_groups,
            others,
        } = *self;
        let ending = |file: &File, end: u64, sizes: &[u64]| {
            let mut offsets = vec![0];
            file.write_all_at(&table(&first_groups, sizes), head)?;
            let mut at = end;
            for other in others {
                offsets.push(at - head);
                let (length, sizes) = other.pieces.finish();
                let table = table(&other.groups, &sizes);
                file.write_all_at(&table, at)?;
                at += table.len() as u64;
                copy(&other.room, length, file, at)?;
                at += length;
            }
            file.write_all_at(TAIL.as_bytes(), at)?;
            file.write_all_at(xml(&of, points, &offsets).as_bytes(), 0)
        };
        Ok(vec![first.finish(files, ending).map(record)?])
    }
}

/// Copies the first `length` bytes of a file.
fn copy(mut from: &File, length: u64, mut to: &File, at: u64) -> io::Result<()> {
    from.seek(SeekFrom::Start(0))?;
    to.seek(SeekFrom::Start(at))?;
    let copied = io::copy(&mut io::Read::take(&mut from, length), &mut to)?;
    if copied == length {
        Ok(())
    } else {
        Err(io::ErrorKind::UnexpectedEof.into())
    }
}
