//! What cut cells are for: Poisson's equation on a disc and in a torus, by finite volumes on the cells of a grid.
//!
//! ```text
//!   -Δu = f in the solid, ∂u/∂n = g on its boundary
//!   Σ over sides of A (u_c - u_neighbour) / h = ∭ f dV + ∬ g dA
//! ```
//!
//! with A the open area of a side, from `face-x`, `-y`, `-z`, the volume from `fraction`, f at the centroid of the solid
//! part, g at the centroid of the boundary, times its area. Values belong to the centres of whole cells, in the solid or
//! not. With 0 or 1 for every cell and side the same scheme has a staircase for a boundary.
//!
//! * Source: Ng, Min & Gibou, *An efficient fluid-solid coupling algorithm for single-phase flows*, J. Comput. Phys. 228
//!   (2009), §3; Purvis & Burkhalter, AIAA J. 17 (1979).

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

const CHANNELS: [Channel; 12] = [
    Channel::Occupancy,
    Channel::Fraction,
    Channel::FaceX,
    Channel::FaceY,
    Channel::FaceZ,
    Channel::CentroidX,
    Channel::CentroidY,
    Channel::CentroidZ,
    Channel::BoundaryArea,
    Channel::BoundaryX,
    Channel::BoundaryY,
    Channel::BoundaryZ,
];

/// The channels of a whole grid, x fastest.
struct Cells {
    grid: GridSpec,
    values: Vec<Vec<f64>>,
}

impl Cells {
    /// All channels, or the occupancy alone.
    fn new(scene: &Scene, grid: GridSpec, are_cut: bool) -> Self {
        let channels = if are_cut {
            &CHANNELS[..]
        } else {
            &CHANNELS[..1]
        };
        let sampler = LayerSampler::new(scene.assembly(), &grid, Selection::of(channels, None));
        let mut values = vec![Vec::new(); CHANNELS.len()];
        let mut layer = LayerBuffers::default();
        for k in 0..grid.dims()[2] {
            sampler.sample(k, &mut layer);
            assert_eq!((layer.tally.uncut, layer.tally.loose.voxels), (0, 0));
            for (channel, values) in channels.iter().zip(&mut values) {
                match channel {
                    Channel::Occupancy => {
                        values.extend(layer.occupancy.iter().map(|v| f64::from(*v)))
                    }
                    Channel::Fraction => {
                        values.extend(layer.fraction.iter().map(|v| f64::from(*v)))
                    }
                    other => {
                        let found = layer.others.iter().find(|(c, _)| c == other);
                        let found = &found.expect("a channel").1;
                        values.extend(found.iter().map(|v| f64::from(*v)));
                    }
                }
            }
        }
        Self { grid, values }
    }

    fn of(&self, channel: Channel) -> &[f64] {
        let n = CHANNELS.iter().position(|c| *c == channel);
        &self.values[n.expect("a channel")]
    }

    fn three(&self, channels: [Channel; 3], n: usize) -> DVec3 {
        DVec3::from_array(channels.map(|c| self.of(c)[n]))
    }
}

/// A problem whose answer is known.
struct Problem {
    u: fn(DVec3) -> f64,
    f: fn(DVec3) -> f64,
    /// ∂u/∂n on the boundary, which the point is near to.
    g: fn(DVec3) -> f64,
}

/// The two measures of what is off: the root of the mean square over the solid, and the most of any cell.
#[derive(Debug, Clone, Copy)]
struct Off {
    mean: f64,
    most: f64,
}

