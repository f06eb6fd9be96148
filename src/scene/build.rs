//! From a scene's data to its solid and its grid.

use super::faults::{Use, placed};
use super::model::{
    self, AxisModel, CurveKind, CurveModel, GridStep, PlaceStep, ProfileModel, SceneModel,
    SolidKind, SolidModel, TurnModel,
};
use super::{export, nets, shapes};
use crate::error::Error;
use crate::grid::{GridError, GridSpec};
use crate::math::quadrature::Integral;
use crate::math::{Aabb, Similarity};
use crate::nurbs::NurbsVolume;
use crate::region::{
    Across, Boundary, CurveLocator, Ends, Fill, ProfileCurve, ProfileLoop, Region, RegionError,
    Rules,
};
use crate::solid::{
    Analytic, Assembly, Block, Body, Ellipsoid, Measures, Operation, Part, Shape, Turn,
};
use glam::DVec3;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Work of the composite's volume that a run that samples waits for: some tenths of a second.
const BESIDE_SAMPLING: u64 = 800_000;
/// An error relative to the volume above which it is not told.
const POOR: f64 = 1e-6;

/// A scene made ready: its solid, and the grid it asks for.
///
/// ```
/// use voxlathe::Scene;
/// let scene = Scene::parse(r#"
///     schema = 1
///     [profiles.ring]
///     curves = [{ kind = "circle", center = [1, 0], radius = 0.25 }]
///     [[solid]]
///     kind = "revolve"
///     profile = "ring"
/// "#)?;
/// assert_eq!(scene.bounds().max.to_array(), [1.25, 1.25, 0.25]);
/// assert!(scene.assembly().contains(glam::DVec3::new(0.0, 1.0, 0.2)));
/// # Ok::<(), voxlathe::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scene {
    model: SceneModel,
    assembly: Assembly,
    reference: Option<Analytic>,
    volume: OnceLock<Option<Integral>>,
    volume_beside_sampling: OnceLock<Option<Integral>>,
    warnings: Vec<String>,
}

