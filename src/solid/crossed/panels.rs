//! The two integrals of the chords, cut where what they add up changes.

use super::places::{Family, Places};
use super::sheet::{Line, zero};
use super::{BRANCHES, Crossed, Row, SIDE, Sums};
use crate::math::quadrature::{FIFTEEN, Integral, Nested, SEVEN, graded, points};
use smallvec::SmallVec;

/// How often a stretch is halved, or cut, one within another.
const DEPTH: u32 = 40;
/// Stretches narrower than this, in voxels, are left out.
const NARROW: f64 = 1e-13;
/// How near to a side of the voxel a square root counts as beginning on it, in voxels.
const BESIDE: f64 = 1e-6;
/// How near to the ends of a stretch it is looked at, as a share of it.
const VERGE: f64 = 1e-6;
/// Share of the tolerance that the integrals of planes take.
const INNER: f64 = 0.2;
/// Share of it that one stretch takes: there are some.
const STRETCH: f64 = 0.25;

/// A stretch between two places.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    ends: [f64; 2],
    /// At which ends there may be a square root.
    graded: [bool; 2],
    depth: u32,
}

impl Stretch {
    /// The place and its derivative at `u` of [0, 1].
    fn place(&self, u: f64) -> (f64, f64) {
        graded(self.ends, self.graded, u)
    }

    fn cut(&self, at: f64, graded: bool) -> [Self; 2] {
        let [a, b] = self.ends;
        let at = at.clamp(a, b);
        let part = |ends, graded| Self {
            ends,
            graded,
            depth: self.depth + 1,
        };
        [
            part([a, at], [self.graded[0], graded]),
            part([at, b], [graded, self.graded[1]]),
        ]
    }

    fn width(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// Places next to both ends.
    fn verges(&self) -> [f64; 2] {
        let [a, b] = self.ends;
        let room = VERGE * (b - a);
        [a + room, b - room]
    }
}

/// The stretches between places, which are sorted here.
fn stretches(mut places: Places) -> SmallVec<[Stretch; 24]> {
    // What begins on a side of the voxel, or next to it, is a square root there, too.
    let graded = |at: f64| places.iter().any(|p| p.1 && (p.0 - at).abs() <= BESIDE);
    let ends = [(-0.5, graded(-0.5)), (0.5, graded(0.5))];
    places.retain(|p| p.0 > -0.5 && p.0 < 0.5);
    places.extend(ends);
    places.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut ends: SmallVec<[(f64, bool); 24]> = SmallVec::new();
    for (place, graded) in places {
        match ends.last_mut() {
            // The ends of the voxel stay.
            Some(last) if place - last.0 <= NARROW => {
                last.1 |= graded;
                if place >= 0.5 {
                    last.0 = place;
                }
            }
            _ => ends.push((place, graded)),
        }
    }
    let pairs = ends.windows(2).map(|w| Stretch {
        ends: [w[0].0, w[1].0],
        graded: [w[0].1, w[1].1],
        depth: 0,
    });
    pairs.collect()
}

impl Crossed<'_> {
    fn row_at<S: Sums<N>, const N: usize>(&self, family: Family, place: f64) -> Row<N> {
        let mut through = family.through;
        through[family.moving] = place;
        self.row::<S, N>(Line {
            along: family.along,
            through,
        })
    }

    /// The places of one body at which the intervals of a family's rows change.
    fn changes_alone<S: Sums<N>, const N: usize>(&self, family: Family) -> SmallVec<[Stretch; 24]> {
        let all = stretches(self.places(family));
        let mut kept: SmallVec<[Stretch; 24]> = SmallVec::new();
        let mut before: Option<Row<N>> = None;
        for stretch in all {
            let middle = 0.5 * (stretch.ends[0] + stretch.ends[1]);
            let row = self.row_at::<S, N>(family, middle);
            match (&before, kept.last_mut()) {
                (Some(last), Some(whole))
                    if last.visible == row.visible && order(last).eq(order(&row)) =>
                {
                    whole.ends[1] = stretch.ends[1];
                    whole.graded[1] = stretch.graded[1];
                }
                _ => kept.push(stretch),
            }
            before = Some(row);
        }
        kept
    }
}

/// Sums over rows, with an estimate of the error of each.
#[derive(Debug, Clone, Copy)]
struct Sum<const N: usize> {
    values: [f64; N],
    errors: [f64; N],
}

