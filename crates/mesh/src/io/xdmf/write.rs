//! Writes XDMF: the description as XML, and the numbers in an HDF5 file of the same name in the same folder.

use quick_xml::escape::escape;

use super::{FORMAT, GROUP, topology};
use crate::error::{Error, Result};
use crate::field::GlobalValues;
use crate::io::hdf5::write::{Data, Group as Folder, Type};
use crate::io::loss::Losses;
use crate::io::raw::CellNodes;
use crate::io::scalar::Number;
use crate::io::steps::{Stepped, Steps};
use crate::io::vtu::cells::order;
use crate::io::{Job, out};
use crate::mesh::{CellBlock, CellGroups, CellKind, Group, Mesh, Support, Values};

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        whole,
        mut losses,
        ..
    } = job;
    let stem = path
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned());
    let stem = stem.filter(|_| !out::is_special(path));
    let stem = stem.ok_or_else(|| {
        Error::usage(
            "XDMF is two files in the same folder",
            "give the name of a file",
        )
    })?;
    losses.lose_blocks(mesh, |kind| topology::name(kind).is_some());
    let blocks: Vec<&CellBlock> = mesh
        .blocks
        .iter()
        .filter(|block| topology::name(block.kind).is_some())
        .collect();
    if blocks.iter().all(|block| block.is_empty()) && mesh.cell_count() > 0 {
        let what = format!("{} has none of its kinds of cells", FORMAT.title);
        return Err(Error::whole(path, what, "choose another format, as VTU"));
    }
    let whole_mesh = blocks.len() == mesh.blocks.len();
    let steps = Steps::of(&mesh.fields, &mut losses);
    for field in &steps.fields {
        let is_group = field.name == GROUP && !mesh.groups.is_empty();
        if field.on == Support::CellPoints
            || (field.on == Support::Cells && (!whole_mesh || is_group))
        {
            losses.lose_field(field.name, field.on);
        } else if field.on == Support::Cells && field.at().is_some() {
            losses.note_gaps(field.name, field.on);
        }
    }
    if !whole_mesh {
        losses.lose_some(mesh.groups.len(), "groups together with such cells");
    }
    losses.note_gmsh(mesh);
    let mut file = Folder::default();
    let name = format!("{stem}.h5");
    let item = |place: &str, kind: Type, shape: &[usize]| data_item(&name, place, kind, shape);

    // The mesh, which each time refers to.
    // dolfinx takes a mesh of two coordinates for planar.
    let flat = mesh.is_flat();
    let (space, axes) = if flat { (2, "XY") } else { (3, "XYZ") };
    let shape = [mesh.points.len(), space];
    let coordinates = Data::table(shape.to_vec(), shape, false, |k, axis| mesh.points[k][axis]);
    file.group("Mesh").add("geometry", coordinates);
    let mut base = format!(
        "<Geometry GeometryType=\"{axes}\">{}</Geometry>",
        item("/Mesh/geometry", Number::F64.into(), &shape)
    );
    if !blocks.is_empty() {
        let count: usize = blocks.iter().map(|block| block.len()).sum();
        let (words, width, (data, shape)) = topology_data(&blocks);
        let kind = data.kind();
        file.group("Mesh").add("topology", data);
        let per = if width > 0 {
            format!(" NodesPerElement=\"{width}\"")
        } else {
            String::new()
        };
        base += &format!(
            "<Topology TopologyType=\"{words}\" NumberOfElements=\"{count}\"{per}>{}</Topology>",
            item("/Mesh/topology", kind, &shape)
        );
    }
    if whole_mesh && !mesh.groups.is_empty() {
        let (names, width, tags) = groups(mesh, &mut losses);
        let shape = rows_of(mesh.cell_count(), width);
        let kind = tags.kind();
        file.group("Mesh").add("groups", tags.of_shape(&shape));
        let tags = item("/Mesh/groups", kind, &shape);
        base += &names;
        base += &attribute(GROUP, "Cell", width, &tags);
    }
    let mut about = String::new();
    for (k, data) in whole.iter().enumerate() {
        let GlobalValues::Numbers(values) = &data.values else {
            losses.lose(format!(
                "the text {:?} about the mesh as a whole",
                data.name
            ));
            continue;
        };
        let shape = [data.tuples(), data.components];
        file.group("Whole")
            .add(&k.to_string(), Data::numbers(values, data.components));
        about += &attribute(
            &data.name,
            "Grid",
            data.components,
            &item(&format!("/Whole/{k}"), Number::of(values).into(), &shape),
        );
    }
    let mut grids = Vec::new();
    for step in 0..steps.times.len().max(1) {
        let mut grid = base.clone();
        if let Some(time) = steps.times.get(step) {
            grid += &format!("<Time Value=\"{time:?}\"/>");
        }
        grid += &about;
        for (k, field) in steps.fields.iter().enumerate() {
            let (centre, rows) = match field.on {
                Support::Points => ("Node", mesh.points.len()),
                Support::Cells if whole_mesh && (field.name != GROUP || mesh.groups.is_empty()) => {
                    ("Cell", mesh.cell_count())
                }
                _ => continue,
            };
            // A field without time is the same at all of them.
            let at = if field.at_all_times() { 0 } else { step };
            let kind = kind_of(field, step);
            let shape = rows_of(rows, field.components);
            if at == step {
                file.group("Fields")
                    .group(&k.to_string())
                    .add(&at.to_string(), values(field, step, rows).of_shape(&shape));
            }
            grid += &attribute(
                field.name,
                centre,
                field.components,
                &item(&format!("/Fields/{k}/{at}"), kind.into(), &shape),
            );
        }
        grids.push(format!(
            "<Grid Name=\"mesh\" GridType=\"Uniform\">{grid}</Grid>\n"
        ));
    }
    let grids = grids.concat();
    let body = match steps.times.is_empty() {
        true => grids,
        false => format!(
            "<Grid Name=\"times\" GridType=\"Collection\" CollectionType=\"Temporal\">\n{grids}</Grid>\n"
        ),
    };
    let xml = format!(
        "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\"><Domain>\n{body}</Domain></Xdmf>\n"
    );
    losses.settle(path, || {
        file.save(&path.with_file_name(&name))?;
        out::save(path, [xml.as_bytes()])
    })
}

