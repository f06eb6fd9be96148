//! Solids: from values to the model.

use std::collections::BTreeMap;

use super::error::{Fault, Place, push_index, shorten};
use super::fields::{
    Fields, choice, choices, direction, each, elements, find, finite, integer, kinded, largest,
    length, name, number, string, tuple, vector,
};
use super::keys::{self, nearest};
use super::limits::{MAX_SOLIDS, MIN_ASPECT, MIN_MAGNITUDE, MIN_SINE};
use super::model::{
    AxisModel, Operation, PlaceStep, ProfileModel, SolidKind, SolidModel, TurnModel,
};
use super::reference::shape;
use super::value::{Kind, Value};
use super::volume::{Context, volume};

/// Reads `solid`.
pub(super) fn solids(value: &Value, context: &mut Context) -> Result<Vec<SolidModel>, Fault> {
    let wanted = "an array of at least one solid";
    if let Kind::Table(_) = value.kind {
        return Err(value.wrong_type(wanted).with_hint(Some(
            "in toml write [[solid]], with two brackets".to_owned(),
        )));
    }
    let list = elements(value, wanted)?;
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    if let Some(more) = list.get(MAX_SOLIDS) {
        let wanted = format!("at most {MAX_SOLIDS} solids in a scene");
        let found = format!("{} solids", list.len());
        return Err(Fault::found(more.place, found, wanted).at_index(MAX_SOLIDS));
    }
    let found = each(list, |index, element| solid(element, index, context))?;
    // Of two solids of one name the later one is at fault, unless only the earlier one asked for it.
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    let asked = |index: usize| match &list[index].kind {
        Kind::Table(entries) => find(entries, "name").map(|name| name.place),
        _ => None,
    };
    for (index, solid) in found.iter().enumerate() {
        let Some(first) = names.insert(&solid.name, index) else {
            continue;
        };
        let (at, other) = match asked(index) {
            Some(_) => (index, first),
            None => (first, index),
        };
        let place = asked(at).unwrap_or(found[at].place);
        let line = context.sources.describe_line(found[other].place);
        return Err(Fault::value(place, "a name that no other solid has")
            .with_hint(Some(format!("solid[{other}], {line}, has it too")))
            .at_key("name")
            .at_index(at));
    }
    Ok(found)
}

fn solid(value: &Value, index: usize, context: &mut Context) -> Result<SolidModel, Fault> {
    let (kind, fields) = kinded(value, keys::SOLIDS, "a table: a solid")?;
    let name = fields
        .read("name", |value| name(value, "a string"))?
        .unwrap_or_else(|| format!("{kind} {}", index + 1));
    let kind = match kind {
        "revolve" => SolidKind::Revolve {
            profile: profile(&fields, context.profiles)?,
            turn: turn(&fields)?,
        },
        "ellipsoid" => SolidKind::Ellipsoid {
            radii: lengths(&fields, "radii", "three half axes [x, y, z]")?,
        },
        "box" => SolidKind::Box {
            size: lengths(&fields, "size", "three side lengths [x, y, z]")?,
        },
        "volume" => SolidKind::Volume(volume(&fields, value, context)?),
        round => SolidKind::Round {
            shape: shape(round, &fields, value)?,
            turn: turn(&fields)?,
        },
    };
    let (axis, steps) = placed(&fields, value.place)?;
    let operation = fields
        .read("operation", |value| {
            let operation = choice(value, choices!(Operation))?;
            if index == 0 && operation != Operation::Add {
                return Err(Fault::value(
                    value.place,
                    "add: there is nothing before the first solid",
                ));
            }
            Ok(operation)
        })?
        .unwrap_or(Operation::Add);
    let material = fields
        .read("material", |value| integer(value, 1, u32::MAX))?
        .unwrap_or(1);
    let mut path = "solid".to_owned();
    push_index(&mut path, index);
    Ok(SolidModel {
        name,
        kind,
        axis,
        steps,
        operation,
        material,
        place: value.place,
        path,
    })
}

/// The index of the profile that a solid names.
pub(super) fn profile(
    fields: &Fields,
    profiles: &[(String, ProfileModel)],
) -> Result<usize, Fault> {
    fields.need("profile", "the name of a profile", |value| {
        let wanted = "the name of a profile";
        let name = string(value, wanted)?;
        profiles
            .binary_search_by(|(other, _)| other.as_str().cmp(name))
            .map_err(|_| {
                let near = nearest(name, profiles.iter().map(|(name, _)| name.as_str()));
                let hint = match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if profiles.is_empty() => "the scene has no profiles".to_owned(),
                    None => {
                        let names: Vec<&str> = profiles
                            .iter()
                            .take(8)
                            .map(|(name, _)| name.as_str())
                            .collect();
                        format!("the scene has {}", shorten(&names.join(", ")))
                    }
                };
                Fault::value(value.place, wanted).with_hint(Some(hint))
            })
    })
}

