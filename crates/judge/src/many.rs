//! Combines comparisons of several times or files.

use serde::Serialize;

use faceoff_mesh::field::Results;

use crate::{ComparedField, Comparison, Verdict};

/// The result of comparing two series, or the files of two folders.
#[derive(Debug, Serialize)]
pub struct Comparisons {
    /// The worst of the parts.
    pub verdict: Verdict,
    /// The name of the first series or folder.
    pub a: String,
    /// The name of the second.
    pub b: String,
    /// One per time, or per file, in order.
    pub parts: Vec<Part>,
    /// What was left out on request.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The index of the part that is farthest from agreement, with its first result, whose differences are kept.
    #[serde(skip)]
    pub farthest: Option<(usize, Box<Results>)>,
}

/// One time, or one file.
#[derive(Debug, Serialize)]
pub struct Part {
    /// The path of the file, relative to either folder; empty if one file is compared with one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The time, if the results have times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// The verdict of this part only.
    pub verdict: Verdict,
    /// Why nothing could be compared: there is no counterpart, or a file cannot be read. `None` if it was compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The comparison; `None` if it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
}

impl Comparisons {
    /// Without parts the verdict is undetermined.
    pub fn new(a: String, b: String) -> Self {
        Comparisons {
            verdict: Verdict::Undetermined,
            a,
            b,
            parts: Vec::new(),
            notes: Vec::new(),
            farthest: None,
        }
    }

    /// The parts agree together only if each does. The differences of the part farthest from agreement are kept, with its first result.
    pub fn add(&mut self, mut part: Part, of_a: Option<Box<Results>>) {
        self.verdict = match self.parts.is_empty() {
            true => part.verdict,
            false => self.verdict.max(part.verdict),
        };
        let before = self.farthest.as_ref().map(|(k, _)| *k);
        let factor = part.factor();
        match of_a.filter(|_| before.is_none_or(|k| factor > self.parts[k].factor())) {
            Some(of_a) => {
                if let Some(k) = before {
                    self.parts[k].forget();
                }
                self.farthest = Some((self.parts.len(), of_a));
            }
            None => part.forget(),
        }
        self.parts.push(part);
    }

    /// The part and field whose difference is largest relative to the tolerance.
    pub fn worst(&self) -> Option<(&Part, &ComparedField)> {
        let fields = self.parts.iter().flat_map(|part| {
            let fields = part.comparison.iter().flat_map(|of| &of.fields);
            fields.map(move |field| (part, field))
        });
        fields.max_by(|(_, f), (_, g)| f.factor().total_cmp(&g.factor()))
    }
}

impl Part {
    /// A part that could not be compared.
    pub fn failed(name: String, time: Option<f64>, reason: String) -> Self {
        Part {
            name,
            time,
            verdict: Verdict::Undetermined,
            reason: Some(reason),
            comparison: None,
        }
    }

    /// A part that was judged.
    pub fn compared(name: String, time: Option<f64>, comparison: Comparison) -> Self {
        Part {
            name,
            time,
            verdict: comparison.verdict,
            reason: None,
            comparison: Some(comparison),
        }
    }

    /// The ratio for its field with the largest difference relative to the tolerance.
    fn factor(&self) -> f64 {
        let fields = self.comparison.iter().flat_map(|of| &of.fields);
        fields.map(ComparedField::factor).fold(0.0, f64::max)
    }

    fn forget(&mut self) {
        if let Some(comparison) = &mut self.comparison {
            comparison.differences = Vec::new();
            comparison.found = None;
        }
    }

    /// The name of the part in reports.
    pub fn title(&self) -> String {
        // Times are printed rounded: 0.30000000000000004 is 0.3.
        let time = self.time.map(|time| {
            let short: f64 = format!("{time:.9e}").parse().unwrap_or(time);
            format!("time {short}")
        });
        match (self.name.is_empty(), time) {
            (false, None) => self.name.clone(),
            (false, Some(time)) => format!("{}, {time}", self.name),
            (true, time) => time.unwrap_or_default(),
        }
    }
}

impl ComparedField {
    /// The difference of a field divided by its tolerance; infinite if it is unknown.
    pub fn factor(&self) -> f64 {
        match self.field.max_rel / self.field.tolerance {
            factor if factor.is_nan() && self.field.verdict == Verdict::Agree => 0.0,
            factor if factor.is_nan() => f64::INFINITY,
            factor => factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Settings, compare_results};
    use faceoff_mesh::io;

    #[test]
    fn what_is_missing_is_no_pass_and_the_worst_part_is_named() {
        let table = |name: &str, text: &str| {
            io::read_results(name.as_ref(), text.as_bytes(), None).unwrap()
        };
        let part = |time: f64, value: &str| {
            let b = table("b.csv", &format!("vertex,u\n0,1\n1,{value}\n"));
            let a = table("a.csv", "vertex,u\n0,1\n1,2\n");
            Part::compared(
                String::new(),
                Some(time),
                compare_results(&a, &b, &Settings::default()).unwrap(),
            )
        };
        let of = |parts: Vec<Part>| {
            let mut all = Comparisons::new("a".into(), "b".into());
            for part in parts {
                let of_a = Results {
                    source: part.title(),
                    ..Results::default()
                };
                let is_compared = part.comparison.is_some();
                all.add(part, is_compared.then(|| Box::new(of_a)));
            }
            all
        };
        assert_eq!(of(vec![part(0.0, "2")]).verdict, Verdict::Agree);
        assert_eq!(of(vec![]).verdict, Verdict::Undetermined);
        let missing = Part::failed(String::new(), Some(1.0), "only a has it".into());
        assert_eq!(
            of(vec![part(0.0, "2"), missing]).verdict,
            Verdict::Undetermined
        );
        let all = of(vec![part(0.0, "2"), part(0.5, "2.5"), part(1.0, "2.1")]);
        assert_eq!(all.verdict, Verdict::Disagree);
        assert_eq!(all.worst().unwrap().0.time, Some(0.5));
        let (k, of_a) = all.farthest.as_ref().unwrap();
        assert_eq!((*k, &*of_a.source), (1, "time 0.5"));
        let kept = |part: &Part| !part.comparison.as_ref().unwrap().differences.is_empty();
        assert_eq!(
            all.parts.iter().map(kept).collect::<Vec<_>>(),
            [false, true, false]
        );
        let nan = of(vec![part(0.5, "2.5"), part(1.0, "nan")]);
        assert_eq!(nan.worst().unwrap().0.title(), "time 1");
    }
}