impl<const N: usize> Default for Sum<N> {
    fn default() -> Self {
        Self {
            values: [0.0; N],
            errors: [0.0; N],
        }
    }
}

impl<const N: usize> Sum<N> {
    /// By a rule's values at its points.
    fn by<const P: usize>(rule: &Nested<P>, values: &[[f64; N]; P]) -> Self {
        let mut made = Self::default();
        for n in 0..N {
            let one = rule.sum(&values.map(|v| v[n]));
            (made.values[n], made.errors[n]) = (one.value, one.error);
        }
        made
    }

    fn add(&mut self, other: &Self) {
        for n in 0..N {
            self.values[n] += other.values[n];
            self.errors[n] += other.errors[n];
        }
    }

    /// With every error wider by as much.
    fn doubt(&mut self, error: f64) {
        self.errors.iter_mut().for_each(|e| *e += error);
    }

    /// With a part that nothing is known of but that a sum over it is between 0 and its width.
    fn unknown(&mut self, width: f64) {
        self.values.iter_mut().for_each(|v| *v += 0.5 * width);
        self.doubt(width);
    }

    fn error(&self) -> f64 {
        self.errors.iter().fold(0.0, |most, e| most.max(*e))
    }
}

/// What is summed over the rows within the terms, over the whole voxel.
pub(super) fn integrals<S: Sums<N>, const N: usize>(
    voxel: &Crossed,
    [along, moving, planes]: [usize; 3],
    tolerance: f64,
) -> [Integral; N] {
    let mut places = voxel.reaches(planes);
    for (rows, side) in [(along, moving), (moving, along)] {
        for at in SIDE_PLACES {
            let mut through = [0.0; 3];
            through[side] = at;
            let family = Family {
                along: rows,
                moving: planes,
                through,
            };
            changes::<S, N>(voxel, family, &mut places);
        }
    }
    let mut work: Vec<Stretch> = stretches(places).into_vec();
    let mut total = Sum::<N>::default();
    let slice = |at: f64| {
        let mut through = [0.0; 3];
        through[planes] = at;
        let family = Family {
            along,
            moving,
            through,
        };
        area::<S, N>(voxel, family, INNER * tolerance)
    };
    while let Some(stretch) = work.pop() {
        if stretch.width() <= NARROW {
            total.doubt(stretch.width());
            continue;
        }
        if voxel.is_over() {
            total.unknown(stretch.width());
            continue;
        }
        match of_planes(voxel, stretch, STRETCH * tolerance, &slice) {
            Ok(part) => total.add(&part),
            Err(parts) => work.extend(parts.into_iter().rev()),
        }
    }
    std::array::from_fn(|n| Integral {
        value: total.values[n],
        error: total.errors[n],
    })
}

const SIDE_PLACES: [f64; 2] = [-0.5, 0.5];

/// The sums over a plane, and what stands for the edges that cut it.
#[derive(Debug, Clone, Copy, Default)]
struct Slice<const N: usize> {
    sum: Sum<N>,
    corners: u64,
}

/// One stretch of planes, or the parts it is to be cut into.
fn of_planes<const N: usize>(
    voxel: &Crossed,
    stretch: Stretch,
    tolerance: f64,
    slice: &impl Fn(f64) -> Slice<N>,
) -> Result<Sum<N>, [Stretch; 2]> {
    let last = stretch.depth >= DEPTH || voxel.is_spent();
    let tolerance = tolerance.max(voxel.rounding);
    let quick = planes_by(&SEVEN, stretch, tolerance, slice, last)?;
    if quick.error() <= tolerance {
        return Ok(quick);
    }
    let long = planes_by(&FIFTEEN, stretch, tolerance, slice, last)?;
    if long.error() <= tolerance || last {
        return Ok(long);
    }
    let middle = 0.5 * (stretch.ends[0] + stretch.ends[1]);
    Err(stretch.cut(middle, false))
}

