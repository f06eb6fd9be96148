//! MetaImage headers, `CHANNEL.mhd`, with the raw arrays they describe.
//!
//! ITK's images put the origin at the centre of the first voxel, and so does `Offset`.
//!
//! Source: Insight Software Consortium, *MetaIO* documentation, tags of `MetaImage`.

use super::error::IoError;
use super::format::{Description, Element, Format, Layer, decimals, record};
use super::manifest::FileRecord;
use super::raw;
use super::stack::ChannelSpec;
use super::staged::{StagedFiles, WrittenFile};

/// A header for each channel, and the arrays where they are not another format's.
#[derive(Debug)]
pub(super) struct Images {
    headers: Vec<(String, WrittenFile)>,
    arrays: raw::Arrays,
}

impl Images {
    /// * `with_arrays`: whether they are not another format's already.
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        with_arrays: bool,
    ) -> Result<Self, IoError> {
        let headers = of.channels.iter().map(|channel| {
            let name = of.channel_file(channel, "mhd");
            let text = header(of, channel);
            let written = files.write(&name, text.as_bytes(), blake3::hash(text.as_bytes()))?;
            Ok((name, written))
        });
        Ok(Self {
            headers: headers.collect::<Result<_, IoError>>()?,
            arrays: raw::Arrays::begin(files, of, with_arrays)?,
        })
    }
}

impl Format for Images {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        self.arrays.layer(files, layer)
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let mut records: Vec<FileRecord> = self.headers.into_iter().map(record).collect();
        records.extend(Box::new(self.arrays).finish(files)?);
        Ok(records)
    }
}

fn header(of: &Description, channel: &ChannelSpec) -> String {
    let lattice = of.lattice(channel);
    let kind = match Element::of(channel.kind) {
        Element::U8 => "MET_UCHAR",
        Element::U32 => "MET_UINT",
        Element::F32 => "MET_FLOAT",
        Element::F64 => "MET_DOUBLE",
    };
    format!(
        "ObjectType = Image\n\
         NDims = 3\n\
         Comment = {}; lengths in {}, {}\n\
         BinaryData = True\n\
         BinaryDataByteOrderMSB = False\n\
         CompressedData = False\n\
         TransformMatrix = 1 0 0 0 1 0 0 0 1\n\
         Offset = {}\n\
         CenterOfRotation = 0 0 0\n\
         ElementSpacing = {}\n\
         DimSize = {} {} {}\n\
         ElementType = {kind}\n\
         ElementDataFile = {}\n",
        channel.name,
        of.units,
        of.sign(),
        decimals(lattice.first),
        decimals(lattice.spacing),
        lattice.dims[0],
        lattice.dims[1],
        lattice.dims[2],
        of.channel_file(channel, "raw"),
    )
}

#[cfg(test)]
mod tests {
    use crate::io::exr::SampleKind;
    use crate::io::format::FormatKind;
    use crate::io::format::tests::{description, orders, written};

    #[test]
    fn the_offset_is_the_centre_of_the_first_voxel() {
        let of = description(&[("sdf", SampleKind::Float)]);
        let dir = tempfile::tempdir().unwrap();
        let records = written(dir.path(), FormatKind::Mhd, &of, &orders(11)[1]);
        let names: Vec<&str> = records.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["sdf.mhd", "sdf.raw"]);
        let text = std::fs::read_to_string(dir.path().join("sdf.mhd")).unwrap();
        for line in [
            "Offset = -1.0 0.25 7.35",
            "ElementSpacing = 0.5 0.3 0.7",
            "DimSize = 7 5 11",
            "ElementType = MET_FLOAT",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} in {text}");
        }
        assert!(text.ends_with("\nElementDataFile = sdf.raw\n"));
    }
}