impl Scene {
    /// Reads a scene from a file, TOML or (by its ending) JSON; `-` reads TOML from standard input.
    ///
    /// # Errors
    /// [`Error::Scene`] when the file cannot be read or its scene cannot be.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_with(path, &[])
    }

    /// As [`load`](Self::load), with changes as `path=value`.
    ///
    /// # Errors
    /// [`Error::Scene`] when the file cannot be read or its scene cannot be.
    pub fn load_with(path: impl AsRef<Path>, sets: &[String]) -> Result<Self, Error> {
        Self::from_model(super::load_model(path.as_ref(), sets)?)
    }

    /// Reads a scene from TOML text; files of points are relative to the current folder.
    ///
    /// # Errors
    /// [`Error::Scene`] when the scene cannot be.
    pub fn parse(toml: &str) -> Result<Self, Error> {
        Self::from_model(super::parse_model(
            toml,
            super::SceneFormat::Toml,
            "<text>",
            Path::new(""),
            &[],
        )?)
    }

    /// The solid and grid of a scene's data.
    ///
    /// # Errors
    /// [`Error::Scene`] when the curves of a profile bound no region.
    pub fn from_model(model: SceneModel) -> Result<Self, Error> {
        let mut regions: BTreeMap<usize, Arc<Region>> = BTreeMap::new();
        let mut warnings = Vec::new();
        let mut parts = Vec::new();
        for solid in &model.solids {
            let part = match &solid.kind {
                SolidKind::Revolve { profile, turn } => {
                    let (name, data) = &model.profiles[*profile];
                    let region = match regions.entry(*profile) {
                        Entry::Occupied(known) => known.get().clone(),
                        Entry::Vacant(place) => {
                            let region = region(data, &rules(data))
                                .map_err(|e| placed(&model, data, &e, Use::Turned))?;
                            let said = region.warnings().iter();
                            warnings.extend(said.map(|w| format!("profiles.{name}: {w}")));
                            place.insert(Arc::new(region)).clone()
                        }
                    };
                    turned(&model, solid, region, *turn)?
                }
                SolidKind::Round { shape, turn } => {
                    turned(&model, solid, round(&model, solid, *shape)?, *turn)?
                }
                SolidKind::Ellipsoid { radii } => {
                    // It is its own mirror image.
                    let frame = placing(&model, solid)?.frame;
                    let made = Ellipsoid::new(&frame, DVec3::from(*radii));
                    let body = made.ok_or_else(|| unmade(&model, solid))?;
                    Part::new(solid.name.clone(), solid.material, Body::Ellipsoid(body))
                }
                SolidKind::Volume(volume) => {
                    let notes = volume.notes.iter();
                    warnings.extend(notes.map(|n| format!("{}: {n}", solid.path)));
                    let part = nets::part(&model, solid, volume, &mut warnings)?;
                    if let Body::Patches(patches) = &**part.body()
                        && let Some(([first, later], [x, y, z])) =
                            patches.overlap().map(|(pair, at)| (pair, at.to_array()))
                    {
                        let place = format!("both hold [{x}, {y}, {z}]");
                        let found = if first == later {
                            format!("patch {first}, which overlaps itself: parts of it {place}")
                        } else {
                            format!("patches {first} and {later}, which {place}")
                        };
                        let wanted =
                            "patches that touch at most; what overlaps goes into solids of its own";
                        let fault =
                            model.error(solid.place, &solid.path, Some(found), wanted, None);
                        return Err(fault.into());
                    }
                    part
                }
                SolidKind::Box { size } => {
                    let frame = placing(&model, solid)?.frame;
                    let body = Body::Block(Block::new(&frame, DVec3::from(*size)));
                    Part::new(solid.name.clone(), solid.material, body)
                }
            };
            check_size(&model, solid, &part)?;
            parts.push(part.with_operation(match solid.operation {
                model::Operation::Add => Operation::Add,
                model::Operation::Subtract => Operation::Subtract,
                model::Operation::Intersect => Operation::Intersect,
            }));
        }
        let reference = model.reference.as_ref().map(|r| {
            let frame = frame(&model, &r.axis, &r.steps, "reference")?.frame;
            Ok::<_, Error>(Analytic::new(r.shape, frame))
        });
        Ok(Self {
            assembly: Assembly::new(parts),
            reference: reference.transpose()?,
            volume: OnceLock::new(),
            volume_beside_sampling: OnceLock::new(),
            model,
            warnings,
        })
    }

    /// The curves of each part's profile, in the order in which the scene numbers them; `None` of a part that has none.
    pub(crate) fn profile_curves(&self) -> Vec<Option<Arc<CurveLocator>>> {
        let mut made: BTreeMap<usize, Arc<CurveLocator>> = BTreeMap::new();
        let solids = self.model.solids.iter();
        solids
            .map(|solid| match &solid.kind {
                SolidKind::Revolve { profile, .. } => {
                    let locator = made.entry(*profile).or_insert_with(|| {
                        let all = loops(&self.model.profiles[*profile].1).concat();
                        let curves: Vec<ProfileCurve> = all.iter().map(curve).collect();
                        Arc::new(CurveLocator::new(&curves))
                    });
                    Some(Arc::clone(locator))
                }
                _ => None,
            })
            .collect()
    }

    /// The scene's data.
    #[must_use]
    pub fn model(&self) -> &SceneModel {
        &self.model
    }

    /// The scene's data, to change its grid or output.
    pub fn model_mut(&mut self) -> (&mut model::GridModel, &mut model::OutputModel) {
        (&mut self.model.grid, &mut self.model.output)
    }

    /// The scene's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.model.name
    }

    /// The solid.
    #[must_use]
    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }

    /// The closed form that the scene names to be compared with.
    #[must_use]
    pub fn reference(&self) -> Option<&Analytic> {
        self.reference.as_ref()
    }

    /// The smallest box around the added solids, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.assembly.bounds()
    }

    /// What a user should know about the scene.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What a user should know of a grid: that it holds none, or not all, of the solid.
    ///
    /// ```
    /// let scene = voxlathe::Scene::parse("
    ///     schema = 1
    ///     grid = { bounds = [[0, 0, 0], [2, 1, 1]], resolution = 8 }
    ///     solid = [{ kind = 'sphere', radius = 1 }]
    /// ")?;
    /// let warning = scene.grid_warning(&scene.grid()?).expect("seven eighths are outside");
    /// assert!(warning.starts_with("the grid does not hold all of the solid"));
    /// # Ok::<(), voxlathe::Error>(())
    /// ```
    #[must_use]
    pub fn grid_warning(&self, grid: &GridSpec) -> Option<String> {
        super::window::warning(self.assembly.parts(), grid)
    }

    /// The volume of the composite in cubed scene units with an estimate of its error, computed once; `None` where
    /// its surfaces meet so often, or so nearly, that it would take minutes.
    #[must_use]
    pub fn exact_volume(&self) -> Option<Integral> {
        let volume = || Some(self.assembly.moments()?.volume);
        *self.volume.get_or_init(volume)
    }

    /// The same within the work that a run that samples waits for, computed once. The work is counted, not timed:
    /// equal scenes have equal answers.
    #[must_use]
    pub fn volume_beside_sampling(&self) -> Option<Integral> {
        let volume = || Self::volume_of(&self.assembly);
        *self.volume_beside_sampling.get_or_init(volume)
    }

    /// The volume of a composite within that work.
    #[must_use]
    pub fn volume_of(assembly: &Assembly) -> Option<Integral> {
        let volume = assembly.moments_within(BESIDE_SAMPLING)?.volume;
        // Where the work ended before the estimates were good.
        let known = volume.error <= POOR * volume.value || volume.value == 0.0;
        known.then_some(volume)
    }

    /// The area of the composite's whole boundary in squared scene units, within the same work.
    #[must_use]
    pub fn area_beside_sampling(&self) -> Option<Integral> {
        let area = self.assembly.moments_within(BESIDE_SAMPLING)?.area;
        let known = area.error <= POOR * area.value || area.value == 0.0;
        known.then_some(area)
    }

    /// Whether nothing is left of the solids, as far as that is known.
    #[must_use]
    pub fn is_known_empty(&self) -> bool {
        self.assembly.is_empty()
            || self
                .volume_beside_sampling()
                .is_some_and(|v| v.value == 0.0)
    }

    /// Volume, area, centroid, inertia and bounds of the whole solid in scene units, with estimates
    /// of their errors; `None` where so many solids meet that it would take minutes. Each solid has
    /// its own as [`Part::measures`](crate::solid::Part::measures).
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// let scene = voxlathe::Scene::parse(r#"
    ///     schema = 1
    ///     [profiles.ring]
    ///     curves = [{ kind = "circle", center = [1, 0], radius = 0.25 }]
    ///     [[solid]]
    ///     kind = "revolve"
    ///     profile = "ring"
    ///     angle = 180
    /// "#)?;
    /// let found = scene.measures().expect("one solid");
    /// let volume = PI * PI * 0.25 * 0.25;
    /// assert!((found.volume - volume).abs() <= found.error_estimate.volume + 1e-15 * volume);
    /// // The turned surface and two caps.
    /// let area = 2.0 * PI * PI * 0.25 + 2.0 * PI * 0.25 * 0.25;
    /// assert!((found.area - area).abs() <= 1e-14 * area);
    /// let centroid = found.centroid.expect("it is not empty");
    /// assert!((centroid.y - 2.0 / PI * (1.0 + 0.25 * 0.25 / 4.0)).abs() <= 1e-14);
    /// assert_eq!(scene.assembly().parts()[0].measures(), found);
    /// # Ok::<(), voxlathe::Error>(())
    /// ```
    #[must_use]
    pub fn measures(&self) -> Option<Measures> {
        self.assembly.measures()
    }

    /// A solid as trivariate NURBS whose images make it up, in scene coordinates.
    ///
    /// Volumes have their own, rounded once into their place. Cylinder, cone, sphere, torus, ellipsoid
    /// and box have an exact form, and so has what is revolved from one chain to the axis along which z
    /// never turns back.
    ///
    /// * `index`: that of the solid in [`SceneModel::solids`].
    ///
    /// # Errors
    /// [`Error::Scene`] when the solid has no such form, or there is no such solid.
    ///
    /// ```
    /// let scene = voxlathe::Scene::parse(r#"
    ///     schema = 1
    ///     [[solid]]
    ///     kind = "torus"
    ///     major = 3
    ///     minor = 1
    ///     place = [{ translate = [0, 0, 5] }]
    /// "#)?;
    /// let volumes = scene.volumes(0)?;
    /// assert_eq!(volumes[0].degrees(), [2, 2, 2]);
    /// let [x, y, z] = volumes[0].evaluate([0.5, 0.5, 0.25])?; // the middle of the tube, a quarter round
    /// assert!(x.abs() + (y - 3.0).abs() + (z - 5.0).abs() < 1e-14);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn volumes(&self, index: usize) -> Result<Vec<NurbsVolume>, Error> {
        let solid = self.model.solids.get(index);
        let Some((solid, part)) = solid.zip(self.assembly.parts().get(index)) else {
            let place = self
                .model
                .solids
                .first()
                .map_or(self.model.grid.place, |s| s.place);
            let found = Some(format!("no solid of index {index}"));
            let wanted = format!("an index below {}", self.model.solids.len());
            return Err(self
                .model
                .error(place, "solid", found, &wanted, None)
                .into());
        };
        export::volumes(&self.model, solid, part.body())
    }

    /// BLAKE3 of the resolved scene, in hexadecimal.
    ///
    /// # Panics
    /// Never: a digest takes whatever is written to it.
    #[must_use]
    pub fn hash(&self) -> String {
        let mut digest = std::io::BufWriter::new(blake3::Hasher::new());
        let written = (self.model.write_resolved(&mut digest)).and_then(|()| digest.flush());
        written.expect("a digest takes all");
        digest.get_ref().finalize().to_hex().to_string()
    }

    /// The grid that the scene asks for.
    ///
    /// # Errors
    /// [`Error::Scene`] when there would be too many voxels, or too small ones.
    pub fn grid(&self) -> Result<GridSpec, Error> {
        self.grid_within().map_err(|e| {
            let wanted = "a grid that can be numbered";
            self.model
                .error(
                    self.model.grid.place,
                    "grid",
                    Some(e.to_string()),
                    wanted,
                    Some("lower the resolution or change the bounds".into()),
                )
                .into()
        })
    }

    fn grid_within(&self) -> Result<GridSpec, GridError> {
        let asked = &self.model.grid;
        let (bounds, padding) = match asked.bounds {
            Some([min, max]) => (
                Aabb {
                    min: DVec3::from(min),
                    max: DVec3::from(max),
                },
                0,
            ),
            None => (self.bounds(), asked.padding),
        };
        let sides = bounds.sides();
        let spacing = match asked.step {
            GridStep::Verbatim {
                origin,
                spacing,
                dims,
            } => {
                return GridSpec::new(
                    dims.map(|d| d as usize),
                    DVec3::from(origin),
                    DVec3::from(spacing),
                );
            }
            GridStep::Resolution(n) => DVec3::splat(bounds.longest_side() / f64::from(n)),
            GridStep::Resolutions(n) => sides / DVec3::from(n.map(f64::from)),
            GridStep::Spacing(s) => DVec3::from(s),
        };
        let mut dims = [0_usize; 3];
        let mut origin = DVec3::ZERO;
        for a in 0..3 {
            let count = (sides[a] / spacing[a] - 1e-9).ceil().max(1.0);
            let found = count + 2.0 * f64::from(padding);
            if !(found <= GridSpec::MAX_DIM as f64) {
                return Err(GridError::Dimension {
                    axis: ['x', 'y', 'z'][a],
                    found,
                });
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked just above"
            )]
            {
                dims[a] = found as usize;
            }
            let surplus = count * spacing[a] - sides[a];
            origin[a] = bounds.min[a] - 0.5 * surplus - f64::from(padding) * spacing[a];
        }
        GridSpec::new(dims, origin, spacing)
    }

    /// The half width of the narrow band in scene units, where the scene asks for one.
    #[must_use]
    pub fn band(&self, grid: &GridSpec) -> Option<f64> {
        self.model
            .output
            .band
            .map(|voxels| voxels * grid.spacing().max_element())
    }
}

