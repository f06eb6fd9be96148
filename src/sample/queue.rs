//! Rows that wait to be written together past the caches.
//!
//! Rows come in pairs that mirror each other: one from the first row upwards, the other from the last downwards. Each
//! kind waits in a buffer of its own until that is long enough to be worth the stores that go past the caches.

use super::memory::Stream;

/// Bytes written together: much more than a line, much less than a cache.
const TOGETHER: usize = 1 << 16;

/// Rows that wait, upwards from a row and downwards to the rows that mirror them.
#[derive(Debug, Default)]
pub(super) struct RowQueue {
    ahead: Vec<f32>,
    behind: Vec<f32>,
    width: usize,
    together: usize,
    /// The first row that waits.
    first: usize,
    waiting: [usize; 2],
}

impl RowQueue {
    /// Begins a layer of rows of `width` voxels.
    pub(super) fn start(&mut self, width: usize) {
        self.width = width;
        self.together = (TOGETHER / (4 * width)).max(1);
        self.ahead.resize(self.together * width, 0.0);
        self.behind.resize(self.together * width, 0.0);
        self.first = 0;
        self.waiting = [0; 2];
    }

    /// Adds a row to those from the first upwards; at least one buffer has room.
    pub(super) fn push_ahead(&mut self, row: &[f32]) {
        let at = self.waiting[0] * self.width;
        self.ahead[at..at + self.width].copy_from_slice(row);
        self.waiting[0] += 1;
    }

    /// Adds a row to those from the last downwards.
    pub(super) fn push_behind(&mut self, row: &[f32]) {
        let at = (self.together - 1 - self.waiting[1]) * self.width;
        self.behind[at..at + self.width].copy_from_slice(row);
        self.waiting[1] += 1;
    }

    /// Whether the next row must wait until [`write`](Self::write) has made room.
    pub(super) fn is_full(&self) -> bool {
        self.waiting[0] == self.together
    }

    /// Writes what waits to its rows of a layer.
    pub(super) fn write(&mut self, stream: &Stream, layer: &mut [f32]) {
        let width = self.width;
        let rows = layer.len() / width;
        let [ahead, behind] = self.waiting;
        let from = (self.together - behind) * width;
        // As many rows were written from the last downwards as from the first upwards.
        let parts = [
            (&self.ahead[..ahead * width], self.first),
            (&self.behind[from..], rows - self.first - behind),
        ];
        for (from, row) in parts {
            let to = &mut layer[row * width..row * width + from.len()];
            stream.copy(bytemuck::cast_slice(from), bytemuck::cast_slice_mut(to));
        }
        self.first += ahead;
        self.waiting = [0; 2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Kernel;

    #[test]
    fn rows_arrive_where_they_belong() {
        const WIDTH: usize = 1500;
        let row = |j: usize| vec![f32::from(u16::try_from(j).expect("few rows")); WIDTH];
        let mut queue = RowQueue::default();
        for rows in [1, 2, 10, 11, 40, 41] {
            for mirrored in [false, true] {
                let mut layer = vec![-1.0; rows * WIDTH];
                queue.start(WIDTH);
                let first_half = if mirrored { rows.div_ceil(2) } else { rows };
                for j in 0..first_half {
                    queue.push_ahead(&row(j));
                    if mirrored && 2 * j + 1 < rows {
                        queue.push_behind(&row(rows - 1 - j));
                    }
                    if queue.is_full() || j + 1 == first_half {
                        queue.write(&Stream::new(Kernel::default()), &mut layer);
                    }
                }
                for (j, found) in layer.chunks(WIDTH).enumerate() {
                    assert_eq!(found, row(j), "row {j} of {rows}, {mirrored}");
                }
            }
        }
    }
}
