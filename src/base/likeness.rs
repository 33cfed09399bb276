//! A misspelt word → what was most likely meant.

/// How alike names are at least (Jaro and Winkler).
const LEAST: f64 = 0.8;

/// The candidate that a misspelt word most likely means, if one is near enough.
pub fn nearest<'c>(word: &str, candidates: impl Iterator<Item = &'c str>) -> Option<&'c str> {
    let likeness = |name: &str| strsim::jaro_winkler(&word.to_lowercase(), &name.to_lowercase());
    candidates
        .map(|name| (likeness(name), name))
        .filter(|(likeness, _)| *likeness > LEAST)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, name)| name)
}
