//! Rows of a layer from the parts of them that are computed: the rest mirrors those.

use super::memory::Lines;
use std::ops::Range;

/// The parts of rows that follow each other, and how they make whole rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts<'a> {
    /// A part for each row, filled up to `padded` values.
    pub(super) values: &'a [f32],
    pub(super) padded: usize,
    /// Values of a part.
    pub(super) stored: usize,
    /// Values of a row; those beyond the part mirror it.
    pub(super) columns: usize,
}

/// Whole rows, one after the other.
#[derive(Debug)]
pub(super) struct MirroredRows<'a> {
    parts: Parts<'a>,
    /// The parts still to come after the one that is read.
    rows: Range<usize>,
    descending: bool,
    part: &'a [f32],
    at: usize,
}

impl<'a> MirroredRows<'a> {
    /// The rows of some parts, the last first where `descending`.
    pub(super) fn new(parts: Parts<'a>, rows: Range<usize>, descending: bool) -> Self {
        let mut all = Self {
            parts,
            rows,
            descending,
            part: &[],
            at: 0,
        };
        all.turn();
        all
    }

    /// Goes to the next row.
    #[inline(always)]
    fn turn(&mut self) {
        let next = if self.descending {
            self.rows.next_back()
        } else {
            self.rows.next()
        };
        let Parts {
            values,
            padded,
            stored,
            ..
        } = self.parts;
        self.part = next.map_or(&[], |row| &values[row * padded..row * padded + stored]);
        self.at = 0;
    }
}

impl Lines for MirroredRows<'_> {
    #[inline(always)]
    fn value(&mut self) -> f32 {
        let columns = self.parts.columns;
        if self.at == columns {
            self.turn();
        }
        let at = self.at;
        self.at += 1;
        let mirrored = at >= self.part.len();
        self.part[if mirrored { columns - 1 - at } else { at }]
    }

    #[inline(always)]
    fn line(&mut self) -> [f32; 16] {
        let columns = self.parts.columns;
        if let Some(line) = self.part.get(self.at..).and_then(|p| p.first_chunk::<16>()) {
            self.at += 16;
            return *line;
        }
        if self.at >= self.part.len()
            && let Some(end) = columns.checked_sub(self.at)
            && let Some(line) = self.part.get(..end).and_then(|p| p.last_chunk::<16>())
        {
            self.at += 16;
            // Loops, not closures: a call would leave the function that has the lanes switched on.
            let mut reversed = [0.0; 16];
            for (to, from) in reversed.iter_mut().zip(line.iter().rev()) {
                *to = *from;
            }
            return reversed;
        }
        let mut line = [0.0; 16];
        for value in &mut line {
            *value = self.value();
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_completed_in_either_order() {
        for columns in [1, 2, 31, 32, 33, 64, 97] {
            for stored in [columns, usize::div_ceil(columns, 2)] {
                let padded = stored.next_multiple_of(16);
                let values: Vec<f32> = (0_u16..).map(f32::from).take(5 * padded).collect();
                let parts = Parts {
                    values: &values,
                    padded,
                    stored,
                    columns,
                };
                for descending in [false, true] {
                    for start in [0, 1, 5, 15].map(|n| n.min(3 * columns)) {
                        let mut rows = MirroredRows::new(parts, 1..4, descending);
                        let mut found: Vec<f32> = (0..start).map(|_| rows.value()).collect();
                        while found.len() + 16 <= 3 * columns {
                            found.extend(rows.line());
                        }
                        while found.len() < 3 * columns {
                            found.push(rows.value());
                        }
                        let order = if descending { [3, 2, 1] } else { [1, 2, 3] };
                        let wanted = order.into_iter().flat_map(|row| {
                            let values = &values;
                            (0..columns).map(move |i| {
                                let i = if i < stored { i } else { columns - 1 - i };
                                values[row * padded + i]
                            })
                        });
                        assert!(found.into_iter().eq(wanted), "{columns} {stored} {start}");
                    }
                }
            }
        }
    }
}
