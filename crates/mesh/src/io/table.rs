//! Tables of values as CSV, with a header line of names.
//!
//! The names of the columns determine what a row is: `vertex`, a point by its number from 0; `v0,v1[,v2…]`, a face or cell by the numbers
//! of its vertices; `x,y[,z]`, a point by its coordinates. Every other column is a field, which is missing where the
//! entry is empty.

use std::collections::HashMap;
use std::path::Path;

use crate::cancel;
use crate::error::{Error, Place, Result};
use crate::field::{ResultField, Results};

/// Reads a table of values on a mesh.
///
/// # Errors
/// Rows without a key or of another length; entries that are not numbers.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Results> {
    read_keyed(path, bytes, false)
}

/// Reads a table of values on a mesh, or of quantities over time: rows with a column `time` or `t`, or numbered in the order of the file.
///
/// # Errors
/// As [`read`].
pub(super) fn read_any(path: &Path, bytes: &[u8]) -> Result<Results> {
    read_keyed(path, bytes, true)
}

fn read_keyed(path: &Path, bytes: &[u8], curves: bool) -> Result<Results> {
    let refuse = |line: usize, what: String| {
        let remedy =
            "write one line of names, then numbers; the keys are `vertex`, `v0,v1,…`, or `x,y[,z]`";
        Error::file(path, Place::Line(line), what, remedy)
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let names = match reader.headers() {
        Ok(names) => names.clone(),
        Err(e) => return Err(refuse(1, e.to_string())),
    };
    let columns = Columns::new(&names, curves).map_err(|what| refuse(1, what))?;
    let mut results = Results {
        source: path.display().to_string(),
        space: match (columns.place.len(), columns.vertices.len()) {
            (0, 0) => 0,
            (3, _) => 3,
            (1, _) => 1,
            _ => 2,
        },
        width: if columns.vertices.len() > 1 {
            columns.vertices.len()
        } else {
            0
        },
        ..Results::default()
    };
    let mut fields: Vec<ResultField> = columns
        .fields
        .iter()
        .map(|&column| ResultField {
            name: names[column].to_owned(),
            components: 1,
            values: Vec::new().into(),
            rest: None,
            at: Some(Vec::new()),
            scaled_by: None,
            single: false,
        })
        .collect();
    let mut row = csv::StringRecord::new();
    let mut count = 0u32;
    loop {
        cancel::check()?;
        let line = reader.position().line() as usize;
        match reader.read_record(&mut row) {
            Ok(true) => {}
            Ok(false) => break,
            Err(e) => return Err(refuse(line, e.to_string())),
        }
        let entry = |column: usize| (&names[column], &row[column]);
        for &column in &columns.vertices {
            let (name, text) = entry(column);
            let id: u32 = text
                .parse()
                .ok()
                .filter(|id| *id < u32::MAX)
                .ok_or_else(|| {
                    refuse(
                        line,
                        format!("`{text}` in column `{name}` is not the number of a vertex"),
                    )
                })?;
            let ids = if results.width == 0 {
                &mut results.ids
            } else {
                results.cells.to_mut()
            };
            ids.push(id);
        }
        let number = |column: usize| {
            let (name, text) = entry(column);
            text.parse::<f64>()
                .map_err(|_| refuse(line, format!("`{text}` in column `{name}` is not a number")))
        };
        if !columns.place.is_empty() {
            let mut place = [0.0; 3];
            for (x, &column) in place.iter_mut().zip(&columns.place) {
                *x = number(column)?;
                if !x.is_finite() {
                    return Err(refuse(line, format!("the coordinate {x} is not finite")));
                }
            }
            results.points.to_mut().push(place);
        }
        for (field, &column) in fields.iter_mut().zip(&columns.fields) {
            if !row[column].is_empty() {
                field.values.to_mut().push(number(column)?);
                field.at.get_or_insert_default().push(count);
            }
        }
        if results.space == 0 {
            results.ids.push(count);
        }
        count += 1;
    }
    for field in &mut fields {
        if field.values.len() == count as usize {
            field.at = None;
        }
    }
    if results.width > 0 {
        results.on_cells = fields;
    } else {
        results.on_points = fields;
    }
    Ok(results)
}

/// Names of the time column.
const TIMES: [&str; 4] = ["time", "Time", "t", "TIME"];

/// Which column is what.
struct Columns {
    /// `vertex`, or `v0`, `v1`, … in their order.
    vertices: Vec<usize>,
    /// `x`, `y`, `z`, or the time
    place: Vec<usize>,
    fields: Vec<usize>,
}

impl Columns {
    fn new(names: &csv::StringRecord, curves: bool) -> Result<Self, String> {
        let mut columns = HashMap::with_capacity(names.len());
        for (k, name) in names.iter().enumerate() {
            if name.is_empty() || columns.insert(name, k).is_some() {
                return Err(format!("column {} has no name of its own", k + 1));
            }
        }
        let find = |name: &str| columns.get(name).copied();
        let mut vertices: Vec<usize> = (0..).map_while(|k| find(&format!("v{k}"))).collect();
        if let Some(vertex) = find("vertex") {
            if !vertices.is_empty() {
                return Err("it has `vertex` and `v0`, which are keys of different things".into());
            }
            vertices.push(vertex);
        }
        let place: Vec<usize> = ["x", "y", "z"]
            .iter()
            .map_while(|name| find(name))
            .collect();
        // A face is identified by its vertices: coordinates would be a second key.
        let place = match (place.len(), vertices.len()) {
            (2.., 0 | 1) => place,
            (0, 1..) => place,
            (0, 0) if curves => TIMES
                .iter()
                .find_map(|name| find(name))
                .into_iter()
                .collect(),
            (2.., _) => {
                return Err(
                    "it has vertices of faces and coordinates: leave out one of them".into(),
                );
            }
            _ => return Err("no column is a key".into()),
        };
        let mut is_key = vec![false; names.len()];
        vertices
            .iter()
            .chain(&place)
            .for_each(|&k| is_key[k] = true);
        let fields = (0..names.len()).filter(|&k| !is_key[k]).collect();
        Ok(Columns {
            vertices,
            place,
            fields,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<Results> {
        read(Path::new("t.csv"), text.as_bytes())
    }

    #[test]
    fn rows_are_points_or_faces_by_the_names_above() {
        let points = table("vertex, u\n7, 1.5\n3, -2e-3\n").unwrap();
        assert_eq!(
            (points.ids, points.on_points[0].values.clone()),
            (vec![7, 3], vec![1.5, -2e-3].into())
        );
        let faces = table("v0,v1,mean,flux\n0,1,2,\n1,2,3,4\n").unwrap();
        assert_eq!((faces.width, faces.cells), (2, vec![0, 1, 1, 2].into()));
        assert_eq!(faces.on_cells[0].at, None);
        assert_eq!(faces.on_cells[1].at, Some(vec![1]));
        let places = table("x,y,u\n0,1,2\n0.5,1,3\n").unwrap();
        assert_eq!(places.points, [[0.0, 1.0, 0.0], [0.5, 1.0, 0.0]]);
    }

    #[test]
    fn rows_of_a_curve_are_times_or_counted_where_that_is_asked_for() {
        let curve = |text: &str| read_any(Path::new("t.csv"), text.as_bytes());
        let drag = curve("drag,time\n1,0.5\n2,0.25\n").unwrap();
        assert_eq!(
            (drag.space, drag.points),
            (1, vec![[0.5, 0.0, 0.0], [0.25, 0.0, 0.0]].into())
        );
        let rows = curve("a,b\n1,0.5\n2,0.25\n").unwrap();
        assert_eq!(
            (rows.space, rows.ids, rows.on_points.len()),
            (0, vec![0, 1], 2)
        );
        assert!(curve("x,u\n1,2\n").is_err());
        assert_eq!(curve("x,y,time\n1,2,3\n").unwrap().space, 2);
    }

    /// Comparing each name with all others would take an hour.
    #[test]
    fn a_table_may_have_many_columns() {
        let names = |name: &str| {
            let names: Vec<String> = (0..200_000).map(|k| format!("{name}{k}")).collect();
            names.join(",")
        };
        let fields = table(&format!("vertex,{}\n", names("f"))).unwrap();
        assert_eq!(fields.on_points.len(), 200_000);
        assert_eq!(
            table(&format!("{},mean\n", names("v"))).unwrap().width,
            200_000
        );
        let twice = table(&format!("vertex,{},f7\n", names("f")));
        let error = twice.unwrap_err().to_string();
        assert!(error.contains("column 200002"), "{error}");
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, part) in [
            ("u\n1\n", ":1: no column is a key"),
            ("x,u\n1,2\n", "no column is a key"),
            ("vertex,u\n1\n", ":2"),
            ("vertex,u\n1,2\n-1,2\n", ":3: `-1`"),
            ("vertex,u\n1.5,2\n", "not the number of a vertex"),
            ("vertex,u\n1,two\n", "`two` in column `u`"),
            ("x,y,u\n1,nan,2\n", "is not finite"),
            ("vertex,u,u\n1,2,3\n", "column 3"),
            ("vertex,v0,u\n1,2,3\n", "different things"),
            ("v0,v1,x,y,u\n1,2,3,4,5\n", "leave out"),
            ("", "no column is a key"),
        ] {
            let error = table(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text:?}: {error}");
        }
    }
}
