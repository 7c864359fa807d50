//! Fields that follow from others: divergence and curl, cell by cell, functions of facets and edges, components and magnitudes.

use super::domain::Domain;
use super::function::Function;
use super::geometry::Geometry;
use super::map::Local;
use super::moments::{self, Element};
use crate::On;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};

/// Adds the field that a name means, and returns whether there is such a field: `div(q)` and `curl(q)` of a vector field, on each cell
/// by itself, or what [`Results::derive`] knows, as `u[0]` and `|u|`, of these too.
///
/// Of functions that are linear on triangles or tetrahedra, as those of RT0, BDM1 and N1curl are, both are constant on each cell. In
/// the plane the curl is the scalar ∂v₁/∂x - ∂v₀/∂y; on a surface in space the divergence is that of the tangential gradient.
///
/// `RT0(q)` and `N1curl(q)` are the vector fields whose moments on facets or edges are the column q of a table, `BDM1(q)` that with the columns
/// q0, q1 and in space q2; its rows have the numbers of vertices of `mesh`. It takes the place of the table.
///
/// # Errors
/// A field that has no divergence or curl here, as on cells whose map is not affine; a table that is not that of the moments of a function;
/// [`Error::Ended`].
pub fn derive(side: &mut Results, name: &str, mesh: Option<&Results>) -> Result<bool> {
    let magnitude = || name.strip_prefix('|')?.strip_suffix('|');
    let component = || Some(name.strip_suffix(']')?.rsplit_once('[')?.0);
    if let Some(of) = magnitude().or_else(component)
        && of.ends_with(')')
        && !side.has(of)
        && !derive(side, of, mesh)?
    {
        return Ok(false);
    }
    if side.derive(name) {
        return Ok(true);
    }
    let refuse = |source: &str, what: String, remedy: &str| Error::Compare {
        a: source.to_owned(),
        b: format!("`{name}`"),
        what,
        remedy: remedy.into(),
    };
    if let Some((element, of)) = Element::named(name) {
        if !element.columns(of, 2).iter().all(|column| side.has(column)) {
            return Ok(false);
        }
        let Some(mesh) = mesh else {
            let what = "there is no mesh whose vertices its rows could have";
            let remedy = "give it, as by --mesh, or compare in a face-off whose codes share one";
            return Err(refuse(&side.source, what.into(), remedy));
        };
        let mut found = moments::function(side, mesh, element, of)?.map_err(|why| {
            let remedy = "write one row per facet or edge, by the numbers of its vertices";
            refuse(
                &side.source,
                format!("`{of}` is not a function there: {why}"),
                remedy,
            )
        })?;
        found.rename(of, name);
        *side = found;
        return Ok(true);
    }
    let operator = [("div(", Operator::Div), ("curl(", Operator::Curl)];
    let named = |(start, operator): &(&str, Operator)| {
        Some((*operator, name.strip_prefix(start)?.strip_suffix(')')?))
    };
    let Some((operator, of)) = operator.iter().find_map(named) else {
        return Ok(false);
    };
    if !side.has(of) && !derive(side, of, mesh)? {
        return Ok(false);
    }
    let (on, field) = applied(side, operator, of).map_err(|why| match why {
        Why::Refused(why) => refuse(
            &side.source,
            format!("`{of}` has no {}: {why}", operator.word()),
            "give a vector field on straight triangles, tetrahedra or parallelograms",
        ),
        Why::Failed(error) => error,
    })?;
    let field = ResultField {
        name: name.to_owned(),
        ..field
    };
    match on {
        On::Cells => side.on_cells.push(field),
        _ => side.on_corners.push(field),
    }
    Ok(true)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Operator {
    Div,
    Curl,
}

impl Operator {
    fn word(self) -> &'static str {
        match self {
            Operator::Div => "divergence",
            Operator::Curl => "curl",
        }
    }

    /// Of a value and a gradient for each component.
    fn of(self, v: &[[f64; 4]], dim: usize) -> Vec<f64> {
        let d = |component: usize, axis: usize| v[component][1 + axis];
        match (self, dim) {
            (Operator::Div, _) => vec![(0..dim).map(|k| d(k, k)).sum()],
            (Operator::Curl, 2) => vec![d(1, 0) - d(0, 1)],
            (Operator::Curl, _) => vec![d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1)],
        }
    }
}

enum Why {
    Refused(String),
    Failed(Error),
}

impl From<Error> for Why {
    fn from(error: Error) -> Self {
        match error {
            Error::Ended(_) => Why::Failed(error),
            other => Why::Refused(other.to_string()),
        }
    }
}

