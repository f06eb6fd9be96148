//! MFEM NURBS meshes written: patches with Cartesian points, and the topology that joins them.
//!
//! Patches share vertices, edges and faces where a whole side of one is a side of another: the same
//! control points, weights and knots bit for bit, however turned. The topology of the format names edges
//! and faces by their vertices, so it cannot tell two edges between the same two vertices apart, as in a
//! ring of one or two patches. Where joining would lead there, all patches are written apart: the
//! geometry is the same, and MFEM then sees pieces that touch without being connected.
//!
//! ```text
//!   sides that fit ──> vertices, one for each set of corners joined
//!                  ──> edges, the four along one parameter of a patch with one knot vector
//!                  ──> boundary, the sides that fit no other
//! ```
//!
//! * Limits: knot vectors that are not clamped are refused, for corners must be points of the patch.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::spline::{common_kind, nets};
use super::{ExchangeError, Format, Net, Place, number};

/// The text of splines, which must all be curves, all surfaces or all volumes.
///
/// # Errors
/// [`ExchangeError::Unwritable`] where kinds are mixed, there is nothing, or a knot vector is not clamped.
///
/// ```
/// # use voxlathe::exchange::{Spline, mfem};
/// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
/// let knots = || KnotVector::bezier(1);
/// let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
/// let patch = NurbsSurface::new([knots()?, knots()?], points, vec![1.0; 4])?;
/// let text = mfem::write(std::slice::from_ref(&patch))?;
/// assert_eq!(mfem::read(&text)?.splines, [Spline::Surface(patch)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write<'a, T>(splines: &'a [T]) -> Result<String, ExchangeError>
where
    Net<'a>: From<&'a T>,
{
    let nets = nets(splines);
    common_kind(&nets, Format::Mfem)?;
    for (index, net) in nets.iter().enumerate() {
        if net.knots().iter().any(|knots| !knots.is_clamped()) {
            return Err(ExchangeError::Unwritable {
                place: Place::Spline(index),
                format: Format::Mfem,
                what: "its knot vectors are not all clamped; clamp them first".into(),
            });
        }
    }
    let mesh = Mesh::joined(&nets).unwrap_or_else(|| Mesh::apart(&nets));
    let mut out = mesh.text();
    out.push_str("\npatches\n");
    for net in &nets {
        write_patch(&mut out, net);
    }
    Ok(out)
}

fn write_patch(out: &mut String, net: &Net<'_>) {
    // Writing into a string cannot fail.
    let _ = writeln!(out, "\nknotvectors\n{}", net.knots().len());
    for knots in net.knots() {
        let values = number::row(knots.knots().iter().copied());
        let _ = writeln!(
            out,
            "{} {} {values}",
            knots.degree(),
            knots.control_points()
        );
    }
    out.push_str("\ndimension\n3\n\ncontrolpoints_cartesian\n");
    for (point, &weight) in net.points().iter().zip(net.weights()) {
        let _ = writeln!(
            out,
            "{}",
            number::row(point.iter().copied().chain([weight]))
        );
    }
}

/// Corners of an element of 1, 2 or 3 parameters as ends along the parameters, in MFEM's order.
fn corners(parameters: usize) -> Vec<Vec<bool>> {
    let ring = [[false, false], [true, false], [true, true], [false, true]];
    match parameters {
        1 => vec![vec![false], vec![true]],
        2 => ring.iter().map(|c| c.to_vec()).collect(),
        _ => [false, true]
            .iter()
            .flat_map(|&top| ring.iter().map(move |c| vec![c[0], c[1], top]))
            .collect(),
    }
}

/// The sides of an element by its corners, in MFEM's order.
fn sides(parameters: usize) -> &'static [&'static [usize]] {
    match parameters {
        1 => &[&[0], &[1]],
        2 => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        _ => &[
            &[3, 2, 1, 0],
            &[0, 1, 5, 4],
            &[1, 2, 6, 5],
            &[2, 3, 7, 6],
            &[3, 0, 4, 7],
            &[4, 5, 6, 7],
        ],
    }
}

/// Everything along a walk over a part of a net, as bits: counts, knots, points and weights.
type Print = Vec<u64>;

