//! What a manifest says, held against what the slices hold.
//!
//! The samples are counted and summed again as they were when they were written: in the same order, so that the
//! numbers are equal to the last bit. Only samples that `pxr24` has rounded allow for that.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::grid::GridSpec;
use crate::io::exr::{
    Attribute, Attributes, Compression, DecodedLayer, DecodedSamples, SIGN_CONVENTION, Samples,
    ascii, decode_layer, layer_attributes,
};
use crate::io::manifest::{FileRecord, Manifest, slice_name};
use crate::io::stack::Statistics;

/// What `pxr24` may change a number by, as a share of it.
const ROUNDING: f64 = 1.0 / 32768.0;

/// A slice's share of the totals.
#[derive(Debug)]
pub(super) struct Slice {
    /// What its header contradicts.
    pub(super) wrong: Vec<String>,
    /// Of each channel, in the manifest's order.
    statistics: Vec<Statistics>,
    /// Voxels of each material id.
    materials: BTreeMap<u32, u64>,
}

impl Slice {
    /// Slice `k` from the bytes of its file; why it is no layer of the manifest's grid and channels.
    pub(super) fn read(
        bytes: &[u8],
        record: &FileRecord,
        k: usize,
        manifest: &Manifest,
    ) -> Result<Self, String> {
        let layer = decode_layer(bytes).map_err(|error| error.to_string())?;
        let [nx, ny, _] = manifest.grid.dims;
        if layer.size != [nx, ny] {
            let [columns, rows] = layer.size;
            return Err(format!(
                "it has {columns} x {rows} voxels, and the grid {nx} x {ny}"
            ));
        }
        let held: Vec<_> = (layer.channels.iter())
            .map(|(name, samples)| (name.as_str(), samples.kind()))
            .collect();
        let mut listed: Vec<_> = (manifest.channels.iter())
            .map(|channel| (channel.name.as_str(), channel.kind))
            .collect();
        listed.sort_unstable_by_key(|channel| channel.0);
        if held != listed {
            return Err(format!(
                "it holds {held:?}, and the manifest lists {listed:?}"
            ));
        }
        let statistics = manifest
            .channels
            .iter()
            .map(|channel| statistics(&layer, &channel.name, nx))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            wrong: header(&layer, record, k, manifest),
            statistics,
            materials: match layer.channel("material") {
                Some(DecodedSamples::Uint(ids)) => count(ids),
                _ => BTreeMap::new(),
            },
        })
    }
}

fn statistics(layer: &DecodedLayer, name: &str, width: usize) -> Result<Statistics, String> {
    let samples = layer.channel(name).ok_or("a channel is not there")?;
    match samples {
        DecodedSamples::Uint(s) => Statistics::of(name, &Samples::Uint(s), width),
        DecodedSamples::Float(s) => Statistics::of(name, &Samples::Float(s), width),
        DecodedSamples::Half(s) => {
            // Stacks have whole numbers in them.
            let whole = |v: &half::f16| {
                let value = v.to_f32();
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "checked to be the same"
                )]
                let byte = value as u8;
                (f32::from(byte) == value).then_some(byte)
            };
            let values: Option<Vec<u8>> = s.iter().map(whole).collect();
            let values = values.ok_or_else(|| format!("{name} has a value that is no count"))?;
            Statistics::of(name, &Samples::Half(&values), width)
        }
    }
}

fn count(ids: &[u32]) -> BTreeMap<u32, u64> {
    let mut counts = BTreeMap::new();
    for run in ids.chunk_by(|a, b| a == b) {
        *counts.entry(run[0]).or_insert(0) += run.len() as u64;
    }
    counts
}

