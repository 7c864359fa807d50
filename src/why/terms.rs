//! Writes the difference of two linear systems as a sum of mass, stiffness, convection and boundary terms.
//!
//! The terms are those of a form that is built here, on the mesh and in the space whose nodes the dofs are. A bilinear term T is represented by T w for
//! one vector w without any symmetry: D w = Σ δ T w has one solution with few δ, which the recovery of forms finds.

use serde::Serialize;

use faceoff_form::Problem;
use faceoff_form::judge::recovery::{Column, Recovered, Scheme, Trial, largest, recover};
use faceoff_form::own::{Assembler, State, Wanted, dof_table};
use faceoff_judge::systems::{Both, Compared, System, matched};
use faceoff_mesh::io::{Coordinates, DofTable};
use faceoff_mesh::mesh::Mesh;

/// The largest remainder of a row, relative to its size.
const ROUNDING: f64 = 1e-12;
/// The most terms in one explanation.
const MOST: usize = 4;
/// The largest system that is explained.
const ROWS: usize = 200_000;

/// A term with different coefficients in the two systems.
#[derive(Debug, Clone, Serialize)]
pub struct OfTerm {
    /// The field.
    pub of: String,
    /// The term in the language of forms, with u the field and v its test function.
    pub term: String,
    /// The coefficient in the second system minus that in the first.
    pub more: f64,
    /// The coefficient in the first system, if all of it is known as a sum of terms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a: Option<f64>,
}

/// Terms in the language of forms, each with its cost in the recovery.
type Texts = Vec<(String, usize)>;

/// The terms assembled here, on the rows of one field.
struct Terms {
    texts: Texts,
    columns: Vec<Column>,
}

impl Scheme for Target<'_> {
    fn columns(&self) -> &[Column] {
        &self.terms.columns
    }

    fn left(&self, changes: &[(usize, f64)]) -> Option<Vec<f64>> {
        let mut rest = self.b.to_vec();
        for (k, delta) in changes {
            let all = rest.iter_mut().zip(&self.terms.columns[*k].vector);
            all.for_each(|(rest, d)| *rest -= delta * d);
        }
        Some(rest)
    }

    fn is_curved(&self, _: &[usize]) -> bool {
        false
    }

    fn rank(&self, change: usize, _: f64) -> usize {
        self.terms.texts[change].1
    }

    fn is_sound(&self, _: &Trial) -> bool {
        true
    }
}

struct Target<'a> {
    terms: &'a Terms,
    b: &'a [f64],
}

/// The terms by which matrices differ, and those by which loads do.
pub fn terms(both: &Both<'_>, compared: &Compared, mesh: &Mesh) -> [Vec<OfTerm>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    if both.is_held.len() > ROWS {
        return all;
    }
    for (field, name) in both.a.dofs.names.iter().enumerate() {
        let has_matrix = compared
            .matrix
            .iter()
            .any(|block| block.of == *name && block.with == *name && block.differs.rows > 0);
        let has_load = compared
            .load
            .iter()
            .any(|load| load.of == *name && load.differs.rows > 0);
        if !has_matrix && !has_load {
            continue;
        }
        for space in ["P1", "P2", "RT0", "N1curl", "P0", "CR"] {
            let Some(space) = Space::new(both, field, mesh, space) else {
                continue;
            };
            if has_matrix {
                all[0].extend(space.matrix(both, name));
            }
            // Constrained values come into the loads through the matrix.
            if has_load && !has_matrix {
                all[1].extend(space.load(both, name));
            }
            break;
        }
    }
    all
}

/// The terms assembled here in the space of a field, matched with its rows.
struct Space {
    assembler: Assembler,
    /// The rows of the field, and for each of them the dof here.
    rows: Vec<usize>,
    own: Vec<u32>,
    /// The factors of the dofs here relative to those of the rows.
    scale: Vec<f64>,
    bilinear: Texts,
    linear: Texts,
}