/// A control net walked from a corner.
///
/// * `start`: the corner, as ends along the parameters.
/// * `order`: the parameters walked, the fastest first; each away from the corner.
///
/// Nothing where a knot vector cannot be reversed.
fn print(net: &Net<'_>, start: &[bool], order: &[usize]) -> Option<Print> {
    let counts = net.counts();
    let mut out = Print::new();
    for &d in order {
        let knots = net.knots()[d];
        let reversed = if start[d] {
            Some(knots.reversed().ok()?)
        } else {
            None
        };
        let knots = reversed.as_ref().unwrap_or(knots);
        out.push(u64::try_from(counts[d]).ok()?);
        // Adding zero makes the two zeros one.
        out.extend(knots.knots().iter().map(|x| (x + 0.0).to_bits()));
    }
    let stride = |d: usize| counts[..d].iter().product::<usize>();
    let total = order.iter().map(|&d| counts[d]).product::<usize>();
    let base: usize = (0..counts.len())
        .map(|d| {
            if start[d] {
                (counts[d] - 1) * stride(d)
            } else {
                0
            }
        })
        .sum();
    for step in 0..total {
        let (mut rest, mut at) = (step, base);
        for &d in order {
            let moved = rest % counts[d] * stride(d);
            at = if start[d] { at - moved } else { at + moved };
            rest /= counts[d];
        }
        out.extend(net.points()[at].map(|x| (x + 0.0).to_bits()));
        out.push(net.weights()[at].to_bits());
    }
    Some(out)
}

/// A mesh's topology.
#[derive(Debug)]
struct Mesh {
    parameters: usize,
    /// For each patch its corners.
    vertices: Vec<Vec<usize>>,
    /// How many vertices.
    count: usize,
    /// Knot vector, first and last vertex.
    edges: Vec<[usize; 3]>,
    boundary: Vec<Vec<usize>>,
}

