//! ParaView files: the points as a VTU file, the tool's outline as a VTP file, and the VTU read back.
//!
//! Both are VTK XML files with appended raw binary data (VTK file formats, "XML file formats"): a short XML
//! head says which array begins where; behind the `_` follow the arrays, each led by its length in bytes as a
//! 64-bit integer. Everything is little endian. Numbers are stored as 32-bit floats: 7 digits are more than a
//! picture shows, at half the size. Every file names the program's version and the run's parameters, as field
//! data and as a comment.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::Error;
use crate::output::cell_means::cell_means;
use crate::output::point_fields::PointFields;

/// What every file begins with, by which the program knows its own files.
pub const MARK: &str = "written by swarf";

/// Writes the points as vertices with velocity, stress, plastic_strain, temperature, jacobian, mass, id and
/// damage; with the means of their cells, stress_cell, von_mises, pressure and strain_rate
/// (`output::cell_means`); and with tail, 1 for points of the chip's rigid tail.
///
/// * `fields`: SI units; stresses in VTK's order of a symmetric tensor (xx, yy, zz, xy, yz, xz)
/// * `parameters`: names and values in use
///
/// # Errors
/// `Error::File` when the file cannot be written.
pub fn write_points(path: &Path, fields: &PointFields, parameters: &[(String, String)]) -> Result<(), Error> {
    let count = fields.position.len();
    let means = cell_means(fields);
    let mut arrays = Appended::default();
    let points = arrays.floats("Points", 3, fields.position.iter().flatten());
    let vertex_numbers = 0..count as u32;
    let connectivity =
        arrays.raw("Int32", "connectivity", 1, vertex_numbers.clone().flat_map(u32::to_le_bytes));
    let offsets = arrays.raw("Int32", "offsets", 1, vertex_numbers.flat_map(|i| (i + 1).to_le_bytes()));
    // 1 is VTK_VERTEX.
    let types = arrays.raw("UInt8", "types", 1, std::iter::repeat_n(1, count));
    let point_data = [
        arrays.floats("velocity", 3, fields.velocity.iter().flatten()),
        arrays.floats("stress", 6, fields.stress.iter().flat_map(in_vtk_order)),
        arrays.floats("plastic_strain", 1, &fields.plastic_strain),
        arrays.floats("temperature", 1, &fields.temperature),
        arrays.floats("jacobian", 1, &fields.jacobian),
        arrays.floats("mass", 1, &fields.mass),
        arrays.raw("UInt32", "id", 1, fields.id.iter().flat_map(|id| id.to_le_bytes())),
        arrays.floats("damage", 1, &fields.damage),
        arrays.floats("stress_cell", 6, means.stress.iter().flat_map(in_vtk_order)),
        arrays.floats("von_mises", 1, &means.von_mises),
        arrays.floats("pressure", 1, &means.pressure),
        arrays.floats("strain_rate", 1, &means.strain_rate),
        arrays.raw("UInt8", "tail", 1, (0..count).map(|i| u8::from(fields.is_tail(i)))),
    ]
    .concat();
    let head = format!(
        "{}  <UnstructuredGrid>\n{}    <Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\">\n\
         <PointData>\n{point_data}</PointData>\n<Points>\n{points}</Points>\n\
         <Cells>\n{connectivity}{offsets}{types}</Cells>\n    </Piece>\n  </UnstructuredGrid>\n",
        file_head("UnstructuredGrid", parameters),
        field_data(fields.time, parameters),
    );
    arrays.write(path, &head)
}

/// A stress xx, yy, zz, yz, xz, xy in VTK's order.
fn in_vtk_order(stress: &[f64; 6]) -> [&f64; 6] {
    let [xx, yy, zz, yz, xz, xy] = stress;
    [xx, yy, zz, xy, yz, xz]
}

/// Writes a closed polygon in the x-y plane (m), the tool's outline.
///
/// # Errors
/// `Error::File` when the file cannot be written.
pub fn write_outline(
    path: &Path,
    time: f64,
    outline: &[[f64; 2]],
    parameters: &[(String, String)],
) -> Result<(), Error> {
    let count = outline.len();
    let mut arrays = Appended::default();
    let points = arrays.floats("Points", 3, outline.iter().flat_map(|[x, y]| [x, y, &0.0]));
    let connectivity = arrays.raw("Int32", "connectivity", 1, (0..count as u32).flat_map(u32::to_le_bytes));
    let offsets = arrays.raw("Int32", "offsets", 1, (count as u32).to_le_bytes());
    let head = format!(
        "{}  <PolyData>\n{}    <Piece NumberOfPoints=\"{count}\" NumberOfPolys=\"1\">\n<Points>\n{points}</Points>\n\
         <Polys>\n{connectivity}{offsets}</Polys>\n    </Piece>\n  </PolyData>\n",
        file_head("PolyData", parameters),
        field_data(time, parameters),
    );
    arrays.write(path, &head)
}

