//! Strategies and bounds shared by the tests of this folder.

use super::{KnotVector, NurbsCurve};
use proptest::prelude::*;
use std::ops::RangeInclusive;

/// γ(n) = n ε / (1 − n ε), ε being half the distance from 1 to the next f64: the relative error of
/// n roundings.
pub(super) fn gamma(n: usize) -> f64 {
    let n = n as f64 * f64::EPSILON / 2.0;
    n / (1.0 - n)
}

/// Knot vectors of the `degrees`: clamped or not, spans from 1e-9 to 10 wide, any multiplicity.
pub(super) fn knot_vectors(degrees: RangeInclusive<usize>) -> impl Strategy<Value = KnotVector> {
    let knot = (
        prop_oneof![3 => -1.0..=1.0_f64, 1 => -9.0..=-3.0_f64],
        0.0..1.0_f64,
    );
    (
        degrees,
        any::<bool>(),
        prop::collection::vec(knot, 1..=9),
        -2.0..=2.0_f64,
    )
        .prop_filter_map("a domain", |(degree, clamped, inner, start)| {
            let mut knots = Vec::new();
            let mut at = start;
            let end = if clamped { degree + 1 } else { 1 };
            knots.extend(std::iter::repeat_n(at, end));
            for (i, (exponent, share)) in inner.iter().enumerate() {
                at += 10_f64.powf(*exponent);
                let most = if i + 1 == inner.len() && clamped {
                    end - 1
                } else {
                    degree - 1
                };
                let times = 1 + (share * share * (most + 1) as f64) as usize;
                let last = i + 1 == inner.len() && clamped;
                knots.extend(std::iter::repeat_n(
                    at,
                    if last { end } else { times.min(degree) },
                ));
            }
            while knots.len() < 2 * degree + 2 {
                at += 0.5;
                knots.push(at);
            }
            KnotVector::new(degree, knots).ok()
        })
}

/// The parameter at the fraction `at` of the domain; the ends come out exactly, knots often.
pub(super) fn parameter(knots: &KnotVector, at: f64) -> f64 {
    let (a, b) = knots.domain();
    if at < 0.02 {
        a
    } else if at > 0.98 {
        b
    } else if at < 0.2 {
        let spans: Vec<_> = knots.spans().collect();
        spans[(at * 1e4) as usize % spans.len()].start
    } else {
        (a + (b - a) * at).clamp(a, b)
    }
}

/// Curves of the `degrees` on [`knot_vectors`], weights from 0.1 to 10.
pub(super) fn curves(degrees: RangeInclusive<usize>) -> impl Strategy<Value = NurbsCurve<2>> {
    knot_vectors(degrees).prop_flat_map(|knots| {
        let n = knots.control_points();
        let point = prop::array::uniform2(-10.0..=10.0_f64);
        let weight =
            prop_oneof![1 => Just(1.0), 2 => (-1.0..=1.0_f64).prop_map(|e| 10_f64.powf(e))];
        (
            Just(knots),
            prop::collection::vec(point, n),
            prop::collection::vec(weight, n),
        )
            .prop_map(|(knots, points, weights)| {
                NurbsCurve::new(knots, points, weights).expect("weights are positive")
            })
    })
}

/// The largest absolute coordinate of the control points.
pub(super) fn size<const D: usize>(curve: &NurbsCurve<D>) -> f64 {
    let (low, high) = curve.control_bounds();
    low.iter().chain(&high).fold(0.0, |m, x| x.abs().max(m))
}

/// The largest difference of a coordinate.
pub(super) fn gap<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).fold(0.0, |m, i| (a[i] - b[i]).abs().max(m))
}
