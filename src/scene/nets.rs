//! From the data of a volume to its NURBS.

use super::build::{Placing, curve, placing};
use super::build::{region, rules};
use super::error::{Place, SceneError};
use super::faults::{Use, placed};
use super::fold::{self, Fold};
use super::limits::{MAX_CELLS, MAX_COEFFICIENTS, MAX_WEIGHT_RATIO};
use super::model::{
    self, CurveForm, PatchModel, ProfileModel, SceneModel, SectionModel, SolidModel, TurnModel,
    VolumeModel, VolumeSource,
};
use crate::construct::{
    AngleInterval, AxisFrame, CircleForm, ConstructError, DiscForm, curve_disc, curve_to_axis,
    meridian, surface_circle,
};
use crate::error::Error;
use crate::math::bernstein;
use crate::math::tolerance::GAP;
use crate::math::{Dd, Real};
use crate::nurbs::{
    CellIndex, JacobianSign, KnotVector, NurbsCurve, NurbsError, NurbsSurface, NurbsVolume,
    OrientationError,
};
use crate::region::{
    Across, Boundary, Fill, HomogeneousPoint, ProfileCurve, ProfileLoop, Region, RegionError,
    Rules, beziers,
};
use crate::solid::{Body, Field, Part, Patches};
use std::sync::Arc;

/// The part that a volume is; what a user should know of it goes to `warnings`.
pub(super) fn part(
    model: &SceneModel,
    solid: &SolidModel,
    volume: &VolumeModel,
    warnings: &mut Vec<String>,
) -> Result<Part, Error> {
    let placing = placing(model, solid)?;
    let maker = Maker { model, solid };
    let (source, notes) = (&volume.source, volume.notes.as_slice());
    let volumes = match source {
        VolumeSource::Patches(patches) => maker.patches(patches)?,
        VolumeSource::Section { section, turn } => vec![maker.section(section, *turn)?],
        VolumeSource::Curve {
            form,
            profile,
            turn,
            union,
        } => {
            let chain = maker.chain(&model.profiles[*profile].1, *union)?;
            if let Some(back) = chain.reversal {
                if !*union {
                    let hint = "fill = \"union\" takes the union of its discs; kind = \"revolve\" what it encloses";
                    return Err(maker.runs_back(back, hint));
                }
                return maker.stack(&placing, &chain, *turn);
            }
            maker.curve(*form, chain, *turn)?
        }
    };
    let volumes = if placing.mirrored {
        let images = volumes.iter().map(mirrored).collect::<Result<_, _>>();
        images.map_err(|e| maker.refused(&e.to_string()))?
    } else {
        volumes
    };
    maker.check_size(&volumes)?;
    for (index, volume) in volumes.iter().enumerate() {
        let (place, key) = match source {
            VolumeSource::Patches(patches) => (patches[index].place, format!(".patches[{index}]")),
            VolumeSource::Section { section, .. } => (section.place, ".section".to_owned()),
            VolumeSource::Curve { .. } => (solid.place, ".profile".to_owned()),
        };
        let rounding = || match source {
            VolumeSource::Section { section, .. } => fold::rounding(section.points.iter()),
            VolumeSource::Patches(patches) => fold::rounding(patches[index].points.iter()),
            VolumeSource::Curve { .. } => fold::rounding(volume.control_points().iter()),
        };
        let said = maker.check(&key, volume, place, rounding);
        warnings.extend(said.map_err(|e| noted(e, notes))?);
    }
    let fields = match source {
        VolumeSource::Patches(patches) => fields(patches, &volumes),
        _ => Ok(Vec::new()),
    };
    let body = fields.and_then(|fields| Patches::new(&placing.frame, volumes, fields));
    let body = body.map_err(|e| maker.refused(&e.to_string()))?;
    if body.faces().faces().is_empty() {
        let key = match source {
            VolumeSource::Patches(_) => ".patches",
            VolumeSource::Section { .. } => ".section",
            VolumeSource::Curve { .. } => ".profile",
        };
        let found = "volumes without a face that bounds them".to_owned();
        return Err(maker.fault(key, found, "volumes that enclose something", None));
    }
    Ok(Part::new(
        solid.name.clone(),
        solid.material,
        Body::Patches(body),
    ))
}

