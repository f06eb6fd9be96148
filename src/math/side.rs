//! The answer to a question of membership.

/// Where a point lies relative to a closed set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Not in the set.
    Outside,
    /// Met by the set's boundary, to the resolution of double-double.
    On,
    /// In the set's interior.
    Inside,
}

impl Side {
    /// The side of the closure of the complement.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Outside => Self::Inside,
            Self::On => Self::On,
            Self::Inside => Self::Outside,
        }
    }
}
