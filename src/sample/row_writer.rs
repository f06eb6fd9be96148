//! Rows of a layer, written past the caches one at a time.
//!
//! Rows come upwards from the first, or in pairs that mirror each other: one from the first row upwards, the other from
//! the last downwards. Only whole lines of memory are written; what a row leaves of a line is carried to the row that
//! joins it there, since a line written in two parts is read in between, which takes as long as writing many.
//!
//! Stores wait in their order for the memory: as few as can be are made besides those that go there, and few at a
//! time, so that the next row is computed meanwhile.

use super::memory::{LINE, Lines, Stream};

/// The row that is being made, and what those before left.
#[derive(Debug, Default)]
pub(super) struct RowWriter {
    /// Room for what is carried to before the row, the row, and room for what is carried to behind it.
    values: Lines<f32>,
    width: usize,
    /// Rows written upwards, and downwards.
    written: [usize; 2],
    /// Values carried to before the next row upwards, and to behind the next downwards.
    carried: [usize; 2],
    behind: [f32; LINE],
}

impl RowWriter {
    /// Begins a layer of rows of `width` voxels; lanes may write `padding` values beyond the last.
    pub(super) fn start(&mut self, width: usize, padding: usize) {
        self.values.resize(LINE + width + padding.max(LINE));
        self.width = width;
        self.written = [0; 2];
        self.carried = [0; 2];
    }

    /// The row that is to be written next, with what lanes may write beyond it.
    pub(super) fn row(&mut self) -> &mut [f32] {
        &mut self.values[LINE..]
    }

    /// Writes the row as the next from the first upwards; but for the `last`, some of it is carried to the next one.
    pub(super) fn write_ahead(&mut self, stream: Option<&Stream>, layer: &mut [f32], last: bool) {
        let (end, [carried, behind]) = (LINE + self.width, self.carried);
        let at = self.written[0] * self.width;
        // The row in the middle joins what is left of the one behind it.
        let all = at + self.width + self.written[1] * self.width == layer.len();
        let behind = if all { behind } else { 0 };
        if behind > 0 {
            self.values[end..end + LINE].copy_from_slice(&self.behind);
        }
        let from = &self.values[LINE - carried..end + behind];
        let to = &mut layer[at - carried..at + self.width + behind];
        let left = put(stream, from, to, last, Left::Tail);
        // As many always: a copy of known length is one load and one store.
        self.values.copy_within(end - LINE..end, 0);
        self.carried[0] = left;
        self.written[0] += 1;
    }

    /// Writes the row as the next from the last downwards; but for the `last`, some of it is carried to the next one.
    pub(super) fn write_behind(&mut self, stream: Option<&Stream>, layer: &mut [f32], last: bool) {
        let (end, carried) = (LINE + self.width, self.carried[1]);
        self.written[1] += 1;
        let at = layer.len() - self.written[1] * self.width;
        self.values[end..end + LINE].copy_from_slice(&self.behind);
        let from = &self.values[LINE..end + carried];
        let to = &mut layer[at..at + self.width + carried];
        let left = put(stream, from, to, last, Left::Head);
        self.behind.copy_from_slice(&self.values[LINE..2 * LINE]);
        self.carried[1] = left;
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
        for width in [1, 3, 15, 16, 17, 33, 64, 150] {
            let row = |j: usize| -> Vec<f32> {
                #[allow(clippy::cast_precision_loss, reason = "small counts")]
                (0..width).map(|i| (j * width + i) as f32).collect()
            };
            let mut writer = RowWriter::default();
            for rows in [1, 2, 10, 11, 40, 41] {
                for (mirrored, shift) in [(false, 0), (true, 0), (false, 5), (true, 5), (true, 13)]
                {
                    for stream in &streams {
                        let mut buffer = vec![-1.0; rows * width + shift + 1];
                        let layer = &mut buffer[shift..shift + rows * width];
                        writer.start(width, 3);
                        let first_half = if mirrored { rows.div_ceil(2) } else { rows };
                        for j in 0..first_half {
                            let last = j + 1 == first_half;
                            writer.row()[..width].copy_from_slice(&row(j));
                            // As lanes do.
                            writer.row()[width..].fill(-2.0);
                            writer.write_ahead(*stream, layer, last);
                            if mirrored && 2 * j + 1 < rows {
                                writer.row()[..width].copy_from_slice(&row(rows - 1 - j));
                                writer.write_behind(*stream, layer, last);
                            }
                        }
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
