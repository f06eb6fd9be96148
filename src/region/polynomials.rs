//! The signed distance over larger parts of the half-plane, as a polynomial of degree four or six for each.
//!
//! Where the tiles of a [`CellTable`] are undivided around a *square* of two by two of them, one polynomial may serve
//! for all: then a row of voxels whose middle is in the square needs one look-up and no root. It is one in
//!
//! ```text
//!   x = (r² - R²) / 2R      y = z - Z      R, Z the square's middle
//! ```
//!
//! because r² of the voxels of a row is a polynomial of their number, and so is z. It is fitted by least squares to
//! the values and gradients at the tiles' centres, of degree six where four is not enough, and then held against the
//! circle of each tile: about a tile's centre
//!
//! ```text
//!   x = x₀ + α q + β q²     α = 1 + (r₀ - R) / R     β = 1 / 2R     q = r - r₀
//! ```
//!
//! makes the polynomial one in q and y, and the circle is, with k its bend, u along the gradient and w across,
//!
//! ```text
//!   d = d₀ + u + k/2 w² - k²/2 u w² + k³/8 w² (4 u² - w²) - k⁴/8 u w² (4 u² - 3 w²) + rest
//!   |rest| <= 2/11 m (m k)⁵ / (1 - m k)
//! ```
//!
//! with m half the tile's diagonal (the terms of degree n are |q|ⁿ kⁿ⁻¹ times Gegenbauer's polynomials of order -1/2,
//! which are differences of Legendre's: at most 2 / (2 n - 1)). Of x - x₀ to the power of n what has β once is kept, of
//! its square all. The sum of the sizes of the coefficients of the difference, each times what its powers are at most,
//! and of what is not kept bounds it; the circle's own error is added. A square where the bound is above the tolerance for
//! any of its tiles, or where one of those is divided or has no circle, has no polynomial.
//!
//! Lengths are in steps of the table.

use super::cells::{CellTable, Circle, TILE};
use rayon::prelude::*;

/// Polynomials over squares of a table's tiles.
#[derive(Debug, Clone, Default)]
pub(crate) struct PolynomialTable {
    /// For each square, r first, the number of its polynomial and 1, or 0.
    squares: Vec<u32>,
    /// Squares along r.
    across: u32,
    /// R² and 1 / 2R of each column of squares.
    columns: Vec<[f64; 2]>,
    polynomials: Vec<Polynomial>,
}

/// One square's polynomial, in scene units.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(crate) struct Polynomial {
    /// The coefficients of y to the power of 0 … 6, then those times x, x² …; what the first of them loses in f32.
    pub(crate) terms: [f32; TERMS],
    /// The first coefficient.
    pub(crate) first: f32,
    /// Whether the degree is [`LOW`].
    pub(crate) is_low: bool,
}

const DEGREE: usize = 6;
/// Coefficients of a polynomial of that degree in two variables.
const TERMS: usize = terms(DEGREE);
/// A degree that is tried first.
const LOW: usize = 4;

const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Steps along a square's side are 2 to the power of this.
pub(crate) const SQUARE: u32 = TILE + 1;
/// Half a tile's side.
const HALF: f64 = 0.5 * (1 << TILE) as f64;
/// Half a square's side.
const MIDDLE: f64 = (1 << TILE) as f64;
/// The furthest that a square's polynomial may have to reach beyond its side.
const FARTHEST: f64 = 10.0;
/// What the numbers of a place may be off by.
const ROOM: f64 = 1e-3;
/// Circles more bent than this have rests beyond any tolerance.
const MOST_BEND: f64 = 0.05;
/// Share of a gradient's error in what is least.
const GRADIENT: f64 = HALF;

/// Powers of x and y of the coefficients, the lowest degrees first.
const POWERS: [[usize; 2]; TERMS] = {
    let mut powers = [[0; 2]; TERMS];
    let (mut n, mut degree) = (0, 0);
    while degree <= DEGREE {
        let mut i = 0;
        while i <= degree {
            powers[n] = [i, degree - i];
            n += 1;
            i += 1;
        }
        degree += 1;
    }
    powers
};

/// Coefficients by the powers of x and y.
type Square = [[f64; DEGREE + 1]; DEGREE + 1];

