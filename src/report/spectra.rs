//! Spectra in a face-off file: common eigenvalues, those that only one code has, modes as spaces.

use super::face_off::{NOT_JUDGED, level};
use super::model::{Block, Cell, Table, TestCase, joined, table};
use crate::campaigns::face_off::{OfResidual, OfSpectra, OfSpectrum, short};
use crate::text::number::{number, size};
use crate::text::{Text, text};
use faceoff_judge::relative;

/// The tables of one spectrum; the modal assurance criterion of the pair that is farthest from agreement is only on the page.
pub(super) fn blocks<'a>(of: &OfSpectrum) -> Vec<Block<'a>> {
    let mut all = vec![Block::Titled(
        text!("Spectrum `{of.spectrum}`"),
        rows_table(of.pairs.iter().chain(&of.exact)),
    )];
    if !of.residuals.is_empty() {
        let words = text!("How well each code solves the eigenproblem, in our matrices");
        all.push(Block::Titled(words, residuals_table(&of.residuals)));
    }
    let judged = of.pairs.iter().filter(|row| row.judged);
    if let Some(row) = judged.max_by_key(|row| row.verdict) {
        let words = text!(
            "Eigenvalues of `{of.spectrum}`, {row.a} – {row.b}{}",
            row.level.at()
        );
        all.push(Block::Titled(words, values_table(row)));
        if !row.assurance.is_empty() {
            let caption = text!(
                "Modal assurance criterion of `{of.spectrum}`: modes of {row.a} in rows, of {row.b} in columns"
            );
            let table = assurance_table(row);
            let folded = Block::folded(caption, "", vec![table.into()]);
            all.push(Block::Page(vec![folded]));
        }
    }
    all
}

fn rows_table<'a>(rows: impl Iterator<Item = &'a OfSpectra>) -> Table {
    let verdict = |row: &OfSpectra| match row.judged {
        true => Cell::from(row.verdict),
        false => NOT_JUDGED.into(),
    };
    let sine = |row: &OfSpectra| {
        let sines = row.spaces.iter().filter_map(|space| space.sine);
        sines.max_by(f64::total_cmp)
    };
    let kernel = |row: &OfSpectra| match row.kernel {
        [0, 0] => None,
        [a, b] if a == b => Some(a.to_string()),
        [a, b] => Some(format!("{a} and {b}")),
    };
    table!("", rows, |row|
        "codes" => format!("{} – {}", row.a, row.b),
        "n" => level(&row.level),
        "the same" => row.values.len(),
        "left out as kernel" => kernel(row),
        "relative" => row.relative,
        "allowed" => Cell::size(row.tolerance),
        "spaces" => (!row.spaces.is_empty()).then_some(row.spaces.len()),
        "largest sine" => sine(row).map(Cell::size),
        "verdict" => verdict(row),
        "remark" => &row.reason,
    )
    .known()
}

fn residuals_table(all: &[OfResidual]) -> Table {
    table!("", all, |row|
        "code" => &row.code,
        "n" => level(&row.level),
        "pairs" => row.pairs,
        "largest residual" => row.residual.map(Cell::size),
        "of" => row.value.map(|value| Cell::number(value, number(value, 6))),
        "where held" => row.dirichlet.map(Cell::size),
        "allowed" => Cell::size(row.allowed),
        "verdict" => row.verdict,
        "remark" => &row.reason,
    )
    .known()
}

/// Every value of either code, with the space that its mode belongs to.
fn values_table(of: &OfSpectra) -> Table {
    let alone = |k: usize| {
        let all = of.alone[k].iter().chain(&of.beyond[k]);
        all.map(move |value| (k, *value))
    };
    let mut rows: Vec<[Option<f64>; 2]> = of.values.iter().map(|pair| pair.map(Some)).collect();
    rows.extend(alone(0).chain(alone(1)).map(|(k, value)| {
        let mut row = [None; 2];
        row[k] = Some(value);
        row
    }));
    rows.sort_by(|p, q| {
        let key = |row: &[Option<f64>; 2]| row[0].or(row[1]).unwrap_or_default();
        key(p).total_cmp(&key(q))
    });
    let space = |row: &[Option<f64>; 2]| {
        let value = row[0].filter(|_| row[1].is_some())?;
        let mut spaces = of.spaces.iter();
        spaces.find(|space| (space.values[0]..=space.values[1]).contains(&value))
    };
    let digits = |value: Option<f64>| value.map(|value| Cell::number(value, number(value, 12)));
    table!("", rows, |row|
        format!("a: {}", of.a) => digits(row[0]),
        format!("b: {}", of.b) => digits(row[1]),
        "relative" => row[0].zip(row[1]).map(|(a, b)| relative(a, b)),
        "modes" => space(&row).map(|space| space.dimension),
        "sine" => space(&row).and_then(|space| space.sine).map(Cell::size),
    )
    .known()
}

