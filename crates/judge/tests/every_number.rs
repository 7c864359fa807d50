//! One number of a file is changed, any number of any array: then it never agrees with the file as it was. It disagrees, is
//! undetermined, or cannot be read or matched. Of the formats that hold no fields, another mesh must be read, or none.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use faceoff_judge::{Settings, Tolerance, Tolerances, compare_results};
use faceoff_mesh::field::{GlobalArray, Results};
use faceoff_mesh::io::{self, Content, Format, Options, msh, vtu};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{Field, Mesh, Support, Values};

/// Small, with fields of every kind.
fn mesh(times: &[f64]) -> Mesh {
    let mut mesh = union_jack(2, [1.0, 2.0]);
    let (points, cells) = (mesh.points.len(), mesh.cell_count());
    let corners: usize = mesh
        .blocks
        .iter()
        .map(|block| block.len() * block.kind.points())
        .sum();
    // No value is repeated, and none is small beside the others.
    let values = |count: usize, seed: f64| -> Vec<f64> {
        (0..count)
            .map(|k| 1.5 + seed + (k as f64 * 0.7 + seed).sin())
            .collect()
    };
    let mut add = |name: &str, on, components, values: Values, time: Option<f64>| {
        let mut field = Field::new(name, on, components, values);
        field.time = time;
        field.step = time.map(|time| time as i32 + 1);
        mesh.fields.push(field);
    };
    let none = [None];
    let some: Vec<Option<f64>> = times.iter().copied().map(Some).collect();
    for &time in if times.is_empty() { &none[..] } else { &some } {
        let at = time.unwrap_or(0.0);
        let f64s = |n, seed| Values::F64(values(n, seed + at).into());
        add("u", Support::Points, 1, f64s(points, 0.1), time);
        add("w", Support::Points, 3, f64s(3 * points, 0.2), time);
        add("e", Support::Cells, 1, f64s(cells, 0.3), time);
        add("s", Support::Cells, 3, f64s(3 * cells, 0.4), time);
        add("c", Support::CellPoints, 1, f64s(corners, 0.5), time);
        if time.is_none() {
            let numbers: Vec<i32> = (0..cells as i32).map(|k| k * k + 3).collect();
            add("k", Support::Cells, 1, Values::I32(numbers.into()), time);
            let single = values(points, 0.6).iter().map(|&v| v as f32).collect();
            add("f", Support::Points, 1, Values::F32(single), time);
        }
    }
    mesh
}

fn write(path: &Path, mesh: &Mesh, change: impl FnOnce(&mut Options)) {
    let mut options = Options {
        lossy: true,
        ..Options::default()
    };
    change(&mut options);
    let whole = [GlobalArray::numbers(
        "energy",
        Values::F64(vec![2.5, 3.5].into()),
    )];
    io::write_with(path, mesh, &whole, &options).unwrap_or_else(|e| panic!("{e}"));
}

/// What of a changed file must not be as before.
enum Known {
    Fields(Vec<Results>),
    Mesh(Box<Content>),
}

fn read(path: &Path, of_mesh: bool) -> Result<Known, String> {
    if of_mesh {
        let mut content = io::open(path, None).map_err(|e| e.to_string())?;
        content.warnings.clear();
        return Ok(Known::Mesh(Box::new(content)));
    }
    let mut series = io::Series::open(path).map_err(|e| e.to_string())?;
    let times = series.times.clone();
    let all = (0..times.len()).map(|k| {
        let mut results = series.read(k, None)?;
        // Times are paired by who compares series.
        results.source = format!("{:?}", times[k]);
        Ok(results)
    });
    let all: faceoff_mesh::Result<Vec<Results>> = all.collect();
    all.map(Known::Fields).map_err(|e| e.to_string())
}

fn agrees(before: &Known, after: &Known) -> bool {
    let exact = Tolerance {
        rtol: 0.0,
        atol: 0.0,
    };
    let settings = Settings::from(Tolerances {
        of_all: exact,
        of_field: Vec::new(),
        is_given: true,
    });
    match (before, after) {
        (Known::Mesh(a), Known::Mesh(b)) => a == b,
        (Known::Fields(a), Known::Fields(b)) => {
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| {
                    // Of cells and groups that only one has there is a note.
                    let found = [a, b].map(|side| compare_results(a, side, &settings));
                    let [Ok(same), Ok(found)] = found else {
                        return false;
                    };
                    a.source == b.source && found.verdict.passes() && same.notes == found.notes
                })
        }
        _ => false,
    }
}

