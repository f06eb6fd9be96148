//! Rows of a layer that wait to be written together past the caches.
//!
//! Rows come upwards from the first, or in pairs that mirror each other: one from the first row upwards, the other from
//! the last downwards. Each kind waits in a buffer of its own until that is long enough. Only whole lines of memory
//! are written; what is left at the end of the rows so far is carried to where it joins the next ones, since a line
//! written in two parts is read in between, which takes as long as writing many.

use super::memory::{LINE, Stream};

/// Rows that wait, upwards from a row and downwards to the rows that mirror them.
#[derive(Debug, Default)]
pub(super) struct RowQueue {
    /// Room for what is carried, and then rows.
    ahead: Vec<f32>,
    /// Rows, the last pushed first, and then room for what is carried.
    behind: Vec<f32>,
    width: usize,
    together: usize,
    /// The first row that waits.
    first: usize,
    waiting: [usize; 2],
    /// Values carried.
    carried: [usize; 2],
}

impl RowQueue {
    /// Begins a layer of rows of `width` voxels, some `bytes` of which are written together; lanes may write `padding`
    /// values beyond the last.
    pub(super) fn start(&mut self, width: usize, bytes: usize, padding: usize) {
        self.width = width;
        self.together = (bytes / (4 * width)).max(1);
        let rows = self.together * width;
        self.ahead.resize(LINE + rows + padding, 0.0);
        self.behind.resize(rows + LINE, 0.0);
        self.first = 0;
        self.waiting = [0; 2];
        self.carried = [0; 2];
    }

    /// Rows that either buffer has room for.
    pub(super) fn room(&self) -> usize {
        self.together
    }

    /// Rows that wait from the first upwards.
    pub(super) fn waiting(&self) -> usize {
        self.waiting[0]
    }

    /// The buffer of the rows from the first upwards, with what lanes may write beyond them. Rows that are filled in it
    /// are [added](Self::add_ahead).
    pub(super) fn ahead(&mut self) -> &mut [f32] {
        &mut self.ahead[LINE..]
    }

    /// Adds a row that was filled in the buffer.
    pub(super) fn add_ahead(&mut self) {
        self.waiting[0] += 1;
    }

    /// Adds a row to those from the first upwards.
    pub(super) fn push_ahead(&mut self, row: &[f32]) {
        let at = LINE + self.waiting[0] * self.width;
        self.ahead[at..at + self.width].copy_from_slice(row);
        self.waiting[0] += 1;
    }

    /// Adds a row to those from the last downwards.
    pub(super) fn push_behind(&mut self, row: &[f32]) {
        let at = self.behind_at(self.waiting[1]);
        self.behind[at..at + self.width].copy_from_slice(row);
        self.waiting[1] += 1;
    }

    /// Adds the row that the last one added upwards mirrors.
    pub(super) fn add_behind(&mut self) {
        let from = LINE + (self.waiting[0] - 1) * self.width;
        let at = self.behind_at(self.waiting[1]);
        let row = &self.ahead[from..from + self.width];
        self.behind[at..at + self.width].copy_from_slice(row);
        self.waiting[1] += 1;
    }

    /// The row number `n` of those that wait, upwards or downwards.
    pub(super) fn waiting_row(&mut self, n: usize, downwards: bool) -> &mut [f32] {
        let width = self.width;
        if downwards {
            let at = self.behind_at(n);
            &mut self.behind[at..at + width]
        } else {
            &mut self.ahead[LINE + n * width..LINE + (n + 1) * width]
        }
    }

    fn behind_at(&self, n: usize) -> usize {
        (self.together - 1 - n) * self.width
    }

    /// Whether the next row must wait until [`write`](Self::write) has made room.
    pub(super) fn is_full(&self) -> bool {
        self.waiting[0] == self.together
    }

