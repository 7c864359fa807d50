//! Nastran's bulk data: cards of small, large and free fields, with continuations and included files. Properties are groups.
//! meshio writes it.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use nalgebra::Vector3;

use super::builder::{Builder, Lookup, Numbering};
use super::out::folder_of;
use super::scan::Scan;
use super::sides::{Between, place};
use super::{Content, Native, meshio};
use crate::error::{Error, Result};
use crate::file;
use crate::mesh::{CellKind, Mesh};

pub static FORMAT: Native = Native {
    title: "Nastran's bulk data",
    names: &["nastran"],
    suffixes: &["bdf", "nas", "fem"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read,
    write: |path, mesh, _, options| meshio::write(path, mesh, "nastran", options),
};

/// What the first line that is no comment begins with.
const BEGINNINGS: [&str; 22] = [
    "GRID", "BEGIN", "SOL ", "CEND", "NASTRAN ", "ID ", "ASSIGN", "INCLUDE", "CTETRA", "CHEXA",
    "CPENTA", "CQUAD", "CTRIA", "PSHELL", "PSOLID", "MAT1", "TITLE", "CORD2", "SUBCASE", "ECHO",
    "INIT ", "PARAM",
];

fn recognises(bytes: &[u8]) -> bool {
    let mut lines = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines
        .find(|line| !line.is_empty() && !line.starts_with(b"$"))
        .unwrap_or_default();
    let begins = |known: &str| {
        first
            .get(..known.len())
            .is_some_and(|word| word.eq_ignore_ascii_case(known.as_bytes()))
    };
    let cards = CARDS.iter().map(|(name, ..)| name);
    (BEGINNINGS.iter().chain(cards)).any(|known| begins(known))
        && memchr::memmem::find(&bytes.to_ascii_uppercase(), b"GRID").is_some()
}

/// Cards of elements: the kinds of first and of second order, and the field of the first node after the element's number.
const CARDS: [(&str, CellKind, Option<CellKind>, usize); 23] = [
    ("CBAR", CellKind::Line, None, 2),
    ("CBEAM", CellKind::Line, None, 2),
    ("CROD", CellKind::Line, None, 2),
    ("CTUBE", CellKind::Line, None, 2),
    ("CBUSH", CellKind::Line, None, 2),
    ("CGAP", CellKind::Line, None, 2),
    ("CONROD", CellKind::Line, None, 1),
    ("PLOTEL", CellKind::Line, None, 1),
    ("CONM2", CellKind::Vertex, None, 1),
    ("CTRIA3", CellKind::Triangle, None, 2),
    ("CTRIAR", CellKind::Triangle, None, 2),
    ("CTRAX3", CellKind::Triangle, None, 2),
    ("CTRIA6", CellKind::Triangle, Some(CellKind::Triangle6), 2),
    ("CQUAD4", CellKind::Quadrangle, None, 2),
    ("CQUADR", CellKind::Quadrangle, None, 2),
    ("CSHEAR", CellKind::Quadrangle, None, 2),
    (
        "CQUAD8",
        CellKind::Quadrangle,
        Some(CellKind::Quadrangle8),
        2,
    ),
    (
        "CQUAD",
        CellKind::Quadrangle,
        Some(CellKind::Quadrangle9),
        2,
    ),
    (
        "CTETRA",
        CellKind::Tetrahedron,
        Some(CellKind::Tetrahedron10),
        2,
    ),
    ("CPYRAM", CellKind::Pyramid, Some(CellKind::Pyramid13), 2),
    ("CPYRA", CellKind::Pyramid, Some(CellKind::Pyramid13), 2),
    ("CPENTA", CellKind::Prism, Some(CellKind::Prism15), 2),
    (
        "CHEXA",
        CellKind::Hexahedron,
        Some(CellKind::Hexahedron20),
        2,
    ),
];

/// Where the nodes behind the corners lie: around the bottom, up, around the top.
fn middles(kind: CellKind) -> &'static [Between] {
    match kind {
        CellKind::Triangle6 => &[[0, 1], [1, 2], [2, 0]],
        CellKind::Quadrangle8 => &[[0, 1], [1, 2], [2, 3], [3, 0]],
        CellKind::Quadrangle9 => &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
        CellKind::Tetrahedron10 => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
        CellKind::Pyramid13 => &[
            [0, 1],
            [1, 2],
            [2, 3],
            [3, 0],
            [0, 4],
            [1, 4],
            [2, 4],
            [3, 4],
        ],
        CellKind::Prism15 => &[
            [0, 1],
            [1, 2],
            [2, 0],
            [0, 3],
            [1, 4],
            [2, 5],
            [3, 4],
            [4, 5],
            [5, 3],
        ],
        CellKind::Hexahedron20 => &[
            [0, 1],
            [1, 2],
            [2, 3],
            [3, 0],
            [0, 4],
            [1, 5],
            [2, 6],
            [3, 7],
            [4, 5],
            [5, 6],
            [6, 7],
            [7, 4],
        ],
        _ => &[],
    }
}