/// An error about nets, with what was assumed when they were read: that may be why.
fn noted(error: Error, notes: &[String]) -> Error {
    match error {
        Error::Scene(SceneError::Input { mut problem }) if !notes.is_empty() => {
            let hints = problem.hint.take().into_iter();
            let hints: Vec<String> = notes.iter().cloned().chain(hints).collect();
            problem.hint = Some(hints.join("; "));
            Error::Scene(SceneError::Input { problem })
        }
        other => other,
    }
}

/// The volumes that a turned profile is, where it is one chain to the axis along which z never turns
/// back.
pub(super) fn revolved(
    model: &SceneModel,
    solid: &SolidModel,
    profile: usize,
    turn: TurnModel,
) -> Result<Vec<NurbsVolume>, Error> {
    let maker = Maker { model, solid };
    let chain = maker.chain(&model.profiles[profile].1, false)?;
    if let Some(back) = chain.reversal {
        return Err(maker.runs_back(back, "`mesh` writes the boundary of every solid"));
    }
    maker.curve(CurveForm::Disc, chain, turn)
}

/// The fields of patches, all of which have the same.
fn fields(patches: &[PatchModel], volumes: &[NurbsVolume]) -> Result<Vec<Field>, NurbsError> {
    let names = patches[0].fields.iter().enumerate();
    let made = names.map(|(index, field)| {
        let values: Vec<&[f64]> = (patches.iter())
            .map(|p| p.fields[index].values.as_slice())
            .collect();
        Field::new(field.name.clone(), volumes, &values)
    });
    made.collect()
}

/// A part of a chain with z monotone: a rational Bézier piece.
#[derive(Debug, Clone)]
struct Piece {
    /// Which curve of the chain it is of.
    curve: usize,
    points: Vec<HomogeneousPoint>,
}

/// The chain of a profile in pieces along which z rises, or is level.
struct Chain {
    pieces: Vec<Piece>,
    /// A piece that runs against those before it, where one does.
    reversal: Option<usize>,
}

impl Piece {
    fn end(&self, at: usize) -> [f64; 2] {
        let [r, z, w] = self.points[at];
        [(r / w).f64(), (z / w).f64()]
    }

    fn ends(&self) -> [[f64; 2]; 2] {
        [self.end(0), self.end(self.points.len() - 1)]
    }

    /// How far z rises along it.
    fn rise(&self) -> f64 {
        let [[_, a], [_, b]] = self.ends();
        b - a
    }

    fn reversed(mut self) -> Self {
        self.points.reverse();
        self
    }

    fn curve(&self) -> Result<NurbsCurve<2>, NurbsError> {
        joined(std::slice::from_ref(self))
    }
}

/// Whether a piece begins with the point and weight with which the last one ends.
fn continues(run: &[Piece], next: &Piece) -> bool {
    let end = run.last().and_then(|piece| piece.points.last());
    end.is_some_and(|end| (end[2] / next.points[0][2] - Dd::ONE).abs().f64() < 1e-12)
}

/// Consecutive pieces of one degree as one curve over [0, their number].
fn joined(pieces: &[Piece]) -> Result<NurbsCurve<2>, NurbsError> {
    let degree = pieces[0].points.len() - 1;
    let (mut knots, mut points, mut weights) = (vec![0.0], Vec::new(), Vec::new());
    for (index, piece) in pieces.iter().enumerate() {
        #[allow(clippy::cast_precision_loss, reason = "a count")]
        knots.extend(vec![index as f64; degree]);
        for (k, [r, z, w]) in piece.points.iter().enumerate() {
            if index > 0 && k == 0 {
                continue;
            }
            points.push([(*r / *w).f64(), (*z / *w).f64()]);
            weights.push(w.f64());
        }
    }
    #[allow(clippy::cast_precision_loss, reason = "a count")]
    knots.extend(vec![pieces.len() as f64; degree + 1]);
    NurbsCurve::new(KnotVector::new(degree, knots)?, points, weights)
}