fn assurance_table(of: &OfSpectra) -> Table {
    let columns = of.assurance.first().map_or(0, Vec::len);
    let head = std::iter::once("mode".to_owned()).chain((1..=columns).map(|j| j.to_string()));
    let rows = of.assurance.iter().zip(1..).map(|(row, i): (_, usize)| {
        let cells = row.iter().map(|of| Cell::fixed(*of, 3));
        std::iter::once(Cell::from(i))
            .chain(cells)
            .collect::<Vec<Cell>>()
    });
    Table::new("", head.collect::<Vec<_>>()).with(rows)
}

/// The fault of a spectrum, or how well it agrees.
pub(super) fn words(of: &OfSpectrum) -> Vec<Text> {
    let rows = of.pairs.iter().chain(&of.exact).filter(|row| row.judged);
    let mut wrong = rows.clone().filter(|row| !row.verdict.passes());
    let unsolved = of.residuals.iter().rfind(|row| !row.verdict.passes());
    if let (None, Some(row)) = (wrong.clone().next(), unsolved) {
        return vec![text!(
            "`{of.spectrum}`, {row.code}{}: {row.reason}.",
            row.level.at()
        )];
    }
    match wrong.next_back() {
        Some(row) => {
            let against = match &*row.b {
                "exact" => row.a.clone(),
                b => format!("{} – {b}", row.a),
            };
            vec![text!(
                "`{of.spectrum}`, {against}{}: {row.reason}.",
                row.level.at()
            )]
        }
        None => {
            let largest = rows.map(|row| row.relative).fold(0.0, f64::max);
            vec![text!(
                "The eigenvalues of `{of.spectrum}` differ by **{}** of them at most.",
                size(largest)
            )]
        }
    }
}

/// One case for each row that is judged.
pub(super) fn cases(name: &str, of: &OfSpectrum) -> Vec<TestCase> {
    let rows = of.pairs.iter().chain(&of.exact).filter(|row| row.judged);
    let of_residuals = of.residuals.iter().map(|row| {
        let about = format!(
            "{}, residual of {}{}",
            of.spectrum,
            row.code,
            row.level.at()
        );
        TestCase::new(name, about, row.verdict, row.reason.clone())
    });
    let case = |row: &OfSpectra| {
        let about = format!("{}, {} – {}{}", of.spectrum, row.a, row.b, row.level.at());
        TestCase::new(name, about, row.verdict, row.reason.clone())
    };
    rows.map(case).chain(of_residuals).collect()
}

/// The values that one code has and another has not, in a few words.
pub(super) fn claim(of: &OfSpectrum) -> Option<Text> {
    let rows = of.exact.iter().chain(&of.pairs).filter(|row| row.judged);
    let mut found = rows.filter(|row| !row.alone.iter().all(Vec::is_empty));
    let row = found.next()?;
    let k = usize::from(row.alone[0].is_empty());
    let has = [&row.a, &row.b][k];
    let list = joined(row.alone[k].iter().map(|x| short(*x).to_string()), ", ");
    Some(match (&**has, &*row.b) {
        ("exact", _) => text!("**{row.a}** misses {list} in `{of.spectrum}`"),
        (_, "exact") => text!("**{has}** has the spurious {list} in `{of.spectrum}`"),
        _ => text!(
            "**{has}** has {list} in `{of.spectrum}`, and {} has not",
            [&row.b, &row.a][k]
        ),
    })
}