    /// Writes what waits to its rows of a layer; but for the `last`, some of it is carried to the next time.
    pub(super) fn write(&mut self, stream: Option<&Stream>, layer: &mut [f32], last: bool) {
        let width = self.width;
        let rows = layer.len() / width;
        let [ahead, behind] = self.waiting;
        let [tail, head] = self.carried;
        let from = &self.ahead[LINE - tail..LINE + ahead * width];
        let at = self.first * width - tail;
        let rest = put(
            stream,
            from,
            &mut layer[at..at + from.len()],
            last,
            Left::Tail,
        );
        let end = LINE + ahead * width;
        self.ahead.copy_within(end - rest..end, LINE - rest);
        // As many rows were written from the last downwards as from the first upwards.
        let whole = self.together * width;
        let start = whole - behind * width;
        let from = &self.behind[start..whole + head];
        let at = (rows - self.first - behind) * width;
        let left = put(
            stream,
            from,
            &mut layer[at..at + from.len()],
            last,
            Left::Head,
        );
        self.behind.copy_within(start..start + left, whole);
        self.carried = [rest, left];
        self.first += ahead;
        self.waiting = [0; 2];
    }
}

/// Which part of some values may be left for the next time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Left {
    Head,
    Tail,
}

/// Writes values, but for a part of a line; how many are left.
fn put(
    stream: Option<&Stream>,
    from: &[f32],
    to: &mut [f32],
    last: bool,
    may_leave: Left,
) -> usize {
    let Some(stream) = stream else {
        to.copy_from_slice(from);
        return 0;
    };
    let [head, tail] = if last {
        [0, to.len()]
    } else {
        let [head, tail] = stream.whole_lines(to);
        match may_leave {
            Left::Head => [head, to.len()],
            Left::Tail => [0, tail],
        }
    };
    stream.copy(
        bytemuck::cast_slice(&from[head..tail]),
        bytemuck::cast_slice_mut(&mut to[head..tail]),
    );
    to.len() - (tail - head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::every_kernel;

    #[test]
    fn rows_arrive_where_they_belong() {
        let streams: Vec<_> = every_kernel().into_iter().map(Stream::new).collect();
        let streams: Vec<_> = streams.iter().map(Some).chain([None]).collect();
        for width in [1, 3, 16, 17, 64, 150] {
            let row = |j: usize| -> Vec<f32> {
                #[allow(clippy::cast_precision_loss, reason = "small counts")]
                (0..width).map(|i| (j * width + i) as f32).collect()
            };
            let mut queue = RowQueue::default();
            for rows in [1, 2, 10, 11, 40, 41] {
                for (mirrored, shift) in [(false, 0), (true, 0), (false, 5), (true, 5), (true, 13)]
                {
                    for stream in &streams {
                        let mut buffer = vec![-1.0; rows * width + shift + 1];
                        queue.start(width, 4 * 7 * width, 3);
                        let first_half = if mirrored { rows.div_ceil(2) } else { rows };
                        for j in 0..first_half {
                            if j % 2 == 0 {
                                queue.push_ahead(&row(j));
                            } else {
                                queue.waiting_row(j % 7, false).copy_from_slice(&row(j));
                                queue.add_ahead();
                            }
                            if mirrored && 2 * j + 1 < rows {
                                if j % 3 == 0 {
                                    queue.add_behind();
                                    assert_eq!(queue.waiting_row(j % 7, true), row(j));
                                    let twin = row(rows - 1 - j);
                                    queue.waiting_row(j % 7, true).copy_from_slice(&twin);
                                } else {
                                    queue.push_behind(&row(rows - 1 - j));
                                }
                            }
                            let last = j + 1 == first_half;
                            if queue.is_full() || last {
                                let layer = &mut buffer[shift..shift + rows * width];
                                queue.write(*stream, layer, last);
                            }
                        }
                        let layer = &buffer[shift..shift + rows * width];
                        for (j, found) in layer.chunks(width).enumerate() {
                            assert_eq!(found, row(j), "row {j} of {rows}, {mirrored}");
                        }
                        let around = [&buffer[..shift], &buffer[shift + rows * width..]].concat();
                        assert!(around.iter().all(|v| *v == -1.0));
                    }
                }
            }
        }
    }
}
