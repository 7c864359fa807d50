//! Medit's `.sol`, text, and `.solb`, binary: values at the vertices or cells of the mesh with the same name in the same folder.
//!
//! Each section has a count, the kinds of its fields (1 a scalar, 2 a vector, 3 a symmetric tensor), and a row of all of
//! them for each item. Fields have no names: they are called `sol`, or `sol 1`, `sol 2`, ….

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use super::binary::Binary;
use super::cells;
use super::sections::{Sections, number};
use crate::error::Result;
use crate::io::loss::Losses;
use crate::io::out::{self, Out};
use crate::mesh::{CellKind, Field, Mesh, Support, Values};

/// The most fields of a section; the format's own readers hold no more.
const MOST: usize = 1000;

/// Reads the fields of `mesh`.
///
/// # Errors
/// Any violation of the format, with keyword and line; a number of values that does not fit the mesh.
pub fn read(path: &Path, bytes: &[u8], mesh: &Mesh) -> Result<Vec<Field>> {
    let mut sections = Sections::new(path, bytes)?;
    let mut fields: Vec<Field> = Vec::new();
    while let Some(word) = sections.next()? {
        let on = word.strip_prefix("SolAt").unwrap_or_default();
        let kind = cells().find(|(name, ..)| *name == on);
        if kind.is_none() && on != "Vertices" {
            return Err(sections.scan.error("this is not a section of values"));
        }
        if sections.dimension == 0 {
            return Err(sections.scan.error("the values come before the dimension"));
        }
        fields.extend(values(&mut sections, kind.map(|(.., kind)| kind), mesh)?);
    }
    if !sections.ended {
        return Err(sections.scan.error("End is missing"));
    }
    let count = fields.len();
    for (k, field) in fields.iter_mut().enumerate() {
        field.name = name_of(k, count);
    }
    Ok(fields)
}

fn values(sections: &mut Sections<'_>, kind: Option<CellKind>, mesh: &Mesh) -> Result<Vec<Field>> {
    let count = sections.count("rows", 0, 1)?;
    let Sections {
        scan, dimension, ..
    } = sections;
    let dimension = *dimension;
    let at: Vec<u32> = match kind {
        None => (0..mesh.points.len() as u32).collect(),
        Some(kind) => mesh.cells_of(kind).map(|(cell, ..)| cell).collect(),
    };
    if at.len() != count {
        return Err(scan.error_with(
            format!("there are {count} rows, and {} items in the mesh", at.len()),
            "put the mesh of these values into the same folder, under the same name",
        ));
    }
    let declared = u64::try_from(scan.i32()?).unwrap_or(u64::MAX);
    let number = scan.believe(declared, "fields", scan.least(2, 4))?;
    if !(1..=MOST).contains(&number) {
        return Err(scan.error(format!("{number} is not a possible number of fields")));
    }
    let mut components = Vec::new();
    for _ in 0..number {
        components.push(match scan.i32()? {
            1 => 1,
            2 => dimension,
            3 => dimension * (dimension + 1) / 2,
            other => return Err(scan.error(format!("{other} is not a kind of field"))),
        });
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); number];
    for _ in 0..count {
        for (column, components) in columns.iter_mut().zip(&components) {
            for _ in 0..*components {
                column.push(scan.any_real()?);
            }
        }
    }
    let on = if kind.is_none() {
        Support::Points
    } else {
        Support::Cells
    };
    let columns = columns.into_iter().zip(components);
    let fields = columns.map(|(values, components)| {
        let field = Field::new("sol", on, components, Values::F64(values.into()));
        field.only(at.clone(), mesh.items(on))
    });
    Ok(fields.collect())
}

/// A field on one kind of items: its values, the components of each, those that are written, and the row of each item.
struct Column<'a> {
    values: Cow<'a, [f64]>,
    components: usize,
    written: usize,
    rows: Vec<usize>,
}

