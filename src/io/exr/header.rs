//! The header of a slice, as bytes.
//!
//! The `exr` crate writes it. The crate keeps custom attributes in a hash map, whose order differs
//! from run to run, so the entries are put in the order of their names; no byte after them moves.
//!
//! ```text
//!   magic 4   version 4   { name 0  type 0  size 4  value }...   0
//! ```
//!
//! Source: Academy Software Foundation, *OpenEXR File Layout*.

use ::exr::meta::header::{Header, LayerAttributes};
use ::exr::meta::{BlockDescription, MetaData, magic_number};
use ::exr::prelude::{
    AttributeValue, ChannelDescription, Compression as ExrCompression, LineOrder, SmallVec, Text,
    Vec2,
};

use super::attributes::ascii;
use super::{Attribute, Attributes, ExrError, Samples};

/// The header of one layer: what the `exr` crate's block functions ask for.
pub(super) fn header(
    size: [usize; 2],
    sorted: &[(&str, Samples<'_>)],
    attributes: &Attributes,
    compression: ExrCompression,
) -> Result<Header, ExrError> {
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
    Ok(
        Header::new(Text::default(), Vec2(size[0], size[1]), descriptions)
            .with_encoding(
                compression,
                BlockDescription::ScanLines,
                LineOrder::Increasing,
            )
            .with_attributes(own),
    )
}

/// Appends the header's bytes, checked by the crate and with its attributes in order, to `bytes`,
/// which must be empty.
pub(super) fn append_header(bytes: &mut Vec<u8>, header: &Header) -> Result<(), ExrError> {
    let refused = |e: ::exr::error::Error| ExrError::Encode {
        reason: e.to_string(),
    };
    let headers = std::slice::from_ref(header);
    let requirements = MetaData::validate(headers, true).map_err(refused)?;
    magic_number::write(bytes).map_err(refused)?;
    requirements.write(bytes).map_err(refused)?;
    Header::write_all(headers, bytes, requirements.is_multilayer()).map_err(refused)?;
    sort_header(bytes).ok_or_else(|| ExrError::Encode {
        reason: "its header is not laid out as expected".into(),
    })
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

/// Where a header's attributes are: name and whole entry of each, and the end of the list.
pub(super) type HeaderEntries<'a> = (Vec<(&'a [u8], &'a [u8])>, usize);

/// The attribute list starts after magic number and version, 4 bytes each.
const HEADER_START: usize = 8;

/// Splits the header: each entry is `name\0 type\0 size(i32) value`, and a zero byte ends the list.
pub(super) fn header_entries(bytes: &[u8]) -> Option<HeaderEntries<'_>> {
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
pub(super) fn sort_header(bytes: &mut [u8]) -> Option<()> {
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
