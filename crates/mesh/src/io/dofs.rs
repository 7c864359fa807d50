//! Tables of degrees of freedom as CSV: the place of each row of a linear system, and what it is the value of.
//!
//! The columns, by a header line in any order: `x,y,z` (as many as there are axes), the place; `field`, its name (default `u`); `component`, from 0;
//! or `dx,dy,dz`, the values of the dof for the constant fields (1, 0, 0), (0, 1, 0) and (0, 0, 1), which give the direction, the sign and the
//! scaling of a moment on a face or edge; `value`, what the code's own solution has there.

use std::collections::BTreeMap;
use std::path::Path;

use super::out::save;
use crate::cancel;
use crate::error::{Error, Place, Result};
use crate::file;

/// The functional (dof) of each row of a linear system.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DofTable {
    /// The names of the fields.
    pub names: Vec<String>,
    /// For each dof the position of its field among the names.
    pub field: Vec<u16>,
    /// Where it is.
    pub at: Vec<[f64; 3]>,
    /// Its values for the constant fields along the axes; of a scalar the first is its value for the constant 1.
    pub direction: Vec<[f64; 3]>,
    /// The code's own solution, if the table has it.
    pub values: Option<Vec<f64>>,
}

/// The required form of a table.
const REMEDY: &str = "write one line of names, then one row per dof: `field,x,y,z,component` or `field,x,y,z,dx,dy,dz`, and `value` if it is known";

/// Reads a table of dofs.
///
/// # Errors
/// Columns that are not known or missing; entries that are not finite numbers, with the line.
pub fn read_dofs(path: &Path) -> Result<DofTable> {
    table(path, &file::read(path)?)
}

/// Writes a table of dofs; names of fields are words.
///
/// # Errors
/// A file that cannot be written.
pub fn write_dofs(path: &Path, table: &DofTable) -> Result<()> {
    let mut text = String::from("field,x,y,z,dx,dy,dz");
    text.push_str(if table.values.is_some() {
        ",value\n"
    } else {
        "\n"
    });
    for (k, (x, d)) in table.at.iter().zip(&table.direction).enumerate() {
        text.push_str(&table.names[usize::from(table.field[k])]);
        let value = table.values.iter().map(|values| &values[k]);
        x.iter()
            .chain(d)
            .chain(value)
            .for_each(|number| text.push_str(&format!(",{number:?}")));
        text.push('\n');
    }
    save(path, [text.as_bytes()])
}

fn table(path: &Path, bytes: &[u8]) -> Result<DofTable> {
    let refuse = |line: usize, what: String| Error::file(path, Place::Line(line), what, REMEDY);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let names = reader
        .headers()
        .map_err(|e| refuse(1, e.to_string()))?
        .clone();
    const KNOWN: [&str; 9] = [
        "field",
        "component",
        "x",
        "y",
        "z",
        "dx",
        "dy",
        "dz",
        "value",
    ];
    let mut column = [None; KNOWN.len()];
    for (k, name) in names.iter().enumerate() {
        let Some(known) = KNOWN.iter().position(|known| *known == name) else {
            return Err(refuse(1, format!("the column `{name}` is not known")));
        };
        if column[known].replace(k).is_some() {
            return Err(refuse(1, format!("the column `{name}` occurs twice")));
        }
    }
    let [field, component, x, y, z, dx, dy, dz, value] = column;
    if x.is_none() {
        return Err(refuse(1, "there is no column `x`".into()));
    }
    let mut all = DofTable {
        values: value.map(|_| Vec::new()),
        ..DofTable::default()
    };
    let mut known: BTreeMap<String, u16> = BTreeMap::new();
    let mut row = csv::StringRecord::new();
    loop {
        let line = reader.position().line() as usize;
        if all.at.len().is_multiple_of(65536) {
            cancel::check()?;
        }
        match reader.read_record(&mut row) {
            Ok(true) => {}
            Ok(false) => break,
            Err(e) => return Err(refuse(line, e.to_string())),
        }
        let number = |column: usize| {
            let number = row[column].parse().ok().filter(|x: &f64| x.is_finite());
            number.ok_or_else(|| {
                let what = format!(
                    "`{}` in column `{}` is not a finite number",
                    &row[column], &names[column]
                );
                refuse(line, what)
            })
        };
        let three = |columns: [Option<usize>; 3]| -> Result<[f64; 3]> {
            let mut all = [0.0; 3];
            for (one, column) in all.iter_mut().zip(columns) {
                *one = column
                    .filter(|k| !row[*k].is_empty())
                    .map_or(Ok(0.0), number)?;
            }
            Ok(all)
        };
        let name = field.map_or("u", |k| &row[k]);
        let position = match known.get(name) {
            Some(position) => *position,
            None => {
                let position = u16::try_from(known.len());
                let position =
                    position.map_err(|_| refuse(line, "there are too many fields".into()))?;
                known.insert(name.to_owned(), position);
                all.names.push(name.to_owned());
                position
            }
        };
        let given = [dx, dy, dz]
            .into_iter()
            .flatten()
            .any(|k| !row[k].is_empty());
        let direction = match component.filter(|k| !row[*k].is_empty()) {
            _ if given => three([dx, dy, dz])?,
            None => [1.0, 0.0, 0.0],
            Some(k) => {
                let component = row[k].parse().ok().filter(|c: &usize| *c < 3);
                let component = component.ok_or_else(|| {
                    refuse(
                        line,
                        format!("the component `{}` is not 0, 1 or 2", &row[k]),
                    )
                })?;
                let mut direction = [0.0; 3];
                direction[component] = 1.0;
                direction
            }
        };
        all.field.push(position);
        all.at.push(three([x, y, z])?);
        all.direction.push(direction);
        if let (Some(values), Some(k)) = (&mut all.values, value) {
            values.push(number(k)?);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<DofTable> {
        table("dofs.csv".as_ref(), text.as_bytes())
    }

    #[test]
    fn components_and_moments_are_directions() {
        let found = read(
            "field,x,y,component,dx,dy,value\nu,0,1,1,,,2.5\nq,0.5,0,,0,-0.25,3\np,1,1,,,,4\n",
        )
        .unwrap();
        assert_eq!(found.names, ["u", "q", "p"]);
        assert_eq!(
            found.direction,
            [[0.0, 1.0, 0.0], [0.0, -0.25, 0.0], [1.0, 0.0, 0.0]]
        );
        assert_eq!(found.at[1], [0.5, 0.0, 0.0]);
        assert_eq!(found.values, Some(vec![2.5, 3.0, 4.0]));
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dofs.csv");
        let written =
            read("field,x,y,component,dx,dy,value\nu,0,0.1,1,,,2.5\nq,0.5,0,,0,-0.25,3\n").unwrap();
        write_dofs(&path, &written).unwrap();
        assert_eq!(read_dofs(&path).unwrap(), written);
    }

    #[test]
    fn errors_name_the_line_and_the_column() {
        for (text, told) in [
            ("y,z\n0,0\n", "no column `x`"),
            ("x,colour\n0,0\n", ":1: the column `colour` is not known"),
            ("x,x\n0,0\n", "`x` occurs twice"),
            (
                "x,y\n0,0\n1,nan\n",
                ":3: `nan` in column `y` is not a finite number",
            ),
            ("x,component\n0,3\n", ":2: the component `3`"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(told), "{text:?}: {error}");
        }
    }
}
