//! A table of words on coloured backgrounds: rows in families, columns by code and method.

use super::Html;
use super::markup::html;
use crate::text::Text;

/// The results of trials, for finding where something goes wrong.
pub(in crate::report) struct Map {
    pub caption: Text,
    /// Names of the two columns that name a row.
    pub of: [&'static str; 2],
    /// Codes, and the methods of each.
    pub head: Vec<(String, Vec<String>)>,
    /// Families, and the values of each.
    pub families: Vec<(String, Vec<Row>)>,
    /// The meaning of each background.
    pub legend: Vec<(&'static str, &'static str)>,
}

/// A value, with its result in each column.
pub(in crate::report) type Row = (Text, Vec<Option<Spot>>);

/// One word, the class of its background, and its numbers as a tooltip.
pub(in crate::report) struct Spot {
    pub word: String,
    pub class: &'static str,
    pub title: String,
}

impl Map {
    pub fn html(&self) -> Html {
        // A caption inside the table would have its width.
        html! {
            p.cap #map { (self.caption) }
            p.cap { @for (class, words) in &self.legend { span.key { i class=(class) {} (words) } } }
            .scroll {
                table.heat aria-labelledby="map" {
                    thead {
                        tr {
                            td colspan="2" {}
                            @for (code, methods) in &self.head {
                                th.code colspan=(methods.len()) scope="colgroup" { (code) }
                            }
                        }
                        tr {
                            @for name in self.of { th scope="col" { (name) } }
                            @for (k, method) in self.head.iter().flat_map(|(_, of)| of.iter().enumerate()) {
                                th scope="col" class=[(k == 0).then_some("code")] { (method) }
                            }
                        }
                    }
                    @for (family, rows) in &self.families {
                        tbody {
                            @for (k, (value, spots)) in rows.iter().enumerate() {
                                tr {
                                    @if k == 0 { th rowspan=(rows.len()) scope="rowgroup" { (family) } }
                                    th scope="row" { (value) }
                                    @for spot in spots {
                                        @match spot {
                                            Some(Spot { word, class, title }) => td class=(class) title=(title) { (word) },
                                            None => td {},
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::html::markup::visible;

    #[test]
    fn names_cannot_become_markup_and_columns_are_as_many_as_methods() {
        let evil = || "<script>\u{202e}&".to_owned();
        let spot = || {
            Some(Spot {
                word: evil(),
                class: "w1",
                title: "\"".into(),
            })
        };
        let map = Map {
            caption: evil().into(),
            of: ["extreme", "value"],
            head: vec![
                (evil(), vec![evil(), "p1".into()]),
                ("b".into(), vec!["p1".into()]),
            ],
            families: vec![(evil(), vec![(evil().into(), vec![spot(), None, spot()])])],
            legend: vec![("w1", "worse")],
        };
        let html = visible(map.html().as_str());
        assert!(
            !html.contains("<script") && !html.contains('\u{202e}'),
            "{html}"
        );
        assert!(
            html.contains("colspan=\"2\" scope=\"colgroup\"") && html.contains("title=\"&quot;\"")
        );
        assert_eq!(html.matches("<td").count(), 4, "three cells and the corner");
    }
}
