//! VTK image data: `NAME.vti`, every channel an array of one file.
//!
//! ```text
//!   values of cells    extent 0 nx 0 ny 0 nz            origin: the corner of the first voxel
//!   values of points   extent 0 nx-1 0 ny-1 0 nz-1      origin: the centre of the first voxel
//!
//!   raw      <?xml ...> _ [length samples] [length samples] ...  </VTKFile>   every place is known
//!   base64   <?xml ...> <DataArray> digits </DataArray> ...      </VTKFile>   every place is known
//!   zlib     <?xml ...> _ [count size last sizes.. blocks..] ... </VTKFile>   a block is some layers
//! ```
//!
//! x is fastest, as VTK has it. The file is little-endian with 64-bit lengths, which VTK has read since version 6.
//!
//! Source: Kitware, *VTK XML Formats* (VTK file formats, wiki).

mod base64;
mod head;
mod placed;
mod zlib;

use super::error::IoError;
use super::format::{BUFFER, Description, Format, Needs, SMALL, VtiEncoding, digest_bytes};
use super::nrrd;
use super::staged::StagedFiles;

pub(super) fn needs(of: &Description, encoding: VtiEncoding, _points: bool) -> Needs {
    let count = of.channels.len() as u64;
    let arrays = of.voxel_bytes();
    let heads = SMALL.saturating_mul(count + 1);
    let layers = of.grid.dims()[2] as u64;
    let largest = of.channels.iter().map(|c| of.layer_bytes(c) as u64).max();
    match encoding {
        VtiEncoding::Raw => Needs {
            disk: arrays.saturating_add(heads),
            disk_is_sure: true,
            memory: digest_bytes(arrays),
            each: BUFFER,
        },
        VtiEncoding::Base64 => {
            let digits = (arrays / 3).saturating_mul(4);
            Needs {
                disk: digits.saturating_add(heads),
                disk_is_sure: true,
                memory: digest_bytes(digits) + 128 * layers * count,
                each: BUFFER + largest.unwrap_or(0) * 3 / 2,
            }
        }
        VtiEncoding::Zlib => Needs {
            // All arrays but the first wait in files of their own.
            disk: (arrays + arrays / 1000 + 64 * layers * count).saturating_mul(2) + heads,
            disk_is_sure: false,
            memory: nrrd::kept(of) + 16 * layers * count,
            each: nrrd::compressed_bytes(of),
        },
    }
}

pub(super) fn begin(
    files: &StagedFiles,
    of: &Description,
    encoding: VtiEncoding,
    points: bool,
) -> Result<Box<dyn Format>, IoError> {
    Ok(match encoding {
        VtiEncoding::Raw => Box::new(placed::Appended::begin(files, of, points)?),
        VtiEncoding::Base64 => Box::new(base64::Inline::begin(files, of, points)?),
        VtiEncoding::Zlib => Box::new(zlib::Blocks::begin(files, of, points)?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::exr::SampleKind;
    use crate::io::format::FormatKind;
    use crate::io::format::tests::{description, float, orders, written};

    fn text(encoding: VtiEncoding, points: bool, order: &[usize]) -> Vec<u8> {
        let of = description(&[("occupancy", SampleKind::Half), ("sdf", SampleKind::Float)]);
        let dir = tempfile::tempdir().unwrap();
        let kind = FormatKind::Vti { encoding, points };
        let records = written(dir.path(), kind, &of, order);
        assert_eq!(records.len(), 1);
        assert_eq!(records[0].name, "a_ball.vti");
        std::fs::read(dir.path().join("a_ball.vti")).unwrap()
    }

    fn find(bytes: &[u8], what: &str) -> usize {
        let place = bytes.windows(what.len()).position(|w| w == what.as_bytes());
        place.unwrap_or_else(|| panic!("no {what}")) + what.len()
    }

    fn number(bytes: &[u8], at: usize) -> usize {
        u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
    }

    fn wanted() -> [Vec<u8>; 2] {
        let masks = (0..385).map(|i| u8::from(i % 3 == 0)).collect();
        [
            masks,
            (0..385).flat_map(|n| float(n).to_le_bytes()).collect(),
        ]
    }

    #[test]
    fn appended_arrays_are_where_the_head_says() {
        for order in orders(11) {
            let bytes = text(VtiEncoding::Raw, false, &order);
            find(
                &bytes,
                "WholeExtent=\"0 7 0 5 0 11\" Origin=\"-1.25 0.1 7.0\" Spacing=\"0.5 0.3 0.7\"",
            );
            let start = find(&bytes, "encoding=\"raw\">_");
            let mut at = start;
            for array in wanted() {
                find(&bytes, &format!("offset=\"{}\"", at - start));
                assert_eq!(number(&bytes, at), array.len());
                assert!(bytes[at + 8..].starts_with(&array));
                at += 8 + array.len();
            }
            assert!(bytes[at..].starts_with(b"\n  </AppendedData>"));
        }
    }

    #[test]
    fn points_are_at_the_centres() {
        let bytes = text(VtiEncoding::Raw, true, &orders(11)[0]);
        find(
            &bytes,
            "WholeExtent=\"0 6 0 4 0 10\" Origin=\"-1.0 0.25 7.35\"",
        );
        find(&bytes, "<PointData Scalars=\"occupancy\">");
    }

    #[test]
    fn blocks_of_deflate_hold_whole_layers() {
        use std::io::Read as _;
        for order in orders(11) {
            let bytes = text(VtiEncoding::Zlib, false, &order);
            find(&bytes, "compressor=\"vtkZLibDataCompressor\"");
            let start = find(&bytes, "encoding=\"raw\">_");
            let mut at = start;
            for array in wanted() {
                find(&bytes, &format!("offset=\"{}\"", at - start));
                let [count, size, last] = [0, 8, 16].map(|n| number(&bytes, at + n));
                let blocks = if last == 0 { count } else { count - 1 };
                assert_eq!(blocks * size + last, array.len());
                let sizes: Vec<usize> = (0..count)
                    .map(|b| number(&bytes, at + 24 + 8 * b))
                    .collect();
                at += 24 + 8 * count;
                let mut found = Vec::new();
                for size in sizes {
                    let mut block = flate2::bufread::ZlibDecoder::new(&bytes[at..at + size]);
                    block.read_to_end(&mut found).unwrap();
                    at += size;
                }
                assert_eq!(found, array);
            }
        }
    }

    #[test]
    fn digits_are_those_of_length_and_samples() {
        for order in orders(11) {
            let bytes = text(VtiEncoding::Base64, false, &order);
            for (name, array) in ["occupancy", "sdf"].into_iter().zip(wanted()) {
                let start = find(&bytes, &format!("Name=\"{name}\" format=\"binary\">\n"));
                let length = (array.len() as u64).to_le_bytes();
                let digits = base64::tests::plain(&[&length[..], &array].concat());
                assert!(bytes[start..].starts_with(digits.as_bytes()), "{name}");
                assert!(bytes[start + digits.len()..].starts_with(b"\n"));
            }
        }
    }
}
