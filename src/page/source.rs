//! Where the samples of a page come from: layers of channels, by their bits.

use super::codec::Kind;
use crate::error::Error;
use crate::grid::{Channel, GridSpec};
use crate::io::exr::SampleKind;
use crate::sample::{LayerBuffers, LayerSampler, Tally};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// A channel of a page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChannelHead {
    pub(super) name: String,
    pub(super) unit: Option<String>,
    pub(super) meaning: String,
    pub(super) kind: Kind,
}

impl ChannelHead {
    pub(super) fn kind_of(kind: SampleKind) -> Kind {
        match kind {
            SampleKind::Uint => Kind::Uint,
            SampleKind::Float | SampleKind::Half => Kind::Float,
        }
    }
}

/// What gives the layers of a grid.
pub(super) trait Layers: Sync {
    /// What a thread reuses from layer to layer.
    type Scratch: Default;

    /// The samples of layer `k`, one list for each channel wanted, x fastest, as bits.
    fn layer(
        &self,
        k: usize,
        wanted: &[ChannelHead],
        scratch: &mut Self::Scratch,
    ) -> Result<Vec<Vec<u32>>, Error>;
}

/// What is counted of layers.
#[derive(Debug, Default)]
pub(super) struct Counts {
    /// Voxels inside.
    pub(super) inside: u64,
    /// The sum of fractions of each layer: they are added in the order of the layers, whoever sampled them.
    pub(super) fractions: BTreeMap<usize, f64>,
    pub(super) tally: Tally,
}

/// A scene's sampler, and the names of its scalars and of shares of materials in their order.
pub(super) struct Sampled<'a> {
    pub(super) sampler: &'a LayerSampler<'a>,
    pub(super) scalars: &'a [String],
    pub(super) shares: &'a [String],
    /// Where the layers are counted.
    pub(super) counts: Option<&'a Mutex<Counts>>,
}

impl Layers for Sampled<'_> {
    type Scratch = LayerBuffers;

    fn layer(
        &self,
        k: usize,
        wanted: &[ChannelHead],
        buffers: &mut LayerBuffers,
    ) -> Result<Vec<Vec<u32>>, Error> {
        self.sampler.sample(k, buffers);
        let buffers = &*buffers;
        if let Some(counts) = self.counts {
            let mut counts = counts.lock().unwrap_or_else(PoisonError::into_inner);
            counts.inside += buffers.inside;
            counts.fractions.insert(k, buffers.fraction_sum);
            counts.tally.add(&buffers.tally);
        }
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect();
        let named = |names: &[String], lists: &[Vec<f32>], name: &str| {
            let at = names.iter().position(|n| n == name);
            at.and_then(|at| lists.get(at))
                .map_or_else(Vec::new, |v| bits(v))
        };
        let one = |head: &ChannelHead| match Channel::from_name(&head.name) {
            Some(Channel::Occupancy) => buffers.occupancy.iter().map(|&v| v.into()).collect(),
            Some(Channel::Fraction) => bits(&buffers.fraction),
            Some(Channel::Sdf) => bits(&buffers.sdf),
            Some(Channel::Material) => buffers.material.clone(),
            Some(other) => {
                let found = buffers.others.iter().find(|(channel, _)| *channel == other);
                found.map_or_else(Vec::new, |(_, values)| bits(values))
            }
            None if self.shares.contains(&head.name) => {
                named(self.shares, &buffers.material_fractions, &head.name)
            }
            None => named(self.scalars, &buffers.scalars, &head.name),
        };
        Ok(wanted.iter().map(one).collect())
    }
}

/// Bytes that a worker takes for a slab of some layers: its samples, what is made of them, what is compressed, and the
/// slabs whose digest waits for one before them.
pub(super) fn bytes_per_slab(grid: &GridSpec, channels: usize, layers: usize) -> u64 {
    let voxels = (grid.layer_len() as u64).saturating_mul(layers as u64);
    let samples = voxels.saturating_mul(4 * channels as u64);
    let waiting = samples.saturating_mul(1 + super::channels::AHEAD as u64);
    (samples.saturating_add(waiting)).saturating_add(voxels.saturating_mul(4 + 3))
}