impl PolynomialTable {
    /// How many squares a table has.
    pub(crate) fn squares(table: &CellTable) -> usize {
        size(table).iter().map(|n| *n as usize).product()
    }

    /// The polynomials of a table that are within `tolerance` of the distance in every square and as far beyond it as
    /// `reach` along r and z, the distance being that to the field's arcs. None of them where that is too far.
    pub(crate) fn new(table: &CellTable, reach: [f64; 2], tolerance: f64) -> Self {
        let reach = reach.map(|c| c + ROOM);
        if !(reach[0].max(reach[1]) <= FARTHEST) {
            return Self::default();
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let around = reach.map(|c| (c / (2.0 * HALF)).ceil() as u32);
        let (tiles, tiles_across) = table.tiles();
        let size = size(table);
        let base = table.corner()[0] / table.region_step();
        let expansions: Vec<Option<Expansion>> = (0..tiles.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|tile| Expansion::new(table.whole_tile(tile)?))
            .collect();
        let tiles = Tiles {
            expansions,
            across: tiles_across,
            step: table.step(),
        };
        let columns: Vec<(f64, Vec<Option<Polynomial>>)> = (0..size[0])
            .into_par_iter()
            .map(|column| {
                let middle = base + f64::from(column << SQUARE) + MIDDLE;
                let fitter = Fitter::new(&tiles, column, around, middle, tolerance);
                let rows = 0..size[1];
                let found = rows.map(|row| fitter.as_ref().and_then(|f| f.square(row)));
                (middle, found.collect())
            })
            .collect();
        let mut squares = vec![0; size[0] as usize * size[1] as usize];
        let mut polynomials = Vec::new();
        for (column, (_, rows)) in columns.iter().enumerate() {
            for (row, found) in rows.iter().enumerate() {
                if let Some(polynomial) = found {
                    polynomials.push(polynomial.clone());
                    squares[row * size[0] as usize + column] = polynomials.len() as u32;
                }
            }
        }
        Self {
            squares,
            across: size[0],
            columns: (columns.iter().map(|(r, _)| [r * r, 0.5 / r])).collect(),
            polynomials,
        }
    }

    /// The polynomial of a square, with R² and 1 / 2R.
    #[inline(always)]
    pub(crate) fn find(&self, [column, row]: [u32; 2]) -> Option<(&Polynomial, [f64; 2])> {
        let here = self.columns.get(column as usize)?;
        let square = row as usize * self.across as usize + column as usize;
        let number = *self.squares.get(square)?;
        let polynomial = self.polynomials.get((number as usize).wrapping_sub(1))?;
        Some((polynomial, *here))
    }
}

/// Squares of a table along r and z.
#[allow(clippy::cast_possible_truncation, reason = "tiles are counted in u32")]
fn size(table: &CellTable) -> [u32; 2] {
    let (tiles, across) = table.tiles();
    [across, tiles.len() as u32 / across.max(1)].map(|n| n / 2)
}

/// Circles of a table's tiles.
struct Tiles {
    expansions: Vec<Option<Expansion>>,
    across: u32,
    /// A step in scene units.
    step: f64,
}

/// What serves for a column of squares.
struct Fitter<'a> {
    tiles: &'a Tiles,
    column: u32,
    around: [u32; 2],
    tolerance: f64,
    /// Tiles that a square's polynomial reaches, from the square's first one, and their centres.
    places: Vec<Place>,
    /// An orthonormal basis of what polynomials are at those places, three numbers of each, and what turns
    /// coordinates in that basis into coefficients.
    basis: Vec<[f64; TERMS]>,
    triangle: [[f64; TERMS]; TERMS],
}

/// A tile's centre in a square's coordinates.
struct Place {
    /// From the square's first tile, and as many as there are around it.
    tile: [u32; 2],
    x: f64,
    y: f64,
    alpha: f64,
    /// What the powers of x are in q: of each what counts q to the same power and to the next, and what is not kept.
    powers: [[f64; 3]; DEGREE + 1],
    /// What x² counts q⁴.
    fourth: f64,
}

