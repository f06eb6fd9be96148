//! Whether a boundary is its own mirror image across a height.
//!
//! Each piece must have a partner of its own whose control points are the piece's, mirrored, in the same order or the
//! other one. Curves of equal weights are no further apart than their control points are (*The NURBS Book*, eq. 4.1:
//! points of a rational curve are convex combinations of them), so the boundary and its image are that near to each
//! other, and a point further from both than that, and its image, are on the same side.

use super::boundary::BoundaryPiece;
use super::curve::HomogeneousPoint;
use super::piece::Piece;
use crate::math::Real;

/// The most pieces that are compared, each with each.
const MOST_PIECES: usize = 1000;
/// Weights differ by no more than this part: rounding of f64.
const SAME_WEIGHT: f64 = 8.0 * f64::EPSILON;

/// Whether `boundary` is its own image across the height `middle`, within `tolerance`, in the region's unit; no, too,
/// where there are too many pieces to say.
pub(crate) fn is_mirrored(boundary: &[BoundaryPiece], middle: f64, tolerance: f64) -> bool {
    if boundary.len() > MOST_PIECES {
        return false;
    }
    let points: Vec<_> = boundary.iter().map(|b| points(b.piece)).collect();
    are_paired(&points, middle, tolerance)
}

/// Whether each piece has a partner of its own.
fn are_paired(points: &[Vec<[f64; 3]>], middle: f64, tolerance: f64) -> bool {
    let mut taken = vec![false; points.len()];
    points.iter().all(|piece| {
        let partner = (points.iter().zip(&taken))
            .position(|(other, taken)| !taken && are_images(piece, other, middle, tolerance));
        partner.is_some_and(|p| !std::mem::replace(&mut taken[p], true))
    })
}

/// Control points and weights.
fn points(piece: &Piece) -> Vec<[f64; 3]> {
    let point = |[r, z, w]: HomogeneousPoint| [(r / w).f64(), (z / w).f64(), w.f64()];
    piece.points().map(point).collect()
}

fn are_images(piece: &[[f64; 3]], other: &[[f64; 3]], middle: f64, tolerance: f64) -> bool {
    let alike = |(a, b): (&[f64; 3], &[f64; 3])| {
        (a[0] - b[0]).abs() <= tolerance
            && (a[1] + b[1] - 2.0 * middle).abs() <= tolerance
            && (a[2] - b[2]).abs() <= SAME_WEIGHT * a[2].abs()
    };
    piece.len() == other.len()
        && (piece.iter().zip(other).all(alike) || piece.iter().zip(other.iter().rev()).all(alike))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    /// Whether a solid is its own image across its middle, and `away` from that.
    fn mirrored(text: &str, away: f64, tolerance: f64) -> bool {
        let scene = Scene::parse(&format!("schema = 1\n{text}")).expect("a scene");
        let body = scene.assembly().bodies()[0].revolved().expect("turned");
        let heights = || {
            body.boundary()
                .iter()
                .flat_map(|b| [b.piece.bounds().min[1], b.piece.bounds().max[1]])
        };
        let (low, high) = (
            heights().fold(f64::MAX, f64::min),
            heights().fold(f64::MIN, f64::max),
        );
        let boundary: Vec<_> = body.boundary().iter().collect();
        is_mirrored(&boundary, 0.5 * (low + high) + away, tolerance)
    }

    #[test]
    fn tori_and_cylinders_are_mirrored_and_cones_are_not() {
        for solid in [
            "'torus'\nmajor = 1\nminor = 0.35",
            "'cylinder'\nradius = 1\nheight = 3",
        ] {
            let solid = format!("[[solid]]\nkind = {solid}\n");
            assert!(mirrored(&solid, 0.0, 1e-12));
            assert!(!mirrored(&solid, 1e-6, 1e-7));
        }
        let cone = "[[solid]]\nkind = 'cone'\nradius1 = 1\nradius2 = 0\nheight = 2\n";
        assert!(!mirrored(cone, 0.0, 1e-7));
    }

    #[test]
    fn places_alone_do_not_make_an_image() {
        let profile = |weight: f64| {
            format!(
                "[profiles.p]\n[[profiles.p.curves]]\nkind = 'nurbs'\ndegree = 2\n\
                 points = [[1, -1], [3, -1], [3, 0], [3, 1], [1, 1]]\nknots = [0, 0, 0, 1, 1, 2, 2, 2]\n\
                 weights = [1, 1, 1, {weight}, 1]\n\
                 [[profiles.p.curves]]\nkind = 'polyline'\npoints = [[1, 1], [1, -1]]\n\
                 [[solid]]\nkind = 'revolve'\nprofile = 'p'\n"
            )
        };
        assert!(mirrored(&profile(1.0), 0.0, 1e-12));
        assert!(!mirrored(&profile(1.001), 0.0, 1e-3));
    }

    /// A wall below that is three sheets thick and one above: each sheet is near the image of another, but not of its
    /// own, and what they bound is not the image of itself.
    #[test]
    fn sheets_as_thin_as_the_tolerance_do_not_make_an_image() {
        let line = |z: f64| vec![[1.0, z, 1.0], [2.0, z, 1.0]];
        let one = [line(-1.0), line(1.0)];
        assert!(are_paired(&one, 0.0, 1e-6));
        let thick = [line(-1.0), line(-1.0 + 1e-7), line(-1.0 + 2e-7), line(1.0)];
        assert!(!are_paired(&thick, 0.0, 1e-6));
    }
}