/// The field: on cells where it is constant on each of them, else at the nodes of each.
fn applied(side: &Results, operator: Operator, name: &str) -> Result<(On, ResultField), Why> {
    let refuse = |why: String| Err(Why::Refused(why));
    let all = [
        (On::Points, &side.on_points),
        (On::Cells, &side.on_cells),
        (On::Corners, &side.on_corners),
    ];
    let named = all
        .into_iter()
        .flat_map(|(on, fields)| fields.iter().map(move |field| (on, field)))
        .filter(|(_, field)| field.name == name);
    let &[(on, field)] = &named.collect::<Vec<_>>()[..] else {
        return refuse("there are several fields of this name".into());
    };
    let domain = Domain::divided(side, 0.0)?;
    // The gradients of a surface in space are tangential vectors of three components.
    let dim = if domain.is_surface { 3 } else { domain.dim };
    match (on, field.components) {
        _ if domain.is_surface && operator == Operator::Curl => {
            return refuse("its cells are a surface in space".into());
        }
        (On::Cells, _) => return refuse("it has one value on each cell".into()),
        _ if field.rest.is_some() => return refuse("it has integers".into()),
        (_, n) if n != dim && (n, dim) != (3, 2) => {
            return refuse(format!("it has {n} components, in {dim}D"));
        }
        _ => {}
    }
    let is_affine = |cell: &u32| domain.geometries[*cell as usize] == Geometry::Straight;
    let cells = || (0..side.cell_count() as u32).filter(|c| domain.known_element(*c).is_some());
    if let Some(cell) = cells().find(|cell| !is_affine(cell)) {
        return refuse(format!("cell {cell} is not the image of an affine map"));
    }
    let is_constant = domain
        .elements
        .iter()
        .all(|of| of.degree == 1 && !of.is_product());
    let function = [Function::new(field, on)];
    let mut local = Local::new(&domain, &function);
    let (mut at, mut values) = (Vec::new(), Vec::new());
    let mut last = u32::MAX;
    for piece in &domain.pieces {
        cancel::check()?;
        if std::mem::replace(&mut last, piece.cell) == piece.cell {
            continue;
        }
        let frame = domain.frame(piece);
        local.turn_to(piece.cell, &frame);
        let first = domain.first_corners[piece.cell as usize];
        for (corner, place) in (first..).zip(domain.nodes(piece.cell, &frame)) {
            local.evaluate(&place);
            values.extend(operator.of(&local.values, dim));
            at.push(if is_constant { piece.cell } else { corner });
            if is_constant {
                break;
            }
        }
    }
    let count = match is_constant {
        true => side.cell_count(),
        false => (0..side.cell_count())
            .map(|cell| side.cell(cell).count())
            .sum(),
    };
    let components = values.len() / at.len().max(1);
    Ok((
        if is_constant { On::Cells } else { On::Corners },
        ResultField {
            components,
            values: values.into(),
            at: (at.len() < count).then_some(at),
            ..field.clone()
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_mesh::CellKind;

    /// Two triangles, or two of six nodes, with a vector field of (x² + 3 x y, y - 2 x) or its linear part.
    fn side(kind: CellKind) -> Results {
        let corners = [[0.0, 0.0], [2.0, 0.1], [1.0, 1.0], [0.1, 2.0]];
        let (mut points, mut values) = (Vec::new(), Vec::new());
        for cell in [[0, 1, 2], [0, 2, 3]] {
            let x = cell.map(|k: usize| corners[k]);
            let middle = |i: usize, j: usize| [0, 1].map(|k| 0.5 * (x[i][k] + x[j][k]));
            let nodes = [x[0], x[1], x[2], middle(0, 1), middle(1, 2), middle(2, 0)];
            for [x, y] in nodes.into_iter().take(kind.points()) {
                points.push([x, y, 0.0]);
                let square = if kind.points() == 6 {
                    x * x + 3.0 * x * y
                } else {
                    4.0 * x
                };
                values.extend([square, y - 2.0 * x, 0.0]);
            }
        }
        Results {
            source: "a".into(),
            space: 2,
            width: kind.points(),
            cells: (0..points.len() as u32).collect(),
            points: points.into(),
            kinds: vec![(kind, 2)],
            on_points: vec![ResultField {
                name: "q".into(),
                components: 3,
                values: values.into(),
                rest: None,
                at: None,
                scaled_by: None,
                single: false,
            }],
            ..Results::default()
        }
    }

    #[test]
    fn divergence_and_curl_are_those_of_the_functions() {
        let mut linear = side(CellKind::Triangle);
        assert!(
            derive(&mut linear, "div(q)", None).unwrap()
                && derive(&mut linear, "curl(q)", None).unwrap()
        );
        for (field, exact) in linear.on_cells.iter().zip([5.0, -2.0]) {
            assert_eq!((field.len(), field.components), (2, 1));
            assert!(
                field.values.iter().all(|v| (v - exact).abs() < 1e-13),
                "{field:?}"
            );
        }
        let mut curved = side(CellKind::Triangle6);
        assert!(
            derive(&mut curved, "|curl(q)|", None).unwrap()
                && derive(&mut curved, "div(q)", None).unwrap()
        );
        let [curl, size, div] = &curved.on_corners[..] else {
            panic!("{:?}", curved.on_corners)
        };
        for (k, [x, y, _]) in curved.points.iter().enumerate() {
            assert!((div.values[k] - (2.0 * x + 3.0 * y + 1.0)).abs() < 1e-12);
            assert!((curl.values[k] - (-2.0 - 3.0 * x)).abs() < 1e-12);
            assert!((size.values[k] - curl.values[k].abs()).abs() < 1e-15);
        }
    }

    #[test]
    fn what_has_no_divergence_is_refused_or_not_there() {
        let mut one = side(CellKind::Triangle);
        assert!(
            !derive(&mut one, "div(w)", None).unwrap()
                && !derive(&mut one, "rot(q)", None).unwrap()
        );
        assert!(derive(&mut one, "div(q)", None).unwrap());
        let refused =
            |one: &mut Results, name: &str| derive(one, name, None).unwrap_err().to_string();
        assert!(refused(&mut one, "curl(div(q))").contains("one value on each cell"));
        assert!(derive(&mut one, "q[1]", None).unwrap());
        assert!(refused(&mut one, "div(q[1])").contains("1 components, in 2D"));
        let mut bent = side(CellKind::Triangle6);
        bent.points.to_mut()[3][1] -= 0.1;
        assert!(refused(&mut bent, "div(q)").contains("affine"));
    }
}
