//! Points in, columns of results out: `.csv` and `.npy`.
//!
//! * `.csv`: one point a line, `x, y, z` with commas or blanks between, in double quotes or not; an optional header
//!   line of names; what follows `#` is a comment. Results have a header line and the shortest digits that
//!   give the same f64.
//! * `.npy`: little-endian float64 (float32 is widened) of shape (n, 3), in C or Fortran order,
//!   format versions 1 to 3. Results are float64 of shape (n, columns) in C order.
//!
//! Nothing is allocated on the word of a file: an array's shape must agree with the size of the
//! file, and lines are read one by one with a limit on their length. Files are regular ones, of at most
//! [`MAX_POINTS`] points.
//!
//! Source: NumPy Enhancement Proposal 1, *A simple file format for NumPy arrays*.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;

use glam::DVec3;

use super::error::IoError;
use super::regular::open_regular;
use super::single::write_file_atomically;

/// A longer line is no point; three numbers of 17 digits take 80 bytes.
const MAX_LINE: u64 = 64 << 10;

/// A header of an array file longer than this is refused; those of plain arrays take 118 bytes.
const MAX_HEADER: usize = 64 << 10;

/// The most points that are read: their answers take some 100 bytes each.
pub const MAX_POINTS: usize = 1 << 26;

const NPY_MAGIC: &[u8; 6] = b"\x93NUMPY";

/// What the end of a file's name says about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Table {
    Csv,
    Npy,
}

impl Table {
    fn of(path: &Path) -> Result<Self, IoError> {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("npy") => Ok(Self::Npy),
            _ => Err(IoError::TableFormat { path: path.into() }),
        }
    }
}

/// The points in the `.csv` or `.npy` file `path`, in their order; all are finite.
///
/// # Errors
/// [`IoError::Read`] when the file cannot be read; [`IoError::TableFormat`],
/// [`IoError::PointLine`], [`IoError::PointNotFinite`] and [`IoError::Array`] say what is wrong in
/// it and where.
pub fn read_points(path: impl AsRef<Path>) -> Result<Vec<DVec3>, IoError> {
    let path = path.as_ref();
    let table = Table::of(path)?;
    let file = open_regular(path).map_err(IoError::open(path))?;
    match table {
        Table::Csv => read_csv(path, BufReader::new(file), MAX_POINTS),
        Table::Npy => {
            let data = file.metadata().map_err(IoError::read(path))?;
            read_npy(path, BufReader::new(file), data.len())
        }
    }
}

/// The points of a `.csv` that comes from elsewhere than a file.
///
/// * `name`: what it is called in errors.
///
/// # Errors
/// Those of [`read_points`] for a `.csv`.
///
/// ```
/// # use voxlathe::io::points::read_csv_points;
/// let found = read_csv_points("<stdin>", "x,y,z\n1,2,3\n".as_bytes())?;
/// assert_eq!(found, [glam::DVec3::new(1.0, 2.0, 3.0)]);
/// # Ok::<(), voxlathe::io::IoError>(())
/// ```
pub fn read_csv_points(
    name: impl AsRef<Path>,
    reader: impl BufRead,
) -> Result<Vec<DVec3>, IoError> {
    read_csv(name.as_ref(), reader, MAX_POINTS)
}

/// A field and its column in characters, from 1.
type Field<'a> = (usize, &'a str);

/// Splits at commas and blanks: one comma with blanks around it, or blanks alone, end a field.
fn fields(line: &str) -> Vec<Field<'_>> {
    let blank = |c: char| c == ' ' || c == '\t';
    let mut found = Vec::new();
    let mut column = 1;
    let mut rest = line;
    let skip = |rest: &mut &str, column: &mut usize| {
        let trimmed = rest.trim_start_matches(blank);
        // Blanks are one byte each.
        *column += rest.len() - trimmed.len();
        *rest = trimmed;
    };
    skip(&mut rest, &mut column);
    if rest.is_empty() {
        return found;
    }
    loop {
        let end = rest.find(|c| blank(c) || c == ',').unwrap_or(rest.len());
        let (field, tail) = rest.split_at(end);
        found.push((column, field));
        column += field.chars().count();
        rest = tail;
        skip(&mut rest, &mut column);
        if let Some(tail) = rest.strip_prefix(',') {
            column += 1;
            rest = tail;
            skip(&mut rest, &mut column);
        } else if rest.is_empty() {
            return found;
        }
    }
}

