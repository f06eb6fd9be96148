//! Digests of channels whose slabs come in any order.

use std::collections::BTreeMap;

/// The BLAKE3 digest of bytes that come in numbered pieces: what is early waits.
#[derive(Debug, Default)]
pub(super) struct Ordered {
    hasher: blake3::Hasher,
    next: usize,
    early: BTreeMap<usize, Vec<u8>>,
}

impl Ordered {
    /// Adds piece `number`.
    pub(super) fn add(&mut self, number: usize, bytes: Vec<u8>) {
        self.early.insert(number, bytes);
        while let Some(bytes) = self.early.remove(&self.next) {
            self.hasher.update(&bytes);
            self.next += 1;
        }
    }

    /// Of all pieces so far, in hexadecimal.
    pub(super) fn finish(&self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_pieces_does_not_matter() {
        let mut found = Ordered::default();
        for (number, bytes) in [(2, "c"), (0, "a"), (3, "d"), (1, "b")] {
            found.add(number, bytes.into());
        }
        assert_eq!(found.finish(), blake3::hash(b"abcd").to_hex().to_string());
    }
}
