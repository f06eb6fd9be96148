//! The inner loops over samples, and which of them runs.
//!
//! The plain loops in [`scalar`] are the definition. Those in [`wide`] do the same operations in
//! the same order for 4 or 8 samples of one span at a time, and neither uses a fused multiply-add,
//! so the two agree bit for bit and a run on one machine can be reproduced on another.

pub(super) mod scalar;
pub(super) mod wide;

use super::NurbsError;
use super::cache::Run;
use pulp::Arch;

/// Which instructions the inner loops use. The results do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SimdLevel {
    /// The widest lanes this machine has.
    #[default]
    Auto,
    /// One sample at a time: the definition.
    Scalar,
    /// Four samples at a time, x86-64 with AVX2.
    Avx2,
    /// Eight samples at a time, x86-64 with AVX-512.
    Avx512,
}

/// The inner loops chosen once for this machine, or forced.
#[derive(Debug, Clone, Copy)]
pub struct Kernel(Loops);

#[derive(Debug, Clone, Copy)]
enum Loops {
    Scalar,
    Wide(Arch),
}

impl Kernel {
    /// The loops for `level`.
    ///
    /// # Errors
    /// [`NurbsError::SimdUnavailable`] when this machine lacks the instructions.
    ///
    /// ```
    /// # use voxlathe::nurbs::{Kernel, SimdLevel};
    /// assert_eq!(Kernel::new(SimdLevel::Scalar)?.level(), SimdLevel::Scalar);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn new(level: SimdLevel) -> Result<Self, NurbsError> {
        let arch = match level {
            SimdLevel::Auto => Some(Arch::new()),
            SimdLevel::Scalar => return Ok(Self(Loops::Scalar)),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => pulp::x86::V4::try_new().map(Arch::V4),
            #[cfg(not(target_arch = "x86_64"))]
            SimdLevel::Avx2 | SimdLevel::Avx512 => None,
        };
        match arch {
            None => Err(NurbsError::SimdUnavailable { level }),
            Some(Arch::Scalar) => Ok(Self(Loops::Scalar)),
            Some(arch) => Ok(Self(Loops::Wide(arch))),
        }
    }

    /// What was chosen; [`SimdLevel::Auto`] where the machine's lanes have no name of their own.
    #[must_use]
    pub fn level(self) -> SimdLevel {
        match self.0 {
            Loops::Scalar => SimdLevel::Scalar,
            #[cfg(target_arch = "x86_64")]
            Loops::Wide(Arch::V3(_)) => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Loops::Wide(Arch::V4(_)) => SimdLevel::Avx512,
            Loops::Wide(_) => SimdLevel::Auto,
        }
    }

    /// The machine's lanes, unless the plain loops were chosen.
    pub(super) fn lanes(self) -> Option<Arch> {
        match self.0 {
            Loops::Scalar => None,
            Loops::Wide(arch) => Some(arch),
        }
    }
}

impl Default for Kernel {
    /// The widest lanes this machine has.
    fn default() -> Self {
        Self::new(SimdLevel::Auto).expect("the automatic choice falls back to the plain loops")
    }
}

/// Curves over one table of basis functions, to be evaluated at all of its samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curves<'a> {
    /// Rows of basis values.
    pub(super) basis: &'a [f64],
    /// From a row to the next.
    pub(super) stride: usize,
    /// The runs of samples.
    pub(super) runs: &'a [Run],
    /// The degree.
    pub(super) degree: usize,
    /// Control points of a curve.
    pub(super) control_points: usize,
    /// Samples of a curve.
    pub(super) samples: usize,
    /// Weighted coordinates x, y, z and weights, curve after curve.
    pub(super) net: [&'a [f64]; 4],
}

/// Rows of equal length in one slice: row i is `values[i * stride ..][..samples]`.
#[derive(Debug)]
pub(super) struct Rows<'a> {
    /// The values.
    pub(super) values: &'a mut [f64],
    /// From a row to the next.
    pub(super) stride: usize,
}

#[cfg(test)]
pub(super) fn every_kernel() -> Vec<Kernel> {
    [SimdLevel::Auto, SimdLevel::Avx2, SimdLevel::Avx512]
        .into_iter()
        .filter_map(|level| Kernel::new(level).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forced_level_is_the_one_that_runs() {
        assert_eq!(
            Kernel::new(SimdLevel::Scalar).map(Kernel::level),
            Ok(SimdLevel::Scalar)
        );
        for level in [SimdLevel::Avx2, SimdLevel::Avx512] {
            match Kernel::new(level) {
                Ok(kernel) => assert_eq!(kernel.level(), level),
                Err(error) => assert_eq!(error, NurbsError::SimdUnavailable { level }),
            }
        }
    }
}
