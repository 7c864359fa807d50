//! Finds terms that differ on a few cells or facets, from the contributions of those that touch a row that does not hold.

use faceoff_fem::linear::General;

use super::change::Change;
use super::recovery::Column;
use super::residual::{Residual, largest};
use crate::own::{Entity, Work};
use crate::problem::{Bilinear, Domain};

/// The most cells of one change that are found one after the other.
const CELLS: usize = 6;
/// A change in more than this fraction of the rows is not local.
const ROWS: f64 = 0.5;
/// The most cells or facets that are examined.
const MOST: usize = 20_000;
/// Factors that differ by less are equal.
const SAME: f64 = 1e-6;

/// The contribution of a cell or facet to some rows, relative to their sizes.
struct Part {
    at: [f64; 3],
    rows: Vec<(usize, f64)>,
}

/// The changes of each term on some cells or facets, with one factor, that explain the residual or come closest.
pub fn local(residual: &Residual<'_>, b: &[f64], rounding: f64) -> Vec<(Change, Column)> {
    let failing = b.iter().filter(|b| b.abs() > rounding).count();
    let free = residual.held.is_held.iter().filter(|is| !**is).count();
    if failing as f64 > ROWS * free as f64 || !residual.means.is_empty() {
        return Vec::new();
    }
    let integrals = &residual.problem.integrals;
    let alone = (0..integrals.len()).map(|term| vec![term]);
    // All terms over one measure, for a code that skips a facet.
    let firsts = (0..integrals.len()).filter_map(|first| {
        let same = |k: &usize| integrals[*k].measure == integrals[first].measure;
        let all: Vec<usize> = (0..integrals.len()).filter(same).collect();
        (all[0] == first && all.len() > 1).then_some(all)
    });
    let each = alone.chain(firsts).filter_map(|terms| {
        let (parts, of, domain) = parts(residual, &terms, b, rounding)?;
        let chosen = match domain {
            Domain::Cells => by_turns(&parts, b, rounding),
            _ => together(&parts, b),
        };
        column(residual, &terms, domain, of, &parts, &chosen)
    });
    each.collect()
}

/// The cells or facets of terms over one measure that touch rows which do not hold, and the number of all.
fn parts(
    residual: &Residual<'_>,
    terms: &[usize],
    b: &[f64],
    rounding: f64,
) -> Option<(Vec<Part>, usize, Domain)> {
    let mut problem = residual.problem.clone();
    problem.integrals = terms
        .iter()
        .map(|k| problem.integrals[*k].clone())
        .collect();
    let integral = problem.residual().pop()?;
    let (mesh, rules) = (&residual.assembler.mesh, problem.rules());
    let by = Bilinear::new();
    let work = Work::new(&mut problem, mesh, residual.source, &integral, rules, by);
    let mut parts = Vec::new();
    let state = residual.state(&residual.parameters);
    residual
        .assembler
        .contributions(&problem, &work, state, |entity, rows| {
            let is_failing = |(dof, _): &(usize, f64)| b[*dof].abs() > rounding;
            if parts.len() > MOST || !rows.iter().any(is_failing) {
                return;
            }
            let free = rows
                .iter()
                .filter(|(dof, _)| !residual.held.is_held[*dof] && residual.sizes[*dof] > 0.0);
            let mut scaled: Vec<(usize, f64)> = free
                .map(|(dof, value)| (*dof, value / residual.sizes[*dof]))
                .collect();
            // Both sides of a facet may share a dof.
            scaled.sort_by_key(|(dof, _)| *dof);
            scaled.dedup_by(|b, a| {
                let is_same = a.0 == b.0;
                if is_same {
                    a.1 += b.1;
                }
                is_same
            });
            if scaled.iter().any(|(_, value)| value.abs() > rounding) {
                parts.push(Part {
                    at: centre(residual, &work, entity),
                    rows: scaled,
                });
            }
        });
    let domain = integral.measure.domain;
    (!parts.is_empty() && parts.len() <= MOST).then_some((parts, work.entities.len(), domain))
}

