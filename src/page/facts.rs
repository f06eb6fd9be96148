//! What a page says beside the picture: exact numbers, with their units.

use super::channels::Stored;
use super::lattice::Lattice;
use crate::grid::GridSpec;
use crate::io::manifest::Manifest;
use crate::math::quadrature::Integral;
use crate::scene::Scene;

/// The error relative to it up to which a volume is called exact.
const EXACT: f64 = 1e-9;

/// A group of facts under one title.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) title: &'static str,
    /// Names and values.
    pub(super) rows: Vec<[String; 2]>,
}

fn row(name: &str, value: impl Into<String>) -> [String; 2] {
    [name.to_owned(), value.into()]
}

fn triple(values: [f64; 3]) -> String {
    values.map(|v| v.to_string()).join(", ")
}

/// A unit to a power.
pub(super) fn power(units: &str, power: u8) -> String {
    let sign = match power {
        2 => "²",
        3 => "³",
        _ => "",
    };
    let units = if units == "um" { "µm" } else { units };
    format!("{units}{sign}")
}

/// What was integrated, with its error where that says something.
fn integral(name: &str, found: Option<(f64, Option<f64>)>, units: &str) -> [String; 2] {
    let Some((value, error)) = found else {
        return row(name, "not measured");
    };
    let is_exact = error.is_some_and(|e| e <= EXACT * value.abs());
    match error {
        Some(_) if is_exact => row(&format!("{name}, exact"), format!("{value} {units}")),
        Some(error) => row(name, format!("{value} ± {error:.1e} {units}")),
        None => row(name, format!("{value} {units}")),
    }
}

/// What the grid is.
fn grid(lattice: &Lattice, units: &str) -> Group {
    let length = power(units, 1);
    let g: &GridSpec = &lattice.grid;
    let [nx, ny, nz] = g.dims();
    let mut rows = vec![
        row("voxels", format!("{nx} × {ny} × {nz}")),
        row(
            "spacing",
            format!("{} {length}", triple(g.spacing().to_array())),
        ),
        row(
            "origin",
            format!("{} {length}", triple(g.origin().to_array())),
        ),
    ];
    if !lattice.is_whole() {
        let [a, b, c] = lattice.dims;
        rows.push(row(
            "shown",
            format!("{a} × {b} × {c}, one of {} along each axis", lattice.stride),
        ));
    }
    Group {
        title: "Grid",
        rows,
    }
}

fn bounds(bounds: Option<[[f64; 3]; 2]>, units: &str) -> [String; 2] {
    let shown = bounds.map(|[low, high]| {
        let axes = (0..3).map(|a| format!("{} {} … {}", ["x", "y", "z"][a], low[a], high[a]));
        format!(
            "{} {}",
            axes.collect::<Vec<_>>().join("\n"),
            power(units, 1)
        )
    });
    row("bounds", shown.unwrap_or_else(|| "unknown".into()))
}

/// What was counted while a scene's layers were sampled.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Counted {
    pub(super) inside: u64,
    pub(super) fraction: Option<f64>,
}

/// The facts of a scene.
pub(super) fn of_scene(
    scene: &Scene,
    lattice: &Lattice,
    counted: Option<Counted>,
    channels: &[Stored],
) -> Vec<Group> {
    let units = scene.model().units.name();
    let (square, cube) = (power(units, 2), power(units, 3));
    let known = |i: Integral| (i.value, Some(i.error));
    let b = scene.bounds();
    let mut solid = vec![
        integral("volume", scene.volume_beside_sampling().map(known), &cube),
        integral("area", scene.area_beside_sampling().map(known), &square),
        bounds(Some([b.min.to_array(), b.max.to_array()]), units),
        row("unit of length", power(units, 1)),
    ];
    let names: Vec<&str> = scene.assembly().parts().iter().map(|p| p.name()).collect();
    solid.push(row(
        if names.len() == 1 { "solid" } else { "solids" },
        names.join("\n"),
    ));
    let mut sampled = grid(lattice, units);
    if let Some(counted) = counted {
        let voxel = lattice.grid.voxel_volume();
        sampled
            .rows
            .push(row("voxels inside", counted.inside.to_string()));
        #[allow(clippy::cast_precision_loss, reason = "a count of voxels")]
        let volume = counted.inside as f64 * voxel;
        sampled
            .rows
            .push(row("volume by occupancy", format!("{volume} {cube}")));
        if let Some(sum) = counted.fraction {
            let volume = sum * voxel;
            sampled
                .rows
                .push(row("volume by fraction", format!("{volume} {cube}")));
        }
    }
    let source = Group {
        title: "Source",
        rows: vec![
            row("scene, BLAKE3", scene.hash()),
            row("made by", format!("voxlathe {}", env!("CARGO_PKG_VERSION"))),
        ],
    };
    vec![
        Group {
            title: "Solid",
            rows: solid,
        },
        sampled,
        values(channels),
        source,
    ]
}

/// The digests of the channels that are shown whole, by which others tell that they have the same.
fn values(channels: &[Stored]) -> Group {
    let known = |c: &Stored| Some(row(&c.head.name, c.digest.as_deref()?));
    Group {
        title: "Values, BLAKE3",
        rows: channels.iter().filter_map(known).collect(),
    }
}

/// The facts of a stack, as its manifest has them.
pub(super) fn of_stack(
    manifest: &Manifest,
    digest: &str,
    lattice: &Lattice,
    channels: &[Stored],
) -> Vec<Group> {
    let units = manifest.units.as_str();
    let cube = power(units, 3);
    let volume = manifest
        .volume_exact
        .map(|v| (v, manifest.volume_exact_error));
    let solid = vec![
        integral("volume", volume, &cube),
        bounds(manifest.bounds, units),
        row("unit of length", power(units, 1)),
    ];
    let mut sampled = grid(lattice, units);
    if let Some(inside) = manifest.voxels_inside {
        sampled.rows.push(row("voxels inside", inside.to_string()));
    }
    for (name, volume) in [
        ("volume by occupancy", manifest.volume_occupancy),
        ("volume by fraction", manifest.volume_fraction),
    ] {
        if let Some(volume) = volume {
            sampled.rows.push(row(name, format!("{volume} {cube}")));
        }
    }
    let mut source = vec![
        row(
            "files",
            format!(
                "{}, {}, digests verified",
                manifest.files.len(),
                manifest.formats.join(", ")
            ),
        ),
        row("manifest, BLAKE3", digest),
    ];
    if let Some(hash) = &manifest.scene_hash {
        source.push(row("scene, BLAKE3", hash.as_str()));
    }
    source.push(row("written by", format!("voxlathe {}", manifest.version)));
    source.push(row(
        "made by",
        format!("voxlathe {}", env!("CARGO_PKG_VERSION")),
    ));
    vec![
        Group {
            title: "Solid",
            rows: solid,
        },
        sampled,
        values(channels),
        Group {
            title: "Source",
            rows: source,
        },
    ]
}
