//! How the pixels of a slice are compressed, and what `auto` stands for.
//!
//! Every kind but `pxr24` gives back the same bits; `pxr24` rounds floats to 24 bits, 2^-16 of the
//! value, and leaves integers and halves alone.

use std::fmt;
use std::str::FromStr;

use ::exr::prelude::Compression as ExrCompression;
use serde::{Deserialize, Serialize};

use crate::grid::Channel;

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
    /// Five layers of `scenes/goblet.toml` at 512 voxels, 258 x 258 each, one thread of a 2-core
    /// Xeon at 2 GHz, release build, `measure_compressions` below; file size over the size of the
    /// samples, megabytes of samples encoded in a second:
    ///
    /// | channels | none | rle | zips | zip | piz | pxr24 |
    /// |---|---|---|---|---|---|---|
    /// | occupancy | 1.03 8321 | 0.071 546 | 0.093 35 | 0.014 215 | 0.032 8 | 0.014 221 |
    /// | fraction | 1.02 12381 | 0.083 583 | 0.083 58 | 0.040 203 | 0.220 10 | 0.034 132 |
    /// | material | 1.02 12231 | 0.059 376 | 0.046 53 | 0.008 162 | 0.018 11 | 0.011 148 |
    /// | sdf | 1.02 10986 | 1.02 287 | 1.02 12 | 0.99 17 | 0.90 6 | 0.29 42 |
    /// | all four | 1.00 9741 | 0.33 323 | 0.32 32 | 0.30 38 | 0.29 17 | 0.10 70 |
    ///
    /// The last bits of an f32 distance are noise to every lossless codec: zip saves 1 % of it and
    /// piz 10 %, at less than a hundredth of the speed of `none`, so a stack with `sdf`, or with a
    /// channel of unknown content, is left alone. Masks, fractions and ids shrink twelvefold under
    /// rle, twice as fast as under zip, which shrinks them further, and a few threads of it feed as
    /// many samples to the disk as a fast disk takes uncompressed ones: rle writes them soonest on
    /// any disk that takes more than some 40 MB/s for each thread.
    ///
    /// ```
    /// # use voxlathe::io::exr::Compression;
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "sdf"]), Compression::None);
    /// assert_eq!(Compression::Auto.resolve(["occupancy", "fraction"]), Compression::Rle);
    /// assert_eq!(Compression::Piz.resolve(["sdf"]), Compression::Piz);
    /// ```
    #[must_use]
    pub fn resolve<'a>(self, channels: impl IntoIterator<Item = &'a str>) -> Self {
        if self != Self::Auto {
            return self;
        }
        let known = |name: &str| Channel::from_name(name);
        let compressible = |name: &str| known(name).is_some_and(Channel::is_mostly_constant);
        if channels.into_iter().all(compressible) {
            Self::Rle
        } else {
            Self::None
        }
    }

    /// The compression that a file's header names, where stacks have it.
    pub(super) fn from_exr(found: ExrCompression) -> Option<Self> {
        let ways = Self::ALL.into_iter().filter(|way| *way != Self::Auto);
        ways.into_iter().find(|way| way.to_exr() == found)
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
    use super::super::testing::attributes;
    use super::super::{LayerEncoder, Samples};
    use super::*;
    use crate::grid::Channel;
    use crate::sample::{LayerBuffers, LayerSampler, Selection};
    use crate::scene::Scene;

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
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/goblet.toml");
        let scene = Scene::load_with(path, &["grid.resolution=512".to_owned()]).unwrap();
        let grid = scene.grid().unwrap();
        let [nx, ny, nz] = grid.dims();
        let selection = Selection::of(&[Channel::Fraction, Channel::Sdf, Channel::Material], None);
        let sampler = LayerSampler::new(scene.assembly(), &grid, selection);
        let layers: Vec<LayerBuffers> = (1..6)
            .map(|i| {
                let mut layer = LayerBuffers::default();
                sampler.sample(nz * i / 6, &mut layer);
                layer
            })
            .collect();
        let mut encoder = LayerEncoder::default();
        for wanted in [
            &["occupancy"][..],
            &["fraction"],
            &["material"],
            &["sdf"],
            &["occupancy", "fraction", "sdf", "material"],
        ] {
            for compression in &Compression::ALL[..6] {
                let (mut samples, mut file, mut seconds) = (0, 0, 0.0);
                for layer in &layers {
                    let mut list = vec![
                        ("occupancy", Samples::Half(&layer.occupancy)),
                        ("fraction", Samples::Float(&layer.fraction)),
                        ("sdf", Samples::Float(&layer.sdf)),
                        ("material", Samples::Uint(&layer.material)),
                    ];
                    list.retain(|c| wanted.contains(&c.0));
                    samples += list
                        .iter()
                        .map(|c| c.1.len() * c.1.kind().bytes())
                        .sum::<usize>();
                    let mut best = f64::INFINITY;
                    for round in 0..4 {
                        let start = std::time::Instant::now();
                        let bytes = encoder
                            .encode([nx, ny], &list, &attributes(), *compression)
                            .unwrap();
                        best = best.min(start.elapsed().as_secs_f64());
                        if round == 0 {
                            file += bytes.len();
                        }
                    }
                    seconds += best;
                }
                eprintln!(
                    "{:32} {compression:6} ratio {:.3}  {:6.0} MB/s",
                    wanted.join(" "),
                    file as f64 / samples as f64,
                    samples as f64 / seconds / 1e6
                );
            }
        }
    }
}
