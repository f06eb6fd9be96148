//! Area of a convex polygon within a disc about the origin.
//!
//! The boundary of the intersection runs along polygon edges inside the disc and along arcs
//! between them. Its area is that of the polygon of the end points plus a circular segment for
//! each arc,
//!
//! ```text
//!   segment(r, α) = r² (α - sin α) / 2
//! ```
//!
//! with the small angles of a distant, nearly straight arc taken by series, so that a cell of size
//! h at radius R loses only ε R / h.

use glam::DVec2;
use smallvec::SmallVec;

/// Corners of a convex polygon, counter-clockwise.
pub type Polygon = SmallVec<[DVec2; 10]>;

/// Area of a polygon, positive when counter-clockwise.
#[must_use]
pub fn polygon_area(polygon: &[DVec2]) -> f64 {
    let Some((&o, rest)) = polygon.split_first() else {
        return 0.0;
    };
    0.5 * rest
        .windows(2)
        .map(|w| (w[0] - o).perp_dot(w[1] - o))
        .sum::<f64>()
}

/// α - sin α for 0 <= α <= 2π.
fn angle_less_sine(a: f64) -> f64 {
    if a > 0.5 {
        return a - a.sin();
    }
    let a2 = a * a;
    // Six terms leave 0.5^14 / 15! of the first, below one rounding.
    a * a2 / 6.0
        * (1.0
            - a2 / 20.0
                * (1.0 - a2 / 42.0 * (1.0 - a2 / 72.0 * (1.0 - a2 / 110.0 * (1.0 - a2 / 156.0)))))
}

/// Chord, as a share of the radius, that is a rounding at a corner and no part of an edge.
const GRAZE: f64 = 1e-9;

/// Area of the circular segment cut off by the chord from `p` to `q`, both on the circle of radius
/// `r` about the origin, on the side of the counter-clockwise arc.
///
/// Between points that differ by a rounding the arc is nothing, unless it is said to be `around`
/// the whole circle.
fn segment_area(p: DVec2, q: DVec2, r: f64, around: bool) -> f64 {
    let half_chord = 0.5 * (q - p).length();
    let mut angle = 2.0 * (half_chord / r).min(1.0).asin();
    if p.perp_dot(q) < 0.0 && (around || half_chord > GRAZE * r) {
        angle = std::f64::consts::TAU - angle;
    }
    0.5 * r * r * angle_less_sine(angle)
}

/// Area of the convex counter-clockwise `polygon` within the disc of radius `r` about the origin.
///
/// ```
/// use glam::DVec2;
/// use voxlathe::math::disc::polygon_disc_area;
/// let square = [DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.0), DVec2::new(1.0, 1.0), DVec2::new(0.0, 1.0)];
/// assert!((polygon_disc_area(&square, 1.0) - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
/// ```
#[must_use]
pub fn polygon_disc_area(polygon: &[DVec2], r: f64) -> f64 {
    if polygon.len() < 3 || !(r > 0.0) {
        return 0.0;
    }
    let r2 = r * r;
    if polygon.iter().all(|p| p.length_squared() <= r2) {
        return polygon_area(polygon);
    }
    // Parts of the edges within the disc, in order.
    let mut parts: SmallVec<[(DVec2, DVec2); 10]> = SmallVec::new();
    let mut holds_origin = true;
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let d = b - a;
        holds_origin &= d.perp_dot(-a) >= 0.0;
        let length2 = d.length_squared();
        if length2 == 0.0 {
            continue;
        }
        // |a + s d|² = r², solved about the foot of the perpendicular.
        let foot = -a.dot(d) / length2;
        let across = a.perp_dot(d);
        let half2 = (r2 - across * across / length2) / length2;
        if half2 <= 0.0 {
            continue;
        }
        let half = half2.sqrt();
        let (s0, s1) = ((foot - half).max(0.0), (foot + half).min(1.0));
        if s0 < s1 {
            let at = |s: f64| {
                if s <= 0.0 {
                    a
                } else if s >= 1.0 {
                    b
                } else {
                    a + d * s
                }
            };
            parts.push((at(s0), at(s1)));
        }
    }
    let Some(&(origin, _)) = parts.first() else {
        return if holds_origin {
            std::f64::consts::PI * r2
        } else {
            0.0
        };
    };
    // A circle within the polygon that only touches its edges goes all around.
    let touches = |&(p, q): &(DVec2, DVec2)| (q - p).length() <= 1e3 * GRAZE * r;
    let around = holds_origin && parts.iter().all(touches);
    let mut area = 0.0;
    for (i, &(p, q)) in parts.iter().enumerate() {
        let next = parts[(i + 1) % parts.len()].0;
        area += 0.5 * (p - origin).perp_dot(q - origin);
        if q != next {
            area += 0.5 * (q - origin).perp_dot(next - origin) + segment_area(q, next, r, around);
        }
    }
    area
}

