//! Splines through points.
//!
//! ```text
//!   open     C(s_i) = P_i, clamped at both ends; C'(0), C'(L) as given, where they are
//!   closed   C(s_i) = P_i, C(s + L) = C(s), n points and n knots, odd degree
//!
//!   s_0 = 0,  s_i = s_(i-1) + |P_i - P_(i-1)|,  L the last of them (closed: with the chord back to P_0)
//! ```
//!
//! Open knots are averages of p consecutive sites, the end site counted twice where its derivative is given (*The NURBS
//! Book*, eqs. 9.8 and 9.14): one more condition there is one more knot. A derivative at an end is the first leg of the
//! control polygon, so it is known beforehand. Closed curves have their knots at the sites, which for odd degrees is always
//! solvable: they are the periodic splines of least energy.
//!
//! * Units: points in scene units, tangents in scene units per unit of chord length; the parameter s / L is in [0, 1].
//! * Accuracy: everything is in double-double; what is solved has bands without pivots, which is stable for these totally
//!   positive matrices (de Boor & Pinkus, *Numer. Math.* 27 (1977)), and of the closed ones the few rows that wrap round
//!   are a border, solved with pivots.

use super::curve::{Bezier, HomogeneousPoint, exact, extract};
use crate::math::{Dd, Real};

/// How an interpolating curve ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ends {
    /// At the first and the last point, with those derivatives by chord length where they are given.
    Open([Option<[f64; 2]>; 2]),
    /// Where it begins, smoothly; the first point is not repeated.
    Closed,
}

impl Ends {
    /// An open curve with no derivative given.
    pub const FREE: Self = Self::Open([None, None]);
}

/// The pieces of the spline through the points.
pub(super) fn pieces(
    points: &[[f64; 2]],
    degree: usize,
    ends: Ends,
) -> Result<Vec<Bezier>, String> {
    if degree == 0 {
        return Err("has degree 0; the degree must be at least 1".into());
    }
    let least = if ends == Ends::Closed { 3 } else { 2 };
    if points.len() < least {
        return Err(format!(
            "has {} points; an interpolating curve needs at least {least}",
            points.len()
        ));
    }
    match ends {
        Ends::Open(tangents) => open(points, degree, tangents),
        Ends::Closed => closed(points, degree),
    }
}

/// The distance between two points, unless they are equal.
fn chord(points: &[[f64; 2]], from: usize, to: usize) -> Result<Dd, String> {
    let d = [0, 1].map(|c| Dd::sum(points[to][c], -points[from][c]));
    let largest = d[0].f64().abs().max(d[1].f64().abs());
    if largest == 0.0 {
        let [r, z] = points[to];
        return Err(if to < from {
            format!(
                "has its first point ({r}, {z}) again as its last; a closed one goes back to it by itself, so leave the last one out"
            )
        } else {
            format!("has equal points {from} and {to}, ({r}, {z}); consecutive points must differ")
        });
    }
    let power = (-largest.log2().floor()).exp2();
    let d = d.map(|c| c.scale_by_power_of_two(power));
    Ok((d[0] * d[0] + d[1] * d[1])
        .sqrt()
        .scale_by_power_of_two(1.0 / power))
}

/// The sites s_i / L, and L; `around` counts the chord from the last point to the first one.
fn sites(points: &[[f64; 2]], around: bool) -> Result<(Vec<Dd>, Dd), String> {
    let mut sites = vec![Dd::ZERO];
    let mut length = Dd::ZERO;
    for i in 1..points.len() {
        length = length + chord(points, i - 1, i)?;
        sites.push(length);
    }
    if around {
        length = length + chord(points, points.len() - 1, 0)?;
    }
    for u in &mut sites {
        *u = *u / length;
    }
    Ok((sites, length))
}