/// Makes the nets of one solid.
struct Maker<'a> {
    model: &'a SceneModel,
    solid: &'a SolidModel,
}

impl Maker<'_> {
    fn fault(&self, key: &str, found: String, wanted: &str, hint: Option<String>) -> Error {
        let path = format!("{}{key}", self.solid.path);
        let error = self
            .model
            .error(self.solid.place, &path, Some(found), wanted, hint);
        error.into()
    }

    fn refused(&self, reason: &str) -> Error {
        self.fault("", reason.to_owned(), "a volume that can be made", None)
    }

    fn patches(&self, patches: &[PatchModel]) -> Result<Vec<NurbsVolume>, Error> {
        let made = patches.iter().enumerate().map(|(index, patch)| {
            volume_of(patch).map_err(|e| {
                let path = format!("{}.patches[{index}]", self.solid.path);
                let found = Some(e.to_string());
                let error = self
                    .model
                    .error(patch.place, &path, found, "a NURBS volume", None);
                Error::from(error)
            })
        });
        made.collect()
    }

    /// Refuses what would take too much memory.
    fn check_size(&self, volumes: &[NurbsVolume]) -> Result<(), Error> {
        let cells = |v: &NurbsVolume| {
            let spans = v.knots().iter().map(|k| k.spans().count());
            spans.fold(1, usize::saturating_mul)
        };
        let coefficients = |v: &NurbsVolume| {
            let each = v.degrees().into_iter().map(|p| p + 1).product();
            cells(v).saturating_mul(each)
        };
        let total = |of: &dyn Fn(&NurbsVolume) -> usize| {
            volumes.iter().map(of).fold(0, usize::saturating_add)
        };
        let count = total(&cells);
        if count > MAX_CELLS {
            let found = format!("{count} Bézier cells");
            let wanted = format!("at most {MAX_CELLS}: products of the knot spans in u, v and w");
            return Err(self.fault("", found, &wanted, Some("use fewer knots".to_owned())));
        }
        let count = total(&coefficients);
        if count > MAX_COEFFICIENTS {
            let found = format!("{count} Bézier coefficients");
            let wanted = format!(
                "at most {MAX_COEFFICIENTS}: for each cell the product of the degrees plus one"
            );
            let hint = "use lower degrees or fewer knots".to_owned();
            return Err(self.fault("", found, &wanted, Some(hint)));
        }
        Ok(())
    }

    /// Refuses a patch that folds, that is flat, or whose weights are too far apart; else what a user
    /// should know.
    ///
    /// * `rounding`: that of the coordinates it was given by, in their own units.
    fn check(
        &self,
        key: &str,
        volume: &NurbsVolume,
        place: Place,
        rounding: impl FnOnce() -> f64,
    ) -> Result<Option<String>, Error> {
        let path = format!("{}{key}", self.solid.path);
        let refused = |found: String, wanted: &str, hint: &str| {
            let (found, hint) = (Some(found), Some(hint.to_owned()));
            Err(self.model.error(place, &path, found, wanted, hint).into())
        };
        if let Some((cell, [low, high])) = widest_weights(volume)
            && !(high / low <= MAX_WEIGHT_RATIO)
        {
            let found = format!(
                "weights from {low:e} to {high:e}, a ratio of {:.0e}, in Bézier {cell}",
                high / low
            );
            let wanted = format!("a ratio of at most {MAX_WEIGHT_RATIO:e} in each cell");
            let hint = "insert knots where the weights change, or bring them nearer to each other";
            return refused(found, &wanted, hint);
        }
        let Err(error) = volume.orientation() else {
            return Ok(None);
        };
        match error {
            OrientationError::Folded {
                positive,
                negative,
                cells,
            } => {
                let fold = Fold::new(volume, [positive, negative], cells);
                if fold.is_rounding(rounding) {
                    return Ok(Some(format!(
                        "{path}: folds over itself by the rounding of its control points, a share of {:.0e}, at parameters {negative:?} for one: taken as if it did not",
                        fold.share()
                    )));
                }
                refused(
                    error.to_string(),
                    "a Jacobian determinant of one sign",
                    "split the patch where it folds, or move its control points",
                )
            }
            OrientationError::Nurbs(_) => refused(
                error.to_string(),
                "a Jacobian determinant of one sign",
                "split the patch where it folds, or move its control points",
            ),
            OrientationError::Flat { .. } => {
                let flat = |sign: &JacobianSign| matches!(sign, JacobianSign::Flat);
                let signs = volume.jacobian_signs().unwrap_or_default();
                if signs.iter().all(|(sign, _)| flat(sign)) {
                    return refused(
                        "a volume that is flat: its Jacobian determinant is zero throughout".into(),
                        "a patch that fills space",
                        "move its control points out of the surface they are in, or leave it out",
                    );
                }
                // A cell without volume adds nothing.
                Ok(None)
            }
            // What could not be settled is not known to fold.
            _ => Ok(Some(format!(
                "{path}: not proved one to one: {error}; where it folds, answers may be wrong"
            ))),
        }
    }

    fn section(&self, section: &SectionModel, turn: TurnModel) -> Result<NurbsVolume, Error> {
        let made = || -> Result<NurbsVolume, ConstructError> {
            let [u, v] =
                [0, 1].map(|k| KnotVector::new(section.degrees[k], section.knots[k].clone()));
            let points = section.points.iter().map(|[r, z]| [*r, 0.0, *z]);
            let surface = NurbsSurface::new([u?, v?], points.collect(), section.weights.clone())?;
            let turn = AngleInterval::new(turn.start, turn.angle)?;
            surface_circle(&surface, CircleForm::Quadratic, turn, &AxisFrame::WORLD)
        };
        made().map_err(|e| {
            let path = format!("{}.section", self.solid.path);
            let found = Some(e.to_string());
            let wanted = "a planar surface that can be turned";
            let error = self.model.error(section.place, &path, found, wanted, None);
            error.into()
        })
    }

    /// The chain of a profile, in pieces, its gaps closed.
    ///
    /// * `union`: its discs are asked for, which may have an area where the profile has none.
    fn chain(&self, profile: &ProfileModel, union: bool) -> Result<Chain, Error> {
        let wanted = "a profile with boundary = \"to-axis\" and one chain, `curves`";
        let found = match (&profile.curves, profile.boundary) {
            (Some(_), model::Boundary::ToAxis) if profile.loops.is_empty() => None,
            (_, model::Boundary::Closed) => Some("a profile with boundary = \"closed\""),
            _ => Some("a profile with loops"),
        };
        if let Some(found) = found {
            return Err(self.fault(".profile", found.to_owned(), wanted, None));
        }
        // What is refused when it is turned as a profile is refused here.
        let upright = Rules {
            across: Across::Refuse,
            ..rules(profile)
        };
        match region(profile, &upright) {
            Ok(_) => {}
            Err(RegionError::NoArea) if union => {}
            Err(RegionError::NoArea) => return Err(self.encloses_nothing()),
            Err(RegionError::Tangle { .. }) => {}
            Err(error) => return Err(placed(self.model, profile, &error, Use::Volume).into()),
        }
        let mut pieces = Vec::new();
        for (index, one) in profile.curves.iter().flatten().enumerate() {
            let found = beziers(&curve(one)).map_err(|reason| {
                let found = Some(format!("a curve that {reason}"));
                let wanted = "a curve that can be drawn";
                Error::from(self.model.error(one.place, &one.path, found, wanted, None))
            })?;
            for bezier in found {
                split_at_extrema(index, bezier.points, &mut pieces);
            }
        }
        let mut pieces = without_gaps(pieces);
        let rises: Vec<f64> = pieces.iter().map(Piece::rise).collect();
        let first = rises
            .iter()
            .copied()
            .find(|r| *r != 0.0)
            .unwrap_or_default();
        let reversal = rises.iter().position(|r| r * first < 0.0);
        if first < 0.0 && reversal.is_none() {
            pieces.reverse();
            pieces = pieces.into_iter().map(Piece::reversed).collect();
        }
        Ok(Chain { pieces, reversal })
    }

    fn encloses_nothing(&self) -> Error {
        let found = "a chain that encloses no volume with the axis".to_owned();
        self.fault(
            ".profile",
            found,
            "a chain along which z rises, or falls, off the axis",
            None,
        )
    }

    fn runs_back(&self, piece: usize, hint: &str) -> Error {
        let found = format!("a chain that runs back along the axis, at its monotone part {piece}");
        let wanted = "a chain along which z rises, or falls, all the way";
        self.fault(".profile", found, wanted, Some(hint.to_owned()))
    }

    /// The volumes of a chain that rises: one for each run of pieces of one curve, split where discs
    /// of different radii meet so that each face has one neighbour.
    fn curve(
        &self,
        form: CurveForm,
        chain: Chain,
        turn: TurnModel,
    ) -> Result<Vec<NurbsVolume>, Error> {
        let mut runs: Vec<Vec<Piece>> = Vec::new();
        let mut broken = true;
        for piece in chain.pieces {
            // What is level or on the axis has nothing beneath it.
            if piece.rise() == 0.0 || piece.points.iter().all(|p| p[0] == Dd::ZERO) {
                broken = true;
                continue;
            }
            match runs.last_mut() {
                Some(run)
                    if !broken
                        && run[0].curve == piece.curve
                        && run[0].points.len() == piece.points.len()
                        && continues(run, &piece) =>
                {
                    run.push(piece);
                }
                _ => runs.push(vec![piece]),
            }
            broken = false;
        }
        if runs.is_empty() {
            return Err(self.encloses_nothing());
        }
        let radii: Vec<[f64; 2]> = runs
            .iter()
            .map(|run| [run[0].ends()[0][0], run[run.len() - 1].ends()[1][0]])
            .collect();
        let splits = splits(&radii);
        let made = || -> Result<Vec<NurbsVolume>, ConstructError> {
            let angle = AngleInterval::new(turn.start, turn.angle)?;
            // The disc of a full turn has no direction.
            let full = AngleInterval::new(turn.start, 360.0)?;
            let stepped = splits.iter().any(|s| !s.is_empty());
            let regular = form == CurveForm::Disc && angle.is_full() && !stepped;
            let volumes = runs.iter().zip(&splits).map(|(run, splits)| {
                let curve = meridian(&joined(run)?)?;
                let world = &AxisFrame::WORLD;
                if regular {
                    return curve_disc(&curve, DiscForm::Biquadratic, full, world);
                }
                // The polar disc makes of a what c is.
                let whole = curve_to_axis(&curve, CircleForm::Quadratic, angle, world)?;
                Ok(whole.refine(1, splits)?)
            });
            volumes.collect()
        };
        made().map_err(|e| {
            self.fault(
                ".profile",
                e.to_string(),
                "a chain that can be turned",
                None,
            )
        })
    }

    /// The union of the discs of a chain that runs back: every piece with the axis is a loop of one
    /// direction.
    fn stack(&self, placing: &Placing, chain: &Chain, turn: TurnModel) -> Result<Part, Error> {
        let made = || -> Result<Region, String> {
            let mut loops: Vec<ProfileLoop> = Vec::new();
            for piece in chain.pieces.iter().filter(|p| p.rise() != 0.0) {
                let piece = if piece.rise() > 0.0 {
                    piece.clone()
                } else {
                    piece.clone().reversed()
                };
                let curve = piece.curve().map_err(|e| e.to_string())?;
                let [[r0, z0], [r1, z1]] = piece.ends();
                let mut back = vec![[r1, z1], [0.0, z1], [0.0, z0], [r0, z0]];
                back.dedup();
                loops.push(vec![
                    ProfileCurve::Nurbs {
                        degree: curve.degree(),
                        knots: curve.knots().knots().to_vec(),
                        points: curve.control_points().to_vec(),
                        weights: curve.weights().to_vec(),
                    },
                    ProfileCurve::Polyline { points: back },
                ]);
            }
            Region::new(&loops, Boundary::Closed, Fill::NonZero).map_err(|e| e.to_string())
        };
        let region = made()
            .map_err(|e| self.fault(".profile", e, "a chain whose discs can be joined", None))?;
        Ok(Part::revolved(
            self.solid.name.clone(),
            self.solid.material,
            Arc::new(region),
            &placing.frame,
            placing.turn(turn),
        ))
    }
}