/// Reads a file of `write_points` and, where it stands beside it, the outline of `write_outline`.
///
/// Reads only this program's own files, and numbers to the 32 bits they were written with.
///
/// # Errors
/// `Error::File` when a file cannot be read, or is not one of this program's.
pub fn read_points(points: &Path, outline: Option<&Path>) -> Result<PointFields, Error> {
    let file = Stored::read(points)?;
    let plain =
        |name: &str| -> Result<Vec<f64>, Error> { Ok(file.floats::<1>(name)?.as_flattened().to_vec()) };
    let mut fields = PointFields {
        time: file.time()?,
        id: file.bytes("id")?.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
        position: file.floats("Points")?,
        velocity: file.floats("velocity")?,
        stress: file.floats::<6>("stress")?.iter().map(|s| [s[0], s[1], s[2], s[4], s[5], s[3]]).collect(),
        plastic_strain: plain("plastic_strain")?,
        temperature: plain("temperature")?,
        jacobian: plain("jacobian")?,
        mass: plain("mass")?,
        damage: plain("damage")?,
        tail: file.bytes("tail")?.iter().map(|byte| *byte != 0).collect(),
        ..PointFields::default()
    };
    if let Some(path) = outline {
        fields.tool_outline =
            Stored::read(path)?.floats::<3>("Points")?.iter().map(|p| [p[0], p[1]]).collect();
    }
    Ok(fields)
}

/// The time (s) of a file of `write_points` or `write_outline`, without the rest.
///
/// # Errors
/// `Error::File` when the file cannot be read, or is not one of this program's.
pub fn read_time(path: &Path) -> Result<f64, Error> {
    Stored::read(path)?.time()
}

/// Text as it may stand in XML, in an attribute too.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML 1.0 has no other control characters.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('?'),
            c => out.push(c),
        }
    }
    out
}

/// A comment with version and parameters; two hyphens in a row, which end a comment, are set apart.
pub fn comment(parameters: &[(String, String)]) -> String {
    let mut out = format!("<!-- {MARK} {}\n", crate::version::VERSION);
    for (name, value) in parameters {
        let mut value = escape(value).replace('\n', " ");
        while value.contains("--") {
            value = value.replace("--", "- -");
        }
        let _ = writeln!(out, "{name} = {value}");
    }
    out.push_str("-->\n");
    out
}

fn file_head(kind: &str, parameters: &[(String, String)]) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n{}<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n",
        comment(parameters)
    )
}

/// Time, version and parameters as VTK field data; VTK writes text as the numbers of its bytes, ended by 0.
fn field_data(time: f64, parameters: &[(String, String)]) -> String {
    let text = |name: &str, lines: &[String]| {
        let mut codes = String::new();
        for line in lines {
            for byte in line.bytes() {
                let _ = write!(codes, "{byte} ");
            }
            codes.push_str("0 ");
        }
        let count = lines.len();
        format!(
            "<Array type=\"String\" Name=\"{name}\" NumberOfTuples=\"{count}\" \
             format=\"ascii\">\n{codes}\n</Array>\n"
        )
    };
    let lines: Vec<String> = parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    format!(
        "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:e}\
         </DataArray>\n{}{}</FieldData>\n",
        text("version", &[format!("swarf {}", crate::version::VERSION)]),
        text("parameters", &lines)
    )
}

/// The arrays behind the head, in the order of their description.
#[derive(Default)]
struct Appended {
    data: Vec<u8>,
}

impl Appended {
    /// Appends an array and gives its description for the head.
    fn raw(
        &mut self,
        kind: &str,
        name: &str,
        components: usize,
        bytes: impl IntoIterator<Item = u8>,
    ) -> String {
        let offset = self.data.len();
        self.data.extend([0; 8]);
        self.data.extend(bytes);
        let length = (self.data.len() - offset - 8) as u64;
        self.data[offset..offset + 8].copy_from_slice(&length.to_le_bytes());
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }

    fn floats<'a>(
        &mut self,
        name: &str,
        components: usize,
        values: impl IntoIterator<Item = &'a f64>,
    ) -> String {
        self.raw("Float32", name, components, values.into_iter().flat_map(|&v| (v as f32).to_le_bytes()))
    }

    fn write(&self, path: &Path, head: &str) -> Result<(), Error> {
        let mut file = format!("{head}<AppendedData encoding=\"raw\">\n_").into_bytes();
        file.extend_from_slice(&self.data);
        file.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
        replace(path, &file)
    }
}

/// Ending of a file that is being written.
pub const PART: &str = ".part";

/// Writes a file beside its place and moves it there, so that a reader finds the old or the new one, never
/// half: not even when the program is killed meanwhile, which leaves a file that ends in `.part`.
///
/// # Errors
/// `Error::File` when it cannot be written.
pub fn replace(path: &Path, content: &[u8]) -> Result<(), Error> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(PART);
    fs::write(&beside, content)
        .and_then(|()| fs::rename(&beside, path))
        .map_err(|e| refused(path, &e.to_string()))
}

/// A file of this program, read back.
struct Stored<'a> {
    path: &'a Path,
    head: String,
    data: Vec<u8>,
}

