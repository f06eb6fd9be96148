//! Range and sums of a channel, gathered on the way into a file.
//!
//! Every sample is looked at once, in lanes that do not wait for each other. Sums are taken row by
//! row, so they do not depend on how many rows are looked at together.

use std::ops::Range;

use super::super::exr::{SampleKind, Samples};
use super::ChannelSpec;
use crate::grid::{Channel, Stored};

/// Independent accumulators: four of SSE's registers, or one of AVX-512's.
const LANES: usize = 16;

/// Range and sums of a channel in one layer or more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Statistics {
    min: f64,
    max: f64,
    /// Of halves, which are whole numbers.
    pub(in super::super) count: u64,
    /// Of `fraction`.
    pub(in super::super) sum: f64,
    pub(super) infinite: u64,
}

fn stored_as(name: &str) -> Option<Stored> {
    Channel::from_name(name).map(Channel::stored)
}

impl Statistics {
    pub(super) const NONE: Self = Self {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        count: 0,
        sum: 0.0,
        infinite: 0,
    };

    /// Numbers of as many digits as those of a channel of so many voxels are likely to have.
    pub(super) fn likely(channel: &ChannelSpec, voxels: u64) -> Self {
        let whole = channel.kind != SampleKind::Float || channel.name == "fraction";
        let [min, max] = if whole {
            [0.0, 1.0]
        } else {
            [-1.234_567_880_630_493_2, 1.234_567_880_630_493_2]
        };
        Self {
            min,
            max,
            count: voxels / 2,
            sum: 0.123_456_789_012_345_67,
            infinite: 0,
        }
    }

    /// Of the samples in rows of `width`; what is wrong when they cannot be that channel's.
    pub(in super::super) fn of(
        name: &str,
        samples: &Samples<'_>,
        width: usize,
    ) -> Result<Self, String> {
        let mut found = Self::NONE;
        let rows = samples.len().div_ceil(width.max(1));
        found.add(name, samples, 0..rows, width)?;
        Ok(found)
    }

    /// Takes in some rows of the layer.
    pub(super) fn add(
        &mut self,
        name: &str,
        samples: &Samples<'_>,
        rows: Range<usize>,
        width: usize,
    ) -> Result<(), String> {
        let width = width.max(1);
        let first = rows.start * width;
        let part = first..(rows.end * width).min(samples.len());
        let place = |n: usize| format!("voxel ({}, {})", (first + n) % width, (first + n) / width);
        match samples {
            Samples::Half(values) => self.add_halves(name, &values[part], place),
            Samples::Uint(values) => {
                let values = &values[part];
                if !values.is_empty() {
                    let min = values.iter().fold(u32::MAX, |a, &v| a.min(v));
                    let max = values.iter().fold(0, |a, &v| a.max(v));
                    self.include(f64::from(min), f64::from(max));
                }
                Ok(())
            }
            Samples::Float(values) => self.add_floats(name, &values[part], width, place),
        }
    }

    fn add_halves(
        &mut self,
        name: &str,
        values: &[u8],
        place: impl Fn(usize) -> String,
    ) -> Result<(), String> {
        if values.is_empty() {
            return Ok(());
        }
        let min = values.iter().fold(u8::MAX, |a, &v| a.min(v));
        let max = values.iter().fold(0, |a, &v| a.max(v));
        if stored_as(name) == Some(Stored::Mask)
            && max > 1
            && let Some(n) = values.iter().position(|&v| v > 1)
        {
            return Err(format!(
                "{name} of {} is {}; it must be 0 or 1",
                place(n),
                values[n]
            ));
        }
        self.include(f64::from(min), f64::from(max));
        // Short runs, so that narrow sums do not overflow.
        for run in values.chunks(1 << 16) {
            let sum: u32 = run.iter().map(|&v| u32::from(v)).sum();
            self.count += u64::from(sum);
        }
        Ok(())
    }