/// The Bézier cell whose weights are furthest apart, with the least and the largest of them; `None`
/// where all weights of the net are near enough to each other.
fn widest_weights(volume: &NurbsVolume) -> Option<(CellIndex, [f64; 2])> {
    let ends = |weights: &mut dyn Iterator<Item = f64>| {
        weights.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], w| {
            [low.min(w), high.max(w)]
        })
    };
    // Those of cells are means of the net's.
    let [low, high] = ends(&mut volume.weights().iter().copied());
    if high / low <= MAX_WEIGHT_RATIO {
        return None;
    }
    let spans = volume.knots().each_ref().map(|k| k.spans().count());
    let pieces = volume.to_bezier().ok()?;
    let each = pieces.iter().enumerate().map(|(number, piece)| {
        let [a, b, _] = spans;
        let spans = [number % a, number / a % b, number / (a * b)];
        let points = piece.cell.control_points().iter();
        let ends = ends(&mut points.map(|h| h.weight));
        (CellIndex { number, spans }, ends)
    });
    let ratio = |[low, high]: [f64; 2]| high / low;
    each.max_by(|a, b| ratio(a.1).total_cmp(&ratio(b.1)))
}

/// The image under y -> -y, with the same parameters.
pub(super) fn mirrored(volume: &NurbsVolume) -> Result<NurbsVolume, NurbsError> {
    let points = volume.control_points().iter();
    // Not -y, which makes -0 of 0.
    let image = points.map(|&[x, y, z]| [x, 0.0 - y, z]);
    NurbsVolume::new(
        volume.knots().clone(),
        image.collect(),
        volume.weights().to_vec(),
    )
}

