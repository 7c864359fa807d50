//! The provenance of a report.

use std::fs;
use std::sync::OnceLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::model::{Report, count};
use crate::engine::{Machine, typed};
use crate::text::number::number;
use crate::text::{Text, text};

/// When the command began.
static BEGUN: OnceLock<Instant> = OnceLock::new();

/// Starts the clock for the time that the page reports.
pub(super) fn begin() {
    BEGUN.get_or_init(Instant::now);
}

/// The provenance on a page.
pub(super) struct Provenance {
    /// The command as it was typed.
    pub command: String,
    /// The short form.
    pub line: Vec<Text>,
    /// All data, by name.
    pub all: Vec<(Text, Text)>,
}

/// Program, command, machine, date, engines and digests.
pub(super) fn provenance(report: &Report) -> Provenance {
    let machine = Machine::here();
    let build = match machine.optimised {
        true => "",
        false => ", built without optimisation",
    };
    let memory = machine.memory_mb;
    let memory = memory.map_or(String::new(), |mb| format!(", {:.0} GB", mb / 1024.0));
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let processor = match &*machine.processor {
        "" => "unknown processor",
        known => known,
    };
    let (name, system, threads) = (host.trim(), machine.system, machine.threads);
    let (date, took) = (
        now(),
        BEGUN.get().map(|begun| took(begun.elapsed().as_secs_f64())),
    );
    let engine = |(name, version): &(String, String)| text!("{name} **{version}**");
    let engines = Text::joined(report.engines.iter().map(engine), ", ");
    let mut line = vec![Text::from(&date)];
    line.extend(took.iter().map(|took| text!("took {took}")));
    line.push(text!("faceoff **{machine.version}**"));
    line.extend((!engines.is_empty()).then(|| engines.clone()));
    line.push(text!(
        "on **{name}**, {system}, {}",
        count(threads, "thread")
    ));
    let mut all: Vec<(Text, Text)> = vec![(
        "faceoff".into(),
        format!("{}{build}", machine.version).into(),
    )];
    let host = format!(
        "{name} ({system} {}, {processor}, {}{memory})",
        kernel.trim(),
        count(threads, "thread")
    );
    all.extend([("host".into(), host.into()), ("date".into(), date.into())]);
    all.extend(took.map(|took| ("took".into(), took.into())));
    all.extend((!engines.is_empty()).then(|| ("engines".into(), engines)));
    let inputs = report.inputs.iter().map(|path| {
        let digest = faceoff_mesh::file::read(path)
            .map_or("it cannot be read again".into(), |bytes| {
                blake3::hash(&bytes).to_hex()[..16].to_owned()
            });
        (path.display().to_string(), digest)
    });
    let digests: Vec<(String, String)> = report.digests.iter().cloned().chain(inputs).collect();
    let mut known: Vec<&str> = digests
        .iter()
        .map(|(_, digest)| &**digest)
        .filter(|d| !d.contains(' '))
        .collect();
    known.dedup();
    if let [first, rest @ ..] = &known[..] {
        let more = if rest.is_empty() { "" } else { ", …" };
        line.push(text!("digest `{}`{more}", &first[..first.len().min(8)]));
    }
    all.extend(
        digests
            .into_iter()
            .map(|(name, digest)| (format!("digest of {name}").into(), text!("`{digest}`"))),
    );
    Provenance {
        command: format!("faceoff {}", typed()),
        line,
        all,
    }
}

/// `0.4 s`, `4 min 24 s`
fn took(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{} s", number(s, 2)),
        s => format!("{:.0} min {:.0} s", (s / 60.0).floor(), s % 60.0),
    }
}

/// The date, as [`date`] writes it.
pub(super) fn now() -> String {
    date(SystemTime::now())
}

/// `2026-11-22 04:02 UTC`
fn date(now: SystemTime) -> String {
    let since = now.duration_since(UNIX_EPOCH);
    let seconds = since.map_or(0, |since| since.as_secs());
    let (days, minutes) = ((seconds / 86_400) as i64, seconds % 86_400 / 60);
    // From days since 1970 to the Gregorian calendar, by eras of 400 years that begin in March (H. Hinnant).
    let day = days + 719_468;
    let (era, of_era) = (day.div_euclid(146_097), day.rem_euclid(146_097));
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year + 400 * era + i64::from(month <= 2);
    format!(
        "{year}-{month:02}-{day:02} {:02}:{:02} UTC",
        minutes / 60,
        minutes % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_795_320_120, "2026-11-22 04:02 UTC"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