/// Basis functions that do not vanish on a span, in double-double.
fn basis(degree: usize, knots: &[Dd], span: usize, u: Dd) -> Vec<Dd> {
    let mut values = vec![Dd::ONE];
    for j in 1..=degree {
        let mut saved = Dd::ZERO;
        for r in 0..j {
            let right = knots[span + r + 1] - u;
            let left = u - knots[span + 1 + r - j];
            let t = values[r] / (right + left);
            values[r] = saved + right * t;
            saved = left * t;
        }
        values.push(saved);
    }
    values
}

fn lifted(points: impl Iterator<Item = [Dd; 2]>) -> Vec<HomogeneousPoint> {
    points.map(|p| [p[0], p[1], Dd::ONE]).collect()
}

/// A row of a matrix with a band: its first column, and the values from there.
type Row = (usize, Vec<Dd>);

const UNEVEN: &str = "has points too unevenly spaced to interpolate";

fn open(
    points: &[[f64; 2]],
    degree: usize,
    tangents: [Option<[f64; 2]>; 2],
) -> Result<Vec<Bezier>, String> {
    let given = tangents.map(|t| usize::from(t.is_some()));
    let count = points.len() + given[0] + given[1];
    let degree = degree.min(count - 1);
    if degree < 2 && given != [0, 0] {
        return Err("has degree 1 and a tangent at an end; tangents need degree 2 or more".into());
    }
    let (mut parameters, length) = sites(points, false)?;
    parameters[points.len() - 1] = Dd::ONE;
    // The end sites count twice where their derivative is a condition, too.
    let mut conditions = parameters.clone();
    conditions.splice(0..0, (0..given[0]).map(|_| Dd::ZERO));
    conditions.extend((0..given[1]).map(|_| Dd::ONE));
    let mut knots = vec![Dd::ZERO; degree + 1];
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    for j in 1..count - degree {
        let total = conditions[j..j + degree]
            .iter()
            .fold(Dd::ZERO, |s, &u| s + u);
        knots.push(total / Dd::of(degree as f64));
    }
    knots.extend(std::iter::repeat_n(Dd::ONE, degree + 1));

    let unit_row = |first: usize, column: usize| -> Row {
        let mut values = vec![Dd::ZERO; degree + 1];
        values[column - first] = Dd::ONE;
        (first, values)
    };
    let mut rows: Vec<Row> = vec![unit_row(0, 0)];
    let mut right: Vec<[Dd; 2]> = vec![exact(points[0])];
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let leg = |span: Dd, tangent: [f64; 2]| -> [Dd; 2] {
        tangent.map(|t| Dd::of(t) * length * span / Dd::of(degree as f64))
    };
    if let Some(tangent) = tangents[0] {
        let step = leg(knots[degree + 1], tangent);
        rows.push(unit_row(0, 1));
        right.push([0, 1].map(|c| right[0][c] + step[c]));
    }
    let mut span = degree;
    for (k, &u) in parameters.iter().enumerate() {
        while span < count - 1 && u >= knots[span + 1] {
            span += 1;
        }
        if k > 0 && k + 1 < points.len() {
            rows.push((span - degree, basis(degree, &knots, span, u)));
            right.push(exact(points[k]));
        }
    }
    let last = exact(points[points.len() - 1]);
    if let Some(tangent) = tangents[1] {
        let step = leg(Dd::ONE - knots[count - 1], tangent);
        rows.push(unit_row(count - 1 - degree, count - 2));
        right.push([0, 1].map(|c| last[c] - step[c]));
    }
    rows.push(unit_row(count - 1 - degree, count - 1));
    right.push(last);
    let mut columns: Vec<Vec<Dd>> = [0, 1]
        .map(|c| right.iter().map(|p| p[c]).collect())
        .to_vec();
    Banded::new(rows, degree)?.solve(&mut columns);
    let mut control: Vec<[Dd; 2]> = (0..count).map(|k| [columns[0][k], columns[1][k]]).collect();
    control[0] = exact(points[0]);
    control[count - 1] = last;
    Ok(extract(degree, &knots, &lifted(control.into_iter())))
}

/// A matrix with a band, eliminated without pivots.
struct Banded {
    rows: Vec<Row>,
    /// For each row, the rows below it it was taken from, and how often.
    factors: Vec<Vec<(usize, Dd)>>,
}