impl Space {
    /// For elements with this name; `None` if the rows are not their dofs.
    fn new(both: &Both<'_>, field: usize, mesh: &Mesh, element: &str) -> Option<Self> {
        let dofs = &both.a.dofs;
        let rows: Vec<usize> = (0..dofs.at.len())
            .filter(|k| usize::from(dofs.field[*k]) == field)
            .collect();
        let is_vector = rows.iter().any(|row| dofs.direction[*row][0] == 0.0);
        let dim = usize::from(mesh.dim());
        let groups = mesh
            .groups
            .iter()
            .filter(|group| usize::from(group.dim) + 1 == dim);
        let is_name = |name: &&str| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let groups: Vec<&str> = groups
            .filter_map(|group| group.name.as_deref())
            .filter(is_name)
            .collect();
        let is_moment = matches!(element, "RT0" | "N1curl");
        if is_moment && !is_vector {
            return None;
        }
        let (bilinear, linear) = match element {
            "RT0" | "N1curl" => of_moments(dim, element == "RT0", &groups),
            "P0" => of_constants(),
            _ => texts(dim, is_vector, &groups),
        };
        let space = match is_vector && !is_moment {
            true => format!("{element}^{dim}"),
            false => element.to_owned(),
        };
        let sum: Vec<&str> = bilinear
            .iter()
            .chain(&linear)
            .map(|(text, _)| text.as_str())
            .collect();
        let form = format!(
            "name = \"terms\"\n[spaces]\nu = \"{space}\"\n[form]\nF = \"{}\"\n",
            sum.join(" + ")
        );
        let problem = Problem::parse("terms".as_ref(), &form, mesh).ok()?;
        if problem.integrals.len() != sum.len() {
            return None;
        }
        let assembler = Assembler::of(&problem, mesh, &problem.integrals, false).ok()?;
        let system = |name: &str, table: DofTable| {
            let count = table.at.len();
            let matrix = Coordinates {
                rows: count,
                columns: count,
                entries: Vec::new(),
            };
            System::new(name, matrix, vec![0.0; count], table).ok()
        };
        let own = system("terms", dof_table(&assembler).ok()?)?;
        let part = DofTable {
            names: vec!["u".into()],
            field: vec![0; rows.len()],
            at: rows.iter().map(|row| dofs.at[*row]).collect(),
            direction: rows.iter().map(|row| dofs.direction[*row]).collect(),
            values: None,
        };
        let found = matched(&own, &system("field", part)?).ok()?;
        Some(Space {
            assembler,
            rows,
            own: found.to,
            scale: found.scale,
            bilinear,
            linear,
        })
    }

    /// F(w; ·) of each term, on the rows of the field relative to their sizes.
    fn columns(
        &self,
        both: &Both<'_>,
        w: &[f64],
        sizes: &[f64],
        which: std::ops::Range<usize>,
    ) -> Terms {
        let mut own = vec![0.0; self.assembler.dofs.count()];
        let each = || self.rows.iter().zip(&self.own).zip(&self.scale);
        each().for_each(|((row, dof), scale)| own[*dof as usize] = scale * w[*row]);
        let all = self.bilinear.iter().chain(&self.linear).cloned();
        let texts: Texts = all.skip(which.start).take(which.len()).collect();
        let columns = which.map(|k| {
            let state = State {
                u: &own,
                old: &[],
                parameters: &[],
            };
            let values = self
                .assembler
                .assemble_only(k, state, Wanted::Residual)
                .residual;
            let on_rows = each()
                .map(|((row, dof), scale)| over(both, *row, scale * values[*dof as usize], sizes));
            Column::number(on_rows.collect(), 1.0)
        });
        Terms {
            columns: columns.collect(),
            texts,
        }
    }

