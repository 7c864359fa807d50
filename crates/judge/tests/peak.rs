//! What a comparison takes beside the results that it is given: alone in its process, whose peak is measured.
#![cfg(target_os = "linux")]

use faceoff_judge::{Settings, compare_results};
use faceoff_mesh::field::Results;
use faceoff_mesh::io::{Content, of_content};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Triangles with points of their own, two in each of n² squares, and a value at each point.
fn discontinuous(n: usize) -> Results {
    let place = |k: usize| (k as f64 + 0.1 * (k as f64).sin()) / n as f64;
    let squares = (0..n * n).map(|k| (k % n, k / n));
    let corners = squares.flat_map(|(i, j)| {
        let [p, q, r, s] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        [p, q, r, p, r, s]
    });
    let points: Vec<[f64; 3]> = corners.map(|(i, j)| [place(i), place(j), 0.0]).collect();
    let nodes = (0..points.len() as u32).collect();
    let values = points.iter().map(|[x, y, _]| (x + 3.0 * y).sin()).collect();
    let mesh = Mesh {
        blocks: vec![CellBlock::new(CellKind::Triangle, nodes)],
        fields: vec![Field::new("u", Support::Points, 1, Values::F64(values))],
        points: points.into(),
        ..Mesh::default()
    };
    let content = Content {
        mesh,
        ..Content::default()
    };
    of_content("made here".as_ref(), content).expect("a mesh")
}

/// Bytes that this process has or had at most.
fn bytes(what: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find_map(|line| line.strip_prefix(what));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<usize>().ok());
    1024 * kilobytes.expect("a number")
}

#[test]
fn a_million_values_are_compared_without_another_copy_of_the_arrays() {
    let (a, mut b) = (discontinuous(409), discontinuous(409));
    b.on_points[0].values.to_mut()[1000] += 1.0;
    let of = |side: &Results| {
        24 * side.points.len() + 4 * side.cells.len() + 8 * side.on_points[0].values.len()
    };
    let arrays = of(&a) + of(&b);
    // 5 sets the peak back to what is held now.
    std::fs::write("/proc/self/clear_refs", "5").expect("Linux has it");
    let before = bytes("VmRSS");
    let found = compare_results(&a, &b, &Settings::default()).expect("comparable");
    let more = bytes("VmHWM") - before;
    assert_eq!(found.fields[0].field.beyond, 1);
    assert_eq!(a.points, found.differences[0].places(&a));
    println!("{more} bytes more than the arrays' {arrays}");
    assert!(more < arrays, "{more} bytes more than the arrays' {arrays}");
}
