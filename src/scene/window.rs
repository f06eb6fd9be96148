//! Whether a grid holds the solid it is to sample.

use crate::grid::GridSpec;
use crate::math::Aabb;
use crate::solid::{Operation, Part};
use glam::DVec3;

/// Share of the longest side by which bounds may lie outside a grid that was meant to hold them: rounding of decimals.
const SLACK: f64 = 1e-9;

/// What to say of a grid that holds none, or not all, of what the parts make; lengths in scene units.
pub(super) fn warning(parts: &[Part], grid: &GridSpec) -> Option<String> {
    // What is left of the composite lies in here, and where all parts are added it fills it.
    let mut solid: Option<Aabb> = None;
    for part in parts {
        let own = part.bounds();
        solid = match (part.operation(), solid) {
            (Operation::Subtract, known) => known,
            (Operation::Add, None) => Some(own),
            (Operation::Add, Some(known)) => Some(Aabb {
                min: known.min.min(own.min),
                max: known.max.max(own.max),
            }),
            (Operation::Intersect, known) => known.map(|known| Aabb {
                min: known.min.max(own.min),
                max: known.max.min(own.max),
            }),
        };
    }
    let solid = solid.filter(|b| b.min.cmple(b.max).all())?;
    let window = window(grid);
    let slack = DVec3::splat(SLACK * solid.longest_side().max(window.longest_side()));
    if window.min.cmpgt(solid.max).any() || window.max.cmplt(solid.min).any() {
        return Some(format!(
            "the grid holds none of the solid: it covers {}, the solid lies in {}",
            shown(&window),
            shown(&solid)
        ));
    }
    let below = solid.min.cmplt(window.min - slack);
    let above = solid.max.cmpgt(window.max + slack);
    if !(below.any() || above.any()) {
        return None;
    }
    let added = parts.iter().all(|p| p.operation() == Operation::Add);
    let holds = if added {
        "does not hold all"
    } else {
        "may not hold all"
    };
    Some(format!(
        "the grid {holds} of the solid: it covers {}, the solid lies in {}; fractions add up to what is within",
        shown(&window),
        shown(&solid)
    ))
}

/// The box of all voxels.
fn window(grid: &GridSpec) -> Aabb {
    let [nx, ny, nz] = grid.dims();
    let half = 0.5 * grid.spacing();
    Aabb {
        min: grid.origin(),
        max: grid.centre(nx - 1, ny - 1, nz - 1) + half,
    }
}

fn shown(b: &Aabb) -> String {
    format!("{:?} to {:?}", b.min.to_array(), b.max.to_array())
}