    /// The coefficients of each term in the matrices.
    fn matrix(&self, both: &Both<'_>, name: &str) -> Vec<OfTerm> {
        let mut w = vec![0.0; both.is_held.len()];
        for (k, row) in self
            .rows
            .iter()
            .enumerate()
            .filter(|(_, row)| !both.is_held[**row])
        {
            // Multiples of the golden ratio modulo 1: no two are equal, and none is small.
            w[*row] = 1.0 + (k as f64 * 0.618_033_988_749_895).fract();
        }
        let [(a, size), (b, other)] = [0, 1].map(|which| both.times(which, &w));
        let sizes: Vec<f64> = size.iter().zip(&other).map(|(a, b)| a.max(*b)).collect();
        let terms = self.columns(both, &w, &sizes, 0..self.bilinear.len());
        self.told(both, &terms, name, &sizes, |row| [a[row], b[row]])
    }

    /// The coefficients of each term in the loads.
    fn load(&self, both: &Both<'_>, name: &str) -> Vec<OfTerm> {
        let count = both.is_held.len();
        let most = self.rows.iter().filter(|row| !both.is_held[**row]);
        let most = most
            .map(|row| both.load(0, *row).0.abs().max(both.load(1, *row).0.abs()))
            .fold(0.0, f64::max);
        let sizes = vec![most; count];
        let bilinear = self.bilinear.len();
        let terms = self.columns(
            both,
            &vec![0.0; count],
            &sizes,
            bilinear..bilinear + self.linear.len(),
        );
        let values = |row| [0, 1].map(|which| both.load(which, row).0);
        self.told(both, &terms, name, &sizes, values)
    }

    /// The coefficients with which the terms give the values of the two systems.
    fn told(
        &self,
        both: &Both<'_>,
        terms: &Terms,
        name: &str,
        sizes: &[f64],
        values: impl Fn(usize) -> [f64; 2],
    ) -> Vec<OfTerm> {
        let scaled = |of: &dyn Fn([f64; 2]) -> f64| -> Vec<f64> {
            let rows = self.rows.iter();
            rows.map(|row| over(both, *row, of(values(*row)), sizes))
                .collect()
        };
        told(terms, name, &scaled(&|[a, b]| b - a), &scaled(&|[a, _]| a))
    }
}

/// Relative to the size of the row; 0 in constrained rows.
fn over(both: &Both<'_>, row: usize, value: f64, sizes: &[f64]) -> f64 {
    match both.is_held[row] || sizes[row] == 0.0 {
        true => 0.0,
        false => value / sizes[row],
    }
}

fn told(terms: &Terms, name: &str, more: &[f64], whole: &[f64]) -> Vec<OfTerm> {
    let find = |b: &[f64], most: usize| {
        let Recovered { exact, .. } = recover(&Target { terms, b }, b, ROUNDING, most);
        exact.into_iter().next()
    };
    let Some(found) = find(more, MOST) else {
        return Vec::new();
    };
    let whole = find(whole, 2 * MOST);
    let each = found.of.iter().zip(&found.deltas);
    each.map(|(k, delta)| {
        // A multiple that is at most rounding in every row is 0.
        let most = largest(&terms.columns[*k].vector);
        let plain = |x: f64| {
            if x.abs() * most <= 10.0 * ROUNDING {
                0.0
            } else {
                x
            }
        };
        let a = whole.as_ref().map(|whole| {
            let own = whole
                .of
                .iter()
                .zip(&whole.deltas)
                .find(|(own, _)| *own == k);
            own.map_or(0.0, |(_, a)| plain(*a))
        });
        OfTerm {
            of: name.to_owned(),
            term: terms.texts[*k].0.clone(),
            more: a.map_or(*delta, |a| plain(a + delta) - a),
            a,
        }
    })
    .collect()
}

