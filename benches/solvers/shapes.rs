//! Bodies of many shapes by each way to solve them: does `auto` choose the fastest?

use faceoff_fem::contact::{Discretisation, Iteration, Problem, Solution, Stop, solve_by};
use faceoff_fem::linear::{Settings, Solver};
use faceoff_fem::scene::{GroupName, Scene};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh, Triangulation};
use std::collections::BTreeMap;

/// A dense contact system of more multiplications and additions is not tried: minutes.
const TOO_MANY: f64 = 1e11;

/// Each way is taken so often, unless it takes longer than so many seconds.
const REPEATS: usize = 3;
const LONG: f64 = 5.0;

/// Unit cubes of a lattice, those that `has`, each cut by the paths of Kuhn (1960).
struct Shape {
    name: &'static str,
    cells: [usize; 3],
    has: fn([usize; 3]) -> bool,
    /// Contact above as well, so that Γ_D is the rest.
    both: bool,
}

const fn shape(name: &'static str, cells: [usize; 3]) -> Shape {
    Shape {
        name,
        cells,
        has: |_| true,
        both: false,
    }
}

const SHAPES: [Shape; 21] = [
    shape("square", [32, 32, 0]),
    shape("square", [64, 64, 0]),
    shape("square", [128, 128, 0]),
    shape("square", [256, 256, 0]),
    shape("strip", [500, 4, 0]),
    shape("strip", [1000, 4, 0]),
    shape("strip", [2000, 4, 0]),
    shape("strip", [4000, 4, 0]),
    shape("strip", [8000, 4, 0]),
    shape("strip", [2000, 16, 0]),
    shape("strip", [500, 100, 0]),
    Shape {
        both: true,
        ..shape("strip, two sides", [1000, 12, 0])
    },
    Shape {
        both: true,
        ..shape("strip, two sides", [2000, 1, 0])
    },
    Shape {
        has: |[i, j, _]| j >= 40 || i % 8 < 4,
        ..shape("comb", [200, 60, 0])
    },
    Shape {
        has: |[i, j, _]| j >= 4 || i % 16 < 8,
        ..shape("comb", [1600, 8, 0])
    },
    shape("tower", [8, 1000, 0]),
    shape("cube", [8, 8, 8]),
    shape("cube", [16, 16, 16]),
    shape("plate", [24, 24, 2]),
    shape("plate", [64, 64, 2]),
    shape("beam", [200, 4, 4]),
];

impl Shape {
    fn dim(&self) -> usize {
        if self.cells[2] == 0 { 2 } else { 3 }
    }

    fn mesh(&self) -> Mesh {
        let dim = self.dim();
        let rows = self.cells.map(|n| n + 1);
        let number = |v: [usize; 3]| ((v[2] * rows[1] + v[1]) * rows[0] + v[0]) as u32;
        let orders: &[&[usize]] = match dim {
            2 => &[&[0, 1], &[1, 0]],
            _ => &[
                &[0, 1, 2],
                &[1, 2, 0],
                &[2, 0, 1],
                &[0, 2, 1],
                &[2, 1, 0],
                &[1, 0, 2],
            ],
        };
        let mut cells = Vec::new();
        for k in 0..self.cells[2].max(1) {
            for (i, j) in (0..self.cells[1]).flat_map(|j| (0..self.cells[0]).map(move |i| (i, j))) {
                if !(self.has)([i, j, k]) {
                    continue;
                }
                for (turn, order) in orders.iter().enumerate() {
                    let mut at = [i, j, k];
                    let mut simplex = vec![number(at)];
                    for &axis in *order {
                        at[axis] += 1;
                        simplex.push(number(at));
                    }
                    if 2 * turn >= orders.len() {
                        simplex.swap(dim - 1, dim);
                    }
                    cells.push(simplex);
                }
            }
        }
        // Faces of one cell, by side.
        let mut faces: BTreeMap<Vec<u32>, Option<Vec<u32>>> = BTreeMap::new();
        for cell in &cells {
            for out in 0..=dim {
                let face: Vec<u32> = (0..=dim).filter(|k| *k != out).map(|k| cell[k]).collect();
                let mut key = face.clone();
                key.sort_unstable();
                let found = faces.entry(key);
                found.and_modify(|old| *old = None).or_insert(Some(face));
            }
        }
        let place = |v: u32| {
            let v = v as usize;
            [v % rows[0], v / rows[0] % rows[1], v / rows[0] / rows[1]]
        };
        let mut sides: [Vec<u32>; 3] = Default::default();
        for face in faces.into_values().flatten() {
            let all = |height: usize| face.iter().all(|v| place(*v)[dim - 1] == height);
            let side = match (all(0), all(self.cells[dim - 1])) {
                (true, _) => 0,
                (_, true) => 1,
                _ => 2,
            };
            sides[side].extend(face);
        }
        let mut first = 0;
        let mut groups = Vec::new();
        for (tag, (side, name)) in sides.iter().zip(["bottom", "top", "sides"]).enumerate() {
            let end = first + (side.len() / dim) as u32;
            groups.push(Group {
                dim: dim as u8 - 1,
                tag: tag as i64 + 1,
                name: Some(name.into()),
                cells: (first..end).collect(),
            });
            first = end;
        }
        // Vertices without a cell, beside a comb's teeth, are left out.
        let mut used = vec![u32::MAX; rows.iter().product()];
        let mut points = Vec::new();
        let unit = 1.0 / self.cells[dim - 1] as f64;
        let mut renumbered = |nodes: Vec<u32>| -> Vec<u32> {
            let number = |v: u32| {
                if used[v as usize] == u32::MAX {
                    used[v as usize] = points.len() as u32;
                    points.push(place(v).map(|x| x as f64 * unit));
                }
                used[v as usize]
            };
            nodes.into_iter().map(number).collect()
        };
        let cells = renumbered(cells.concat());
        let sides = renumbered(sides.concat());
        let kinds = match dim {
            2 => [CellKind::Line, CellKind::Triangle],
            _ => [CellKind::Triangle, CellKind::Tetrahedron],
        };
        Mesh {
            points,
            groups,
            blocks: vec![
                CellBlock::new(kinds[0], sides),
                CellBlock::new(kinds[1], cells),
            ],
            ..Mesh::default()
        }
    }
}

