//! `faceoff compare` on a million triangles of discontinuous data, whose points, cells and corners stand in another
//! order in the second file: seconds and peak memory of the whole program, and whether it found what it should.
//!
//! `cargo bench --bench compare [-- SQUARES]`, SQUARES along a side, each cut in two; 708 are a million triangles.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use faceoff::engine::peak_memory_mb;
use faceoff_mesh::io::{self, Options};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// k ↦ s k + t modulo `count`, with s prime to it: a permutation without neighbours.
fn permutation(count: usize) -> impl Fn(usize) -> usize {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (0.618 * count as f64) as usize;
    let stride = (golden..).find(|s| gcd(*s, count) == 1).unwrap_or(1);
    move |k| (k * stride + count / 3) % count
}

/// 2 n² triangles with points of their own: u may jump between them, w is on cells. `permuted` has the same in another
/// order, and `off` is added to one value.
fn triangles(n: usize, permuted: bool, off: f64) -> Mesh {
    // No binary32, so that places are compared in full.
    let place = |k: usize| (k as f64 + 0.1 * (k as f64).sin()) / n as f64;
    let cells = 2 * n * n;
    let (cell_to, point_to) = (permutation(cells), permutation(3 * cells));
    let mut points = vec![[0.0; 3]; 3 * cells];
    let mut nodes = vec![0; 3 * cells];
    let (mut u, mut w) = (vec![0.0; 3 * cells], vec![0.0; cells]);
    for cell in 0..cells {
        let (i, j) = (cell / 2 % n, cell / 2 / n);
        let corners = match cell % 2 {
            0 => [(i, j), (i + 1, j), (i + 1, j + 1)],
            _ => [(i, j), (i + 1, j + 1), (i, j + 1)],
        };
        let at = if permuted { cell_to(cell) } else { cell };
        w[at] = (0.37 * cell as f64).sin();
        for (k, (i, j)) in corners.into_iter().enumerate() {
            let of_u = (0.11 * (3 * cell + k) as f64).cos();
            let (point, corner) = match permuted {
                true => (point_to(3 * cell + k), (k + cell) % 3),
                false => (3 * cell + k, k),
            };
            points[point] = [place(i), place(j), 0.0];
            u[point] = of_u;
            nodes[3 * at + corner] = point as u32;
        }
    }
    u[cells] += off;
    let field = |name: &str, on, values| Field::new(name, on, 1, Values::F64(values));
    Mesh {
        points: points.into(),
        blocks: vec![CellBlock::new(CellKind::Triangle, nodes)],
        fields: vec![
            field("u", Support::Points, u.into()),
            field("w", Support::Cells, w.into()),
        ],
        ..Mesh::default()
    }
}

/// Runs the program; exit code and seconds.
fn compare(folder: &Path, words: &[&str]) -> (Option<i32>, f64) {
    let clock = Instant::now();
    let mut program = Command::new(env!("CARGO_BIN_EXE_faceoff"));
    program.current_dir(folder).arg("compare").args(words);
    let status = program.status().expect("the program starts");
    (status.code(), clock.elapsed().as_secs_f64())
}

fn main() {
    let n = std::env::args().skip(1).find_map(|word| word.parse().ok());
    let n: usize = n.unwrap_or(708);
    let folder = tempfile::tempdir().expect("a folder");
    for (name, permuted, off) in [("a", false, 0.0), ("b", true, 0.0), ("off", true, 1e-6)] {
        let path = folder.path().join(format!("{name}.vtu"));
        io::write(&path, &triangles(n, permuted, off), &Options::default()).expect("written");
    }
    println!("{} triangles, {} points", 2 * n * n, 6 * n * n);
    for (other, out, expected) in [
        ("b.vtu", &[][..], Some(0)),
        ("off.vtu", &[], Some(1)),
        ("b.vtu", &["--out", "difference.vtu"], Some(0)),
    ] {
        let words = [&["a.vtu", other], out].concat();
        let (code, seconds) = compare(folder.path(), &words);
        assert_eq!(code, expected, "{words:?}");
        println!("{}: {seconds:.2} s", words.join(" "));
    }
    println!("at most {:.0} MB", peak_memory_mb(true));
}