fn planes_by<const P: usize, const N: usize>(
    rule: &Nested<P>,
    stretch: Stretch,
    tolerance: f64,
    slice: &impl Fn(f64) -> Slice<N>,
    last: bool,
) -> Result<Sum<N>, [Stretch; 2]> {
    let mut values = [[0.0; N]; P];
    let mut before: Option<(f64, Slice<N>)> = None;
    let mut change: Option<[(f64, Slice<N>); 2]> = None;
    let mut carried: f64 = 0.0;
    let mut spread = Spread::<N>::default();
    let [low, high] = stretch.verges();
    // The ends are looked at once.
    let ends = P == 7 && !last;
    if ends {
        before = Some((low, slice(low)));
    }
    let us = points(rule);
    for i in 0..=P {
        if i == P && !ends {
            break;
        }
        let (at, slope) = us.get(i).map_or((high, 0.0), |u| stretch.place(*u));
        let here = slice(at);
        if let Some(before) = before
            && before.1.corners != here.corners
        {
            change.get_or_insert([before, (at, here)]);
            if stretch.width() > SLIGHT && !last {
                break;
            }
        }
        before = Some((at, here));
        carried = carried.max(here.sum.error());
        spread.add(&here.sum.values);
        if let Some(value) = values.get_mut(i) {
            *value = here.sum.values.map(|v| v * slope);
        }
    }
    let unknown = spread.width() * stretch.width();
    match change {
        Some([from, to])
            if !last && (stretch.width() > SLIGHT || unknown > UNKNOWN * tolerance) =>
        {
            let place = change_of_planes(from, to, tolerance, slice);
            return Err(stretch.cut(place, true));
        }
        _ => {}
    }
    let mut sum = Sum::by(rule, &values);
    let unknown = if change.is_some() { unknown } else { 0.0 };
    for error in &mut sum.errors {
        *error = error.max(unknown) + carried * stretch.width();
    }
    Ok(sum)
}

/// Stretches narrower than this may be too slight for what changes in them to matter.
const SLIGHT: f64 = 1e-3;
/// Share of a tolerance that is left to what is not known where values differ by no more.
const UNKNOWN: f64 = 0.02;

/// How far values lie apart.
#[derive(Debug, Clone, Copy)]
struct Spread<const N: usize>([[f64; 2]; N]);

impl<const N: usize> Default for Spread<N> {
    fn default() -> Self {
        Self([[f64::INFINITY, f64::NEG_INFINITY]; N])
    }
}

impl<const N: usize> Spread<N> {
    fn add(&mut self, values: &[f64; N]) {
        for (known, value) in self.0.iter_mut().zip(values) {
            *known = [known[0].min(*value), known[1].max(*value)];
        }
    }

    fn width(&self) -> f64 {
        let widths = self.0.iter().map(|[low, high]| high - low);
        widths.fold(0.0, f64::max)
    }
}

/// How far two sums lie apart.
fn step<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let steps = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    steps.fold(0.0, f64::max)
}

/// Where the edges that planes cut change, to what that place may matter.
fn change_of_planes<const N: usize>(
    mut from: (f64, Slice<N>),
    mut to: (f64, Slice<N>),
    tolerance: f64,
    slice: &impl Fn(f64) -> Slice<N>,
) -> f64 {
    let matters = |a: &(f64, Slice<N>), b: &(f64, Slice<N>)| {
        (b.0 - a.0) * step(&a.1.sum.values, &b.1.sum.values) > 1e-2 * UNKNOWN * tolerance
    };
    while to.0 - from.0 > NARROW && matters(&from, &to) {
        let middle = 0.5 * (from.0 + to.0);
        let here = slice(middle);
        if here.corners == from.1.corners {
            from = (middle, here);
        } else {
            to = (middle, here);
        }
    }
    0.5 * (from.0 + to.0)
}

/// The sums over the rows of a plane.
fn area<S: Sums<N>, const N: usize>(voxel: &Crossed, family: Family, tolerance: f64) -> Slice<N> {
    let mut work = voxel.changes_alone::<S, N>(family);
    work.reverse();
    let mut found = Slice::default();
    let mut before: Option<SmallVec<[u32; 12]>> = None;
    while let Some(stretch) = work.pop() {
        if stretch.width() <= NARROW {
            found.sum.doubt(stretch.width());
            continue;
        }
        if voxel.is_over() {
            found.sum.unknown(stretch.width());
            continue;
        }
        match of_rows::<S, N>(voxel, family, stretch, STRETCH * tolerance) {
            Ok((part, ends)) => {
                found.sum.add(&part);
                let corners = match &before {
                    None => ends
                        .iter()
                        .map(|e| hash(2, surface(*e)))
                        .fold(0, u64::wrapping_add),
                    Some(last) => corner(last, &ends),
                };
                found.corners = found.corners.wrapping_add(corners);
                before = Some(ends);
            }
            Err([first, second]) => work.extend([second, first]),
        }
    }
    let ends = before.unwrap_or_default();
    let last = ends.iter().map(|e| hash(3, surface(*e)));
    found.corners = found.corners.wrapping_add(last.fold(0, u64::wrapping_add));
    found
}

