//! Volumes: trivariate NURBS given inline, by construction or in a file.

use super::error::{At, Fault, Sources};
use super::fields::{
    Fields, WEIGHT, choice, each, elements, entries, finite, integer, number, string, tuple, vector,
};
use super::keys;
use super::limits::MAX_DEGREE;
use super::model::{
    CurveForm, FieldModel, PARAMETERS, PatchModel, ProfileModel, SectionModel, VolumeModel,
    VolumeSource,
};
use super::points::PointFiles;
use super::profile::knots;
use super::solid::{profile, turn};
use super::value::{Kind, Value};
use crate::exchange;
use crate::grid::Channel;
use crate::nurbs::NurbsVolume;
use std::path::Path;

/// What a scene has read so far, which solids refer to.
pub(super) struct Context<'a> {
    pub(super) profiles: &'a [(String, ProfileModel)],
    pub(super) files: &'a mut PointFiles,
    pub(super) sources: &'a mut Sources,
}

/// The source of a solid of kind `volume`.
pub(super) fn volume(
    fields: &Fields,
    value: &Value,
    context: &mut Context,
) -> Result<VolumeModel, Fault> {
    let given = ["patches", "construct", "file"].map(|key| fields.get(key).is_some());
    match given {
        [true, false, false] | [false, true, false] | [false, false, true] => {}
        [false, false, false] => {
            let wanted = "one of `patches`, `construct`, `file`";
            return Err(Fault::found(value.place, "a volume of nothing", wanted));
        }
        _ => {
            let wanted = "one of them";
            let found = "several of `patches`, `construct`, `file`";
            return Err(Fault::found(value.place, found, wanted));
        }
    }
    let [patches, construct, _] = given;
    if !construct {
        let stray = ["profile", "section", "angle", "start", "fill"];
        if let Some(key) = stray.into_iter().find(|key| fields.get(key).is_some()) {
            return Err(only_with(fields, key, "`construct`"));
        }
    }
    if patches {
        let patches = fields.need("patches", "an array of patches", |value| {
            let list = elements(value, "an array of patches")?;
            if list.is_empty() {
                return Err(Fault::value(value.place, "at least one patch"));
            }
            let patches = each(list, |_, value| patch(value))?;
            same_fields(&patches)?;
            Ok(patches)
        })?;
        return Ok(VolumeModel {
            source: VolumeSource::Patches(patches),
            notes: Vec::new(),
        });
    }
    if construct {
        return Ok(VolumeModel {
            source: constructed(fields, context)?,
            notes: Vec::new(),
        });
    }
    fields.need("file", "the name of a file", |value| file(value, context))
}

fn only_with(fields: &Fields, key: &str, other: &str) -> Fault {
    let place = fields.get(key).map_or(fields.place(), |v| v.place);
    Fault::found(
        place,
        format!("`{key}` without {other}"),
        format!("{other} beside it"),
    )
    .at_key(key)
}

fn constructed(fields: &Fields, context: &Context) -> Result<VolumeSource, Fault> {
    let names = [
        ("curve-disc", Some(CurveForm::Disc)),
        ("surface-circle", None),
        ("curve-ruled", Some(CurveForm::Ruled)),
    ];
    let wanted = "one of curve-disc, surface-circle, curve-ruled";
    let form = fields.need("construct", wanted, |value| choice(value, &names))?;
    let Some(form) = form else {
        for key in ["profile", "fill"] {
            if fields.get(key).is_some() {
                return Err(only_with(fields, key, "a construction from a curve"));
            }
        }
        let wanted = "a planar NURBS surface: a table of degrees, knots, points [r, z]";
        return Ok(VolumeSource::Section {
            section: fields.need("section", wanted, section)?,
            turn: turn(fields)?,
        });
    };
    if fields.get("section").is_some() {
        return Err(only_with(
            fields,
            "section",
            "construct = \"surface-circle\"",
        ));
    }
    let union = fields.read("fill", |value| choice(value, &[("union", ())]))?;
    Ok(VolumeSource::Curve {
        form,
        profile: profile(fields, context.profiles)?,
        turn: turn(fields)?,
        union: union.is_some(),
    })
}