/// Solves it; `is_cut`: by shares of cells and sides, else by cells that are wholly solid or empty.
fn solve(cells: &Cells, problem: &Problem, is_cut: bool) -> Off {
    let dims = cells.grid.dims();
    let h = cells.grid.spacing();
    let faces = DVec3::new(h.y * h.z, h.z * h.x, h.x * h.y);
    let cell = h.element_product();
    let occupancy = cells.of(Channel::Occupancy);
    let strides = [1, dims[0], dims[0] * dims[1]];
    let count = occupancy.len();
    let share = |n: usize| {
        if is_cut {
            cells.of(Channel::Fraction)[n]
        } else {
            occupancy[n]
        }
    };
    let open = |axis: usize, n: usize| {
        let channels = [Channel::FaceX, Channel::FaceY, Channel::FaceZ];
        if is_cut {
            cells.of(channels[axis])[n]
        } else {
            occupancy[n] * occupancy[n - strides[axis]]
        }
    };
    // Of each cell the ties to those before it along the axes.
    let mut ties = vec![[0.0; 3]; count];
    let mut diagonal = vec![0.0; count];
    let mut right = vec![0.0; count];
    let mut centres = vec![DVec3::ZERO; count];
    for n in 0..count {
        let place = [n % dims[0], n / dims[0] % dims[1], n / strides[2]];
        centres[n] = cells.grid.centre(place[0], place[1], place[2]);
        for axis in (0..3).filter(|a| place[*a] > 0) {
            let tie = open(axis, n) * faces[axis] / h[axis];
            ties[n][axis] = tie;
            diagonal[n] += tie;
            diagonal[n - strides[axis]] += tie;
        }
        let volume = share(n) * cell;
        if volume == 0.0 {
            continue;
        }
        let mut at = centres[n];
        if is_cut {
            let centroid = [Channel::CentroidX, Channel::CentroidY, Channel::CentroidZ];
            at += h * cells.three(centroid, n);
            let area = cells.of(Channel::BoundaryArea)[n];
            let centroid = [Channel::BoundaryX, Channel::BoundaryY, Channel::BoundaryZ];
            let on = centres[n] + h * cells.three(centroid, n);
            if area > 0.0 {
                right[n] += (problem.g)(on) * area;
            }
        }
        right[n] += (problem.f)(at) * volume;
    }
    // Cells without a neighbour have no equation.
    let is_in = |n: usize| diagonal[n] > 1e-12 * faces.max_element() / h.min_element();
    let volumes: Vec<f64> = (0..count)
        .map(|n| if is_in(n) { share(n) * cell } else { 0.0 })
        .collect();
    let total: f64 = volumes.iter().sum();
    let excess: f64 = (0..count).filter(|n| is_in(*n)).map(|n| right[n]).sum();
    for n in 0..count {
        right[n] = if is_in(n) {
            right[n] - excess * volumes[n] / total
        } else {
            0.0
        };
    }
    let apply = |x: &[f64], out: &mut [f64]| {
        for n in 0..count {
            out[n] = diagonal[n] * x[n];
        }
        for n in 0..count {
            for axis in 0..3 {
                let tie = ties[n][axis];
                if tie != 0.0 {
                    let m = n - strides[axis];
                    out[n] -= tie * x[m];
                    out[m] -= tie * x[n];
                }
            }
        }
    };
    // Conjugate gradients, by the diagonal.
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |r: &[f64]| -> Vec<f64> {
        (0..count)
            .map(|n| if is_in(n) { r[n] / diagonal[n] } else { 0.0 })
            .collect()
    };
    let mut x = vec![0.0; count];
    let mut r = right.clone();
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut ap = vec![0.0; count];
    let mut rz = dot(&r, &z);
    let goal = 1e-22 * rz;
    for _ in 0..20_000 {
        if rz <= goal {
            break;
        }
        apply(&p, &mut ap);
        let step = rz / dot(&p, &ap);
        for n in 0..count {
            x[n] += step * p[n];
            r[n] -= step * ap[n];
        }
        z = scaled(&r);
        let next = dot(&r, &z);
        for n in 0..count {
            p[n] = z[n] + next / rz * p[n];
        }
        rz = next;
    }
    assert!(rz <= goal, "the solver stopped at {rz:e} of {goal:e}");
    // Up to a constant.
    let mut off: Vec<f64> = (0..count).map(|n| x[n] - (problem.u)(centres[n])).collect();
    let middle = dot(&off, &volumes) / total;
    off.iter_mut().for_each(|v| *v -= middle);
    let square: f64 = (0..count).map(|n| volumes[n] * off[n] * off[n]).sum();
    let most = (0..count).filter(|n| is_in(*n)).map(|n| off[n].abs());
    Off {
        mean: (square / total).sqrt(),
        most: most.fold(0.0, f64::max),
    }
}

/// Prints the table and gives the order of the mean square over all its resolutions, and the last error.
fn table(name: &str, found: &[(u32, Off)]) -> [f64; 2] {
    eprintln!("{name}\n     N   mean square  order       most  order");
    let ratio =
        |a: f64, b: f64, (n, m): (u32, u32)| (a / b).ln() / (f64::from(m) / f64::from(n)).ln();
    for (i, (resolution, off)) in found.iter().enumerate() {
        let orders = i.checked_sub(1).map(|before| {
            let (n, last) = found[before];
            let steps = (n, *resolution);
            [
                ratio(last.mean, off.mean, steps),
                ratio(last.most, off.most, steps),
            ]
        });
        let [mean, most] = orders.unwrap_or([f64::NAN; 2]);
        eprintln!(
            "  {resolution:4}      {:.2e}  {mean:5.2}   {:.2e}  {most:5.2}",
            off.mean, off.most
        );
    }
    let ((n, first), (m, last)) = (found[0], found[found.len() - 1]);
    [ratio(first.mean, last.mean, (n, m)), last.mean]
}

/// Grids that errors of staircases are averaged over: they go up and down as steps come and go.
const MOVED: u32 = 8;

