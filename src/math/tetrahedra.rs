//! Volumes of boxes cut by planes.

use glam::DVec3;
use smallvec::SmallVec;

/// The points x with `normal · x <= offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Need not be of length 1.
    pub normal: DVec3,
    /// In units of the normal's length.
    pub offset: f64,
}

/// Four corners.
pub type Tetrahedron = [DVec3; 4];
type Tetrahedra = SmallVec<[Tetrahedron; 32]>;

/// The volume that half-spaces leave of the box with corners `± half`.
///
/// The box is six tetrahedra, and a plane leaves of each nothing, a tetrahedron or a prism, which
/// is three; so every step is exact but for rounding.
#[must_use]
pub fn box_volume_within(half: DVec3, spaces: &[HalfSpace]) -> f64 {
    box_tetrahedra_within(half, spaces).iter().map(volume).sum()
}

/// Tetrahedra that together are what half-spaces leave of the box with corners `± half`.
#[must_use]
pub fn box_tetrahedra_within(half: DVec3, spaces: &[HalfSpace]) -> SmallVec<[Tetrahedron; 32]> {
    let mut parts: Tetrahedra = box_tetrahedra(half).into_iter().collect();
    for space in spaces {
        let mut left = Tetrahedra::new();
        for part in &parts {
            clip(part, space, &mut left);
        }
        parts = left;
    }
    parts
}

/// The share that one half-space leaves of the box with corners `± half`, in closed form.
///
/// With the box as the unit cube and the half-space as `m · x <= α`, m ascending and its sum 1, the share is the sum of
/// the corner's tetrahedron `α³ / 6 m₁ m₂ m₃` less those beyond the sides; written so that no small m is divided by
/// without a like factor above.
///
/// * Source: Scardovelli & Zaleski, *Journal of Computational Physics* 164 (2000) 228-237.
#[must_use]
pub fn box_share_under(half: DVec3, space: &HalfSpace) -> f64 {
    let across = (space.normal * half).abs();
    let reach = across.element_sum();
    if !(space.offset < reach) {
        return 1.0;
    }
    if !(space.offset > -reach) {
        return 0.0;
    }
    let mut m = (across / reach).to_array();
    m.sort_by(f64::total_cmp);
    let [a, b, c] = m;
    // From the nearer corner: the share of the rest is one less that.
    let from_corner = 0.5 * (reach - space.offset.abs()) / reach;
    let under = if from_corner < a {
        from_corner * from_corner * from_corner / (6.0 * a * b * c)
    } else if from_corner >= a + b {
        (from_corner - 0.5 * (a + b)) / c
    } else {
        let cube = |x: f64| {
            let x = x.max(0.0);
            x * x * x
        };
        let beyond = cube(from_corner - b) + cube(from_corner - c);
        let beyond = if beyond > 0.0 { beyond / a } else { 0.0 };
        (3.0 * from_corner * (from_corner - a) + a * a - beyond) / (6.0 * b * c)
    };
    if space.offset > 0.0 {
        1.0 - under
    } else {
        under
    }
}

fn volume([a, b, c, d]: &Tetrahedron) -> f64 {
    (*b - *a).cross(*c - *a).dot(*d - *a).abs() / 6.0
}

/// Six tetrahedra around the diagonal, one for each order of the axes.
fn box_tetrahedra(half: DVec3) -> [Tetrahedron; 6] {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    ORDERS.map(|order| {
        let mut at = -half;
        let mut step = |axis: usize| {
            at[axis] = half[axis];
            at
        };
        [-half, step(order[0]), step(order[1]), step(order[2])]
    })
}

fn clip(part: &Tetrahedron, space: &HalfSpace, out: &mut Tetrahedra) {
    let height = |p: DVec3| space.normal.dot(p) - space.offset;
    let mut inside = SmallVec::<[(DVec3, f64); 4]>::new();
    let mut outside = SmallVec::<[(DVec3, f64); 4]>::new();
    for &p in part {
        let h = height(p);
        if h <= 0.0 {
            inside.push((p, h));
        } else {
            outside.push((p, h));
        }
    }
    let meet = |(p, hp): (DVec3, f64), (q, hq): (DVec3, f64)| p + (q - p) * (hp / (hp - hq));
    match (inside.as_slice(), outside.as_slice()) {
        ([], _) => {}
        (_, []) => out.push(*part),
        (&[a], &[p, q, r]) => out.push([a.0, meet(a, p), meet(a, q), meet(a, r)]),
        (&[a, b], &[p, q]) => prism(
            [a.0, meet(a, p), meet(a, q)],
            [b.0, meet(b, p), meet(b, q)],
            out,
        ),
        (&[a, b, c], &[p]) => prism([a.0, b.0, c.0], [meet(a, p), meet(b, p), meet(c, p)], out),
        _ => unreachable!("a tetrahedron has four corners"),
    }
}

fn prism([a, b, c]: [DVec3; 3], [p, q, r]: [DVec3; 3], out: &mut Tetrahedra) {
    out.push([a, b, c, p]);
    out.push([b, c, p, q]);
    out.push([c, p, q, r]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_closed_form_is_what_tetrahedra_sum_to(
            n in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0],
            small in [0..40_u32, 0..40, 0..40],
            offset in -1.2..1.2_f64,
            h in [0.1..3.0_f64, 0.1..3.0, 0.1..3.0],
        ) {
            // Components from 1 down to nothing.
            let tiny = |i: usize| if small[i] > 30 { 0.0 } else { (-f64::from(small[i])).exp2() };
            let normal = DVec3::new(n[0] * tiny(0), n[1] * tiny(1), n[2] * tiny(2));
            let half = DVec3::from_array(h);
            prop_assume!(normal.length() > 1e-12);
            let offset = offset * (normal * half).abs().element_sum();
            let space = HalfSpace { normal, offset };
            let by_parts = box_volume_within(half, &[space]) / (8.0 * half.element_product());
            let found = box_share_under(half, &space);
            prop_assert!((found - by_parts).abs() < 1e-13, "{found} for {by_parts}");
        }
    }

    #[test]
    fn planes_leave_known_volumes() {
        let half = DVec3::new(1.0, 2.0, 3.0);
        let space = |normal, offset| HalfSpace { normal, offset };
        let within = |spaces: &[HalfSpace]| box_volume_within(half, spaces);
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-13, "{a} for {b}");
        close(within(&[]), 48.0);
        close(within(&[space(DVec3::X, 0.25)]), 30.0);
        close(within(&[space(DVec3::X, -2.0)]), 0.0);
        close(within(&[space(DVec3::X, 2.0)]), 48.0);
        // Halves through the middle, whatever the tilt; quarters where they cross at right angles.
        let tilt = DVec3::new(0.3, -0.7, 0.2);
        close(within(&[space(tilt, 0.0)]), 24.0);
        close(
            within(&[space(DVec3::X, 0.0), space(DVec3::Z * 5.0, 0.0)]),
            12.0,
        );
        // A corner: x/1 + y/2 + z/3 >= 2 leaves a sixth of the box around it.
        let corner = DVec3::new(-1.0, -0.5, -1.0 / 3.0);
        close(within(&[space(corner, -2.0)]), 1.0);
        // What one plane leaves and what its opposite leaves is all, within a third.
        let third = space(DVec3::new(0.1, 0.9, 0.4), 0.3);
        let opposite = space(-tilt, 0.1);
        let both = within(&[third, space(tilt, -0.1)]) + within(&[third, opposite]);
        close(both, within(&[third]));
    }
}
