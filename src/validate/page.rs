//! The report as a page that needs no other file.

use super::Report;
use crate::page::{escaped, mark, sheet, table};
use std::fmt::Write;

/// What a page says of where a report comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading<'a> {
    /// The scene's name.
    pub scene: &'a str,
    /// BLAKE3 of the resolved scene.
    pub hash: &'a str,
    /// The scene's unit of length.
    pub units: &'a str,
    /// Voxels of the grid.
    pub dims: [usize; 3],
    /// Size of a voxel.
    pub spacing: [f64; 3],
}

/// The report as a self-contained HTML page.
#[must_use]
pub fn page(report: &Report, heading: &Heading) -> String {
    let title = format!("voxlathe validate: {}", heading.scene);
    let [nx, ny, nz] = heading.dims;
    let units = heading.units;
    let line = format!("{nx} × {ny} × {nz} voxels of {:?} {units}", heading.spacing);
    let (class, verdict) = if report.is_ok() {
        (
            "ok",
            "Everything agrees, or differs within the proven chord error.",
        )
    } else {
        ("bad", "There are differences that nothing explains.")
    };
    let mut html = format!(
        "<section class=\"card\"><p class=\"verdict {class}\">{verdict}</p>\n<p>scene <code>{}</code></p></section>\n",
        escaped(heading.hash)
    );
    html += &table(
        "Membership",
        &["points", "agree", "within chord error", "disagree"],
        &[[
            report.samples,
            report.agree,
            report.within_chord_error,
            report.disagree,
        ]
        .map(|n| n.to_string())
        .to_vec()],
    );
    let meshes: Vec<Vec<String>> = report
        .meshes
        .iter()
        .map(|m| {
            vec![
                escaped(&m.name),
                m.triangles.to_string(),
                format!("{:.3e}", m.chord_error),
                mark(m.closed),
                m.euler_characteristic.to_string(),
                m.volume.to_string(),
            ]
        })
        .collect();
    html += &table(
        "Triangles",
        &[
            "solid",
            "triangles",
            "chord error",
            "closed",
            "Euler characteristic",
            "volume",
        ],
        &meshes,
    );
    let f = &report.field;
    let checks = [
        ("finite", report.samples, f.not_finite),
        (
            "sign is that of the membership",
            report.samples,
            f.wrong_sign,
        ),
        ("no steeper than 1", f.steepness[0], f.steepness[1]),
        ("slope 1 away from the medial axis", f.slope[0], f.slope[1]),
        ("zero where the triangles are", f.zero[0], f.zero[1]),
        ("distance to the triangles", f.distance[0], f.distance[1]),
    ];
    let checks: Vec<Vec<String>> = checks
        .iter()
        .map(|(name, looked, failed)| {
            vec![
                (*name).to_owned(),
                looked.to_string(),
                failed.to_string(),
                mark(*failed == 0),
            ]
        })
        .collect();
    html += &table("Distance", &["check", "looked at", "failed", ""], &checks);
    let _ = writeln!(
        html,
        "<section class=\"card\"><p>Largest ||∇φ| − 1| away from the medial axis {:.2e}; largest difference from the distance to the triangles {:.2e} {units}.</p></section>",
        f.gradient_max_error, f.distance_max_error
    );
    let points: Vec<Vec<String>> = report
        .disagreements
        .iter()
        .flat_map(|d| {
            d.parts.iter().map(move |p| {
                vec![
                    voxel(d.voxel),
                    format!("{:?}", d.point.to_array()),
                    format!("{} / {} / {}", d.inside, d.parity, d.winding),
                    escaped(&p.name),
                    format!("{} / {} / {:.3}", p.inside, p.parity, p.winding),
                    format!("{:e} of {:e}", p.distance, p.chord_error),
                ]
            })
        })
        .collect();
    if !points.is_empty() {
        html += &table(
            "Points where the answers differ",
            &[
                "voxel",
                "point",
                "exact / ray / winding",
                "solid",
                "exact / ray / winding",
                "distance of chord error",
            ],
            &points,
        );
    }
    let violations: Vec<Vec<String>> = f
        .violations
        .iter()
        .map(|v| {
            vec![
                v.check.to_owned(),
                voxel(v.voxel),
                format!("{:?}", v.point.to_array()),
                format!("{:e} of {:e}", v.off[0], v.off[1]),
            ]
        })
        .collect();
    if !violations.is_empty() {
        html += &table(
            "Values that no distance has",
            &["check", "voxel", "point", "off, of what is allowed"],
            &violations,
        );
    }
    sheet(&title, &line, &html)
}

fn voxel(voxel: Option<[usize; 3]>) -> String {
    voxel.map_or_else(|| "—".to_owned(), |v| format!("{v:?}"))
}