/// The NURBS of a patch.
fn volume_of(patch: &PatchModel) -> Result<NurbsVolume, NurbsError> {
    let [u, v, w] = [0, 1, 2].map(|k| KnotVector::new(patch.degrees[k], patch.knots[k].clone()));
    NurbsVolume::new([u?, v?, w?], patch.points.clone(), patch.weights.clone())
}

/// Pieces that meet end to end: a gap is closed by a segment.
///
/// A segment too low to have faces of its own, or one that runs back by no more than rounding, is left out: there the next
/// piece begins at the height at which the last one ends.
fn without_gaps(pieces: Vec<Piece>) -> Vec<Piece> {
    /// Share of the size below which two faces are nearly one.
    const THIN: f64 = 1e-11;
    let ends = || pieces.iter().flat_map(Piece::ends);
    let size = (0..2).fold(0.0_f64, |m, k| {
        let low = ends().fold(f64::INFINITY, |m, p| m.min(p[k]));
        let high = ends().fold(f64::NEG_INFINITY, |m, p| m.max(p[k]));
        m.max(high - low)
    });
    let direction = match (pieces.first(), pieces.last()) {
        (Some(first), Some(last)) => last.ends()[1][1] - first.ends()[0][1],
        _ => 0.0,
    };
    let mut closed: Vec<Piece> = Vec::with_capacity(pieces.len());
    for mut piece in pieces {
        for end in [0, piece.points.len() - 1] {
            // Below the axis by a rounding counts as on it.
            let r = &mut piece.points[end][0];
            *r = if *r < Dd::ZERO { Dd::ZERO } else { *r };
        }
        if let Some(last) = closed.last() {
            let at = |[r, z, w]: HomogeneousPoint| [r / w, z / w];
            let (from, to) = (at(last.points[last.points.len() - 1]), at(piece.points[0]));
            let [across, along] = [0, 1].map(|k| (to[k] - from[k]).f64());
            if along.abs() > THIN * size && along * direction > 0.0 || along.abs() > GAP * size {
                closed.push(Piece {
                    // Of no curve.
                    curve: usize::MAX,
                    points: [from, to].map(|[r, z]| [r, z, Dd::ONE]).to_vec(),
                });
            } else {
                let [r, z, w] = &mut piece.points[0];
                *z = from[1] * *w;
                if across.abs() <= THIN * size {
                    *r = from[0] * *w;
                }
            }
        }
        closed.push(piece);
    }
    closed
}

