//! Values of a layer that were found at some cost: many voxels share them, those that mirror each other in the
//! diagonals, and those at one place along a cap that is parallel to their rows.

/// Values by place, in a table of fixed size: a later one takes the room of an earlier.
#[derive(Debug, Default)]
pub(super) struct Known {
    entries: Vec<(u32, f32)>,
}

/// No place of a voxel: those are within a lattice of 2^15 cells.
const NONE: u32 = u32::MAX;
const LENGTH: usize = 512;

impl Known {
    /// Forgets all; makes room the first time.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.entries.resize(LENGTH, (NONE, 0.0));
    }

    /// The value at a place, which `find` tells where it is not known.
    #[inline]
    pub(super) fn value(&mut self, place: u32, find: impl FnOnce() -> f32) -> f32 {
        // The golden ratio's bits spread neighbours.
        let at = (place.wrapping_mul(0x9e37_79b9) >> 16) as usize % self.entries.len();
        let entry = &mut self.entries[at];
        if entry.0 != place {
            *entry = (place, find());
        }
        entry.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_once_until_their_room_is_taken() {
        let mut known = Known::default();
        known.clear();
        let mut found = 0_u32;
        for place in (0..5000_u32).map(|n| n * 7919 % 700) {
            let value = known.value(place, || {
                found += 1;
                place as f32
            });
            assert_eq!(value, place as f32);
        }
        assert!(found < 5000, "{found}");
        assert_eq!(known.value(3, || 3.0), 3.0);
        known.clear();
        assert_eq!(known.value(3, || 4.0), 4.0);
    }
}
