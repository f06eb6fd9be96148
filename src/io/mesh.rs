//! Triangles to files: `.stl`, `.obj` and `.ply`.
//!
//! * `.stl`: binary. Single precision, every triangle with its own three corners; corners that were
//!   one vertex stay bit-identical. Readers that join equal corners get the mesh back, as long as
//!   vertices differ by more than the rounding to f32.
//! * `.obj`: text, the shortest digits that give the same f64; indices from 1.
//! * `.ply`: binary, little endian, coordinates as `double`, faces as lists of `int`.
//!
//! Source: the STL format of 3D Systems' *StereoLithography Interface Specification* (1989); G. Turk, *The
//! PLY Polygon File Format* (1994).

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::error::IoError;
use super::single::write_file_atomically;

/// Bytes in the header of a binary STL file.
const STL_HEADER: usize = 80;

/// What the end of a file's name says about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Stl,
    Obj,
    Ply,
}

impl Format {
    fn of(path: &Path) -> Result<Self, IoError> {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            Some("stl") => Ok(Self::Stl),
            Some("obj") => Ok(Self::Obj),
            Some("ply") => Ok(Self::Ply),
            _ => Err(IoError::MeshFormat { path: path.into() }),
        }
    }
}

/// Checks that a file of that name can be a mesh.
///
/// # Errors
/// [`IoError::MeshFormat`] when its name does not end in .stl, .obj or .ply.
pub fn check_mesh_name(path: impl AsRef<Path>) -> Result<(), IoError> {
    Format::of(path.as_ref()).map(|_| ())
}

/// Writes triangles as the end of the file's name says; the file appears only when it is whole.
///
/// * `vertices`: coordinates, finite.
/// * `triangles`: indices of vertices, counter-clockwise seen from outside.
/// * `note`: one line of ASCII for the header; what does not fit is left out.
///
/// # Errors
/// [`IoError::MeshFormat`] when the name has no known ending, [`IoError::MeshRange`] when a coordinate is
/// beyond the format's numbers, [`IoError::Write`] when the system refuses.
pub fn write_mesh(
    path: impl AsRef<Path>,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    note: &str,
) -> Result<(), IoError> {
    let path = path.as_ref();
    let format = Format::of(path)?;
    if format == Format::Stl {
        let far = vertices.iter().map(|v| v.abs().max_element());
        if let Some(found) = far.into_iter().find(|&v| !(v <= f64::from(f32::MAX))) {
            return Err(IoError::MeshRange {
                path: path.into(),
                found,
            });
        }
    }
    write_file_atomically(path, |file| match format {
        Format::Stl => write_stl(file, vertices, triangles, note),
        Format::Obj => write_obj(file, vertices, triangles, note),
        Format::Ply => write_ply(file, vertices, triangles, note),
    })
}

fn write_stl(
    file: &mut dyn Write,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    note: &str,
) -> io::Result<()> {
    let count = u32::try_from(triangles.len())
        .map_err(|_| io::Error::other("an STL file holds at most 2^32 - 1 triangles"))?;
    // A text STL begins with "solid"; this must not.
    let mut header = format!("binary STL, {note}").into_bytes();
    header.resize(STL_HEADER, b' ');
    file.write_all(&header)?;
    file.write_all(&count.to_le_bytes())?;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let mut record = [0; 50];
        let values = [normal, a, b, c].into_iter().flat_map(|v| v.to_array());
        for (bytes, value) in record.chunks_exact_mut(4).zip(values) {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "the format is single precision"
            )]
            bytes.copy_from_slice(&(value as f32).to_le_bytes());
        }
        file.write_all(&record)?;
    }
    Ok(())
}

fn write_obj(
    file: &mut dyn Write,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    note: &str,
) -> io::Result<()> {
    writeln!(file, "# {note}")?;
    for v in vertices {
        writeln!(file, "v {:?} {:?} {:?}", v.x, v.y, v.z)?;
    }
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| u64::from(i) + 1);
        writeln!(file, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn write_ply(
    file: &mut dyn Write,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    note: &str,
) -> io::Result<()> {
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\ncomment {note}\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    )?;
    for v in vertices {
        for value in v.to_array() {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    for triangle in triangles {
        file.write_all(&[3])?;
        for &i in triangle {
            let i = i32::try_from(i)
                .map_err(|_| io::Error::other("a PLY file indexes at most 2^31 vertices"))?;
            file.write_all(&i.to_le_bytes())?;
        }
    }
    Ok(())
}
