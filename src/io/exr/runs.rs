//! Runs of equal bytes, the format's RLE.
//!
//! ```text
//!   samples, little-endian      s0 s1 s2 s3 s4 ...
//!   even bytes, then odd ones   s0 s2 s4 ... s1 s3 ...
//!   differences + 128           a flat stretch becomes one byte repeated
//!   tokens                      n, byte: the byte n + 1 times;  -n, n bytes: as they are
//! ```
//!
//! The tokens are those of the `exr` crate, byte for byte; runs are measured eight bytes at a time,
//! which is what masks and ids consist of. A line that would not shrink is stored as it is.
//! Source: Academy Software Foundation, *OpenEXR*, `ImfRle.cpp` and `ImfRleCompressor.cpp`.

/// Shorter runs go with the bytes around them.
const MIN_RUN: usize = 3;
/// A run's token holds its length less one.
const MAX_RUN: usize = 128;
/// A token of bytes as they are holds their number.
const MAX_LITERAL: usize = 127;

/// Buffers from line to line.
#[derive(Debug, Default)]
pub(super) struct Runs {
    separated: Vec<u8>,
    differences: Vec<u8>,
}

impl Runs {
    /// Appends the line's tokens to `out`, or the line itself where they are not shorter.
    pub(super) fn append(&mut self, line: &[u8], out: &mut Vec<u8>) {
        separate(line, &mut self.separated);
        differences(&self.separated, &mut self.differences);
        let start = out.len();
        append_tokens(&self.differences, out);
        if out.len() - start >= line.len() {
            out.truncate(start);
            out.extend_from_slice(line);
        }
    }
}

/// Bytes of even index, then those of odd index.
fn separate(line: &[u8], out: &mut Vec<u8>) {
    out.resize(line.len(), 0);
    let (even, odd) = out.split_at_mut(line.len().div_ceil(2));
    let (pairs, last) = line.as_chunks::<2>();
    for ((pair, even), odd) in pairs.iter().zip(even.iter_mut()).zip(odd) {
        [*even, *odd] = *pair;
    }
    if let (Some(to), Some(from)) = (even.last_mut(), last.first()) {
        *to = *from;
    }
}

/// The first byte, then each less the one before it, plus 128.
fn differences(bytes: &[u8], out: &mut Vec<u8>) {
    out.resize(bytes.len(), 0);
    let Some(first) = out.first_mut() else {
        return;
    };
    *first = bytes[0];
    for (out, pair) in out[1..].iter_mut().zip(bytes.windows(2)) {
        *out = pair[1].wrapping_sub(pair[0]).wrapping_add(128);
    }
}

/// How often the first byte is repeated, at most [`MAX_RUN`] times, in bytes that are not empty.
fn run_length(bytes: &[u8]) -> usize {
    let bytes = &bytes[..bytes.len().min(MAX_RUN)];
    let wanted = u64::from_le_bytes([bytes[0]; 8]);
    let (words, rest) = bytes.as_chunks::<8>();
    for (n, word) in words.iter().enumerate() {
        let other = u64::from_le_bytes(*word) ^ wanted;
        if other != 0 {
            return 8 * n + other.trailing_zeros() as usize / 8;
        }
    }
    let equal = rest.iter().take_while(|&&b| b == bytes[0]).count();
    bytes.len() - rest.len() + equal
}

fn append_tokens(bytes: &[u8], out: &mut Vec<u8>) {
    let mut rest = bytes;
    while !rest.is_empty() {
        let run = run_length(rest);
        if run >= MIN_RUN {
            out.extend_from_slice(&[token(run - 1), rest[0]]);
            rest = &rest[run..];
        } else {
            // Up to where the next run begins, as far as a token reaches.
            let reach = rest.len().min(MAX_LITERAL + MIN_RUN);
            let next = rest[run..reach]
                .windows(MIN_RUN)
                .position(|w| w[0] == w[1] && w[1] == w[2]);
            let literal = next.map_or(rest.len(), |n| run + n).min(MAX_LITERAL);
            let (head, tail) = rest.split_at(literal);
            out.push(token(literal).wrapping_neg());
            out.extend_from_slice(head);
            rest = tail;
        }
    }
}

fn token(length: usize) -> u8 {
    #[allow(clippy::cast_possible_truncation, reason = "at most 127")]
    let token = length as u8;
    token
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads tokens, differences and halves back, each by its plain definition.
    fn expand(tokens: &[u8], length: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut at = tokens.iter().copied();
        while let Some(token) = at.next() {
            let count = i32::from(token.cast_signed());
            if count < 0 {
                bytes.extend(at.by_ref().take(count.unsigned_abs() as usize));
            } else {
                let value = at.next().unwrap();
                bytes.extend(std::iter::repeat_n(value, token as usize + 1));
            }
        }
        for n in 1..bytes.len() {
            bytes[n] = bytes[n - 1].wrapping_add(bytes[n]).wrapping_sub(128);
        }
        let half = length.div_ceil(2);
        (0..length)
            .map(|n| bytes[if n % 2 == 0 { n / 2 } else { half + n / 2 }])
            .collect()
    }

    #[test]
    fn lines_come_back() {
        let mut runs = Runs::default();
        let mut state = 3_u64;
        for round in 0..4000 {
            let length = round % 700;
            // Stretches of 1 to about 2^shift equal bytes.
            let shift = round % 10;
            let mut line = Vec::new();
            while line.len() < length {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let stretch = 1 + (state >> 40) as usize % (1 << shift);
                line.extend(std::iter::repeat_n((state >> 33) as u8, stretch));
            }
            line.truncate(length);
            let mut out = vec![7; 5];
            runs.append(&line, &mut out);
            assert_eq!(out[..5], [7; 5]);
            if out.len() - 5 == length {
                assert_eq!(out[5..], line);
            } else {
                assert!(out.len() - 5 < length);
                assert_eq!(expand(&out[5..], length), line);
            }
        }
    }

    #[test]
    fn run_lengths_are_counted() {
        for length in 1..300 {
            for run in 1..=length {
                let mut bytes = vec![9; length];
                if run < length {
                    bytes[run] = 8;
                }
                assert_eq!(run_length(&bytes), run.min(MAX_RUN));
            }
        }
    }
}
