//! Superblock, object headers and their messages.
//!
//! ```text
//!   superblock     signature, version 2, root group, check
//!   object header  "OHDR" version 2, size, messages, check
//!   message        type (u8) size (u16) flags (u8), then its data
//! ```
//!
//! Offsets and lengths have 8 bytes; all is little-endian. Checks are Jenkins' `lookup3`, as the library's are.
//!
//! Source: The HDF Group, *HDF5 File Format Specification*, version 3.0, II.A, IV.A.

use crate::io::format::Element;

/// Bytes of the superblock.
pub(super) const FIXED_HEAD: u64 = 48;
/// An address of nothing.
pub(super) const UNDEFINED: u64 = u64::MAX;

pub(super) fn superblock(length: u64, root: u64) -> Vec<u8> {
    let mut bytes = b"\x89HDF\r\n\x1a\n\x02\x08\x08\x00".to_vec();
    for address in [0, UNDEFINED, length, root] {
        bytes.extend(address.to_le_bytes());
    }
    bytes.extend(lookup3(&bytes).to_le_bytes());
    bytes
}

/// The messages of an object.
#[derive(Debug, Default)]
pub(super) struct Header(Vec<u8>);

/// The value of an attribute.
#[derive(Debug)]
pub(super) enum Attribute<'a> {
    Text(&'a str),
    Integers(&'a [u64]),
    Floats(&'a [f64]),
}

impl Header {
    fn message(&mut self, kind: u8, flags: u8, data: &[u8]) {
        self.0.push(kind);
        #[allow(
            clippy::cast_possible_truncation,
            reason = "messages are short; see `attribute`"
        )]
        self.0.extend((data.len() as u16).to_le_bytes());
        self.0.push(flags);
        self.0.extend(data);
    }

    /// Adds an attribute. Texts are cut after 32 KiB: a message has no room for more.
    pub(super) fn attribute(&mut self, name: &str, value: &Attribute<'_>) {
        const LONGEST: usize = 1 << 15;
        let (kind, space, data): (Vec<u8>, Vec<u8>, Vec<u8>) = match value {
            Attribute::Text(text) => {
                let end = (0..=text.len().min(LONGEST))
                    .rev()
                    .find(|n| text.is_char_boundary(*n));
                let text = &text[..end.unwrap_or(0)];
                // An empty string has no type: one byte that is no text stands for it.
                let data = if text.is_empty() {
                    vec![0]
                } else {
                    text.as_bytes().to_vec()
                };
                (text_type(&data), vec![2, 0, 0, 0], data)
            }
            Attribute::Integers(values) => (
                INT64.to_vec(),
                simple(&[values.len() as u64]),
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ),
            Attribute::Floats(values) => (
                F64.to_vec(),
                simple(&[values.len() as u64]),
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ),
        };
        // Version 3, no shared parts; sizes of name, type and space; names in UTF-8.
        let mut message = vec![3, 0];
        #[allow(clippy::cast_possible_truncation, reason = "some dozen bytes each")]
        for size in [name.len() + 1, kind.len(), space.len()] {
            message.extend((size as u16).to_le_bytes());
        }
        message.push(1);
        message.extend(name.as_bytes());
        message.push(0);
        message.extend(kind);
        message.extend(space);
        message.extend(data);
        self.message(0x0c, 0, &message);
    }

    /// The header: no times, the size of its only chunk in four bytes.
    pub(super) fn finish(self) -> Vec<u8> {
        let mut bytes = b"OHDR\x02\x02".to_vec();
        #[allow(clippy::cast_possible_truncation, reason = "some kibibytes")]
        bytes.extend((self.0.len() as u32).to_le_bytes());
        bytes.extend(self.0);
        bytes.extend(lookup3(&bytes).to_le_bytes());
        bytes
    }
}

/// The messages of a group that links to these objects.
pub(super) fn group(header: &mut Header, links: &[(&str, u64)]) {
    let mut info = vec![0, 0];
    info.extend(UNDEFINED.to_le_bytes());
    info.extend(UNDEFINED.to_le_bytes());
    header.message(0x02, 0, &info);
    header.message(0x0a, 1, &[0, 0]);
    for (name, address) in links {
        // Version 1; a name in UTF-8 whose size has two bytes; a hard link.
        let mut link = vec![1, 0b1_0001, 1];
        #[allow(
            clippy::cast_possible_truncation,
            reason = "names of channels are short"
        )]
        link.extend((name.len() as u16).to_le_bytes());
        link.extend(name.as_bytes());
        link.extend(address.to_le_bytes());
        header.message(0x06, 0, &link);
    }
}

/// The messages of an array that is contiguous at `address`.
pub(super) fn dataset(header: &mut Header, stored: Element, dims: &[u64], address: u64) {
    header.message(0x01, 0, &simple(dims));
    header.message(0x03, 1, number(stored));
    // Version 3; space is there late, and filled where somebody says so.
    header.message(0x05, 1, &[3, 0x0a]);
    let mut layout = vec![3, 1];
    layout.extend(address.to_le_bytes());
    let count: u64 = dims.iter().product();
    layout.extend((count * stored.bytes() as u64).to_le_bytes());
    header.message(0x08, 0, &layout);
}

