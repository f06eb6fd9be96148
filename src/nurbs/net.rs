//! Nets of values with N indices, the first fastest, and what is done to them row by row.
//!
//! ```text
//!   place of (i, j, k) in a net of n_1 x n_2 x n_3 values:   i + n_1 (j + n_2 k)
//! ```
//!
//! Insertion, elevation, splitting and evaluation of surfaces and volumes are those of curves, done
//! to every row of the net in one direction; a row in direction k has its values n_1 .. n_{k-1}
//! places apart.

/// A net: the number of values along each index, and the values.
pub(super) type Net<T, const N: usize> = ([usize; N], Vec<T>);

/// The net whose rows in direction `k` are the images of the rows of `net`, all equally long.
pub(super) fn try_map_rows<T: Copy, E, const N: usize>(
    counts: [usize; N],
    net: &[T],
    k: usize,
    mut map: impl FnMut(&[T]) -> Result<Vec<T>, E>,
) -> Result<Net<T, N>, E> {
    let stride: usize = counts[..k].iter().product();
    let length = counts[k];
    let mut row = Vec::with_capacity(length);
    let mut image_counts = counts;
    let mut out: Vec<T> = Vec::new();
    for (index, block) in net.chunks_exact(stride * length).enumerate() {
        for offset in 0..stride {
            row.clear();
            row.extend(block[offset..].iter().step_by(stride));
            let image = map(&row)?;
            if out.is_empty() {
                image_counts[k] = image.len();
                out = vec![row[0]; net.len() / length * image.len()];
            }
            let start = index * stride * image.len() + offset;
            for (place, value) in out[start..].iter_mut().step_by(stride).zip(image) {
                *place = value;
            }
        }
    }
    Ok((image_counts, out))
}

/// As [`try_map_rows`], for a map that does not fail.
pub(super) fn map_rows<T: Copy, const N: usize>(
    counts: [usize; N],
    net: &[T],
    k: usize,
    mut map: impl FnMut(&[T]) -> Vec<T>,
) -> Net<T, N> {
    let mapped: Result<_, std::convert::Infallible> =
        try_map_rows(counts, net, k, |row| Ok(map(row)));
    match mapped {
        Ok(net) => net,
        Err(never) => match never {},
    }
}

/// The indices of a net in its order, the first fastest.
pub(super) fn indices<const N: usize>(counts: [usize; N]) -> impl Iterator<Item = [usize; N]> {
    let total: usize = counts.iter().product();
    (0..total).map(move |mut place| {
        counts.map(|n| {
            let i = place % n;
            place /= n;
            i
        })
    })
}

/// The place of an index in a net.
pub(super) fn place<const N: usize>(counts: [usize; N], index: [usize; N]) -> usize {
    (0..N)
        .rev()
        .fold(0, |place, k| place * counts[k] + index[k])
}

/// The values with indices from `first` on, `size` of them in each direction.
pub(super) fn window<T: Copy, const N: usize>(
    counts: [usize; N],
    net: &[T],
    first: [usize; N],
    size: [usize; N],
) -> Vec<T> {
    indices(size)
        .map(|index| net[place(counts, std::array::from_fn(|k| first[k] + index[k]))])
        .collect()
}

/// The net whose parameter k is parameter `order[k]` of `net`; `order` is a permutation.
pub(super) fn permuted<T: Copy, const N: usize>(
    counts: [usize; N],
    net: &[T],
    order: [usize; N],
) -> Net<T, N> {
    let image = order.map(|k| counts[k]);
    let values = indices(image).map(|index| {
        let mut source = [0; N];
        for (&i, &k) in index.iter().zip(&order) {
            source[k] = i;
        }
        net[place(counts, source)]
    });
    (image, values.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_run_in_their_direction() {
        let counts = [2, 3, 4];
        let net: Vec<usize> = (0..24).collect();
        // A value says its index: i + 2 j + 6 k.
        for (k, step) in [(0, 1), (1, 2), (2, 6)] {
            let (image, out) = map_rows(counts, &net, k, |row| {
                assert!(row.windows(2).all(|pair| pair[1] - pair[0] == step));
                assert_eq!(row.len(), counts[k]);
                [row, &[100 + row[0]]].concat()
            });
            assert_eq!(image[k], counts[k] + 1);
            for index in indices(image) {
                let mut first = index;
                first[k] = 0;
                let expected = if index[k] == counts[k] {
                    100 + place(counts, first)
                } else {
                    place(counts, index)
                };
                assert_eq!(out[place(image, index)], expected);
            }
        }
    }

    #[test]
    fn permutations_and_windows() {
        let counts = [2, 3, 4];
        let net: Vec<usize> = (0..24).collect();
        let (image, out) = permuted(counts, &net, [2, 0, 1]);
        assert_eq!(image, [4, 2, 3]);
        for [i, j, k] in indices(counts) {
            assert_eq!(out[place(image, [k, i, j])], place(counts, [i, j, k]));
        }
        assert_eq!(window(counts, &net, [1, 1, 2], [1, 2, 2]), [15, 17, 21, 23]);
    }
}