/// Solves problems on grids of these resolutions; the tables, and of each what [`table`] gives.
///
/// * `cells`: of a resolution, and a grid that is moved by so much of a voxel.
fn orders(
    name: &str,
    resolutions: &[u32],
    cells: impl Fn(u32, DVec3, bool) -> Cells,
    problems: &[(&str, &Problem, bool)],
) -> Vec<[f64; 2]> {
    let one = |(what, problem, is_cut): &(&str, &Problem, bool)| {
        let found: Vec<(u32, Off)> = (resolutions.iter())
            .map(|resolution| {
                let count = if *is_cut { 1 } else { MOVED };
                let offs: Vec<Off> = (0..count)
                    .map(|n| {
                        // Spread evenly: multiples of the plastic number's powers.
                        let part = |g: f64| (g * f64::from(n)).fract();
                        let moved = DVec3::new(
                            part(0.819_172_513_396_164_5),
                            part(0.671_043_606_703_789_3),
                            part(0.549_700_477_901_970_3),
                        );
                        solve(&cells(*resolution, moved, *is_cut), problem, *is_cut)
                    })
                    .collect();
                let mean = |of: fn(&Off) -> f64| {
                    let squares = offs.iter().map(|off| of(off) * of(off));
                    (squares.sum::<f64>() / f64::from(count)).sqrt()
                };
                let off = Off {
                    mean: mean(|off| off.mean),
                    most: mean(|off| off.most),
                };
                (*resolution, off)
            })
            .collect();
        table(&format!("{name}, {what}"), &found)
    };
    problems.iter().map(one).collect()
}

/// A disc, as one layer of a long cylinder's cells.
#[test]
fn a_disc() {
    let scene = Scene::parse(
        "schema = 1\nsolid = [{ kind = 'cylinder', radius = 1, height = 4, axis = { origin = [0.03, -0.02, -2] } }]",
    )
    .expect("a scene");
    const MIDDLE: DVec3 = DVec3::new(0.03, -0.02, 0.0);
    // (2 - r²) (x² - y²): its slope along r is 0 at r = 1.
    let closed = Problem {
        u: |p| {
            let q = p - MIDDLE;
            (2.0 - q.x * q.x - q.y * q.y) * (q.x * q.x - q.y * q.y)
        },
        f: |p| {
            let q = p - MIDDLE;
            12.0 * (q.x * q.x - q.y * q.y)
        },
        g: |_| 0.0,
    };
    // Through the boundary there is a flux.
    let flowing = Problem {
        u: |p| (0.5 * p.x).exp() * p.y.sin(),
        f: |p| 0.75 * (0.5 * p.x).exp() * p.y.sin(),
        g: |p| {
            let n = (p - MIDDLE).truncate().normalize();
            let e = (0.5 * p.x).exp();
            0.5 * e * p.y.sin() * n.x + e * p.y.cos() * n.y
        },
    };
    let cells = |n: u32, moved: DVec3, are_cut: bool| {
        let h = 2.4 / f64::from(n);
        let low = DVec3::new(-1.2, -1.2, -0.5 * h) + h * moved;
        let grid = GridSpec::new([n as usize, n as usize, 1], low, DVec3::splat(h));
        Cells::new(&scene, grid.expect("a grid"), are_cut)
    };
    let found = orders(
        "disc",
        &[16, 32, 64, 128],
        cells,
        &[
            ("cut cells", &closed, true),
            ("0 and 1, over 8 grids", &closed, false),
            ("cut cells, with flux through the boundary", &flowing, true),
        ],
    );
    assert!(found[0][0] >= 1.9 && found[2][0] >= 1.9, "{found:?}");
    assert!(
        found[1][0] <= 1.6 && found[1][1] >= 20.0 * found[0][1],
        "{found:?}"
    );
}

/// A torus.
#[test]
fn a_torus() {
    let scene = Scene::parse(
        "schema = 1\nsolid = [{ kind = 'torus', major = 1, minor = 0.4, axis = { origin = [0.01, 0.02, -0.03] } }]",
    )
    .expect("a scene");
    /// Distance from the axis, cosine of the angle, height, and square of the distance from the tube's middle.
    fn local(p: DVec3) -> [f64; 4] {
        let q = p - DVec3::new(0.01, 0.02, -0.03);
        let r = q.x.hypot(q.y);
        [r, q.x / r, q.z, (r - 1.0).powi(2) + q.z * q.z]
    }
    const SQUARE: f64 = 0.16;
    // (3 a² - s) z cos φ, whose slope across the tube is 0 where s = a².
    let closed = Problem {
        u: |p| {
            let [_, cos, z, s] = local(p);
            (3.0 * SQUARE - s) * z * cos
        },
        f: |p| {
            let [r, cos, z, s] = local(p);
            cos * z * (8.0 + 2.0 * (r - 1.0) / r + (3.0 * SQUARE - s) / (r * r))
        },
        g: |_| 0.0,
    };
    let cells = |n: u32, moved: DVec3, are_cut: bool| {
        let h = 3.0 / f64::from(n);
        let n = n as usize;
        let layers = n / 8 * 3;
        let low = DVec3::new(-1.5, -1.5, -0.5 * h * layers as f64) + h * moved;
        let grid = GridSpec::new([n, n, layers], low, DVec3::splat(h));
        Cells::new(&scene, grid.expect("a grid"), are_cut)
    };
    let found = orders(
        "torus",
        &[24, 32, 48, 64],
        cells,
        &[
            ("cut cells", &closed, true),
            ("0 and 1, over 8 grids", &closed, false),
        ],
    );
    assert!(found[0][0] >= 1.9, "{found:?}");
    assert!(
        found[1][0] <= 1.75 && found[1][1] >= 5.0 * found[0][1],
        "{found:?}"
    );
}