impl Banded {
    /// * `rows`: their first columns do not decrease, and no row reaches `degree` or more beyond the diagonal.
    fn new(mut rows: Vec<Row>, degree: usize) -> Result<Self, String> {
        let count = rows.len();
        let mut factors = vec![Vec::new(); count];
        for k in 0..count {
            let (first, pivot_row) = (rows[k].0, rows[k].1.clone());
            let pivot = k.checked_sub(first).and_then(|at| pivot_row.get(at));
            let Some(&pivot) = pivot.filter(|p| **p != Dd::ZERO) else {
                return Err(UNEVEN.into());
            };
            for m in k + 1..(k + degree + 1).min(count) {
                let start = rows[m].0;
                if start > k {
                    break;
                }
                let Some(&below) = rows[m].1.get(k - start) else {
                    continue;
                };
                let factor = below / pivot;
                if factor == Dd::ZERO {
                    continue;
                }
                for (offset, &value) in pivot_row.iter().enumerate() {
                    let column = first + offset;
                    if column >= k && column >= start && column - start < rows[m].1.len() {
                        rows[m].1[column - start] = rows[m].1[column - start] - factor * value;
                    }
                }
                factors[k].push((m, factor));
            }
        }
        Ok(Self { rows, factors })
    }

    /// Solves for each of the right sides, in their place.
    fn solve(&self, right: &mut [Vec<Dd>]) {
        for side in right {
            for (k, factors) in self.factors.iter().enumerate() {
                for &(m, factor) in factors {
                    side[m] = side[m] - factor * side[k];
                }
            }
            for (k, (first, row)) in self.rows.iter().enumerate().rev() {
                let mut value = side[k];
                for (offset, &factor) in row.iter().enumerate() {
                    let column = first + offset;
                    if column > k {
                        value = value - factor * side[column];
                    }
                }
                side[k] = value / row[k - first];
            }
        }
    }
}

fn closed(points: &[[f64; 2]], degree: usize) -> Result<Vec<Bezier>, String> {
    if degree.is_multiple_of(2) {
        return Err(format!(
            "is closed and has degree {degree}; a closed interpolating curve has an odd one"
        ));
    }
    let n = points.len();
    let (sites, _) = sites(points, true)?;
    // Knot k is site k - degree, counted round and round.
    let knots: Vec<Dd> = (0..=n + 2 * degree)
        .map(|k| {
            // Beyond both ends by as many whole turns as there are.
            let turns = degree.div_ceil(n);
            let at = k + turns * n - degree;
            #[allow(clippy::cast_precision_loss, reason = "a count")]
            let whole = Dd::of((at / n) as f64 - turns as f64);
            sites[at % n] + whole
        })
        .collect();
    // At a knot the last function of its span vanishes; the middle one of the rest is the unknown's own.
    let half = (degree - 1) / 2;
    let rows: Vec<Vec<Dd>> = (0..n)
        .map(|i| {
            let span = i + degree;
            let mut values = basis(degree, &knots, span, knots[span]);
            values.truncate(degree.max(1));
            values
        })
        .collect();
    let right = [0, 1].map(|c| points.iter().map(|p| Dd::of(p[c])).collect::<Vec<Dd>>());
    let solved = cyclic(&rows, half, right.to_vec())?;
    // Function j is the unknown j - half.
    let control = (0..n + degree).map(|j| {
        let m = (j + n * degree.div_ceil(n) - half) % n;
        [solved[0][m], solved[1][m]]
    });
    let control = lifted(control);
    let mut pieces = extract(degree, &knots, &control);
    // What closes, closes to the last bit.
    let start = lifted(std::iter::once(exact(points[0])))[0];
    if let Some(first) = pieces.first_mut() {
        first.points[0] = start;
    }
    if let Some(end) = pieces.last_mut().and_then(|last| last.points.last_mut()) {
        *end = start;
    }
    Ok(pieces)
}