/// A field without the double quotes that programs of tables put even numbers in.
fn unquoted(field: &str) -> &str {
    let inner = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
    inner.unwrap_or(field)
}

fn read_csv(path: &Path, mut reader: impl BufRead, most: usize) -> Result<Vec<DVec3>, IoError> {
    let mut points = Vec::new();
    let mut header_allowed = true;
    let mut bytes = Vec::new();
    for line in 1_u64.. {
        bytes.clear();
        (&mut reader)
            .take(MAX_LINE)
            .read_until(b'\n', &mut bytes)
            .map_err(IoError::read(path))?;
        if bytes.is_empty() {
            break;
        }
        let refuse = |column, value: &str, reason| {
            Err(IoError::PointLine {
                path: path.into(),
                line,
                column,
                value: value.chars().take(40).collect(),
                reason,
            })
        };
        let text = String::from_utf8_lossy(&bytes);
        if bytes.len() as u64 == MAX_LINE && !bytes.ends_with(b"\n") {
            return refuse(1, &text, "the line is too long");
        }
        let text = text.trim_end_matches(['\n', '\r']);
        let text = if line == 1 {
            text.trim_start_matches('\u{feff}')
        } else {
            text
        };
        let text = text.split('#').next().unwrap_or_default();
        let fields = fields(text);
        if fields.is_empty() {
            continue;
        }
        // Three names are a header; a number with a slip among numbers is not.
        let is_name = |field: &str| {
            !field.is_empty()
                && field.parse::<f64>().is_err()
                && !field.starts_with(|c: char| c.is_ascii_digit())
        };
        let is_header =
            header_allowed && fields.len() == 3 && fields.iter().all(|f| is_name(unquoted(f.1)));
        header_allowed = false;
        if is_header {
            continue;
        }
        let mut point = [0.0; 3];
        for (n, value) in point.iter_mut().enumerate() {
            let Some(&(column, field)) = fields.get(n) else {
                let end = text.trim_end().chars().count() + 1;
                return refuse(end, "", "three numbers are wanted");
            };
            *value = match unquoted(field).parse::<f64>() {
                Ok(value) if value.is_finite() => value,
                Ok(_) => return refuse(column, field, "a finite number is wanted"),
                Err(_) => return refuse(column, field, "a number is wanted"),
            };
        }
        if let Some(&(column, field)) = fields.get(3) {
            return refuse(column, field, "three numbers are wanted, not more");
        }
        if points.len() >= most {
            let (column, field) = fields[0];
            return refuse(column, field, TOO_MANY);
        }
        points.push(DVec3::from(point));
    }
    Ok(points)
}

const TOO_MANY: &str = "no more than 67108864 points are read from a file, split it";
const _: () = assert!(MAX_POINTS == 67_108_864);

fn array(path: &Path, reason: String) -> IoError {
    IoError::Array {
        path: path.into(),
        reason,
    }
}