/// The names of the groups as meshio has them, and for each cell the numbers of its groups, 0 for no further one.
fn groups<'a>(mesh: &'a Mesh, losses: &mut Losses) -> (String, usize, Data<'a>) {
    let mut next = mesh
        .groups
        .iter()
        .map(|group| group.tag)
        .max()
        .unwrap_or(0)
        .max(0);
    let mut number = |group: &Group| {
        if group.tag != 0 {
            return group.tag;
        }
        next += 1;
        losses.note(format!(
            "the group 0 of dimension {} is numbered {next}",
            group.dim
        ));
        next
    };
    let tags: Vec<i64> = mesh.groups.iter().map(&mut number).collect();
    let nothing = mesh
        .groups
        .iter()
        .filter(|group| group.cells.is_empty() && group.name.is_none());
    losses.lose_some(nothing.count(), "groups without cells that have no name");
    let named = mesh.groups.iter().zip(&tags).filter_map(|(group, tag)| {
        let name = escape(group.name.as_deref()?).into_owned();
        Some(format!(
            "<map key=\"{name}\" dim=\"{}\">{tag}</map>",
            group.dim
        ))
    });
    let named: Vec<String> = named.collect();
    let names = format!(
        "<Information Name=\"Information\" Value=\"{}\"><![CDATA[<main>{}</main>]]></Information>",
        named.len(),
        named.concat()
    );
    let sets = CellGroups::new(mesh);
    let width = sets.sets.iter().map(Vec::len).max().unwrap_or(0).max(1);
    let row = |set: &Vec<u32>| -> Vec<i64> {
        let mut row: Vec<i64> = set.iter().map(|&k| tags[k as usize]).collect();
        row.resize(width, 0);
        row
    };
    let rows: Vec<Vec<i64>> = sets.sets.iter().map(row).collect();
    let narrow = rows.iter().flatten().all(|&tag| i32::try_from(tag).is_ok());
    let kind = if narrow { Number::I32 } else { Number::I64 };
    let values = Data::runs(kind, vec![mesh.cell_count(), width], sets.runs, rows);
    (names, width, values)
}

