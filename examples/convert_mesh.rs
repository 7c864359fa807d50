//! Reads a mesh of any format, prints its groups, and writes it as VTU.
//!
//!     cargo run --example convert_mesh -- meshes/plate.msh plate.vtu

use std::path::Path;
use std::process::ExitCode;

use faceoff_mesh::{Result, io};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = &arguments[..] else {
        eprintln!("usage: convert_mesh IN OUT.vtu");
        return ExitCode::from(2);
    };
    match convert(input.as_ref(), output.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn convert(input: &Path, output: &Path) -> Result<()> {
    let mesh = io::read(input)?;
    println!("{} points, {} cells", mesh.points.len(), mesh.cell_count());
    for group in &mesh.groups {
        let name = group.name.as_deref().unwrap_or("(no name)");
        let (dim, tag, count) = (group.dim, group.tag, group.cells.len());
        println!("{dim}D group {tag}, {name}: {count} cells");
    }
    let options = io::Options {
        format: Some(io::Format::VTU),
        // What VTU cannot hold becomes a warning.
        lossy: true,
        ..io::Options::default()
    };
    for warning in io::write(output, &mesh, &options)? {
        eprintln!("warning: {warning}");
    }
    Ok(())
}