/// What a slice's header contradicts.
fn header(layer: &DecodedLayer, record: &FileRecord, k: usize, manifest: &Manifest) -> Vec<String> {
    let name = &record.name;
    let mut wrong = Vec::new();
    let grid = GridSpec::new(
        manifest.grid.dims,
        manifest.grid.origin.into(),
        manifest.grid.spacing.into(),
    );
    let Ok(grid) = grid else {
        return vec!["the grid cannot be".into()];
    };
    if *name != slice_name(k, grid.dims()[2]) {
        wrong.push(format!("{name} is listed as slice {k}"));
    }
    if record.z != Some(grid.centre_along(2, k)) {
        wrong.push(format!("{name} is listed at z {:?}", record.z));
    }
    let scene = manifest
        .scene_name
        .as_deref()
        .zip(manifest.scene_hash.as_deref());
    for (key, wanted) in layer_attributes(&grid, k, &manifest.units, scene) {
        let wanted = match wanted {
            Attribute::Text(text) => Attribute::Text(ascii(&text)),
            other => other,
        };
        compare(name, &layer.attributes, &key, &wanted, &mut wrong);
    }
    if scene.is_none() && layer.attributes.contains_key("voxlathe:sceneHash") {
        wrong.push(format!("{name} names a scene, and the manifest none"));
    }
    if layer.compression.map(Compression::name) != manifest.compression.as_deref() {
        wrong.push(format!(
            "{name} is not compressed by {:?}",
            manifest.compression.as_deref().unwrap_or("nothing")
        ));
    }
    let software = format!("voxlathe {}", manifest.version);
    if layer.software.as_ref() != Some(&software) {
        wrong.push(format!(
            "{name} was written by {:?}, and the manifest by {software:?}",
            layer.software.as_deref().unwrap_or("an unknown program")
        ));
    }
    wrong
}

fn compare(file: &str, held: &Attributes, key: &str, wanted: &Attribute, wrong: &mut Vec<String>) {
    let found = held.get(key);
    if found != Some(wanted) {
        let text = |value: Option<&Attribute>| match value {
            Some(Attribute::Text(text)) => format!("{text:?}"),
            Some(Attribute::Int(value)) => value.to_string(),
            Some(Attribute::Double(value)) => value.to_string(),
            None => "nothing".into(),
        };
        wrong.push(format!(
            "{file} has {} as {key}, and the manifest {}",
            text(found),
            text(Some(wanted))
        ));
    }
}

/// What a manifest contradicts by itself.
pub(super) fn of_manifest(manifest: &Manifest) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut hold = |right: bool, what: &str| {
        if !right {
            wrong.push(format!("the manifest contradicts itself: {what}"));
        }
    };
    hold(
        manifest.sign_convention == SIGN_CONVENTION,
        "its sign convention is unknown",
    );
    let slices: Vec<_> = manifest.files.iter().filter_map(|f| f.slice).collect();
    hold(slices.is_sorted(), "its slices are not in the order of z");
    let has_slices = manifest.formats.iter().any(|format| format == "exr");
    hold(
        has_slices != slices.is_empty() && has_slices == manifest.compression.is_some(),
        "its formats are not those of its files",
    );
    let hash = |text: &str| blake3::hash(text.as_bytes()).to_hex().to_string();
    if let (Some(own), false) = (&manifest.scene_hash, manifest.scene.is_null()) {
        hold(
            *own == hash(&manifest.scene.to_string()),
            "its scene_hash is not that of its scene",
        );
    }
    let said = |key: &str| manifest.scene.get(key).filter(|v| !v.is_null());
    let text = |key: &str| said(key).and_then(Value::as_str);
    hold(
        text("name").is_none_or(|n| manifest.scene_name.as_deref() == Some(n)),
        "scene_name is not its scene's",
    );
    hold(
        text("units").is_none_or(|u| manifest.units == u),
        "units are not its scene's",
    );
    hold(
        said("materials").is_none_or(|m| manifest.materials == *m),
        "materials are not its scene's",
    );
    let sdf = manifest.channels.iter().find(|c| c.name == "sdf");
    hold(
        sdf.is_none_or(|c| c.unit.as_ref() == Some(&manifest.units)),
        "the unit of sdf is not that of lengths",
    );
    let ordered = |[low, high]: &[[f64; 3]; 2]| low.iter().zip(high).all(|(a, b)| a <= b);
    hold(
        manifest.bounds.as_ref().is_none_or(ordered),
        "its bounds are reversed",
    );
    wrong
}

