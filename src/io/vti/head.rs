//! The XML around the arrays.

use std::fmt::Write as _;

use crate::io::format::{Description, Element, decimals};
use crate::io::stack::ChannelSpec;

/// How the arrays are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Held {
    /// After the XML, at these places.
    Appended,
    /// The same, compressed.
    Compressed,
    /// In the elements.
    Inline,
}

/// What stands before the element of the first array.
pub(super) fn begin(of: &Description, held: Held, points: bool) -> String {
    let lattice = of.centres();
    let (origin, less) = if points {
        (lattice.first, 1)
    } else {
        (of.grid.origin().to_array(), 0)
    };
    let extent = lattice.dims.map(|n| format!("0 {}", n - less)).join(" ");
    let compressor = match held {
        Held::Compressed => " compressor=\"vtkZLibDataCompressor\"",
        _ => "",
    };
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"{compressor}>\n\
         \x20 <ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"1 0 0 0 1 0 0 0 1\">\n\
         \x20   <FieldData>\n",
        decimals(origin),
        decimals(lattice.spacing),
    );
    let told = [("units", of.units.as_str()), ("sign_convention", of.sign())];
    for (name, value) in told {
        let codes: Vec<String> = value.bytes().map(|b| b.to_string()).collect();
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "      <DataArray type=\"String\" Name=\"{name}\" NumberOfTuples=\"1\" format=\"ascii\">{} 0</DataArray>",
            codes.join(" ")
        );
    }
    let other = if points {
        ""
    } else {
        "      <PointData></PointData>\n"
    };
    let _ = write!(
        text,
        "    </FieldData>\n    <Piece Extent=\"{extent}\">\n{other}      <{} Scalars=\"{}\">\n",
        data(points),
        escaped(&of.channels[0].name),
    );
    text
}

/// What stands after the element of the last array.
pub(super) fn end(held: Held, points: bool) -> String {
    let other = if points {
        "      <CellData></CellData>\n"
    } else {
        ""
    };
    let mut text = format!(
        "      </{}>\n{other}    </Piece>\n  </ImageData>\n",
        data(points)
    );
    text.push_str(match held {
        Held::Inline => "</VTKFile>\n",
        _ => "  <AppendedData encoding=\"raw\">_",
    });
    text
}

/// What stands after appended arrays.
pub(super) const TAIL: &str = "\n  </AppendedData>\n</VTKFile>\n";

fn data(points: bool) -> &'static str {
    if points { "PointData" } else { "CellData" }
}

/// The element of an array that begins at `offset` of the appended data.
pub(super) fn appended(channel: &ChannelSpec, offset: u64) -> String {
    let (kind, name) = (kind(channel), escaped(&channel.name));
    format!(
        "        <DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{offset}\"></DataArray>\n"
    )
}

/// As [`appended`], of the same length whatever the offset is.
pub(super) fn appended_padded(channel: &ChannelSpec, offset: u64) -> String {
    let (kind, name, offset) = (
        kind(channel),
        escaped(&channel.name),
        format!("offset=\"{offset}\""),
    );
    format!(
        "        <DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" {offset:<30}></DataArray>\n"
    )
}

/// The element of an array up to its digits.
pub(super) fn inline_begin(channel: &ChannelSpec) -> String {
    let (kind, name) = (kind(channel), escaped(&channel.name));
    format!("        <DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\">\n")
}

/// What stands after the digits.
pub(super) const INLINE_END: &str = "\n        </DataArray>\n";

fn kind(channel: &ChannelSpec) -> &'static str {
    match Element::of(channel.kind) {
        Element::U8 => "UInt8",
        Element::U32 => "UInt32",
        Element::F32 => "Float32",
        Element::F64 => "Float64",
    }
}

/// A name as the value of an attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
