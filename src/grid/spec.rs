//! Where the voxels are.
//!
//! ```text
//!   centre(i, j, k) = origin + (i + 1/2, j + 1/2, k + 1/2) * spacing      in f64, unfused
//! ```
//!
//! `origin` is the minimum corner of voxel (0, 0, 0). x varies fastest in memory, then y, then z.

use glam::DVec3;

/// A dense axis-aligned voxel grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSpec {
    dims: [usize; 3],
    origin: DVec3,
    spacing: DVec3,
}

/// Why a grid cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// A dimension is zero or larger than an image can be.
    #[error(
        "grid dimension {axis} is {found}; it must be between 1 and {}",
        GridSpec::MAX_DIM
    )]
    Dimension {
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given.
        found: f64,
    },
    /// The number of voxels does not fit 63 bits.
    #[error("a grid of {} x {} x {} voxels is too large to number", dims[0], dims[1], dims[2])]
    TooManyVoxels {
        /// The dimensions asked for.
        dims: [usize; 3],
    },
    /// A spacing is not positive and finite.
    #[error("grid spacing {axis} is {found}; it must be finite and greater than zero")]
    Spacing {
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given.
        found: f64,
    },
    /// An origin is not finite, or so far out that neighbouring voxel centres coincide.
    #[error(
        "grid origin {axis} is {found}, where f64 cannot tell neighbouring voxels of spacing {spacing} apart"
    )]
    Origin {
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given.
        found: f64,
        /// The spacing along that axis.
        spacing: f64,
    },
}

const AXES: [char; 3] = ['x', 'y', 'z'];

impl GridSpec {
    /// The largest number of voxels along one axis: what an OpenEXR window can number.
    pub const MAX_DIM: usize = i32::MAX as usize;

    /// A grid of `dims` voxels of size `spacing` whose minimum corner is `origin`.
    ///
    /// # Errors
    /// [`GridError`] when a dimension is zero or above [`Self::MAX_DIM`], when the voxel count does
    /// not fit 63 bits, when a spacing is not positive and finite, or when neighbouring voxel
    /// centres would coincide in f64.
    pub fn new(dims: [usize; 3], origin: DVec3, spacing: DVec3) -> Result<Self, GridError> {
        for a in 0..3 {
            if dims[a] == 0 || dims[a] > Self::MAX_DIM {
                #[allow(clippy::cast_precision_loss, reason = "only printed")]
                let found = dims[a] as f64;
                return Err(GridError::Dimension {
                    axis: AXES[a],
                    found,
                });
            }
            if !(spacing[a] > 0.0 && spacing[a].is_finite()) {
                return Err(GridError::Spacing {
                    axis: AXES[a],
                    found: spacing[a],
                });
            }
        }
        let count = dims.iter().try_fold(1_u64, |n, &d| n.checked_mul(d as u64));
        if count.is_none_or(|n| n > i64::MAX as u64) {
            return Err(GridError::TooManyVoxels { dims });
        }
        let grid = Self {
            dims,
            origin,
            spacing,
        };
        for a in 0..3 {
            let bad = |c: f64, d: f64| !c.is_finite() || c == d;
            let n = dims[a];
            if bad(grid.centre_along(a, 0), grid.centre_along(a, 1))
                || bad(grid.centre_along(a, n - 1), grid.centre_along(a, n))
                || !origin[a].is_finite()
            {
                return Err(GridError::Origin {
                    axis: AXES[a],
                    found: origin[a],
                    spacing: spacing[a],
                });
            }
        }
        Ok(grid)
    }

    /// Number of voxels along x, y and z.
    #[must_use]
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Minimum corner of voxel (0, 0, 0), in scene units.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Size of a voxel along x, y and z, in scene units.
    #[must_use]
    pub fn spacing(&self) -> DVec3 {
        self.spacing
    }

    /// Coordinate along `axis` (0, 1, 2) of the centre of the voxels with that `index`.
    #[must_use]
    pub fn centre_along(&self, axis: usize, index: usize) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "dimensions are below 2^31")]
        let steps = index as f64 + 0.5;
        self.origin[axis] + steps * self.spacing[axis]
    }

    /// Coordinate along `axis` (0, 1, 2) of the lower side of the voxels with that `index`; there is one side more than
    /// voxels.
    #[must_use]
    pub fn side_along(&self, axis: usize, index: usize) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "dimensions are below 2^31")]
        let steps = index as f64;
        self.origin[axis] + steps * self.spacing[axis]
    }

    /// Centre of voxel (i, j, k), in scene units.
    ///
    /// ```
    /// # use voxlathe::grid::GridSpec;
    /// # use glam::DVec3;
    /// let grid = GridSpec::new([2, 3, 5], DVec3::ZERO, DVec3::splat(2.0))?;
    /// assert_eq!(grid.centre(1, 0, 2), DVec3::new(3.0, 1.0, 5.0));
    /// # Ok::<(), voxlathe::grid::GridError>(())
    /// ```
    #[must_use]
    pub fn centre(&self, i: usize, j: usize, k: usize) -> DVec3 {
        DVec3::new(
            self.centre_along(0, i),
            self.centre_along(1, j),
            self.centre_along(2, k),
        )
    }

    /// Number of voxels in the grid.
    #[must_use]
    pub fn voxel_count(&self) -> u64 {
        self.dims.iter().map(|&d| d as u64).product()
    }

    /// Number of voxels in one z layer.
    #[must_use]
    pub fn layer_len(&self) -> usize {
        self.dims[0] * self.dims[1]
    }

    /// Volume of one voxel, in cubed scene units.
    #[must_use]
    pub fn voxel_volume(&self) -> f64 {
        self.spacing.element_product()
    }
}