impl<'a> Fitter<'a> {
    /// `None` where the axis is so near that polynomials cannot serve.
    fn new(
        tiles: &'a Tiles,
        column: u32,
        around: [u32; 2],
        middle: f64,
        tolerance: f64,
    ) -> Option<Self> {
        let mut places = Vec::new();
        let beta = 0.5 / middle;
        for row in 0..2 + 2 * around[1] {
            for at in 0..2 + 2 * around[0] {
                let centre =
                    |n: u32, around: u32| (f64::from(n) - f64::from(around) - 0.5) * (2.0 * HALF);
                let away = centre(at, around[0]);
                if away - HALF <= -0.5 * middle {
                    return None;
                }
                let alpha = 1.0 + 2.0 * beta * away;
                places.push(Place {
                    tile: [at, row],
                    x: away + beta * away * away,
                    y: centre(row, around[1]),
                    alpha,
                    powers: std::array::from_fn(|n| powers(n, alpha, beta)),
                    fourth: beta * beta,
                });
            }
        }
        let mut basis: Vec<[f64; TERMS]> = Vec::with_capacity(3 * places.len());
        for place in &places {
            let mut rows = [[0.0; TERMS]; 3];
            for (n, [i, j]) in POWERS.into_iter().enumerate() {
                let power = |c: f64, n: usize| c.powi(i32::try_from(n).unwrap_or(0));
                let slope = |c: f64, n: usize| {
                    if n == 0 {
                        0.0
                    } else {
                        (n as f64) * power(c, n - 1)
                    }
                };
                let (x, y) = (place.x, place.y);
                rows[0][n] = power(x, i) * power(y, j);
                rows[1][n] = GRADIENT * place.alpha * slope(x, i) * power(y, j);
                rows[2][n] = GRADIENT * power(x, i) * slope(y, j);
            }
            basis.extend(rows);
        }
        let triangle = orthonormal(&mut basis)?;
        Some(Self {
            tiles,
            column,
            around,
            tolerance,
            places,
            basis,
            triangle,
        })
    }

    /// The polynomial of a square, where one is within the tolerance.
    fn square(&self, row: u32) -> Option<Polynomial> {
        let at = |first: u32, n: u32, around: u32| (2 * first + n).checked_sub(around);
        let mut circles = smallvec::SmallVec::<[&Expansion; 64]>::new();
        for place in &self.places {
            let column = at(self.column, place.tile[0], self.around[0])?;
            let row = at(row, place.tile[1], self.around[1])?;
            if column >= self.tiles.across {
                return None;
            }
            let tile = row as usize * self.tiles.across as usize + column as usize;
            circles.push(self.tiles.expansions.get(tile)?.as_ref()?);
        }
        // About one of the values, so that none is large.
        let origin = circles[circles.len() / 2].distance;
        let mut along = [0.0; TERMS];
        for (circle, rows) in circles.iter().zip(self.basis.as_chunks::<3>().0) {
            let [r, z] = [circle.terms[1][0], circle.terms[0][1]];
            let values = [circle.distance - origin, GRADIENT * r, GRADIENT * z];
            for (value, row) in values.into_iter().zip(rows) {
                for n in 0..TERMS {
                    along[n] += value * row[n];
                }
            }
        }
        [LOW, DEGREE].into_iter().find_map(|degree| {
            let square = self.coefficients(&along, degree);
            let rows = circles
                .chunks(self.width())
                .zip(self.places.chunks(self.width()));
            for (circles, places) in rows {
                let shifted = shifted_up(&square, places[0].y);
                for (circle, place) in circles.iter().zip(places) {
                    if !(departure(&shifted, place, circle, origin) <= self.tolerance) {
                        return None;
                    }
                }
            }
            Some(self.stored(&square, origin, degree == LOW))
        })
    }

    /// The best polynomial of a degree, from its coordinates in the basis: those of a lower degree are the first of them.
    fn coefficients(&self, along: &[f64; TERMS], degree: usize) -> Square {
        let count = terms(degree);
        let mut terms = [0.0; TERMS];
        for n in (0..count).rev() {
            let known: f64 = (n + 1..count).map(|m| self.triangle[n][m] * terms[m]).sum();
            terms[n] = (along[n] - known) / self.triangle[n][n];
        }
        let mut square: Square = [[0.0; DEGREE + 1]; DEGREE + 1];
        for ([i, j], term) in POWERS.into_iter().zip(terms) {
            square[i][j] = term;
        }
        square
    }