/// A card: its name in capitals, its fields, and where it stands.
struct Card<'a> {
    name: String,
    fields: Vec<String>,
    row: Scan<'a>,
}

/// A local system: the origin, a point on the third axis, a point in the plane of the first and the third.
struct System {
    kind: u8,
    base: u64,
    points: [[f64; 3]; 3],
}

#[derive(Default)]
struct Reader {
    numbers: Vec<u64>,
    points: Vec<([f64; 3], u64)>,
    elements: Vec<Element>,
    systems: HashMap<u64, System>,
    /// Cards that are not read, with how many there are.
    others: BTreeMap<String, usize>,
    unread: Vec<String>,
    warnings: Vec<String>,
    partly: usize,
    files: usize,
    ended: bool,
}

struct Element {
    number: u64,
    property: i64,
    kind: CellKind,
    nodes: Vec<u64>,
}

fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut reader = Reader::default();
    // The sections before the bulk data have another syntax.
    let upper = bytes.to_ascii_uppercase();
    let mut skip = 0;
    for start in memchr::memmem::find_iter(&upper, b"BEGIN") {
        let before = upper
            .get(..start)
            .and_then(|before| before.rsplit(|&byte| byte == b'\n').next());
        let after = upper
            .get(start + 5..)
            .unwrap_or_default()
            .trim_ascii_start();
        if before.unwrap_or_default().trim_ascii().is_empty() && after.starts_with(b"BULK") {
            skip = start;
            reader
                .warnings
                .push("what stands before BEGIN BULK was skipped".into());
            break;
        }
    }
    let mut scan = Scan::new(path, bytes);
    scan.advance(skip);
    if skip > 0 {
        scan.line();
    }
    reader.file(scan, folder_of(path), 0)?;
    if reader.partly > 0 {
        reader.warnings.push(format!(
            "{} elements have some of their middle nodes: they are read without any",
            reader.partly
        ));
    }
    let others: Vec<String> = reader
        .others
        .iter()
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    if !others.is_empty() {
        reader
            .unread
            .push(format!("the cards {}", others.join(", ")));
    }
    Ok(Content {
        mesh: reader.build(&Scan::new(path, bytes))?,
        format: "nastran".into(),
        encoding: "ascii".into(),
        warnings: reader.warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

/// The fields of a line, the first being the name or the mark of a continuation, without the mark at its end.
fn fields(text: &str) -> (Vec<String>, bool) {
    let text = text.split('$').next().unwrap_or_default().trim_end();
    if text.contains(',') {
        let mut all: Vec<String> = text
            .split(',')
            .map(|field| field.trim().to_owned())
            .collect();
        let wide = all[0].contains('*');
        all.truncate(if wide { 5 } else { 9 });
        return (all, wide);
    }
    let text = text.replace('\t', "        ");
    let characters: Vec<char> = text.chars().collect();
    let part = |from: usize, width: usize| -> String {
        let part = characters.iter().skip(from).take(width);
        part.collect::<String>().trim().to_owned()
    };
    let first = part(0, 8);
    let wide = first.contains('*');
    let (width, count) = if wide { (16, 4) } else { (8, 8) };
    let mut all = vec![first];
    all.extend((0..count).map(|place| part(8 + place * width, width)));
    (all, wide)
}

impl Reader {
    fn file<'a>(&mut self, mut scan: Scan<'a>, folder: &Path, depth: usize) -> Result<()> {
        self.files += 1;
        let mut open: Option<Card<'a>> = None;
        while let Some(row) = scan.row() {
            let text = String::from_utf8_lossy(row.rest()).into_owned();
            let bare = text.trim();
            if bare.is_empty() || bare.starts_with('$') || self.ended {
                continue;
            }
            let word: String = bare
                .chars()
                .take(8)
                .collect::<String>()
                .to_ascii_uppercase();
            if word.starts_with("ENDDATA") {
                self.ended = true;
                continue;
            }
            if word.starts_with("INCLUDE") {
                self.finish(open.take())?;
                let name = bare
                    .get(7..)
                    .unwrap_or_default()
                    .trim()
                    .trim_matches(['\'', '"']);
                self.include(&row, folder, name, depth)?;
                continue;
            }
            let (mut all, wide) = fields(&text);
            let continues = text.starts_with(['+', '*', ' ', '\t', ','])
                && !all[0]
                    .trim_matches(['+', '*'])
                    .chars()
                    .next()
                    .is_some_and(|c| c.is_ascii_alphabetic() && !text.starts_with(['+', '*']));
            match &mut open {
                Some(card) if continues => {
                    all.remove(0);
                    all.resize(if wide { 4 } else { 8 }, String::new());
                    card.fields.append(&mut all);
                    if card.fields.len() > 4000 {
                        return Err(row.error("a card is longer than any"));
                    }
                }
                _ if continues => return Err(row.error("a continuation follows no card")),
                _ => {
                    self.finish(open.take())?;
                    let name = all
                        .remove(0)
                        .trim_end_matches('*')
                        .trim()
                        .to_ascii_uppercase();
                    all.resize(if wide { 4 } else { 8 }, String::new());
                    open = Some(Card {
                        name,
                        fields: all,
                        row,
                    });
                }
            }
        }
        self.finish(open)
    }

    fn include(&mut self, row: &Scan<'_>, folder: &Path, name: &str, depth: usize) -> Result<()> {
        let remedy = "put it into the folder of this file or below";
        let Some(path) = file::beneath(folder, name) else {
            return Err(row.error_with(
                format!("the included file {name:?} is outside of the folder"),
                remedy,
            ));
        };
        if depth > 16 || self.files > 1000 {
            return Err(row.error_with(
                "too many files are included",
                "check whether files include themselves",
            ));
        }
        if !path.exists() {
            self.unread
                .push(format!("the included file {name}, which is not there"));
            return Ok(());
        }
        let bytes = super::bytes::read(&path).map_err(Error::io(&path, "read"))?;
        self.file(Scan::new(&path, &bytes), folder, depth + 1)
    }

    /// Takes a card that is complete.
    fn finish(&mut self, card: Option<Card<'_>>) -> Result<()> {
        let Some(card) = card else { return Ok(()) };
        let known = CARDS.iter().find(|(name, ..)| *name == card.name);
        match (card.name.as_str(), known) {
            (_, Some(&(_, linear, quadratic, first))) => {
                self.element(&card, linear, quadratic, first)?
            }
            ("GRID", _) => {
                self.numbers.push(card.whole(0)?);
                self.points.push((
                    [card.real(2)?, card.real(3)?, card.real(4)?],
                    card.whole(1)?,
                ));
            }
            ("CORD2R" | "CORD2C" | "CORD2S", _) => {
                let at = |place: usize| -> Result<[f64; 3]> {
                    Ok([
                        card.real(place)?,
                        card.real(place + 1)?,
                        card.real(place + 2)?,
                    ])
                };
                let system = System {
                    kind: card.name.as_bytes()[5],
                    base: card.whole(1)?,
                    points: [at(2)?, at(5)?, at(8)?],
                };
                self.systems.insert(card.whole(0)?, system);
            }
            _ => *self.others.entry(card.name).or_insert(0) += 1,
        }
        Ok(())
    }

    fn element(
        &mut self,
        card: &Card<'_>,
        linear: CellKind,
        quadratic: Option<CellKind>,
        first: usize,
    ) -> Result<()> {
        let node = |place: usize| card.whole(first + place);
        let mut nodes: Vec<u64> = (0..linear.points()).map(node).collect::<Result<_>>()?;
        let mut kind = linear;
        if linear == CellKind::Line && nodes.contains(&0) {
            *self
                .others
                .entry(format!("{} to the ground", card.name))
                .or_insert(0) += 1;
            return Ok(());
        }
        if let Some(quadratic) = quadratic {
            let more = quadratic.points() - linear.points();
            let middles: Vec<u64> = (0..more)
                .map(|place| node(linear.points() + place))
                .collect::<Result<_>>()?;
            match middles.iter().filter(|&&node| node > 0).count() {
                0 => {}
                there if there == more => {
                    nodes.extend(middles);
                    kind = quadratic;
                }
                _ => self.partly += 1,
            }
        }
        let property = if first == 2 { card.whole(1)? } else { 0 };
        self.elements.push(Element {
            number: card.whole(0)?,
            // An element has the property of its own number if it names none.
            property: i64::try_from(property).unwrap_or(0),
            kind,
            nodes,
        });
        Ok(())
    }

    /// The place of a point of a system, which may lie in others.
    fn placed(&self, scan: &Scan<'_>, point: [f64; 3], mut system: u64) -> Result<[f64; 3]> {
        let mut point = Vector3::from(point);
        let mut turns = 0;
        while system != 0 {
            let found = self.systems.get(&system).filter(|_| turns < 100);
            let Some(System { kind, base, points }) = found else {
                return Err(scan.error_with(
                    format!("the coordinate system {system} is not defined by CORD2R, CORD2C or CORD2S, or by itself"),
                    "write the mesh in the basic system",
                ));
            };
            turns += 1;
            let (sin, cos) = point[1].to_radians().sin_cos();
            let local = match kind {
                b'C' => Vector3::new(point[0] * cos, point[0] * sin, point[2]),
                b'S' => {
                    let (sin_phi, cos_phi) = point[2].to_radians().sin_cos();
                    Vector3::new(
                        point[0] * sin * cos_phi,
                        point[0] * sin * sin_phi,
                        point[0] * cos,
                    )
                }
                _ => point,
            };
            let [a, b, c] = points.map(Vector3::from);
            let up = (b - a).try_normalize(0.0).unwrap_or(Vector3::z());
            let across = up
                .cross(&(c - a))
                .try_normalize(0.0)
                .unwrap_or(Vector3::y());
            point = a + across.cross(&up) * local[0] + across * local[1] + up * local[2];
            system = *base;
        }
        Ok(point.into())
    }

    fn build(&mut self, scan: &Scan<'_>) -> Result<Mesh> {
        if self.numbers.is_empty() {
            return Err(scan.error_with(
                "the file has no GRID",
                "give the file with the mesh, or put what it includes beside it",
            ));
        }
        let mut builder = Builder::default();
        let mut numbers = Numbering::default();
        for (&number, &(point, system)) in self.numbers.iter().zip(&self.points) {
            numbers.push(number);
            builder.mesh.points.push(self.placed(scan, point, system)?);
        }
        builder.finish_points(scan, numbers)?;
        let points = builder
            .points
            .take()
            .unwrap_or(Lookup::Dense { first: 1, count: 0 });
        for element in &self.elements {
            let kind = element.kind;
            let corners = kind.shape().corners() as u8;
            let order = (0..corners)
                .map(|a| [a, a])
                .chain(middles(kind).iter().copied());
            let mut nodes = vec![0; kind.points()];
            for (&number, between) in element.nodes.iter().zip(order) {
                let point = points.get(number).ok_or_else(|| {
                    scan.error(format!(
                        "element {} has the node {number}, which does not exist",
                        element.number
                    ))
                })?;
                if let Some(node) = place(kind, between).and_then(|place| nodes.get_mut(place)) {
                    *node = point;
                }
            }
            builder.cell(kind, &nodes, element.number, element.property);
        }
        builder.points = Some(points);
        builder.finish_cells(scan)?;
        Ok(builder.finish())
    }
}

impl Card<'_> {
    fn field(&self, place: usize) -> &str {
        self.fields.get(place).map_or("", String::as_str)
    }

    /// A whole number; 0 where the field is empty.
    fn whole(&self, place: usize) -> Result<u64> {
        match self.field(place) {
            "" => Ok(0),
            text => text
                .parse()
                .map_err(|_| self.refuse(text, "a whole number")),
        }
    }

    /// A number, which may have a sign for its exponent alone, as in 1.5-3; 0 where the field is empty.
    fn real(&self, place: usize) -> Result<f64> {
        let text = self.field(place);
        if text.is_empty() {
            return Ok(0.0);
        }
        let mut plain = text.to_ascii_uppercase().replace('D', "E");
        if !plain.contains('E')
            && let Some(sign) = plain.rfind(['+', '-']).filter(|&sign| sign > 0)
        {
            plain.insert(sign, 'E');
        }
        let value = plain.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| self.refuse(text, "a number"))
    }

    fn refuse(&self, text: &str, what: &str) -> Error {
        self.row
            .error(format!("expected {what} on {}, found {text:?}", self.name))
    }
}
