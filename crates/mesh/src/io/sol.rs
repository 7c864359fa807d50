//! Medit's `.sol`, text, and `.solb`, binary: values at the vertices or cells of the mesh of the same name beside it.
//!
//! Each section has a count, the kinds of its fields (1 a scalar, 2 a vector, 3 a symmetric tensor), and a row of all of
//! them for each item. Fields have no names: they are called `sol`, or `sol 1`, `sol 2`, ….

use std::path::Path;

use super::medit::{CELLS, Sections};
use crate::error::Result;
use crate::mesh::{CellKind, Field, Mesh, Support, Values};

/// The most fields of a section; the format's own readers hold no more.
const MOST: usize = 1000;

/// Reads the fields of `mesh`.
///
/// # Errors
/// Any violation of the format, with keyword and line; a number of values that does not fit the mesh.
pub(super) fn read(path: &Path, bytes: &[u8], mesh: &Mesh) -> Result<Vec<Field>> {
    let mut sections = Sections::new(path, bytes)?;
    let mut fields: Vec<Field> = Vec::new();
    while let Some(word) = sections.next()? {
        let on = word.strip_prefix("SolAt").unwrap_or_default();
        let kind = CELLS.iter().find(|(name, ..)| *name == on);
        if kind.is_none() && on != "Vertices" {
            return Err(sections.scan.error("this is not a section of values"));
        }
        if sections.dimension == 0 {
            return Err(sections.scan.error("the values come before the dimension"));
        }
        fields.extend(values(&mut sections, kind.map(|(.., kind)| *kind), mesh)?);
    }
    if !sections.ended {
        return Err(sections.scan.error("End is missing"));
    }
    if fields.len() > 1 {
        for (field, k) in fields.iter_mut().zip(1..) {
            field.name = format!("sol {k}");
        }
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
            "put the mesh of these values beside them, under the same name",
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
    let all = kind.is_none() || at.len() == mesh.cell_count();
    let columns = columns.into_iter().zip(components);
    let fields = columns.map(|(values, components)| Field {
        at: if all { Vec::new() } else { at.clone() },
        ..Field::new("sol", on, components, Values::F64(values))
    });
    Ok(fields.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::CellBlock;

    fn mesh() -> Mesh {
        Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
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
}