/// The part of a convex polygon on the left of the line through the origin along `direction`.
#[must_use]
pub fn clip_left(polygon: &[DVec2], direction: DVec2) -> Polygon {
    let mut out = Polygon::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (sa, sb) = (direction.perp_dot(a), direction.perp_dot(b));
        if sa >= 0.0 {
            out.push(a);
        }
        if sa * sb < 0.0 {
            out.push(a + (b - a) * (sa / (sa - sb)));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quadrature::integrate;
    use proptest::prelude::*;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            .into_iter()
            .map(|(x, y)| DVec2::new(x, y))
            .collect()
    }

    /// The same area as an integral over x of the length of the vertical line inside both.
    fn by_columns(x0: f64, y0: f64, x1: f64, y1: f64, r: f64) -> f64 {
        let column = |x: f64| {
            let h = (r * r - x * x).max(0.0).sqrt();
            (y1.min(h) - y0.max(-h)).max(0.0)
        };
        // Between the places where the circle meets the sides the columns are smooth.
        let half = |y: f64| (r * r - y * y).max(0.0).sqrt();
        let mut cuts = vec![x0, x1, -r, r, half(y0), -half(y0), half(y1), -half(y1)];
        cuts.retain(|&x| x >= x0 && x <= x1 && x.abs() <= r);
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2)
            .map(|w| integrate(column, w[0], w[1], 1e-10, 4000).value)
            .sum()
    }

    proptest! {
        #[test]
        fn agrees_with_columns(x0 in -2.0..1.0_f64, y0 in -2.0..1.0_f64, w in 0.01..2.0_f64, h in 0.01..2.0_f64, r in 0.01..2.5_f64) {
            let (x1, y1) = (x0 + w, y0 + h);
            let got = polygon_disc_area(&rectangle(x0, y0, x1, y1), r);
            let want = by_columns(x0, y0, x1, y1, r);
            prop_assert!((got - want).abs() < 3e-8, "{got} for {want}");
        }

        #[test]
        fn thin_far_cells_keep_their_digits(y in -0.5..0.5_f64, off in -1.0..1.0_f64) {
            // A cell of size 1 at radius 1e6: locally a half-plane, up to the sagitta 1/(8e6).
            let r = 1e6;
            let square = rectangle(r - 0.5, y - 0.5, r + 0.5, y + 0.5);
            let got = polygon_disc_area(&square, r + off);
            let want = (off + 0.5).clamp(0.0, 1.0);
            prop_assert!((got - want).abs() < 1e-6, "{got} for {want}");
        }
    }

    #[test]
    fn discs_within_polygons_and_polygons_within_discs() {
        assert_eq!(
            polygon_disc_area(&rectangle(-2.0, -2.0, 2.0, 2.0), 1.0),
            std::f64::consts::PI
        );
        assert_eq!(
            polygon_disc_area(&rectangle(-0.5, -0.5, 0.5, 0.5), 1.0),
            1.0
        );
        assert_eq!(polygon_disc_area(&rectangle(3.0, -0.5, 4.0, 0.5), 1.0), 0.0);
        assert_eq!(polygon_disc_area(&rectangle(3.0, 1.5, 4.0, 2.5), 1.0), 0.0);
        let half = clip_left(&rectangle(-2.0, -2.0, 2.0, 2.0), DVec2::X);
        assert!((polygon_disc_area(&half, 1.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }
}
