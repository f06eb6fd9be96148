//! Which instructions the inner loops use.
//!
//! Every loop has a plain form, which is its definition, and wide ones that do the same operations in the same
//! order, a sample in each lane, with no fused multiply-add: all agree bit for bit, and a run on one machine can be
//! reproduced on another.

use pulp::Arch;

/// The processor lacks the instructions that were asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("this machine has no {level:?} instructions")]
pub struct SimdUnavailable {
    /// What was asked for.
    pub level: SimdLevel,
}

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
    /// [`SimdUnavailable`] when this machine lacks the instructions.
    ///
    /// ```
    /// # use voxlathe::math::{Kernel, SimdLevel};
    /// assert_eq!(Kernel::new(SimdLevel::Scalar)?.level(), SimdLevel::Scalar);
    /// # Ok::<(), voxlathe::math::SimdUnavailable>(())
    /// ```
    pub fn new(level: SimdLevel) -> Result<Self, SimdUnavailable> {
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
            None => Err(SimdUnavailable { level }),
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

    /// Runs a job whose loops are the same for all lanes.
    pub(crate) fn dispatch<J: pulp::WithSimd>(self, job: J) -> J::Output {
        match self.0 {
            Loops::Scalar => job.with_simd(pulp::Scalar),
            Loops::Wide(arch) => arch.dispatch(job),
        }
    }

    /// The machine's lanes, unless the plain loops were chosen.
    pub(crate) fn lanes(self) -> Option<Arch> {
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

#[cfg(test)]
pub(crate) fn every_kernel() -> Vec<Kernel> {
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
                Err(error) => assert_eq!(error, SimdUnavailable { level }),
            }
        }
    }
}
