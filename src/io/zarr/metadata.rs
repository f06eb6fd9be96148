//! The `zarr.json` of the group and its arrays.

use serde_json::{Map, Value, json};

use super::chunks::Chunks;
use super::shard::LEVEL;
use crate::io::format::{Description, Element, ZarrCodec};
use crate::io::stack::ChannelSpec;

/// Coordinate arrays: the axis of the grid, and the name.
pub(super) const AXES: [(usize, &str); 3] = [(2, "z"), (1, "y"), (0, "x")];

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
    let axes = AXES.map(|(axis, name)| (name.to_owned(), coordinate(of, axis, name)));
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
    let lattice = of.lattice();
    let zyx = |[x, y, z]: [f64; 3]| [z, y, x];
    let axis = |name: &str| match unit {
        Some(unit) => json!({ "name": name, "type": "space", "unit": unit }),
        None => json!({ "name": name, "type": "space" }),
    };
    let one = |channel: &ChannelSpec| {
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
        "dimension_names": ["z", "y", "x"],
    })
}

fn coordinate(of: &Description, axis: usize, name: &str) -> Value {
    let count = of.grid.dims()[axis];
    let meaning = format!("{name} of the voxel centres");
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
