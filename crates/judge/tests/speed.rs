use faceoff_judge::*;
use faceoff_mesh::{CellKind, field::*};
fn mesh(dim: usize, n: usize, bend: f64) -> Results {
    let m = n + 1;
    let mut points = vec![];
    let top = if dim == 3 { n } else { 0 };
    for k in 0..=top {
        for j in 0..=n {
            for i in 0..=n {
                let x = [
                    i as f64 / n as f64,
                    j as f64 / n as f64,
                    k as f64 / n as f64,
                ];
                let b: f64 = bend
                    * x[..dim]
                        .iter()
                        .map(|x| 4.0 * x * (1.0 - x))
                        .product::<f64>();
                points.push([
                    x[0] + b,
                    x[1] - 0.7 * b,
                    if dim == 3 { x[2] + 0.3 * b } else { 0.0 },
                ]);
            }
        }
    }
    let mut cells: Vec<u32> = vec![];
    let at = |i: [usize; 3]| (i[0] + m * (i[1] + m * i[2])) as u32;
    let paths: &[&[usize]] = if dim == 3 {
        &[
            &[0, 1, 2],
            &[0, 2, 1],
            &[1, 0, 2],
            &[1, 2, 0],
            &[2, 0, 1],
            &[2, 1, 0],
        ]
    } else {
        &[&[0, 1], &[1, 0]]
    };
    for c in 0..n.pow(dim as u32) {
        // permuted
        let c = (c * 7919) % n.pow(dim as u32);
        let base = [c % n, c / n % n, c / n / n];
        for p in paths {
            let mut i = base;
            cells.push(at(i));
            for a in *p {
                i[*a] += 1;
                cells.push(at(i));
            }
        }
    }
    let count = cells.len() / (dim + 1);
    let u = points
        .iter()
        .map(|x| (3.0 * x[0] + x[1] + x[2]).sin())
        .collect();
    Results {
        source: format!("m{n}"),
        space: dim,
        points,
        width: dim + 1,
        cells,
        kinds: vec![(
            if dim == 2 {
                CellKind::Triangle
            } else {
                CellKind::Tetrahedron
            },
            count,
        )],
        on_points: vec![ResultField {
            name: "u".into(),
            components: 1,
            values: u,
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        }],
        ..Results::default()
    }
}
fn main_() {
    for (dim, n, m) in [(2, 707, 709), (3, 32, 33)] {
        let (a, b) = (mesh(dim, n, 0.02), mesh(dim, m, -0.03));
        let t = std::time::Instant::now();
        let c = compare_results(&a, &b, &Settings::default()).unwrap();
        println!(
            "{dim}D {} cells: {:.1} s, {} MB; {:?} {:?}",
            a.cell_count(),
            t.elapsed().as_secs_f64(),
            faceoff_mesh::memory::held() / 1_000_000,
            c.fields[0].norms,
            c.intersection
        );
    }
    println!(
        "{}",
        std::fs::read_to_string("/proc/self/status")
            .unwrap()
            .lines()
            .find(|l| l.starts_with("VmHWM"))
            .unwrap()
    );
}
#[test]
#[ignore]
fn speed() {
    main_()
}