/// The surface of a branch.
fn surface(label: u32) -> u32 {
    if label < BRANCHES {
        label
    } else {
        label / BRANCHES * BRANCHES
    }
}

/// One step of a mixing of words.
fn hash(a: u64, b: u32) -> u64 {
    let mut h = (a ^ 0xcbf2_9ce4_8422_2325).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(b);
    h = h.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h ^ h >> 31
}

/// What stands for the corner between two rows: the surfaces that end one more of the intervals of either. A surface
/// that only turns there ends two more.
fn corner(before: &[u32], after: &[u32]) -> u64 {
    let mut all: SmallVec<[u32; 24]> = before.iter().chain(after).map(|l| surface(*l)).collect();
    all.sort_unstable();
    let odd = all.chunk_by(|a, b| a == b).filter(|run| run.len() % 2 == 1);
    let words = odd.map(|run| run[0]);
    let (count, code) = words.fold((0, 5), |(n, h), w| (n + 1, hash(h, w)));
    if count == 0 { 0 } else { code }
}

/// The labels that end the intervals of a row.
type Ends = SmallVec<[u32; 12]>;

/// One stretch of rows, or the parts it is to be cut into.
fn of_rows<S: Sums<N>, const N: usize>(
    voxel: &Crossed,
    family: Family,
    stretch: Stretch,
    tolerance: f64,
) -> Result<(Sum<N>, Ends), [Stretch; 2]> {
    let last = stretch.depth >= DEPTH || voxel.is_spent();
    let tolerance = tolerance.max(voxel.rounding * stretch.width());
    let (quick, ends) = rows_by::<S, 7, N>(&SEVEN, voxel, family, stretch, tolerance, last)?;
    if quick.error() <= tolerance {
        return Ok((quick, ends));
    }
    let (long, ends) = rows_by::<S, 15, N>(&FIFTEEN, voxel, family, stretch, tolerance, last)?;
    if long.error() <= tolerance || last {
        return Ok((long, ends));
    }
    let middle = 0.5 * (stretch.ends[0] + stretch.ends[1]);
    Err(stretch.cut(middle, false))
}

fn rows_by<S: Sums<N>, const P: usize, const N: usize>(
    rule: &Nested<P>,
    voxel: &Crossed,
    family: Family,
    stretch: Stretch,
    tolerance: f64,
    last: bool,
) -> Result<(Sum<N>, Ends), [Stretch; 2]> {
    let us = points(rule);
    let rows: SmallVec<[Row<N>; 15]> = us
        .iter()
        .map(|u| voxel.row_at::<S, N>(family, stretch.place(*u).0))
        .collect();
    let mut spread = Spread::default();
    rows.iter().for_each(|r| spread.add(&r.sums));
    let unknown = spread.width() * stretch.width();
    let slight = stretch.width() <= SLIGHT && unknown <= UNKNOWN * tolerance;
    if !(last || slight)
        && let Some((place, graded)) = first_change::<S, N>(voxel, family, stretch, &us, &rows)
    {
        return Err(stretch.cut(place, graded));
    }
    let mut values = [[0.0; N]; P];
    for ((value, u), row) in values.iter_mut().zip(us).zip(&rows) {
        let slope = stretch.place(u).1;
        *value = row.sums.map(|sum| sum * slope);
    }
    let ends = rows[P / 2].visible.clone();
    let mut sum = Sum::by(rule, &values);
    if slight || last && rows.iter().any(|r| r.visible != ends) {
        for error in &mut sum.errors {
            *error = error.max(unknown);
        }
    }
    Ok((sum, ends))
}

