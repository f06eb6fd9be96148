//! Questions to triangles: ray parity, winding numbers and nearest points against brute force, at
//! edges and vertices, far from the origin and at every scale.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::mesh::{Mesh, MeshTree, RayCrossings, tessellate};

fn shipped(name: &str) -> Scene {
    Scene::load(format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))).expect("a scene")
}

fn meshed(name: &str, share: f64) -> (Scene, Mesh) {
    let scene = shipped(name);
    let body = scene.assembly().parts()[0].body().clone();
    let mesh = tessellate(&body, share * body.bounds().longest_side()).expect("a mesh");
    (scene, mesh)
}

fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }
}

/// The sum of all solid angles, each by its own formula: the spherical excess of three dihedral
/// angles.
fn winding_by_excess(triangles: &[[DVec3; 3]], p: DVec3) -> f64 {
    let mut sum = 0.0;
    for t in triangles {
        let [a, b, c] = t.map(|v| (v - p).normalize());
        let dihedral = |a: DVec3, b: DVec3, c: DVec3| {
            let (u, v) = (a.cross(b), a.cross(c));
            u.cross(v).length().atan2(u.dot(v))
        };
        let excess =
            dihedral(a, b, c) + dihedral(b, c, a) + dihedral(c, a, b) - std::f64::consts::PI;
        sum += excess * a.dot(b.cross(c)).signum();
    }
    sum / (4.0 * std::f64::consts::PI)
}

/// A cube of side 2 about the origin with a vertex in the middle of every face: rays from lattice
/// points meet edges and vertices all the time.
fn cube(centre: DVec3, half: f64) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let middle = DVec3::AXES[axis] * sign;
            let ring = [-u - v, u - v, u + v, v - u];
            for k in 0..4 {
                let [a, b] = [ring[k], ring[(k + 1) % 4]].map(|d| middle + d);
                let t = if sign > 0.0 {
                    [middle, a, b]
                } else {
                    [middle, b, a]
                };
                triangles.push(t.map(|p| centre + half * p));
            }
        }
    }
    triangles
}