fn seconds(solution: &Solution) -> f64 {
    let spent = solution.seconds;
    spent.factor + spent.iterate + spent.expand
}

/// Prints a row for each shape and method.
pub fn compare(stop: Stop) -> super::Outcome<()> {
    println!(
        "\n| shape | squares or cubes | method | unknowns | contact faces | multifrontal | iterative | dense (faer) | auto | chosen | auto / best | Gflop | MB predicted |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for shape in &SHAPES {
        let mesh = Triangulation::new(shape.name, &shape.mesh())?;
        let built_in = Scene::find(if shape.dim() == 2 {
            "one-zone"
        } else {
            "one-zone-3d"
        })?;
        let named = |names: &[&str]| names.iter().map(|n| GroupName::Name((*n).into())).collect();
        let mut boundary = built_in.boundary().clone();
        [boundary.contact, boundary.dirichlet, boundary.neumann] = if shape.both {
            [named(&["bottom", "top"]), named(&["sides"]), Vec::new()]
        } else {
            [named(&["bottom"]), named(&["top"]), named(&["sides"])]
        };
        let scene = built_in.with_boundary(boundary);
        for method in if shape.dim() == 2 {
            &["cr", "cr-fc", "p2"][..]
        } else {
            &["cr", "p2"]
        } {
            let discretisation = Discretisation::of(&scene, method.parse()?);
            let problem = Problem::new(&scene, &mesh, &discretisation)?;
            let once = |solver: Solver| {
                let settings = Settings {
                    solver,
                    ..Settings::default()
                };
                solve_by(&problem, Iteration::Newton, stop, settings, |_, _| Ok(()))
            };
            let kept = 3.0 * problem.contact.len() as f64 * problem.space.element.degree() as f64;
            let ways = [
                (Solver::Multifrontal, true),
                (Solver::Iterative, method.starts_with("cr")),
                (Solver::Faer, kept.powi(3) < TOO_MANY),
                (Solver::Auto, true),
            ];
            // In turn, so that what else the machine does hits all.
            let mut found: [Option<(f64, Solution)>; 4] = [const { None }; 4];
            for _ in 0..REPEATS {
                for ((solver, is_possible), best) in ways.into_iter().zip(&mut found) {
                    let is_long = best.as_ref().is_some_and(|(least, _)| *least > LONG);
                    if is_possible && !is_long {
                        let solution = once(solver)?;
                        let least = best.as_ref().map_or(f64::INFINITY, |(least, _)| *least);
                        *best = Some((least.min(seconds(&solution)), solution));
                    }
                }
            }
            let [Some((direct, by)), iterative, dense, Some((auto, chosen))] = found else {
                return Err("a way that is always there was not taken".into());
            };
            for other in [&dense, &iterative].into_iter().flatten() {
                let off = super::distance(&by.u, &other.1.u);
                if !(off <= super::AGREEMENT) {
                    return Err(format!("{} {method}: ways are {off:e} apart", shape.name).into());
                }
            }
            let told = |way: &Option<(f64, Solution)>| {
                way.as_ref()
                    .map_or(String::new(), |(s, _)| format!("{s:.3}"))
            };
            let best = [&dense, &iterative]
                .into_iter()
                .flatten()
                .fold(direct, |best: f64, way| best.min(way.0));
            let squares: Vec<String> = shape.cells[..shape.dim()]
                .iter()
                .map(usize::to_string)
                .collect();
            println!(
                "| {} | {} | {method} | {} | {} | {direct:.3} | {} | {} | {auto:.3} | {} | {:.2} | {:.2} | {:.0} |",
                shape.name,
                squares.join(" × "),
                problem.space.dofs,
                problem.contact.len(),
                told(&iterative),
                told(&dense),
                chosen.linear.solver,
                auto / best,
                by.linear.flops / 1e9,
                by.linear.predicted_mb,
            );
        }
    }
    Ok(())
}
