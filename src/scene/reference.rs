//! `[reference]`: the closed form that a scene is compared with.

use super::error::Fault;
use super::fields::{Fields, kinded, length, number};
use super::keys;
use super::limits::MIN_MAGNITUDE;
use super::model::ReferenceModel;
use super::solid::placed;
use super::value::Value;
use crate::solid::Shape;

/// Reads `reference`.
pub(super) fn reference(value: &Value) -> Result<ReferenceModel, Fault> {
    let (kind, fields) = kinded(value, keys::REFERENCES, "a table: a closed form")?;
    let shape = shape(kind, &fields, value)?;
    if let Shape::Torus { major, minor } = shape
        && minor > major
    {
        let place = fields.get("minor").map_or(value.place, |v| v.place);
        let wanted = "a minor radius of at most the major one";
        return Err(Fault::value(place, wanted).at_key("minor"));
    }
    let (axis, steps) = placed(&fields, value.place)?;
    Ok(ReferenceModel {
        shape,
        axis,
        steps,
        place: value.place,
    })
}

/// The sizes of a torus, cylinder, cone or (any other kind) sphere.
pub(super) fn shape(kind: &str, fields: &Fields, value: &Value) -> Result<Shape, Fault> {
    let size = |key: &str| fields.need(key, "a length", length);
    let radius_or_tip = |key: &str| {
        fields.need(key, "a radius", |value| {
            let wanted = "a radius: 0, or a length (1e-100 to 1e100)";
            number(value, wanted, |x| x == 0.0 || x >= MIN_MAGNITUDE)
        })
    };
    Ok(match kind {
        "torus" => Shape::Torus {
            major: size("major")?,
            minor: size("minor")?,
        },
        "cylinder" => Shape::Cylinder {
            radius: size("radius")?,
            height: size("height")?,
        },
        "cone" => {
            let (radius1, radius2) = (radius_or_tip("radius1")?, radius_or_tip("radius2")?);
            if radius1 == 0.0 && radius2 == 0.0 {
                let place = fields.get("radius2").map_or(value.place, |v| v.place);
                let wanted = "a radius greater than 0 where the other one is 0";
                return Err(Fault::value(place, wanted).at_key("radius2"));
            }
            Shape::Cone {
                radius1,
                radius2,
                height: size("height")?,
            }
        }
        _ => Shape::Sphere {
            radius: size("radius")?,
        },
    })
}