/// The messages of an array in deflated chunks, which the tree at `address` finds.
#[cfg(feature = "hdf5")]
pub(super) fn chunked_dataset(
    header: &mut Header,
    stored: Element,
    dims: &[u64],
    chunk: &[u64],
    address: u64,
) {
    header.message(0x01, 0, &simple(dims));
    header.message(0x03, 1, number(stored));
    // Version 3; space comes with the chunks, and is filled where somebody says so.
    header.message(0x05, 1, &[3, 0x0b]);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "at most three, and checked to fit"
    )]
    let mut layout = vec![3, 2, chunk.len() as u8 + 1];
    layout.extend(address.to_le_bytes());
    #[allow(clippy::cast_possible_truncation, reason = "sides of grids")]
    let sides = chunk
        .iter()
        .map(|n| *n as u32)
        .chain([stored.bytes() as u32]);
    layout.extend(sides.flat_map(u32::to_le_bytes));
    header.message(0x08, 0, &layout);
    // Version 2; one filter: deflate, which must be there, and its level.
    let mut filter = vec![2, 1, 1, 0, 0, 0, 1, 0];
    filter.extend(crate::io::deflate::LEVEL.to_le_bytes());
    header.message(0x0b, 1, &filter);
}

/// The message of an element's type.
fn number(stored: Element) -> &'static [u8] {
    match stored {
        Element::U8 => &UINT8,
        Element::U32 => &UINT32,
        Element::F32 => &F32,
        Element::F64 => &F64,
    }
}

fn simple(dims: &[u64]) -> Vec<u8> {
    #[allow(clippy::cast_possible_truncation, reason = "at most three")]
    let mut space = vec![2, dims.len() as u8, 0, 1];
    space.extend(dims.iter().flat_map(|n| n.to_le_bytes()));
    space
}

// Class and version, three bytes of flags, the size, the offset and number of bits; floats: where exponent and mantissa
// are and how many bits they have, and the bias.
const UINT8: [u8; 12] = [0x10, 0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0];
const UINT32: [u8; 12] = [0x10, 0, 0, 0, 4, 0, 0, 0, 0, 0, 32, 0];
const INT64: [u8; 12] = [0x10, 8, 0, 0, 8, 0, 0, 0, 0, 0, 64, 0];
const F32: [u8; 20] = [
    0x11, 0x20, 31, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0,
];
const F64: [u8; 20] = [
    0x11, 0x20, 63, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xff, 3, 0, 0,
];

/// A string of that length, padded with zeros, in ASCII where that is enough, else in UTF-8.
fn text_type(text: &[u8]) -> Vec<u8> {
    let mut kind = vec![0x13, if text.is_ascii() { 1 } else { 0x11 }, 0, 0];
    #[allow(clippy::cast_possible_truncation, reason = "at most 32 KiB")]
    kind.extend((text.len() as u32).to_le_bytes());
    kind
}

/// Jenkins' hash of bytes, from 0 on.
///
/// Source: B. Jenkins, *lookup3.c*, `hashlittle`, 2006.
pub(super) fn lookup3(bytes: &[u8]) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "headers are some kibibytes"
    )]
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let [mut a, mut b, mut c] = [start; 3];
    let word = |bytes: &[u8], n: usize| {
        let part = bytes.get(4 * n..).unwrap_or_default();
        let mut word = [0; 4];
        let count = part.len().min(4);
        word[..count].copy_from_slice(&part[..count]);
        u32::from_le_bytes(word)
    };
    let mut rest = bytes;
    while rest.len() > 12 {
        a = a.wrapping_add(word(rest, 0));
        b = b.wrapping_add(word(rest, 1));
        c = c.wrapping_add(word(rest, 2));
        for (shift, turn) in [(4, 0), (6, 1), (8, 2), (16, 0), (19, 1), (4, 2)] {
            // a -= c; a ^= rot(c, s); c += b, and the same with the letters moved on.
            let (x, y, z) = match turn {
                0 => (&mut a, &mut b, &mut c),
                1 => (&mut b, &mut c, &mut a),
                _ => (&mut c, &mut a, &mut b),
            };
            *x = x.wrapping_sub(*z) ^ z.rotate_left(shift);
            *z = z.wrapping_add(*y);
        }
        rest = &rest[12..];
    }
    if rest.is_empty() {
        return c;
    }
    a = a.wrapping_add(word(rest, 0));
    b = b.wrapping_add(word(rest, 1));
    c = c.wrapping_add(word(rest, 2));
    for (shift, turn) in [(14, 0), (11, 1), (25, 2), (16, 0), (4, 1), (14, 2), (24, 0)] {
        // c ^= b; c -= rot(b, s), and the same with the letters moved on.
        let (x, y) = match turn {
            0 => (&mut c, b),
            1 => (&mut a, c),
            _ => (&mut b, a),
        };
        *x = (*x ^ y).wrapping_sub(y.rotate_left(shift));
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_are_those_of_lookup3() {
        // The driver's own example, and what is known of the empty string.
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }
}
