//! Layers gathered into pieces that are worth compressing.
//!
//! A compressor that starts anew with each layer of a small grid would find nothing to refer back to. Layers are
//! gathered until they are a mebibyte together; one that is as large as that is a piece by itself, and is not copied.
//! The pieces depend on the size of a layer alone.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Bytes of a piece, at least, where there are so many.
const WORTH: usize = 1 << 20;

/// The pieces of an array whose layers come in any order.
#[derive(Debug)]
pub(in super::super) struct Groups {
    layer_bytes: usize,
    layers: usize,
    /// Layers of a piece, but for the last.
    each: usize,
    open: Mutex<BTreeMap<usize, Open>>,
}

#[derive(Debug)]
struct Open {
    bytes: Vec<u8>,
    missing: usize,
}

impl Groups {
    pub(in super::super) fn new(layer_bytes: usize, layers: usize) -> Self {
        let each = Self::layers_of_each(layer_bytes, layers);
        Self::of_layers(each, layer_bytes, layers)
    }

    /// Pieces of `each` layers.
    pub(in super::super) fn of_layers(each: usize, layer_bytes: usize, layers: usize) -> Self {
        Self {
            layer_bytes,
            layers,
            each,
            open: Mutex::default(),
        }
    }

    /// Layers that are worth compressing together.
    pub(in super::super) fn layers_of_each(layer_bytes: usize, layers: usize) -> usize {
        WORTH.div_ceil(layer_bytes.max(1)).clamp(1, layers)
    }

    /// How many pieces there are.
    pub(in super::super) fn count(&self) -> usize {
        self.layers.div_ceil(self.each)
    }

    /// Bytes of each piece but the last.
    pub(in super::super) fn piece_bytes(&self) -> usize {
        self.each * self.layer_bytes
    }

    /// Bytes of the last piece.
    pub(in super::super) fn last_bytes(&self) -> usize {
        (self.layers - (self.count() - 1) * self.each) * self.layer_bytes
    }

    /// Bytes that are kept while layers come almost in order.
    pub(in super::super) fn kept(layer_bytes: usize, layers: usize) -> u64 {
        match Self::layers_of_each(layer_bytes, layers) {
            1 => 0,
            each => 2 * (each * layer_bytes) as u64,
        }
    }

    /// Takes in layer `k`, and gives `whole` the number and the bytes of the piece that it completes.
    pub(in super::super) fn add<E>(
        &self,
        k: usize,
        layer: &[u8],
        whole: impl FnOnce(usize, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        if self.each == 1 {
            return whole(k, layer);
        }
        let (piece, within) = (k / self.each, k % self.each);
        let done = {
            let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
            let count = self.each.min(self.layers - piece * self.each);
            let found = open.entry(piece).or_insert_with(|| Open {
                bytes: vec![0; count * self.layer_bytes],
                missing: count,
            });
            found.bytes[within * self.layer_bytes..][..self.layer_bytes].copy_from_slice(layer);
            found.missing -= 1;
            if found.missing == 0 {
                open.remove(&piece)
            } else {
                None
            }
        };
        done.map_or(Ok(()), |done| whole(piece, &done.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_their_layers_in_order() {
        for (layer_bytes, layers) in [(3, 5), (1000, 2500), (WORTH / 4 + 1, 9), (WORTH, 3)] {
            let groups = Groups::new(layer_bytes, layers);
            let mut found = vec![None; groups.count()];
            for k in (0..layers).rev() {
                let layer = vec![(k % 251) as u8; layer_bytes];
                let none: Result<(), ()> = groups.add(k, &layer, |piece, bytes| {
                    found[piece] = Some(bytes.to_vec());
                    Ok(())
                });
                none.unwrap();
            }
            let all: Vec<u8> = found.iter().flat_map(|f| f.clone().unwrap()).collect();
            let wanted = (0..layers).flat_map(|k| vec![(k % 251) as u8; layer_bytes]);
            assert!(all.iter().copied().eq(wanted));
            assert_eq!(
                found.last().unwrap().as_ref().unwrap().len(),
                groups.last_bytes()
            );
            assert!(
                groups.count() == 1 || found[0].as_ref().unwrap().len() == groups.piece_bytes()
            );
        }
    }
}
