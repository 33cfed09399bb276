//! A profile's text → its values with their places, to tell where each value of a machine is from.

use toml::de::{DeTable, DeValue};

use super::keys::line_of;

/// A value as a text has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Its key with those of its tables: `axes.X.travel_mm`.
    pub path: String,
    /// As it stands there.
    pub value: String,
    /// Its line, from 1.
    pub line: u32,
}

/// All values of a text, in their order; of a text with errors those that can be read.
pub fn written(text: &str) -> Vec<Written> {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut found = Vec::new();
    walk(text, "", root.get_ref(), &mut found);
    found.sort_by_key(|(at, _)| *at);
    found.into_iter().map(|(_, written)| written).collect()
}

fn walk(text: &str, prefix: &str, table: &DeTable<'_>, found: &mut Vec<(usize, Written)>) {
    for (key, value) in table {
        let path = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => walk(text, &format!("{path}."), inner, found),
            _ => {
                let span = value.span();
                let line = line_of(text, span.start);
                let value = text.get(span.clone()).unwrap_or_default().to_owned();
                found.push((span.start, Written { path, value, line }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_in_their_order_with_their_lines() {
        let text = "name = \"a\"\n\n[bus]\nnodes = { X = 1,\n Y = 2 }\nids = [1, 2]\n";
        let found: Vec<_> = written(text);
        let found = found.iter().map(|w| (w.path.as_str(), w.value.as_str(), w.line));
        let expected = [
            ("name", "\"a\"", 1),
            ("bus.nodes.X", "1", 4),
            ("bus.nodes.Y", "2", 5),
            ("bus.ids", "[1, 2]", 6),
        ];
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }
}