/// What the header of an array file says.
#[derive(Debug, PartialEq)]
struct NpyHeader {
    descr: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

fn read_npy(path: &Path, mut reader: impl Read, size: u64) -> Result<Vec<DVec3>, IoError> {
    let refuse = |reason: String| Err(array(path, reason));
    let mut read = |buffer: &mut [u8]| match reader.read_exact(buffer) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            Err(array(path, "the file ends within its header".into()))
        }
        other => other.map_err(IoError::read(path)),
    };
    let mut start = [0; 8];
    read(&mut start)?;
    if start[..6] != *NPY_MAGIC {
        return refuse("it does not start as a .npy file does".into());
    }
    let length_bytes: usize = match start[6] {
        1 => 2,
        2 | 3 => 4,
        other => return refuse(format!("its format version is {other}, not 1, 2 or 3")),
    };
    let mut length = [0; 4];
    read(&mut length[..length_bytes])?;
    let length = u32::from_le_bytes(length) as usize;
    let data_start = 8 + length_bytes as u64 + length as u64;
    if length > MAX_HEADER || data_start > size {
        return refuse(format!(
            "its header claims {length} bytes of a file of {size}"
        ));
    }
    let mut text = vec![0; length];
    read(&mut text)?;
    let text = String::from_utf8_lossy(&text);
    let header = parse_npy_header(&text).ok_or_else(|| {
        let shown: String = text.trim().chars().take(80).collect();
        array(
            path,
            format!("its header {shown:?} is not that of a plain array"),
        )
    })?;
    let width = match header.descr.as_str() {
        "<f8" => 8,
        "<f4" => 4,
        other => return refuse(format!("its samples are {other:?}, not \"<f8\" or \"<f4\"")),
    };
    let &[rows, 3] = header.shape.as_slice() else {
        let shape: Vec<_> = header.shape.iter().map(u64::to_string).collect();
        return refuse(format!("its shape is ({}), not (n, 3)", shape.join(", ")));
    };
    let promised = rows.checked_mul(3 * width);
    if promised != Some(size - data_start) {
        return refuse(format!(
            "its shape ({rows}, 3) does not fit the {} bytes after its header",
            size - data_start
        ));
    }
    let Some(count) = usize::try_from(rows).ok().filter(|n| *n <= MAX_POINTS) else {
        return refuse(format!(
            "its {rows} rows are more than {MAX_POINTS}, the most that are read"
        ));
    };
    let mut points = vec![DVec3::ZERO; count];
    let mut sample = [0; 8];
    let mut next = || -> Result<f64, IoError> {
        if width == 8 {
            read(&mut sample)?;
            Ok(f64::from_le_bytes(sample))
        } else {
            read(&mut sample[..4])?;
            let [a, b, c, d, ..] = sample;
            Ok(f64::from(f32::from_le_bytes([a, b, c, d])))
        }
    };
    let finite = |row: usize, column: usize, value: f64| {
        if value.is_finite() {
            return Ok(value);
        }
        Err(IoError::PointNotFinite {
            path: path.into(),
            row: row as u64,
            column,
            value,
        })
    };
    if header.fortran_order {
        for column in 0..3 {
            for (row, point) in points.iter_mut().enumerate() {
                point[column] = finite(row, column, next()?)?;
            }
        }
    } else {
        for (row, point) in points.iter_mut().enumerate() {
            for column in 0..3 {
                point[column] = finite(row, column, next()?)?;
            }
        }
    }
    Ok(points)
}

/// The three entries of the Python dictionary literal that a header is, in any order.
fn parse_npy_header(text: &str) -> Option<NpyHeader> {
    let mut descr = None;
    let mut fortran_order = None;
    let mut shape = None;
    let mut rest = text.trim().strip_prefix('{')?.trim_start();
    loop {
        if let Some(after) = rest.strip_prefix('}') {
            return after.is_empty().then_some(NpyHeader {
                descr: descr?,
                fortran_order: fortran_order?,
                shape: shape?,
            });
        }
        let (key, after) = quoted(rest)?;
        rest = after.trim_start().strip_prefix(':')?.trim_start();
        match key {
            "descr" if descr.is_none() => {
                let (value, after) = quoted(rest)?;
                descr = Some(value.to_owned());
                rest = after;
            }
            "fortran_order" if fortran_order.is_none() => {
                let (value, after) = match rest.strip_prefix("True") {
                    Some(after) => (true, after),
                    None => (false, rest.strip_prefix("False")?),
                };
                fortran_order = Some(value);
                rest = after;
            }
            "shape" if shape.is_none() => {
                let (list, after) = rest.strip_prefix('(')?.split_once(')')?;
                let list = list.trim();
                let list = list.strip_suffix(',').unwrap_or(list);
                let sides = list.split(',').map(str::trim).filter(|s| !s.is_empty());
                shape = Some(sides.map(|s| s.parse().ok()).collect::<Option<_>>()?);
                rest = after;
            }
            _ => return None,
        }
        rest = rest.trim_start();
        match rest.strip_prefix(',') {
            Some(after) => rest = after.trim_start(),
            None if rest.starts_with('}') => {}
            None => return None,
        }
    }
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

/// Writes columns of results to the `.csv` or `.npy` file `path`, whole or not at all.
///
/// * `columns`: name and values of each; the names are the header line of a `.csv`.
///
/// # Errors
/// [`IoError::TableFormat`] when the name tells no format, [`IoError::Mismatch`] when the columns
/// differ in length, [`IoError::Write`] when the system refuses.
pub fn write_columns(path: impl AsRef<Path>, columns: &[(&str, &[f64])]) -> Result<(), IoError> {
    let path = path.as_ref();
    let table = Table::of(path)?;
    let rows = columns.first().map_or(0, |c| c.1.len());
    if let Some(other) = columns.iter().find(|c| c.1.len() != rows) {
        return Err(IoError::Mismatch {
            path: path.into(),
            reason: format!(
                "column {:?} has {} values and {:?} has {rows}; each needs one for each point",
                other.0,
                other.1.len(),
                columns[0].0
            ),
        });
    }
    write_file_atomically(path, |out| match table {
        Table::Csv => write_csv(out, columns),
        Table::Npy => write_npy(out, rows, columns),
    })
}

/// Writes columns of results as comma-separated values with a header line.
///
/// Columns are cut to the shortest.
///
/// # Errors
/// What `out` returns.
///
/// ```
/// # use voxlathe::io::points::write_csv;
/// let mut out = Vec::new();
/// write_csv(&mut out, &[("inside", &[1.0, 0.0]), ("sdf", &[-0.1, 2e-20])])?;
/// assert_eq!(out, b"inside,sdf\n1,-0.1\n0,2e-20\n");
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_csv<W: Write + ?Sized>(out: &mut W, columns: &[(&str, &[f64])]) -> io::Result<()> {
    let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
    writeln!(out, "{}", names.join(","))?;
    let rows = columns.iter().map(|c| c.1.len()).min().unwrap_or(0);
    for row in 0..rows {
        for (n, (_, values)) in columns.iter().enumerate() {
            if n > 0 {
                out.write_all(b",")?;
            }
            let value = values[row];
            if value.fract() == 0.0 && value.abs() < 1e15 {
                write!(out, "{value}")?;
            } else {
                // The shortest digits that come back, with an exponent where that is shorter.
                write!(out, "{value:?}")?;
            }
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn write_npy<W: Write + ?Sized>(
    out: &mut W,
    rows: usize,
    columns: &[(&str, &[f64])],
) -> io::Result<()> {
    let mut header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {}), }}",
        columns.len()
    );
    // The data start at a multiple of 64, and the header ends with a line feed.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    out.write_all(NPY_MAGIC)?;
    out.write_all(&[1, 0])?;
    let length = u16::try_from(header.len()).map_err(io::Error::other)?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    for row in 0..rows {
        for (_, values) in columns {
            out.write_all(&values[row].to_le_bytes())?;
        }
    }
    Ok(())
}

