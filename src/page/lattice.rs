//! The voxels that a page shows: all of a grid, or every so manieth.

use crate::grid::GridSpec;

/// Most voxels along a side of what is shown.
pub const MOST_SIDE: usize = 512;

/// Voxels of a grid at regular steps. What is shown of a large grid are samples of it, not averages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lattice {
    pub(super) grid: GridSpec,
    /// Every so manieth voxel along each axis.
    pub(super) stride: usize,
    /// The first of them.
    pub(super) first: [usize; 3],
    /// How many there are.
    pub(super) dims: [usize; 3],
}

impl Lattice {
    /// The voxels of a grid, at most [`MOST_SIDE`] along each axis.
    pub(super) fn new(grid: GridSpec) -> Self {
        let longest = grid.dims().into_iter().max().unwrap_or(1);
        let stride = longest.div_ceil(MOST_SIDE);
        // The middle of each group; where there is less than one, what there is.
        let first = grid.dims().map(|n| ((stride - 1) / 2).min(n - 1));
        let dims = [0, 1, 2].map(|a| (grid.dims()[a] - first[a]).div_ceil(stride));
        Self {
            grid,
            stride,
            first,
            dims,
        }
    }

    pub(super) fn is_whole(&self) -> bool {
        self.stride == 1
    }

    /// The grid's number of the `k`-th layer.
    pub(super) fn layer(&self, k: usize) -> usize {
        self.first[2] + k * self.stride
    }

    /// What is shown of a layer of the grid.
    pub(super) fn of_layer<T: Copy>(&self, layer: &[T]) -> Vec<T> {
        if self.is_whole() {
            return layer.to_vec();
        }
        let nx = self.grid.dims()[0];
        let rows = (0..self.dims[1]).map(|j| (self.first[1] + j * self.stride) * nx);
        let picked = rows
            .flat_map(|row| (0..self.dims[0]).map(move |i| row + self.first[0] + i * self.stride));
        picked.map(|at| layer[at]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn every_group_has_one_voxel() {
        for dims in [[512, 3, 1], [513, 512, 2], [1024, 7, 1], [1700, 1, 5]] {
            let grid = GridSpec::new(dims, DVec3::ZERO, DVec3::ONE).expect("a grid");
            let lattice = Lattice::new(grid);
            assert_eq!(lattice.is_whole(), dims[0] <= 512);
            for a in 0..3 {
                let last = lattice.first[a] + (lattice.dims[a] - 1) * lattice.stride;
                assert!(last < dims[a] && last + lattice.stride >= dims[a]);
                assert!(lattice.dims[a] <= MOST_SIDE && lattice.dims[a] > 0);
            }
            let layer: Vec<usize> = (0..grid.layer_len()).collect();
            let shown = lattice.of_layer(&layer);
            assert_eq!(shown.len(), lattice.dims[0] * lattice.dims[1]);
            assert_eq!(shown[0], lattice.first[1] * dims[0] + lattice.first[0]);
        }
    }
}