/// Changes every number of a file, one by one: `sites` are the places of bytes and what they become. Prints how many there
/// were, and fails with those that agree.
fn change_all(title: &str, path: &Path, changed: &Path, sites: &[Site], of_mesh: bool) {
    let before = read(path, of_mesh).unwrap_or_else(|e| panic!("{title}: {e}"));
    let again = read(path, of_mesh).unwrap_or_else(|e| panic!("{title}: {e}"));
    assert!(agrees(&before, &again), "{title}: not as it is itself");
    let sound = std::fs::read(changed).expect("the file to change");
    let mut missed: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut refused = 0;
    for site in sites {
        let mut bytes = sound.clone();
        bytes.splice(site.at..site.at + site.length, site.new.iter().copied());
        std::fs::write(changed, &bytes).expect("written");
        match read(path, of_mesh) {
            Err(_) => refused += 1,
            Ok(after) if agrees(&before, &after) => {
                let old = &sound[site.at..site.at + site.length];
                let [old, new] = [old, &site.new].map(String::from_utf8_lossy);
                let what = format!("byte {}: {old:?} -> {new:?}", site.at);
                missed.entry(&site.array).or_default().push(what);
            }
            Ok(_) => {}
        }
    }
    std::fs::write(changed, sound).expect("written");
    println!("{title}: {} mutants, {refused} refused", sites.len());
    assert!(sites.len() > 20, "{title}: only {} numbers", sites.len());
    let shown = missed
        .iter()
        .map(|(array, all)| format!("{array}: {} such, {}", all.len(), all[0]));
    let shown: Vec<String> = shown.collect();
    assert!(
        shown.is_empty(),
        "{title} agrees all the same:\n{}",
        shown.join("\n")
    );
}

/// A number of a file.
struct Site {
    array: String,
    at: usize,
    length: usize,
    new: Vec<u8>,
}

/// The numbers of a text. `skip` says what is no data, by the last line with letters, the line and the place in it.
fn numbers(bytes: &[u8], skip: impl Fn(&str, &str, usize) -> bool) -> Vec<Site> {
    let (mut sites, mut at, mut section) = (Vec::new(), 0, String::new());
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let text = String::from_utf8_lossy(line).into_owned();
        let is_name = |letter: char| letter.is_ascii_alphabetic() && !"eE".contains(letter);
        if text.contains(is_name) {
            section = text.trim().chars().take(70).collect();
        }
        let mut word = 0;
        let mut k = 0;
        while k < line.len() {
            let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"+-._$\"'".contains(&byte);
            if !is_part(line[k]) {
                k += 1;
                continue;
            }
            let length = line[k..].iter().take_while(|byte| is_part(**byte)).count();
            let token = &line[k..k + length];
            let is_number = std::str::from_utf8(token).ok().is_some_and(|token| {
                let token = token.replace('D', "E");
                token.parse::<f64>().is_ok_and(f64::is_finite)
            });
            if is_number && !skip(&section, text.trim(), word) {
                // Its first digit, so that it is another number by far.
                if let Some(digit) = token.iter().position(u8::is_ascii_digit) {
                    sites.push(Site {
                        array: section.clone(),
                        at: at + k + digit,
                        length: 1,
                        new: vec![(token[digit] - b'0' + 1) % 10 + b'0'],
                    });
                }
            }
            word += 1;
            k += length;
        }
        at += line.len();
    }
    sites
}