/// Solves a system whose row i has its values in the columns from i - half to i + half, counted round.
fn cyclic(rows: &[Vec<Dd>], half: usize, right: Vec<Vec<Dd>>) -> Result<Vec<Vec<Dd>>, String> {
    let n = rows.len();
    let column = |i: usize, offset: usize| (i + offset + n * half.div_ceil(n) - half) % n;
    if n <= 4 * half + 1 {
        let mut full = vec![vec![Dd::ZERO; n]; n];
        for (i, row) in rows.iter().enumerate() {
            for (offset, &value) in row.iter().enumerate() {
                let c = column(i, offset);
                full[i][c] = full[i][c] + value;
            }
        }
        return dense(full, right);
    }
    // | A B | | x |   | f |      A has the band alone, the last `half` rows and columns are the border
    // | C D | | y | = | g |
    let inner = n - half;
    let band = rows[..inner].iter().enumerate().map(|(i, row)| {
        let first = i.saturating_sub(half);
        let end = (i + half + 1).min(inner);
        let values = (first..end).map(|c| row[c + half - i]).collect();
        (first, values)
    });
    let banded = Banded::new(band.collect(), half + 1)?;
    let mut sides: Vec<Vec<Dd>> = right.iter().map(|side| side[..inner].to_vec()).collect();
    sides.extend((0..half).map(|_| vec![Dd::ZERO; inner]));
    let mut below = vec![vec![Dd::ZERO; n]; half];
    for (i, row) in rows.iter().enumerate() {
        for (offset, &value) in row.iter().enumerate() {
            let c = column(i, offset);
            if i >= inner {
                below[i - inner][c] = below[i - inner][c] + value;
            } else if c >= inner {
                sides[right.len() + c - inner][i] = value;
            }
        }
    }
    banded.solve(&mut sides);
    let (ends, borders) = sides.split_at(right.len());
    let along = |row: &[Dd], x: &[Dd]| row.iter().zip(x).fold(Dd::ZERO, |s, (&a, &b)| s + a * b);
    let schur = below.iter().map(|row| {
        (0..half)
            .map(|c| row[inner + c] - along(&row[..inner], &borders[c]))
            .collect()
    });
    let rest = right.iter().zip(ends).map(|(side, x)| {
        let row = |(k, row): (usize, &Vec<Dd>)| side[inner + k] - along(&row[..inner], x);
        below.iter().enumerate().map(row).collect()
    });
    let border = dense(schur.collect(), rest.collect())?;
    let solved = ends.iter().zip(border).map(|(x, y)| {
        let mut x = x.clone();
        for (value, column) in y.iter().zip(borders) {
            for (x, c) in x.iter_mut().zip(column) {
                *x = *x - *value * *c;
            }
        }
        x.extend(y);
        x
    });
    Ok(solved.collect())
}

/// Solves a small system by elimination with row pivots.
fn dense(mut rows: Vec<Vec<Dd>>, mut right: Vec<Vec<Dd>>) -> Result<Vec<Vec<Dd>>, String> {
    let n = rows.len();
    for k in 0..n {
        let size = |i: usize| rows[i][k].abs().f64();
        let pivot = (k..n).max_by(|&a, &b| size(a).total_cmp(&size(b)));
        let Some(pivot) = pivot.filter(|&p| size(p) > 0.0) else {
            return Err(UNEVEN.into());
        };
        rows.swap(k, pivot);
        right.iter_mut().for_each(|side| side.swap(k, pivot));
        for m in k + 1..n {
            let factor = rows[m][k] / rows[k][k];
            for c in k..n {
                rows[m][c] = rows[m][c] - factor * rows[k][c];
            }
            for side in &mut right {
                side[m] = side[m] - factor * side[k];
            }
        }
    }
    for side in &mut right {
        for k in (0..n).rev() {
            let known = (k + 1..n).fold(Dd::ZERO, |s, c| s + rows[k][c] * side[c]);
            side[k] = (side[k] - known) / rows[k][k];
        }
    }
    Ok(right)
}
