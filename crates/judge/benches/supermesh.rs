//! Two meshes laid over each other, and one mesh with discontinuous data in another order: seconds and memory.
//!
//! `cargo bench -p faceoff-judge --bench supermesh [-- N]`, N squares along a side, each cut in two; 707 are a million
//! triangles. Then tetrahedra, a fifth as many.
#![allow(clippy::unwrap_used, reason = "a table, not a program")]

use std::time::Instant;

use faceoff_judge::{Settings, Verdict, compare_results, project};
use faceoff_mesh::CellKind;
use faceoff_mesh::field::{ResultField, Results};

/// The unit square or cube in simplices, cubes in an order of their own, bent inside.
fn mesh(dim: usize, n: usize, bend: f64) -> Results {
    let at = |k: usize| k as f64 / n as f64;
    let mut points = Vec::new();
    for k in 0..=if dim == 3 { n } else { 0 } {
        for j in 0..=n {
            for i in 0..=n {
                let x = [at(i), at(j), at(k)];
                let bump = x[..dim].iter().map(|x| 4.0 * x * (1.0 - x));
                let bump = bend * bump.product::<f64>();
                let z = if dim == 3 { x[2] + 0.3 * bump } else { 0.0 };
                points.push([x[0] + bump, x[1] - 0.7 * bump, z]);
            }
        }
    }
    let number = |i: [usize; 3]| (i[0] + (n + 1) * (i[1] + (n + 1) * i[2])) as u32;
    let paths: &[&[usize]] = match dim {
        2 => &[&[0, 1], &[1, 0]],
        _ => &[
            &[0, 1, 2],
            &[0, 2, 1],
            &[1, 0, 2],
            &[1, 2, 0],
            &[2, 0, 1],
            &[2, 1, 0],
        ],
    };
    let mut cells = Vec::new();
    let count = n.pow(dim as u32);
    for cube in (0..count).map(|k| k * 7919 % count) {
        for path in paths {
            let mut corner = [cube % n, cube / n % n, cube / n / n];
            cells.push(number(corner));
            for &axis in *path {
                corner[axis] += 1;
                cells.push(number(corner));
            }
        }
    }
    let kind = if dim == 2 {
        CellKind::Triangle
    } else {
        CellKind::Tetrahedron
    };
    let u = |x: &[f64; 3]| (3.0 * x[0] + x[1] + x[2]).sin();
    let field = ResultField {
        name: "u".into(),
        components: 1,
        values: points.iter().map(u).collect(),
        rest: None,
        at: None,
        scaled_by: None,
        single: false,
    };
    Results {
        source: format!("{n}"),
        space: dim,
        width: dim + 1,
        kinds: vec![(kind, cells.len() / (dim + 1))],
        cells: cells.into(),
        points: points.into(),
        on_points: vec![field],
        ..Results::default()
    }
}

/// The same with points of their own for each cell, where values jump; the cells forwards or backwards.
fn broken(of: &Results, backwards: bool) -> Results {
    let (width, count) = (of.width, of.cell_count());
    let order = |k: usize| if backwards { count - 1 - k } else { k };
    let corners = (0..count).flat_map(|k| (0..width).map(move |i| (order(k), i)));
    let corners: Vec<(usize, usize)> = corners.collect();
    let mut side = of.clone();
    let point = |(cell, i): &(usize, usize)| of.points[of.cells[width * cell + i] as usize];
    side.points = corners.iter().map(point).collect();
    side.cells = (0..corners.len() as u32).collect();
    let value = |(cell, i): &(usize, usize)| (cell * width + i) as f64;
    side.on_points[0].values = corners.iter().map(value).collect();
    side
}

/// Megabytes, at most so far.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) / 1e3
}

fn main() {
    let asked = std::env::args().skip(1).find_map(|word| word.parse().ok());
    let n: usize = asked.unwrap_or(707);
    let cubes = ((n * n) as f64 / 15.0).cbrt().round() as usize;
    println!(
        "{:>3} {:>9} {:>9} {:>10} {:>10} {:>8}",
        "dim", "cells", "others", "compare s", "project s", "MB"
    );
    for (dim, n) in [(2, n), (3, cubes.max(2))] {
        let (a, b) = (mesh(dim, n, 0.02), mesh(dim, n + 1, -0.03));
        let start = Instant::now();
        let compared = compare_results(&a, &b, &Settings::default()).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let found = compared.intersection.unwrap();
        assert!((found.common - 1.0).abs() < 1e-12, "{found:?}");
        let start = Instant::now();
        project(&a, &b, &|_| {}).unwrap();
        let projected = start.elapsed().as_secs_f64();
        let [cells, others] = found.cells;
        println!(
            "{dim:>3} {cells:>9} {others:>9} {seconds:>10.1} {projected:>10.1} {:>8.0}",
            peak()
        );
    }
    let of = mesh(2, n, 0.02);
    let (a, b) = (broken(&of, false), broken(&of, true));
    let start = Instant::now();
    let compared = compare_results(&a, &b, &Settings::default()).unwrap();
    assert_eq!(
        (compared.verdict, compared.fields[0].field.max_abs),
        (Verdict::Agree, 0.0)
    );
    let (cells, seconds) = (a.cell_count(), start.elapsed().as_secs_f64());
    println!(
        "discontinuous, permuted: {cells} cells, {seconds:.1} s, {:.0} MB",
        peak()
    );
}