    fn add_floats(
        &mut self,
        name: &str,
        values: &[f32],
        width: usize,
        place: impl Fn(usize) -> String,
    ) -> Result<(), String> {
        if values.is_empty() {
            return Ok(());
        }
        let (mut min, mut max, all_finite) = extremes(values);
        if !all_finite {
            if let Some(n) = values.iter().position(|v| v.is_nan()) {
                return Err(format!(
                    "{name} of {} is NaN; every sample must be a number",
                    place(n)
                ));
            }
            let finite = || values.iter().copied().filter(|v| v.is_finite());
            self.infinite += (values.len() - finite().count()) as u64;
            min = finite().fold(f32::INFINITY, f32::min);
            max = finite().fold(f32::NEG_INFINITY, f32::max);
        }
        self.include(f64::from(min), f64::from(max));
        if let Some(range) = Channel::from_name(name).and_then(Channel::range) {
            let wrong = |v: &f32| !range.contains(v);
            if (wrong(&min) || wrong(&max) || !all_finite)
                && let Some(n) = values.iter().position(wrong)
            {
                return Err(format!(
                    "{name} of {} is {}; it must be between {} and {}",
                    place(n),
                    values[n],
                    range.start(),
                    range.end()
                ));
            }
        }
        if Channel::from_name(name) == Some(Channel::Fraction) {
            for row in values.chunks(width) {
                self.sum += sum(row);
            }
        }
        Ok(())
    }

    fn include(&mut self, min: f64, max: f64) {
        self.min = self.min.min(min);
        self.max = self.max.max(max);
    }

    /// Of several layers, in their order.
    pub(in super::super) fn join(layers: impl Iterator<Item = Self>) -> Self {
        layers.fold(Self::NONE, |a, b| Self {
            min: a.min.min(b.min),
            max: a.max.max(b.max),
            count: a.count + b.count,
            sum: a.sum + b.sum,
            infinite: a.infinite + b.infinite,
        })
    }

    /// Least and greatest finite sample, where there is one.
    pub(in super::super) fn range(&self) -> Option<[f64; 2]> {
        // A range of zeros has one sign, whatever the order of the samples.
        (self.min <= self.max).then_some([self.min + 0.0, self.max + 0.0])
    }
}

