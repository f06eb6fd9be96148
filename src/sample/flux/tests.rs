//! Single voxels against integrals over the radius, which share nothing with the flux: sums telescope and prove nothing.
//!
//! ```text
//!   V = ∫ h(ρ) ρ φ(ρ) dρ        φ the angle of the circle within the voxel's rectangle and the turn
//! ```
//!
//! h comes from the pieces in double-double, the integral from the double exponential rule between all radii at which
//! either factor is not analytic.

use super::*;
use crate::Scene;
use crate::region::BoundaryPiece;
use glam::DVec3;
use std::f64::consts::TAU;

/// Deterministic numbers between 0 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        #[allow(clippy::cast_precision_loss, reason = "53 bits")]
        {
            (self.0 >> 11) as f64 * (-53.0_f64).exp2()
        }
    }
}

/// The double exponential rule over [a, b].
fn double_exponential(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    const STEP: f64 = 1.0 / 16.0;
    let half_pi = std::f64::consts::FRAC_PI_2;
    let mut sum = 0.0;
    for k in -56..=56_i32 {
        let u = f64::from(k) * STEP;
        let (sinh, cosh) = ((half_pi * u.sinh()), u.cosh());
        let weight = half_pi * cosh / sinh.cosh().powi(2);
        // Distance from the nearer end, without cancellation.
        let near = 1.0 / (1.0 + (2.0 * sinh.abs()).exp());
        let x = if k <= 0 {
            a + (b - a) * near
        } else {
            b - (b - a) * near
        };
        if x > a && x < b {
            sum += weight * f(x);
        }
    }
    0.5 * (b - a) * STEP * sum
}

/// One voxel in the body's coordinates.
struct Cell {
    u: [f64; 2],
    v: [f64; 2],
    z: [f64; 2],
}

impl Cell {
    /// Radii at which the angle of the circle is not analytic.
    fn radii(&self, caps: Option<&Caps>) -> Vec<f64> {
        let mut radii = Vec::new();
        for u in self.u {
            radii.push(u.abs());
            radii.extend(self.v.iter().map(|v| u.hypot(*v)));
        }
        radii.extend(self.v.iter().map(|v| v.abs()));
        for d in caps.iter().flat_map(|c| c.directions) {
            radii.extend(self.u.iter().map(|u| (u / d.x).abs()));
            radii.extend(self.v.iter().map(|v| (v / d.y).abs()));
        }
        radii
    }

    /// The angle of the circle within the rectangle and the turn.
    fn angle(&self, r: f64, caps: Option<&Caps>) -> f64 {
        let mut cuts = vec![0.0, TAU];
        let mut add = |a: f64| cuts.push(a.rem_euclid(TAU));
        for u in self.u.iter().filter(|u| u.abs() < r) {
            let a = (r * r - u * u).sqrt().atan2(*u);
            add(a);
            add(-a);
        }
        for v in self.v.iter().filter(|v| v.abs() < r) {
            let b = (r * r - v * v).sqrt();
            add(v.atan2(b));
            add(v.atan2(-b));
        }
        for d in caps.iter().flat_map(|c| c.directions) {
            add(d.y.atan2(d.x));
        }
        cuts.sort_by(f64::total_cmp);
        let within = |a: f64| {
            let p = DVec2::new(r * a.cos(), r * a.sin());
            let held = p.x > self.u[0] && p.x < self.u[1] && p.y > self.v[0] && p.y < self.v[1];
            held && caps.is_none_or(|c| c.holds(p))
        };
        let arcs = cuts
            .windows(2)
            .filter(|w| w[1] > w[0] && within(0.5 * (w[0] + w[1])));
        arcs.map(|w| w[1] - w[0]).sum()
    }

