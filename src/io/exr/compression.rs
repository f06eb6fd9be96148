//! How the pixels of a slice are compressed, and what `auto` stands for.
//!
//! Every kind but `pxr24` gives back the same bits; `pxr24` rounds floats to 24 bits, 2^-16 of the
//! value, and leaves integers and halves alone.

use std::fmt;
use std::str::FromStr;

use ::exr::prelude::Compression as ExrCompression;
use serde::{Deserialize, Serialize};

/// How the pixels of a slice are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Not at all.
    None,
    /// Runs of equal bytes.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines together.
    Zip,
    /// Wavelets and Huffman codes, 32 lines together.
    Piz,
    /// Deflate after rounding floats to 24 bits: lossy, 2^-16 of the value.
    Pxr24,
    /// Lossless, chosen from the channels; see [`Compression::resolve`].
    #[default]
    Auto,
}

impl Compression {
    /// All choices, in the order they are listed to users.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Rle,
        Self::Zips,
        Self::Zip,
        Self::Piz,
        Self::Pxr24,
        Self::Auto,
    ];

    /// The name users write.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "rle",
            Self::Zips => "zips",
            Self::Zip => "zip",
            Self::Piz => "piz",
            Self::Pxr24 => "pxr24",
            Self::Auto => "auto",
        }
    }

    /// The compression that `auto` stands for with these channels; every other is itself.
    ///
    /// A slice of a ball, 512 x 512, one thread of a 2-core Xeon, release build,
    /// `measure_compressions` below; file size over raw size, raw megabytes encoded in a second:
    ///
    /// | channels | none | rle | zips | zip | piz | pxr24 |
    /// |---|---|---|---|---|---|---|
    /// | sdf | 1.01 1041 | 1.01 187 | 1.01 21 | 0.98 20 | 0.79 18 | 0.23 57 |
    /// | occupancy, fraction, sdf | 1.00 1202 | 0.49 260 | 0.42 44 | 0.40 42 | 0.34 39 | 0.10 93 |
    /// | occupancy, fraction | 1.01 1055 | 0.14 299 | 0.023 78 | 0.010 146 | 0.076 69 | 0.009 171 |
    /// | occupancy | 1.02 471 | 0.039 241 | 0.045 41 | 0.008 114 | 0.017 31 | 0.008 131 |
    ///
    /// The last bits of an f32 distance are noise to every lossless codec: zip saves 2 % and piz
    /// 21 % of it, both at a fiftieth of the speed, so a stack with `sdf`, or with a channel of
    /// unknown content, is left alone. Masks, fractions and ids shrink a hundredfold under zip, so
    /// the disk has next to nothing to do; rle is twice as fast but leaves ten times the bytes.
    ///
    /// ```
    /// # use voxlathe::io::exr::Compression;
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "sdf"]), Compression::None);
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "fraction"]), Compression::Zip);
    /// assert_eq!(Compression::Piz.resolve(["sdf"]), Compression::Piz);
    /// ```
    #[must_use]
    pub fn resolve<'a>(self, channels: impl IntoIterator<Item = &'a str>) -> Self {
        if self != Self::Auto {
            return self;
        }
        let compressible = |name: &str| matches!(name, "occupancy" | "fraction" | "material");
        if channels.into_iter().all(compressible) {
            Self::Zip
        } else {
            Self::None
        }
    }

    pub(super) fn to_exr(self) -> ExrCompression {
        match self {
            Self::None | Self::Auto => ExrCompression::Uncompressed,
            Self::Rle => ExrCompression::RLE,
            Self::Zips => ExrCompression::ZIP1,
            Self::Zip => ExrCompression::ZIP16,
            Self::Piz => ExrCompression::PIZ,
            Self::Pxr24 => ExrCompression::PXR24,
        }
    }
}

impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A compression name that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown compression {found:?}; it must be none, rle, zips, zip, piz, pxr24 or auto")]
pub struct UnknownCompression {
    /// The name given.
    pub found: String,
}

impl FromStr for Compression {
    type Err = UnknownCompression;

    fn from_str(name: &str) -> Result<Self, UnknownCompression> {
        Self::ALL
            .into_iter()
            .find(|c| c.name() == name)
            .ok_or_else(|| UnknownCompression { found: name.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Layer, attributes};
    use super::super::{LayerChannels, encode_layer};
    use super::*;

    #[test]
    fn compression_names_come_back() {
        for compression in Compression::ALL {
            assert_eq!(compression.name().parse(), Ok(compression));
            let json = serde_json::to_string(&compression).unwrap();
            assert_eq!(json, format!("\"{compression}\""));
        }
        assert_eq!(
            "gzip".parse::<Compression>().unwrap_err().to_string(),
            "unknown compression \"gzip\"; it must be none, rle, zips, zip, piz, pxr24 or auto"
        );
    }

    /// How the table of [`Compression::resolve`] was made.
    #[test]
    #[ignore = "a measurement"]
    #[allow(clippy::cast_precision_loss, reason = "only printed")]
    fn measure_compressions() {
        let size = [512, 512];
        let layer = Layer::ball(size);
        let all = layer.channels();
        let masks = LayerChannels { sdf: None, ..all };
        let mut table = String::new();
        for (name, channels) in [
            (
                "sdf",
                LayerChannels {
                    sdf: all.sdf,
                    ..Default::default()
                },
            ),
            (
                "occupancy fraction sdf",
                LayerChannels {
                    material: None,
                    ..all
                },
            ),
            (
                "occupancy fraction",
                LayerChannels {
                    material: None,
                    ..masks
                },
            ),
            (
                "occupancy",
                LayerChannels {
                    occupancy: all.occupancy,
                    ..Default::default()
                },
            ),
        ] {
            let list = channels.list();
            let raw: usize = list.iter().map(|c| c.1.len() * c.1.kind().bytes()).sum();
            for compression in &Compression::ALL[..6] {
                let rounds = 5;
                let mut best = f64::INFINITY;
                let mut bytes = Vec::new();
                for _ in 0..rounds {
                    let start = std::time::Instant::now();
                    bytes = encode_layer(size, &list, &attributes(), *compression).unwrap();
                    best = best.min(start.elapsed().as_secs_f64());
                }
                use std::fmt::Write as _;
                writeln!(
                    table,
                    "{name:24} {compression:6} ratio {:.3}  {:6.0} MB/s",
                    bytes.len() as f64 / raw as f64,
                    raw as f64 / best / 1e6
                )
                .unwrap();
            }
        }
        eprintln!("{table}");
    }
}