/// Least and greatest value, NaN left out, and whether all are finite.
fn extremes(values: &[f32]) -> (f32, f32, bool) {
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let mut nothing = [0.0_f32; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    let mut include = |lane: usize, value: f32| {
        // As the processor's own minimum has it: a NaN fails the comparison.
        low[lane] = if value < low[lane] { value } else { low[lane] };
        high[lane] = if value > high[lane] {
            value
        } else {
            high[lane]
        };
        // 0 for what is finite, NaN for what is not.
        nothing[lane] += 0.0 * value;
    };
    for chunk in whole {
        for (lane, &value) in chunk.iter().enumerate() {
            include(lane, value);
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        include(lane, value);
    }
    (
        low.into_iter().fold(f32::INFINITY, f32::min),
        high.into_iter().fold(f32::NEG_INFINITY, f32::max),
        nothing.iter().all(|&v| v == 0.0),
    )
}

/// The sum in double precision.
fn sum(values: &[f32]) -> f64 {
    let mut sums = [0.0_f64; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    for chunk in whole {
        for (sum, &value) in sums.iter_mut().zip(chunk) {
            *sum += f64::from(value);
        }
    }
    for (sum, &value) in sums.iter_mut().zip(rest) {
        *sum += f64::from(value);
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream of bits: Knuth's multiplier.
    fn bits(state: &mut u64) -> u32 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 32) as u32
    }

    #[test]
    fn floats_agree_with_a_plain_loop() {
        let mut state = 5;
        for round in 0..400 {
            let (width, rows) = (1 + round % 37, 1 + round / 37);
            let values: Vec<f32> = (0..width * rows)
                .map(|_| match bits(&mut state) % 9 {
                    0 => f32::INFINITY,
                    1 if round % 2 == 0 => f32::NEG_INFINITY,
                    2 => -0.0,
                    _ => f32::from_bits(bits(&mut state) & 0xff00_ffff),
                })
                .filter(|v| !v.is_nan())
                .chain(std::iter::repeat(0.25))
                .take(width * rows)
                .collect();
            let finite: Vec<f64> = values
                .iter()
                .filter(|v| v.is_finite())
                .map(|&v| f64::from(v))
                .collect();
            let found = Statistics::of("sdf", &Samples::Float(&values), width).unwrap();
            assert_eq!(found.infinite, (values.len() - finite.len()) as u64);
            let least = finite.iter().copied().reduce(f64::min);
            let most = finite.iter().copied().reduce(f64::max);
            assert_eq!(found.range(), least.zip(most).map(|(a, b)| [a, b]));
        }
    }

    #[test]
    fn a_nan_is_found_wherever_it_is() {
        for n in 0..70 {
            let mut values = vec![1.0_f32; 70];
            values[n] = f32::from_bits(0xffc0_0001);
            let error = Statistics::of("sdf", &Samples::Float(&values), 7).unwrap_err();
            let wanted = format!(
                "sdf of voxel ({}, {}) is NaN; every sample must be a number",
                n % 7,
                n / 7
            );
            assert_eq!(error, wanted);
        }
    }

    #[test]
    fn bands_of_rows_do_not_show() {
        let mut state = 9;
        let (width, rows) = (53, 40);
        let fraction: Vec<f32> = (0..width * rows)
            .map(|_| bits(&mut state) as f32 / u32::MAX as f32)
            .collect();
        let masks: Vec<u8> = fraction.iter().map(|&v| u8::from(v > 0.4)).collect();
        let ids: Vec<u32> = (0..width * rows).map(|_| bits(&mut state)).collect();
        for (name, samples) in [
            ("fraction", Samples::Float(&fraction)),
            ("occupancy", Samples::Half(&masks)),
            ("material", Samples::Uint(&ids)),
        ] {
            let whole = Statistics::of(name, &samples, width).unwrap();
            for band in [1, 3, 16, 40] {
                let mut parts = Statistics::NONE;
                for first in (0..rows).step_by(band) {
                    let last = (first + band).min(rows);
                    parts.add(name, &samples, first..last, width).unwrap();
                }
                assert_eq!(parts, whole, "{name}, {band} rows at a time");
            }
        }
        let found = Statistics::of("fraction", &Samples::Float(&fraction), width).unwrap();
        let exact: f64 = fraction.iter().map(|&v| f64::from(v)).sum();
        assert!((found.sum - exact).abs() <= 1e-12 * exact);
        let found = Statistics::of("occupancy", &Samples::Half(&masks), width).unwrap();
        let ones = masks.iter().filter(|&&v| v == 1).count();
        assert_eq!(found.count, ones as u64);
        let found = Statistics::of("material", &Samples::Uint(&ids), width).unwrap();
        let [least, most] = [ids.iter().min(), ids.iter().max()].map(|v| f64::from(*v.unwrap()));
        assert_eq!(found.range(), Some([least, most]));
    }

    #[test]
    fn fractions_stay_between_nothing_and_all() {
        for (value, row) in [
            (1.5, 0),
            (-1e-9, 3),
            (f32::INFINITY, 4),
            (f32::NEG_INFINITY, 5),
        ] {
            let mut values = vec![0.5_f32; 6 * 20];
            values[row * 20 + 11] = value;
            let samples = Samples::Float(&values);
            let mut found = Statistics::NONE;
            let error = (0..6)
                .try_for_each(|row| found.add("fraction", &samples, row..row + 1, 20))
                .unwrap_err();
            assert_eq!(
                error,
                format!("fraction of voxel (11, {row}) is {value}; it must be between 0 and 1")
            );
        }
    }
}