#[test]
fn rays_through_edges_and_vertices_of_a_cube_count_right() {
    for centre in [DVec3::ZERO, DVec3::splat(1e6), DVec3::new(-3e5, 7.0, 1e6)] {
        for half in [0.5, 2.0] {
            let tree = MeshTree::from_triangles(&cube(centre, half));
            assert_eq!((tree.len(), tree.is_empty()), (24, false));
            // Every fourth of the half side is exact in f64.
            for i in -6..=6 {
                for j in -6..=6 {
                    for k in -6..=6 {
                        let steps = [i, j, k];
                        let p = centre + DVec3::from_array(steps.map(f64::from)) * (half / 4.0);
                        let most = steps.iter().map(|s: &i32| s.abs()).max();
                        let wanted = match most {
                            Some(0..=3) => 1,
                            Some(4) => continue,
                            _ => 0,
                        };
                        let found = tree.crossings(p);
                        assert_eq!(found.signed, wanted, "{steps:?} about {centre}");
                        assert_eq!(found.is_inside(), wanted == 1);
                        let w = tree.winding_number(p, 1e-3);
                        assert!(
                            (w - f64::from(wanted)).abs() <= 1e-3 + 1e-9,
                            "{steps:?}: {w}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn rays_aimed_at_every_vertex_and_edge_of_a_mesh_agree_with_the_winding_number() {
    for name in ["torus", "goblet", "vase", "half_torus"] {
        let (scene, mesh) = meshed(name, 0.02);
        let tree = MeshTree::new(&mesh);
        let triangles: Vec<[DVec3; 3]> = mesh.corners().collect();
        let size = scene.bounds().longest_side();
        let mut random = uniform(3);
        let stride = mesh.triangles().len() / 200 + 1;
        for t in triangles.iter().step_by(stride) {
            // A point with the very y and z of a vertex, or of the middle of an edge.
            for target in [t[0], 0.5 * (t[0] + t[1]), t[2]] {
                let x = target.x + (random() - 0.5) * size;
                let p = DVec3::new(x, target.y, target.z);
                let off = tree.nearest(p).expect("triangles").distance;
                if off < 1e-6 * size {
                    continue;
                }
                // The winding number is the same all around; in line with an edge the dihedral
                // angles have no value.
                let beside = p + 1e-7 * size * DVec3::new(0.31, -0.57, 0.76);
                let exact = winding_by_excess(&triangles, beside);
                let wanted = exact.round();
                assert!((exact - wanted).abs() < 1e-6, "{name} {p}: {exact}");
                assert_eq!(f64::from(tree.crossings(p).signed), wanted, "{name} {p}");
                assert_eq!(tree.crossings(p).is_inside(), wanted == 1.0, "{name} {p}");
            }
        }
    }
}

#[test]
fn a_row_is_its_points() {
    for name in ["goblet", "rings", "vase", "bearing_outer_ring", "torus"] {
        let (scene, mesh) = meshed(name, 0.01);
        let tree = MeshTree::new(&mesh);
        let bounds = scene.bounds();
        let mut random = uniform(5);
        for row in 0..60 {
            let n = row % 67;
            let mut xs: Vec<f64> = (0..n)
                .map(|i| bounds.min.x + (f64::from(i) + 0.5) / f64::from(n) * bounds.sides().x)
                .collect();
            let (mut y, mut z) = (
                bounds.min.y + random() * bounds.sides().y,
                bounds.min.z + random() * bounds.sides().z,
            );
            if row % 2 == 1 {
                // Through vertices, some of the points on them.
                let v = mesh.vertices()[(random() * mesh.vertices().len() as f64) as usize];
                (y, z) = (v.y, v.z);
                xs.push(v.x);
                xs.sort_by(f64::total_cmp);
            }
            let mut found = vec![RayCrossings::default(); xs.len()];
            tree.crossings_row(&xs, y, z, &mut found);
            let wanted: Vec<_> = xs
                .iter()
                .map(|&x| tree.crossings(DVec3::new(x, y, z)))
                .collect();
            assert_eq!(found, wanted, "{name}, row {row}");
        }
    }
}

#[test]
fn winding_numbers_are_within_their_accuracy_and_agree_with_parity() {
    for name in ["torus", "goblet", "rings", "vase"] {
        let (scene, mesh) = meshed(name, 0.01);
        let tree = MeshTree::new(&mesh);
        let triangles: Vec<[DVec3; 3]> = mesh.corners().collect();
        let bounds = scene.bounds();
        let mut random = uniform(9);
        for k in 0..60 {
            let wide = if k % 5 == 0 { 6.0 } else { 1.0 };
            let p = 0.5 * (bounds.min + bounds.max)
                + wide * (DVec3::new(random(), random(), random()) - 0.5) * bounds.sides();
            let exact = winding_by_excess(&triangles, p);
            let full = tree.winding_number(p, 0.0);
            assert!(
                (full - exact).abs() < 1e-6,
                "{name} {p}: {full} for {exact}"
            );
            assert_eq!(
                f64::from(tree.crossings(p).signed),
                exact.round(),
                "{name} {p}"
            );
            for accuracy in [1e-6, 1e-3, 0.1, 0.4] {
                let found = tree.winding_number(p, accuracy);
                assert!(
                    (found - exact).abs() <= accuracy + 1e-6,
                    "{name} {p}: {found} for {exact} within {accuracy}"
                );
            }
        }
    }
}

#[test]
fn an_open_surface_has_a_winding_number_between() {
    // Five sides of a cube: from the centre five sixths of the sphere.
    let open: Vec<_> = cube(DVec3::ZERO, 1.0).split_off(4);
    let tree = MeshTree::from_triangles(&open);
    let found = tree.winding_number(DVec3::ZERO, 0.0);
    assert!((found - 5.0 / 6.0).abs() < 1e-14, "{found}");
}

#[test]
fn far_points_see_the_first_moment() {
    // Of a closed surface nothing is left far away, of an open one the missing side.
    let closed = cube(DVec3::new(0.3, -0.2, 0.1), 1.0);
    let open = closed[4..].to_vec();
    let mut random = uniform(19);
    for triangles in [closed, open] {
        let tree = MeshTree::from_triangles(&triangles);
        for k in 0..400 {
            let direction = (DVec3::new(random(), random(), random()) - 0.5).normalize();
            let p = direction * 10f64.powf(0.5 + 2.5 * f64::from(k) / 400.0);
            let exact = tree.winding_number(p, 0.0);
            for accuracy in [1e-6, 1e-3, 0.1] {
                let found = tree.winding_number(p, accuracy);
                assert!(
                    (found - exact).abs() <= accuracy,
                    "{p}: {found} for {exact} within {accuracy}"
                );
            }
        }
    }
}

#[test]
fn nearest_points_are_those_of_brute_force() {
    for name in ["torus", "goblet", "half_torus"] {
        let (scene, mesh) = meshed(name, 0.02);
        let tree = MeshTree::new(&mesh);
        let triangles: Vec<[DVec3; 3]> = mesh.corners().collect();
        let bounds = scene.bounds();
        let size = bounds.longest_side();
        let mut random = uniform(13);
        for k in 0..60 {
            let wide = if k % 4 == 0 { 1e3 } else { 1.2 };
            let p = 0.5 * (bounds.min + bounds.max)
                + wide * (DVec3::new(random(), random(), random()) - 0.5) * bounds.sides();
            // Each triangle by itself, through a tree of one.
            let alone = |t: &[DVec3; 3]| {
                let one = MeshTree::from_triangles(std::slice::from_ref(t));
                one.nearest(p).expect("one").distance
            };
            let wanted = triangles.iter().map(alone).fold(f64::INFINITY, f64::min);
            let found = tree.nearest(p).expect("triangles");
            let room = 1e-13 * (wanted + size);
            assert!(
                (found.distance - wanted).abs() <= room,
                "{name} {p}: {found:?} for {wanted}"
            );
            assert!(((found.point - p).length() - found.distance).abs() <= room);
            let own = alone(&triangles[found.triangle as usize]);
            assert!((own - wanted).abs() <= room);
            assert!(tree.nearest_within(p, 0.99 * wanted).is_none());
            assert!(tree.nearest_within(p, 1.01 * wanted).is_some());
        }
    }
}

#[test]
fn nearest_points_of_one_triangle_are_where_geometry_has_them() {
    let [a, b, c] = [
        DVec3::ZERO,
        DVec3::new(4.0, 0.0, 0.0),
        DVec3::new(0.0, 4.0, 0.0),
    ];
    let tree = MeshTree::from_triangles(&[[a, b, c]]);
    let cases = [
        (DVec3::new(1.0, 1.0, 3.0), DVec3::new(1.0, 1.0, 0.0)),
        (DVec3::new(-2.0, -1.0, 1.0), a),
        (DVec3::new(2.0, -5.0, 0.0), DVec3::new(2.0, 0.0, 0.0)),
        (DVec3::new(4.0, 4.0, -1.0), DVec3::new(2.0, 2.0, 0.0)),
        (DVec3::new(9.0, -1.0, 0.0), b),
    ];
    for (p, wanted) in cases {
        let found = tree.nearest(p).expect("one");
        assert!((found.point - wanted).length() < 1e-14, "{p}: {found:?}");
        assert!((found.distance - (p - wanted).length()).abs() < 1e-14);
    }
    // Flat to a line, flat to a point.
    for flat in [[a, b, 0.25 * b], [a, a, a]] {
        let found = MeshTree::from_triangles(&[flat]).nearest(DVec3::new(1.0, 2.0, 0.0));
        let wanted = if flat[1] == a { 5.0_f64.sqrt() } else { 2.0 };
        assert!((found.expect("one").distance - wanted).abs() < 1e-14);
    }
    let none = MeshTree::from_triangles(&[]);
    assert!(none.is_empty() && none.nearest(a).is_none());
    assert_eq!(none.crossings(a), RayCrossings::default());
    assert_eq!(none.winding_number(a, 0.1), 0.0);
}

#[test]
fn answers_do_not_depend_on_units_or_on_where_the_solid_is() {
    let ring = |place: &str| {
        Scene::parse(&format!(
            "schema = 1\nprofiles.p.curves = [{{ kind = 'circle', center = [3, 0], radius = 1 }}]\n\
             [[solid]]\nkind = 'revolve'\nprofile = 'p'\nangle = 300\nplace = [{place}]\n"
        ))
        .expect("a scene")
    };
    for (factor, offset) in [
        (1.0, 0.0),
        (1e-6, 0.0),
        (1e6, 0.0),
        (1.0, 1e6),
        (1e-6, 1.0),
        (1e60, 0.0),
        (1e-60, 0.0),
    ] {
        let offset = DVec3::new(offset, -offset, offset);
        let scene = ring(&format!(
            "{{ scale = {factor:?} }}, {{ translate = [{:?}, {:?}, {:?}] }}",
            offset.x, offset.y, offset.z
        ));
        let body = scene.assembly().single().expect("one");
        let mesh = tessellate(body, 0.02 * factor).expect("a mesh");
        let tree = MeshTree::new(&mesh);
        let mut random = uniform(17);
        let mut asked = 0;
        for _ in 0..300 {
            let p = offset + 9.0 * factor * (DVec3::new(random(), random(), random()) - 0.5);
            let inside = body.contains(p);
            if body.distance(p, inside, f64::INFINITY) <= mesh.chord_error() {
                continue;
            }
            asked += 1;
            let found = tree.crossings(p);
            assert_eq!(found.is_inside(), inside, "{factor} {offset} {p}");
            assert_eq!(found.signed, i32::from(inside), "{factor} {offset} {p}");
            let w = tree.winding_number(p, 0.05);
            assert!(
                (w - f64::from(u8::from(inside))).abs() < 0.06,
                "{factor} {offset} {p}: {w}"
            );
        }
        assert!(asked > 200, "{factor} {offset}");
    }
}