    /// The share of the voxel, by the radius.
    fn share(&self, pieces: &[BoundaryPiece], caps: Option<&Caps>) -> f64 {
        let [low, high] = self.z;
        let parts: Vec<BoundaryPiece> = (pieces.iter().copied())
            .filter(|p| p.disc_sign() != 0 && !p.piece.on_axis)
            .filter(|p| p.piece.bounds().max[1] > low && p.piece.bounds().min[1] < high)
            .collect();
        let mut radii = self.radii(caps);
        for part in &parts {
            let piece = part.piece;
            for end in [piece.start(), piece.end()] {
                radii.push(end[0].f64());
            }
            if piece.degree() > 1 {
                // Between these the height is smooth enough for the rule, however the piece bends.
                let inner = (1..16).map(|i| piece.at(Dd::of(f64::from(i) / 16.0)));
                radii.extend(inner.map(|p| p[0].f64()));
            }
            for z in self.z {
                let (a, b) = (piece.start()[1].f64(), piece.end()[1].f64());
                if z > a.min(b) && z < a.max(b) {
                    radii.push(piece.other_at(1, Dd::of(z)).f64());
                }
            }
        }
        let (near, far) = (self.u, self.v);
        let most = near[0]
            .abs()
            .max(near[1].abs())
            .hypot(far[0].abs().max(far[1].abs()));
        radii.push(0.0);
        radii.push(most);
        radii.retain(|r| (0.0..=most).contains(r));
        radii.sort_by(f64::total_cmp);
        let height = |r: f64| -> f64 {
            let each = parts.iter().map(|part| {
                let piece = part.piece;
                let (inner, outer) = if piece.start()[0] <= piece.end()[0] {
                    (piece.start(), piece.end())
                } else {
                    (piece.end(), piece.start())
                };
                let from = if r <= inner[0].f64() {
                    inner[1]
                } else if r >= outer[0].f64() {
                    outer[1]
                } else {
                    piece.other_at(0, Dd::of(r))
                };
                let clip = |z: Dd| z.f64().clamp(low, high);
                f64::from(part.disc_sign()) * (clip(outer[1]) - clip(from)).abs()
            });
            each.sum()
        };
        let whole = radii.windows(2).filter(|w| w[1] > w[0]).map(|w| {
            let f = |r: f64| {
                let angle = self.angle(r, caps);
                if angle == 0.0 {
                    0.0
                } else {
                    height(r) * r * angle
                }
            };
            if self.angle(0.5 * (w[0] + w[1]), caps) == 0.0 {
                0.0
            } else {
                double_exponential(&f, w[0], w[1])
            }
        });
        let volume = (self.u[1] - self.u[0]) * (self.v[1] - self.v[0]) * (high - low);
        whole.sum::<f64>() / volume
    }
}

