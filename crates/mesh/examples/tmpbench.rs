use faceoff_mesh::io::{self, vtu::*};
use faceoff_mesh::mesh::{CellBlock, CellKind, Mesh};
use std::time::Instant;
fn main() {
    let n = 708u32;
    let h = 1.0 / f64::from(n);
    let point = |i: u32| [f64::from(i % (n + 1)) * h, f64::from(i / (n + 1)) * h, 0.0];
    let corners = (0..n * n).map(|i| i / n * (n + 1) + i % n);
    let nodes = corners.flat_map(|a| [a, a + 1, a + n + 2, a, a + n + 2, a + n + 1]);
    let mesh = Mesh {
        points: (0..(n + 1) * (n + 1)).map(point).collect(),
        blocks: vec![CellBlock::new(CellKind::Triangle, nodes.collect())],
        ..Mesh::default()
    };
    for (name, binary) in [
        ("ascii.vtk", false),
        ("binary.vtk", true),
        ("raw.vtp", false),
        ("raw.vtu", false),
    ] {
        let path = std::path::Path::new("/tmp/bench").join(name);
        let o = io::Options {
            binary,
            vtu: Encoding::Raw(Compressor::None),
            ..Default::default()
        };
        let (mut w, mut r) = (9e9f64, 9e9f64);
        for _ in 0..3 {
            let s = Instant::now();
            io::write(&path, &mesh, &o).unwrap();
            w = w.min(s.elapsed().as_secs_f64());
            let s = Instant::now();
            assert_eq!(io::read(&path).unwrap().cell_count(), mesh.cell_count());
            r = r.min(s.elapsed().as_secs_f64());
        }
        println!("{name} read {r:.3} write {w:.3}");
    }
}