/// What the nets of patches and sections share.
struct Net<const N: usize, const D: usize> {
    degrees: [usize; N],
    knots: [Vec<f64>; N],
    points: Vec<[f64; D]>,
    weights: Vec<f64>,
}

fn net<const N: usize, const D: usize>(
    fields: &Fields,
    point: impl Fn(&Value) -> Result<[f64; D], Fault>,
) -> Result<Net<N, D>, Fault> {
    const HIGH: u32 = MAX_DEGREE as u32;
    let wanted = format!("{N} degrees, one for each parameter");
    let degrees = fields.need("degrees", &wanted, |value| {
        tuple(value, &wanted, |v| integer(v, 1, HIGH).map(|d| d as usize))
    })?;
    let wanted = format!("{N} knot vectors, one for each parameter");
    let knots = fields.need("knots", &wanted, |value| {
        let list = elements(value, &wanted)?;
        if list.len() != N {
            let found = format!("{} knot vectors", list.len());
            return Err(Fault::found(value.place, found, wanted.as_str()));
        }
        let mut all: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
        for (k, value) in list.iter().enumerate() {
            let count = elements(value, "an array of numbers")?.len();
            let least = 2 * degrees[k] + 2;
            if count < least {
                let found = format!("{count} knots");
                let wanted = format!("at least {least} for degree {}", degrees[k]);
                return Err(Fault::found(value.place, found, wanted).at_index(k));
            }
            all[k] = knots(value, count - degrees[k] - 1, degrees[k], degrees[k]).at_index(k)?;
        }
        Ok(all)
    })?;
    let counts: [usize; N] = std::array::from_fn(|k| knots[k].len() - degrees[k] - 1);
    let needed = counts.iter().try_fold(1_usize, |n, c| n.checked_mul(*c));
    let shape = counts.map(|c| c.to_string()).join(" x ");
    let count = |value: &Value, found: usize, what: &str| {
        if Some(found) == needed {
            return Ok(());
        }
        let wanted = match needed {
            Some(needed) => format!("{needed}: {shape} by the knots and degrees"),
            None => format!("{shape} by the knots and degrees"),
        };
        Err(Fault::found(value.place, format!("{found} {what}"), wanted))
    };
    let points = fields.need(
        "points",
        "control points, the first index fastest",
        |value| {
            let list = elements(value, "an array of control points")?;
            count(value, list.len(), "control points")?;
            each(list, |_, value| point(value))
        },
    )?;
    let weights = fields.read("weights", |value| {
        let list = elements(value, "an array of numbers")?;
        count(value, list.len(), "weights")?;
        each(list, |_, value| number(value, WEIGHT, |x| x > 0.0))
    })?;
    Ok(Net {
        degrees,
        knots,
        weights: weights.unwrap_or_else(|| vec![1.0; points.len()]),
        points,
    })
}

fn patch(value: &Value) -> Result<PatchModel, Fault> {
    let fields = Fields::new(value, keys::PATCH, "a table: a patch")?;
    let net = net::<3, 3>(&fields, vector)?;
    let scalars = fields.read("fields", |value| {
        let mut found: Vec<FieldModel> = Vec::new();
        for entry in entries(value, "a table of fields: a list of numbers for each")? {
            check_field_name(&entry.key)
                .map_err(|wanted| {
                    Fault::found(
                        entry.key_place,
                        format!("a field named `{}`", entry.key),
                        wanted,
                    )
                })
                .at_key(&entry.key)?;
            let list = elements(&entry.value, "an array of numbers").at_key(&entry.key)?;
            if list.len() != net.points.len() {
                let found = format!("{} values", list.len());
                let wanted = format!("{}, one for each control point", net.points.len());
                return Err(Fault::found(entry.value.place, found, wanted).at_key(&entry.key));
            }
            let values = each(list, |_, value| finite(value)).at_key(&entry.key)?;
            found.push(FieldModel {
                name: entry.key.clone(),
                values,
            });
        }
        found.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(found)
    })?;
    Ok(PatchModel {
        degrees: net.degrees,
        knots: net.knots,
        points: net.points,
        weights: net.weights,
        fields: scalars.unwrap_or_default(),
        place: value.place,
    })
}