/// Of many numbers so many, spread evenly.
fn some(sites: Vec<Site>, most: usize) -> Vec<Site> {
    let step = sites.len().div_ceil(most).max(1);
    sites.into_iter().step_by(step).collect()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn text(
    title: &str,
    name: &str,
    times: &[f64],
    of_mesh: bool,
    skip: impl Fn(&str, &str, usize) -> bool,
) {
    text_with(title, name, times, of_mesh, |_| {}, skip);
}

fn text_with(
    title: &str,
    name: &str,
    times: &[f64],
    of_mesh: bool,
    change: impl FnOnce(&mut Options),
    skip: impl Fn(&str, &str, usize) -> bool,
) {
    let folder = folder();
    let path = folder.path().join(name);
    write(&path, &mesh(times), change);
    let bytes = std::fs::read(&path).expect("the file");
    let sites = some(numbers(&bytes, skip), 400);
    change_all(title, &path, &path, &sites, of_mesh);
}

#[test]
fn msh_2_2() {
    for (title, times) in [("MSH 2.2", &[][..]), ("MSH 2.2 with times", &[0.5, 1.5])] {
        let old = |options: &mut Options| options.msh_version = msh::Version::V22;
        text_with(title, "a.msh", times, false, old, is_gmsh);
    }
}

/// The line of the format, whose last number is the size of numbers in binary; the entities of Gmsh's geometry and which of them
/// an element is on; counts and the number of a time step before values, which have a line of two words or more each.
fn is_gmsh(section: &str, line: &str, word: usize) -> bool {
    let is_head = line.starts_with("2.2 ") || line.starts_with("4.1 ");
    let is_entity = section == "$Elements" && word == 4
        || section == "$Elements" && word == 1 && line.split(' ').count() == 4
        || section == "$Entities"
        || ["1 9 1 9", "5 16 1 16", "2 5 0 9"].contains(&line);
    let is_step = section != "$Elements" && ["0", "1", "2"].contains(&line);
    is_head || is_entity || is_step
}

#[test]
fn msh_4_1() {
    let new = |options: &mut Options| options.msh_version = msh::Version::V41;
    text_with("MSH 4.1", "a.msh", &[], false, new, is_gmsh);
}

/// Types of cells, of which two may mean the same: a line is a poly-line of two points. And what our own writer keeps of fields
/// without time.
fn is_own(name: &str) -> bool {
    let names = ["types", "CELL_TYPES", "faceoff:field"];
    names.iter().any(|own| name.contains(own))
}

#[test]
fn vtu_text() {
    let ascii = |options: &mut Options| options.vtu = vtu::Encoding::Ascii;
    let skip = |section: &str, line: &str, _| {
        line.starts_with("<?xml") || line.starts_with("<VTKFile") || is_own(section)
    };
    text_with("VTU", "a.vtu", &[], false, ascii, skip);
}

#[test]
fn vtk_text() {
    text("legacy VTK", "a.vtk", &[], false, |section, line, _| {
        line.starts_with("# vtk") || is_own(section)
    });
}

#[test]
fn unv() {
    // Colours, coordinate systems and other marks are whole numbers; records about an analysis that is none are zeros.
    let is_zero = |word: &str| word.starts_with("0.000") && word.ends_with("D0");
    let skip = |_: &str, line: &str, _| !line.contains('.') || line.split_whitespace().all(is_zero);
    text("UNV", "a.unv", &[], false, skip);
}

#[test]
fn meshes_without_fields() {
    for (title, name) in [("Medit", "a.mesh"), ("Abaqus", "a.inp"), ("SU2", "a.su2")] {
        text(title, name, &[], true, |_, line, _| {
            line.starts_with("NMARK")
        });
    }
    let freefem = |options: &mut Options| options.format = Format::of_name("freefem");
    text_with("FreeFEM", "a.msh", &[], true, freefem, |_, _, _| false);
}

/// A number in binary and what it becomes: of a float one far from it, of anything else the next.
fn binary(array: &str, at: usize, old: &[u8], is_float: bool, big_endian: bool) -> Site {
    let mut new = old.to_vec();
    if big_endian {
        new.reverse();
    }
    match (is_float, new.len()) {
        (true, 4) => {
            let value = f32::from_le_bytes(new[..].try_into().expect("4 bytes"));
            new = (2.0 * value + 1.0).to_le_bytes().to_vec();
        }
        (true, _) => {
            let value = f64::from_le_bytes(new[..].try_into().expect("8 bytes"));
            new = (2.0 * value + 1.0).to_le_bytes().to_vec();
        }
        (false, _) => new[0] ^= 1,
    }
    if big_endian {
        new.reverse();
    }
    Site {
        array: array.to_owned(),
        at,
        length: old.len(),
        new,
    }
}

/// All numbers of arrays: of each a name, where it is, the bytes of a number, and whether it has floats.
fn of_arrays(
    bytes: &[u8],
    arrays: Vec<(String, usize, usize, usize, bool)>,
    big: bool,
) -> Vec<Site> {
    let mut sites = Vec::new();
    for (name, at, length, width, is_float) in arrays {
        let of_one = (0..length / width).map(|k| {
            let at = at + k * width;
            binary(&name, at, &bytes[at..at + width], is_float, big)
        });
        sites.extend(some(of_one.collect(), 24));
    }
    sites
}

fn number(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .rev()
        .fold(0, |all, &byte| all << 8 | usize::from(byte))
}

/// The data sets of an HDF5 file of ours: headers of version 2, contiguous data. `skip` is asked with the path and
/// the bytes of a number.
fn hdf5_sites(bytes: &[u8], skip: impl Fn(&str, usize) -> bool) -> Vec<Site> {
    // Of each object the name and where the group is that links to it.
    let (mut names, mut sets) = (BTreeMap::new(), Vec::new());
    for start in memchr_all(bytes, b"OHDR") {
        let (mut at, end) = (
            start + 10,
            start + 10 + number(&bytes[start + 6..start + 10]),
        );
        let (mut kind, mut layout) = (None, None);
        while at + 4 <= end {
            let length = number(&bytes[at + 1..at + 3]);
            let message = &bytes[at + 4..at + 4 + length];
            match bytes[at] {
                3 => kind = Some((message[0] & 15, number(&message[4..8]))),
                6 => {
                    let (head, address) = message.split_at(length - 8);
                    let is_letter = |byte: &u8| byte.is_ascii_graphic() || *byte == b' ';
                    let name: Vec<u8> = head.iter().rev().copied().take_while(is_letter).collect();
                    let name = name.into_iter().rev().map(char::from).collect::<String>();
                    names.insert(number(address), (name, start));
                }
                8 if message[1] == 1 => {
                    layout = Some((number(&message[2..10]), number(&message[10..18])))
                }
                _ => {}
            }
            at += 4 + length;
        }
        if let (Some((class, width)), Some((place, length))) = (kind, layout) {
            // A text, or a table of bytes, is changed in its first byte.
            let width = if class > 1 { 1 } else { width };
            if place < bytes.len() {
                sets.push((start, place, length, width, class == 1));
            }
        }
    }
    let named = sets
        .into_iter()
        .map(|(start, place, length, width, is_float)| {
            let (mut path, mut at) = (String::new(), start);
            while let Some((name, above)) = names.get(&at) {
                path = format!("/{name}{path}");
                at = *above;
            }
            (path, place, length, width, is_float)
        });
    of_arrays(
        bytes,
        named
            .filter(|(name, _, _, width, _)| !skip(name, *width))
            .collect(),
        false,
    )
}

fn memchr_all(bytes: &[u8], word: &[u8]) -> Vec<usize> {
    (0..bytes.len())
        .filter(|&k| bytes[k..].starts_with(word))
        .collect()
}

fn hdf5(title: &str, name: &str, in_file: &str, times: &[f64], skip: impl Fn(&str, usize) -> bool) {
    let folder = folder();
    let path = folder.path().join(name);
    let mut mesh = mesh(times);
    if name.ends_with("vtkhdf") && !times.is_empty() {
        // Values at the corners of cells are read at all times at once, so that no one of them can be judged.
        mesh.fields.retain(|field| field.on != Support::CellPoints);
    }
    write(&path, &mesh, |_| {});
    let changed: PathBuf = folder.path().join(in_file);
    let bytes = std::fs::read(&changed).expect("the file");
    change_all(title, &path, &changed, &hdf5_sites(&bytes, skip), false);
}

/// Each format with and without times.
const TIMES: [(&str, &[f64]); 2] = [("", &[]), (" with times", &[0.5, 1.5])];

#[test]
fn med() {
    for (more, times) in TIMES {
        let names = |path: &str, _| path.ends_with("/NOM");
        hdf5(&format!("MED{more}"), "a.med", "a.med", times, names);
    }
}

#[test]
fn vtkhdf() {
    for (more, times) in TIMES {
        // Characters of texts are bytes; how many values there are at a step, the arrays say as well.
        let texts = |path: &str, _| {
            path.ends_with("faceoff:texts")
                || path.contains("faceoff:field")
                || path.contains("FieldDataSizes")
        };
        hdf5(
            &format!("VTKHDF{more}"),
            "a.vtkhdf",
            "a.vtkhdf",
            times,
            texts,
        );
    }
}

#[test]
fn cgns() {
    for (more, times) in TIMES {
        // Texts; and how many cells there are, which the arrays say as well.
        let texts = |path: &str, width| {
            let counts = [
                "/Base/ data",
                "/Base/Zone/ data",
                "/Base/BaseIterativeData/ data",
            ];
            let counts = counts.contains(&path);
            let of_section = path.ends_with("_line/ data") || path.ends_with("_triangle/ data");
            width == 1 || counts || of_section || path.contains("CGNSLibraryVersion")
        };
        hdf5(&format!("CGNS{more}"), "a.cgns", "a.cgns", times, texts);
    }
}

#[test]
fn xdmf() {
    for (more, times) in TIMES {
        let title = format!("XDMF{more}, its HDF5 file");
        hdf5(&title, "a.xdmf", "a.h5", times, |_, _| false);
    }
}

/// The variables of a netCDF file of the 64-bit offset format.
fn netcdf_sites(bytes: &[u8], skip: impl Fn(&str) -> bool) -> Vec<Site> {
    let at = std::cell::Cell::new(4);
    let take = |count: usize| {
        let start = at.get();
        at.set(start + count.next_multiple_of(4));
        bytes[start..start + count].to_vec()
    };
    let whole = || {
        take(4)
            .iter()
            .fold(0_usize, |all, &byte| all << 8 | usize::from(byte))
    };
    let size = |kind: usize| [0, 1, 1, 2, 4, 4, 8][kind];
    let attributes = || {
        whole();
        for _ in 0..whole() {
            take(whole());
            let kind = whole();
            take(whole() * size(kind));
        }
    };
    let records = whole();
    whole();
    let dimensions: Vec<usize> = (0..whole())
        .map(|_| {
            take(whole());
            whole()
        })
        .collect();
    attributes();
    whole();
    let mut found = Vec::new();
    for _ in 0..whole() {
        let name = String::from_utf8(take(whole())).expect("a name");
        let of: Vec<usize> = (0..whole()).map(|_| whole()).collect();
        attributes();
        let (kind, length) = (whole(), whole());
        whole();
        let begin = whole();
        let is_record = of.first().is_some_and(|&first| dimensions[first] == 0);
        let count: usize = of.iter().map(|&k| dimensions[k].max(1)).product();
        found.push((
            name,
            begin,
            count * size(kind),
            size(kind),
            kind > 4,
            is_record,
            length,
        ));
    }
    let step: usize = found.iter().filter(|v| v.5).map(|v| v.6).sum();
    let arrays =
        found
            .into_iter()
            .flat_map(|(name, begin, length, width, is_float, is_record, _)| {
                let rows = if is_record { records } else { 1 };
                (0..rows)
                    .map(move |row| (name.clone(), begin + row * step, length, width, is_float))
                    .collect::<Vec<_>>()
            });
    of_arrays(
        bytes,
        arrays.filter(|(name, ..)| !skip(name)).collect(),
        true,
    )
}

/// Names, marks, the table of which variables are there, which their presence says as well, and the numbers of blocks, of which
/// one that comes twice is numbered anew.
fn is_mark(name: &str) -> bool {
    let words = ["name", "status", "_var_tab", "eb_prop1"];
    words.iter().any(|word| name.contains(word))
}

#[test]
fn exodus() {
    for (title, times) in [("Exodus", &[][..]), ("Exodus with times", &[0.5, 1.5])] {
        let folder = folder();
        let path = folder.path().join("a.exo");
        write(&path, &mesh(times), |_| {});
        let bytes = std::fs::read(&path).expect("the file");
        change_all(title, &path, &path, &netcdf_sites(&bytes, is_mark), false);
    }
}

/// The arrays of a VTU file with raw data: each has its type and offset in a tag, and its length before it.
#[test]
fn vtu_binary() {
    let folder = folder();
    let path = folder.path().join("a.vtu");
    let raw = vtu::Encoding::Raw(vtu::Compressor::None);
    write(&path, &mesh(&[]), |options| options.vtu = raw);
    let bytes = std::fs::read(&path).expect("the file");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let start = memchr_all(&bytes, b"<AppendedData")[0];
    let start = start
        + bytes[start..]
            .iter()
            .position(|byte| *byte == b'_')
            .expect("data")
        + 1;
    let mut arrays = Vec::new();
    for tag in text.split("<DataArray").skip(1) {
        let word = |name: &str| {
            let rest = tag.split_once(&format!(" {name}=\"")).map(|(_, rest)| rest);
            rest.and_then(|rest| rest.split_once('"'))
                .map(|(word, _)| word.to_owned())
        };
        let (Some(kind), Some(offset)) = (word("type"), word("offset")) else {
            continue;
        };
        let at = start + offset.parse::<usize>().expect("an offset");
        let length = number(&bytes[at..at + 8]);
        let width = kind
            .chars()
            .filter(char::is_ascii_digit)
            .collect::<String>();
        let width = width.parse::<usize>().map_or(1, |bits| bits / 8);
        let name = word("Name").unwrap_or_default();
        if is_own(&name) {
            continue;
        }
        arrays.push((name, at + 8, length, width, kind.starts_with("Float")));
    }
    change_all(
        "VTU, raw",
        &path,
        &path,
        &of_arrays(&bytes, arrays, false),
        false,
    );
}
