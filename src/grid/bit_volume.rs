//! A whole grid of yes or no in memory, a bit for each voxel.

use super::GridSpec;

/// Bits of a word.
const WORD: usize = u64::BITS as usize;

/// One bit for every voxel of a grid: an eighth of a [`Volume<u8>`](super::Volume).
///
/// Every z layer begins with a word of its own. Voxel (i, j, k) is bit `j nx + i` of layer k, the lowest bit of a word
/// first; the bits after a layer's last voxel are 0.
#[derive(Debug, Clone, PartialEq)]
pub struct BitVolume {
    grid: GridSpec,
    words: Vec<u64>,
}

impl BitVolume {
    /// Words that a layer of the grid takes.
    #[must_use]
    pub fn words_per_layer(grid: &GridSpec) -> usize {
        grid.layer_len().div_ceil(WORD)
    }

    /// The bits `words` on `grid`.
    ///
    /// # Panics
    /// When `words` does not hold [`words_per_layer`](Self::words_per_layer) words for each layer, or a bit is set
    /// that belongs to no voxel.
    #[must_use]
    pub fn new(grid: GridSpec, words: Vec<u64>) -> Self {
        let per_layer = Self::words_per_layer(&grid);
        assert_eq!(
            Some(words.len()),
            per_layer.checked_mul(grid.dims()[2]),
            "whole layers of words"
        );
        let used = grid.layer_len() % WORD;
        let stray = |layer: &[u64]| used != 0 && layer[per_layer - 1] >> used != 0;
        assert!(
            !words.chunks(per_layer).any(stray),
            "a bit after a layer's last voxel"
        );
        Self { grid, words }
    }

    /// The grid the bits belong to.
    #[must_use]
    pub fn grid(&self) -> &GridSpec {
        &self.grid
    }

    /// The words of z layer `k`.
    ///
    /// # Panics
    /// When `k` is not a layer of the grid.
    #[must_use]
    pub fn layer(&self, k: usize) -> &[u64] {
        let n = Self::words_per_layer(&self.grid);
        &self.words[k * n..(k + 1) * n]
    }

    /// The bit of voxel (i, j, k).
    ///
    /// # Panics
    /// When the voxel is outside the grid.
    #[must_use]
    pub fn get(&self, i: usize, j: usize, k: usize) -> bool {
        let [nx, ny, _] = self.grid.dims();
        assert!(
            i < nx && j < ny,
            "voxel ({i}, {j}, {k}) is outside the grid"
        );
        let at = j * nx + i;
        self.layer(k)[at / WORD] >> (at % WORD) & 1 != 0
    }

    /// How many bits are set.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn grid() -> GridSpec {
        GridSpec::new([7, 11, 3], DVec3::ZERO, DVec3::ONE).unwrap()
    }

    #[test]
    fn bits_are_where_the_documentation_says() {
        assert_eq!(BitVolume::words_per_layer(&grid()), 2);
        // Voxel (2, 9, 1) is bit 65 of layer 1.
        let volume = BitVolume::new(grid(), vec![1, 0, 0, 2, 0, 0]);
        assert!(volume.get(0, 0, 0) && volume.get(2, 9, 1));
        assert!(!volume.get(1, 0, 0) && !volume.get(3, 9, 1) && !volume.get(2, 9, 2));
        assert_eq!(volume.count(), 2);
        assert_eq!(volume.layer(1), [0, 2]);
    }

    #[test]
    #[should_panic(expected = "a bit after a layer's last voxel")]
    fn stray_bits_are_refused() {
        let _ = BitVolume::new(grid(), vec![0, 1 << 13, 0, 0, 0, 0]);
    }
}