impl Mesh {
    /// No patch shares anything.
    fn apart(nets: &[Net<'_>]) -> Self {
        let parameters = nets.first().map_or(1, |net| net.knots().len());
        let corners = 1 << parameters;
        let ids = (0..nets.len()).map(|p| (p * corners..(p + 1) * corners).collect());
        let vertices: Vec<Vec<usize>> = ids.collect();
        let mut mesh = Self {
            parameters,
            count: nets.len() * corners,
            vertices,
            edges: Vec::new(),
            boundary: Vec::new(),
        };
        // Without anything shared there is nothing to contradict.
        mesh.edges = mesh.find_edges().unwrap_or_default();
        mesh.boundary = mesh.find_boundary().unwrap_or_default();
        mesh
    }

    /// Sides that fit are shared; nothing where the format cannot say so.
    fn joined(nets: &[Net<'_>]) -> Option<Self> {
        let parameters = nets.first()?.knots().len();
        let mut sets = Sets::new(nets.len() << parameters);
        for pair in fitting_sides(nets, parameters)? {
            for (a, b) in pair {
                sets.join(a, b);
            }
        }
        let mut names = HashMap::new();
        let vertices = (0..nets.len()).map(|p| {
            let ids = (0..1 << parameters).map(|c| {
                let root = sets.root((p << parameters) + c);
                let next = names.len();
                *names.entry(root).or_insert(next)
            });
            ids.collect::<Vec<_>>()
        });
        let vertices: Vec<_> = vertices.collect();
        let mut mesh = Self {
            parameters,
            vertices,
            count: names.len(),
            edges: Vec::new(),
            boundary: Vec::new(),
        };
        mesh.agrees_with(nets)?;
        mesh.edges = mesh.find_edges()?;
        mesh.boundary = mesh.find_boundary()?;
        Some(mesh)
    }

    /// Corners of an element differ, and edges and sides of the same vertices are the same.
    fn agrees_with(&self, nets: &[Net<'_>]) -> Option<()> {
        let corners = corners(self.parameters);
        let mut prints: HashMap<Vec<usize>, Print> = HashMap::new();
        for (net, ids) in nets.iter().zip(&self.vertices) {
            let mut seen = ids.clone();
            seen.sort_unstable();
            seen.dedup();
            if seen.len() != ids.len() {
                return None;
            }
            let mut parts: Vec<Vec<usize>> = self.element_edges().concat();
            if self.parameters == 3 {
                parts.extend(sides(3).iter().map(|side| side.to_vec()));
            }
            for part in parts {
                // Walk from the vertex of the lowest number to the lower of its neighbours first.
                let n = part.len();
                let lowest = (0..n).min_by_key(|&i| ids[part[i]])?;
                let mut ways = match n {
                    2 => vec![part[1 - lowest]],
                    _ => vec![part[(lowest + 1) % n], part[(lowest + n - 1) % n]],
                };
                ways.sort_by_key(|&c| ids[c]);
                let start = &corners[part[lowest]];
                let order: Option<Vec<_>> = (ways.iter())
                    .map(|&c| (0..start.len()).find(|&d| start[d] != corners[c][d]))
                    .collect();
                let own = print(net, start, &order?)?;
                let mut key: Vec<_> = part.iter().map(|&c| ids[c]).collect();
                key.sort_unstable();
                match prints.get(&key) {
                    Some(other) if *other != own => return None,
                    Some(_) => {}
                    None => {
                        prints.insert(key, own);
                    }
                }
            }
        }
        Some(())
    }

    /// For each parameter, the edges along it: corners, the low end first.
    fn element_edges(&self) -> Vec<Vec<Vec<usize>>> {
        let corners = corners(self.parameters);
        let along = |d: usize| {
            let lows = (0..corners.len()).filter(|&c| !corners[c][d]);
            lows.filter_map(|low| {
                let mut end = corners[low].clone();
                end[d] = true;
                let high = corners.iter().position(|c| *c == end)?;
                Some(vec![low, high])
            })
            .collect()
        };
        (0..self.parameters).map(along).collect()
    }

    /// Edges with knot vectors, or nothing where one would have to run both ways.
    fn find_edges(&self) -> Option<Vec<[usize; 3]>> {
        // Each edge as it is first met; both ends of the walk along it are an end of a set.
        let mut index: HashMap<[usize; 2], usize> = HashMap::new();
        let mut met = Vec::new();
        let mut groups = Vec::new();
        for ids in &self.vertices {
            for edges in self.element_edges() {
                let mut group = Vec::new();
                for edge in edges {
                    let [low, high] = [ids[edge[0]], ids[edge[1]]];
                    let key = [low.min(high), low.max(high)];
                    let own = *index.entry(key).or_insert_with(|| {
                        met.push([low, high]);
                        met.len() - 1
                    });
                    group.push((own, met[own] == [low, high]));
                }
                groups.push(group);
            }
        }
        // Node 2 e is edge e as met, node 2 e + 1 the same backwards.
        let mut sets = Sets::new(2 * met.len());
        for group in &groups {
            let (first, forward) = *group.first()?;
            for &(other, same) in &group[1..] {
                sets.join(
                    2 * first + usize::from(!forward),
                    2 * other + usize::from(!same),
                );
                sets.join(
                    2 * first + usize::from(forward),
                    2 * other + usize::from(same),
                );
            }
        }
        let mut names: HashMap<usize, usize> = HashMap::new();
        let mut out = Vec::new();
        for (e, &[low, high]) in met.iter().enumerate() {
            let (as_met, backwards) = (sets.root(2 * e), sets.root(2 * e + 1));
            if as_met == backwards {
                return None;
            }
            let next = names.len();
            out.push(match (names.get(&as_met), names.get(&backwards)) {
                (_, Some(&name)) => [name, high, low],
                (Some(&name), None) => [name, low, high],
                (None, None) => {
                    names.insert(as_met, next);
                    [next, low, high]
                }
            });
        }
        Some(out)
    }

    /// Sides of one element only; nothing where a side has more than two.
    fn find_boundary(&self) -> Option<Vec<Vec<usize>>> {
        let mut users: HashMap<Vec<usize>, usize> = HashMap::new();
        let key = |ids: &[usize], side: &[usize]| {
            let mut key: Vec<_> = side.iter().map(|&c| ids[c]).collect();
            key.sort_unstable();
            key
        };
        for ids in &self.vertices {
            for side in sides(self.parameters) {
                *users.entry(key(ids, side)).or_default() += 1;
            }
        }
        if users.values().any(|&n| n > 2) {
            return None;
        }
        let mut out = Vec::new();
        for ids in &self.vertices {
            for side in sides(self.parameters) {
                if users.get(&key(ids, side)) == Some(&1) {
                    out.push(side.iter().map(|&c| ids[c]).collect());
                }
            }
        }
        Some(out)
    }

    fn text(&self) -> String {
        let geometry = |parameters: usize| [0, 1, 3, 5][parameters.min(3)];
        let list = |ids: &[usize]| {
            let texts: Vec<_> = ids.iter().map(ToString::to_string).collect();
            texts.join(" ")
        };
        // Writing into a string cannot fail.
        let mut out = String::from("MFEM NURBS mesh v1.0\n\n");
        let _ = writeln!(out, "dimension\n{}\n", self.parameters);
        let _ = writeln!(out, "elements\n{}", self.vertices.len());
        for ids in &self.vertices {
            let _ = writeln!(out, "1 {} {}", geometry(self.parameters), list(ids));
        }
        let _ = writeln!(out, "\nboundary\n{}", self.boundary.len());
        for ids in &self.boundary {
            let _ = writeln!(out, "1 {} {}", geometry(self.parameters - 1), list(ids));
        }
        let _ = writeln!(out, "\nedges\n{}", self.edges.len());
        for edge in &self.edges {
            let _ = writeln!(out, "{}", list(edge));
        }
        let _ = writeln!(out, "\nvertices\n{}", self.count);
        out
    }
}

/// Pairs of sides that are the same, each as pairs of corners, numbered over all patches.
fn fitting_sides(nets: &[Net<'_>], parameters: usize) -> Option<Vec<Vec<(usize, usize)>>> {
    let corners = corners(parameters);
    // By their print from the corner and in the order that make it least.
    let mut found: HashMap<Print, Vec<Vec<usize>>> = HashMap::new();
    for (patch, net) in nets.iter().enumerate() {
        for side in sides(parameters) {
            let mut best: Option<(Print, Vec<usize>)> = None;
            let mut ties = 0;
            for walk in walks(side) {
                let start = &corners[walk[0]];
                // The first two steps of the walk are the parameters of the side.
                let order = match walk.len() {
                    4 => vec![
                        differing(start, &corners[walk[1]])?,
                        differing(start, &corners[walk[3]])?,
                    ],
                    2 => vec![differing(start, &corners[walk[1]])?],
                    _ => Vec::new(),
                };
                let own = print(net, start, &order)?;
                match &best {
                    Some((least, _)) if *least < own => {}
                    Some((least, _)) if *least == own => ties += 1,
                    _ => {
                        best = Some((own, walk));
                        ties = 0;
                    }
                }
            }
            // A side that looks the same from two corners is degenerate: nothing says how to join it.
            if let Some((own, walk)) = best
                && ties == 0
            {
                let ids = walk.iter().map(|&c| (patch << parameters) + c).collect();
                found.entry(own).or_default().push(ids);
            }
        }
    }
    let mut pairs: Vec<Vec<(usize, usize)>> = Vec::new();
    for users in found.into_values() {
        if let [a, b] = &users[..]
            && a[0] >> parameters != b[0] >> parameters
        {
            pairs.push(a.iter().copied().zip(b.iter().copied()).collect());
        }
    }
    Some(pairs)
}

/// A side's corners from every corner and in both directions.
fn walks(side: &[usize]) -> Vec<Vec<usize>> {
    let n = side.len();
    let from = |start: usize| {
        let forward: Vec<_> = (0..n).map(|k| side[(start + k) % n]).collect();
        let backward = (0..n).map(|k| side[(start + n - k) % n]).collect();
        if n > 2 {
            vec![forward, backward]
        } else {
            vec![forward]
        }
    };
    (0..n).flat_map(from).collect()
}

fn differing(a: &[bool], b: &[bool]) -> Option<usize> {
    (0..a.len()).find(|&d| a[d] != b[d])
}

/// Disjoint sets of numbers.
#[derive(Debug)]
struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
        }
    }

    fn root(&mut self, mut at: usize) -> usize {
        while self.parent[at] != at {
            self.parent[at] = self.parent[self.parent[at]];
            at = self.parent[at];
        }
        at
    }

    /// The lower root stays, so that names do not depend on the order of joining.
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high] = low;
    }
}