    /// Tiles along r that a square's polynomial reaches.
    fn width(&self) -> usize {
        2 + 2 * self.around[0] as usize
    }

    #[allow(clippy::cast_possible_truncation, reason = "what is kept is f32")]
    fn stored(&self, square: &Square, origin: f64, is_low: bool) -> Polynomial {
        let scale = self.tiles.step;
        let rows = (0..=DEGREE).flat_map(|i| &square[i][..=DEGREE - i]);
        let mut terms = [0.0; TERMS];
        for (kept, term) in terms.iter_mut().zip(rows) {
            *kept = (term * scale) as f32;
        }
        let whole = (origin + square[0][0]) * scale;
        let first = whole as f32;
        terms[0] = (whole - f64::from(first)) as f32;
        Polynomial {
            terms,
            first,
            is_low,
        }
    }
}

/// What x - x₀ to the power of `n` is.
fn powers(n: usize, alpha: f64, beta: f64) -> [f64; 3] {
    let power = |c: f64, n: usize| c.powi(i32::try_from(n).unwrap_or(0));
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let next = if n == 0 {
        0.0
    } else {
        n as f64 * power(alpha, n - 1) * beta
    };
    let kept = power(alpha * HALF, n) + next * power(HALF, n + 1);
    let rest = match n {
        // All of these is kept: of the square what counts q⁴ stands apart.
        0..=2 => 0.0,
        _ => power(alpha * HALF + beta * HALF * HALF, n) - kept,
    };
    [power(alpha, n), next, rest.max(0.0)]
}

/// A circle's distance about a tile's centre.
struct Expansion {
    distance: f64,
    /// Coefficients by the powers of q and y, but for that distance, up to degree five.
    terms: [[f64; DEGREE]; DEGREE],
    /// What is left out, and how far the circle is off, at most.
    rest: f64,
}

impl Expansion {
    /// `None` where the circle is bent too much.
    fn new(circle: Circle) -> Option<Self> {
        let k = circle.bend;
        if !(k.abs() <= MOST_BEND) {
            return None;
        }
        let [r, z] = circle.gradient;
        // Coefficients by the power of y: u, w² and what they give together.
        let u = [r, z];
        let ww = [z * z, -2.0 * r * z, r * r];
        let uww: [f64; 4] = product(&u, &ww);
        let uuww: [f64; 5] = product(&u, &uww);
        let wwww: [f64; 5] = product(&ww, &ww);
        let uuuww: [f64; 6] = product(&u, &uuww);
        let uwwww: [f64; 6] = product(&u, &wwww);
        let mut terms = [[0.0; DEGREE]; DEGREE];
        let mut add = |part: &[f64], times: f64| {
            let degree = part.len() - 1;
            for (j, c) in part.iter().enumerate() {
                terms[degree - j][j] += times * c;
            }
        };
        let [k2, k3, k4] = [k * k, k * k * k, k * k * k * k];
        add(&u, 1.0);
        add(&ww, 0.5 * k);
        add(&uww, -0.5 * k2);
        add(&uuww, 0.5 * k3);
        add(&wwww, -0.125 * k3);
        add(&uuuww, -0.5 * k4);
        add(&uwwww, 0.375 * k4);
        let m = HALF * 2.0_f64.sqrt();
        let mk = m * k.abs();
        Some(Self {
            distance: circle.distance,
            terms,
            rest: circle.error + 2.0 / 11.0 * m * mk.powi(5) / (1.0 - mk),
        })
    }
}

/// How far a polynomial, shifted to a tile's height, is at most from the distance within a tile, whose circle's counts
/// from `origin`.
fn departure(square: &Square, place: &Place, circle: &Expansion, origin: f64) -> f64 {
    let shifted = shifted_along(square, place.x);
    let mut about = [[0.0; DEGREE + 1]; DEGREE + 2];
    for (about, terms) in about.iter_mut().zip(&circle.terms) {
        for (about, term) in about.iter_mut().zip(terms) {
            *about = -term;
        }
    }
    about[0][0] -= circle.distance - origin;
    let mut most = 0.0;
    for i in 0..=DEGREE {
        let [same, next, rest] = place.powers[i];
        let mut sizes = 0.0;
        for j in (0..=DEGREE - i).rev() {
            let term = shifted[i][j];
            about[i][j] += same * term;
            about[i + 1][j] += next * term;
            sizes = sizes * HALF + term.abs();
        }
        most += sizes * rest;
    }
    for j in 0..=DEGREE - 2 {
        about[4][j] += place.fourth * shifted[2][j];
    }
    let mut sum = 0.0;
    for row in about.iter().rev() {
        let sizes = row.iter().rev();
        sum = sum * HALF + sizes.fold(0.0, |sum, c| sum * HALF + c.abs());
    }
    sum + most + circle.rest
}