fn centre(residual: &Residual<'_>, work: &Work, entity: &Entity) -> [f64; 3] {
    let mesh = &residual.assembler.mesh;
    let facet = match work.domain {
        Domain::Cells => None,
        _ => Some(work.placements[usize::from(entity.places[0])].facet),
    };
    let all = mesh.vertices(entity.cells[0] as usize);
    let is_its = |k: &usize| facet.is_none_or(|facet| mesh.shape.is_on(*k, facet));
    let own = (0..mesh.shape.corners(mesh.dim))
        .filter(is_its)
        .map(|k| all[k]);
    let count = own.clone().count() as f64;
    std::array::from_fn(|axis| own.clone().map(|at| at[axis]).sum::<f64>() / count)
}

/// The change with its cells and facets, and its factor minus 1.
type Chosen = Vec<usize>;

/// The cell that reduces the residual most, then the next one, until nothing is left.
fn by_turns(parts: &[Part], b: &[f64], rounding: f64) -> Chosen {
    let mut rest = b.to_vec();
    let mut chosen = Vec::new();
    while chosen.len() < CELLS && largest(&rest) > rounding {
        let fit = |part: &Part| {
            let square: f64 = part.rows.iter().map(|(_, d)| d * d).sum();
            let both: f64 = part.rows.iter().map(|(dof, d)| d * rest[*dof]).sum();
            (both * both / square, both / square)
        };
        let open = (0..parts.len()).filter(|k| !chosen.contains(k));
        let Some(best) = open.max_by(|i, j| fit(&parts[*i]).0.total_cmp(&fit(&parts[*j]).0)) else {
            break;
        };
        let (_, delta) = fit(&parts[best]);
        for (dof, d) in &parts[best].rows {
            rest[*dof] -= delta * d;
        }
        chosen.push(best);
    }
    chosen
}

/// Facets share few rows, so the factors of all follow at once; those with the factor of the largest are chosen.
fn together(parts: &[Part], b: &[f64]) -> Chosen {
    let mut of_rows: std::collections::BTreeMap<usize, Vec<(usize, f64)>> = Default::default();
    for (k, part) in parts.iter().enumerate() {
        for (dof, d) in &part.rows {
            of_rows.entry(*dof).or_default().push((k, *d));
        }
    }
    let mut rows: Vec<std::collections::BTreeMap<usize, f64>> =
        vec![Default::default(); parts.len()];
    let mut right = vec![0.0; parts.len()];
    for (dof, entries) in &of_rows {
        for (k, d) in entries {
            right[*k] += d * b[*dof];
            for (l, e) in entries {
                *rows[*k].entry(*l).or_default() += d * e;
            }
        }
    }
    let rows = rows
        .into_iter()
        .map(|row| row.into_iter().collect())
        .collect();
    let places: Vec<[f64; 3]> = parts.iter().map(|part| part.at).collect();
    let solved = General::new(rows, &places, None).and_then(|factor| factor.solve(&right));
    let Ok(deltas) = solved else {
        return Vec::new();
    };
    let most = deltas.iter().fold(
        0.0_f64,
        |most, d| if d.abs() > most.abs() { *d } else { most },
    );
    let is_it = |k: &usize| (deltas[*k] - most).abs() <= SAME * most.abs().max(SAME);
    (0..parts.len()).filter(is_it).collect()
}

/// The sum of the contributions of the chosen ones.
fn column(
    residual: &Residual<'_>,
    terms: &[usize],
    domain: Domain,
    of: usize,
    parts: &[Part],
    chosen: &[usize],
) -> Option<(Change, Column)> {
    let mut vector = vec![0.0; residual.u.len()];
    let mut between = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for part in chosen.iter().map(|k| &parts[*k]) {
        part.rows.iter().for_each(|(dof, d)| vector[*dof] += d);
        for (axis, x) in part.at.iter().enumerate() {
            between[0][axis] = between[0][axis].min(*x);
            between[1][axis] = between[1][axis].max(*x);
        }
    }
    // All of them together are the whole term.
    let is_some = !chosen.is_empty() && chosen.len() < of && vector.iter().any(|d| *d != 0.0);
    is_some.then(|| {
        let change = Change::Some {
            term: terms[0],
            is_all: terms.len() > 1,
            domain,
            count: chosen.len(),
            of,
            between,
        };
        let column = Column {
            plain: &[-1.0, -2.0],
            ..Column::number(vector, 1.0)
        };
        (change, column)
    })
}
