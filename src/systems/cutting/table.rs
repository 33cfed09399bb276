//! Tables of tools and materials: TOML → entries, every value checked. A table has a section for each
//! entry; the built-in ones are such files too. Unknown keys are errors.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;

/// The built-in tools.
pub const TOOLS: &str = include_str!("tools.toml");
/// The built-in materials.
pub const MATERIALS: &str = include_str!("materials.toml");

/// A mill.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Diameter D_c.
    pub diameter_mm: f64,
    /// Number of teeth z_n.
    pub teeth: u32,
    /// How deep it can cut at most.
    pub cutting_length_mm: f64,
    /// Rake angle γ_0.
    pub rake_deg: f64,
    /// Angle κ between cutting edge and feed: 90 of an end mill.
    pub edge_angle_deg: f64,
    /// Depth of cut along its axis, unless told otherwise.
    pub depth_mm: f64,
    /// Width of cut across the feed, unless told otherwise.
    pub width_mm: f64,
}

/// What is cut.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Force on a chip of 1 mm by 1 mm, k_c1.1.
    pub kc11_n_mm2: f64,
    /// Exponent m_c of the chip's thickness.
    pub mc: f64,
}

/// Why there is no such entry.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// The text is no table of this kind.
    #[error("line {line}: {message}")]
    Wrong {
        /// Line of the table, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A value that cannot be.
    #[error("[{entry}] {key} = {value}: {least} to {most} is expected")]
    Range {
        /// The section.
        entry: String,
        /// The key.
        key: &'static str,
        /// What stands there.
        value: f64,
        /// Least value.
        least: f64,
        /// Greatest value.
        most: f64,
    },
    /// There is no such entry.
    #[error("there is no [{name}]; there are {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// Several entries, and none is asked for.
    #[error("there are {known}: say which, as FILE:{first}")]
    Which {
        /// What there is.
        known: String,
        /// The first of them.
        first: String,
    },
}

/// What stands in a table.
pub trait Entry: DeserializeOwned {
    /// Every value with its key, and what it may be.
    fn ranges(&self) -> Vec<(&'static str, f64, [f64; 2])>;
}

impl Entry for Tool {
    fn ranges(&self) -> Vec<(&'static str, f64, [f64; 2])> {
        vec![
            ("diameter_mm", self.diameter_mm, [0.01, 1000.0]),
            ("teeth", f64::from(self.teeth), [1.0, 100.0]),
            ("cutting_length_mm", self.cutting_length_mm, [0.01, 1000.0]),
            ("rake_deg", self.rake_deg, [-45.0, 45.0]),
            ("edge_angle_deg", self.edge_angle_deg, [1.0, 90.0]),
            ("depth_mm", self.depth_mm, [1e-4, self.cutting_length_mm]),
            ("width_mm", self.width_mm, [1e-4, self.diameter_mm]),
        ]
    }
}

impl Entry for Material {
    fn ranges(&self) -> Vec<(&'static str, f64, [f64; 2])> {
        vec![("kc11_n_mm2", self.kc11_n_mm2, [1.0, 1e5]), ("mc", self.mc, [0.0, 0.9])]
    }
}

/// The names of a table's entries, in order; none if it cannot be read.
pub fn names(text: &str) -> Vec<String> {
    text.parse::<toml::Table>().map(|table| table.keys().cloned().collect()).unwrap_or_default()
}

/// An entry by its name; without a name the only one. Gives its name too.
///
/// # Errors
/// When the table is wrong anywhere, or has no such entry.
pub fn entry<T: Entry>(text: &str, name: Option<&str>) -> Result<(String, T), TableError> {
    let mut entries: BTreeMap<String, T> = toml::from_str(text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let message = error.message().to_owned();
        TableError::Wrong { line: 1 + before.matches('\n').count(), message }
    })?;
    for (entry, value) in &entries {
        for (key, value, [least, most]) in value.ranges() {
            if !(least..=most).contains(&value) {
                return Err(TableError::Range { entry: entry.clone(), key, value, least, most });
            }
        }
    }
    let known = entries.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    if let Some(name) = name {
        let found = entries.remove(name).map(|found| (name.to_owned(), found));
        return found.ok_or_else(|| TableError::Unknown { name: name.to_owned(), known });
    }
    match (entries.len(), entries.pop_first()) {
        (1, Some(only)) => Ok(only),
        (_, Some((first, _))) => Err(TableError::Which { known, first }),
        (_, None) => Err(TableError::Wrong { line: 1, message: "the table is empty".into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_tables_are_right() {
        for name in names(TOOLS) {
            entry::<Tool>(TOOLS, Some(&name)).unwrap();
        }
        for name in names(MATERIALS) {
            entry::<Material>(MATERIALS, Some(&name)).unwrap();
        }
        assert!(names(TOOLS).len() > 1 && names(MATERIALS).len() > 1);
    }

    #[test]
    fn what_is_wrong_in_a_table_is_told() {
        let wrong = |text: &str, name: Option<&str>| {
            entry::<Material>(text, name).map(|(name, _)| name).unwrap_err().to_string()
        };
        assert_eq!(
            wrong("[a]\nkc11_n_mm2 = 700.0\nmc = 1.2", None),
            "[a] mc = 1.2: 0 to 0.9 is expected"
        );
        assert!(wrong("[a]\nkc11_n_mm2 = 700.0", None).starts_with("line 1: missing field `mc`"));
        assert!(
            wrong("[a]\nkc11_n_mm2 = 700.0\nmc = 0.2\nm = 1", None).starts_with("line 4: unknown")
        );
        let two = "[a]\nkc11_n_mm2 = 700.0\nmc = 0.2\n[b]\nkc11_n_mm2 = 700.0\nmc = 0.2";
        assert_eq!(wrong(two, None), "there are a, b: say which, as FILE:a");
        assert_eq!(wrong(two, Some("c")), "there is no [c]; there are a, b");
        assert_eq!(entry::<Material>(two, Some("b")).unwrap().0, "b");
        assert_eq!(wrong("", None), "line 1: the table is empty");
    }
}