/// The loops of a profile: the chain first, where there is one.
pub(super) fn loops(profile: &ProfileModel) -> Vec<&[CurveModel]> {
    profile
        .curves
        .iter()
        .chain(&profile.loops)
        .map(Vec::as_slice)
        .collect()
}

/// The region that a profile's curves make by those rules.
pub(super) fn region(profile: &ProfileModel, rules: &Rules) -> Result<Region, RegionError> {
    let loops: Vec<ProfileLoop> = loops(profile)
        .into_iter()
        .map(|l| l.iter().map(curve).collect())
        .collect();
    Region::with_rules(&loops, rules)
}

/// How the curves of a profile become its region.
pub(super) fn rules(profile: &ProfileModel) -> Rules {
    Rules {
        boundary: match profile.boundary {
            model::Boundary::Closed => Boundary::Closed,
            model::Boundary::ToAxis => Boundary::ToAxis,
        },
        fill: match profile.fill {
            model::Fill::EvenOdd => Fill::EvenOdd,
            model::Fill::NonZero => Fill::NonZero,
        },
        gap: profile.gap,
        across: match profile.across {
            model::Across::Refuse => Across::Refuse,
            model::Across::Clip => Across::Clip,
            model::Across::Mirror => Across::Mirror,
        },
    }
}