impl<'a> Stored<'a> {
    fn read(path: &'a Path) -> Result<Self, Error> {
        let mut data = fs::read(path).map_err(|e| refused(path, &e.to_string()))?;
        let start = b"<AppendedData encoding=\"raw\">\n_";
        let end = data.windows(start.len()).position(|w| w == start).map(|at| at + start.len());
        let head = end.and_then(|end| String::from_utf8(data[..end].to_vec()).ok());
        match (head, end) {
            (Some(head), Some(end)) if head.contains(MARK) => {
                data.drain(..end);
                Ok(Stored { path, head, data })
            }
            _ => Err(refused(path, "not a VTK file of this program")),
        }
    }

    /// The text between two others in the head.
    fn between(&self, from: &str, to: &str) -> Result<&str, Error> {
        let damaged = || refused(self.path, &format!("no '{from}' in it"));
        let rest = self.head.split_once(from).ok_or_else(damaged)?.1;
        Ok(rest.split_once(to).ok_or_else(damaged)?.0)
    }

    fn time(&self) -> Result<f64, Error> {
        let tag = self.between("Name=\"TimeValue\"", "<")?;
        let number = tag.split_once('>').map_or("", |parts| parts.1);
        number.trim().parse().map_err(|_| refused(self.path, "its time is not a number"))
    }

    fn bytes(&self, name: &str) -> Result<&[u8], Error> {
        let tag = self.between(&format!("Name=\"{name}\" "), "/>")?;
        let offset =
            tag.split_once("offset=\"").and_then(|parts| parts.1.trim_end_matches('"').parse::<usize>().ok());
        let cut_short = || refused(self.path, &format!("array '{name}' is cut short"));
        let rest = offset.and_then(|o| self.data.get(o..)).ok_or_else(cut_short)?;
        let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(cut_short)?;
        rest.get(..u64::from_le_bytes(*length) as usize).ok_or_else(cut_short)
    }

    fn floats<const N: usize>(&self, name: &str) -> Result<Vec<[f64; N]>, Error> {
        let bytes = self.bytes(name)?;
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        Ok(bytes.chunks_exact(4 * N).map(|b| std::array::from_fn(|i| number(&b[4 * i..]))).collect())
    }
}

fn refused(path: &Path, reason: &str) -> Error {
    Error::File { path: path.display().to_string(), reason: reason.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> PointFields {
        let count = 7;
        let value = |i: usize, k: usize| (i * 10 + k) as f64;
        PointFields {
            time: 1.25e-5,
            id: (0..count as u32).rev().collect(),
            position: (0..count).map(|i| std::array::from_fn(|k| value(i, k))).collect(),
            velocity: (0..count).map(|i| std::array::from_fn(|k| -value(i, k))).collect(),
            stress: (0..count).map(|i| std::array::from_fn(|k| 1e6 * value(i, k))).collect(),
            plastic_strain: (0..count).map(|i| value(i, 0) / 8.0).collect(),
            temperature: (0..count).map(|i| 300.0 + value(i, 0)).collect(),
            jacobian: (0..count).map(|i| 1.0 - value(i, 0) / 256.0).collect(),
            tool_outline: vec![[0.0, 0.5], [1.0, 0.5], [1.0, 2.0]],
            mass: vec![2.0_f64.powi(-30); count],
            damage: (0..count).map(|i| value(i, 0) / 128.0).collect(),
            tail: (0..count).map(|i| i > 4).collect(),
            ..PointFields::default()
        }
    }

    /// The report draws from these files, so what was written must come back, in the order it was written.
    #[test]
    fn points_and_outline_come_back_as_written() {
        let folder = std::env::temp_dir().join(format!("swarf-vtk-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (points, outline) = (folder.join("p.vtu"), folder.join("t.vtp"));
        let fields = sample();
        let parameters = vec![("material.name".to_string(), "a <b> -- & \"c\"".to_string())];
        write_points(&points, &fields, &parameters).unwrap();
        write_outline(&outline, fields.time, &fields.tool_outline, &parameters).unwrap();
        let back = read_points(&points, Some(&outline)).unwrap();
        // All sample values are exact in 32 bits, so equality is exact.
        assert_eq!(format!("{fields:?}"), format!("{back:?}"));
        let text = fs::read(&points).unwrap();
        let text = String::from_utf8_lossy(&text);
        assert!(
            text.contains(crate::version::VERSION) && text.contains("material.name"),
            "version and parameters are named"
        );
        let stored = Stored::read(&points).unwrap();
        let means = cell_means(&fields);
        for (name, values) in
            [("von_mises", means.von_mises), ("pressure", means.pressure), ("strain_rate", means.strain_rate)]
        {
            let read = stored.floats::<1>(name).unwrap();
            assert!(read.iter().zip(&values).all(|(a, b)| a[0] as f32 == *b as f32), "{name}: {read:?}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A file cut short is told from a whole one, not read as fewer points.
    #[test]
    fn a_file_cut_short_is_refused() {
        let folder = std::env::temp_dir().join(format!("swarf-vtk-short-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("p.vtu");
        write_points(&path, &sample(), &[]).unwrap();
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 60]).unwrap();
        let error = read_points(&path, None).unwrap_err();
        assert!(error.to_string().contains("cut short"), "{error}");
        fs::remove_dir_all(&folder).unwrap();
    }
}