/// What storing fractions as f32 may change their sum by, as a share of it; and, the last bit, the sum itself.
const STORED: f64 = 1.0 / (1_u64 << 24) as f64 + 1e-12;

/// What the totals of all slices contradict.
pub(super) fn of_totals(manifest: &Manifest, slices: &[Slice]) -> Vec<String> {
    let rounding = if manifest.compression.as_deref() == Some(Compression::Pxr24.name()) {
        ROUNDING
    } else {
        0.0
    };
    let mut wrong = Vec::new();
    let totals: Vec<Statistics> = (0..manifest.channels.len())
        .map(|c| Statistics::join(slices.iter().map(|slice| slice.statistics[c])))
        .collect();
    let near = |a: f64, b: f64| a == b || (a - b).abs() <= rounding * a.abs().max(b.abs());
    for (channel, total) in manifest.channels.iter().zip(&totals) {
        let found = total.range();
        let same = match (channel.range, found) {
            (Some(a), Some(b)) => near(a[0], b[0]) && near(a[1], b[1]),
            (a, b) => a == b,
        };
        if !same {
            wrong.push(format!(
                "the range of {} is listed as {:?}, and is {found:?}",
                channel.name, channel.range
            ));
        }
    }
    let mut hold = |what: &str, listed: Option<f64>, found: Option<f64>| {
        // What nothing in the slices tells is taken as it is.
        if let Some(found) = found.filter(|v| v.is_finite())
            && !listed.is_some_and(|listed| near(listed, found))
        {
            let listed = listed.map_or_else(|| "nothing".into(), |v| v.to_string());
            wrong.push(format!("{what} is listed as {listed}, and is {found}"));
        }
    };
    let total = |name: &str| {
        let channel = manifest.channels.iter().position(|c| c.name == name);
        channel.map(|c| totals[c])
    };
    #[allow(
        clippy::cast_precision_loss,
        reason = "a count of 2^53 voxels is out of reach"
    )]
    let number = |n: u64| n as f64;
    let voxel: f64 = GridSpec::new(
        manifest.grid.dims,
        manifest.grid.origin.into(),
        manifest.grid.spacing.into(),
    )
    .map_or(f64::NAN, |grid| grid.voxel_volume());
    let inside = total("occupancy").map(|t| t.count);
    hold(
        "voxels_inside",
        manifest.voxels_inside.map(number),
        inside.map(number),
    );
    let inside = inside.or(manifest.voxels_inside);
    let volume = inside.map(|n| number(n) * voxel);
    hold("volume_occupancy", manifest.volume_occupancy, volume);
    let volume = total("fraction").map(|t| t.sum * voxel);
    // What older programs wrote as the one is the other.
    let stored = (manifest.volume_fraction_stored).or(manifest.volume_fraction);
    hold("volume_fraction_stored", stored, volume);
    let has_material = total("material").is_some();
    for one in manifest.material_volumes.iter().filter(|_| has_material) {
        let counts = slices
            .iter()
            .filter_map(|slice| slice.materials.get(&one.id));
        let voxels: u64 = counts.sum();
        let what = format!("the number of voxels of material {}", one.id);
        hold(&what, one.voxels.map(number), Some(number(voxels)));
        let what = format!("the volume by occupancy of material {}", one.id);
        hold(&what, one.volume_occupancy, Some(number(voxels) * voxel));
    }
    if let (Some(before), Some(stored)) = (manifest.volume_fraction, stored)
        && !((before - stored).abs() <= (STORED + rounding) * stored.abs())
    {
        wrong.push(format!(
            "volume_fraction is listed as {before}, and of the stored values it is {stored}"
        ));
    }
    wrong
}
