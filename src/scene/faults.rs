//! What is wrong with a profile's region, told at its place in the scene.
//!
//! A remedy is told only where it is one: each is tried on the profile first.

use super::build::{loops, region, rules};
use super::error::SceneError;
use super::model::{Boundary, CurveKind, ProfileModel, SceneModel};
use crate::region::{Across, Boundary as RegionBoundary, MAX_GAP, RegionError, Rules};

/// What a profile is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// Its region is turned.
    Turned,
    /// Its chain becomes trivariate NURBS, which knows no other side of the axis.
    Volume,
}

/// A region's error at its place in the scene.
pub(super) fn placed(
    model: &SceneModel,
    profile: &ProfileModel,
    error: &RegionError,
    usage: Use,
) -> SceneError {
    let loops = loops(profile);
    let curve_at = |l: usize, c: usize| loops.get(l).and_then(|curves| curves.get(c));
    let name = |l: usize, c: usize| curve_at(l, c).map_or_else(String::new, |c| c.path.clone());
    let (place, path) = match error.place() {
        Some((l, Some(c))) => curve_at(l, c).map_or((profile.place, profile.path.clone()), |c| {
            (c.place, c.path.clone())
        }),
        _ => (profile.place, profile.path.clone()),
    };
    let (found, wanted, hint) = match error {
        RegionError::Gap {
            loop_index,
            curve,
            next,
            gap,
            at,
            allowed,
        } => (
            format!(
                "a gap of {gap:e} between the end of {} at (r, z) = ({}, {}) and the start of {}",
                name(*loop_index, *curve),
                at[0],
                at[1],
                name(*loop_index, *next)
            ),
            format!("curves that meet within {allowed:e}"),
            Some(gap_remedies(profile, *next == 0)),
        ),
        RegionError::Jump {
            gap,
            at,
            allowed,
            parameter,
            ..
        } => (
            format!(
                "a jump of {gap:e} at parameter {parameter}, from (r, z) = ({}, {})",
                at[0], at[1]
            ),
            format!("control points that meet within {allowed:e} where degree + 1 knots are equal"),
            Some(match joining_gap(profile) {
                Some(gap) => format!("gap = {gap:e} in the profile joins them by a segment"),
                None => "make the two control points equal".to_owned(),
            }),
        ),
        RegionError::BelowAxis {
            r,
            parameter,
            allowed,
            ..
        } => (
            format!("r = {r:e} at parameter {parameter}"),
            format!("a curve with r >= {allowed:e}"),
            Some(across_remedies(profile, usage)),
        ),
        RegionError::Curve { reason, .. } => (
            format!("a curve that {reason}"),
            "a curve that can be drawn".to_owned(),
            None,
        ),
        RegionError::Thin { allowed, .. } => (
            error.to_string(),
            format!("a profile at least {allowed:e} thick"),
            Some("check the exponents of its coordinates".to_owned()),
        ),
        RegionError::Tangle { limit } => (
            error.to_string(),
            format!("loops that meet at most {limit} times"),
            None,
        ),
        _ => (
            error.to_string(),
            "curves that enclose an area".to_owned(),
            None,
        ),
    };
    model.error(place, &path, Some(found), &wanted, hint)
}

/// The least power of ten as `gap` with which all curves meet, where it is not more than may be asked for.
fn joining_gap(profile: &ProfileModel) -> Option<f64> {
    let given = rules(profile);
    let tried = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, MAX_GAP];
    tried
        .into_iter()
        .filter(|gap| *gap > given.gap)
        .find(|&gap| {
            let found = region(profile, &Rules { gap, ..given });
            !matches!(
                found,
                Err(RegionError::Gap { .. } | RegionError::Jump { .. })
            )
        })
}

/// What closes a gap between two curves.
///
/// * `closing`: whether it is where the last curve of a loop should meet the first.
fn gap_remedies(profile: &ProfileModel, closing: bool) -> String {
    let mut remedies = Vec::new();
    if let Some(gap) = joining_gap(profile) {
        remedies.push(format!(
            "gap = {gap:e} in the profile joins them by a segment"
        ));
    }
    let open = profile.boundary == Boundary::Closed && profile.curves.is_some();
    if closing && open {
        let given = rules(profile);
        let chain = Rules {
            boundary: RegionBoundary::ToAxis,
            ..given
        };
        if region(profile, &chain).is_ok() {
            remedies.push("boundary = \"to-axis\" takes an open chain".to_owned());
        }
        if lone_spline(profile) {
            remedies.push("closed = true takes the spline back to its first point".to_owned());
        }
    }
    remedies.push(match closing {
        true => "add a closing curve".to_owned(),
        false => "move an end, or add a segment between them".to_owned(),
    });
    remedies.join("; or ")
}

/// Whether all there is is an open interpolating curve that could be closed.
fn lone_spline(profile: &ProfileModel) -> bool {
    match profile.curves.as_deref() {
        Some([one]) => matches!(
            &one.kind,
            CurveKind::Interpolate { points, degree, closed: false, tangents: [None, None] }
                if points.len() > 2 && degree % 2 == 1
        ),
        _ => false,
    }
}

/// What helps a profile that reaches over the axis.
fn across_remedies(profile: &ProfileModel, usage: Use) -> String {
    if usage == Use::Volume {
        return "move it to r >= 0; of a volume, only what kind = \"revolve\" turns may cross the axis"
            .to_owned();
    }
    let helps = |across| {
        let tried = Rules {
            across,
            ..rules(profile)
        };
        region(profile, &tried).is_ok()
    };
    match (helps(Across::Clip), helps(Across::Mirror)) {
        (true, true) => "across = \"clip\" in the profile takes what lies at r >= 0; or across = \"mirror\" takes the union with its mirror image".to_owned(),
        (true, false) => "across = \"clip\" in the profile takes what lies at r >= 0".to_owned(),
        (false, true) => "across = \"mirror\" in the profile takes the union with its mirror image".to_owned(),
        (false, false) => "move it to r >= 0".to_owned(),
    }
}
