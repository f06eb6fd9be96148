//! A scene with every default and every file of points written out, as JSON.
//!
//! The result is itself a scene: reading it gives the same data, and resolving that gives the same
//! text, bit for bit. Keys are in alphabetical order and floats in their shortest form that reads
//! back exactly, so equal scenes have equal text and the text can be hashed.

use serde::ser::{Serialize, SerializeMap as _, Serializer};
use serde_json::Value;

use super::model::{
    Across, AxisModel, CurveForm, CurveKind, CurveModel, GridModel, GridStep, OutputModel,
    PatchModel, PlaceStep, PointModel, ProfileModel, ReferenceModel, SceneModel, SolidKind,
    SolidModel, TurnModel, VolumeModel, VolumeSource,
};
use crate::math::tolerance::GAP;
use crate::solid::Shape;

/// [`serde_json::json!`] as a [`Node`].
macro_rules! json {
    ($value:expr) => {
        Node::Plain(serde_json::json!($value))
    };
}

/// What has no value.
const NOTHING: Node<'static> = Node::Plain(Value::Null);

/// A value of the JSON form. A scene may have very many points: they are not copied.
enum Node<'a> {
    Plain(Value),
    Points(&'a [PointModel]),
    List(Vec<Node<'a>>),
    /// Keys in alphabetical order.
    Table(Vec<(String, Node<'a>)>),
}

impl<'a> FromIterator<Node<'a>> for Node<'a> {
    fn from_iter<I: IntoIterator<Item = Node<'a>>>(nodes: I) -> Self {
        Self::List(nodes.into_iter().collect())
    }
}

impl Node<'_> {
    fn is_null(&self) -> bool {
        matches!(self, Self::Plain(Value::Null))
    }
}

impl Serialize for Node<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Plain(value) => value.serialize(serializer),
            Self::Points(points) => serializer.collect_seq(points.iter().map(|p| [p.r, p.z])),
            Self::List(nodes) => serializer.collect_seq(nodes),
            Self::Table(entries) => {
                let mut map = serializer.serialize_map(Some(entries.len()))?;
                for (key, node) in entries {
                    map.serialize_entry(key, node)?;
                }
                map.end()
            }
        }
    }
}

impl SceneModel {
    /// The scene in full: a valid scene in its JSON form.
    ///
    /// Defaults are written out, points from files are inlined, profiles are ordered by name.
    /// What has no value (a band, explicit bounds, a chosen zero-angle direction) is left out.
    ///
    /// # Panics
    /// Never: whatever a scene holds has a JSON form.
    pub fn resolve(&self) -> Value {
        serde_json::to_value(self.node()).expect("keys are text")
    }

    /// The text of [`resolve`](Self::resolve), written piece by piece.
    ///
    /// # Errors
    /// Those of the writer.
    pub(crate) fn write_resolved(&self, to: impl std::io::Write) -> std::io::Result<()> {
        Ok(serde_json::to_writer(to, &self.node())?)
    }

    /// As [`write_resolved`](Self::write_resolved), indented.
    ///
    /// # Errors
    /// Those of the writer.
    #[cfg_attr(
        not(feature = "cli"),
        allow(dead_code, reason = "only a command writes whole manifests of scenes")
    )]
    pub(crate) fn write_resolved_indented(
        &self,
        to: &mut dyn std::io::Write,
    ) -> std::io::Result<()> {
        Ok(serde_json::to_writer_pretty(to, &self.node())?)
    }

    fn node(&self) -> Node<'_> {
        let materials = self
            .materials
            .iter()
            .map(|(id, name)| (id.to_string(), json!(name)));
        let profiles = self
            .profiles
            .iter()
            .map(|(name, model)| (name.clone(), profile(model)));
        object([
            ("schema", json!(1)),
            ("name", json!(self.name)),
            ("units", json!(self.units.name())),
            ("grid", grid(&self.grid)),
            ("output", output(&self.output)),
            ("materials", sorted(materials)),
            ("profiles", sorted(profiles)),
            (
                "solid",
                self.solids.iter().map(|model| self.solid(model)).collect(),
            ),
            (
                "reference",
                self.reference.as_ref().map_or(NOTHING, reference),
            ),
        ])
    }

    fn solid<'a>(&'a self, model: &'a SolidModel) -> Node<'a> {
        let mut keys = vec![
            ("name", json!(model.name)),
            ("axis", axis(&model.axis)),
            ("place", model.steps.iter().map(step).collect()),
            ("operation", json!(model.operation.name())),
            ("material", json!(model.material)),
        ];
        let turned =
            |turn: &TurnModel| [("angle", json!(turn.angle)), ("start", json!(turn.start))];
        match &model.kind {
            SolidKind::Revolve { profile, turn } => {
                keys.push(("kind", json!("revolve")));
                keys.push(("profile", json!(self.profiles[*profile].0)));
                keys.extend(turned(turn));
            }
            SolidKind::Round { shape, turn } => {
                keys.extend(round(*shape));
                keys.extend(turned(turn));
            }
            SolidKind::Ellipsoid { radii } => {
                keys.push(("kind", json!("ellipsoid")));
                keys.push(("radii", json!(radii)));
            }
            SolidKind::Box { size } => {
                keys.push(("kind", json!("box")));
                keys.push(("size", json!(size)));
            }
            SolidKind::Volume(volume) => {
                keys.push(("kind", json!("volume")));
                keys.extend(self.volume(volume));
            }
        }
        sorted(keys.into_iter().map(|(key, value)| (key.to_owned(), value)))
    }
}