/// The fields of a mesh in their file next to `path`, which is not yet saved; none if there are no fields. What the
/// format cannot hold is lost.
///
/// # Errors
/// The file cannot be begun.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    dimension: usize,
    fields: &[&Field],
    is_binary: bool,
    losses: &mut Losses,
) -> Result<Option<(PathBuf, Out)>> {
    let mut sections: BTreeMap<i32, (&str, Vec<Column<'_>>)> = BTreeMap::new();
    let (mut seen, mut names) = (HashSet::new(), Vec::new());
    for field in fields {
        let found = match out::is_special(path) || !seen.insert((&field.name, field.on)) {
            true => None,
            false => columns(field, mesh, dimension),
        };
        let Some(found) = found else {
            losses.lose_field(&field.name, field.on);
            continue;
        };
        if let Some(time) = field.time {
            losses.lose(format!("the time {time} of the field {:?}", field.name));
        }
        for (number, keyword, column) in found {
            names.push((number, &field.name));
            let (_, columns) = sections.entry(number).or_insert((keyword, Vec::new()));
            columns.push(column);
        }
    }
    names.sort_by_key(|(number, _)| *number);
    for (k, (_, name)) in names.iter().enumerate() {
        let called = name_of(k, names.len());
        if **name != called {
            losses.lose(format!(
                "the name of the field {name:?}, which is read as {called:?}"
            ));
        }
    }
    if sections.is_empty() {
        return Ok(None);
    }
    let path = path.with_extension(if is_binary { "solb" } else { "sol" });
    let mut out = Out::to(&path)?;
    let kind = |written: usize| match written {
        1 => 1,
        n if n == dimension => 2,
        _ => 3,
    };
    let values = |columns: &[Column<'_>], k: usize, put: &mut dyn FnMut(f64)| {
        for column in columns {
            let start = column.rows[k] * column.components;
            let row = &column.values[start..start + column.written];
            row.iter().for_each(|&value| put(value));
        }
    };
    if is_binary {
        let mut binary = Binary::new(&mut out, dimension);
        for (number, (_, columns)) in &sections {
            let count = columns[0].rows.len();
            let width: usize = columns.iter().map(|column| column.written).sum();
            binary.begin(*number, count, 4 * (1 + columns.len()) + 8 * count * width);
            binary.ints([columns.len() as i32]);
            binary.ints(columns.iter().map(|column| kind(column.written)));
            let mut put = |value: f64| binary.out.append(&value.to_le_bytes());
            (0..count).for_each(|k| values(columns, k, &mut put));
        }
        binary.end();
        return Ok(Some((path, out)));
    }
    out.text(&format!("MeshVersionFormatted 2\nDimension {dimension}\n"));
    for (keyword, columns) in sections.values() {
        let count = columns[0].rows.len();
        out.text(&format!("SolAt{keyword}\n{count}\n"))
            .int(columns.len());
        for column in columns {
            out.int(kind(column.written));
        }
        out.end();
        for k in 0..count {
            values(columns, k, &mut |value| {
                out.float(value);
            });
            out.end();
        }
    }
    out.text("End\n");
    Ok(Some((path, out)))
}

/// The name with which the k-th of `count` fields is read.
fn name_of(k: usize, count: usize) -> String {
    match count {
        1 => "sol".into(),
        _ => format!("sol {}", k + 1),
    }
}

/// A field as columns on vertices, or on the cells of some kinds, each with its section's number and keyword; `None` where
/// the format cannot hold all of it.
fn columns<'a>(
    field: &'a Field,
    mesh: &Mesh,
    dimension: usize,
) -> Option<Vec<(i32, &'static str, Column<'a>)>> {
    let values = match &field.values {
        Values::F64(values) => Cow::Borrowed(&values[..]),
        others => Cow::Owned(others.to_f64()),
    };
    let components = field.components;
    // In other formats vectors of the plane have a third component of 0.
    let flat = |values: &[f64]| values.iter().skip(2).step_by(3).all(|&z| z == 0.0);
    let is_flat = (dimension, components) == (2, 3) && flat(&values);
    let written = if is_flat { 2 } else { components };
    let kinds = [1, dimension, dimension * (dimension + 1) / 2];
    if !kinds.contains(&written) || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let count = values.len() / components;
    let section = |keyword: &'static str, rows: Vec<usize>| {
        let number = number(&format!("SolAt{keyword}"))?;
        let values = values.clone();
        Some((
            number,
            keyword,
            Column {
                values,
                components,
                written,
                rows,
            },
        ))
    };
    match field.on {
        Support::Points if field.at.is_empty() => {
            Some(vec![section("Vertices", (0..count).collect())?])
        }
        Support::Cells => {
            let mut row = vec![None; mesh.cell_count()];
            match field.at.is_empty() {
                true => row.iter_mut().zip(0..).for_each(|(row, k)| *row = Some(k)),
                false => field
                    .at
                    .iter()
                    .zip(0..)
                    .for_each(|(&cell, k)| row[cell as usize] = Some(k)),
            }
            let mut found = Vec::new();
            for (keyword, _, kind) in cells() {
                let rows: Vec<Option<usize>> = mesh
                    .cells_of(kind)
                    .map(|(cell, ..)| row[cell as usize])
                    .collect();
                // Values on some cells of a kind have no place.
                if rows.iter().any(Option::is_some) {
                    found.push(section(keyword, rows.into_iter().collect::<Option<_>>()?)?);
                }
            }
            let covered: usize = found.iter().map(|(.., column)| column.rows.len()).sum();
            (covered == count && count > 0).then_some(found)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::CellBlock;

    fn mesh() -> Mesh {
        Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
            blocks: vec![
                CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
                CellBlock::new(CellKind::Triangle, vec![0, 1, 2]),
            ],
            ..Mesh::default()
        }
    }

    fn fields(text: &str) -> Result<Vec<Field>> {
        let text = format!("MeshVersionFormatted 1\n\nDimension 2\n{text}");
        read(Path::new("u.sol"), text.as_bytes(), &mesh())
    }

    #[test]
    fn rows_are_split_into_fields_and_belong_to_their_cells() {
        let text =
            "SolAtVertices\n3\n2 1 2\n\n1 2 3\n4 5 6\n7 8 9\nSolAtTriangles\n1\n1 1\n0.5\nEnd\n";
        let found = fields(text).unwrap();
        let sol = |k: usize| (found[k].name.as_str(), found[k].values.to_f64());
        assert_eq!(sol(0), ("sol 1", vec![1.0, 4.0, 7.0]));
        assert_eq!(sol(1), ("sol 2", vec![2.0, 3.0, 5.0, 6.0, 8.0, 9.0]));
        assert_eq!(sol(2), ("sol 3", vec![0.5]));
        assert_eq!((found[2].on, &found[2].at[..]), (Support::Cells, &[2][..]));
        assert_eq!(
            fields("SolAtTriangles\n1\n1 3\n1 2 3\nEnd").unwrap()[0].name,
            "sol"
        );
    }

    #[test]
    fn what_does_not_fit_the_mesh_is_refused() {
        for (text, part) in [
            ("SolAtVertices\n2\n1 1\n1 2\nEnd", "2 rows, and 3 items"),
            ("SolAtVertices\n3\n1 1\n1 2\nEnd", "u.sol:"),
            ("SolAtVertices\n3\n1 1\n1 2 x\nEnd", "u.sol:"),
            ("SolAtVertices\n3\n1 4\n1 2 3\nEnd", "not a kind of field"),
            (
                "SolAtVertices\n3\n0\n\nEnd",
                "not a possible number of fields",
            ),
            ("SolAtTriangles\n1\n1 1\n0.5\n", "End is missing"),
            ("Vertices\n3\n", "not a section of values"),
            ("Dimension 2\nEnd", "given once"),
        ] {
            let error = fields(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text:?}: {error}");
        }
        let early = b"MeshVersionFormatted 1\nSolAtVertices\n3\n1 1\n1 2 3\nEnd";
        assert!(read(Path::new("u.sol"), early, &mesh()).is_err());
    }

    /// A scalar and a vector on points, and a scalar only on the triangle, as text and in binary.
    #[test]
    fn what_is_written_is_read_and_the_rest_told() {
        let folder = tempfile::tempdir().unwrap();
        let field = |name: &str, on, components, values: &[f64]| {
            Field::new(name, on, components, Values::F64(values.to_vec().into()))
        };
        let mut mesh = mesh();
        let v = [1.0, 2.0, 0.0, 3.0, 4.0, 0.0, 5.0, 6.0, 0.0];
        mesh.fields = vec![
            field("sol 1", Support::Points, 1, &[0.5, 1e-300, -7.0]),
            field("v", Support::Points, 3, &v),
            Field {
                at: vec![2],
                ..field("sol 3", Support::Cells, 1, &[0.1])
            },
            Field {
                at: vec![0, 2],
                ..field("some", Support::Cells, 1, &[1.0, 2.0])
            },
        ];
        for suffix in ["mesh", "meshb"] {
            let path = folder.path().join("u").with_extension(suffix);
            let mut options = crate::io::Options::default();
            let refused = crate::io::write(&path, &mesh, &options)
                .unwrap_err()
                .to_string();
            assert!(
                refused.contains("\"some\"")
                    && refused.contains("\"v\", which is read as \"sol 2\""),
                "{refused}"
            );
            let values = path.with_extension(if suffix == "mesh" { "sol" } else { "solb" });
            assert!(!values.exists());
            options.lossy = true;
            crate::io::write(&path, &mesh, &options).unwrap();
            let bytes = std::fs::read(&values).unwrap();
            let back = read(&values, &bytes, &crate::io::read(&path).unwrap()).unwrap();
            assert_eq!((&back[0], &back[2]), (&mesh.fields[0], &mesh.fields[2]));
            assert_eq!(
                (back[1].components, back[1].values.to_f64()),
                (2, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
            );
            std::fs::remove_file(&path).unwrap();
        }
    }
}