fn cases() -> Vec<(&'static str, String)> {
    let region = |name: &'static str, profile: &str, solid: &str| {
        let text = format!(
            "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = \"revolve\"\nprofile = \"p\"\n{solid}"
        );
        (name, text)
    };
    let ball = "boundary = \"to-axis\"\ncurves = [{ kind = \"arc\", center = [0, 0], radius = 1, from = -90, to = 90 }]";
    let torus = "curves = [{ kind = \"circle\", center = [1, 0.1], radius = 0.4 }]";
    let cone =
        "boundary = \"to-axis\"\ncurves = [{ kind = \"polyline\", points = [[1, 0], [0, 1.3]] }]";
    let cubic = "boundary = \"to-axis\"\ncurves = [{ kind = \"bezier\", points = [[0.5, 0], [1.6, 0.4], [-0.1, 1.1], [0.8, 1.5]] }]";
    let wild = "boundary = \"to-axis\"\ncurves = [{ kind = \"bezier\", points = [[0.5, 0], [1.2, 0.3], [0.2, 0.9], [0.9, 1.2]], weights = [1, 40, 0.03, 1] }]";
    let seventh = "boundary = \"to-axis\"\ncurves = [{ kind = \"bezier\", points = [[0.3, 0], [1, 0.1], [0.2, 0.3], [1.4, 0.5], [0.1, 0.6], [1.1, 0.9], [0.9, 1], [0.4, 1.2]] }]";
    let cusp = "boundary = \"to-axis\"\ncurves = [{ kind = \"bezier\", points = [[1, 0], [0, 0], [0, 0], [0, 1]] }]";
    let grooves = {
        let mut points = String::from("[1, 0]");
        for i in 0..40 {
            let z = f64::from(i) / 40.0;
            points += &format!(", [0.93, {:.4}], [1, {:.4}]", z + 0.0125, z + 0.025);
        }
        format!("boundary = \"to-axis\"\ncurves = [{{ kind = \"polyline\", points = [{points}] }}]")
    };
    let thread = {
        let arc = |i: u32| {
            let z = (f64::from(i) + 0.5) / 120.0;
            let radius = 1.0 / 240.0;
            format!(
                "{{ kind = \"arc\", center = [1, {z}], radius = {radius}, from = -90, to = 90 }}"
            )
        };
        let arcs: Vec<String> = (0..120).map(arc).collect();
        format!(
            "boundary = \"to-axis\"\ngap = 1e-6\ncurves = [{}]",
            arcs.join(", ")
        )
    };
    vec![
        region("thread of arcs", &thread, ""),
        region("ball", ball, ""),
        region(
            "ball apart",
            ball,
            "place = [{ translate = [0.137, -0.311, 0.05] }]",
        ),
        region("torus", torus, ""),
        region(
            "torus about -z, apart",
            torus,
            "axis = { origin = [0.3, 0.2, 0], direction = [0, 0, -1] }",
        ),
        region("cone", cone, ""),
        region("cubic", cubic, "axis = { origin = [0.01, 0.5, -0.2] }"),
        region("wild weights", wild, ""),
        region("degree seven", seventh, ""),
        region("cusp on the axis", cusp, ""),
        region("grooves", &grooves, ""),
        region(
            "lying ball",
            ball,
            "axis = { origin = [0.1, 0.2, 0.3], direction = [1, 0, 0] }",
        ),
        region(
            "lying cubic",
            cubic,
            "axis = { origin = [0.1, -0.5, 0.3], direction = [0, -1, 0] }",
        ),
        region("wedge of a torus", torus, "start = 25\nangle = 110"),
        region(
            "reflex wedge",
            cubic,
            "start = -35\nangle = 290\naxis = { origin = [0.05, 0.1, 0.3] }",
        ),
        region("quarter", cone, "start = 90\nangle = 90"),
        region(
            "lying wedge",
            cubic,
            "start = 15\nangle = -200\naxis = { origin = [0.1, -0.5, 0.3], direction = [0, 1, 0] }",
        ),
        region(
            "mirrored wedge",
            cubic,
            "start = 15\nangle = 200\nplace = [{ mirror = [1, 0, 0] }]",
        ),
    ]
}

fn grids(scene: &Scene) -> Vec<GridSpec> {
    let whole = scene.grid().expect("a grid");
    let [min, side] = [
        whole.origin(),
        whole.spacing() * DVec3::from(whole.dims().map(|n| n as f64)),
    ];
    let grid = |dims: [usize; 3], shift: DVec3| {
        let spacing = side / DVec3::from(dims.map(|n| n as f64));
        GridSpec::new(dims, min + shift * spacing, spacing).expect("a grid")
    };
    vec![
        grid([24, 24, 24], DVec3::ZERO),
        grid([17, 31, 23], DVec3::new(0.21, -0.4, 0.13)),
        grid([1, 1, 1], DVec3::ZERO),
        grid([3, 2, 5], DVec3::ZERO),
        grid([120, 110, 90], DVec3::new(0.0, 0.3, 0.5)),
    ]
}