/// The first place within a stretch at which the intervals of its rows change, and whether as a square root.
fn first_change<S: Sums<N>, const N: usize>(
    voxel: &Crossed,
    family: Family,
    stretch: Stretch,
    us: &[f64],
    rows: &[Row<N>],
) -> Option<(f64, bool)> {
    let place = |i: usize| stretch.place(us[i]).0;
    for i in 1..rows.len() {
        if rows[i - 1].visible != rows[i].visible {
            return Some(change_of_rows::<S, N>(
                voxel,
                family,
                [place(i - 1), place(i)],
                [&rows[i - 1], &rows[i]],
            ));
        }
    }
    let n = rows.len();
    let compared = |at: f64, i: usize| {
        let row = voxel.row_at::<S, N>(family, at);
        (row.visible != rows[i].visible).then(|| {
            let known = place(i);
            if at < known {
                change_of_rows::<S, N>(voxel, family, [at, known], [&row, &rows[i]])
            } else {
                change_of_rows::<S, N>(voxel, family, [known, at], [&rows[i], &row])
            }
        })
    };
    // No point sees what is beyond the outermost.
    let [low, high] = stretch.verges();
    if let Some(found) = compared(low, 0).or_else(|| compared(high, n - 1)) {
        return Some(found);
    }
    // Where surfaces change places that end nothing, something may come to light between the changes.
    for i in 1..n {
        let found = uncovered::<S, N>(
            voxel,
            family,
            [place(i - 1), place(i)],
            [&rows[i - 1], &rows[i]],
        );
        if found.is_some() {
            return found;
        }
    }
    // Between the points surfaces may touch that are apart at each of them.
    let gaps: SmallVec<[SmallVec<[f64; 24]>; 15]> = rows.iter().map(gaps).collect();
    for i in 1..n - 1 {
        let [first, here, last] = [&rows[i - 1], &rows[i], &rows[i + 1]];
        if !(labels(first).eq(labels(here)) && labels(here).eq(labels(last))) {
            continue;
        }
        for k in 0..gaps[i].len() {
            let [a, b, c] = [gaps[i - 1][k], gaps[i][k], gaps[i + 1][k]];
            if !(b < a && b < c) {
                continue;
            }
            // The least value of the parabola through the three.
            let (x, y, z) = (us[i - 1], us[i], us[i + 1]);
            let (left, right) = ((b - a) / (y - x), (c - b) / (z - y));
            let bend = (right - left) / (z - x);
            let u = 0.5 * (x + y) - 0.5 * left / bend;
            let least = a + (u - x) * left + bend * (u - x) * (u - y);
            if least < 0.5 * b
                && u > x
                && u < z
                && let Some(found) = compared(stretch.place(u).0, i)
            {
                return Some(found);
            }
        }
    }
    None
}

/// All that crosses a row, and the voxel's sides, in order.
fn order<const N: usize>(row: &Row<N>) -> impl Iterator<Item = u32> {
    let mut all: SmallVec<[(f64, u32); 26]> =
        row.events.iter().map(|e| (e.place, e.label)).collect();
    let before = all.iter().take_while(|e| e.0 <= -0.5).count();
    all.insert(before, (-0.5, SIDE[0]));
    let within = all.iter().take_while(|e| e.0 < 0.5).count();
    all.insert(within.max(before + 1), (0.5, SIDE[1]));
    all.into_iter().map(|e| e.1)
}

/// A place between two rows of equal intervals at which they are others: between the places at which what crosses the rows
/// changes its order.
fn uncovered<S: Sums<N>, const N: usize>(
    voxel: &Crossed,
    family: Family,
    [from, to]: [f64; 2],
    [first, last]: [&Row<N>; 2],
) -> Option<(f64, bool)> {
    let [a, b] = [first, last].map(|row| order(row).collect::<SmallVec<[u32; 26]>>());
    if a == b {
        return None;
    }
    let mut marks: SmallVec<[f64; 16]> = SmallVec::new();
    for (i, &x) in a.iter().enumerate() {
        let Some(at) = b.iter().position(|&l| l == x) else {
            continue;
        };
        for &y in &a[i + 1..] {
            if !b[..at].contains(&y) {
                continue;
            }
            let gap = |row: &Row<N>| Some(place_of(row, y)? - place_of(row, x)?);
            let (Some(fa), Some(fb)) = (gap(first), gap(last)) else {
                continue;
            };
            if (fa < 0.0) != (fb < 0.0) {
                let f = |p: f64| gap(&voxel.row_at::<S, N>(family, p)).unwrap_or(0.0);
                marks.push(zero(&f, [from, to], [fa, fb]));
            }
        }
    }
    marks.extend([from, to]);
    marks.sort_unstable_by(f64::total_cmp);
    marks.windows(2).find_map(|w| {
        let middle = 0.5 * (w[0] + w[1]);
        let row = (w[1] - w[0] > NARROW).then(|| voxel.row_at::<S, N>(family, middle))?;
        let differs = row.visible != first.visible;
        differs.then(|| change_of_rows::<S, N>(voxel, family, [from, middle], [first, &row]))
    })
}