impl SceneModel {
    fn volume<'a>(&'a self, model: &'a VolumeModel) -> Vec<(&'static str, Node<'a>)> {
        match &model.source {
            VolumeSource::Patches(patches) => {
                vec![("patches", patches.iter().map(patch).collect())]
            }
            VolumeSource::Curve {
                form,
                profile,
                turn,
                union,
            } => {
                let construct = match form {
                    CurveForm::Disc => "curve-disc",
                    CurveForm::Ruled => "curve-ruled",
                };
                let mut keys = vec![
                    ("construct", json!(construct)),
                    ("profile", json!(self.profiles[*profile].0)),
                ];
                keys.extend(turned(turn));
                keys.extend(union.then(|| ("fill", json!("union"))));
                keys
            }
            VolumeSource::Section { section, turn } => {
                let mut keys = vec![
                    ("construct", json!("surface-circle")),
                    (
                        "section",
                        object([
                            ("degrees", json!(section.degrees)),
                            ("knots", json!(section.knots)),
                            ("points", json!(section.points)),
                            ("weights", json!(section.weights)),
                        ]),
                    ),
                ];
                keys.extend(turned(turn));
                keys
            }
        }
    }
}

fn turned(turn: &TurnModel) -> [(&'static str, Node<'static>); 2] {
    [("angle", json!(turn.angle)), ("start", json!(turn.start))]
}

fn patch(model: &PatchModel) -> Node<'static> {
    let fields = model.fields.iter();
    let fields = match model.fields.as_slice() {
        [] => NOTHING,
        _ => sorted(fields.map(|f| (f.name.clone(), json!(f.values)))),
    };
    object([
        ("degrees", json!(model.degrees)),
        ("knots", json!(model.knots)),
        ("points", json!(model.points)),
        ("weights", json!(model.weights)),
        ("fields", fields),
    ])
}

/// An object whose keys are in alphabetical order, whichever map `serde_json` was built with.
fn sorted<'a>(entries: impl IntoIterator<Item = (String, Node<'a>)>) -> Node<'a> {
    let mut entries: Vec<_> = entries.into_iter().collect();
    entries.sort_by(|a, b| a.0.cmp(&b.0));
    Node::Table(entries)
}

/// As [`sorted`]; entries that are `null` are left out.
fn object<'a, const N: usize>(entries: [(&str, Node<'a>); N]) -> Node<'a> {
    sorted(
        entries
            .into_iter()
            .filter(|(_, value)| !value.is_null())
            .map(|(key, value)| (key.to_owned(), value)),
    )
}

/// Nothing where `plain`, else the value.
fn unless(plain: bool, value: Node<'_>) -> Node<'_> {
    if plain { NOTHING } else { value }
}

fn grid(model: &GridModel) -> Node<'static> {
    let (resolution, spacing, origin, dims) = match model.step {
        GridStep::Resolution(n) => (json!(n), NOTHING, NOTHING, NOTHING),
        GridStep::Resolutions(n) => (json!(n), NOTHING, NOTHING, NOTHING),
        GridStep::Spacing(spacing) => (NOTHING, json!(spacing), NOTHING, NOTHING),
        GridStep::Verbatim {
            origin,
            spacing,
            dims,
        } => (NOTHING, json!(spacing), json!(origin), json!(dims)),
    };
    object([
        ("resolution", resolution),
        ("spacing", spacing),
        ("bounds", json!(model.bounds)),
        ("origin", origin),
        ("dims", dims),
        ("padding", json!(model.padding)),
    ])
}

fn output(model: &OutputModel) -> Node<'static> {
    object([
        (
            "channels",
            (model.channels.iter())
                .map(|channel| json!(channel.name()))
                .collect(),
        ),
        (
            "formats",
            (model.formats.iter())
                .map(|format| json!(format.name()))
                .collect(),
        ),
        ("compression", json!(model.compression.name())),
        ("band", json!(model.band)),
    ])
}

