//! Writes legacy VTK: the arrays that VTU has, as fields.

use super::numbers::TYPES;
use crate::error::Result;
use crate::field::data::with_numbers;
use crate::io::Job;
use crate::io::out::Out;
use crate::io::scalar::Scalar;
use crate::io::vtu::cells::{needs_new_version, order, vtk_type};
use crate::io::vtu::layout::{Array, Topology, lay_out};
use crate::io::vtu::write::{check_arrays, refuse};
use crate::mesh::{CellKind, Mesh};

pub(super) fn write(job: Job<'_>) -> Result<Vec<String>> {
    let (path, mesh, whole, options) = (job.path, job.mesh, job.whole, job.options);
    let refuse = |what| refuse(path, what);
    let layout = lay_out(mesh, &[], whole, Topology::Cells).map_err(refuse)?;
    let is_new = mesh
        .blocks
        .iter()
        .any(|block| needs_new_version(block.kind));
    // Those of one kind of cells have one length, and are made where they are written.
    let of_kinds = options.binary && !is_new && mesh.polyhedra.is_empty();
    let (lists, nodes) = match of_kinds {
        true => (
            Lists::default(),
            mesh.blocks.iter().map(|block| block.nodes.len()).sum(),
        ),
        false => {
            let lists = lists(mesh);
            let nodes = lists.nodes.len();
            (lists, nodes)
        }
    };
    let size = nodes + mesh.cell_count();
    check_arrays(&layout).map_err(refuse)?;
    if i32::try_from(size).is_err() {
        return Err(refuse("cells of more than 2^31 nodes do not fit".into()));
    }
    let mut file = File {
        out: Out::to(path)?,
        binary: options.binary,
    };
    file.out.text(match is_new {
        true => "# vtk DataFile Version 5.1\n",
        false => "# vtk DataFile Version 4.2\n",
    });
    file.out.text("faceoff\n").text(if options.binary {
        "BINARY\n"
    } else {
        "ASCII\n"
    });
    file.out.text("DATASET UNSTRUCTURED_GRID\n");
    file.line(&format!("POINTS {} double", mesh.points.len()));
    file.numbers(mesh.points.as_flattened(), 3);
    if is_new {
        let ends = std::iter::once(0).chain(lists.ends.iter().copied());
        file.line(&format!("CELLS {} {nodes}", lists.ends.len() + 1,));
        file.line("OFFSETS vtktypeint64");
        file.numbers(&ends.map(|end| end as i64).collect::<Vec<_>>(), 1);
        file.line("CONNECTIVITY vtktypeint64");
        file.numbers(
            &lists
                .nodes
                .iter()
                .map(|&node| i64::from(node))
                .collect::<Vec<_>>(),
            8,
        );
    } else {
        file.line(&format!("CELLS {} {size}", mesh.cell_count()));
        match of_kinds {
            true => file.cells(mesh),
            false => file.lists(&lists),
        }
    }
    file.line(&format!("CELL_TYPES {}", mesh.cell_count()));
    let types = mesh.blocks.iter().flat_map(|block| {
        std::iter::repeat_n(i32::from(vtk_type(block.kind).unwrap_or(0)), block.len())
    });
    file.numbers(&types.collect::<Vec<_>>(), 1);
    // VTK writes these before the points, where Gmsh and vtkio do not expect them.
    file.fields(&layout.whole);
    for (data, arrays, count) in [
        ("POINT_DATA", &layout.points, mesh.points.len()),
        ("CELL_DATA", &layout.cells, mesh.cell_count()),
    ] {
        if !arrays.is_empty() {
            file.line(&format!("{data} {count}"));
            file.fields(arrays);
        }
    }
    file.out.save(path)?;
    Ok(Vec::new())
}

/// The list of each cell, in VTK's order of nodes: its nodes, or the faces of a polyhedron.
#[derive(Default)]
struct Lists {
    nodes: Vec<u32>,
    ends: Vec<usize>,
}