fn data_item(file: &str, place: &str, kind: Type, shape: &[usize]) -> String {
    let (name, size) = match kind {
        Type::Number(number) if number.is_float() => ("Float", number.size()),
        Type::Number(number) if number.is_unsigned() => ("UInt", number.size()),
        Type::Number(number) => ("Int", number.size()),
        Type::Text(_) | Type::Bytes(_) => ("Char", 1),
    };
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    format!(
        "<DataItem Dimensions=\"{}\" NumberType=\"{name}\" Precision=\"{size}\" Format=\"HDF\">{}:{place}</DataItem>",
        shape.join(" "),
        escape(file)
    )
}

/// The shape of rows of `components` components: VTK takes the first two lengths of a matrix for those of one row, unless a third
/// follows.
fn rows_of(rows: usize, components: usize) -> Vec<usize> {
    match components {
        1 | 3 | 6 | 9 => vec![rows, components],
        _ => vec![rows, components, 1],
    }
}

fn attribute(name: &str, centre: &str, components: usize, item: &str) -> String {
    let kind = match components {
        1 => "Scalar",
        3 => "Vector",
        6 => "Tensor6",
        9 => "Tensor",
        _ => "Matrix",
    };
    format!(
        "<Attribute Name=\"{}\" AttributeType=\"{kind}\" Center=\"{centre}\">{item}</Attribute>",
        escape(name)
    )
}

/// The type of a field's values at a time.
fn kind_of(field: &Stepped<'_>, step: usize) -> Number {
    match field.at_step(step) {
        Some(whole) if whole.at.is_empty() => Number::of(&whole.values),
        _ => Number::F64,
    }
}

/// The values of a field at a time; NaN where there are none.
fn values<'a>(field: &'a Stepped<'a>, step: usize, rows: usize) -> Data<'a> {
    let width = field.components;
    match field.at_step(step) {
        Some(whole) if whole.at.is_empty() => Data::numbers(&whole.values, width),
        _ => Data::table(vec![rows, width], [rows, width], false, move |k, of| {
            field.value(step, k, of)
        }),
    }
}

/// The name of the topology, the nodes of a cell where all have as many, and the numbers with their shape.
fn topology_data<'a>(blocks: &[&'a CellBlock]) -> (&'static str, usize, (Data<'a>, Vec<usize>)) {
    let kind = blocks[0].kind;
    if blocks.iter().all(|block| block.kind == kind) {
        let width = kind.points();
        let places = order(kind).unwrap_or_else(|| (0..width).collect());
        let nodes = CellNodes::of_blocks(blocks, places, false);
        let shape = vec![nodes.len() / width, width];
        let data = Data::nodes(shape.clone(), nodes, 0);
        let name = topology::name(kind).map_or("", |(name, _)| name);
        return (name, width, (data, shape));
    }
    let mut numbers: Vec<i64> = Vec::new();
    for block in blocks {
        let number = topology::name(block.kind).map_or(0, |(_, number)| number);
        let order = order(block.kind);
        for cell in block.cells() {
            numbers.push(number);
            if matches!(block.kind, CellKind::Vertex | CellKind::Line) {
                numbers.push(cell.len() as i64);
            }
            numbers.extend(
                (0..cell.len())
                    .map(|k| i64::from(cell[order.as_ref().map_or(k, |order| order[k])])),
            );
        }
    }
    let shape = vec![numbers.len()];
    let values = Values::I64(numbers.into());
    let data = Data::made(Number::I64, shape.clone(), move |first, bytes| {
        let Values::I64(numbers) = &values else {
            return;
        };
        for (bytes, number) in bytes.chunks_exact_mut(8).zip(&numbers[first..]) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
    });
    ("Mixed", 0, (data, shape))
}