fn profile(model: &ProfileModel) -> Node<'_> {
    let loops = match model.loops.as_slice() {
        [] => NOTHING,
        loops => loops.iter().map(|l| chain(l)).collect(),
    };
    object([
        ("boundary", json!(model.boundary.name())),
        ("fill", json!(model.fill.name())),
        // What was not asked for stays out, so that scenes keep the hash they had.
        ("gap", unless(model.gap == GAP, json!(model.gap))),
        (
            "across",
            unless(model.across == Across::Refuse, json!(model.across.name())),
        ),
        (
            "curves",
            model.curves.as_ref().map_or(NOTHING, |c| chain(c)),
        ),
        ("loops", loops),
    ])
}

fn chain(curves: &[CurveModel]) -> Node<'_> {
    curves.iter().map(curve).collect()
}

fn curve(model: &CurveModel) -> Node<'_> {
    let points = |points| Node::Points(points);
    let reverse = ("reverse", json!(model.reverse));
    match &model.kind {
        CurveKind::Nurbs {
            degree,
            points: p,
            weights,
            knots,
        } => object([
            ("kind", json!("nurbs")),
            reverse,
            ("degree", json!(degree)),
            ("points", points(p)),
            ("weights", json!(weights)),
            ("knots", json!(knots)),
        ]),
        CurveKind::Bezier { points: p, weights } => object([
            ("kind", json!("bezier")),
            reverse,
            ("points", points(p)),
            ("weights", json!(weights)),
        ]),
        CurveKind::Polyline { points: p } => {
            object([("kind", json!("polyline")), reverse, ("points", points(p))])
        }
        CurveKind::Arc {
            center,
            radius,
            from,
            to,
        } => object([
            ("kind", json!("arc")),
            reverse,
            ("center", json!(center)),
            ("radius", json!(radius)),
            ("from", json!(from)),
            ("to", json!(to)),
        ]),
        CurveKind::Circle { center, radius } => object([
            ("kind", json!("circle")),
            reverse,
            ("center", json!(center)),
            ("radius", json!(radius)),
        ]),
        CurveKind::Ellipse {
            center,
            radii,
            tilt,
        } => object([
            ("kind", json!("ellipse")),
            reverse,
            ("center", json!(center)),
            ("radii", json!(radii)),
            ("tilt", json!(tilt)),
        ]),
        CurveKind::Interpolate {
            points: p,
            degree,
            closed,
            tangents: [start, end],
        } => object([
            ("kind", json!("interpolate")),
            reverse,
            ("points", points(p)),
            ("degree", json!(degree)),
            ("closed", unless(!closed, json!(closed))),
            ("start-tangent", json!(start)),
            ("end-tangent", json!(end)),
        ]),
    }
}

fn reference(model: &ReferenceModel) -> Node<'static> {
    let mut keys = round(model.shape);
    keys.push(("axis", axis(&model.axis)));
    keys.push(("place", model.steps.iter().map(step).collect()));
    sorted(keys.into_iter().map(|(key, value)| (key.to_owned(), value)))
}

/// Kind and sizes of a shape.
fn round(shape: Shape) -> Vec<(&'static str, Node<'static>)> {
    match shape {
        Shape::Torus { major, minor } => vec![
            ("kind", json!("torus")),
            ("major", json!(major)),
            ("minor", json!(minor)),
        ],
        Shape::Cylinder { radius, height } => vec![
            ("kind", json!("cylinder")),
            ("radius", json!(radius)),
            ("height", json!(height)),
        ],
        Shape::Cone {
            radius1,
            radius2,
            height,
        } => vec![
            ("kind", json!("cone")),
            ("radius1", json!(radius1)),
            ("radius2", json!(radius2)),
            ("height", json!(height)),
        ],
        Shape::Sphere { radius } => vec![("kind", json!("sphere")), ("radius", json!(radius))],
    }
}

fn axis(model: &AxisModel) -> Node<'static> {
    object([
        ("origin", json!(model.origin)),
        ("direction", json!(model.direction)),
        ("x", json!(model.x)),
    ])
}

fn step(step: &PlaceStep) -> Node<'static> {
    match step {
        PlaceStep::Scale(factor) => object([("scale", json!(factor))]),
        PlaceStep::Rotate { axis, degrees } => object([(
            "rotate",
            object([("axis", json!(axis)), ("degrees", json!(degrees))]),
        )]),
        PlaceStep::Translate(by) => object([("translate", json!(by))]),
        PlaceStep::Mirror(normal) => object([("mirror", json!(normal))]),
    }
}