/// The product of two polynomials.
fn product<const N: usize>(a: &[f64], b: &[f64]) -> [f64; N] {
    let mut out = [0.0; N];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

/// A polynomial about another height.
fn shifted_up(square: &Square, y: f64) -> Square {
    let mut out = *square;
    for (i, row) in out.iter_mut().enumerate() {
        for from in 0..DEGREE - i {
            for j in (from..DEGREE - i).rev() {
                row[j] += y * row[j + 1];
            }
        }
    }
    out
}

/// A polynomial about another place along x.
fn shifted_along(square: &Square, x: f64) -> Square {
    let mut out = *square;
    for from in 0..DEGREE {
        for i in (from..DEGREE).rev() {
            for j in 0..DEGREE - i {
                out[i][j] += x * out[i + 1][j];
            }
        }
    }
    out
}

/// Makes the columns of a matrix orthonormal, and returns the triangle that the matrix was their product with; `None`
/// where they depend on each other. (Gram and Schmidt, each column cleared of the ones before it one by one, twice.)
fn orthonormal(rows: &mut [[f64; TERMS]]) -> Option<[[f64; TERMS]; TERMS]> {
    let mut triangle = [[0.0; TERMS]; TERMS];
    for n in 0..TERMS {
        for _ in 0..2 {
            for m in 0..n {
                let along: f64 = rows.iter().map(|row| row[m] * row[n]).sum();
                for row in &mut *rows {
                    row[n] -= along * row[m];
                }
                triangle[m][n] += along;
            }
        }
        let size = rows.iter().map(|row| row[n] * row[n]).sum::<f64>().sqrt();
        if !(size > 0.0) {
            return None;
        }
        for row in &mut *rows {
            row[n] /= size;
        }
        triangle[n][n] = size;
    }
    Some(triangle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Kernel;
    use crate::region::cells::tests::extent_of;
    use crate::region::radial::tests::{numbers, regions, swept};
    use crate::region::{Chain, DistanceSet, MeridianField};

    /// A polynomial in f64 from the numbers kept.
    fn value(polynomial: &Polynomial, x: f64, y: f64) -> f64 {
        let mut terms = polynomial.terms.iter();
        let mut sum = f64::from(polynomial.first);
        for i in 0..=DEGREE {
            for j in 0..=DEGREE - i {
                let [i, j] = [i, j].map(|n| i32::try_from(n).expect("small"));
                sum += f64::from(*terms.next().expect("all terms")) * x.powi(i) * y.powi(j);
            }
        }
        sum
    }

    #[test]
    fn polynomials_are_within_their_tolerance_of_the_distance() {
        for (name, region) in regions() {
            for (voxels, reach) in [
                (150.0, [7.5, 0.0]),
                (300.0, [2.0, 7.5]),
                (900.0, [7.2, 2.3]),
            ] {
                let swept = swept(&region);
                let exact = DistanceSet::new(swept.iter().map(|b| b.piece));
                let extent = extent_of(&swept, voxels);
                let step = extent.cell;
                let chain = Chain::new(&swept, 1.5e-5 * step, 100_000, true).expect("few arcs");
                let field = MeridianField::new(Kernel::default(), chain, extent).expect("a field");
                let table = CellTable::new(&field, 1.0, 4.5e-5 * step).expect("a table");
                let found = PolynomialTable::new(&table, reach, 5e-5);
                let base = table.corner()[0] / step;
                let mut number = numbers(5);
                let (mut worst, mut count, mut low) = (0.0_f64, 0, 0);
                let [across, up] = size(&table);
                for square in (0..up).flat_map(|row| (0..across).map(move |column| [column, row])) {
                    let Some((polynomial, [squared, half])) = found.find(square) else {
                        continue;
                    };
                    count += 1;
                    low += i32::from(polynomial.is_low);
                    let middle = square.map(|n| f64::from(n << SQUARE) + MIDDLE);
                    for corner in 0..6 {
                        // The corners of what it reaches, and two more points.
                        let share = |bit: i32| match corner {
                            0..4 => f64::from(corner >> bit & 1) * 2.0 - 1.0,
                            _ => f64::NAN,
                        };
                        let away: [f64; 2] = std::array::from_fn(|c| {
                            let share = share(i32::try_from(c).expect("0 or 1"));
                            let share = if share.is_nan() {
                                2.0 * number() - 1.0
                            } else {
                                share
                            };
                            share * (MIDDLE + reach[c])
                        });
                        let r = base + middle[0] + away[0];
                        let x = (r * r - squared) * half;
                        let q = [r * step, table.corner()[1] + (middle[1] + away[1]) * step];
                        let value = value(polynomial, x, away[1]);
                        let truth = exact.distance(q, f64::INFINITY);
                        let error = (value.abs() - truth).abs() / step;
                        worst = worst.max(error);
                        assert!(
                            error < 1.5e-5 + 5e-5 + 2e-6,
                            "{name} {voxels}: {value} for {truth} at {q:?}, {error} steps off"
                        );
                        let inside =
                            region.section().side_of(q[0], q[1]) != crate::math::Side::Outside;
                        assert!(
                            truth < 1e-4 * step || inside == (value < 0.0),
                            "{name}: sign at {q:?}"
                        );
                    }
                }
                let all = PolynomialTable::squares(&table);
                eprintln!(
                    "{name:>9} {voxels:>5}: {count} of {all} squares, {low} low, worst {worst:.1e} of a step"
                );
                // Of many small ellipses most tiles are divided.
                let least = if name == "ellipses" {
                    all / 20
                } else {
                    all / 2
                };
                assert!(
                    voxels < 900.0 || count > least,
                    "{name}: {count} of {all} squares"
                );
            }
        }
    }

    #[test]
    fn departures_cover_every_difference_within_a_tile() {
        let mut number = numbers(3);
        let mut wide = 0.0_f64;
        for _ in 0..300 {
            let turn = std::f64::consts::TAU * number();
            let circle = Circle {
                distance: 40.0 * number(),
                gradient: [turn.cos(), turn.sin()],
                bend: MOST_BEND * (2.0 * number() - 1.0),
                error: 0.0,
            };
            let expansion = Expansion::new(circle).expect("a circle");
            let (alpha, beta) = (0.6 + 0.8 * number(), 0.02 * number());
            let place = Place {
                tile: [0; 2],
                x: 20.0 * number() - 10.0,
                y: 20.0 * number() - 10.0,
                alpha,
                powers: std::array::from_fn(|n| powers(n, alpha, beta)),
                fourth: beta * beta,
            };
            let mut square: Square = [[0.0; DEGREE + 1]; DEGREE + 1];
            for [i, j] in POWERS {
                let degree = i32::try_from(i + j).expect("small");
                square[i][j] = (number() - 0.5) * 0.2_f64.powi(degree);
            }
            let bound = departure(&shifted_up(&square, place.y), &place, &expansion, 3.0);
            let mut most = 0.0_f64;
            for n in 0..21 * 21 {
                let [q, y] = [n % 21, n / 21].map(|c| (f64::from(c) - 10.0) / 10.0 * HALF);
                let x = place.x + alpha * q + beta * q * q;
                let mut sum = 3.0;
                for [i, j] in POWERS {
                    let [m, n] = [i, j].map(|n| i32::try_from(n).expect("small"));
                    sum += square[i][j] * x.powi(m) * (place.y + y).powi(n);
                }
                let [r, z] = circle.gradient;
                let e = r * q + z * y + 0.5 * circle.bend * (q * q + y * y);
                let exact =
                    circle.distance + 2.0 * e / (1.0 + (1.0 + 2.0 * circle.bend * e).sqrt());
                most = most.max((sum - exact).abs());
            }
            assert!(most <= bound * (1.0 + 1e-12), "{most} beyond {bound}");
            wide = wide.max(bound / most);
        }
        assert!(wide < 5.0, "bounds up to {wide} times too wide");
    }
}