/// Cuts a piece where z turns.
fn split_at_extrema(curve: usize, points: Vec<HomogeneousPoint>, out: &mut Vec<Piece>) {
    let column = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<Dd>>();
    let [r, z, w] = [column(0), column(1), column(2)];
    let turning = bernstein::quotient_derivative(&z, &w);
    let scale = bernstein::magnitude(&z) * bernstein::magnitude(&w);
    let mut cuts = bernstein::sign_change_parameters(&turning, scale);
    cuts.retain(|t| *t > Dd::ZERO && *t < Dd::ONE);
    let mut from = Dd::ZERO;
    cuts.push(Dd::ONE);
    for to in cuts {
        let part = |c: &[Dd]| bernstein::restrict(c, from, to);
        let [r, z, w] = [part(&r), part(&z), part(&w)];
        let points = (0..r.len()).map(|i| [r[i], z[i], w[i]]);
        out.push(Piece {
            curve,
            points: points.collect(),
        });
        from = to;
    }
}

/// Shares of the radius at which volumes between the radii `[bottom, top]` are split, so that where
/// one ends and the next begins, or goes on at another radius, discs and rings match.
fn splits(radii: &[[f64; 2]]) -> Vec<Vec<f64>> {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.max(b);
    let mut splits: Vec<Vec<f64>> = vec![Vec::new(); radii.len()];
    let mut add = |volume: usize, share: f64| {
        let known = splits[volume].iter().any(|&s| close(s, share));
        if share > 1e-12 && share < 1.0 - 1e-12 && !known {
            splits[volume].push(share);
        }
    };
    for joint in 1..radii.len() {
        let (below, above) = (radii[joint - 1][1], radii[joint][0]);
        if close(below, above) {
            continue;
        }
        let edge = below.min(above);
        // The line goes up and down from here as far as there is volume around it.
        let mut share = edge / above;
        for volume in joint..radii.len() {
            add(volume, share);
            let Some(next) = radii.get(volume + 1) else {
                break;
            };
            share = share * radii[volume][1] / next[0];
            if !(share < 1.0 - 1e-12) {
                break;
            }
        }
        let mut share = edge / below;
        for volume in (0..joint).rev() {
            add(volume, share);
            if volume == 0 {
                break;
            }
            share = share * radii[volume][0] / radii[volume - 1][1];
            if !(share < 1.0 - 1e-12) {
                break;
            }
        }
    }
    for list in &mut splits {
        list.sort_by(f64::total_cmp);
    }
    splits
}