/// Bilinear and linear terms, each with its cost in the recovery.
fn texts(dim: usize, is_vector: bool, groups: &[&str]) -> (Texts, Texts) {
    let mut bilinear: Texts = Vec::new();
    let mut linear: Texts = Vec::new();
    let dx = |text: &str, rank: usize| (format!("{text}*dx"), rank);
    let axes = || 0..dim;
    if is_vector {
        bilinear.push(dx("inner(sym(grad(u)), sym(grad(v)))", 0));
        bilinear.push(dx("div(u)*div(v)", 0));
        bilinear.push(dx("inner(grad(u), grad(v))", 0));
        bilinear.push(dx("dot(u, v)", 0));
        for k in axes() {
            let each: Vec<String> = axes()
                .map(|i| format!("grad(u)[{i}, {k}]*v[{i}]"))
                .collect();
            bilinear.push(dx(&format!("({})", each.join(" + ")), 2));
            bilinear.push(dx(&format!("u[{k}]*v[{k}]"), 3));
        }
        for group in groups {
            bilinear.push((format!("dot(u, v)*ds({group})"), 1));
            bilinear.push((format!("dot(u, n)*dot(v, n)*ds({group})"), 2));
        }
        for k in axes() {
            linear.push(dx(&format!("v[{k}]"), 0));
            linear.extend(
                ["x", "y", "z"][..dim]
                    .iter()
                    .map(|x| dx(&format!("{x}*v[{k}]"), 2)),
            );
            linear.extend(
                groups
                    .iter()
                    .map(|group| (format!("v[{k}]*ds({group})"), 1)),
            );
        }
    } else {
        bilinear.push(dx("dot(grad(u), grad(v))", 0));
        bilinear.push(dx("u*v", 0));
        for k in axes() {
            bilinear.push(dx(&format!("grad(u)[{k}]*v"), 2));
            bilinear.push(dx(&format!("u*grad(v)[{k}]"), 3));
            for l in axes().filter(|l| *l != k) {
                bilinear.push(dx(&format!("grad(u)[{k}]*grad(v)[{l}]"), 4));
            }
            bilinear.push(dx(&format!("grad(u)[{k}]*grad(v)[{k}]"), 3));
        }
        bilinear.extend(groups.iter().map(|group| (format!("u*v*ds({group})"), 1)));
        linear.push(dx("v", 0));
        linear.extend(
            ["x", "y", "z"][..dim]
                .iter()
                .map(|x| dx(&format!("{x}*v"), 2)),
        );
        linear.extend(groups.iter().map(|group| (format!("v*ds({group})"), 1)));
    }
    (bilinear, linear)
}

/// The same for lowest-order Raviart–Thomas, or else Nédélec, elements.
fn of_moments(dim: usize, is_normal: bool, groups: &[&str]) -> (Texts, Texts) {
    let mut bilinear = vec![("dot(u, v)*dx".to_owned(), 0)];
    bilinear.push(match (is_normal, dim) {
        (true, _) => ("div(u)*div(v)*dx".to_owned(), 0),
        (false, 2) => ("curl(u)*curl(v)*dx".to_owned(), 0),
        (false, _) => ("dot(curl(u), curl(v))*dx".to_owned(), 0),
    });
    bilinear.extend((0..dim).map(|k| (format!("u[{k}]*v[{k}]*dx"), 3)));
    let mut linear: Texts = (0..dim).map(|k| (format!("v[{k}]*dx"), 0)).collect();
    if dim == 2 {
        bilinear.push(("(u[0]*v[1] - u[1]*v[0])*dx".into(), 2));
    }
    for group in groups {
        let tangential = |v: &str| format!("({v}[0]*n[1] - {v}[1]*n[0])");
        if is_normal {
            bilinear.push((format!("dot(u, n)*dot(v, n)*ds({group})"), 1));
            linear.push((format!("dot(v, n)*ds({group})"), 1));
        } else if dim == 2 {
            bilinear.push((
                format!("{}*{}*ds({group})", tangential("u"), tangential("v")),
                1,
            ));
            linear.push((format!("{}*ds({group})", tangential("v")), 1));
        }
    }
    (bilinear, linear)
}

/// The same for piecewise constants.
fn of_constants() -> (Texts, Texts) {
    (vec![("u*v*dx".into(), 0)], vec![("v*dx".into(), 0)])
}