pub(super) fn curve(curve: &CurveModel) -> ProfileCurve {
    let flat = |points: &[model::PointModel]| points.iter().map(|p| [p.r, p.z]).collect::<Vec<_>>();
    let made = match &curve.kind {
        CurveKind::Nurbs {
            degree,
            points,
            weights,
            knots,
        } => ProfileCurve::Nurbs {
            degree: *degree,
            knots: knots.clone(),
            points: flat(points),
            weights: weights.clone(),
        },
        CurveKind::Bezier { points, weights } => {
            let degree = points.len() - 1;
            let knots = [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat();
            ProfileCurve::Nurbs {
                degree,
                knots,
                points: flat(points),
                weights: weights.clone(),
            }
        }
        CurveKind::Polyline { points } => ProfileCurve::Polyline {
            points: flat(points),
        },
        CurveKind::Arc {
            center,
            radius,
            from,
            to,
        } => ProfileCurve::Arc {
            center: *center,
            radii: [*radius; 2],
            tilt: 0.0,
            from: *from,
            to: *to,
        },
        CurveKind::Circle { center, radius } => ProfileCurve::Arc {
            center: *center,
            radii: [*radius; 2],
            tilt: 0.0,
            from: 0.0,
            to: 360.0,
        },
        CurveKind::Ellipse {
            center,
            radii,
            tilt,
        } => ProfileCurve::Arc {
            center: *center,
            radii: *radii,
            tilt: *tilt,
            from: 0.0,
            to: 360.0,
        },
        CurveKind::Interpolate {
            points,
            degree,
            closed,
            tangents,
        } => ProfileCurve::Interpolate {
            points: flat(points),
            degree: *degree,
            ends: if *closed {
                Ends::Closed
            } else {
                Ends::Open(*tangents)
            },
        },
    };
    if curve.reverse {
        ProfileCurve::Reversed(Box::new(made))
    } else {
        made
    }
}

fn turned(
    model: &SceneModel,
    solid: &SolidModel,
    region: Arc<Region>,
    turn: TurnModel,
) -> Result<Part, Error> {
    let placing = placing(model, solid)?;
    Ok(Part::revolved(
        solid.name.clone(),
        solid.material,
        region,
        &placing.frame,
        placing.turn(turn),
    ))
}

/// The region that makes a round shape when it is turned.
fn round(model: &SceneModel, solid: &SolidModel, shape: Shape) -> Result<Arc<Region>, Error> {
    let region = shapes::region(shape).map_err(|_| unmade(model, solid))?;
    Ok(Arc::new(region))
}

fn unmade(model: &SceneModel, solid: &SolidModel) -> Error {
    let found = Some("sizes that enclose nothing".to_owned());
    let wanted = "sizes that are not too far from each other";
    let error = model.error(solid.place, &solid.path, found, wanted, None);
    error.into()
}

/// Refuses a solid whose size leaves the range in which volumes can be computed.
fn check_size(model: &SceneModel, solid: &SolidModel, part: &Part) -> Result<(), Error> {
    let bounds = part.bounds();
    let size = bounds.longest_side();
    if bounds.min.is_finite()
        && bounds.max.is_finite()
        && size > 0.0
        && (1e-120..1e120).contains(&size)
    {
        return Ok(());
    }
    let found = format!("a solid of size {size:e}");
    let wanted = "a size between 1e-120 and 1e120";
    let hint = "change place.scale or the units".to_owned();
    let error = model.error(solid.place, &solid.path, Some(found), wanted, Some(hint));
    Err(error.into())
}

/// Where something about an axis is.
pub(super) struct Placing {
    /// Its frame, always right-handed.
    pub(super) frame: Similarity,
    /// Whether its y is to be reflected before it is placed: an odd number of mirrors is a rotation of that image.
    pub(super) mirrored: bool,
}

impl Placing {
    /// A turn as it is in the frame.
    pub(super) fn turn(&self, turn: TurnModel) -> Turn {
        let turn = Turn::new(turn.start, turn.angle);
        if self.mirrored { turn.mirrored() } else { turn }
    }
}

/// Where a solid is.
pub(super) fn placing(model: &SceneModel, solid: &SolidModel) -> Result<Placing, Error> {
    frame(model, &solid.axis, &solid.steps, &solid.path)
}

/// The frame of something about an axis, placed.
fn frame(
    model: &SceneModel,
    axis: &AxisModel,
    steps: &[PlaceStep],
    path: &str,
) -> Result<Placing, Error> {
    let direction = DVec3::from(axis.direction);
    let x = axis.x.map_or_else(|| default_x(direction), DVec3::from);
    let refused = |what: &str, wanted: &str| {
        let (path, found) = (format!("{path}.axis"), Some(what.to_owned()));
        Error::from(model.error(axis.place, &path, found, wanted, None))
    };
    let mut frame =
        Similarity::from_axis(DVec3::from(axis.origin), direction, x).ok_or_else(|| {
            refused(
                "directions that span no frame",
                "a direction that is not zero and an x that is not parallel to it",
            )
        })?;
    let mut mirrored = false;
    for step in steps {
        frame = match *step {
            PlaceStep::Scale(s) => frame.scaled(s),
            PlaceStep::Rotate { axis, degrees } => frame
                .rotated(DVec3::from(axis), degrees)
                .ok_or_else(|| refused("a rotation about nothing", "an axis that is not zero"))?,
            PlaceStep::Translate(by) => frame.translated(DVec3::from(by)),
            PlaceStep::Mirror(normal) => {
                mirrored = !mirrored;
                frame
                    .reflected(DVec3::from(normal))
                    .ok_or_else(|| refused("a mirror without a normal", "one that is not zero"))?
            }
        };
    }
    Ok(Placing { frame, mirrored })
}

/// +x, or +y where the axis is within a degree of ±x.
fn default_x(direction: DVec3) -> DVec3 {
    let unit = direction / direction.abs().max_element();
    let sine = unit.y.hypot(unit.z) / unit.length();
    if sine <= 1_f64.to_radians().sin() {
        DVec3::Y
    } else {
        DVec3::X
    }
}
