//! A table of words on coloured ground: rows in families, columns by code and method.

use super::Html;
use super::markup::{element, leaf, prose, text};
use crate::text::Text;

/// What became of trials, for those who look for where something goes wrong.
pub(in crate::report) struct Map {
    pub caption: Text,
    /// Names of the two columns that name a row.
    pub of: [&'static str; 2],
    /// Codes, and the methods of each.
    pub head: Vec<(String, Vec<String>)>,
    /// Families, and the values of each.
    pub families: Vec<(String, Vec<Row>)>,
    /// What each ground means.
    pub legend: Vec<(&'static str, &'static str)>,
}

/// A value, and what became of it in each column.
pub(in crate::report) type Row = (Text, Vec<Option<Spot>>);

/// One word, the class of its ground, and its numbers where one points.
pub(in crate::report) struct Spot {
    pub word: String,
    pub class: &'static str,
    pub title: String,
}

impl Map {
    pub fn html(&self) -> Html {
        let span = |count: usize| count.to_string();
        let codes = self.head.iter().map(|(code, methods)| {
            let span = span(methods.len());
            leaf(
                "th",
                &[
                    ("colspan", &*span),
                    ("scope", "colgroup"),
                    ("class", "code"),
                ],
                code,
            )
        });
        let blank = element("td", &[("colspan", "2")], Html::default());
        let codes = element("tr", &[], [blank].into_iter().chain(codes));
        let head = |name: &str, class| leaf("th", &[("scope", "col"), ("class", class)], name);
        let named = self.of.map(|name| head(name, ""));
        let methods = self.head.iter().flat_map(|(_, methods)| {
            let class = |k| if k == 0 { "code" } else { "" };
            methods
                .iter()
                .enumerate()
                .map(move |(k, m)| head(m, class(k)))
        });
        let names = element("tr", &[], named.into_iter().chain(methods));
        let bodies = self.families.iter().map(|(family, rows)| {
            let span = span(rows.len());
            let lines = rows.iter().enumerate().map(|(k, (value, spots))| {
                let family = (k == 0)
                    .then(|| leaf("th", &[("rowspan", &*span), ("scope", "rowgroup")], family));
                let value = element("th", &[("scope", "row")], prose(value));
                let spots = spots.iter().map(|spot| match spot {
                    Some(Spot { word, class, title }) => {
                        leaf("td", &[("class", class), ("title", title)], word)
                    }
                    None => element("td", &[], Html::default()),
                });
                element("tr", &[], family.into_iter().chain([value]).chain(spots))
            });
            element("tbody", &[], lines)
        });
        let bodies: Html = bodies.collect();
        let legend = self.legend.iter().map(|(class, words)| {
            let ground = element("i", &[("class", class)], Html::default());
            element("span", &[("class", "key")], [ground, text(words)])
        });
        let legend = element("p", &[("class", "cap")], legend);
        let head = element("thead", &[], [codes, names]);
        // A caption in the table would be as wide as that.
        let caption = element(
            "p",
            &[("class", "cap"), ("id", "map")],
            prose(&self.caption),
        );
        let about = [("class", "heat"), ("aria-labelledby", "map")];
        let table = element("table", &about, [head, bodies]);
        Html::from([
            caption,
            legend,
            element("div", &[("class", "scroll")], table),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let html = map.html();
        let html = html.as_str();
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