/// Whether a field may have that name; else what is wanted.
fn check_field_name(name: &str) -> Result<(), String> {
    let letter = |c: char| c.is_ascii_alphabetic() || c == '_';
    let fits = name.len() <= 64
        && name.starts_with(letter)
        && name.chars().all(|c| letter(c) || c.is_ascii_digit());
    if !fits {
        return Err("letters, digits and _, at most 64, no digit first".to_owned());
    }
    let known = Channel::ALL.iter().map(|c| c.name());
    let taken: Vec<&str> = known.chain(PARAMETERS).collect();
    if taken.contains(&name) {
        return Err(format!("a name other than {}", taken.join(", ")));
    }
    Ok(())
}

/// Refuses patches of one solid of which some lack a field.
fn same_fields(patches: &[PatchModel]) -> Result<(), Fault> {
    let names = |p: &PatchModel| p.fields.iter().map(|f| f.name.clone()).collect::<Vec<_>>();
    let first = names(&patches[0]);
    for (index, patch) in patches.iter().enumerate() {
        let own = names(patch);
        if own != first {
            let found = format!("the fields [{}]", own.join(", "));
            let wanted = format!("those of the first patch, [{}]", first.join(", "));
            return Err(Fault::found(patch.place, found, wanted).at_index(index));
        }
    }
    Ok(())
}

fn section(value: &Value) -> Result<SectionModel, Fault> {
    let fields = Fields::new(value, keys::SECTION, "a table: a planar NURBS surface")?;
    let net = net::<2, 2>(&fields, |value| tuple(value, "a point [r, z]", finite))?;
    Ok(SectionModel {
        degrees: net.degrees,
        knots: net.knots,
        points: net.points,
        weights: net.weights,
        place: value.place,
    })
}

fn file(value: &Value, context: &mut Context) -> Result<VolumeModel, Fault> {
    let wanted = "a file of NURBS volumes: .g2, .mesh (MFEM), .json (geomdl) or .xml (G+Smo)";
    let name = match &value.kind {
        Kind::String(_) => string(value, wanted)?,
        _ => return Err(value.wrong_type(wanted)),
    };
    if name.is_empty() || name.contains('\0') {
        return Err(Fault::value(value.place, wanted));
    }
    let bytes = context.files.bytes(name, value.place)?;
    let refused = |reason: String| Fault::found(value.place, format!("{name}: {reason}"), wanted);
    let reading =
        exchange::read_bytes(Path::new(name), &bytes).map_err(|e| refused(e.to_string()))?;
    let (volumes, notes) = reading.into_volumes().map_err(|e| refused(e.to_string()))?;
    let patches: Vec<_> = volumes.iter().map(|v| of_volume(v, value)).collect();
    if patches.is_empty() {
        return Err(refused("no spline".to_owned()));
    }
    let notes = notes.iter().map(|note| format!("{name}: {note}"));
    Ok(VolumeModel {
        source: VolumeSource::Patches(patches),
        notes: notes.collect(),
    })
}

fn of_volume(volume: &NurbsVolume, value: &Value) -> PatchModel {
    PatchModel {
        degrees: volume.degrees(),
        knots: volume.knots().each_ref().map(|k| k.knots().to_vec()),
        points: volume.control_points().to_vec(),
        weights: volume.weights().to_vec(),
        fields: Vec::new(),
        place: value.place,
    }
}
