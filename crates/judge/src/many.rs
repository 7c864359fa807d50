//! Comparisons of several times or files, as one.

use serde::Serialize;

use crate::{ComparedField, Comparison, Verdict};

/// What comparisons of two series, or of the files of two folders, find.
#[derive(Debug, Serialize)]
pub struct Comparisons {
    pub verdict: Verdict,
    pub a: String,
    pub b: String,
    pub parts: Vec<Part>,
    /// What was left out on purpose.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// One time, or one file.
#[derive(Debug, Serialize)]
pub struct Part {
    /// The file, below either folder; empty where one file is compared with one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    pub verdict: Verdict,
    /// Why nothing could be compared: a partner is missing, or a file cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
}

impl Comparisons {
    /// All agree only if each does, and if there is one.
    pub fn new(a: String, b: String, parts: Vec<Part>) -> Self {
        let verdicts = parts.iter().map(|part| part.verdict);
        Comparisons {
            verdict: verdicts.max().unwrap_or(Verdict::Undetermined),
            a,
            b,
            parts,
            notes: Vec::new(),
        }
    }

    /// The part and its field that is farthest beyond its tolerance, or nearest to it where all agree.
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

    /// A part that was compared; where its differences are is not kept.
    pub fn compared(name: String, time: Option<f64>, mut comparison: Comparison) -> Self {
        comparison.differences = Vec::new();
        Part {
            name,
            time,
            verdict: comparison.verdict,
            reason: None,
            comparison: Some(comparison),
        }
    }

    /// What it is called.
    pub fn title(&self) -> String {
        match (self.name.is_empty(), self.time) {
            (false, None) => self.name.clone(),
            (false, Some(time)) => format!("{}, time {time}", self.name),
            (true, time) => format!("time {}", time.unwrap_or_default()),
        }
    }
}

impl ComparedField {
    /// How many times its tolerance a field differs; infinite where that is not known.
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
        let of = |parts| Comparisons::new("a".into(), "b".into(), parts);
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
        let nan = of(vec![part(0.5, "2.5"), part(1.0, "nan")]);
        assert_eq!(nan.worst().unwrap().0.title(), "time 1");
    }
}