/// How far something is turned, and from where.
pub(super) fn turn(fields: &Fields) -> Result<TurnModel, Fault> {
    let angle = fields.read("angle", |value| {
        let wanted = "an angle other than 0, of at most 360 either way";
        number(value, wanted, |x| {
            (MIN_MAGNITUDE..=360.0).contains(&x.abs())
        })
    })?;
    Ok(TurnModel {
        angle: angle.unwrap_or(360.0),
        start: fields.read("start", finite)?.unwrap_or(0.0),
    })
}

/// Three lengths, none of them so small beside the largest that nothing of the solid is left.
fn lengths(fields: &Fields, key: &str, wanted: &str) -> Result<[f64; 3], Fault> {
    fields.need(key, wanted, |value| {
        let found: [f64; 3] = tuple(value, wanted, length)?;
        let least = found.iter().fold(f64::INFINITY, |m, &v| v.min(m));
        if least < MIN_ASPECT * largest(found) {
            let wanted = format!("lengths of which none is below {MIN_ASPECT:e} of the largest");
            return Err(Fault::value(value.place, wanted));
        }
        Ok(found)
    })
}

/// The axis of a table and the steps that place it, with their defaults.
pub(super) fn placed(fields: &Fields, place: Place) -> Result<(AxisModel, Vec<PlaceStep>), Fault> {
    let axis = fields.read("axis", axis)?.unwrap_or(AxisModel {
        origin: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
        x: None,
        place,
    });
    let steps = fields.read("place", |value| {
        each(elements(value, "an array of steps")?, |_, value| {
            step(value)
        })
    })?;
    Ok((axis, steps.unwrap_or_default()))
}

fn axis(value: &Value) -> Result<AxisModel, Fault> {
    let fields = Fields::new(value, keys::AXIS, "a table: an axis")?;
    let origin = fields.read("origin", vector)?.unwrap_or([0.0; 3]);
    let along = fields
        .read("direction", direction)?
        .unwrap_or([0.0, 0.0, 1.0]);
    let x = fields.read("x", |value| {
        let x = direction(value)?;
        if sine(x, along) < MIN_SINE {
            let [i, j, k] = along;
            return Err(Fault::value(
                value.place,
                format!("a zero-angle direction not parallel to the axis, [{i:?}, {j:?}, {k:?}]"),
            ));
        }
        Ok(x)
    })?;
    Ok(AxisModel {
        origin,
        direction: along,
        x,
        place: value.place,
    })
}

fn step(value: &Value) -> Result<PlaceStep, Fault> {
    let wanted = "a step: a table of one of scale, rotate, translate, mirror";
    let fields = Fields::new(value, keys::STEP, wanted)?;
    let scale = fields.read("scale", |value| {
        number(value, "a factor greater than 0 (1e-100 to 1e100)", |x| {
            x >= MIN_MAGNITUDE
        })
        .map(PlaceStep::Scale)
    })?;
    let rotate = fields.read("rotate", |value| {
        let fields = Fields::new(value, keys::ROTATE, "a table of axis and degrees")?;
        Ok(PlaceStep::Rotate {
            axis: fields.need("axis", "a direction [x, y, z]", direction)?,
            degrees: fields.need("degrees", "an angle in degrees", finite)?,
        })
    })?;
    let translate = fields.read("translate", |value| vector(value).map(PlaceStep::Translate))?;
    let mirror = fields.read("mirror", |value| direction(value).map(PlaceStep::Mirror))?;
    let mut steps = [scale, rotate, translate, mirror].into_iter().flatten();
    match (steps.next(), steps.next()) {
        (Some(step), None) => Ok(step),
        (None, _) => Err(Fault::found(value.place, "an empty step", wanted)),
        _ => Err(Fault::found(
            value.place,
            "several keys in one step",
            "a table for each step, since their order matters",
        )),
    }
}

/// Sine of the angle between two directions, good to a few roundings.
fn sine(a: [f64; 3], b: [f64; 3]) -> f64 {
    let unit = |v: [f64; 3]| {
        let most = largest(v);
        let v = v.map(|c| c / most);
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        v.map(|c| c / length)
    };
    let (a, b) = (unit(a), unit(b));
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    cross.iter().map(|c| c * c).sum::<f64>().sqrt()
}
