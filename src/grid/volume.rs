//! A whole grid of values in memory: the library's answer when a caller asks for one.

use super::GridSpec;

/// Values of every voxel of a grid, x fastest, then y, then z.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume<T> {
    grid: GridSpec,
    data: Vec<T>,
}

impl<T> Volume<T> {
    /// The values `data` on `grid`.
    ///
    /// # Panics
    /// When `data` does not hold one value for each voxel.
    #[must_use]
    pub fn new(grid: GridSpec, data: Vec<T>) -> Self {
        assert_eq!(
            data.len() as u64,
            grid.voxel_count(),
            "one value for each voxel"
        );
        Self { grid, data }
    }

    /// The grid the values belong to.
    #[must_use]
    pub fn grid(&self) -> &GridSpec {
        &self.grid
    }

    /// All values, x fastest, then y, then z.
    #[must_use]
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// The values of z layer `k`, x fastest, then y.
    ///
    /// # Panics
    /// When `k` is not a layer of the grid.
    #[must_use]
    pub fn layer(&self, k: usize) -> &[T] {
        let n = self.grid.layer_len();
        &self.data[k * n..(k + 1) * n]
    }

    /// The value of voxel (i, j, k).
    ///
    /// # Panics
    /// When the voxel is outside the grid.
    #[must_use]
    pub fn get(&self, i: usize, j: usize, k: usize) -> &T {
        let [nx, ny, _] = self.grid.dims();
        assert!(
            i < nx && j < ny,
            "voxel ({i}, {j}, {k}) is outside the grid"
        );
        &self.layer(k)[j * nx + i]
    }
}
