//! The `zarr.json` of the group and its arrays.

use serde_json::{Map, Value, json};

use super::chunks::Chunks;
use super::shard::LEVEL;
use crate::io::format::{Description, Element, ZarrCodec};
use crate::io::stack::ChannelSpec;

/// A coordinate array: of voxel centres, or of the sides of voxels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    axis: usize,
    pub(super) name: &'static str,
    of_sides: bool,
}

const CENTRES: [&str; 3] = ["x", "y", "z"];
const SIDES: [&str; 3] = ["x_face", "y_face", "z_face"];

impl Axis {
    fn count(self, of: &Description) -> usize {
        of.grid.dims()[self.axis] + usize::from(self.of_sides)
    }

    /// Where the samples are along it.
    pub(super) fn places(self, of: &Description) -> impl Iterator<Item = f64> {
        (0..self.count(of)).map(move |n| {
            if self.of_sides {
                of.grid.side_along(self.axis, n)
            } else {
                of.grid.centre_along(self.axis, n)
            }
        })
    }
}

/// The coordinate arrays that the channels have.
pub(super) fn axes(of: &Description) -> Vec<Axis> {
    let has_sides = |axis| of.channels.iter().any(|c| c.staggered == Some(axis));
    let one = |axis: usize, of_sides: bool| Axis {
        axis,
        name: if of_sides { SIDES[axis] } else { CENTRES[axis] },
        of_sides,
    };
    let centres = (0..3).rev().map(|axis| one(axis, false));
    let sides = (0..3).rev().filter(|axis| has_sides(*axis));
    centres.chain(sides.map(|axis| one(axis, true))).collect()
}

/// The names of the dimensions of a channel's array.
fn dimensions(channel: &ChannelSpec) -> [&'static str; 3] {
    let name = |axis| {
        if channel.staggered == Some(axis) {
            SIDES[axis]
        } else {
            CENTRES[axis]
        }
    };
    [name(2), name(1), name(0)]
}

/// The name of a channel's array.
pub(super) fn folder(channel: &ChannelSpec) -> String {
    let keep = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    let name: String = (channel.name.chars())
        .map(|c| if keep(c) { c } else { '_' })
        .collect();
    // Names that begin with dots or underscores are the format's own.
    if name.starts_with(['.', '_']) {
        format!("v{name}")
    } else {
        name
    }
}

/// The arrays by name, with their metadata.
pub(super) fn nodes(of: &Description, codec: ZarrCodec) -> Vec<(String, Value)> {
    let axes = axes(of)
        .into_iter()
        .map(|axis| (axis.name.to_owned(), coordinate(of, axis)));
    let channels = of.channels.iter();
    let channels = channels.map(|channel| (folder(channel), array(of, channel, codec)));
    channels.chain(axes).collect()
}

/// The group's metadata, which repeats that of its arrays so that a reader need not look for them.
pub(super) fn group(of: &Description, nodes: &[(String, Value)]) -> Value {
    let all: Map<String, Value> = nodes.iter().cloned().collect();
    json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": {
            "scene": of.scene.as_ref().map(|scene| &scene.name),
            "scene_hash": of.scene.as_ref().map(|scene| &scene.hash),
            "units": of.units,
            "sign_convention": of.sign(),
            "dims": of.grid.dims(),
            "origin": of.grid.origin().to_array(),
            "spacing": of.grid.spacing().to_array(),
            "ome": { "version": "0.5", "multiscales": multiscales(of) },
        },
        "consolidated_metadata": {
            "kind": "inline",
            "must_understand": false,
            "metadata": all,
        },
    })
}

/// Where each array is, as viewers of microscopy read it.
fn multiscales(of: &Description) -> Vec<Value> {
    let unit = match of.units.as_str() {
        "cm" => Some("centimeter"),
        "mm" => Some("millimeter"),
        "um" => Some("micrometer"),
        "nm" => Some("nanometer"),
        "km" => Some("kilometer"),
        "in" => Some("inch"),
        "ft" => Some("foot"),
        "m" => Some("meter"),
        _ => None,
    };
    let zyx = |[x, y, z]: [f64; 3]| [z, y, x];
    let axis = |name: &str| match unit {
        Some(unit) => json!({ "name": name, "type": "space", "unit": unit }),
        None => json!({ "name": name, "type": "space" }),
    };
    let one = |channel: &ChannelSpec| {
        let lattice = of.lattice(channel);
        json!({
            "name": channel.name,
            "axes": [axis("z"), axis("y"), axis("x")],
            "datasets": [{
                "path": folder(channel),
                "coordinateTransformations": [
                    { "type": "scale", "scale": zyx(lattice.spacing) },
                    { "type": "translation", "translation": zyx(lattice.first) },
                ],
            }],
        })
    };
    of.channels.iter().map(one).collect()
}

fn array(of: &Description, channel: &ChannelSpec, codec: ZarrCodec) -> Value {
    let chunks = Chunks::of(of, channel);
    let [nx, ny, nz] = chunks.dims;
    let stored = Element::of(channel.kind);
    let (data_type, fill) = match stored {
        Element::U8 => ("uint8", json!(0)),
        Element::U32 => ("uint32", json!(0)),
        Element::F32 => ("float32", json!(0.0)),
        Element::F64 => ("float64", json!(0.0)),
    };
    let mut inner = vec![bytes_codec(stored)];
    if codec == ZarrCodec::Zstd {
        inner.push(
            json!({ "name": "zstd", "configuration": { "level": LEVEL, "checksum": false } }),
        );
    }
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": [nz, ny, nx],
        "data_type": data_type,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunks.shard() } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "." } },
        "fill_value": fill,
        "codecs": [{
            "name": "sharding_indexed",
            "configuration": {
                "chunk_shape": chunks.chunk,
                "codecs": inner,
                "index_codecs": [bytes_codec(Element::F64), { "name": "crc32c" }],
                "index_location": "end",
            },
        }],
        "attributes": attributes(&channel.meaning, channel.unit.as_deref()),
        "dimension_names": dimensions(channel),
    })
}

fn coordinate(of: &Description, axis: Axis) -> Value {
    let (count, name) = (axis.count(of), axis.name);
    let what = if axis.of_sides {
        "voxels' sides"
    } else {
        "voxel centres"
    };
    let meaning = format!("{} of the {what}", CENTRES[axis.axis]);
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": [count],
        "data_type": "float64",
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [count] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "." } },
        "fill_value": 0.0,
        "codecs": [bytes_codec(Element::F64)],
        "attributes": attributes(&meaning, Some(&of.units)),
        "dimension_names": [name],
    })
}

fn bytes_codec(stored: Element) -> Value {
    match stored {
        Element::U8 => json!({ "name": "bytes" }),
        _ => json!({ "name": "bytes", "configuration": { "endian": "little" } }),
    }
}

fn attributes(meaning: &str, unit: Option<&str>) -> Value {
    match unit {
        Some(unit) => json!({ "long_name": meaning, "units": unit }),
        None => json!({ "long_name": meaning }),
    }
}

/// A document as the text of a file.
pub(super) fn text(document: &Value) -> Vec<u8> {
    let mut text = format!("{document:#}");
    text.push('\n');
    text.into_bytes()
}
