//! `grid.json`: where the samples of bare arrays are.

use serde_json::{Value, json};

use super::error::IoError;
use super::format::{Description, Element, Format, FormatKind, Layer, record};
use super::manifest::FileRecord;
use super::staged::{StagedFiles, WrittenFile};

/// The file, which is written at once.
#[derive(Debug)]
pub(super) struct GridFile(WrittenFile);

const NAME: &str = "grid.json";

impl GridFile {
    pub(super) fn write(
        files: &StagedFiles,
        of: &Description,
        formats: &[FormatKind],
    ) -> Result<Self, IoError> {
        let bare = formats
            .iter()
            .filter(|format| matches!(format, FormatKind::Npy | FormatKind::Raw));
        let bare: Vec<&str> = bare.map(FormatKind::name).collect();
        let mut text = serde_json::to_string_pretty(&document(of, &bare))
            .map_err(|error| files.failed()(error.into()))?;
        text.push('\n');
        let digest = blake3::hash(text.as_bytes());
        files.write(NAME, text.as_bytes(), digest).map(Self)
    }
}

impl Format for GridFile {
    fn layer(&self, _files: &StagedFiles, _layer: &Layer<'_>) -> Result<(), IoError> {
        Ok(())
    }

    fn finish(self: Box<Self>, _files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        Ok(vec![record((NAME.into(), self.0))])
    }
}

fn document(of: &Description, formats: &[&str]) -> Value {
    let channels = of.channels.iter().map(|channel| {
        let lattice = of.lattice(channel);
        let [nx, ny, nz] = lattice.dims;
        json!({
            "name": channel.name,
            "files": formats.iter().map(|f| of.channel_file(channel, f)).collect::<Vec<_>>(),
            "dtype": Element::of(channel.kind).numpy(),
            "shape": [nz, ny, nx],
            "first": lattice.first,
            "meaning": channel.meaning,
            "unit": channel.unit,
        })
    });
    json!({
        "dims": of.grid.dims(),
        "origin": of.grid.origin().to_array(),
        "spacing": of.grid.spacing().to_array(),
        "units": of.units,
        "sign_convention": of.sign(),
        "order": "x fastest, then y, then z",
        "byte_order": "little-endian",
        "origin_is": "the minimum corner of voxel (0, 0, 0)",
        "channels": channels.collect::<Vec<_>>(),
    })
}