/// Worst differences from the integrals by the radius, and the worst excess over the bound.
fn compare(name: &str, text: &str, error: f64, count: usize) -> f64 {
    let scene = Scene::parse(text).unwrap_or_else(|e| panic!("{name}: {e}"));
    let body = scene.assembly().bodies()[0].clone();
    let body = body.revolved().expect("a turned region");
    let mut random = Random(7);
    let mut worst_of_all = 0.0_f64;
    for grid in grids(&scene) {
        let sampler = FluxSampler::new(body, &grid, error).expect("an axis along the grid's");
        let [nx, ny, nz] = grid.dims();
        let mut scratch = FluxScratch::default();
        let mut cut = Vec::new();
        let (mut sum, mut integrated, mut bound) = (0.0, 0, 0.0_f64);
        for k in 0..nz {
            let mut layer = vec![f64::NAN; nx * ny];
            let filled = sampler
                .layer((Kernel::default(), None), body, k, &mut scratch, &mut layer)
                .unwrap_or_else(|| panic!("{name}: no table of layer {k}"));
            sum += filled.sum;
            integrated += filled.cut;
            bound = bound.max(filled.bound);
            assert!(
                layer.iter().all(|v| (0.0..=1.0).contains(v)),
                "{name}: layer {k}"
            );
            cut.extend(
                layer
                    .iter()
                    .enumerate()
                    .map(|(n, v)| ([n % nx, n / nx, k], *v)),
            );
        }
        let exact = scene.exact_volume().expect("one body").value;
        let off = (sum * grid.voxel_volume() - exact).abs() / exact;
        // Those that are cut, and some that are said not to be.
        let all = cut.len();
        let (mut partly, whole): (Vec<_>, Vec<_>) =
            cut.into_iter().partition(|c| c.1 > 0.0 && c.1 < 1.0);
        while partly.len() > count {
            let n = (random.next() * partly.len() as f64) as usize;
            partly.swap_remove(n);
        }
        for _ in 0..whole.len().min(count / 10) {
            partly.push(whole[(random.next() * whole.len() as f64) as usize]);
        }
        let mut worst = (0.0_f64, [0; 3]);
        for (index, found) in &partly {
            let [u, v] = [[1, 2], [0, 2], [0, 1]][sampler.axis];
            let [p, q] = &sampler.across;
            let heights = [0, 1].map(|i| sampler.heights[index[sampler.axis] + i]);
            let cell = Cell {
                u: [p.at[index[u]], p.at[index[u] + 1]],
                v: [q.at[index[v]], q.at[index[v] + 1]],
                z: [heights[0].min(heights[1]), heights[0].max(heights[1])],
            };
            let boundary: Vec<_> = body.boundary().iter().collect();
            let wanted = cell.share(&boundary, sampler.caps.as_ref());
            let off = (found - wanted).abs();
            if off > worst.0 {
                worst = (off, *index);
            }
        }
        eprintln!(
            "{name} {:?} {error:e}: {} voxels of {all}, {integrated} integrated, worst {:.1e} at {:?}, bound {bound:.1e}, sum {off:.1e}",
            grid.dims(),
            partly.len(),
            worst.0,
            worst.1
        );
        // The integral by the radius is good to some 1e-14 R / h.
        let slack = 2e-14 * 120.0;
        assert!(worst.0 <= bound + slack, "{name}: {worst:?}");
        assert!(off <= error.max(1e-10), "{name}: sum off by {off:e}");
        worst_of_all = worst_of_all.max(worst.0);
    }
    worst_of_all
}

#[test]
fn voxels_agree_with_integrals_over_the_radius() {
    let count = std::env::var("VOXLATHE_POINTS")
        .ok()
        .and_then(|c| c.parse().ok())
        .unwrap_or(60);
    let only = std::env::var("VOXLATHE_CASE").unwrap_or_default();
    for (name, text) in cases() {
        if !name.contains(&only) {
            continue;
        }
        for error in [1e-6, 1e-9, 1e-12] {
            let worst = compare(name, &text, error, count);
            assert!(worst <= error.max(3e-12), "{name}: {worst:e} at {error:e}");
        }
    }
}