fn lists(mesh: &Mesh) -> Lists {
    let nodes = mesh.blocks.iter().map(|block| block.nodes.len()).sum();
    let mut lists = Lists {
        nodes: Vec::with_capacity(nodes),
        ends: Vec::with_capacity(mesh.cell_count()),
    };
    let mut polyhedra = mesh.polyhedra.iter();
    for block in &mesh.blocks {
        let order = order(block.kind);
        for cell in block.cells() {
            match (&order, block.kind) {
                (_, CellKind::Polyhedron(_)) => {
                    let faces = polyhedra.next().into_iter();
                    for faces in faces {
                        lists.nodes.push(faces.clone().count() as u32);
                        lists.nodes.extend(faces.stream());
                    }
                }
                (None, _) => lists.nodes.extend_from_slice(cell),
                (Some(order), _) => lists.nodes.extend(order.iter().map(|&place| cell[place])),
            }
            lists.ends.push(lists.nodes.len());
        }
    }
    lists
}

struct File {
    out: Out,
    binary: bool,
}

impl File {
    fn line(&mut self, text: &str) {
        self.out.text(text).text("\n");
    }

    fn fields(&mut self, arrays: &[Array]) {
        if arrays.is_empty() {
            return;
        }
        self.line(&format!("FIELD FieldData {}", arrays.len()));
        for array in arrays {
            let values = array.values.values();
            let (width, tuples) = (array.components, values.len() / array.components);
            let number = array.values.number();
            let name = TYPES.iter().find(|(known, _)| *known == number);
            self.line(&format!(
                "{} {width} {tuples} {}",
                encode(&array.name),
                name.map_or("", |(_, names)| names[0])
            ));
            with_numbers!(values.as_ref(), numbers => self.numbers(numbers, width));
        }
    }

    /// Numbers, `width` on a line of text.
    fn numbers<T: Scalar>(&mut self, numbers: &[T], width: usize) {
        if self.binary {
            self.out.rows(numbers.len(), T::WIDTH, |first, bytes| {
                T::put_le(&numbers[first..], bytes);
                bytes.chunks_exact_mut(T::WIDTH).for_each(<[u8]>::reverse);
            });
            self.out.text("\n");
            return;
        }
        for row in numbers.chunks(width.max(1)) {
            for number in row {
                number.print(&mut self.out.bytes);
                self.out.bytes.push(b' ');
            }
            self.out.end();
        }
    }

    /// The nodes of each cell after their number, in binary.
    fn cells(&mut self, mesh: &Mesh) {
        for block in &mesh.blocks {
            let (width, order) = (block.kind.points(), order(block.kind));
            let order = order.unwrap_or_else(|| (0..width).collect());
            self.out.rows(block.len(), 4 * (width + 1), |first, bytes| {
                let cells = block.nodes[first * width..].chunks_exact(width);
                for (row, nodes) in bytes.chunks_exact_mut(4 * (width + 1)).zip(cells) {
                    let numbers = order.iter().map(|&place| nodes[place]);
                    let numbers = std::iter::once(width as u32).chain(numbers);
                    let words = row.as_chunks_mut().0.iter_mut().zip(numbers);
                    words.for_each(|(to, number)| *to = number.to_be_bytes());
                }
            });
        }
        self.out.text("\n");
    }

    /// Each list after its length.
    fn lists(&mut self, lists: &Lists) {
        let mut start = 0;
        for &end in &lists.ends {
            let list = &lists.nodes[start..end];
            start = end;
            let numbers = std::iter::once(list.len() as u32).chain(list.iter().copied());
            if self.binary {
                numbers.for_each(|number| self.out.bytes.extend(number.to_be_bytes()));
                self.out.pass_on();
            } else {
                numbers.for_each(|number| {
                    self.out.int(number);
                });
                self.out.end();
            }
        }
        if self.binary {
            self.out.text("\n");
        }
    }
}

/// A name as one word: all but plain characters as % and two digits, as VTK does it.
fn encode(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_graphic() && !matches!(byte, b'%' | b'"');
    let byte = |byte: u8| match plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    match name {
        "" => "%20".into(),
        _ => name.bytes().map(byte).collect(),
    }
}