/// Refuses a name that [`read_points`] and [`write_columns`] would refuse, before any work is done.
///
/// # Errors
/// [`IoError::TableFormat`] when the name ends in neither `.csv` nor `.npy`.
pub fn check_table_name(path: impl AsRef<Path>) -> Result<(), IoError> {
    Table::of(path.as_ref()).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn csv(text: &str) -> Result<Vec<DVec3>, String> {
        read_csv(Path::new("p.csv"), text.as_bytes(), MAX_POINTS).map_err(|e| e.to_string())
    }

    #[test]
    fn csv_takes_commas_blanks_comments_and_a_header() {
        let wanted = vec![DVec3::new(1.0, -2.5, 3e-7), DVec3::new(4.0, 5.0, 6.0)];
        for text in [
            "1,-2.5,3e-7\n4,5,6\n",
            "x,y,z\n1, -2.5 ,3e-7\r\n4\t5 6",
            "\u{feff}# made by hand\n\n  x y z # names\n1 -2.5 3e-7 # first\n\t4 , 5,\t6  \n# end",
            "\"x\",\"y\",\"z\"\n+1,-2.5,0.3e-6\n4.0,5.,6\n",
            "\"1\",\"-2.5\",\"3e-7\"\n4,\"5\",6\n",
        ] {
            assert_eq!(csv(text).as_ref(), Ok(&wanted), "{text:?}");
        }
        assert_eq!(csv(""), Ok(vec![]));
        assert_eq!(csv("x,y,z\n"), Ok(vec![]));
    }

    #[test]
    fn csv_errors_say_where_and_what() {
        let end = "; each line is x, y, z with commas or blanks between";
        for (text, wanted) in [
            (
                "1,2,3\n4,5,six\n",
                "p.csv:2:5: a number is wanted, found \"six\"",
            ),
            (
                "1,2,3\n4,nan,6\n",
                "p.csv:2:3: a finite number is wanted, found \"nan\"",
            ),
            (
                "nan,nan,nan\n",
                "p.csv:1:1: a finite number is wanted, found \"nan\"",
            ),
            (
                "1e400,0,0",
                "p.csv:1:1: a finite number is wanted, found \"1e400\"",
            ),
            ("1,2\n", "p.csv:1:4: three numbers are wanted, found \"\""),
            ("1,2,\n", "p.csv:1:5: a number is wanted, found \"\""),
            ("1,,3\n", "p.csv:1:3: a number is wanted, found \"\""),
            (
                "1 2 3  4\n",
                "p.csv:1:8: three numbers are wanted, not more, found \"4\"",
            ),
            (
                "1,2,3,\n",
                "p.csv:1:7: three numbers are wanted, not more, found \"\"",
            ),
            (
                "x,y,z\nx,y,z\n",
                "p.csv:2:1: a number is wanted, found \"x\"",
            ),
            (
                "1.0,2.o,3\n",
                "p.csv:1:5: a number is wanted, found \"2.o\"",
            ),
            ("hello\n", "p.csv:1:1: a number is wanted, found \"hello\""),
            ("1;2;3\n", "p.csv:1:1: a number is wanted, found \"1;2;3\""),
            (
                "\u{e9} 1 2\n",
                "p.csv:1:1: a number is wanted, found \"\u{e9}\"",
            ),
        ] {
            assert_eq!(csv(text), Err(format!("{wanted}{end}")), "{text:?}");
        }
        let long = "1".repeat(200_000);
        assert!(
            csv(&long)
                .unwrap_err()
                .starts_with("p.csv:1:1: the line is too long, found \"1111")
        );
        assert!(
            read_csv(
                Path::new("p.csv"),
                &b"\xff\xfe\x00 1 2\n1 2 3"[..],
                MAX_POINTS
            )
            .is_err()
        );
    }

    #[test]
    fn points_are_counted() {
        let few = |text: &str| read_csv(Path::new("p.csv"), text.as_bytes(), 2);
        assert_eq!(few("1,2,3\n4,5,6\n# end\n").map_or(0, |p| p.len()), 2);
        assert!(few("1,2,3\n4,5,6\n\n 7,8,9\n").is_err_and(|e| {
            e.to_string()
                .starts_with(&format!("p.csv:4:2: {TOO_MANY}, found \"7\""))
        }));
        let rows = MAX_POINTS as u64 + 1;
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, 3), }}");
        let bytes = npy(1, &header, &[]);
        let size = bytes.len() as u64 + 12 * rows;
        let found = read_npy(Path::new("p.npy"), &bytes[..], size).expect_err("too many");
        assert!(
            found
                .to_string()
                .contains("its 67108865 rows are more than 67108864")
        );
    }

    fn npy(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = NPY_MAGIC.to_vec();
        bytes.extend([version, 0]);
        let n = u32::try_from(header.len()).unwrap().to_le_bytes();
        bytes.extend(&n[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn load(bytes: &[u8]) -> Result<Vec<DVec3>, String> {
        read_npy(Path::new("p.npy"), bytes, bytes.len() as u64).map_err(|e| e.to_string())
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn npy_takes_both_orders_all_versions_and_float32() {
        let wanted = vec![DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
        let c = doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let f = doubles(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
        let singles: Vec<u8> = [1_f32, 2.0, 3.0, 4.0, 5.0, 6.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        for version in 1..=3 {
            for (header, data) in [
                (
                    "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }   \n",
                    &c,
                ),
                (
                    "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }\n",
                    &f,
                ),
                (
                    "{\"shape\":(2,3),\"descr\":\"<f4\",\"fortran_order\":False}",
                    &singles,
                ),
            ] {
                assert_eq!(
                    load(&npy(version, header, data)),
                    Ok(wanted.clone()),
                    "{header}"
                );
            }
        }
        let empty = "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 3), }";
        assert_eq!(load(&npy(1, empty, &[])), Ok(vec![]));
    }

    #[test]
    fn npy_abuse_is_refused_with_reasons() {
        let end = "; save the points as a little-endian float64 array of shape (n, 3)";
        let header = |descr: &str, shape: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}")
        };
        let data = doubles(&[1.0; 6]);
        let good = npy(1, &header("<f8", "(2, 3)"), &data);
        for (bytes, wanted) in [
            (
                b"PK\x03\x04 not an array".to_vec(),
                "it does not start as a .npy file does",
            ),
            (b"\x93NUM".to_vec(), "the file ends within its header"),
            (npy(9, "", &[]), "its format version is 9, not 1, 2 or 3"),
            (good[..9].to_vec(), "the file ends within its header"),
            (
                good[..40].to_vec(),
                "its header claims 59 bytes of a file of 40",
            ),
            (
                [NPY_MAGIC.as_slice(), &[2, 0, 255, 255, 255, 255]].concat(),
                "its header claims 4294967295 bytes of a file of 12",
            ),
            (
                npy(1, &header(">f8", "(2, 3)"), &data),
                "its samples are \">f8\", not \"<f8\" or \"<f4\"",
            ),
            (
                npy(1, &header("<i8", "(2, 3)"), &data),
                "its samples are \"<i8\", not \"<f8\" or \"<f4\"",
            ),
            (
                npy(1, &header("<f8", "(6,)"), &data),
                "its shape is (6), not (n, 3)",
            ),
            (
                npy(1, &header("<f8", "()"), &data),
                "its shape is (), not (n, 3)",
            ),
            (
                npy(1, &header("<f8", "(3, 2)"), &data),
                "its shape is (3, 2), not (n, 3)",
            ),
            (
                npy(1, &header("<f8", "(3, 3)"), &data),
                "its shape (3, 3) does not fit the 48 bytes after its header",
            ),
            (
                npy(1, &header("<f8", "(18446744073709551615, 3)"), &data),
                "its shape (18446744073709551615, 3) does not fit the 48 bytes after its header",
            ),
            (
                npy(1, "{'descr': [('x', '<f8')]}", &data),
                "its header \"{'descr': [('x', '<f8')]}\" is not that of a plain array",
            ),
            (
                npy(1, "", &data),
                "its header \"\" is not that of a plain array",
            ),
        ] {
            assert_eq!(load(&bytes), Err(format!("p.npy: {wanted}{end}")));
        }
        for text in [
            header("<f8", "(2, 99999999999999999999)"),
            header("<f8", "(-2, 3)"),
            header("<f8", "(2, 3"),
            "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}".into(),
            "{'descr': '<f8', 'fortran_order': Maybe, 'shape': (2, 3)}".into(),
            "{'descr': '<f8', 'fortran_order': False}".into(),
            header("<f8", "(2, 3)") + "x",
            "{\u{e9}".into(),
        ] {
            assert!(load(&npy(1, &text, &data)).is_err(), "{text}");
        }
        for cut in 0..good.len() {
            assert!(load(&good[..cut]).is_err(), "cut at {cut}");
        }
        let nan = npy(
            1,
            &header("<f8", "(2, 3)"),
            &doubles(&[1.0, 1.0, 1.0, 1.0, f64::NAN, 1.0]),
        );
        assert_eq!(
            load(&nan),
            Err("p.npy: row 1, column 1 is NaN; points must be finite".into())
        );
    }

    #[test]
    fn results_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let points = [
            [0.1, -2.0, 1e300],
            [f64::MIN_POSITIVE, 1.0 / 3.0, -0.0],
            [5e-324, 123_456_789.125, 1e15],
        ];
        let columns: Vec<Vec<f64>> = (0..3)
            .map(|c| points.iter().map(|p| p[c]).collect())
            .collect();
        let table: Vec<(&str, &[f64])> = ["x", "y", "z"]
            .into_iter()
            .zip(columns.iter().map(Vec::as_slice))
            .collect();
        for name in ["r.csv", "r.NPY"] {
            let path = dir.path().join(name);
            write_columns(&path, &table).unwrap();
            let found = read_points(&path).unwrap();
            for (a, b) in found.iter().zip(&points) {
                assert_eq!(a.to_array().map(f64::to_bits), b.map(f64::to_bits));
            }
            assert_eq!(found.len(), 3);
        }
        let bytes = fs::read(dir.path().join("r.NPY")).unwrap();
        assert_eq!(bytes.len(), 128 + 72);
        let error = write_columns(
            dir.path().join("r.csv"),
            &[("inside", &[1.0]), ("sdf", &[1.0, 2.0])],
        );
        assert!(error.unwrap_err().to_string().ends_with(
            "r.csv: column \"sdf\" has 2 values and \"inside\" has 1; each needs one for each point"
        ));
    }

    #[test]
    fn names_tell_the_format() {
        assert_eq!(
            read_points("points.txt").unwrap_err().to_string(),
            "points.txt: cannot tell the format from the name; it must end in .csv or .npy"
        );
        assert!(check_table_name("a.CSV").is_ok());
        assert!(check_table_name("csv").is_err());
        assert!(matches!(
            read_points("no/such.csv"),
            Err(IoError::Read { .. })
        ));
        let dir = tempfile::tempdir().unwrap();
        let odd = dir.path().join("dir.npy");
        fs::create_dir(&odd).unwrap();
        assert!(read_points(&odd).is_err());
    }
}