/// What crosses a row within the voxel.
fn labels<const N: usize>(row: &Row<N>) -> impl Iterator<Item = u32> + '_ {
    let within = row.events.iter().filter(|e| e.place.abs() < 0.5);
    within.map(|e| e.label)
}

/// How far what crosses a row is from each other, and from the voxel's sides.
fn gaps<const N: usize>(row: &Row<N>) -> SmallVec<[f64; 24]> {
    let mut found = SmallVec::new();
    let mut before = -0.5;
    for event in row.events.iter().filter(|e| e.place.abs() < 0.5) {
        found.push(event.place - before);
        before = event.place;
    }
    found.push(0.5 - before);
    found
}

/// The place on a row of what has that label.
fn place_of<const N: usize>(row: &Row<N>, label: u32) -> Option<f64> {
    if label == SIDE[0] {
        return Some(-0.5);
    }
    if label == SIDE[1] {
        return Some(0.5);
    }
    let event = row.events.iter().find(|e| e.label == label);
    event.map(|e| e.place)
}

/// Where the intervals of rows change between two, and whether as a square root.
fn change_of_rows<S: Sums<N>, const N: usize>(
    voxel: &Crossed,
    family: Family,
    [from, to]: [f64; 2],
    [first, last]: [&Row<N>; 2],
) -> (f64, bool) {
    let (l, r) = (&first.visible, &last.visible);
    let differs = |i: &usize| l.get(*i) != r.get(*i);
    let at = (0..l.len().max(r.len())).find(differs).unwrap_or_default();
    let pairs = [
        l.get(at).zip(r.get(at)),
        l.get(at).zip(l.get(at + 1)),
        r.get(at).zip(r.get(at + 1)),
    ];
    for (a, b) in pairs.into_iter().flatten() {
        let gap = |row: &Row<N>| Some(place_of(row, *a)? - place_of(row, *b)?);
        let (Some(fa), Some(fb)) = (gap(first), gap(last)) else {
            continue;
        };
        if (fa < 0.0) == (fb < 0.0) {
            continue;
        }
        let failed = std::cell::Cell::new(false);
        let f = |p: f64| {
            gap(&voxel.row_at::<S, N>(family, p)).unwrap_or_else(|| {
                failed.set(true);
                0.0
            })
        };
        let found = zero(&f, [from, to], [fa, fb]);
        if !failed.get() {
            return (found, false);
        }
    }
    let (mut a, mut b) = (from, to);
    let mut sums = [first.sums, last.sums];
    // To what the place may matter, at the least tolerance.
    while b - a > NARROW && (b - a) * step(&sums[0], &sums[1]) > 1e-18 {
        let middle = 0.5 * (a + b);
        let row = voxel.row_at::<S, N>(family, middle);
        if row.visible == *l {
            (a, sums[0]) = (middle, row.sums);
        } else {
            (b, sums[1]) = (middle, row.sums);
        }
    }
    (0.5 * (a + b), true)
}

/// Adds the places at which the intervals of a family's rows change.
fn changes<S: Sums<N>, const N: usize>(voxel: &Crossed, family: Family, out: &mut Places) {
    let alone = voxel.changes_alone::<S, N>(family);
    for stretch in &alone[1..] {
        out.push((stretch.ends[0], stretch.graded[0]));
    }
    let mut work: Vec<Stretch> = alone.into_vec();
    while let Some(stretch) = work.pop() {
        if stretch.width() <= NARROW || stretch.depth >= DEPTH || voxel.is_spent() {
            continue;
        }
        let us = points(&SEVEN);
        let rows: SmallVec<[Row<N>; 15]> = us
            .iter()
            .map(|u| voxel.row_at::<S, N>(family, stretch.place(*u).0))
            .collect();
        if let Some((place, graded)) = first_change::<S, N>(voxel, family, stretch, &us, &rows) {
            out.push((place, graded));
            work.extend(stretch.cut(place, graded));
        }
    }
}
